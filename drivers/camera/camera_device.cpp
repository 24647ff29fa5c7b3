#include "drivers/camera/camera_device.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fcntl.h>
#include <filesystem>
#include <linux/videodev2.h>
#include <numbers>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <fmt/format.h>

#include "drivers/access.hpp"
#include "drivers/camera/eye_model.hpp"
#include "drivers/camera/v4l2_stream.hpp"
#include "drivers/setting_values.hpp"
#include "drivers/wake_fd.hpp"

namespace fovea::drivers::camera {

namespace {

constexpr int kClosedAfterFrames = 3;

struct CameraSettings {
    std::array<StreamSettings, 2> streams;   // the second is used when its path is set
    std::array<EyeModel, 2> models;
    std::array<Eye, 2> eyes = {Eye::combined, Eye::right};   // one camera speaks for both eyes unless told otherwise
    bool centre_given = false, radius_given = false;
    PupilSettings pupil;
    double min_confidence = 0.3;
    Duration silent{};
};

class CameraDevice final : public Device {
public:
    CameraDevice(V4l2Calls& calls, CameraSettings settings, const TimeSource& time)
        : settings_{std::move(settings)}, time_{time}, cameras_{Camera(calls), Camera(calls)} {
        count_ = settings_.streams[1].path.empty() ? 1 : 2;
        for (auto& c : cameras_) c.detector.emplace(settings_.pupil);
    }
    ~CameraDevice() override { close(); }

    DeviceInfo info() const override {
        std::string name = cameras_[0].stream.card().empty() ? "eye camera" : cameras_[0].stream.card();
        if (count_ == 2) name += " and " + cameras_[1].stream.card();
        return {"camera", name, settings_.streams[0].path, cameras_[0].stream.rate_hz(), false};
    }

    Result<void> open() override {
        close();
        for (std::size_t i = 0; i < count_; ++i) {
            StreamSettings s = settings_.streams[i];
            if (s.path.empty()) {
                const auto found = list(false);
                const auto usable = std::ranges::find_if(found, [](const FoundDevice& d) { return d.problem.empty(); });
                if (usable == found.end())
                    return found.empty() ? fail("no camera is plugged in", {}, "plug one in, or set path under [source]")
                                         : fail(found.front().problem, found.front().location);
                s.path = usable->location;
            }
            Camera& c = cameras_[i];
            if (auto opened = c.stream.open(s); !opened) {
                close();
                return opened;
            }
            c.model = settings_.models[i];
            // Without a calibration: the eye's centre in the middle of the picture, the ball as large as it usually is
            // for a camera that sees the eye and little else.
            if (!settings_.centre_given && !c.model.glint_reference) {
                c.model.centre_x = (c.stream.width() - 1) / 2.0;
                c.model.centre_y = (c.stream.height() - 1) / 2.0;
            }
            if (!settings_.radius_given) c.model.radius_px = 0.45 * std::min(c.stream.width(), c.stream.height());
            c.state = {};
            c.missed = 0;
        }
        next_id_ = 1;
        last_frame_ = time_.now();
        return {};
    }

    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        if (!cameras_[0].stream.is_open()) return lose("not open");
        for (;;) {
            const Instant now = time_.now();
            if (settings_.silent > Duration{} && now - last_frame_ > settings_.silent) return lose("silent");
            std::array<pollfd, 3> fds{};
            fds[0] = {wake_.get(), POLLIN, 0};
            for (std::size_t i = 0; i < count_; ++i) fds[i + 1] = {cameras_[i].stream.fd(), POLLIN, 0};
            const Duration left = std::clamp<Duration>(deadline - now, Duration{}, std::chrono::seconds(1));
            const timespec wait{static_cast<time_t>(left.count() / 1'000'000'000), left.count() % 1'000'000'000};
            const int ready = ::ppoll(fds.data(), static_cast<nfds_t>(count_ + 1), &wait, nullptr);
            if (ready < 0 && errno != EINTR) return lose("poll failed");
            if (fds[0].revents != 0) {
                wake_.clear();
                return PollStatus::nothing;
            }
            for (std::size_t k = 0; k < count_ && ready > 0; ++k) {
                const std::size_t i = (turn_ + k) % count_;   // neither camera can starve the other
                if (fds[i + 1].revents == 0) continue;
                Frame frame;
                switch (cameras_[i].stream.next(frame, time_.now())) {
                    case FrameEvent::lost: return lose("unplugged");
                    case FrameEvent::nothing: continue;
                    case FrameEvent::frame: break;
                }
                turn_ = i + 1;
                last_frame_ = frame.received;
                if (!take(i, frame, out)) continue;
                return PollStatus::sample;
            }
            if (time_.now() >= deadline) return PollStatus::nothing;
        }
    }

