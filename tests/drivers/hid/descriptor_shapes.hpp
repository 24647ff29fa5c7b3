// Report descriptors of several shapes, as eye trackers have or might have them, and an encoder that fills their
// reports from the descriptor itself. Used by the unit tests and by the device lab's emulated trackers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/hid/report_descriptor.hpp"

namespace fovea::tests {

// Writes descriptor items one by one.
class DescriptorBuilder {
public:
    DescriptorBuilder& item(std::uint8_t prefix, std::int64_t value, int size = 0);   // size 0: the shortest that fits
    DescriptorBuilder& page(int v) { return item(0x04, v); }
    DescriptorBuilder& usage(int v) { return item(0x08, v); }
    DescriptorBuilder& usages(int first, int last) { return item(0x18, first).item(0x28, last); }
    DescriptorBuilder& logical(std::int64_t low, std::int64_t high) { return item(0x14, low, 4).item(0x24, high, 4); }
    DescriptorBuilder& physical(std::int64_t low, std::int64_t high) { return item(0x34, low, 4).item(0x44, high, 4); }
    DescriptorBuilder& unit(std::uint32_t unit, int exponent) { return item(0x64, unit, 4).item(0x54, exponent & 0xF, 1); }
    DescriptorBuilder& size(int bits, int count) { return item(0x74, bits, 1).item(0x94, count, 2); }
    DescriptorBuilder& id(int v) { return item(0x84, v, 1); }
    DescriptorBuilder& input(int flags = 2) { return item(0x80, flags, 1); }
    DescriptorBuilder& feature(int flags = 2) { return item(0xB0, flags, 1); }
    DescriptorBuilder& begin(int usage_id, int type) { return usage(usage_id).item(0xA0, type, 1); }
    DescriptorBuilder& end() { return *this << 0xC0; }
    DescriptorBuilder& push() { return *this << 0xA4; }
    DescriptorBuilder& pop() { return *this << 0xB4; }
    DescriptorBuilder& operator<<(int byte) { bytes.push_back(static_cast<std::uint8_t>(byte)); return *this; }
    std::vector<std::uint8_t> bytes;
};

struct Shape {
    const char* name;
    const char* what;
    std::vector<std::uint8_t> descriptor;
    bool needs_screen_size;   // the device does not tell; the config must
};

// classic: report ids, 64-bit microseconds, 32-bit micrometres, all feature reports
// packed:  no report ids, fields of 13 to 27 bits at odd bit offsets, a 16-bit millisecond counter, usage ranges, push and pop
// ratio:   the gaze as a share of the screen (no unit), 32-bit 100-microsecond counter, screen size in a feature report
// inches:  8-bit gaps, physical ranges in inches, no timestamp, no eye positions
[[nodiscard]] const std::vector<Shape>& shapes();
[[nodiscard]] const Shape& shape(const std::string& name);

// What a report is to say; metres and seconds on the device's own axes (origin upper left, y down, z to the user).
struct Truth {
    double gaze_x = 0, gaze_y = 0;
    double left[3] = {0, 0, 0}, right[3] = {0, 0, 0};
    double time_s = 0;
    bool eyes_seen = true;
};
// Screen of the emulated trackers, metres.
inline constexpr double kScreenWidth = 0.5, kScreenHeight = 0.3;

// The tracking report of `shape` for `truth`, with its id byte where it has one; each value rounded to the field's step.
[[nodiscard]] std::vector<std::uint8_t> encode_tracking(const drivers::hid::ReportDescriptor& descriptor, const Truth& truth);
// A feature report: capabilities, configuration and status of the emulated tracker. Empty: no such report.
[[nodiscard]] std::vector<std::uint8_t> encode_feature(const drivers::hid::ReportDescriptor& descriptor, std::uint8_t id,
                                                       double sampling_hz);

}  // namespace fovea::tests
