#include "drivers/hid/hid_device.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <fcntl.h>
#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <fmt/format.h>
#include <hidapi/hidapi.h>

#include "drivers/access.hpp"
#include "drivers/exposure_clock.hpp"
#include "drivers/hid/eye_tracker.hpp"
#include "drivers/hid/report_stream.hpp"
#include "drivers/hid/usages.hpp"
#include "drivers/setting_values.hpp"

namespace fovea::drivers::hid {

namespace {

constexpr std::size_t kMaxReportBytes = kMaxReportBits / 8 + 1;

std::string narrow(const wchar_t* text) {
    std::string out;
    for (; text != nullptr && *text != 0; ++text) out += *text >= 32 && *text < 127 ? static_cast<char>(*text) : '?';
    return out;
}

// The descriptor as sysfs shows it, which needs no permission; else by asking the node.
std::vector<std::uint8_t> read_descriptor(const std::string& node) {
    std::vector<std::uint8_t> bytes(kMaxDescriptorBytes);
    const std::string name = node.substr(node.rfind('/') + 1);
    if (std::FILE* f = std::fopen(("/sys/class/hidraw/" + name + "/device/report_descriptor").c_str(), "rb")) {
        bytes.resize(std::fread(bytes.data(), 1, bytes.size(), f));
        std::fclose(f);
        if (!bytes.empty()) return bytes;
    }
    const int fd = ::open(node.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) return {};
    int size = 0;
    hidraw_report_descriptor d{};
    if (::ioctl(fd, HIDIOCGRDESCSIZE, &size) >= 0 && size > 0 && size <= HID_MAX_DESCRIPTOR_SIZE) {
        d.size = static_cast<std::uint32_t>(size);
        if (::ioctl(fd, HIDIOCGRDESC, &d) >= 0) bytes.assign(d.value, d.value + d.size);
        else bytes.clear();
    } else {
        bytes.clear();
    }
    ::close(fd);
    return bytes;
}

struct Candidate {
    std::string node, name, serial;
    std::uint16_t vendor = 0, product = 0;
};

// Every hidraw node with a top-level collection on the tracker's page, each once, in the order of their names.
std::vector<Candidate> candidates() {
    std::vector<Candidate> found;
    if (hid_init() != 0) return found;
    hid_device_info* const all = hid_enumerate(0, 0);
    for (const hid_device_info* d = all; d != nullptr; d = d->next) {
        if (d->usage_page != kEyeTrackerPage || d->path == nullptr) continue;
        if (std::ranges::any_of(found, [&](const Candidate& c) { return c.node == d->path; })) continue;
        found.push_back({d->path, narrow(d->product_string), narrow(d->serial_number), d->vendor_id, d->product_id});
    }
    hid_free_enumeration(all);
    std::ranges::sort(found, [](const Candidate& a, const Candidate& b) {
        return a.node.size() != b.node.size() ? a.node.size() < b.node.size() : a.node < b.node;
    });
    return found;
}

void read_features(hid_device* handle, EyeTracker& tracker) {
    for (const EyeTracker::FeatureReport& f : tracker.features_to_read()) {
        std::vector<std::uint8_t> bytes(f.bytes, 0);
        bytes[0] = f.id;
        const int got = hid_get_feature_report(handle, bytes.data(), bytes.size());
        if (got > 0) tracker.take_feature({bytes.data(), static_cast<std::size_t>(got)});
    }
}

struct HidSettings {
    std::string path, serial;
    std::uint16_t vendor = 0, product = 0;
    Duration silent{};
    ScreenSettings screen;
};

class HidDevice final : public Device {
public:
    HidDevice(HidSettings settings, const TimeSource& time)
        : settings_{std::move(settings)}, time_{time} {
        info_.driver = "hid";
        info_.name = "HID eye tracker";
        info_.location = settings_.path;
    }
    ~HidDevice() override { close(); }

    void rehearse() noexcept override {
        if (last_.empty() || !tracker_) return;
        GazeSample sample;
        tracker_->rehearse(last_, sample);
        sample.received = last_report_;
        ExposureClock clock = clock_;
        clock.stamp(sample, true);
    }

    DeviceInfo info() const override { return info_; }
    DeviceCounters counters() const noexcept override { return counters_; }
    void wake() noexcept override { stream_.wake(); }
    void close() noexcept override { stream_.close(); }

