#include "tools/ask_admin.hpp"

#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "daemon/service/admin_client.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {

void add_which_daemon(CLI::App& command, WhichDaemon& which) {
    command.add_option("--run-dir", which.run_dir, "The daemon's run directory (default: $XDG_RUNTIME_DIR/fovea, else /run/fovea)");
    command.add_option("--socket", which.socket, "The administrators' socket itself, where it has another path");
}

int ask_admin(const char* command, const WhichDaemon& which, const service::AdminRequest& request, nlohmann::json* answer) {
    std::string socket = which.socket;
    if (socket.empty())
        socket = which.run_dir.empty() ? service::default_admin_path() : (std::filesystem::path(which.run_dir) / "admin.sock").string();
    const auto line = service::ask_daemon(socket, service::to_line(request));
    if (!line) {
        fmt::print(stderr, "fovea {}: {}\n", command, line.error().message());
        return line.error().no_daemon ? kNoDaemon : kFailed;
    }
    *answer = nlohmann::json::parse(*line, nullptr, false);
    const auto text = [](const nlohmann::json& j, const char* key) { return j.contains(key) && j[key].is_string() ? j[key].get<std::string>() : ""; };
    if (answer->is_object() && answer->contains("error") && (*answer)["error"].is_object()) {
        const nlohmann::json& e = (*answer)["error"];
        fmt::print(stderr, "fovea {}: {}\n", command, Error{text(e, "what"), text(e, "where"), text(e, "way_out")}.message());
        return kFailed;
    }
    if (!answer->is_object() || !answer->contains("ok") || (*answer)["ok"] != true) {
        fmt::print(stderr, "fovea {}: {}: the answer is not that of a fovead of this version: {:.200}\n", command, socket, *line);
        return kFailed;
    }
    return kSuccess;
}

}  // namespace fovea::tools
