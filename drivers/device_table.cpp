// The drivers that are built in: one visible row each, in the order in which `fovea devices` lists them.
#include "drivers/camera/camera_device.hpp"
#include "drivers/device.hpp"
#include "drivers/hid/hid_device.hpp"
#include "drivers/priority_device.hpp"
#include "drivers/sample/sample_device.hpp"
#include "drivers/synthetic/synthetic_device.hpp"
#include "drivers/usb/psvr2_device.hpp"

namespace fovea::drivers {

const std::vector<DeviceRow>& device_table() {
    static const std::vector<DeviceRow> table = [] {
        std::vector<DeviceRow> rows = {
            {"hid", "any eye tracker of HID usage page 0x12 (Eye and Head Trackers)", hid::create, hid::keys(), hid::list},
            {"psvr2", "PlayStation VR2 over USB", usb::create_psvr2, usb::psvr2_keys(), usb::list_psvr2},
            {"camera", "one or two eye cameras behind V4L2: pupil detection, gaze by an eye model", camera::create, camera::keys(), camera::list},
            {"sample", "a made-up USB tracker: the driver to copy (docs/writing_a_driver.md)", sample::create, sample::keys(), sample::list},
            {"synthetic", "a synthetic eye: what a scenario file says it does, and nothing else", synthetic::create, synthetic::keys(), {}, false},
        };
        rows.push_back(priority_row(rows));   // "auto": the best of those above that is there
        return rows;
    }();
    return table;
}

}  // namespace fovea::drivers