    Result<void> open() override {
        close();
        const auto chosen = choose();
        if (!chosen) return std::unexpected(chosen.error());
        const auto quirk_list = load_quirks(quirk_folders());
        if (!quirk_list) return std::unexpected(quirk_list.error());
        const auto bytes = read_descriptor(chosen->node);
        auto tracker = EyeTracker::create(
            bytes, quirks_for(*quirk_list, chosen->vendor, chosen->product, chosen->name), settings_.screen);
        if (!tracker) return at(chosen->node, tracker.error());
        // Before the features: the device must stay open between those and the reports.
        if (const int code = stream_.open(chosen->node); code != 0) return cannot_open(chosen->node, code);
        if (hid_device* const handle = hid_open_path(chosen->node.c_str())) {
            read_features(handle, *tracker);
            if (const auto request = tracker->mode_request(); !request.empty())
                hid_send_feature_report(handle, request.data(), request.size());  // refused by some that stream anyway
            hid_close(handle);
        }
        if (auto geometry = tracker->check_geometry(); !geometry) {
            close();
            return at(chosen->node, geometry.error());
        }
        const Capabilities& k = tracker->capabilities();
        info_.name = fmt::format("{} ({:04x}:{:04x})", chosen->name, chosen->vendor, chosen->product);
        info_.location = chosen->node;
        info_.nominal_rate_hz = std::isnan(k.sampling_hz) ? 0 : k.sampling_hz;
        tracker_.emplace(std::move(*tracker));
        clock_.reset();
        next_id_ = 1;
        last_ = {};
        last_report_ = time_.now();
        return {};
    }

    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        for (;;) {
            Instant until = deadline;
            if (settings_.silent > Duration{}) until = std::min(until, last_report_ + settings_.silent);
            std::span<const std::uint8_t> report;
            Instant received;
            switch (stream_.next(report, received, until, time_)) {
                case ReportEvent::report: break;
                case ReportEvent::lost: return lose("unplugged");
                case ReportEvent::nothing: return silent_at(time_.now()) ? lose("silent") : PollStatus::nothing;
            }
            bool has_device_time = false;
            switch (tracker_->decode(report, out, has_device_time)) {
                case Decoded::sample:
                    last_report_ = received;
                    last_ = report;
                    out.id = next_id_++;
                    out.received = received;
                    clock_.stamp(out, has_device_time);
                    ++counters_.samples;
                    return PollStatus::sample;
                case Decoded::malformed:
                    ++counters_.malformed;
                    if (silent_at(received)) return lose("silent");   // nothing but noise is silence too
                    break;
                case Decoded::status:
                case Decoded::foreign: last_report_ = received; break;
            }
            if (received >= deadline) return PollStatus::nothing;  // a torrent of such reports must not hold us here
        }
    }

private:
    [[nodiscard]] static std::unexpected<Error> at(const std::string& node, Error e) {
        e.where = e.where.empty() ? node : node + ", " + e.where;
        return std::unexpected(std::move(e));
    }

    PollStatus lose(const char* why) noexcept {
        close();
        ++counters_.losses;
        counters_.last_loss = why;
        return PollStatus::lost;
    }

    [[nodiscard]] bool silent_at(Instant now) const noexcept {
        return settings_.silent > Duration{} && now - last_report_ >= settings_.silent;
    }

    [[nodiscard]] Result<Candidate> choose() const {
        const auto all = candidates();
        for (const Candidate& c : all) {
            if (!settings_.path.empty() && settings_.path != c.node) continue;
            if (settings_.vendor != 0 && settings_.vendor != c.vendor) continue;
            if (settings_.product != 0 && settings_.product != c.product) continue;
            if (!settings_.serial.empty() && settings_.serial != c.serial) continue;
            return c;
        }
        if (!all.empty())
            return fail("no HID eye tracker fits path, vendor, product and serial", settings_.path,
                        "`fovea devices` lists what is there");
        return fail("no eye tracker of HID usage page 0x12 is plugged in", settings_.path,
                    "plug one in; `fovea devices` lists what is there");
    }

