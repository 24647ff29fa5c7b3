// Auto mode of `fovea layer run`: the rules of configs/layer, turned into what the layer reads, and its report.
//
// Input: a folder of rule files (configs/layer/README.md lists the keys), the options of the command line.
// Output: the text of FOVEA_LAYER_AUTO; a report for people.
// Threads: none. Errors: a file that cannot be read, a key that nobody knows, a value out of range, each with its file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace fovea::tools {

struct AutoOptions {
    bool on = false, always = false, compare = false;
    std::string rules;                 // a folder; empty: the places of configs/layer/README.md
    std::string gain;                  // "4", or "4,3" for x and y; empty: the rules'
    std::string focus;                 // "x,y"; empty: the rules'
    std::optional<double> area, fov_deg;
};

// `program`: as given on the command line.
[[nodiscard]] Result<std::string> auto_environment(const AutoOptions& options, const std::string& program);

// From the counters that the layer wrote. Empty: they are no JSON, or not of auto mode.
[[nodiscard]] std::string auto_report(const std::string& counters_json);
// What --compare measured, for people; says so where the program was too short for that.
[[nodiscard]] std::string comparison_report(const std::string& counters_json);

}  // namespace fovea::tools
