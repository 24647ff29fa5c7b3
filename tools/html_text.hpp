// What every page of the tools needs: text that cannot become markup, and bytes that travel inside the page.
//
// Threads: pure.
#pragma once

#include <string>
#include <string_view>

namespace fovea::tools {

// Safe between tags and within either kind of quotes.
[[nodiscard]] std::string escaped(std::string_view text);

// RFC 4648, section 4, with padding.
[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace fovea::tools
