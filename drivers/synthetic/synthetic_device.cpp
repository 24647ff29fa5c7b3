#include "drivers/synthetic/synthetic_device.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "drivers/setting_values.hpp"
#include "drivers/synthetic/synthetic_eye.hpp"
#include "protocol/unique_fd.hpp"

namespace fovea::drivers::synthetic {
namespace {

class SyntheticDevice final : public Device {
public:
    SyntheticDevice(const Scenario& scenario, std::string location, bool in_real_time, const TimeSource& time)
        : scenario_{scenario}, location_{std::move(location)}, in_real_time_{in_real_time}, time_{time},
          wake_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)}, eye_{scenario} {}

    [[nodiscard]] DeviceInfo info() const override { return {"synthetic", "synthetic eye: " + scenario_.name, location_, scenario_.rate_hz, true}; }

    [[nodiscard]] Result<void> open() override {
        if (!wake_) return fail("no event descriptor is left", location_, "raise the limit of open files");
        eye_ = SyntheticEye(scenario_);
        started_ = pending_ = false;
        return {};
    }

    [[nodiscard]] PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        if (!started_) start_ = time_.now();
        started_ = true;
        if (!pending_ && !eye_.next(next_)) return PollStatus::ended;
        pending_ = true;
        const Duration since_start = start_ - Instant{};
        const Instant due = next_.sample.received + since_start;
        for (Instant now = time_.now(); in_real_time_ && now < due;) {
            if (now >= deadline || !wait(std::min(due, deadline) - now)) return PollStatus::nothing;
            const Instant then = time_.now();
            if (then == now) return PollStatus::nothing;  // a clock that stands still (a test's)
            now = then;
        }
        out = next_.sample;
        out.exposed += since_start;
        out.received = due;
        pending_ = false;
        ++counters_.samples;
        counters_.dropped += out.id - last_id_ - 1;
        last_id_ = out.id;
        return PollStatus::sample;
    }

    void wake() noexcept override {
        const std::uint64_t one = 1;
        [[maybe_unused]] const ssize_t written = ::write(wake_.get(), &one, sizeof one);
    }
    void close() noexcept override { started_ = pending_ = false, last_id_ = 0; }
    [[nodiscard]] DeviceCounters counters() const noexcept override { return counters_; }

private:
    // False when wake() was called.
    bool wait(Duration d) noexcept {
        struct pollfd fd = {wake_.get(), POLLIN, 0};
        const struct timespec timeout = {static_cast<time_t>(d.count() / 1'000'000'000), static_cast<long>(d.count() % 1'000'000'000)};
        if (::ppoll(&fd, 1, &timeout, nullptr) <= 0) return true;
        std::uint64_t count = 0;
        [[maybe_unused]] const ssize_t got = ::read(wake_.get(), &count, sizeof count);
        return false;
    }

    Scenario scenario_;
    std::string location_;
    bool in_real_time_;
    const TimeSource& time_;
    UniqueFd wake_;
    SyntheticEye eye_;
    SyntheticSample next_;
    bool started_ = false, pending_ = false;
    Instant start_;
    std::uint64_t last_id_ = 0;
    DeviceCounters counters_;
};

}  // namespace

std::unique_ptr<Device> make_device(const Scenario& scenario, std::string location, bool in_real_time, const TimeSource& time) {
    return std::make_unique<SyntheticDevice>(scenario, std::move(location), in_real_time, time);
}

std::vector<DeviceKey> keys() {
    return {{"path", "\"\"", "the scenario, e.g. configs/scenarios/reading.toml"},
            {"seed", "-1", "another run of the same scenario; 0 to 1000000000, -1: the scenario's own"},
            {"without", "\"\"", "effects that are left out, separated by spaces, e.g. \"blinks noise\""},
            {"endless", "true", "go on after the scenario's duration"},
            {"speed", "\"1\"", "\"1\" real time, \"max\" as fast as possible"}};
}

Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time) {
    SettingValues v(settings);
    const std::string path = v.text("path", "");
    if (path.empty()) return fail("the source 'synthetic' needs a path", settings.where, "add: path = \"reading.toml\"; configs/scenarios has some");
    const std::int64_t seed = v.integer("seed", -1, -1, 1'000'000'000);
    const std::string without = v.text("without", "");
    const bool endless = v.flag("endless", true);
    const std::string speed = v.choice("speed", "1", "1 max");
    if (auto bad = v.failure(); !bad) return std::unexpected(bad.error());
    auto scenario = load_scenario(path);
    if (!scenario) return std::unexpected(scenario.error());
    if (seed >= 0) scenario->seed = static_cast<std::uint64_t>(seed);
    if (endless) scenario->duration_s = 0;
    std::istringstream words(without);
    for (std::string effect; words >> effect;)
        if (!remove(*scenario, effect)) return fail("'without' names no effect: '" + effect + "'", settings.where_is("without"), "`fovea synth --keys` prints them");
    return make_device(*scenario, path, speed == "1", time);
}

}  // namespace fovea::drivers::synthetic
