// Servers for windows, started by a test on display names and run-time directories of its own, and programs run on them.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fovea::tests {

// True if a program is on $PATH.
[[nodiscard]] bool installed(const std::string& program);

// A child process; ended when this goes.
class Child {
public:
    Child() = default;
    // Through /bin/sh; `inherited`: a descriptor that it keeps under the same number, -1: none.
    explicit Child(const std::string& command, int inherited = -1);
    Child(Child&& o) noexcept;
    Child& operator=(Child&& o) noexcept;
    ~Child();
    void signal(int number) const;
    [[nodiscard]] bool running();
    // Exit status, 128 + signal, or -1 if it is still running after so long (then it is killed).
    int wait(double seconds);
    [[nodiscard]] pid_t pid() const noexcept { return pid_; }

private:
    pid_t pid_ = -1;
    std::optional<int> status_;
};

// An X server without a screen. Its size: 1280 x 800.
class Xvfb {
public:
    Xvfb();   // display() is empty if it did not start
    [[nodiscard]] const std::string& display() const noexcept { return display_; }
    void stop() { server_ = {}; }

private:
    Child server_;
    std::string display_;
};

// A Wayland compositor without a screen, on a run-time directory of its own below `scratch`.
class Weston {
public:
    // inside: an X display that it shows itself in, with its keyboard and pointer; empty: it has none of these.
    explicit Weston(const std::filesystem::path& scratch, const std::string& options = "", const std::string& inside = "");
    // "XDG_RUNTIME_DIR=... WAYLAND_DISPLAY=..."; empty if it did not start.
    [[nodiscard]] const std::string& environment() const noexcept { return environment_; }
    void stop() { server_ = {}; }

private:
    Child server_;
    std::string environment_;
};

struct Picture {
    int width = 0, height = 0;
    std::vector<unsigned char> rgb;
    [[nodiscard]] const unsigned char* at(int x, int y) const { return &rgb[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 3]; }
};
// What an X display shows; empty on failure.
[[nodiscard]] Picture screenshot(const std::string& display);

// Asks the window of this name to close, as a window manager does.
void close_window(const std::string& display, const std::string& name);

}  // namespace fovea::tests
