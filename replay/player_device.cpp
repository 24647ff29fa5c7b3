#include "replay/player_device.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <optional>

namespace fovea::replay {
namespace {

using drivers::PollStatus;

// No time of a recording may lie further from its start, neither as recorded nor as played; and a loop ends before the
// turns together take longer. So no sum of instants below leaves 64 bits, which hold 292 years.
constexpr Duration kMaxSpan = std::chrono::hours(24 * 3653), kMaxLooped = 10 * kMaxSpan;
constexpr unsigned long kTimerSlack_ns = 1000;

class Player final : public drivers::Device {
public:
    Player(std::filesystem::path path, std::optional<Recording> recording, const PlayerSettings& settings,
           std::string location, const TimeSource& time)
        : path_(std::move(path)), recording_(std::move(recording)), settings_(settings),
          location_(std::move(location)), time_(time), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

    ~Player() override {
        if (wake_ >= 0) ::close(wake_);
    }
    Player(const Player&) = delete;
    Player& operator=(const Player&) = delete;

    [[nodiscard]] drivers::DeviceInfo info() const override {
        drivers::DeviceInfo info{"replay", "recording", location_, 0, true};
        if (recording_) {
            if (!recording_->info.device.empty()) info.name = recording_->info.device;
            info.nominal_rate_hz = recording_->info.nominal_rate_hz * (settings_.speed > 0 ? settings_.speed : 1);
        }
        return info;
    }

    [[nodiscard]] Result<void> open() override {
        if (wake_ < 0) return fail("no event descriptor is left", location_, "raise the limit of open files");
        if (!prepared_) {
            if (!recording_) {
                auto loaded = load_recording(path_);
                if (!loaded) return std::unexpected(loaded.error());
                recording_ = std::move(*loaded);
            }
            if (auto ok = prepare(); !ok) return ok;
        }
        next_ = 0;
        id_ = 0;
        started_ = false;
        loop_shift_ = Duration{};
        return {};
    }

    [[nodiscard]] PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        if (!prepared_) return PollStatus::lost;  // poll() before open()
        if (!started_) {
            // The first sample is due now; every later one follows from it.
            start_ = last_due_ = time_.now();
            started_ = true;
            // A thread's timers may be 50 us late by default, which would be half of all that a played sample lags.
            if (settings_.speed > 0) ::prctl(PR_SET_TIMERSLACK, kTimerSlack_ns);
        }
        while (true) {
            if (next_ == recording_->samples.size()) {
                const Duration shift = loop_shift_ + loop_length_;
                if (!settings_.loop || std::max(shift, played(shift)) > kMaxLooped) return PollStatus::ended;
                next_ = 0;
                loop_shift_ = shift;
            }
            const GazeSample& sample = recording_->samples[next_].sample;
            const Instant received = on_our_clock(sample.received);
            const Instant due = std::max(last_due_, received);  // never before one that came earlier in the file
            const Instant now = time_.now();
            if (settings_.speed == 0 || now >= due) {
                out = sample;
                out.id = ++id_;
                out.device_time.ns += loop_shift_.count();
                out.exposed = on_our_clock(sample.exposed);
                out.received = std::max(received, out.exposed);  // a file whose arrival precedes its exposure
                last_due_ = due;
                ++next_;
                return PollStatus::sample;
            }
            if (now >= deadline || !wait(std::min(due, deadline) - now)) return PollStatus::nothing;
            if (time_.now() == now) return PollStatus::nothing;  // a clock that stands still (a test's)
        }
    }

    void wake() noexcept override {
        const std::uint64_t one = 1;
        [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof one);
    }

    void close() noexcept override { started_ = false; }

private:
    Result<void> prepare() {
        trim(*recording_, seconds(settings_.start_s),
             settings_.duration_s <= 0 ? Duration{-1} : seconds(settings_.duration_s));
        const auto& samples = recording_->samples;
        if (samples.empty())
            return fail("start_s and duration_s leave no sample of the recording", location_, "choose an earlier part");
        origin_ = samples.front().sample.received;
        Instant last = origin_, earliest = origin_;
        Duration furthest{};
        for (const RecordedSample& r : samples)
            for (const Instant t : {r.sample.received, r.sample.exposed}) furthest = std::max(furthest, t < origin_ ? origin_ - t : t - origin_);
        if (furthest > kMaxSpan)
            return fail("the recording spans more than 10 years", location_, "cut it: `fovea convert --start --duration`");
        if (static_cast<double>(furthest.count()) > static_cast<double>(kMaxSpan.count()) * stretch())
            return fail("at this speed the recording would play for more than 10 years", location_,
                        "raise source.speed, or play less of it with source.duration_s");
        std::vector<std::int64_t> steps;
        for (std::size_t i = 1; i < samples.size(); ++i) {
            const Instant t = samples[i].sample.received;
            if (t > last) steps.push_back((t - last).count());
            last = std::max(last, t);
            earliest = std::min(earliest, t);
        }
        std::sort(steps.begin(), steps.end());
        // A turn of the loop takes the whole recording and one usual step, so that no two turns overlap.
        loop_length_ = last - earliest + Duration{steps.empty() ? 1'000'000 : steps[steps.size() / 2]};
        prepared_ = true;
        return {};
    }

