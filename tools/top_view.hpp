// What `fovea top` shows: one look at a running daemon, as lines of a screen or as one line of a log.
//
// Threads: plain data and pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/latency.hpp"

namespace fovea::tools {

struct TopLook {
    double at_s = 0;                 // since the command began
    bool connected = false;
    std::string trouble;             // why not; or why there are no frames to judge (no grant); may be empty
    nlohmann::json status;           // as the daemon's administrators' socket gives it; null: not connected
    bool sees_frames = false;        // raw samples and frame reports are readable
    double window_s = 0;             // what `latency` covers, at most
    replay::LatencyReport latency;   // of the frames in the window whose photon is past
    std::uint64_t lost = 0;          // records that came too fast for this command
};

// For a terminal of this size; every line is at most `columns` characters, at most `rows` lines.
[[nodiscard]] std::vector<std::string> top_screen(const TopLook& look, std::size_t columns, std::size_t rows);
// "1.0 s  rate 999.8 Hz  fixation  +1.2 -0.5 deg  latency 41.5 ms  misses 2/93  clients 1"
[[nodiscard]] std::string top_line(const TopLook& look);
// The same as one JSON object, on one line.
[[nodiscard]] std::string top_json(const TopLook& look);

}  // namespace fovea::tools
