// Per-user, per-eye calibration: where the eye really looks, given where the tracker says it does.
//
// Fitted to fixations of known targets, in the gnomonic plane (tangents of the angles, so that a flat screen stays
// flat). Three models are fitted and the one with the least leave-one-target-out error is kept:
//   affine       6 numbers   needs 4 targets
//   homography   8 numbers   needs 6 targets
//   quadratic   12 numbers   needs 9 targets
// Outliers (a target that the person did not look at, a blink's artefact) are down-weighted by iteratively reweighted
// least squares (Tukey's biweight; scale from the median). Everything is rank-revealing: a fit whose columns are not
// independent (collinear or repeated targets) is refused, never extrapolated.
//
// Source: Hansen and Ji, "In the Eye of the Beholder", PAMI 32(3), 2010, section 4 (mappings); Hampel et al., "Robust
// Statistics", 1986 (biweight, 4.685).
// Units: directions; errors in degrees. Threads: fit() one at a time; apply() pure, noexcept, no allocation, 60 ns.
// Errors: too few targets, an ill-conditioned fit, an error above `largest_error_deg`; each says what to do.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "protocol/error.hpp"
#include "protocol/sphere.hpp"

namespace fovea::pipeline {

struct CalibrationPoint {
    Direction<HeadFrame> measured;  // mean of one fixation
    Direction<HeadFrame> target;
};

enum class CalibrationModel : std::uint8_t { identity, affine, homography, quadratic };
[[nodiscard]] const char* to_string(CalibrationModel model) noexcept;

class Calibration {
public:
    Calibration() = default;  // identity

    // The calibrated direction. Beyond 80 degrees from straight ahead, and where the map would turn inside out, the
    // measured direction itself.
    [[nodiscard]] Direction<HeadFrame> apply(Direction<HeadFrame> measured) const noexcept;

    [[nodiscard]] CalibrationModel model() const noexcept { return model_; }
    [[nodiscard]] double leave_one_out_deg() const noexcept { return leave_one_out_deg_; }  // mean over the targets kept
    [[nodiscard]] int outliers() const noexcept { return outliers_; }

    // As a TOML table [calibration.NAME]; from_toml() reads what to_toml() wrote, bit for bit.
    [[nodiscard]] std::string to_toml(const std::string& name) const;
    [[nodiscard]] static Result<Calibration> from_toml(const std::string& text, const std::string& name, const std::string& where);

private:
    friend Result<Calibration> fit_calibration(std::span<const CalibrationPoint>, double);
    CalibrationModel model_ = CalibrationModel::identity;
    std::array<double, 12> coefficients_{};  // affine, quadratic: six per axis; homography: the first eight
    double leave_one_out_deg_ = 0;
    int outliers_ = 0;
};

// largest_error_deg in (0, 90]: a fit that is worse is refused.
[[nodiscard]] Result<Calibration> fit_calibration(std::span<const CalibrationPoint> points, double largest_error_deg = 3);

}  // namespace fovea::pipeline
