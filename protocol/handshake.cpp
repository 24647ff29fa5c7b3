#include "protocol/handshake.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

namespace fovea {
namespace {

enum class Kind : std::uint32_t { hello = 1, welcome = 2, refusal = 3 };

constexpr std::size_t kHeaderBytes = 16, kNameBytes = 64, kTextBytes = 512;
static_assert(kHelloBytes == 32 + kNameBytes && kRefusalBytes == 32 + kTextBytes);

// Both ends run on one machine, and every machine that Fovea runs on is little-endian.
static_assert(std::endian::native == std::endian::little);

template <class T>
void store(std::span<std::byte> message, std::size_t at, T value) noexcept {
    std::memcpy(message.data() + at, &value, sizeof value);
}
template <class T>
T load(std::span<const std::byte> message, std::size_t at) noexcept {
    T value;
    std::memcpy(&value, message.data() + at, sizeof value);
    return value;
}

void store_header(std::span<std::byte> message, Kind kind, std::uint32_t abi) noexcept {
    store(message, 0, kMessageMagic);
    store(message, 4, static_cast<std::uint32_t>(kind));
    store(message, 8, abi);
    store(message, 12, static_cast<std::uint32_t>(message.size()));
}

void store_text(std::span<std::byte> field, const std::string& text) noexcept {
    std::memcpy(field.data(), text.data(), std::min(text.size(), field.size() - 1));
}
// Up to the first NUL; bytes that would upset a terminal or a log become '?'.
std::string load_text(std::span<const std::byte> field) {
    std::string text;
    for (const std::byte b : field) {
        const auto c = static_cast<unsigned char>(b);
        if (c == 0) break;
        text.push_back(c < 0x20 || c == 0x7f ? '?' : static_cast<char>(c));
    }
    return text;
}

struct Header {
    Kind kind;
    std::uint32_t abi;
};
// Nothing unless the message is one of ours and has the size that it names.
std::optional<Header> header_of(std::span<const std::byte> message) noexcept {
    if (message.size() < kHeaderBytes || load<std::uint32_t>(message, 0) != kMessageMagic ||
        load<std::uint32_t>(message, 12) != message.size())
        return std::nullopt;
    return Header{static_cast<Kind>(load<std::uint32_t>(message, 4)), load<std::uint32_t>(message, 8)};
}

std::unexpected<ConnectFailure> failure(ConnectFault fault, std::string what, std::string where = {},
                                        std::string way_out = {}) {
    ConnectFailure f;
    f.what = std::move(what), f.where = std::move(where), f.way_out = std::move(way_out);
    f.fault = fault;
    return std::unexpected(std::move(f));
}
std::unexpected<ConnectFailure> failure(ConnectFault fault, Error error) {
    return failure(fault, std::move(error.what), std::move(error.where), std::move(error.way_out));
}

ConnectFault fault_of(RefusalReason reason) noexcept {
    switch (reason) {
        case RefusalReason::version: return ConnectFault::version;
        case RefusalReason::permission: return ConnectFault::permission;
        case RefusalReason::protocol: return ConnectFault::protocol;
        case RefusalReason::busy:
        case RefusalReason::internal: break;
    }
    return ConnectFault::system;
}

// The talk broke off with errno `code`: a daemon that ended in between, as in a restart, is as good as none.
std::unexpected<ConnectFailure> broken_off(Error error, int code, const std::string& path) {
    error.where = path;
    if (code != ECONNRESET && code != EPIPE) return failure(ConnectFault::protocol, std::move(error));
    error.way_out = "fovead has just ended: try again";
    return failure(ConnectFault::no_daemon, std::move(error));
}

enum class Waited : std::uint8_t { ready, timed_out, cancelled };
Waited wait_for(int socket, short events, Instant deadline, int cancel_fd) noexcept {
    for (;;) {
        const Duration left = deadline - MonotonicClock::now();
        const auto ms = std::chrono::ceil<std::chrono::milliseconds>(std::max(left, Duration{})).count();
        pollfd fds[2] = {{socket, events, 0}, {cancel_fd, POLLIN, 0}};   // a negative descriptor is skipped
        const int n = poll(fds, 2, static_cast<int>(std::min<std::int64_t>(ms, INT_MAX)));
        if (n > 0 && fds[1].revents != 0) return Waited::cancelled;
        if (n > 0) return Waited::ready;
        if (n == 0 && left <= Duration{}) return Waited::timed_out;
    }
}

}  // namespace

std::array<std::byte, kHelloBytes> encode(const Hello& hello) noexcept {
    std::array<std::byte, kHelloBytes> message{};
    store_header(message, Kind::hello, hello.abi);
    store(message, 16, hello.grants);
    store(message, 24, hello.pid);
    store_text(std::span(message).subspan<32, kNameBytes>(), hello.name);
    return message;
}

std::array<std::byte, kWelcomeBytes> encode(const Welcome& welcome) noexcept {
    std::array<std::byte, kWelcomeBytes> message{};
    store_header(message, Kind::welcome, kAbiVersion);
    store(message, 16, welcome.grants);
    store(message, 20, welcome.descriptors);
    store(message, 24, welcome.client_id);
    return message;
}

std::array<std::byte, kRefusalBytes> encode(const Refusal& refusal) noexcept {
    std::array<std::byte, kRefusalBytes> message{};
    store_header(message, Kind::refusal, kAbiVersion);
    store(message, 16, static_cast<std::uint32_t>(refusal.reason));
    store_text(std::span(message).subspan<32, kTextBytes>(), refusal.text);
    return message;
}

std::expected<Hello, Refusal> decode_hello(std::span<const std::byte> message) {
    const auto header = header_of(message);
    if (!header || header->kind != Kind::hello)
        return std::unexpected(Refusal{RefusalReason::protocol, "this is fovead; the message is no greeting of a Fovea client"});
    if (header->abi != kAbiVersion)
        return std::unexpected(Refusal{
            RefusalReason::version,
            "the client speaks ABI version " + std::to_string(header->abi) + ", this fovead speaks version " +
                std::to_string(kAbiVersion) + ": install " +
                (header->abi < kAbiVersion ? "the libfovea that came with this fovead and restart the app"
                                           : "a fovead as new as the app's libfovea and restart it")});
    if (message.size() != kHelloBytes)
        return std::unexpected(Refusal{RefusalReason::protocol, "the greeting has " + std::to_string(message.size()) +
                                                                    " bytes instead of " + std::to_string(kHelloBytes)});
    Hello hello;
    hello.grants = load<std::uint32_t>(message, 16);
    hello.pid = load<std::int64_t>(message, 24);
    hello.name = load_text(message.subspan(32, kNameBytes));
    if (hello.grants == 0 || (hello.grants & ~(kGrantFocus | kGrantSamples)) != 0)
        return std::unexpected(Refusal{RefusalReason::protocol, "the greeting asks for grants that do not exist"});
    return hello;
}

std::expected<Welcome, ConnectFailure> decode_answer(std::span<const std::byte> message) {
    const auto header = header_of(message);
    if (!header) return failure(ConnectFault::protocol, "the answer is not that of a fovead", {}, "check the socket path");
    if (header->kind == Kind::refusal && message.size() == kRefusalBytes)   // of any version: its layout never changes
        return failure(fault_of(static_cast<RefusalReason>(load<std::uint32_t>(message, 16))),
                       "fovead refuses: " + load_text(message.subspan(32, kTextBytes)));
    if (header->abi != kAbiVersion)
        return failure(ConnectFault::version,
                       "fovead speaks ABI version " + std::to_string(header->abi) + ", this library version " +
                           std::to_string(kAbiVersion),
                       {}, "install fovead and libfovea of the same release");
    if (header->kind != Kind::welcome || message.size() != kWelcomeBytes)
        return failure(ConnectFault::protocol, "the answer is no welcome of a fovead", {}, "check the socket path");
    Welcome welcome;
    welcome.grants = load<std::uint32_t>(message, 16);
    welcome.descriptors = load<std::uint32_t>(message, 20);
    welcome.client_id = load<std::uint64_t>(message, 24);
    return welcome;
}

Result<void> send_message(int socket, std::span<const std::byte> message, std::span<const int> fds) {
    FOVEA_REQUIRE(fds.size() <= kMaxDescriptors);
    iovec data{const_cast<std::byte*>(message.data()), message.size()};
    alignas(cmsghdr) char control[CMSG_SPACE(kMaxDescriptors * sizeof(int))] = {};
    msghdr m{};
    m.msg_iov = &data;
    m.msg_iovlen = 1;
    if (!fds.empty()) {
        m.msg_control = control;
        m.msg_controllen = CMSG_SPACE(fds.size_bytes());
        cmsghdr* c = CMSG_FIRSTHDR(&m);
        c->cmsg_level = SOL_SOCKET;
        c->cmsg_type = SCM_RIGHTS;
        c->cmsg_len = CMSG_LEN(fds.size_bytes());
        std::memcpy(CMSG_DATA(c), fds.data(), fds.size_bytes());
    }
    for (;;) {
        if (sendmsg(socket, &m, MSG_NOSIGNAL) >= 0) return {};
        if (errno != EINTR) return fail_errno("cannot send to the other side", errno);
    }
}

Result<std::optional<Message>> receive_message(int socket) {
    Message message;
    message.bytes.resize(kMaxMessageBytes);
    iovec data{message.bytes.data(), message.bytes.size()};
    // Room for more than we take, so that surplus descriptors arrive here and can be closed.
    alignas(cmsghdr) char control[CMSG_SPACE(16 * sizeof(int))] = {};
    msghdr m{};
    m.msg_iov = &data;
    m.msg_iovlen = 1;
    m.msg_control = control;
    m.msg_controllen = sizeof control;
    ssize_t n = 0;
    do n = recvmsg(socket, &m, MSG_CMSG_CLOEXEC);
    while (n < 0 && errno == EINTR);
    if (n < 0) {
        if (errno == EAGAIN || errno == EWOULDBLOCK) return std::nullopt;
        return fail_errno("cannot receive from the other side", errno);
    }
    for (cmsghdr* c = CMSG_FIRSTHDR(&m); c != nullptr; c = CMSG_NXTHDR(&m, c)) {
        if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS) continue;
        const std::size_t count = (c->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (std::size_t i = 0; i < count; ++i) {
            int fd = -1;
            std::memcpy(&fd, CMSG_DATA(c) + i * sizeof(int), sizeof fd);
            message.fds.emplace_back(fd);
        }
    }
    if (message.fds.size() > kMaxDescriptors || (m.msg_flags & MSG_CTRUNC) != 0)
        message.fds.clear();   // closes them: nobody of ours sends that many
    if ((m.msg_flags & MSG_TRUNC) != 0)
        return fail("a message is longer than " + std::to_string(kMaxMessageBytes) + " bytes", {},
                    "the other side is no Fovea program of this version");
    message.bytes.resize(static_cast<std::size_t>(n));
    return std::optional(std::move(message));
}

Result<PeerCredentials> peer_credentials(int socket) {
    ucred peer{};
    socklen_t size = sizeof peer;
    if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0)
        return fail_errno("cannot tell who is at the other end of the socket", errno);
    return PeerCredentials{peer.pid, peer.uid, peer.gid};
}

