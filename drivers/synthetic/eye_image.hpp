// Pictures of an eye as an infrared eye camera sees it, with the exact pupil known: for measuring pupil detectors.
//
// Every effect is off unless the scene asks for it, and takes nothing when it is off. Random parts (noise, lashes) have
// streams of their own: turning one on changes no other.
// Edges are drawn by area coverage, so that the true centre and axes hold to a few hundredths of a pixel.
// Units: pixels (pixel centres at integers, +x right, +y down), grey levels 0 to 255. Threads: pure.
#pragma once

#include <cstdint>
#include <vector>

namespace fovea::drivers::synthetic {

struct EyeImageScene {
    int width = 192, height = 192;
    // Pupil: the ground truth.
    double pupil_x = 96, pupil_y = 96;
    double pupil_a = 20, pupil_b = 20;     // semi-axes; b/a is the cosine of the angle off the camera's axis
    double pupil_angle_rad = 0;            // of the axis a, from +x towards +y
    // Levels.
    double pupil_level = 25, iris_level = 90, sclera_level = 165, skin_level = 150;
    double iris_scale = 2.4;               // iris over pupil size
    // Effects.
    double upper_lid = 0, lower_lid = 0;   // share of the iris's height that the lid covers, 0 none to 1 all
    int lashes = 0;                        // dark hairs from the upper lid
    int glints = 0;                        // up to 2 reflections of the lamps near the pupil's centre
    double glint_offset = 0.45;            // of the first from the pupil's centre, in pupil radii
    double blur_px = 0;                    // standard deviation of the lens's blur
    double noise = 0;                      // standard deviation of the sensor's noise
    double shade = 0;                      // brightness changes by this share from left to right
    std::uint64_t seed = 1;
};

[[nodiscard]] std::vector<std::uint8_t> render_eye(const EyeImageScene& scene);

}  // namespace fovea::drivers::synthetic
