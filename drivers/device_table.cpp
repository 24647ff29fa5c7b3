// The drivers that are built in: one visible row each, in the order in which `fovea devices` lists them.
#include "drivers/device.hpp"

namespace fovea::drivers {

const std::vector<DeviceRow>& device_table() {
    static const std::vector<DeviceRow> table = {
    };
    return table;
}

}  // namespace fovea::drivers
