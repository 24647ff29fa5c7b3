// The page of `fovea layer trace`: foveation calls, plans and pictures of a program's frames as one HTML file.
//
// Input: a folder that the layer wrote (render/layer/trace.hpp). Output: HTML that needs no other file; every text of
// the program is escaped.
// Threads: none. Errors: nothing traced, with what may have been the cause.
#pragma once

#include <string>

#include "protocol/error.hpp"

namespace fovea::tools {

// `command`: what was run, for the heading.
[[nodiscard]] Result<std::string> layer_trace_page(const std::string& folder, const std::string& command);

}  // namespace fovea::tools
