#include "daemon/service/admin_request.hpp"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace fovea::service {
namespace {

using nlohmann::json;

constexpr std::pair<const char*, AdminCommand> kCommands[] = {
    {"status", AdminCommand::status}, {"reload", AdminCommand::reload},
    {"record", AdminCommand::record}, {"end_recording", AdminCommand::end_recording},
    {"switch", AdminCommand::switch_source}, {"stop", AdminCommand::stop}};

std::string known_commands() {
    std::string names = "commands: ";
    for (const auto& [name, command] : kCommands) names += (command == AdminCommand::status ? "" : ", ") + std::string(name);
    return names;
}

Result<void> read_path(const json& j, AdminRequest& request) {
    constexpr const char* kWayOut = R"(e.g. {"command":"record","path":"/var/lib/fovea/session.fovea"})";
    const auto path = j.find("path");
    if (path == j.end() || !path->is_string()) return fail("record needs a text \"path\"", {}, kWayOut);
    request.path = path->get<std::string>();
    if (!request.path.starts_with('/') || request.path.ends_with('/') || request.path.find('\0') != std::string::npos)
        return fail("the path of a recording is absolute and names a file", request.path, kWayOut);
    return {};
}

Result<void> read_settings(const json& j, AdminRequest& request) {
    constexpr const char* kWayOut = R"(e.g. {"command":"switch","set":["source.driver=hid"]})";
    const auto set = j.find("set");
    if (set == j.end() || !set->is_array() || set->empty()) return fail("switch needs a list \"set\"", {}, kWayOut);
    for (const json& assignment : *set) {
        if (!assignment.is_string()) return fail("\"set\" is a list of texts", assignment.dump(), kWayOut);
        request.set.push_back(assignment.get<std::string>());
        if (!request.set.back().starts_with("source."))
            return fail("switch sets keys of [source] only", request.set.back(), "change the config file and reload for the others");
    }
    return {};
}

}  // namespace

Result<AdminRequest> parse_admin_request(const std::string& line) {
    constexpr const char* kWayOut = R"(send one JSON object per line, e.g. {"command":"status"})";
    const json j = json::parse(line, nullptr, false);
    if (!j.is_object()) return fail("this line is no JSON object", {}, kWayOut);
    const auto name = j.find("command");
    if (name == j.end() || !name->is_string()) return fail("the object has no text \"command\"", {}, kWayOut);
    const auto& text = name->get_ref<const std::string&>();
    const auto* known = std::ranges::find_if(kCommands, [&](const auto& c) { return text == c.first; });
    if (known == std::end(kCommands)) return fail("unknown command '" + text + "'", {}, known_commands());
    AdminRequest request{.command = known->second};
    Result<void> read;
    if (request.command == AdminCommand::record) read = read_path(j, request);
    if (request.command == AdminCommand::switch_source) read = read_settings(j, request);
    if (!read) return std::unexpected(read.error());
    return request;
}

std::string to_line(const AdminRequest& request) {
    const auto* known = std::ranges::find_if(kCommands, [&](const auto& c) { return request.command == c.second; });
    json j = {{"command", known->first}};
    if (request.command == AdminCommand::record) j["path"] = request.path;
    if (request.command == AdminCommand::switch_source) j["set"] = request.set;
    return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace fovea::service