    void wake() noexcept override { wake_.raise(); }

    void close() noexcept override {
        for (auto& c : cameras_) {
            if (!c.stream.is_open()) continue;
            c.before.dropped += c.stream.counters().dropped;
            c.before.broken += c.stream.counters().broken;
            c.stream.close();
        }
    }

    DeviceCounters counters() const noexcept override {
        DeviceCounters c = counters_;
        for (const auto& camera : cameras_) {
            const bool open = camera.stream.is_open();   // a closed stream's are in `before` already
            c.dropped += camera.before.dropped + (open ? camera.stream.counters().dropped : 0);
            c.malformed += camera.before.broken + (open ? camera.stream.counters().broken : 0);
        }
        return c;
    }

private:
    struct Camera {
        explicit Camera(V4l2Calls& calls) : stream{calls} {}
        V4l2Stream stream;
        GreyConverter converter;
        std::optional<PupilDetector> detector;
        EyeModel model;
        EyeState state;
        Instant seen;
        int missed = 0;
        StreamCounters before;
    };

    PollStatus lose(const char* why) noexcept {
        close();
        ++counters_.losses;
        counters_.last_loss = why;
        return PollStatus::lost;
    }

    bool take(std::size_t index, const Frame& frame, GazeSample& out) noexcept {
        Camera& c = cameras_[index];
        const GreyImage image = c.converter.convert(frame.bytes, c.stream.format(), c.stream.width(), c.stream.height(), c.stream.stride());
        if (image.pixels == nullptr) {
            ++counters_.malformed;
            return false;
        }
        const PupilResult pupil = c.detector->detect(image);
        c.missed = pupil.found ? 0 : c.missed + 1;
        c.state = {};
        c.state.confidence = pupil.confidence;
        if (const auto dir = look(c.model, pupil); dir && pupil.confidence >= settings_.min_confidence) {
            c.state.valid = true;
            c.state.gaze_dir_head = *dir;
        }
        if (pupil.found) c.state.openness = 1;
        else if (c.missed >= kClosedAfterFrames) c.state.openness = 0;
        const Duration back = std::chrono::microseconds(settings_.streams[index].exposure_us) / 2;
        c.seen = frame.captured - back;

        out = {};
        out.id = next_id_++;
        out.received = frame.received;
        out.exposed = c.seen;
        out.exposed_estimated = !frame.captured_known;
        // The driver's stamp is on our clock already; it stands in as the device's time.
        if (frame.captured_known) out.device_time = DeviceTime{to_ns(frame.captured)};
        if (count_ == 1) {
            out.eye(settings_.eyes[0]) = c.state;
            out.eye(Eye::combined) = c.state;
        } else {
            combine(index, out);
        }
        ++counters_.samples;
        return true;
    }

    // Both eyes: the other camera's latest counts while it is no older than two frames.
    void combine(std::size_t index, GazeSample& out) const noexcept {
        const Camera &mine = cameras_[index], &other = cameras_[1 - index];
        const double rate = other.stream.rate_hz() > 1 ? other.stream.rate_hz() : 30;
        const bool fresh = mine.seen - other.seen < seconds(2 / rate);
        out.eye(index == 0 ? Eye::left : Eye::right) = mine.state;
        if (fresh) out.eye(index == 0 ? Eye::right : Eye::left) = other.state;
        EyeState& both = out.eye(Eye::combined);
        const EyeState &l = out.eye(Eye::left), &r = out.eye(Eye::right);
        if (l.valid && r.valid) {
            const auto mean = Direction<HeadFrame>::from(l.gaze_dir_head.vec() + r.gaze_dir_head.vec());
            both = l;
            both.valid = mean.has_value();
            if (mean) both.gaze_dir_head = *mean;
            both.confidence = std::min(l.confidence, r.confidence);
        } else {
            both = l.valid ? l : r;
        }
        both.openness = std::fmax(l.openness, r.openness);
    }

