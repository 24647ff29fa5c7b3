// The handshake: how a client gets its descriptors from the daemon, over a Unix SOCK_SEQPACKET socket.
//
//   client                                    daemon
//   connect()                     --------->  accept(), peer_credentials() against the config
//   hello {abi, grants, name}     --------->  decode_hello()
//                                 <---------  welcome {grants, client id} + descriptors, or refusal {reason, text}; close
//   the socket stays open and silent: its end tells each side that the other is gone.
//
// Descriptors of a welcome, in this order: focus, frames (if kGrantFocus), samples (if kGrantSamples).
//
// Layout, little-endian: [0] u32 kMessageMagic  [4] u32 kind  [8] u32 abi  [12] u32 total size  - never changes
//   hello    (96)  [16] u32 grants wanted  [20] u32 0  [24] u64 process id as the client sees it  [32] name, 64, NUL-ended
//   welcome  (32)  [16] u32 grants given   [20] u32 number of descriptors  [24] u64 client id
//   refusal (544)  [16] u32 reason  [20] u32 0  [24] u64 0  [32] text, 512, NUL-ended                - never changes
//
// Threads: pure functions, and calls on a descriptor that the caller owns. All socket calls work on blocking and
// non-blocking descriptors; none raises SIGPIPE.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <expected>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/abi.hpp"
#include "protocol/clock.hpp"
#include "protocol/error.hpp"
#include "protocol/unique_fd.hpp"

namespace fovea {

inline constexpr std::uint32_t kGrantFocus = 1;     // focus and frames: what every app needs
inline constexpr std::uint32_t kGrantSamples = 2;   // raw samples: recorders and profilers

struct Hello {
    std::uint32_t abi = kAbiVersion;
    std::uint32_t grants = kGrantFocus;
    std::int64_t pid = 0;       // as the client sees itself; peer_credentials() is what counts
    std::string name;           // at most 63 bytes are sent
};
struct Welcome {
    std::uint32_t grants = kGrantFocus;
    std::uint32_t descriptors = 0;
    std::uint64_t client_id = 0;   // 1, 2, 3 ... per daemon start
};
enum class RefusalReason : std::uint32_t { protocol = 1, version = 2, permission = 3, busy = 4, internal = 5 };
struct Refusal {
    RefusalReason reason = RefusalReason::internal;
    std::string text;           // for people: what, and the way out; at most 511 bytes are sent
};

inline constexpr std::size_t kHelloBytes = 96, kWelcomeBytes = 32, kRefusalBytes = 544;
inline constexpr std::size_t kMaxMessageBytes = 1024;
inline constexpr std::size_t kMaxDescriptors = 4;

[[nodiscard]] std::array<std::byte, kHelloBytes> encode(const Hello& hello) noexcept;
[[nodiscard]] std::array<std::byte, kWelcomeBytes> encode(const Welcome& welcome) noexcept;
[[nodiscard]] std::array<std::byte, kRefusalBytes> encode(const Refusal& refusal) noexcept;

// The daemon's side: a hello, or the refusal to answer with (another ABI version: names both and the way out).
[[nodiscard]] std::expected<Hello, Refusal> decode_hello(std::span<const std::byte> message);

// What a client is told, or why it cannot be connected.
enum class ConnectFault : std::uint8_t { no_daemon, permission, version, protocol, system, cancelled };
struct ConnectFailure : Error {
    ConnectFault fault = ConnectFault::system;
};
[[nodiscard]] std::expected<Welcome, ConnectFailure> decode_answer(std::span<const std::byte> message);

// One message with descriptors. Errors: what sendmsg says (EAGAIN: a non-blocking socket is full; EPIPE: gone).
[[nodiscard]] Result<void> send_message(int socket, std::span<const std::byte> message, std::span<const int> fds = {});

struct Message {
    std::vector<std::byte> bytes;   // empty: the other side has closed
    std::vector<UniqueFd> fds;      // close-on-exec; more than kMaxDescriptors are closed at once
};
// Nothing when a non-blocking socket has no message yet. Errors: truncated message (over kMaxMessageBytes), recvmsg.
[[nodiscard]] Result<std::optional<Message>> receive_message(int socket);

struct PeerCredentials {
    pid_t pid = 0;
    uid_t uid = 0;
    gid_t gid = 0;
};
// Who connected, by the kernel (SO_PEERCRED).
[[nodiscard]] Result<PeerCredentials> peer_credentials(int socket);

// What a client has after the handshake. Closing `socket` is how it leaves.
struct Connection {
    UniqueFd socket, focus, frames, samples;   // samples: invalid unless granted
    Welcome welcome;
};

// $FOVEA_SOCKET, else $XDG_RUNTIME_DIR/fovea/focus.sock, else /run/fovea/focus.sock.
[[nodiscard]] std::string default_socket_path();

// Connects, introduces itself and waits for the answer, at most `timeout` in all. A readable cancel_fd ends it early.
[[nodiscard]] std::expected<Connection, ConnectFailure> connect_to_daemon(
    const std::string& path, const Hello& hello, Duration timeout = std::chrono::seconds(1), int cancel_fd = -1);

}  // namespace fovea
