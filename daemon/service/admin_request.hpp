// An administrator's line, read: which command, with what.
//
//   {"command":"status"} {"command":"reload"} {"command":"stop"}
//   {"command":"record","path":"/absolute/file.fovea"} {"command":"end_recording"}
//   {"command":"switch","set":["source.driver=hid", ...]}
//
// Threads: pure functions. Errors: no JSON object, a command or member that is not known, a member of the wrong kind.
#pragma once

#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace fovea::service {

enum class AdminCommand : std::uint8_t { status, reload, record, end_recording, switch_source, stop };

struct AdminRequest {
    AdminCommand command = AdminCommand::status;
    std::string path = {};               // record: absolute, since the daemon's folder is not the administrator's
    std::vector<std::string> set = {};   // switch: "source.KEY=VALUE", at least one
};

[[nodiscard]] Result<AdminRequest> parse_admin_request(const std::string& line);

// The lines that parse_admin_request reads, for those who send them.
[[nodiscard]] std::string to_line(const AdminRequest& request);

}  // namespace fovea::service
