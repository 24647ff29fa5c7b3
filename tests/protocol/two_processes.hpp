// Runs a function in a forked child and ends it for good. For tests that need a second process.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

namespace fovea::test {

class Child {
public:
    // `body` runs in the child; its result is the exit code.
    explicit Child(const std::function<int()>& body) : pid_{fork()} {
        if (pid_ == 0) _exit(body());
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    ~Child() {
        if (pid_ > 0) kill_and_wait();
    }
    void kill_and_wait() {
        ::kill(pid_, SIGKILL);
        wait();
    }
    // The exit code, or -1 if a signal ended it.
    int wait() {
        int status = 0;
        waitpid(pid_, &status, 0);
        pid_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    [[nodiscard]] pid_t pid() const { return pid_; }

private:
    pid_t pid_;
};

}  // namespace fovea::test
