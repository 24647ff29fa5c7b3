// A real fovead and its clients: the C example, other versions, hostile ones, other users, and what survives a kill.
#include <fovea/fovea.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "protocol/focus_region.hpp"
#include "protocol/frames_region.hpp"
#include "protocol/handshake.hpp"
#include "replay/session_file.hpp"
#include "tests/daemon/daemon_process.hpp"
#include "tests/protocol/two_processes.hpp"

namespace fovea {
namespace {

using test::Child;
using test::DaemonProcess;
using test::eventually;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr unsigned kNobody = 65534;

std::expected<Connection, ConnectFailure> connect_raw(const std::string& path, std::uint32_t grants = kGrantFocus,
                                                      std::uint32_t abi = kAbiVersion) {
    return connect_to_daemon(path, {.abi = abi, .grants = grants, .pid = ::getpid(), .name = "test"}, std::chrono::seconds(20));
}

UniqueFd connect_silently(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    UniqueFd fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::connect(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return fd;
}

// A frame report that passes all checks.
FrameTiming good_frame(std::uint64_t number) {
    FrameTiming t;
    t.frame = number;
    t.latched = t.submitted = t.gpu_done = t.photon = MonotonicClock::now();
    t.predicted_photon = t.photon;
    t.pixels_full = 100;
    t.pixels_shaded = 40;
    t.view_count = 1;
    t.views[0].half_width_ndc = t.views[0].half_height_ndc = 0.5;
    return t;
}

// A libfovea client as an app has it.
struct App {
    explicit App(const std::string& path) {
        fovea_connect_info info;
        FOVEA_INIT(&info);
        info.socket_path = path.c_str();
        info.client_name = "app";
        result = fovea_connect(&info, &client);
    }
    ~App() { fovea_disconnect(client); }
    App(const App&) = delete;
    App& operator=(const App&) = delete;

    // Latches one view for now; the info of that latch.
    [[nodiscard]] fovea_latch_info latch() const {
        fovea_view view;
        FOVEA_INIT(&view);
        view.tan_left = view.tan_down = -1;
        view.tan_right = view.tan_up = 1;
        view.head_from_view[0] = 1;
        fovea_focal focal;
        FOVEA_INIT(&focal);
        fovea_latch_info info;
        FOVEA_INIT(&info);
        EXPECT_EQ(fovea_latch(client, fovea_now_ns(), &view, 1, &focal, &info), FOVEA_OK);
        return info;
    }
    [[nodiscard]] bool live() const { return (latch().flags & FOVEA_LATCH_LIVE) != 0; }
    [[nodiscard]] fovea_status status() const {
        fovea_status s;
        FOVEA_INIT(&s);
        fovea_get_status(client, &s);
        return s;
    }
    fovea_client* client = nullptr;
    fovea_result result;
};

class RealDaemon : public testing::Test {
protected:
    // Starts it and insists that it came up.
    void start(const test::DaemonOptions& options = {}) {
        daemon = std::make_unique<DaemonProcess>(folder, options);
        ASSERT_TRUE(daemon->ready()) << daemon->log();
    }
    TemporaryFolder folder;
    std::unique_ptr<DaemonProcess> daemon;
};

TEST_F(RealDaemon, ServesTheExampleInC99) {
    start({.arguments = {"--set", "source.loop=true"}});
    ASSERT_TRUE(eventually([&] { return daemon->number("published") > 0; }));
    const test::Finished client = test::run_program({FOVEA_BIN_DIR "/fovea_c_client", daemon->focus_socket()});
    EXPECT_EQ(client.code, 0) << client.out << client.error;
    EXPECT_THAT(client.out, HasSubstr("live"));
    ASSERT_TRUE(eventually([&] { return daemon->ask("status").find("\"gone_frames\":{\"accepted\":100,") != std::string::npos; }))
        << daemon->ask("status");
}

TEST(RealDaemonStart, AdmitsClientsFromItsFirstMoment) {
    for (int round = 0; round < 10; ++round) {
        const TemporaryFolder folder;
        std::atomic<bool> done{false};
        std::thread eager([&] {  // in the queue before the daemon first looks at it
            std::vector<Connection> connections;
            while (!done.load())
                if (auto c = connect_raw(folder / "focus.sock")) connections.push_back(std::move(*c));
        });
        DaemonProcess daemon(folder, {.arguments = {"--set", "server.max_clients=8"}});
        const bool up = daemon.ready() && eventually([&] { return daemon.number("connected") >= 1; });
        done = true;
        eager.join();
        ASSERT_TRUE(up) << daemon.log();
        EXPECT_EQ(daemon.stop(SIGTERM), 0) << daemon.log();
    }
}

TEST_F(RealDaemon, TellsAClientOfAnotherAbiBothVersions) {
    start();
    const auto refused = connect_raw(daemon->focus_socket(), kGrantFocus, kAbiVersion + 41);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().fault, ConnectFault::version);
    EXPECT_THAT(refused.error().message(), HasSubstr(std::to_string(kAbiVersion)));
    EXPECT_THAT(refused.error().message(), HasSubstr(std::to_string(kAbiVersion + 41)));
    EXPECT_TRUE(connect_raw(daemon->focus_socket()));   // and serves the next one
}

TEST_F(RealDaemon, GivesRawSamplesOnlyOnRequest) {
    start();
    const auto app = connect_raw(daemon->focus_socket());
    ASSERT_TRUE(app);
    EXPECT_FALSE(app->samples);
    const auto profiler = connect_raw(daemon->focus_socket(), kGrantFocus | kGrantSamples);
    ASSERT_TRUE(profiler);
    EXPECT_TRUE(profiler->samples);
    EXPECT_THAT(daemon->ask("status"), HasSubstr("\"reads_samples\":true"));
}

TEST_F(RealDaemon, RefusesGrantsThatDoNotExist) {
    start();
    for (const std::uint32_t grants : {0u, 4u, 0x80000001u}) EXPECT_FALSE(connect_raw(daemon->focus_socket(), grants)) << grants;
}

TEST_F(RealDaemon, RefusesMoreClientsThanConfiguredAndAdmitsTheNextWhenOneLeaves) {
    start({.arguments = {"--set", "server.max_clients=2"}});
    auto a = connect_raw(daemon->focus_socket()), b = connect_raw(daemon->focus_socket());
    ASSERT_TRUE(a && b);
    const auto c = connect_raw(daemon->focus_socket());
    ASSERT_FALSE(c);
    EXPECT_THAT(c.error().message(), HasSubstr("max_clients"));
    a->socket.reset();
    EXPECT_TRUE(eventually([&] { return connect_raw(daemon->focus_socket()).has_value(); }));
}

TEST_F(RealDaemon, IsNotDisturbedByHostileClients) {
    start({.arguments = {"--set", "source.loop=true"}});
    const App good(daemon->focus_socket());
    ASSERT_EQ(good.result, FOVEA_OK);

    // Garbage instead of a hello: short, long, huge, and with the right beginning.
    std::vector<UniqueFd> kept;
    for (const std::size_t size : {std::size_t{1}, std::size_t{15}, std::size_t{96}, std::size_t{1024}, std::size_t{100'000}}) {
        UniqueFd fd = connect_silently(daemon->focus_socket());
        std::vector<char> garbage(size, '\x7f');
        std::memcpy(garbage.data(), &kMessageMagic, std::min(size, sizeof kMessageMagic));
        EXPECT_EQ(::send(fd.get(), garbage.data(), size, MSG_NOSIGNAL), static_cast<ssize_t>(size));
        kept.push_back(std::move(fd));   // and never reads the answer
    }
    // A crowd that never says anything: turned away after a second, and never more than 64 of them at once.
    for (int i = 0; i < 200; ++i) kept.push_back(connect_silently(daemon->focus_socket()));
    EXPECT_TRUE(eventually([&] { return daemon->number("misbehaved") >= 1; }));

    // An index far away, over and over, from a connected client; reports that are nonsense.
    std::expected<Connection, ConnectFailure> liar = std::unexpected(ConnectFailure{});
    ASSERT_TRUE(eventually([&] { return (liar = connect_raw(daemon->focus_socket())).has_value(); }));
    Result<SharedMemory> memory = SharedMemory::map(liar->frames.get(), Access::client_writes, sizeof(FramesRegion), 1u << 24);
    ASSERT_TRUE(memory) << memory.error().message();
    auto& region = *reinterpret_cast<FramesRegion*>(memory->data());
    for (auto& slot : region.slots)
        for (Word& word : slot) word.store(~0ull);
    const auto faults = [&] {
        const std::string status = daemon->ask("status");
        double sum = 0;
        for (const char* name : {"\"bad_index\":", "\"bad_values\":", "\"bad_instants\":"})
            for (std::size_t at = status.find(name); at != std::string::npos; at = status.find(name, at + 1))
                sum += std::atof(status.c_str() + at + std::strlen(name));
        return sum;
    };
    std::uint64_t head = 200;   // within the ring: 200 records of nonsense; then far outside it
    for (const std::uint64_t jump : {std::uint64_t{0}, std::uint64_t{1000}, std::uint64_t{1} << 40, ~std::uint64_t{0} / 2}) {
        const double before = faults();
        head += jump;
        region.capacity.store(~head);
        region.tail.store(head / 2);
        region.head.store(head);
        EXPECT_TRUE(eventually([&] { return faults() > before; })) << "head " << head << " was not looked at";
    }

    // The good client goes on through all of it: live, and its reports arrive.
    EXPECT_TRUE(eventually([&] { return good.live(); }));
    fovea_frame frame;
    FOVEA_INIT(&frame);
    frame.flags = FOVEA_FRAME_PHOTON_SIMULATED;
    frame.frame = 7777;
    frame.pixels_full = 100;
    frame.view_count = 1;
    FOVEA_INIT(&frame.views[0]);
    frame.views[0].tan_left = frame.views[0].tan_down = -1;
    frame.views[0].tan_right = frame.views[0].tan_up = 1;
    frame.views[0].head_from_view[0] = 1;
    frame.foveas[0].half_width_ndc = frame.foveas[0].half_height_ndc = 0.5f;
    frame.latch = good.latch();
    frame.submitted_ns = frame.gpu_done_ns = frame.photon_ns = fovea_now_ns();
    EXPECT_EQ(fovea_submit_frame(good.client, &frame), FOVEA_OK) << fovea_last_error(good.client);
    EXPECT_TRUE(eventually([&] { return daemon->ask("status").find("\"newest_frame\":7777") != std::string::npos; }));
    EXPECT_EQ(good.status().connects, 1u) << "the good client was disconnected";
    EXPECT_EQ(daemon->stop(SIGTERM), 0) << daemon->log();
}

TEST_F(RealDaemon, KeepsTheLastReportsOfAClientThatWasKilled) {
    start();
    int said[2], told[2];
    ASSERT_EQ(::pipe(said), 0);
    ASSERT_EQ(::pipe(told), 0);
    Child app([&] {
        char byte = 'x';
        auto c = connect_raw(daemon->focus_socket());
        if (!c) return 1;
        auto reporter = FrameReporter::map(c->frames.get());
        if (!reporter) return 2;
        if (::write(said[1], &byte, 1) != 1 || ::read(told[0], &byte, 1) != 1) return 3;
        for (std::uint64_t n = 1; n <= 20; ++n)
            if (!reporter->submit(good_frame(n))) return 4;
        if (::write(said[1], &byte, 1) != 1) return 5;
        ::pause();
        return 0;
    });
    char byte = 0;
    ASSERT_EQ(::read(said[0], &byte, 1), 1);
    daemon->send(SIGSTOP);   // so that no look in passing drains them: only the end of the client can
    ASSERT_EQ(::write(told[1], "x", 1), 1);
    ASSERT_EQ(::read(said[0], &byte, 1), 1);
    app.kill_and_wait();
    daemon->send(SIGCONT);
    EXPECT_TRUE(eventually([&] { return daemon->ask("status").find("\"gone_frames\":{\"accepted\":20,") != std::string::npos; }))
        << daemon->ask("status");
    EXPECT_THAT(daemon->ask("status"), HasSubstr("\"clients\":[]"));
    EXPECT_TRUE(connect_raw(daemon->focus_socket()));
    for (const int fd : {said[0], said[1], told[0], told[1]}) ::close(fd);
}

TEST_F(RealDaemon, DisconnectsAClientThatTalksAfterItsHello) {
    start();
    const auto talker = connect_raw(daemon->focus_socket());
    ASSERT_TRUE(talker);
    const char more[64] = {};
    ASSERT_EQ(::send(talker->socket.get(), more, sizeof more, MSG_NOSIGNAL), static_cast<ssize_t>(sizeof more));
    char answer[64];
    pollfd p{talker->socket.get(), POLLIN, 0};
    ASSERT_EQ(::poll(&p, 1, 30'000), 1) << "it is still connected";
    EXPECT_EQ(::recv(talker->socket.get(), answer, sizeof answer, MSG_DONTWAIT), 0);
    EXPECT_EQ(daemon->number("misbehaved"), 1);
}

// Tries to connect as another user: 0 admitted, 1 refused for want of permission, 2 anything else.
int connect_as(unsigned uid, const std::string& path, std::uint32_t grants) {
    Child other([&] {
        if (::setgid(uid) != 0 || ::setuid(uid) != 0) return 3;
        const auto c = connect_raw(path, grants);
        if (c) return 0;
        return c.error().fault == ConnectFault::permission ? 1 : 2;
    });
    return other.wait();
}

TEST_F(RealDaemon, AdmitsOnlyTheUsersOfItsConfig) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can be another user";
    ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
    start({.config = "[server]\nuids = [12345]\nsample_uids = [12346]\n"});
    EXPECT_EQ(connect_as(12345, daemon->focus_socket(), kGrantFocus), 0);
    EXPECT_EQ(connect_as(12345, daemon->focus_socket(), kGrantFocus | kGrantSamples), 1);
    EXPECT_EQ(connect_as(kNobody, daemon->focus_socket(), kGrantFocus), 1);
    EXPECT_EQ(connect_as(12346, daemon->focus_socket(), kGrantSamples), 1) << "sample_uids alone admits nobody";
    EXPECT_THAT(daemon->log(), HasSubstr("does not admit user 65534 (add 65534 to uids in [server] of its config)"));
}

TEST_F(RealDaemon, KeepsAllOtherUsersOutByDefault) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can be another user";
    ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
    start();
    EXPECT_EQ(connect_as(kNobody, daemon->focus_socket(), kGrantFocus), 1);
}

TEST_F(RealDaemon, AppsGoOnByThemselvesAfterItIsKilledAndStartedAgain) {
    start({.arguments = {"--set", "source.loop=true"}});
    const App app(daemon->focus_socket());
    ASSERT_EQ(app.result, FOVEA_OK) << fovea_last_error(nullptr);
    ASSERT_TRUE(eventually([&] { return app.live(); }));

    EXPECT_EQ(daemon->stop(SIGKILL), -SIGKILL);
    EXPECT_THAT(folder.names(), testing::Contains("focus.sock")) << "a killed daemon cannot have removed its socket";
    ASSERT_TRUE(eventually([&] { return !app.live(); }));

    start({.arguments = {"--set", "source.loop=true"}});   // takes the stale socket over
    ASSERT_TRUE(eventually([&] { return app.live(); }));
    EXPECT_GE(app.status().connects, 2u);
}

TEST_F(RealDaemon, AKilledOneLosesNothingThatWasRecorded) {
    const test::DaemonOptions options{.arguments = {"--set", "source.loop=true", "--record", folder / "s.fovea"}};
    start(options);
    ASSERT_TRUE(eventually([&] { return daemon->number("published") > 500; }));
    // Committed, as another reader of the file sees it.
    const auto rows = [&](const char* name) {
        std::size_t n = 0;
        const auto session = replay::SessionReader::open(folder / name);
        if (session) static_cast<void>(session->samples([&](const replay::RecordedSample&) { return ++n, true; }));
        return n;
    };
    ASSERT_TRUE(eventually([&] { return rows("s.fovea") >= 300; }));
    const std::size_t before = rows("s.fovea");
    EXPECT_EQ(daemon->stop(SIGKILL), -SIGKILL);
    EXPECT_GE(rows("s.fovea"), before);
    const auto killed = replay::SessionReader::open(folder / "s.fovea");
    ASSERT_TRUE(killed) << killed.error().message();
    EXPECT_FALSE(killed->finished());
    const std::size_t kept = rows("s.fovea");

    start(options);   // the same command line again
    ASSERT_TRUE(eventually([&] { return rows("s-2.fovea") >= 1; }));
    EXPECT_EQ(daemon->stop(SIGTERM), 0) << daemon->log();
    EXPECT_EQ(rows("s.fovea"), kept) << "the restart changed what was recorded";
    const auto second = replay::SessionReader::open(folder / "s-2.fovea");
    ASSERT_TRUE(second) << second.error().message();
    EXPECT_TRUE(second->finished());
}

}  // namespace
}  // namespace fovea
