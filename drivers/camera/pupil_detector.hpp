// Finds the pupil in the picture of an eye, and the lamps' glints beside it.
//
// Coarse: the dark disc in a lighter surround, over positions and radii, on a reduced picture (centre-surround response
// as in Swirski et al., "Robust real-time pupil tracking in highly off-axis images", ETRA 2012). Fine: rays from that
// centre to the steepest rise of brightness (as in Li et al., "Starburst", CVPR 2005), pixels of glints left out; an
// ellipse through them by random samples and a support test, then rays again from the ellipse itself.
//
// Presets, measured by `fovea tradeoff pupil` (docs/pupil_detection.md):
//   draft     24 rays, trimmed fit, once     fast      32 rays more, on the smoothed picture
//   balanced  64 rays, <= 40 random samples  best      the same for three candidates, and the winner's
//                                                                ellipse fitted to the pixels (edge_model.hpp)
// A pupil must be dark below all of its edge that is seen: the lashes of a closed eye are not.
//
// Input: 8-bit grey, 32 to 4096 pixels a side. Units: pixels, pixel centres at integers, +x right, +y down.
// Threads: one at a time. detect() is noexcept; it allocates when sizes change.
// The same picture gives the same result, bit for bit.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "drivers/camera/image.hpp"
#include "protocol/error.hpp"

namespace fovea::drivers::camera {

enum class PupilPreset : std::uint8_t { draft, fast, balanced, best };
inline constexpr const char* kPupilPresetNames = "draft fast balanced best";
[[nodiscard]] PupilPreset preset_from(const std::string& name) noexcept;   // balanced for an unknown name
[[nodiscard]] const char* to_string(PupilPreset preset) noexcept;

struct PupilSettings {
    PupilPreset preset = PupilPreset::balanced;
    double min_radius_px = 0, max_radius_px = 0;   // 0: 1/24 and 1/5 of the picture's smaller side
};

struct PupilEllipse {
    double x = 0, y = 0;
    double a = 0, b = 0;          // semi-axes, a >= b
    double angle_rad = 0;         // of a, from +x towards +y
};

struct Glint {
    double x = 0, y = 0;
    double area_px = 0;
};

struct PupilResult {
    bool found = false;
    PupilEllipse ellipse;
    double confidence = 0;        // 0 to 1: share of rays that support the ellipse, times how clear the contrast is
    int glint_count = 0;
    std::array<Glint, 2> glints;  // nearest to the pupil's centre first
};

class PupilDetector {
public:
    explicit PupilDetector(const PupilSettings& settings);
    PupilDetector(PupilDetector&&) noexcept;
    PupilDetector& operator=(PupilDetector&&) noexcept;
    ~PupilDetector();

    [[nodiscard]] PupilResult detect(const GreyImage& image) noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::drivers::camera
