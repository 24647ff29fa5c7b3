#include "render/viewer/mouse.hpp"

#include <cmath>

namespace fovea::viewer {

Latched latch_pointer(const present::Pointer& pointer, const PointedAt& at, std::span<const scene::SceneView, kEyes> views, Instant now, Instant photon) noexcept {
    Latched l;
    l.source = GazeSource::mouse;
    const FieldOfView& seen = views[at.eye].fov;
    const double x_tan = seen.tan_left + (at.x_ndc + 1) / 2 * (seen.tan_right - seen.tan_left);
    const double y_tan = seen.tan_down + (at.y_ndc + 1) / 2 * (seen.tan_up - seen.tan_down);
    const double length = std::sqrt(x_tan * x_tan + y_tan * y_tan + 1);
    for (std::size_t i = 0; i < kEyes; ++i) {
        const FieldOfView& v = views[i].fov;
        const double w = v.tan_right - v.tan_left, h = v.tan_up - v.tan_down;
        const double x = (x_tan - v.tan_left) / w * 2 - 1, y = (y_tan - v.tan_down) / h * 2 - 1;
        fovea_focal& f = l.focals[i];
        FOVEA_INIT(&f);
        f.flags = std::abs(x) > 1 || std::abs(y) > 1 ? FOVEA_FOCAL_OUTSIDE : 0;
        f.event = FOVEA_EVENT_FIXATION;
        f.x_ndc = static_cast<float>(std::fmin(std::fmax(x, -1), 1));
        f.y_ndc = static_cast<float>(std::fmin(std::fmax(y, -1), 1));
        f.radius68_rad = static_cast<float>(kMouseRadius95Rad / 1.62);   // of a circular normal distribution
        f.radius95_rad = static_cast<float>(kMouseRadius95Rad);
        // d tan / d angle at the point, the larger of the two directions: never too small.
        f.ndc_per_rad_x = static_cast<float>(2 / w * (1 + x_tan * x_tan));
        f.ndc_per_rad_y = static_cast<float>(2 / h * (1 + y_tan * y_tan));
        f.gaze_dir_view[0] = static_cast<float>(x_tan / length);
        f.gaze_dir_view[1] = static_cast<float>(y_tan / length);
        f.gaze_dir_view[2] = static_cast<float>(-1 / length);
    }
    FOVEA_INIT(&l.info);
    l.info.flags = FOVEA_LATCH_LIVE | FOVEA_LATCH_EXPOSED_ESTIMATED;
    l.info.sample_id = pointer.count;
    l.info.exposed_ns = l.info.received_ns = l.info.filtered_ns = l.info.published_ns = to_ns(now);   // a pointer at rest is known to be there now
    l.info.latched_ns = to_ns(now);
    l.info.photon_ns = to_ns(photon);
    return l;
}

}  // namespace fovea::viewer
