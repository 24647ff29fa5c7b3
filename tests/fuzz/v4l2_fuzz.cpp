// A camera whose driver answers anything: negotiation, buffers, frames, conversion to grey.
//
// The input is what the driver answers, call by call: a byte that says success or which errno, then as many bytes of
// the call's structure as the next byte says (the rest stays as it was asked for).
#include <algorithm>
#include <cerrno>
#include <memory>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <vector>

#include <linux/videodev2.h>

#include "drivers/camera/image.hpp"
#include "drivers/camera/v4l2_stream.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace fovea::drivers::camera;

class HostileCamera final : public V4l2Calls {
public:
    explicit HostileCamera(fovea::fuzz::Input& in) : in_{in} {}
    ~HostileCamera() override { FOVEA_FUZZ_CHECK(maps_ == 0 && fds_ == 0); }   // all is given back
    int open(const char*) noexcept override {
        ++fds_;
        return 1000;
    }
    void close(int) noexcept override { --fds_; }
    int ioctl(int, unsigned long request, void* argument) noexcept override {
        const auto how = in_.take<std::uint8_t>();
        if (how >= 0xF0) {
            errno = how == 0xF0 ? EBUSY : how == 0xF1 ? EAGAIN : how == 0xF2 ? EIO : how == 0xF3 ? ENODEV : EINVAL;
            return -1;
        }
        if (in_.rest().empty()) {   // the story is over
            errno = ENODEV;
            return -1;
        }
        // A pointer is the kernel's word in the end: it hands back what it was given.
        unsigned long pointer = 0;
        if (request == VIDIOC_DQBUF) pointer = static_cast<v4l2_buffer*>(argument)->m.userptr;
        const std::size_t from = how & 0x3F;
        const auto bytes = in_.take_bytes(in_.take<std::uint8_t>());
        const std::size_t room = _IOC_SIZE(request);
        if (from < room) std::memcpy(static_cast<std::uint8_t*>(argument) + from, bytes.data(), std::min(bytes.size(), room - from));
        if (request == VIDIOC_DQBUF) static_cast<v4l2_buffer*>(argument)->m.userptr = pointer;
        return 0;
    }
    void* map(std::size_t bytes, int, off_t) noexcept override {
        FOVEA_FUZZ_CHECK(bytes > 0 && bytes <= (std::size_t{1} << 28));
        if (bytes > 1 << 20) {
            errno = ENOMEM;
            return MAP_FAILED;
        }
        ++maps_;
        return std::calloc(1, bytes);
    }
    void unmap(void* data, std::size_t) noexcept override {
        --maps_;
        std::free(data);
    }
    int dma_buffer(std::size_t) noexcept override {
        ++fds_;
        return 2000;
    }

private:
    fovea::fuzz::Input& in_;
    int maps_ = 0, fds_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fovea::fuzz::Input in(data, size);
    HostileCamera camera(in);
    V4l2Stream stream(camera);
    StreamSettings settings;
    settings.path = "/dev/video0";
    const auto wishes = in.take<std::uint8_t>();
    if ((wishes & 1) != 0) settings.width = settings.height = 64;
    if ((wishes & 2) != 0) settings.rate_hz = 120;
    if ((wishes & 4) != 0) settings.exposure_us = 1000, settings.gain = 1;
    if (!stream.open(settings)) return 0;
    FOVEA_FUZZ_CHECK(stream.width() >= 1 && stream.width() <= kMaxImageSide && stream.height() >= 1 && stream.height() <= kMaxImageSide);
    GreyConverter converter;
    Frame frame;
    for (int i = 0; i < 64; ++i) {
        const FrameEvent event = stream.next(frame, fovea::instant_from_ns(1'000'000'000));
        if (event == FrameEvent::lost) break;
        if (event == FrameEvent::nothing) continue;
        FOVEA_FUZZ_CHECK(frame.captured <= frame.received);
        const GreyImage g = converter.convert(frame.bytes, stream.format(), stream.width(), stream.height(), stream.stride());
        if (g.pixels == nullptr) continue;
        FOVEA_FUZZ_CHECK(g.width == stream.width() && g.height == stream.height());
        unsigned sum = 0;
        for (int y = 0; y < g.height; ++y) sum += g.pixels[y * g.stride] + g.pixels[y * g.stride + g.width - 1];
        FOVEA_FUZZ_CHECK(sum <= 510u * static_cast<unsigned>(g.height));
    }
    return 0;
}
