// What a device gets wrong or leaves out, as data: configs/devices/*.toml.
//
// Source: one file per device or family; configs/devices/README.md explains every key.
// Units: as the key's name says. Threads: pure, but load_quirks() reads files.
// Errors: an unreadable file, an unknown key or a value out of range, with file and line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace fovea::drivers::hid {

struct Quirks {
    // What the report descriptor ought to say and does not.
    std::optional<double> length_unit_m;       // metres per count of every length; (0, 1]
    std::optional<double> timestamp_unit_s;    // seconds per count of the sensor timestamp; [1e-9, 1]
    std::optional<double> screen_width_m, screen_height_m;   // (0, 20]
    std::optional<double> sampling_hz;         // (0, 100000]
    // Axes, where they differ from the usage tables (x right, y down, z from the screen towards the user).
    bool flip_x = false, flip_y = false, flip_z = false;
    // A device that ignores its own logical ranges: values outside them are used.
    bool ignore_logical_range = false;
    // The mode byte to write when the device does not offer the mode request usage: a raw feature report.
    std::vector<std::uint8_t> start_report;
    // Do not read or write feature reports (some devices stall on them).
    bool no_features = false;
    // Where the quirks come from, for print-outs; empty: none apply.
    std::string source;
};

// A device is recognised by vendor and product, and by a part of its name where that is given.
struct DeviceMatch {
    std::uint16_t vendor = 0, product = 0;     // product 0: every product of the vendor
    std::string name_contains;
};

struct DeviceQuirks {
    DeviceMatch match;
    Quirks quirks;
};

// Where device files are looked for: $FOVEA_DEVICES_DIR alone if set, else /etc/fovea/devices and
// /usr/share/fovea/devices, in that order.
[[nodiscard]] std::vector<std::filesystem::path> quirk_folders();

// Reads every *.toml of the folders that exist, in the order of their names.
[[nodiscard]] Result<std::vector<DeviceQuirks>> load_quirks(const std::vector<std::filesystem::path>& folders);

// The first entry that fits; without one, no quirks.
[[nodiscard]] Quirks quirks_for(const std::vector<DeviceQuirks>& all, std::uint16_t vendor, std::uint16_t product,
                                const std::string& name);

}  // namespace fovea::drivers::hid
