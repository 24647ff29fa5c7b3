// Why a device node cannot be opened, in words that lead on; the same for HID, USB and cameras.
#pragma once

#include <string>

#include "protocol/error.hpp"

namespace fovea::drivers {

// `code` is the errno of the failed open of `node`. Permission: names the udev rule to install. Busy: who to look for.
[[nodiscard]] std::unexpected<Error> cannot_open(const std::string& node, int code);

// errno of opening the node for reading and writing; 0 when it opens.
[[nodiscard]] int try_open(const std::string& node);

}  // namespace fovea::drivers
