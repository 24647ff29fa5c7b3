// An eye tracker of HID usage page 0x12, from its report descriptor: reports in, gaze out. No device is touched here.
//
// Source: HID Usage Tables, section 17 (HUTRR74). Positions are on the device's axes: origin at the upper left corner
// of the display, +x right, +y down, +z from the screen towards the user (quirks may turn them round).
// Output: GazeSample directions in HeadFrame (+y up, -z into the screen), from the eye's position to the gaze point.
// What the device leaves out is completed, in this order:
//   eye position  <- head position <- `viewing_distance_m` in front of the middle of the screen
//   screen size   <- settings <- Configuration feature <- quirks <- Capabilities feature
//   gaze in metres<- unit of the field <- quirk <- share of its logical range times the screen size
// An array (HID 1.11, 6.2.2.5: a list of the usages that are on) in the gaze's report that can name the gaze point, an
// eye's or the head's position says which of them are there: what it can name and does not is no value.
// A gaze point outside its logical range, or exactly (0, 0) with every eye position (0, 0, 0), is no gaze.
// Threads: one at a time. decode() is noexcept and allocates nothing.
// Errors: a descriptor without an eye tracker, or whose gaze cannot be placed on a screen.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/hid/quirks.hpp"
#include "drivers/hid/report_descriptor.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::drivers::hid {

struct ScreenSettings {
    double width_m = 0, height_m = 0;       // 0: what the device says
    double viewing_distance_m = 0.6;        // for a device that gives neither eye nor head position; (0, 10]
};

enum class ConfigurationStatus : std::uint8_t {
    unknown = 0, ready = 1, configuring = 2, screen_setup_needed = 3, user_calibration_needed = 4
};
[[nodiscard]] const char* to_string(ConfigurationStatus status) noexcept;

// What the device says of itself in its feature reports; kUnknown where it does not.
struct Capabilities {
    double quality = kUnknown;              // 1: fine gaze
    double min_distance_m = kUnknown, optimum_distance_m = kUnknown, max_distance_m = kUnknown;
    double max_screen_width_m = kUnknown, max_screen_height_m = kUnknown;
    double screen_width_m = kUnknown, screen_height_m = kUnknown;   // calibrated
    double sampling_hz = kUnknown;
    ConfigurationStatus status = ConfigurationStatus::unknown;
    bool gaze = false, eye_positions = false, head_position = false, head_rotation = false, timestamp = false;
    double timestamp_unit_s = kUnknown;
    bool timestamp_unit_assumed = false;    // the descriptor names no unit; microseconds, as the first devices had
};

enum class Decoded : std::uint8_t {
    sample,      // `out` holds a sample
    status,      // a status report; capabilities() is up to date
    foreign,     // a report that carries no gaze (another collection's)
    malformed,   // shorter or longer than the descriptor says
};

class EyeTracker {
public:
    [[nodiscard]] static Result<EyeTracker> create(std::span<const std::uint8_t> report_descriptor,
                                                   const Quirks& quirks = {}, const ScreenSettings& screen = {});
    EyeTracker(EyeTracker&&) noexcept;
    EyeTracker& operator=(EyeTracker&&) noexcept;
    ~EyeTracker();

    // Feature reports worth reading at start, by id, with the bytes to ask for (with the id byte).
    struct FeatureReport {
        std::uint8_t id = 0;
        std::size_t bytes = 0;
    };
    [[nodiscard]] const std::vector<FeatureReport>& features_to_read() const noexcept;
    // `report` starts with the report id (0 where the device has none), as hid_get_feature_report() delivers it.
    void take_feature(std::span<const std::uint8_t> report) noexcept;
    // After the feature reports: can the gaze be placed on a screen and be seen from somewhere? Says which key helps.
    [[nodiscard]] Result<void> check_geometry() const;
    // The feature report that asks for gaze, eye positions and head; empty where the device has no such control.
    [[nodiscard]] std::vector<std::uint8_t> mode_request() const;

    // `report` as hidraw delivers it: with the id byte exactly when the descriptor has report ids. Fills the gaze,
    // head and device_time of `out` and leaves id, exposed and received to the caller. `has_device_time` tells whether
    // device_time was given; it counts on over wraps of the device's counter.
    [[nodiscard]] Decoded decode(std::span<const std::uint8_t> report, GazeSample& out, bool& has_device_time) noexcept;

    // decode() of a report that has been decoded already, for the caches' sake: counter and status stay as they are.
    void rehearse(std::span<const std::uint8_t> report, GazeSample& scratch) noexcept;

    [[nodiscard]] const Capabilities& capabilities() const noexcept;
    [[nodiscard]] const ReportDescriptor& descriptor() const noexcept;
    // Longest input report, with its id byte.
    [[nodiscard]] std::size_t max_input_bytes() const noexcept;

private:
    struct State;
    explicit EyeTracker(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::drivers::hid
