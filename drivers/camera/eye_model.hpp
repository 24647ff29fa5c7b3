// From where the pupil is in the picture to where the eye looks: a rotating sphere seen by a camera in front of it.
//
//   direction = (pupil - centre) / radius on the sphere, with depth sqrt(1 - r^2), turned by where the camera stands
//
// The reference is the projected centre of the eyeball, in the picture, or (glint_reference) the first glint plus that
// centre's offset from it, which takes out small shifts of the headset. What remains (the eye's own axes, lens and
// cornea) is the calibration's to remove.
// Units: pixels in, HeadFrame directions out. Threads: pure; noexcept.
#pragma once

#include <optional>

#include "drivers/camera/pupil_detector.hpp"
#include "protocol/frames.hpp"

namespace fovea::drivers::camera {

struct EyeModel {
    double centre_x = 0, centre_y = 0;   // pixels; with glint_reference: offset of the centre from the first glint
    double radius_px = 100;              // of the eyeball, as the camera sees it; (1, 4096]
    bool glint_reference = false;
    bool mirrored = false;               // the camera looks through a mirror: left and right change places
    // Where the camera stands, as seen from the eye: off straight ahead, to the wearer's right and upwards; [-1.4, 1.4].
    double camera_azimuth_rad = 0, camera_elevation_rad = 0;
};

// Nothing where the pupil lies off the sphere, or the glint that the model refers to is missing.
[[nodiscard]] std::optional<Direction<HeadFrame>> look(const EyeModel& model, const PupilResult& pupil) noexcept;

}  // namespace fovea::drivers::camera