    // At speed 1 and max a constant integer offset; other speeds stretch time about the start.
    [[nodiscard]] Instant on_our_clock(Instant t) const noexcept {
        return start_ + played(t - origin_ + loop_shift_);
    }

    // The factor between the file's time and ours.
    [[nodiscard]] double stretch() const noexcept { return settings_.speed == 0 ? 1 : settings_.speed; }

    // How long so much of the recording takes; the longest that 64 bits hold where it takes longer.
    [[nodiscard]] Duration played(Duration recorded) const noexcept {
        if (stretch() == 1) return recorded;
        const double ns = static_cast<double>(recorded.count()) / stretch();
        return ns < static_cast<double>(Duration::max().count()) ? Duration{std::llround(ns)} : Duration::max();
    }

    // False when wake() was called.
    bool wait(Duration d) noexcept {
        struct pollfd fd = {wake_, POLLIN, 0};
        const struct timespec timeout = {static_cast<time_t>(d.count() / 1'000'000'000),
                                         static_cast<long>(d.count() % 1'000'000'000)};
        if (::ppoll(&fd, 1, &timeout, nullptr) <= 0) return true;
        std::uint64_t count = 0;
        [[maybe_unused]] const ssize_t got = ::read(wake_, &count, sizeof count);
        return false;
    }

    std::filesystem::path path_;
    std::optional<Recording> recording_;
    PlayerSettings settings_;
    std::string location_;
    const TimeSource& time_;
    int wake_;
    bool prepared_ = false, started_ = false;
    std::size_t next_ = 0;
    std::uint64_t id_ = 0;
    Instant origin_, start_, last_due_;
    Duration loop_length_{}, loop_shift_{};
};

Result<double> parse_number(const std::string& key, const std::string& text, double low, double high,
                            const std::string& legal, const std::string& where) {
    double value = 0;
    const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (ec != std::errc{} || end != text.data() + text.size() || !(value >= low && value <= high))
        return fail("'" + key + "' is '" + text + "'", where, "legal: " + legal);
    return value;
}

Result<PlayerSettings> parse_settings(const drivers::DeviceSettings& given) {
    PlayerSettings s;
    for (const auto& [key, text] : given.values) {
        if (key == "driver" || key == "path") continue;
        if (key == "speed") {
            if (text == "max") {
                s.speed = 0;
                continue;
            }
            const auto v = parse_number(key, text, 0.001, 1000, "0.001 to 1000, or \"max\"", given.where_is(key));
            if (!v) return std::unexpected(v.error());
            s.speed = *v;
        } else if (key == "loop") {
            if (text != "true" && text != "false")
                return fail("'loop' is '" + text + "'", given.where_is(key), "legal: true, false");
            s.loop = text == "true";
        } else if (key == "start_s") {
            const auto v = parse_number(key, text, 0, 1e6, "0 to 1000000 seconds", given.where_is(key));
            if (!v) return std::unexpected(v.error());
            s.start_s = *v;
        } else if (key == "duration_s") {
            const auto v = parse_number(key, text, 0, 1e6, "0 (all) to 1000000 seconds", given.where_is(key));
            if (!v) return std::unexpected(v.error());
            s.duration_s = *v;
        } else {
            return fail("unknown key '" + key + "' of the source 'replay'", given.where,
                        "legal keys: path, speed, loop, start_s, duration_s");
        }
    }
    return s;
}

}  // namespace

Result<std::unique_ptr<drivers::Device>> make_player(Recording recording, const PlayerSettings& settings,
                                                     std::string location, const TimeSource& time) {
    return std::make_unique<Player>(std::filesystem::path{}, std::move(recording), settings, std::move(location), time);
}

drivers::DeviceRow player_row() {
    return {"replay", "a recording, played as if its eye tracker were there",
            [](const drivers::DeviceSettings& given,
               const TimeSource& time) -> Result<std::unique_ptr<drivers::Device>> {
                const auto path = given.values.find("path");
                if (path == given.values.end() || path->second.empty())
                    return fail("the source 'replay' needs a path", given.where, "add path = \"recording.csv\" under [source], or start with --set source.path=recording.csv; for a tracker: source.driver=auto");
                const auto settings = parse_settings(given);
                if (!settings) return std::unexpected(settings.error());
                return std::make_unique<Player>(path->second, std::nullopt, *settings, path->second, time);
            },
            {{"path", "\"\"", "the recording; any format that `fovea convert --list` prints"},
             {"speed", "\"1\"", "\"1\" real time, \"0.5\" half as fast (0.001 to 1000), \"max\" as fast as possible"},
             {"loop", "false", "after the end from the start again; times go on rising"},
             {"start_s", "0.0", "leave out this much of the beginning; seconds, 0 to 1000000"},
             {"duration_s", "0.0", "play no more than this; seconds, 0 (all) to 1000000"}},
            {},       // nothing can be plugged in
            false};   // a file that cannot be read is the user's error; it does not come later
}

}  // namespace fovea::replay
