// Input reports from one hidraw node: sleeps in the kernel until one comes, the deadline passes or wake() is called.
//
// hidapi, which finds the trackers and speaks their feature reports, shows no descriptor to wait on beside another, so
// a read loop on it has to look up from time to time; this waits for the node and the wake-up at once.
// Cost: one read() where reports are waiting; read(), ppoll(), read() where it has to sleep. Nothing while silent.
// Threads: one at a time, except wake(). next() is noexcept and allocates nothing.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/wake_fd.hpp"
#include "protocol/clock.hpp"

namespace fovea::drivers::hid {

enum class ReportEvent : std::uint8_t { report, nothing, lost };

class ReportStream {
public:
    // `max_report_bytes`: longer reports are cut, as by read(2) on hidraw; at least 1.
    explicit ReportStream(std::size_t max_report_bytes) : buffer_(max_report_bytes) {}

    [[nodiscard]] int open(const std::string& node);   // 0, or errno
    void close() noexcept { fd_ = {}; }
    [[nodiscard]] bool is_open() const noexcept { return fd_.get() >= 0; }

    // Waits until `deadline` by `time`. `report` is valid until the next call; `received` is when it was read.
    [[nodiscard]] ReportEvent next(std::span<const std::uint8_t>& report, Instant& received, Instant deadline,
                                   const TimeSource& time) noexcept;
    void wake() noexcept { wake_.raise(); }

private:
    UniqueFd fd_;
    WakeFd wake_;
    std::vector<std::uint8_t> buffer_;
};

}  // namespace fovea::drivers::hid
