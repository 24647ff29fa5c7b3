#include "drivers/camera/eye_model.hpp"

#include <cmath>

namespace fovea::drivers::camera {

std::optional<Direction<HeadFrame>> look(const EyeModel& model, const PupilResult& pupil) noexcept {
    if (!pupil.found || (model.glint_reference && pupil.glint_count == 0)) return std::nullopt;
    const double cx = model.centre_x + (model.glint_reference ? pupil.glints[0].x : 0);
    const double cy = model.centre_y + (model.glint_reference ? pupil.glints[0].y : 0);
    // The camera faces the eye: what moves right in the picture looks to the wearer's left.
    const double side = model.mirrored ? 1 : -1;
    const double x = side * (pupil.ellipse.x - cx) / model.radius_px, y = -(pupil.ellipse.y - cy) / model.radius_px;
    const double r2 = x * x + y * y;
    if (!(r2 < 0.95)) return std::nullopt;
    const double z = -std::sqrt(1 - r2);
    // From the camera's axes to the head's: an eye that looks into the camera looks to where the camera stands.
    const double ce = std::cos(model.camera_elevation_rad), se = std::sin(model.camera_elevation_rad);
    const double ca = std::cos(model.camera_azimuth_rad), sa = std::sin(model.camera_azimuth_rad);
    const double up = y * ce - z * se, ahead = y * se + z * ce;
    return Direction<HeadFrame>::from({x * ca - ahead * sa, up, x * sa + ahead * ca});
}

}  // namespace fovea::drivers::camera
