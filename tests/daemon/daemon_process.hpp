// A real fovead for tests: started in a folder of its own, waited for by its own word, killed with the object.
//
// No sleeps: readiness is the daemon's "ready" line on a pipe, everything else a condition with a deadline.
#pragma once

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "protocol/clock.hpp"

namespace fovea::test {

// Waits for `condition`, at most 30 s (a loaded machine is slow, not wrong).
bool eventually(const std::function<bool()>& condition, Duration at_most = std::chrono::seconds(30));

// A folder that goes away with the object.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] std::string operator/(const char* name) const { return (path_ / name).string(); }
    [[nodiscard]] std::vector<std::string> names() const;   // what is in it, sorted

private:
    std::filesystem::path path_;
};

// A copy of a program that any user may start: the build folder may be closed to others, as under /root.
std::string copy_for_others(const std::string& program, const TemporaryFolder& folder);

struct Finished {
    int code = -1;           // exit code; -signal when a signal ended it
    std::string out, error;  // what it wrote
};

// Runs a program to its end, at most 60 s; as another user when uid is not 0 (the caller is root then).
Finished run_program(const std::vector<std::string>& arguments, unsigned uid = 0);

struct DaemonOptions {
    std::string recording = {};                  // "": the shipped EyeLink one
    std::vector<std::string> arguments = {};   // more of them
    std::string config = {};                   // text of a config file; "": none
    unsigned uid = 0;                          // not 0: run as this user
};

class DaemonProcess {
public:
    // Starts it; ready() says whether it came up.
    DaemonProcess(const TemporaryFolder& folder, const DaemonOptions& options = {});
    ~DaemonProcess();   // SIGKILL if it still runs
    DaemonProcess(const DaemonProcess&) = delete;
    DaemonProcess& operator=(const DaemonProcess&) = delete;

    [[nodiscard]] bool ready() const { return ready_; }
    [[nodiscard]] pid_t pid() const { return pid_; }
    void send(int signal) const;
    // Exit code (or -signal), waiting at most 30 s for it.
    int wait();
    int stop(int signal) { return send(signal), wait(); }
    [[nodiscard]] std::string log() const;              // what it wrote to stderr
    [[nodiscard]] std::string focus_socket() const { return folder_ + "/focus.sock"; }
    [[nodiscard]] std::string admin_socket() const { return folder_ + "/admin.sock"; }
    // One administrator's command; "" when nobody answers.
    [[nodiscard]] std::string ask(const std::string& command) const;
    // The number behind a member's name in the status, e.g. number("published"); -1 when it is not there.
    [[nodiscard]] double number(const std::string& member) const;

private:
    std::string folder_, log_path_;
    pid_t pid_ = -1;
    bool ready_ = false;
};

std::string shipped_recording();   // 1000 Hz, 61 s

}  // namespace fovea::test
