// The daemon's settings: what configs/fovead.toml says, checked key by key.
//
// Source: one visible table (config_keys.hpp) holds every key with range, default and doc; reading, --set and
// --print-config all follow it, so file and code cannot drift apart.
// Errors: an unknown key, a wrong type or a value out of range, with file:line:column and the legal range or the
// nearest legal key.
// Threads: plain data and pure functions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/pipeline/settings.hpp"
#include "drivers/device.hpp"
#include "protocol/error.hpp"

namespace fovea::service {

struct SourceSettings {
    std::string driver = "replay";
    bool wait_for_client = false;       // open the source only when the first client has connected
    std::int64_t realtime_priority = 10;  // of the thread that reads a tracker; 0: none
    bool rehearse = true;                 // source_loop.hpp
    drivers::DeviceSettings device;     // the driver's own keys
};

struct ServerSettings {
    std::string focus_socket;           // "": focus.sock in the run directory
    std::string admin_socket;           // "": admin.sock in the run directory
    std::vector<std::int64_t> uids;     // who may connect, besides root and the daemon's own user
    std::vector<std::int64_t> gids;
    std::vector<std::int64_t> sample_uids;  // who may read raw samples, besides root and the daemon's own user
    std::int64_t max_clients = 16;
    Duration heartbeat = std::chrono::milliseconds(10);
    bool lock_memory = false;
};

struct RecordSettings {
    std::string path;                   // "": nothing is recorded
};

struct LogSettings {
    std::string level = "info";
};

struct Config {
    SourceSettings source;
    pipeline::PipelineSettings pipeline;  // [loss] is pipeline.loss
    std::string calibration;              // file of `fovea calibrate`; "": the tracker's own
    ServerSettings server;
    RecordSettings record;
    LogSettings log;
};

// Reads and checks `text`. `name` stands before line and column in errors; a relative source.path, record.path or pipeline.calibration is
// resolved against `folder`. `devices`: the rows whose drivers may be chosen.
[[nodiscard]] Result<Config> parse_config(std::string_view text, const std::string& name,
                                          const std::filesystem::path& folder,
                                          const std::vector<drivers::DeviceRow>& devices);
[[nodiscard]] Result<Config> load_config(const std::filesystem::path& file,
                                         const std::vector<drivers::DeviceRow>& devices);

// Applies one "section.key=value" (the --set option); a value that is no TOML value is taken as text.
[[nodiscard]] Result<void> set_key(Config& config, std::string_view assignment,
                                   const std::vector<drivers::DeviceRow>& devices);

// A TOML file with every key, its doc, range and default, and the keys of every driver as comments.
[[nodiscard]] std::string print_default_config(const std::vector<drivers::DeviceRow>& devices);


// The keys and values of `config` as TOML, without docs: what a session file says it was made with.
[[nodiscard]] std::string print_config(const Config& config);

}  // namespace fovea::service
