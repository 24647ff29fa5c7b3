#include "drivers/hid/report_stream.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace fovea::drivers::hid {

int ReportStream::open(const std::string& node) {
    fd_ = UniqueFd(::open(node.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
    return fd_.get() >= 0 ? 0 : errno;
}

ReportEvent ReportStream::next(std::span<const std::uint8_t>& report, Instant& received, Instant deadline,
                               const TimeSource& time) noexcept {
    if (!is_open()) return ReportEvent::lost;
    for (;;) {
        const ssize_t got = ::read(fd_.get(), buffer_.data(), buffer_.size());
        if (got > 0) {
            received = time.now();
            report = {buffer_.data(), static_cast<std::size_t>(got)};
            return ReportEvent::report;
        }
        if (got == 0 || (errno != EAGAIN && errno != EINTR)) return ReportEvent::lost;
        const Duration left = std::max<Duration>(deadline - time.now(), Duration{});
        const timespec wait{static_cast<time_t>(left.count() / 1'000'000'000), left.count() % 1'000'000'000};
        pollfd fds[2] = {{fd_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}};
        const int ready = ::ppoll(fds, 2, &wait, nullptr);
        if (ready < 0 && errno != EINTR) return ReportEvent::lost;
        if (ready > 0 && fds[1].revents != 0) {
            wake_.clear();
            return ReportEvent::nothing;
        }
        if (ready == 0) return ReportEvent::nothing;
    }
}

}  // namespace fovea::drivers::hid
