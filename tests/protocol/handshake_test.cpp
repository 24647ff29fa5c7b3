#include "protocol/handshake.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <rapidcheck/gtest.h>
#include <sys/socket.h>

#include <array>
#include <thread>

#include "tests/protocol/tiny_daemon.hpp"

using namespace fovea;
using fovea::test::SocketDir;
using fovea::test::TinyDaemon;

namespace {

struct Pair {
    UniqueFd a, b;
    Pair() {
        int fds[2];
        EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, fds), 0);
        a.reset(fds[0]), b.reset(fds[1]);
    }
};

std::size_t open_descriptors() {
    std::size_t n = 0;
    DIR* dir = opendir("/proc/self/fd");
    while (readdir(dir) != nullptr) ++n;
    closedir(dir);
    return n;
}

template <std::size_t n>
std::array<std::byte, n> with_u32(std::array<std::byte, n> message, std::size_t at, std::uint32_t value) {
    std::memcpy(message.data() + at, &value, sizeof value);
    return message;
}

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST(Hello, SurvivesTheWay) {
    const Hello hello = decode_hello(encode(Hello{kAbiVersion, kGrantFocus | kGrantSamples, 4711, "viewer"})).value();
    EXPECT_EQ(hello.grants, kGrantFocus | kGrantSamples);
    EXPECT_EQ(hello.pid, 4711);
    EXPECT_EQ(hello.name, "viewer");
    Hello long_name;
    long_name.name = std::string(200, 'x');
    EXPECT_EQ(decode_hello(encode(long_name))->name, std::string(63, 'x'));
    Hello odd;
    odd.name = "a\x1b[2Jb\n";   // must not reach a terminal
    EXPECT_EQ(decode_hello(encode(odd))->name, "a?[2Jb?");
}

TEST(Hello, OfAnotherVersionIsRefusedByNamingBothAndTheWayOut) {
    for (const std::uint32_t version : {kAbiVersion - 1, kAbiVersion + 1}) {
        const auto refused = decode_hello(encode(Hello{version, kGrantFocus, 1, "old"}));
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().reason, RefusalReason::version);
        EXPECT_TRUE(contains(refused.error().text, ("ABI version " + std::to_string(version)).c_str()));
        EXPECT_TRUE(contains(refused.error().text, ("speaks version " + std::to_string(kAbiVersion)).c_str()));
        EXPECT_TRUE(contains(refused.error().text, "install"));
    }
    // A later version's greeting may have another size.
    std::array<std::byte, 200> larger{};
    const auto hello = encode(Hello{kAbiVersion + 1, 1, 1, ""});
    std::memcpy(larger.data(), hello.data(), hello.size());
    EXPECT_EQ(decode_hello(with_u32(larger, 12, 200)).error().reason, RefusalReason::version);
}

TEST(Hello, ThatIsNoneIsRefused) {
    const auto good = encode(Hello{});
    EXPECT_EQ(decode_hello({}).error().reason, RefusalReason::protocol);
    EXPECT_EQ(decode_hello(std::span(good).first(95)).error().reason, RefusalReason::protocol);
    EXPECT_EQ(decode_hello(with_u32(good, 0, 1)).error().reason, RefusalReason::protocol);
    EXPECT_EQ(decode_hello(with_u32(good, 4, 2)).error().reason, RefusalReason::protocol);
    EXPECT_EQ(decode_hello(with_u32(good, 12, 97)).error().reason, RefusalReason::protocol);
    EXPECT_EQ(decode_hello(with_u32(good, 16, 0)).error().reason, RefusalReason::protocol);
    EXPECT_EQ(decode_hello(with_u32(good, 16, 4)).error().reason, RefusalReason::protocol);
}

RC_GTEST_PROP(Hello, AnyBytesAreAnswered, (const std::vector<std::uint8_t>& bytes, bool ours)) {
    std::vector<std::uint8_t> message = bytes;
    if (ours && message.size() >= 16) {   // past the first checks
        const std::uint32_t header[] = {kMessageMagic, 1, kAbiVersion, static_cast<std::uint32_t>(message.size())};
        std::memcpy(message.data(), header, sizeof header);
    }
    (void)decode_hello(std::as_bytes(std::span(message)));
    (void)decode_answer(std::as_bytes(std::span(message)));
}

