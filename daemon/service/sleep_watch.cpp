#include "daemon/service/sleep_watch.hpp"

#include <ctime>

namespace fovea::service {
namespace {

constexpr Duration kClose = std::chrono::milliseconds(1);   // between two readings of one clock around one of the other
constexpr int kAttempts = 16;

Duration boot_time() noexcept {
    timespec t{};
    clock_gettime(CLOCK_BOOTTIME, &t);
    return Duration{std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec};
}

}  // namespace

Duration time_asleep() noexcept {
    Duration best{}, best_apart = Duration::max();
    for (int i = 0; i < kAttempts && best_apart > kClose; ++i) {
        const Instant before = MonotonicClock::now();
        const Duration boot = boot_time();
        const Duration apart = MonotonicClock::now() - before;
        if (apart < best_apart) {
            best_apart = apart;
            best = boot - (before.time_since_epoch() + apart / 2);
        }
    }
    return best;
}

}  // namespace fovea::service