    HidSettings settings_;
    const TimeSource& time_;
    ReportStream stream_{kMaxReportBytes};
    DeviceInfo info_;
    std::optional<EyeTracker> tracker_;
    ExposureClock clock_;
    std::uint64_t next_id_ = 1;
    Instant last_report_;
    std::span<const std::uint8_t> last_;   // the newest sample's report, in the stream's buffer
    DeviceCounters counters_;
};

std::vector<std::string> facts(const EyeTracker& tracker) {
    const Capabilities& k = tracker.capabilities();
    std::vector<std::string> lines;
    std::string gives = "gives gaze point";
    if (k.eye_positions) gives += ", eye positions";
    if (k.head_position) gives += ", head position";
    if (k.head_rotation) gives += ", head rotation";
    lines.push_back(gives);
    if (k.timestamp)
        lines.push_back(fmt::format("timestamp, {:g} s per count{}", k.timestamp_unit_s,
                                    k.timestamp_unit_assumed ? " (assumed: the descriptor names no unit)" : ""));
    else
        lines.push_back("no timestamp: exposure is estimated from arrival");
    if (!std::isnan(k.sampling_hz)) lines.push_back(fmt::format("{:g} Hz", k.sampling_hz));
    if (!std::isnan(k.screen_width_m))
        lines.push_back(fmt::format("calibrated screen {:.3f} m x {:.3f} m", k.screen_width_m, k.screen_height_m));
    if (!std::isnan(k.min_distance_m))
        lines.push_back(fmt::format("tracks from {:.2f} m to {:.2f} m, best at {:.2f} m", k.min_distance_m,
                                    k.max_distance_m, k.optimum_distance_m));
    if (k.status != ConfigurationStatus::unknown) lines.push_back(std::string("status: ") + to_string(k.status));
    return lines;
}

}  // namespace

std::vector<DeviceKey> keys() {
    return {
        {"path", "\"\"", "hidraw node, e.g. \"/dev/hidraw0\"; empty: the first eye tracker found"},
        {"vendor", "0", "USB vendor id, 0 to 65535; 0: any"},
        {"product", "0", "USB product id, 0 to 65535; 0: any"},
        {"serial", "\"\"", "serial number; empty: any"},
        {"silent_ms", "2000", "no report for this long counts as lost; milliseconds, 0 (never) to 600000"},
        {"screen_width_m", "0.0", "width of the screen's picture; metres, 0 (ask the device) to 20"},
        {"screen_height_m", "0.0", "height of the screen's picture; metres, 0 (ask the device) to 20"},
        {"viewing_distance_m", "0.6", "eye to screen where the device does not measure it; metres, 0.05 to 10"},
    };
}

Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time) {
    SettingValues v(settings);
    HidSettings s;
    s.path = v.text("path", "");
    s.vendor = static_cast<std::uint16_t>(v.integer("vendor", 0, 0, 65535));
    s.product = static_cast<std::uint16_t>(v.integer("product", 0, 0, 65535));
    s.serial = v.text("serial", "");
    s.silent = std::chrono::milliseconds(v.integer("silent_ms", 2000, 0, 600000));
    s.screen.width_m = v.number("screen_width_m", 0, 0, 20);
    s.screen.height_m = v.number("screen_height_m", 0, 0, 20);
    s.screen.viewing_distance_m = v.number("viewing_distance_m", 0.6, 0.05, 10);
    if (auto bad = v.failure(); !bad) return std::unexpected(bad.error());
    return std::make_unique<HidDevice>(std::move(s), time);
}

std::vector<FoundDevice> list(bool with_details) {
    std::vector<FoundDevice> found;
    const auto quirk_list = load_quirks(quirk_folders());
    for (const Candidate& c : candidates()) {
        FoundDevice f;
        f.location = c.node;
        f.name = fmt::format("{} ({:04x}:{:04x}{})", c.name, c.vendor, c.product,
                             c.serial.empty() ? "" : ", serial " + c.serial);
        const Quirks quirks = quirk_list ? quirks_for(*quirk_list, c.vendor, c.product, c.name) : Quirks{};
        const auto bytes = read_descriptor(c.node);
        auto tracker = EyeTracker::create(bytes, quirks);
        if (!quirk_list) f.problem = quirk_list.error().message();
        if (!tracker) f.problem = tracker.error().message();
        if (const int code = try_open(c.node); code != 0) {
            f.problem = cannot_open(c.node, code).error().message();
        } else if (tracker) {
            if (hid_device* h = hid_open_path(c.node.c_str())) {
                read_features(h, *tracker);
                hid_close(h);
            }
        }
        if (tracker) f.facts = facts(*tracker);
        if (!quirks.source.empty()) f.facts.push_back("quirks from " + quirks.source);
        if (with_details) {
            const auto parsed = parse_report_descriptor(bytes);
            f.details = parsed ? describe(*parsed) : parsed.error().message() + "\n";
        }
        found.push_back(std::move(f));
    }
    return found;
}

}  // namespace fovea::drivers::hid
