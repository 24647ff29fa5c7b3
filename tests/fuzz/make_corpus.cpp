// Writes the first inputs of the corpora: argument, the folder `corpus`. What libFuzzer finds is added to them by hand.
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include "drivers/synthetic/eye_image.hpp"
#include "protocol/sphere.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"
#include "tests/drivers/usb/psvr2_encode.hpp"

namespace {

using namespace fovea;
using Bytes = std::vector<std::uint8_t>;
std::filesystem::path folder;

void write(const std::string& target, const std::string& name, const Bytes& bytes) {
    std::filesystem::create_directories(folder / target);
    std::ofstream(folder / target / name, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

template <class T>
void add(Bytes& to, const T& value) {
    const auto* p = reinterpret_cast<const std::uint8_t*>(&value);
    to.insert(to.end(), p, p + sizeof value);
}
void add(Bytes& to, const Bytes& more) { to.insert(to.end(), more.begin(), more.end()); }

void hid() {
    for (const tests::Shape& shape : tests::shapes()) {
        write("report_descriptor", shape.name, shape.descriptor);
        const auto descriptor = drivers::hid::parse_report_descriptor(shape.descriptor).value();
        Bytes all;
        add(all, static_cast<std::uint16_t>(shape.descriptor.size()));
        add(all, shape.descriptor);
        for (const auto& r : descriptor.reports)
            if (r.kind == drivers::hid::ReportKind::feature) {
                const Bytes f = tests::encode_feature(descriptor, r.id, 120);
                if (f.empty() || f.size() > 127) continue;
                all.push_back(static_cast<std::uint8_t>(0x80 | f.size()));
                add(all, f);
            }
        for (int i = 0; i < 3; ++i) {
            tests::Truth t;
            t.gaze_x = 0.1 * i, t.gaze_y = 0.05 * i, t.left[0] = 0.22, t.right[0] = 0.28, t.left[2] = t.right[2] = 0.6, t.time_s = i;
            const Bytes r = tests::encode_tracking(descriptor, t);
            all.push_back(static_cast<std::uint8_t>(r.size()));
            add(all, r);
        }
        write("hid_report", shape.name, all);
    }
}

void usb() {
    tests::Psvr2Truth t;
    t.left = t.right = t.combined = from_azimuth_elevation<HeadFrame>({0.2, 0.1});
    const auto packet = tests::encode_psvr2(t);
    Bytes whole, torn;
    add(whole, static_cast<std::uint16_t>(packet.size()));
    whole.insert(whole.end(), packet.begin(), packet.end());
    add(torn, static_cast<std::uint16_t>(200));
    torn.insert(torn.end(), packet.begin(), packet.begin() + 200);
    add(torn, static_cast<std::uint16_t>(packet.size() - 200));
    torn.insert(torn.end(), packet.begin() + 200, packet.end());
    add(torn, whole);
    write("usb_packet", "whole", whole);
    write("usb_packet", "torn", torn);
}

// A camera's answers, from the first byte of each structure on.
template <class T>
void answer(Bytes& to, const T& value, std::size_t bytes = sizeof(T)) {
    bytes = std::min<std::size_t>(bytes, 255);
    to.push_back(0);
    to.push_back(static_cast<std::uint8_t>(bytes));
    const auto* p = reinterpret_cast<const std::uint8_t*>(&value);
    to.insert(to.end(), p, p + bytes);
}
void refuse(Bytes& to, std::uint8_t how) { to.push_back(how); }

void camera() {
    for (const std::uint32_t fourcc : {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG})
        for (const std::uint32_t memory : {V4L2_MEMORY_MMAP, V4L2_MEMORY_USERPTR, V4L2_MEMORY_DMABUF}) {
            Bytes b = {2};
            v4l2_capability cap{};
            cap.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
            answer(b, cap);
            v4l2_fmtdesc f{};
            f.pixelformat = fourcc;
            answer(b, f);
            refuse(b, 0xF4);
            v4l2_format format{};
            format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
            format.fmt.pix = {64, 48, fourcc, V4L2_FIELD_NONE, 0, 0, 0, 0, 0, {0}, 0, 0};
            for (int i = 0; i < 2; ++i) answer(b, format, 64);
            v4l2_streamparm parm{};
            for (int i = 0; i < 2; ++i) answer(b, parm, 8);
            if (memory != V4L2_MEMORY_MMAP) refuse(b, 0xF4);
            if (memory == V4L2_MEMORY_DMABUF) refuse(b, 0xF4);
            v4l2_requestbuffers r{};
            r.count = 2;
            answer(b, r, 4);
            v4l2_buffer v{};
            v.length = 64 * 48 * 2;
            for (v.index = 0; v.index < 2; ++v.index) {
                if (memory == V4L2_MEMORY_MMAP) answer(b, v);
                answer(b, v, 0);
            }
            answer(b, v, 0);   // starts
            for (std::uint32_t i = 0; i < 6; ++i) {
                v.index = i % 2;
                v.sequence = i;
                v.bytesused = 64 * 48 * 2;
                v.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
                answer(b, v);
                refuse(b, 0xF1);
                answer(b, v, 0);
            }
            write("v4l2", "format" + std::to_string(fourcc % 97) + "_memory" + std::to_string(memory), b);
        }
}

void pupil() {
    drivers::synthetic::EyeImageScene s;
    s.width = s.height = 64;
    s.pupil_x = 30, s.pupil_y = 33, s.pupil_a = 8, s.pupil_b = 7, s.glints = 1, s.noise = 3;
    const Bytes open = drivers::synthetic::render_eye(s);
    s.upper_lid = 1, s.lashes = 15;
    const Bytes closed = drivers::synthetic::render_eye(s);
    for (std::uint8_t preset = 0; preset < 4; ++preset)
        for (const bool shut : {false, true}) {
            Bytes b = {preset, 40, 40, 0, 0, 1};
            add(b, shut ? closed : open);
            write("pupil", std::string(shut ? "closed" : "open") + std::to_string(preset), b);
        }
    write("pupil", "checks", {2, 90, 20, 0, 0, 9, 0, 255, 0, 255, 30, 200});
    write("pupil", "no_jpeg", {2, 40, 40, 0, 0, 0, 0xFF, 0xD8, 0xFF, 0xE0, 0, 16, 'J', 'F', 'I', 'F', 0});
}

// Every format, hint and kind of factor once; the rest of each is rectangles of odd bits.
void extrapolation() {
    constexpr std::uint8_t kRectangles[] = {1, 9, 12, 5, 5, 0, 0, 0xC0, 0x7F, 0, 30, 20, 9, 3, 0, 0, 0x80, 0x7F, 1, 40, 33, 1, 1, 1, 0, 0, 0, 1, 50, 9, 14, 14, 0xFF, 0xFB, 0xFF, 0x7B};
    for (std::uint8_t format = 0; format < 7; ++format)
        for (std::uint8_t hint = 0; hint < 4; ++hint) {
            const auto flags = static_cast<std::uint8_t>(std::array<int, 4>{0, 4, 8 + 16, 8 + 16 + 32}[hint] + (format + hint) % 4 + (format % 2 == 0 ? 128 : 0));
            Bytes b = {static_cast<std::uint8_t>(63 + format), static_cast<std::uint8_t>(47 + 5 * hint), format, flags, static_cast<std::uint8_t>((format + 2 * hint) % 9)};
            add(b, Bytes{1, 2, 2, 3, static_cast<std::uint8_t>(20 + 3 * hint), static_cast<std::uint8_t>(256 - 11)});
            if (format > 2) b.push_back(static_cast<std::uint8_t>(format + hint));
            if (flags & 8) add(b, Bytes{static_cast<std::uint8_t>(format % 3), 3, 40, 0, 5, 4, 4, 90, 1, 1, 1, 6, 0, 2, 3, 0, 5});
            add(b, Bytes(std::begin(kRectangles), std::end(kRectangles)));
            write("extrapolation", "format" + std::to_string(format) + "_hint" + std::to_string(hint), b);
        }
    write("extrapolation", "one_pixel", {0, 0, 5, 128, 0, 0, 0, 0, 0, 8, 8, 6, 1, 0, 0, 0, 0, 9, 9, 9, 9});
    write("extrapolation", "still", {69, 69, 0, 2, 0, 0, 0, 0, 0, 0, 0});
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    folder = argv[1];
    hid();
    usb();
    camera();
    pupil();
    extrapolation();
    return 0;
}
