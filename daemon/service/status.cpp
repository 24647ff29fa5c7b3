#include "daemon/service/status.hpp"

#include <cmath>
#include <numbers>

#include <nlohmann/json.hpp>

#include "protocol/sphere.hpp"

namespace fovea::service {
namespace {

using nlohmann::json;

constexpr double kDegrees = 180 / std::numbers::pi;

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

// One line; text that is not UTF-8 (a path, say) is shown with replacement marks instead of failing.
std::string one_line(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

json to_object(const Error& error) {
    return {{"what", error.what}, {"where", error.where}, {"way_out", error.way_out}};
}

json to_object(const FrameCounters& c) {
    return {{"accepted", c.accepted},
            {"bad_values", c.bad_values},
            {"bad_instants", c.bad_instants},
            {"bad_index", c.bad_index},
            {"overrun", c.overrun}};
}

json to_object(const SourceStatus& s) {
    const pipeline::PipelineCounters& c = s.pipeline;
    json j = {{"driver", s.device.driver},
              {"name", s.device.name},
              {"location", s.device.location},
              {"nominal_rate_hz", s.device.nominal_rate_hz},
              {"exact_exposure", s.device.exact_exposure},
              {"state", to_string(s.state)},
              {"opens", s.opens},
              {"losses", s.losses},
              {"published", s.published},
              {"pipeline",
               {{"samples", c.samples},
                {"invalid", c.invalid},
                {"not_finite", c.not_finite},
                {"duplicates", c.duplicates},
                {"out_of_order", c.out_of_order},
                {"blinks", c.blinks},
                {"losses", c.losses}}},
              {"device_counters",
               {{"samples", s.counters.samples},
                {"malformed", s.counters.malformed},
                {"dropped", s.counters.dropped},
                {"losses", s.counters.losses},
                {"switches", s.counters.switches},
                {"last_loss", s.counters.last_loss}}}};
    j["error"] = s.error.what.empty() ? json(nullptr) : to_object(s.error);
    return j;
}

json to_object(const ClientStatus& c, std::int64_t now_ns) {
    return {{"id", c.id},
            {"pid", c.pid},
            {"uid", c.uid},
            {"name", c.name},
            {"reads_samples", c.reads_samples},
            {"connected_s", ms(now_ns - c.connected_ns) * 1e-3},
            {"frames", to_object(c.frames)},
            {"newest_frame", c.newest_frame}};
}

json to_object(const MotionModel& model, std::int64_t age_ns) {
    const EyeMotion& eye = model.eye(Eye::combined);
    const AzimuthElevation a = to_azimuth_elevation(eye.gaze_dir_head);
    return {{"sequence", model.sequence},
            {"sample_id", model.sample_id},
            {"age_ms", ms(age_ns)},
            {"event", to_string(eye.event)},
            {"ever_valid", eye.ever_valid},
            {"azimuth_deg", a.azimuth_rad * kDegrees},
            {"elevation_deg", a.elevation_rad * kDegrees},
            {"speed_deg_s", length(eye.velocity_rad_s) * kDegrees},
            {"radius95_at_30ms_deg", static_cast<double>(eye.horizons[3].radius95_rad) * kDegrees},
            {"exposed_to_received_ms", ms(to_ns(model.received) - to_ns(model.exposed))},
            {"received_to_published_ms", ms(to_ns(model.published) - to_ns(model.received))}};
}

json to_object(const RecorderStatus& r) {
    if (r.path.empty()) return nullptr;
    return {{"path", r.path},
            {"samples", r.samples},
            {"frames", r.frames},
            {"lost_samples", r.lost_samples},
            {"lost_frames", r.lost_frames},
            {"dropped_rows", r.dropped_rows},
            {"error", r.error.empty() ? json(nullptr) : json(r.error)}};
}

}  // namespace

std::string to_json(const DaemonStatus& status) {
    json clients = json::array();
    const std::int64_t now_ns = to_ns(MonotonicClock::now());
    for (const ClientStatus& c : status.clients) clients.push_back(to_object(c, now_ns));
    json source = to_object(status.source);
    source["rate_hz"] = status.rate_hz < 0 ? json(nullptr) : json(status.rate_hz);
    source["newest_age_ms"] = status.newest_age_ns < 0 ? json(nullptr) : json(ms(status.newest_age_ns));
    const json j = {
        {"version", FOVEA_VERSION},
        {"pid", status.pid},
        {"uptime_s", ms(status.uptime_ns) * 1e-3},
        {"focus_socket", status.focus_socket},
        {"admin_socket", status.admin_socket},
        {"source", std::move(source)},
        {"model", status.model ? to_object(*status.model, status.model_age_ns) : json(nullptr)},
        {"clients", std::move(clients)},
        {"connections",
         {{"connected", status.counters.connected},
          {"refused", status.counters.refused},
          {"misbehaved", status.counters.misbehaved},
          {"gone_frames", to_object(status.counters.gone_frames)}}},
        {"recorder", to_object(status.recorder)}};
    return one_line({{"ok", true}, {"status", j}});
}

std::string done_json(const std::vector<std::string>& applied, const std::vector<std::string>& needs_restart) {
    return one_line({{"ok", true}, {"applied", applied}, {"needs_restart", needs_restart}});
}

std::string recorded_json(const RecorderStatus& recorder) { return one_line({{"ok", true}, {"recorder", to_object(recorder)}}); }

std::string error_json(const Error& error) { return one_line({{"ok", false}, {"error", to_object(error)}}); }

}  // namespace fovea::service