TEST(Answer, IsAWelcomeOrSaysWhyNot) {
    const Welcome welcome = decode_answer(encode(Welcome{3, 3, 12})).value();
    EXPECT_EQ(welcome.grants, 3u);
    EXPECT_EQ(welcome.client_id, 12u);
    const auto refused = decode_answer(encode(Refusal{RefusalReason::permission, "user 1000 may not"}));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().fault, ConnectFault::permission);
    EXPECT_TRUE(contains(refused.error().message(), "user 1000 may not"));
    // A refusal is understood whatever version it comes from; a welcome is not.
    EXPECT_TRUE(contains(decode_answer(with_u32(encode(Refusal{RefusalReason::version, "too new"}), 8, 99)).error().what, "too new"));
    EXPECT_EQ(decode_answer(with_u32(encode(Welcome{}), 8, 99)).error().fault, ConnectFault::version);
}

TEST(Message, CarriesDescriptorsThatStayOpenAndCloseOnExec) {
    Pair pair;
    EXPECT_FALSE(receive_message(pair.b.get()).value());   // nothing yet
    const int handed[] = {pair.a.get(), pair.b.get()};
    ASSERT_TRUE(send_message(pair.a.get(), encode(Welcome{1, 2, 5}), handed));
    const auto message = receive_message(pair.b.get()).value();
    ASSERT_TRUE(message);
    EXPECT_EQ(message->bytes.size(), kWelcomeBytes);
    ASSERT_EQ(message->fds.size(), 2u);
    EXPECT_EQ(fcntl(message->fds[1].get(), F_GETFD), FD_CLOEXEC);
}

TEST(Message, ClosesDescriptorsThatNobodyOrdered) {
    Pair pair;
    const std::size_t before = open_descriptors();
    for (const std::size_t count : {5u, 16u, 40u}) {   // a peer that floods us
        const std::byte byte{};
        iovec data{const_cast<std::byte*>(&byte), 1};
        std::vector<int> fds(count, pair.a.get());
        alignas(cmsghdr) char control[CMSG_SPACE(40 * sizeof(int))] = {};
        msghdr m{};
        m.msg_iov = &data, m.msg_iovlen = 1, m.msg_control = control, m.msg_controllen = CMSG_SPACE(count * sizeof(int));
        cmsghdr* c = CMSG_FIRSTHDR(&m);
        c->cmsg_level = SOL_SOCKET, c->cmsg_type = SCM_RIGHTS, c->cmsg_len = CMSG_LEN(count * sizeof(int));
        std::memcpy(CMSG_DATA(c), fds.data(), count * sizeof(int));
        ASSERT_EQ(sendmsg(pair.a.get(), &m, 0), 1);
        const auto message = receive_message(pair.b.get()).value();
        ASSERT_TRUE(message);
        EXPECT_EQ(message.value().fds.size(), 0u);
        EXPECT_EQ(open_descriptors(), before);
    }
}

TEST(Message, ThatIsTooLongOrFromAClosedSocketIsNoMessage) {
    Pair pair;
    const std::array<std::byte, kMaxMessageBytes + 1> big{};
    ASSERT_TRUE(send_message(pair.a.get(), big));
    EXPECT_FALSE(receive_message(pair.b.get()));
    pair.a.reset();
    EXPECT_TRUE(receive_message(pair.b.get()).value()->bytes.empty());
    EXPECT_FALSE(send_message(pair.b.get(), encode(Hello{})));   // and no SIGPIPE
}

TEST(PeerCredentials, NameThisProcess) {
    Pair pair;
    const PeerCredentials peer = peer_credentials(pair.a.get()).value();
    EXPECT_EQ(peer.pid, getpid());
    EXPECT_EQ(peer.uid, getuid());
    EXPECT_FALSE(peer_credentials(-1));
}

TEST(DefaultSocketPath, FollowsTheEnvironment) {
    setenv("FOVEA_SOCKET", "/x/y", 1);
    setenv("XDG_RUNTIME_DIR", "/run/user/7", 1);
    EXPECT_EQ(default_socket_path(), "/x/y");
    unsetenv("FOVEA_SOCKET");
    EXPECT_EQ(default_socket_path(), "/run/user/7/fovea/focus.sock");
    unsetenv("XDG_RUNTIME_DIR");
    EXPECT_EQ(default_socket_path(), "/run/fovea/focus.sock");
}

