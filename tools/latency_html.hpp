// The latency report as one self-contained HTML page: figures, charts (SVG) and the pictures of a frame.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "replay/latency.hpp"

namespace fovea::tools {

struct ReportPage {
    std::string title;                                        // e.g. the session's file name
    std::vector<std::pair<std::string, std::string>> facts;   // what was played, with what: shown as given
    std::string frame_png, levels_png;                        // file contents; empty: no picture
};

// Every string is escaped. UTF-8 in, UTF-8 out.
[[nodiscard]] std::string latency_html(const replay::LatencyReport& report, const ReportPage& page);

}  // namespace fovea::tools
