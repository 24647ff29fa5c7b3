// A daemon in a few lines, for tests of the client side: accepts, answers hellos, hands out its regions.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <functional>
#include <thread>
#include <vector>

#include "protocol/focus_region.hpp"
#include "protocol/frames_region.hpp"
#include "protocol/handshake.hpp"

namespace fovea::test {

inline UniqueFd listen_on(const std::string& path) {
    UniqueFd fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.data(), path.size());
    unlink(path.c_str());
    if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || listen(fd.get(), 8) != 0)
        return UniqueFd();
    return fd;
}

// The daemon without a thread: serve() answers one client, if one comes in time.
class TinyService {
public:
    using Answer = std::function<bool(int socket, const std::expected<Hello, Refusal>& hello)>;   // true: dealt with

    explicit TinyService(std::string path, const LossPolicy& policy = {}, Answer answer = {})
        : focus{FocusPublisher::create(policy, MonotonicClock::now()).value()},
          frames{FrameCollector::create().value()},
          path_{std::move(path)}, answer_{std::move(answer)}, listener_{listen_on(path_)} {
        EXPECT_TRUE(listener_);
    }
    ~TinyService() { unlink(path_.c_str()); }
    TinyService(const TinyService&) = delete;
    TinyService& operator=(const TinyService&) = delete;

    // False: wake_fd became readable (a negative one never does).
    bool serve(int timeout_ms, int wake_fd) {
        pollfd fds[2] = {{listener_.get(), POLLIN, 0}, {wake_fd, POLLIN, 0}};
        if (poll(fds, 2, timeout_ms) < 0 || fds[1].revents != 0) return false;
        if (fds[0].revents == 0) return true;
        UniqueFd client(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
        const auto message = receive_message(client.get());
        if (!message || !*message || (*message)->bytes.empty()) return true;
        const auto hello = decode_hello((*message)->bytes);
        if (answer_ && answer_(client.get(), hello)) return true;
        if (!hello) {
            (void)send_message(client.get(), encode(hello.error()));
            return true;
        }
        const int handed[] = {focus.fd(), frames.fd()};
        (void)send_message(client.get(), encode(Welcome{kGrantFocus, 2, clients_.size() + 1}), handed);
        clients_.push_back(std::move(client));
        return true;
    }

    FocusPublisher focus;
    FrameCollector frames;

private:
    std::string path_;
    Answer answer_;
    UniqueFd listener_;
    std::vector<UniqueFd> clients_;
};

// The same on a thread of its own.
class TinyDaemon : public TinyService {
public:
    explicit TinyDaemon(std::string path, const LossPolicy& policy = {}, Answer answer = {})
        : TinyService(std::move(path), policy, std::move(answer)), wake_{eventfd(0, EFD_CLOEXEC)},
          thread_{[this] {
              while (serve(-1, wake_.get())) {}
          }} {}
    ~TinyDaemon() {
        eventfd_write(wake_.get(), 1);
        thread_.join();
    }
    TinyDaemon(const TinyDaemon&) = delete;
    TinyDaemon& operator=(const TinyDaemon&) = delete;

private:
    UniqueFd wake_;
    std::thread thread_;
};

// A socket path of this test alone, in a directory that goes away with it.
class SocketDir {
public:
    SocketDir() {
        char name[] = "/tmp/fovea-test-XXXXXX";
        dir_ = mkdtemp(name);
    }
    ~SocketDir() {
        unlink(path().c_str());
        rmdir(dir_.c_str());
    }
    SocketDir(const SocketDir&) = delete;
    SocketDir& operator=(const SocketDir&) = delete;
    [[nodiscard]] std::string path() const { return dir_ + "/focus.sock"; }

private:
    std::string dir_;
};

}  // namespace fovea::test
