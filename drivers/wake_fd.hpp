// Ends a wait of the polling thread from another one: an eventfd beside the device's own descriptor.
//
// raise() before the wait ends the next one: a wake-up is never lost, so a driver needs no periodic look.
// Threads: raise() from any thread, the rest from the one that polls. noexcept; a process without a descriptor to spare
// aborts in the constructor.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

#include "protocol/error.hpp"
#include "protocol/unique_fd.hpp"

namespace fovea::drivers {

class WakeFd {
public:
    WakeFd() : fd_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)} { FOVEA_REQUIRE(fd_.get() >= 0); }
    [[nodiscard]] int get() const noexcept { return fd_.get(); }   // readable once raised
    void raise() noexcept {
        const std::uint64_t one = 1;
        [[maybe_unused]] const ssize_t n = ::write(fd_.get(), &one, sizeof one);
    }
    void clear() noexcept {
        std::uint64_t count = 0;
        [[maybe_unused]] const ssize_t n = ::read(fd_.get(), &count, sizeof count);
    }

private:
    UniqueFd fd_;
};

}  // namespace fovea::drivers