std::string default_socket_path() {
    if (const char* path = std::getenv("FOVEA_SOCKET"); path != nullptr && *path != '\0') return path;
    if (const char* dir = std::getenv("XDG_RUNTIME_DIR"); dir != nullptr && *dir != '\0')
        return std::string(dir) + "/fovea/focus.sock";
    return "/run/fovea/focus.sock";
}

std::expected<Connection, ConnectFailure> connect_to_daemon(const std::string& path, const Hello& hello,
                                                            Duration timeout, int cancel_fd) {
    const Instant deadline = MonotonicClock::now() + timeout;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path)
        return failure(ConnectFault::no_daemon,
                       path.empty() ? "the socket path is empty" : "the socket path is too long", path,
                       "use a path of 1 to " + std::to_string(sizeof address.sun_path - 1) + " bytes");
    std::memcpy(address.sun_path, path.data(), path.size());

    Connection connection;
    connection.socket.reset(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const int fd = connection.socket.get();
    if (fd < 0) return failure(ConnectFault::system, fail_errno("cannot make a socket", errno, path).error());
    if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        const int code = errno;
        const Error error = fail_errno("cannot connect to fovead", code, path).error();
        if (code == EACCES || code == EPERM)
            return failure(ConnectFault::permission, error.what, path, "ask for access to the socket (group or fovead's config)");
        if (code == EAGAIN)   // its backlog is full: it does not get to accepting
            return failure(ConnectFault::no_daemon, "fovead is too busy to accept", path, "try again");
        if (code == EPROTOTYPE || code == ENOTSOCK)
            return failure(ConnectFault::protocol, error.what, path, "this is not fovead's socket: check the path");
        return failure(ConnectFault::no_daemon, error.what, path, "start fovead, or set FOVEA_SOCKET to its socket");
    }

    const auto greeting = encode(hello);
    errno = 0;
    if (auto sent = send_message(fd, greeting); !sent) return broken_off(sent.error(), errno, path);
    std::optional<Message> answer;
    while (!answer) {
        switch (wait_for(fd, POLLIN, deadline, cancel_fd)) {
            case Waited::cancelled: return failure(ConnectFault::cancelled, "cancelled", path);
            case Waited::timed_out:
                return failure(ConnectFault::no_daemon, "fovead accepts but does not answer", path,
                               "see what fovead does: it may be stopped or overloaded");
            case Waited::ready: break;
        }
        errno = 0;
        auto received = receive_message(fd);
        if (!received) return broken_off(received.error(), errno, path);
        answer = std::move(*received);
    }
    if (answer->bytes.empty())
        return failure(ConnectFault::protocol, "the other side hung up without an answer", path,
                       "check that it is fovead's socket, and fovead's log");
    auto welcome = decode_answer(answer->bytes);
    if (!welcome) {
        welcome.error().where = path;
        return std::unexpected(std::move(welcome.error()));
    }
    // What was granted is what must have come: focus and frames, then samples.
    const std::size_t expected = ((welcome->grants & kGrantFocus) != 0 ? 2u : 0u) +
                                 ((welcome->grants & kGrantSamples) != 0 ? 1u : 0u);
    if ((welcome->grants & hello.grants) != hello.grants || answer->fds.size() != expected ||
        welcome->descriptors != expected)
        return failure(ConnectFault::protocol, "fovead's welcome does not bring what was asked for", path,
                       "install fovead and libfovea of the same release");
    connection.welcome = *welcome;
    std::size_t next = 0;
    if ((welcome->grants & kGrantFocus) != 0) {
        connection.focus = std::move(answer->fds[next++]);
        connection.frames = std::move(answer->fds[next++]);
    }
    if ((welcome->grants & kGrantSamples) != 0) connection.samples = std::move(answer->fds[next]);
    return connection;
}

}  // namespace fovea
