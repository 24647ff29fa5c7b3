// The pupil detectors that Fovea's are measured against, each the textbook form of its idea.
//
// Source: threshold + centroid: Otsu's threshold of the lower half of the histogram, the largest dark region's centroid.
// Hough: OpenCV's gradient Hough transform for circles. Swirski-like: Haar centre-surround, k-means threshold, edge
// points of the dark region, ellipse by RANSAC (Swirski et al., ETRA 2012, without its image-aware refinement).
// Threads: pure. The same picture gives the same result.
#pragma once

#include "drivers/camera/pupil_detector.hpp"

namespace fovea::tools {

struct PupilBaseline {
    const char* name;
    drivers::camera::PupilResult (*detect)(const drivers::camera::GreyImage& image);
};

inline constexpr int kPupilBaselineCount = 3;
extern const PupilBaseline kPupilBaselines[kPupilBaselineCount];

}  // namespace fovea::tools
