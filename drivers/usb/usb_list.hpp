// The USB devices with given ids, for `fovea devices`.
#pragma once

#include "drivers/device.hpp"

namespace fovea::drivers::usb {

// `details`: interfaces and endpoints in words.
[[nodiscard]] std::vector<FoundDevice> list_usb(std::uint16_t vendor, std::uint16_t product, const char* name,
                                                bool with_details);

}  // namespace fovea::drivers::usb
