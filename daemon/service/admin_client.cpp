#include "daemon/service/admin_client.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "protocol/handshake.hpp"

namespace fovea::service {
namespace {

constexpr std::size_t kLongestAnswer = 16u << 20;  // a thousand clients take less than one MiB

std::unexpected<AskFailure> failure(Error error, bool no_daemon = false) {
    return std::unexpected(AskFailure{{std::move(error)}, no_daemon});
}

// False: the deadline has passed.
bool wait_for(int fd, short events, Instant deadline) {
    for (;;) {
        const Duration left = std::max(deadline - MonotonicClock::now(), Duration{0});
        pollfd p{fd, events, 0};
        const int got = ::poll(&p, 1, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count()));
        if (got > 0) return true;
        if (got == 0 || errno != EINTR) return false;
    }
}

}  // namespace

std::string default_admin_path() {
    return (std::filesystem::path(default_socket_path()).parent_path() / "admin.sock").string();
}

std::expected<std::string, AskFailure> ask_daemon(const std::string& path, const std::string& line, Duration timeout) {
    const Instant deadline = MonotonicClock::now() + timeout;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path)
        return failure({"a socket path has 1 to 107 bytes", path, "give the daemon a shorter --run-dir"});
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!fd) return failure(fail_errno("cannot make a socket", errno).error());
    while (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        if (errno == EINTR) continue;
        if (errno == ENOENT || errno == ENOTDIR || errno == ECONNREFUSED)
            return failure({"no fovead is running here", path, "start one, or say where it is with --run-dir or --socket"}, true);
        if (errno == EACCES || errno == EPERM)
            return failure({"you may not ask this fovead", path, "only root and the user who runs fovead may"});
        if (errno != EAGAIN) return failure(fail_errno("cannot connect", errno, path).error());
        if (MonotonicClock::now() >= deadline) return failure({"fovead does not accept connections", path, "is it stopped?"});
        ::poll(nullptr, 0, 10);  // its queue is full: try again
    }
    const std::string request = line + "\n";
    std::size_t sent = 0;
    std::string answer;
    const auto silent = [&] { return failure({"fovead does not answer", path, "is it stopped (kill -STOP) or overloaded?"}); };
    while (sent < request.size()) {
        if (!wait_for(fd.get(), POLLOUT, deadline)) return silent();
        const ssize_t n = ::send(fd.get(), request.data() + sent, request.size() - sent, MSG_NOSIGNAL);
        if (n > 0) sent += static_cast<std::size_t>(n);
        if (n < 0 && errno != EINTR && errno != EAGAIN) break;  // refused: the read below says so
    }
    while (!answer.ends_with('\n')) {
        if (!wait_for(fd.get(), POLLIN, deadline)) return silent();
        char buffer[4096];
        const ssize_t n = ::recv(fd.get(), buffer, sizeof buffer, 0);
        if (n < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (n <= 0) return failure({"fovead closed the connection without an answer", path, "only root and the user who runs fovead may ask it"});
        answer.append(buffer, static_cast<std::size_t>(n));
        if (answer.size() > kLongestAnswer) return failure({"this is no fovead: its answer has no end", path, ""});
    }
    answer.pop_back();
    return answer;
}

}  // namespace fovea::service
