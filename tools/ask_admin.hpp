// How a subcommand asks a running fovead: the options that say which one, and one request with its answer.
#pragma once

#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "daemon/service/admin_request.hpp"

namespace fovea::tools {

struct WhichDaemon {
    std::string run_dir, socket;
};
void add_which_daemon(CLI::App& command, WhichDaemon& which);

// The answer's object, whose "ok" is true. Returns the exit code; when it is not kSuccess, a message stands on stderr:
// nobody listens (kNoDaemon), the daemon refuses or answers in a way that no fovead does (kFailed).
[[nodiscard]] int ask_admin(const char* command, const WhichDaemon& which, const service::AdminRequest& request, nlohmann::json* answer);

}  // namespace fovea::tools
