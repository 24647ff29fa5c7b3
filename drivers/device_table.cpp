// The drivers that are built in: one visible row each, in the order in which `fovea devices` lists them.
#include "drivers/device.hpp"
#include "drivers/hid/hid_device.hpp"

namespace fovea::drivers {

const std::vector<DeviceRow>& device_table() {
    static const std::vector<DeviceRow> table = {
        {"hid", "any eye tracker of HID usage page 0x12 (Eye and Head Trackers)", hid::create, hid::keys(), hid::list},
    };
    return table;
}

}  // namespace fovea::drivers