TEST(Connect, GetsTheRegionsOfADaemon) {
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    daemon.focus.publish(MotionModel{});
    const auto connection = connect_to_daemon(dir.path(), Hello{});
    ASSERT_TRUE(connection) << connection.error().message();
    EXPECT_EQ(FocusReader::map(connection->focus.get())->latest(), 1u);
    EXPECT_TRUE(FrameReporter::map(connection->frames.get()));
    EXPECT_FALSE(connection->samples);
}

TEST(Connect, SaysWhyItCannotAndWhatToDo) {
    const SocketDir dir;
    const auto fault = [&](const Hello& hello = {}) { return connect_to_daemon(dir.path(), hello).error(); };
    EXPECT_EQ(fault().fault, ConnectFault::no_daemon);
    EXPECT_TRUE(contains(fault().message(), "start fovead"));
    EXPECT_TRUE(contains(fault().message(), dir.path().c_str()));
    EXPECT_EQ(connect_to_daemon(std::string(200, 'x'), {}).error().fault, ConnectFault::no_daemon);
    EXPECT_EQ(connect_to_daemon("", {}).error().fault, ConnectFault::no_daemon);
    {
        TinyDaemon daemon(dir.path());
        const ConnectFailure other = fault(Hello{kAbiVersion + 1, kGrantFocus, 1, "new"});
        EXPECT_EQ(other.fault, ConnectFault::version);
        for (const auto version : {kAbiVersion, kAbiVersion + 1})
            EXPECT_TRUE(contains(other.what, ("version " + std::to_string(version)).c_str())) << other.what;
    }
    {   // grants raw samples to nobody
        TinyDaemon daemon(dir.path(), {}, [](int socket, const auto& hello) {
            if (!hello || (hello->grants & kGrantSamples) == 0) return false;
            (void)send_message(socket, encode(Refusal{RefusalReason::permission, "raw samples are not granted to you"}));
            return true;
        });
        EXPECT_EQ(fault(Hello{kAbiVersion, kGrantFocus | kGrantSamples, 1, "nosy"}).fault, ConnectFault::permission);
    }
    {   // welcomes without what was asked for
        TinyDaemon daemon(dir.path(), {}, [](int socket, const auto&) {
            return send_message(socket, encode(Welcome{kGrantFocus, 2, 1})).has_value();
        });
        EXPECT_EQ(fault().fault, ConnectFault::protocol);
    }
    {   // talks about something else
        TinyDaemon daemon(dir.path(), {}, [](int socket, const auto&) {
            return send_message(socket, std::as_bytes(std::span("HTTP/1.1 400 Bad Request"))).has_value();
        });
        EXPECT_EQ(fault().fault, ConnectFault::protocol);
    }
}

TEST(Connect, TakesADaemonThatEndsBeforeItAnswersForAnAbsentOne) {
    const SocketDir dir;
    UniqueFd listening = fovea::test::listen_on(dir.path());
    std::thread ends([&] {
        pollfd p{listening.get(), POLLIN, 0};   // a client has connected
        EXPECT_EQ(poll(&p, 1, -1), 1);
        listening.reset();
    });
    const auto connection = connect_to_daemon(dir.path(), {}, std::chrono::hours(1));
    ends.join();
    ASSERT_FALSE(connection);
    EXPECT_EQ(connection.error().fault, ConnectFault::no_daemon) << connection.error().message();   // FOVEA_CONNECT_WAIT goes on trying
}

TEST(Connect, GivesUpOnADaemonThatNeverAnswersAndWhenCancelled) {
    const SocketDir dir;
    const UniqueFd silent = fovea::test::listen_on(dir.path());
    EXPECT_EQ(connect_to_daemon(dir.path(), {}, std::chrono::milliseconds(20)).error().fault, ConnectFault::no_daemon);
    Pair pair;
    pair.a.reset();   // readable at once
    EXPECT_EQ(connect_to_daemon(dir.path(), {}, std::chrono::hours(1), pair.b.get()).error().fault, ConnectFault::cancelled);
}
