// What the daemon tells an administrator, as JSON. docs/daemon.md describes each member.
//
// Threads: pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/service/client_server.hpp"
#include "daemon/service/source_loop.hpp"

namespace fovea::service {

struct RecorderStatus {
    std::string path;                       // "": nothing is recorded
    std::uint64_t samples = 0, frames = 0;  // taken from the rings
    std::uint64_t lost_samples = 0, lost_frames = 0;  // overwritten before the recorder came to them
    std::uint64_t dropped_rows = 0;         // of what was taken, not written: the disk was too slow or full; a sample is two rows
    std::string error;                      // why recording has stopped; empty while all is well
};

struct DaemonStatus {
    std::int64_t pid = 0, uptime_ns = 0;
    std::string focus_socket, admin_socket;
    SourceStatus source;
    std::int64_t newest_age_ns = -1;        // since the newest sample was received; -1: there has been none
    double rate_hz = -1;                    // samples, over about the last second; -1: not known yet
    std::vector<ClientStatus> clients;
    ClientServer::Counters counters;
    std::optional<MotionModel> model;       // the newest published
    std::int64_t model_age_ns = 0;
    RecorderStatus recorder;
};

// One line each.
[[nodiscard]] std::string to_json(const DaemonStatus& status);          // {"ok":true,"status":{...}}
[[nodiscard]] std::string done_json(const std::vector<std::string>& applied, const std::vector<std::string>& needs_restart);
[[nodiscard]] std::string recorded_json(const RecorderStatus& recorder);   // {"ok":true,"recorder":{...}}
[[nodiscard]] std::string error_json(const Error& error);               // {"ok":false,"error":{...}}

}  // namespace fovea::service