    CameraSettings settings_;
    const TimeSource& time_;
    std::array<Camera, 2> cameras_;
    std::size_t count_ = 1, turn_ = 0;
    WakeFd wake_;
    DeviceCounters counters_;
    std::uint64_t next_id_ = 1;
    Instant last_frame_;
};

}  // namespace

std::vector<DeviceKey> keys() {
    return {
        {"path", "\"\"", "camera node, e.g. \"/dev/video0\"; empty: the first camera that serves"},
        {"right_path", "\"\"", "node of the right eye's camera when there are two; path is then the left eye's"},
        {"eye", "\"combined\"", "whose eye a single camera sees: combined, left or right"},
        {"width", "0", "pixels, 0 (as the camera has it) to 4096"},
        {"height", "0", "pixels, 0 (as the camera has it) to 4096"},
        {"rate_hz", "0.0", "frame rate; hertz, 0 (as the camera has it) to 1000"},
        {"format", "\"auto\"", "auto, GREY, Y16, YUYV or MJPG"},
        {"exposure_us", "0", "exposure time; microseconds, 0 (the camera's choice) to 1000000"},
        {"gain", "-1", "the camera's own gain steps, -1 (the camera's choice) to 65535"},
        {"preset", "\"balanced\"", "pupil detection: draft, fast, balanced or best"},
        {"min_pupil_px", "0.0", "least pupil radius; pixels, 0 (1/24 of the picture) to 2000"},
        {"max_pupil_px", "0.0", "greatest pupil radius; pixels, 0 (1/5 of the picture) to 2000"},
        {"min_confidence", "0.3", "a pupil below this confidence is not used; 0 to 1"},
        {"reference", "\"picture\"", "what the eye's centre is measured from: picture or glint"},
        {"centre_x_px", "-1.0", "the eyeball's centre from the reference; pixels, -4096 to 4096; picture: -1 is the middle"},
        {"centre_y_px", "-1.0", "the same downwards"},
        {"eyeball_px", "0.0", "radius of the eyeball in the picture; pixels, 0 (0.45 of the smaller side) to 4096"},
        {"mirrored", "false", "the camera sees the eye in a mirror"},
        {"camera_azimuth_deg", "0.0", "where the camera stands, seen from the eye: to the wearer's right of straight ahead; degrees, -80 to 80"},
        {"camera_elevation_deg", "0.0", "the same upwards; a camera below the eye is negative; degrees, -80 to 80"},
        {"silent_ms", "2000", "no frame for this long counts as lost; milliseconds, 0 (never) to 600000"},
    };
}

Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time) {
    return create_on(kernel_v4l2(), settings, time);
}

