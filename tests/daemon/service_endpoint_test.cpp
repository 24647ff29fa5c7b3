// Who owns a socket path, and what happens to what lies there.
#include "daemon/service/endpoint.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <cstring>
#include <fstream>
#include <thread>

#include <boost/asio/io_context.hpp>

#include "daemon/service/client_server.hpp"
#include "tests/daemon/daemon_process.hpp"

namespace fovea::service {
namespace {

using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

Result<Endpoint> listen(const std::string& path, mode_t mode = 0600) { return Endpoint::listen(path, SOCK_SEQPACKET, mode); }

bool connects(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    UniqueFd fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    return ::connect(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
}

// A bound and listening socket whose owner is gone.
void leave_a_stale_socket(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    UniqueFd fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    ASSERT_EQ(::bind(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(::listen(fd.get(), 1), 0);
}

TEST(Endpoint, ListensAndRemovesWhatItMade) {
    const TemporaryFolder folder;
    const std::string path = folder / "s";
    {
        const Result<Endpoint> e = listen(path);
        ASSERT_TRUE(e) << e.error().message();
        EXPECT_TRUE(connects(path));
        struct stat s {};
        ASSERT_EQ(::stat(path.c_str(), &s), 0);
        EXPECT_EQ(s.st_mode & 0777, 0600u);
    }
    EXPECT_THAT(folder.names(), ElementsAre());
}

unsigned mode_of(const std::string& path) {
    struct stat s {};
    return ::stat(path.c_str(), &s) == 0 ? s.st_mode & 0777 : 0;
}

TEST(Endpoint, AFolderThatItMakesLetsThroughWhomTheSocketAdmits) {
    const TemporaryFolder folder;
    const std::string path = folder / "run/fovea/s";
    const Result<Endpoint> e = listen(path);
    ASSERT_TRUE(e) << e.error().message();
    EXPECT_EQ(mode_of(folder / "run"), 0700u);
    EXPECT_EQ(mode_of(folder / "run/fovea"), 0700u);
    ASSERT_TRUE(e->set_mode(0666));
    EXPECT_EQ(mode_of(path), 0666u);
    EXPECT_EQ(mode_of(folder / "run"), 0711u);
    EXPECT_EQ(mode_of(folder / "run/fovea"), 0711u);
    const Result<Endpoint> open = listen(folder / "open/s", 0666);
    ASSERT_TRUE(open) << open.error().message();
    EXPECT_EQ(mode_of(folder / "open"), 0711u);
    EXPECT_EQ(mode_of(folder.path()), 0700u) << "one that was there stays as it was";
}

TEST(ClientServer, AcceptsFewAtOnceSoThatAFloodKeepsNobodyWaiting) {
    const TemporaryFolder folder;
    const Result<Endpoint> endpoint = listen(folder / "s");
    ASSERT_TRUE(endpoint);
    Result<SamplesPublisher> samples = SamplesPublisher::create({}, 1);
    ASSERT_TRUE(samples);
    const SystemTime time;
    boost::asio::io_context io{1};
    ClientServer server(io, *endpoint, {.focus_fd = -1, .samples = *samples}, {}, time, [] {});
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, endpoint->path().c_str());
    std::vector<UniqueFd> flood;
    for (int i = 0; i < 100; ++i) {
        flood.emplace_back(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
        ASSERT_EQ(::connect(flood.back().get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    }
    ASSERT_EQ(io.run_one(), 1u);
    EXPECT_EQ(server.counters().refused, 0u) << "one turn took in more than the 64 that may wait with a greeting";
}

TEST(Endpoint, RefusesTheSecondOwnerAndKeepsTheFirst) {
    const TemporaryFolder folder;
    const Result<Endpoint> first = listen(folder / "s");
    ASSERT_TRUE(first);
    const Result<Endpoint> second = listen(folder / "s");
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().what, StartsWith(Endpoint::kInUse));
    EXPECT_EQ(second.error().where, folder / "s");
    EXPECT_THAT(second.error().way_out, HasSubstr("--run-dir"));
    EXPECT_TRUE(connects(folder / "s"));
}

TEST(Endpoint, TakesOverTheSocketOfAKilledOwner) {
    const TemporaryFolder folder;
    leave_a_stale_socket(folder / "s");
    std::ofstream(folder / "s.lock") << "";   // the lock file is left as well; the lock on it is not
    const Result<Endpoint> e = listen(folder / "s");
    ASSERT_TRUE(e) << e.error().message();
    EXPECT_TRUE(connects(folder / "s"));
}

TEST(Endpoint, LeavesAFileThatIsNoSocketAlone) {
    const TemporaryFolder folder;
    std::ofstream(folder / "s") << "precious";
    const Result<Endpoint> e = listen(folder / "s");
    ASSERT_FALSE(e);
    EXPECT_THAT(e.error().what, HasSubstr("no socket"));
    std::string kept;
    std::ifstream(folder / "s") >> kept;
    EXPECT_EQ(kept, "precious");
}

TEST(Endpoint, RefusesASocketThatAnotherProgramServes) {
    const TemporaryFolder folder;
    const std::string path = folder / "s";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    for (const int type : {SOCK_SEQPACKET, SOCK_STREAM}) {
        UniqueFd stranger(::socket(AF_UNIX, type | SOCK_CLOEXEC, 0));
        ASSERT_EQ(::bind(stranger.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        ASSERT_EQ(::listen(stranger.get(), 1), 0);
        const Result<Endpoint> e = listen(path);
        ASSERT_FALSE(e);
        EXPECT_THAT(e.error().what, HasSubstr("another program"));
        ::unlink(path.c_str());
    }
}

TEST(Endpoint, RemovesOnlyItsOwnSocket) {
    const TemporaryFolder folder;
    {
        const Result<Endpoint> e = listen(folder / "s");
        ASSERT_TRUE(e);
        std::filesystem::rename(folder / "s", folder / "moved");   // keeps the inode number from being reused
        leave_a_stale_socket(folder / "s");
    }
    EXPECT_THAT(folder.names(), ElementsAre("moved", "s"));
}

TEST(Endpoint, MakesMissingFoldersForTheUserAlone) {
    const TemporaryFolder folder;
    const Result<Endpoint> e = listen((folder.path() / "a" / "b" / "s").string());
    ASSERT_TRUE(e) << e.error().message();
    struct stat s {};
    ASSERT_EQ(::stat((folder.path() / "a" / "b").c_str(), &s), 0);
    EXPECT_EQ(s.st_mode & 0777, 0700u);
}

TEST(Endpoint, ExplainsAPathThatIsTooLong) {
    const TemporaryFolder folder;
    const Result<Endpoint> e = listen((folder.path() / std::string(120, 'x')).string());
    ASSERT_FALSE(e);
    EXPECT_THAT(e.error().what, HasSubstr("1 to 107 bytes"));
}

TEST(Endpoint, ExplainsAFileInPlaceOfTheFolder) {
    const TemporaryFolder folder;
    std::ofstream(folder / "f") << "";
    const Result<Endpoint> e = listen((folder.path() / "f" / "s").string());
    ASSERT_FALSE(e);
    EXPECT_THAT(e.error().what, HasSubstr("not a folder"));
}

TEST(Endpoint, OfManyWhoAskAtOnceOneGetsIt) {
    const TemporaryFolder folder;
    for (int round = 0; round < 50; ++round) {
        std::atomic<int> owners{0}, most{0}, found_a_listener{0};
        std::vector<std::thread> threads;
        for (int t = 0; t < 4; ++t)
            threads.emplace_back([&] {
                for (int i = 0; i < 20; ++i) {
                    const Result<Endpoint> e = listen(folder / "s");
                    if (!e) {
                        // Past the lock nobody can be found listening: that would be a second owner.
                        found_a_listener += e.error().what.starts_with("another program");
                        continue;
                    }
                    const int now = owners.fetch_add(1) + 1;
                    int seen = most.load();
                    while (now > seen && !most.compare_exchange_weak(seen, now)) {}
                    owners.fetch_sub(1);
                }
            });
        for (std::thread& t : threads) t.join();
        ASSERT_LE(most.load(), 1);
        ASSERT_EQ(found_a_listener.load(), 0);
    }
}

}  // namespace
}  // namespace fovea::service
