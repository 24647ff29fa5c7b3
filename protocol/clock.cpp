#include "protocol/clock.hpp"

#include <ctime>

namespace fovea {

MonotonicClock::time_point MonotonicClock::now() noexcept {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);  // cannot fail on Linux with this clock
    return instant_from_ns(static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec);
}

}  // namespace fovea