Result<std::unique_ptr<Device>> create_on(V4l2Calls& calls, const DeviceSettings& settings, const TimeSource& time) {
    SettingValues v(settings);
    CameraSettings s;
    StreamSettings& first = s.streams[0];
    first.width = static_cast<int>(v.integer("width", 0, 0, kMaxImageSide));
    first.height = static_cast<int>(v.integer("height", 0, 0, kMaxImageSide));
    first.rate_hz = v.number("rate_hz", 0, 0, 1000);
    first.format = v.choice("format", "auto", "auto GREY Y16 YUYV MJPG");
    first.exposure_us = static_cast<int>(v.integer("exposure_us", 0, 0, 1'000'000));
    first.gain = static_cast<int>(v.integer("gain", -1, -1, 65535));
    s.streams[1] = first;
    first.path = v.text("path", "");
    s.streams[1].path = v.text("right_path", "");
    const std::string eye = v.choice("eye", "combined", "combined left right");
    s.eyes[0] = eye == "left" ? Eye::left : eye == "right" ? Eye::right : Eye::combined;
    s.pupil.preset = preset_from(v.choice("preset", "balanced", kPupilPresetNames));
    s.pupil.min_radius_px = v.number("min_pupil_px", 0, 0, 2000);
    s.pupil.max_radius_px = v.number("max_pupil_px", 0, 0, 2000);
    s.min_confidence = v.number("min_confidence", 0.3, 0, 1);
    EyeModel m;
    m.glint_reference = v.choice("reference", "picture", "picture glint") == "glint";
    m.centre_x = v.number("centre_x_px", -1, -4096, 4096);
    m.centre_y = v.number("centre_y_px", -1, -4096, 4096);
    m.radius_px = v.number("eyeball_px", 0, 0, 4096);
    m.mirrored = v.flag("mirrored", false);
    m.camera_azimuth_rad = v.number("camera_azimuth_deg", 0, -80, 80) * std::numbers::pi / 180;
    m.camera_elevation_rad = v.number("camera_elevation_deg", 0, -80, 80) * std::numbers::pi / 180;
    s.centre_given = m.centre_x != -1 || m.centre_y != -1;
    s.radius_given = m.radius_px > 1;
    s.models = {m, m};
    s.models[1].camera_azimuth_rad = -m.camera_azimuth_rad;   // the right eye's camera is the left one's mirror image
    s.silent = std::chrono::milliseconds(v.integer("silent_ms", 2000, 0, 600000));
    if (auto bad = v.failure(); !bad) return std::unexpected(bad.error());
    if (!s.streams[1].path.empty() && first.path.empty())
        return fail("right_path without path", settings.where_is("right_path"), "name the left eye's camera with path");
    return std::make_unique<CameraDevice>(calls, std::move(s), time);
}

std::vector<FoundDevice> list(bool with_details) {
    std::vector<std::string> nodes;
    std::error_code error;
    for (std::filesystem::directory_iterator it("/sys/class/video4linux", error), end; !error && it != end; it.increment(error))
        if (it->path().filename().string().starts_with("video")) nodes.push_back("/dev/" + it->path().filename().string());
    std::ranges::sort(nodes, [](const std::string& a, const std::string& b) { return a.size() != b.size() ? a.size() < b.size() : a < b; });
    std::vector<FoundDevice> found;
    for (const std::string& node : nodes) {
        FoundDevice d;
        d.location = node;
        const int fd = ::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
        if (fd < 0) {
            d.name = "camera";
            d.problem = cannot_open(node, errno).error().message();
            found.push_back(std::move(d));
            continue;
        }
        v4l2_capability cap{};
        const bool answers = ::ioctl(fd, VIDIOC_QUERYCAP, &cap) == 0;
        const std::uint32_t can = (cap.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? cap.device_caps : cap.capabilities;
        if (answers && (can & V4L2_CAP_VIDEO_CAPTURE) != 0) {   // metadata and output nodes are no cameras
            d.name = fmt::format("{} ({})", reinterpret_cast<const char*>(cap.card), reinterpret_cast<const char*>(cap.driver));
            std::string formats;
            for (const PixelFormat f : usable_formats(fd)) formats += std::string(formats.empty() ? "" : ", ") + to_string(f);
            if (formats.empty()) d.problem = "it offers none of GREY, Y16, YUYV and MJPG";
            else d.facts.push_back("offers " + formats);
            if (with_details)
                for (std::uint32_t i = 0; i < 64; ++i) {
                    v4l2_fmtdesc f{};
                    f.index = i;
                    f.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
                    if (::ioctl(fd, VIDIOC_ENUM_FMT, &f) != 0) break;
                    d.details += fmt::format("format {}: {}\n", i, reinterpret_cast<const char*>(f.description));
                }
            found.push_back(std::move(d));
        }
        ::close(fd);
    }
    return found;
}

}  // namespace fovea::drivers::camera
