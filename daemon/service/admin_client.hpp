// How a program asks a running fovead: one JSON line to its administrators' socket, one line back.
//
// Threads: pure functions on the caller's thread; no asio behind them.
#pragma once

#include <expected>
#include <string>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"

namespace fovea::service {

struct AskFailure : Error {
    bool no_daemon = false;   // nobody listens there
};

// The line that the daemon answers, without its end. Waits at most `timeout` in all.
[[nodiscard]] std::expected<std::string, AskFailure> ask_daemon(const std::string& admin_socket, const std::string& line,
                                                                Duration timeout = std::chrono::seconds(2));

// admin.sock beside the socket that clients use by default.
[[nodiscard]] std::string default_admin_path();

}  // namespace fovea::service
