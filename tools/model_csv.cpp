#include "tools/model_csv.hpp"

#include <iterator>

#include <fmt/format.h>

namespace fovea::tools {

std::string model_csv_header() {
    std::string h =
        "sequence,sample_id,exposed_ns,received_ns,filtered_ns,exposed_estimated,event,reference_ns,gaze_x,gaze_y,gaze_z,"
        "velocity_u_rad_s,velocity_v_rad_s,onset_ns,duration_ns,landing_x,landing_y,landing_z,ever_valid,valid_since_ns,"
        "lost_before,lost_since_ns,held_x,held_y,held_z";
    for (const std::int64_t ns : kHorizons_ns) {
        const std::int64_t ms = ns / 1'000'000;
        fmt::format_to(std::back_inserter(h), ",du{0}_rad,dv{0}_rad,r68_{0}_rad,r95_{0}_rad", ms);
    }
    return h + "\n";
}

void append_model_csv(std::string& out, const MotionModel& m) {
    const EyeMotion& e = m.eyes[0];
    const bool saccade = e.event == GazeEvent::saccade;
    const SaccadeProfile none;
    const SaccadeProfile& s = saccade ? e.saccade : none;
    auto to = std::back_inserter(out);
    fmt::format_to(to, "{},{},{},{},{},{:d},{},{},{},{},{},{},{},{},{},{},{},{},{:d},{},{:d},{},{},{},{}", m.sequence,
                   m.sample_id, to_ns(m.exposed), to_ns(m.received), to_ns(m.filtered), m.exposed_estimated,
                   to_string(e.event), to_ns(e.reference), e.gaze_dir_head.x, e.gaze_dir_head.y, e.gaze_dir_head.z,
                   e.velocity_rad_s.u, e.velocity_rad_s.v, to_ns(s.onset), s.duration.count(), s.landing_dir_head.x,
                   s.landing_dir_head.y, s.landing_dir_head.z, e.ever_valid, to_ns(e.valid_since), e.lost_before,
                   to_ns(e.lost_since), e.held_dir_head.x, e.held_dir_head.y, e.held_dir_head.z);
    for (const HorizonPoint& h : e.horizons)
        fmt::format_to(to, ",{},{},{},{}", h.du_rad, h.dv_rad, h.radius68_rad, h.radius95_rad);
    out += '\n';
}

}  // namespace fovea::tools
