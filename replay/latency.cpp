#include "replay/latency.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocol/sphere.hpp"

namespace fovea::replay {

namespace {

constexpr double kDegPerRad = 180 / std::numbers::pi;

double ms(Duration d) { return static_cast<double>(d.count()) * 1e-6; }

std::array<double, kStageCount> stages(const FrameTiming& f) {
    return {ms(f.received - f.exposed),  ms(f.filtered - f.received),  ms(f.published - f.filtered),
            ms(f.latched - f.published), ms(f.submitted - f.latched),  ms(f.gpu_done - f.submitted),
            ms(f.photon - f.gpu_done),   ms(f.photon - f.exposed)};
}

ViewJudgement judge(const ViewFovea& view, Direction<HeadFrame> gaze_head) {
    const Direction<ViewFrame> gaze = view.head_from_view.inverse() * gaze_head;
    const Direction<ViewFrame> center = unproject(view.fov, view.center_ndc);
    ViewJudgement j;
    j.error_deg = angle_between(center, gaze) * kDegPerRad;
    const auto p = project(view.fov, gaze);
    if (!p) {
        j.missed = true;
        j.outside_deg = j.error_deg;
        return j;
    }
    const double dx = p->x - view.center_ndc.x, dy = p->y - view.center_ndc.y;
    const double r = std::hypot(dx / view.half_width_ndc, dy / view.half_height_ndc);
    if (!(r > 1)) return j;
    // The point of the region's edge on the line from its centre to the gaze.
    const NdcPoint edge{view.center_ndc.x + dx / r, view.center_ndc.y + dy / r};
    j.outside_deg = angle_between(unproject(view.fov, edge), gaze) * kDegPerRad;
    j.missed = true;
    return j;
}

const EyeState& eye_or_combined(const GazeSample& s, Eye eye) {
    return s.eye(eye).valid ? s.eye(eye) : s.eye(Eye::combined);
}

}  // namespace

const char* to_string(FrameKind kind) noexcept { return kind == FrameKind::extrapolated ? "extrapolated" : "rendered"; }

const char* to_string(Stage stage) noexcept {
    switch (stage) {
        case Stage::exposed_to_received: return "exposed -> received";
        case Stage::received_to_filtered: return "received -> filtered";
        case Stage::filtered_to_published: return "filtered -> published";
        case Stage::published_to_latched: return "published -> latched";
        case Stage::latched_to_submitted: return "latched -> submitted";
        case Stage::submitted_to_gpu_done: return "submitted -> gpu done";
        case Stage::gpu_done_to_photon: return "gpu done -> photon";
        case Stage::motion_to_photon: return "motion to photon";
    }
    return "unknown";
}

const char* explain(Stage stage) noexcept {
    switch (stage) {
        case Stage::exposed_to_received: return "the tracker and its transport";
        case Stage::received_to_filtered: return "validate, filter, classify, predict";
        case Stage::filtered_to_published: return "write the motion model to shared memory";
        case Stage::published_to_latched: return "wait until the app latches";
        case Stage::latched_to_submitted: return "plan, patch and submit; also render, where the resolve runs on the processor";
        case Stage::submitted_to_gpu_done: return "render";
        case Stage::gpu_done_to_photon: return "wait for scan-out, up to its middle";
        case Stage::motion_to_photon: return "all of it";
    }
    return "";
}

Percentiles percentiles(std::vector<double> values) {
    Percentiles p;
    p.count = values.size();
    if (values.empty()) return p;
    std::sort(values.begin(), values.end());
    const auto rank = [&](double q) {
        const auto n = static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size())));
        return values[std::clamp<std::size_t>(n, 1, values.size()) - 1];
    };
    p.p50 = rank(0.50);
    p.p95 = rank(0.95);
    p.p99 = rank(0.99);
    p.max = values.back();
    return p;
}

bool FrameJudgement::missed() const noexcept {
    return std::any_of(views.begin(), views.begin() + view_count, [](const auto& v) { return v.missed; });
}

double FrameJudgement::worst_error_deg() const noexcept {
    double worst = 0;
    for (std::uint32_t i = 0; i < view_count; ++i) worst = std::max(worst, views[i].error_deg);
    return worst;
}

double FrameJudgement::worst_outside_deg() const noexcept {
    double worst = 0;
    for (std::uint32_t i = 0; i < view_count; ++i) worst = std::max(worst, views[i].outside_deg);
    return worst;
}

std::optional<Direction<HeadFrame>> gaze_at(std::span<const GazeSample> samples, Eye eye, Instant t,
                                            Duration max_gap) noexcept {
    const auto after =
        std::lower_bound(samples.begin(), samples.end(), t, [](const GazeSample& s, Instant at) { return s.exposed < at; });
    if (after == samples.end()) return std::nullopt;
    const EyeState& b = eye_or_combined(*after, eye);
    if (after->exposed == t) return b.valid ? std::optional(b.gaze_dir_head) : std::nullopt;
    if (after == samples.begin()) return std::nullopt;
    const auto before = after - 1;
    const EyeState& a = eye_or_combined(*before, eye);
    if (!a.valid || !b.valid || after->exposed - before->exposed > max_gap) return std::nullopt;
    const double fraction =
        static_cast<double>((t - before->exposed).count()) / static_cast<double>((after->exposed - before->exposed).count());
    return slerp(a.gaze_dir_head, b.gaze_dir_head, fraction);
}

namespace {

KindReport report_of(FrameKind kind, std::span<const FrameJudgement> frames) {
    KindReport r;
    std::vector<double> latency, gpu, errors;
    for (const FrameJudgement& f : frames) {
        if (f.kind != kind) continue;
        ++r.frames;
        latency.push_back(f.stage_ms[static_cast<std::size_t>(Stage::motion_to_photon)]);
        gpu.push_back(f.stage_ms[static_cast<std::size_t>(Stage::submitted_to_gpu_done)]);
        if (f.unjudged != Unjudged::no) continue;
        ++r.judged;
        r.missed += f.missed() ? 1 : 0;
        errors.push_back(f.worst_error_deg());
    }
    r.motion_to_photon_ms = percentiles(std::move(latency));
    r.submitted_to_gpu_done_ms = percentiles(std::move(gpu));
    r.error_deg = percentiles(std::move(errors));
    return r;
}

}  // namespace

LatencyReport analyse_latency(std::span<const FrameTiming> frames, std::span<const GazeSample> samples,
                              const LatencyOptions& options) {
    LatencyReport report;
    report.frames = frames.size();
    std::array<std::vector<double>, kStageCount> stage_values;
    std::vector<double> predictions, intervals, errors, outsides;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const FrameTiming& f = frames[i];
        report.pixels_shaded += f.pixels_shaded;
        report.pixels_full += f.pixels_full;
        report.photon_simulated |= f.photon_simulated;
        report.photon_estimated |= f.photon_estimated;
        if (i > 0) intervals.push_back(ms(f.photon - frames[i - 1].photon));
        if (f.model_sequence == 0) {
            ++report.frames_without_model;
            continue;
        }
        report.exposed_estimated |= f.exposed_estimated;
        FrameJudgement j;
        j.frame = f.frame;
        j.kind = f.kind;
        j.stage_ms = stages(f);
        j.prediction_ms = ms(f.predicted_photon - f.photon);
        for (std::size_t s = 0; s < kStageCount; ++s) stage_values[s].push_back(j.stage_ms[s]);
        predictions.push_back(std::abs(j.prediction_ms));

        j.view_count = f.view_count;
        if (f.view_count == 0) j.unjudged = Unjudged::no_view;
        if (samples.empty() || samples.back().exposed < f.photon) {
            j.unjudged = Unjudged::after_recording;
        } else {
            for (std::uint32_t v = 0; v < f.view_count; ++v) {
                const auto truth = gaze_at(samples, f.views[v].eye, f.photon, options.max_gap);
                if (!truth) {
                    j.unjudged = Unjudged::no_gaze;
                    break;
                }
                j.views[v] = judge(f.views[v], *truth);
            }
        }
        switch (j.unjudged) {
            case Unjudged::no:
                ++report.judged;
                errors.push_back(j.worst_error_deg());
                if (j.missed()) {
                    ++report.missed;
                    outsides.push_back(j.worst_outside_deg());
                }
                break;
            case Unjudged::no_gaze: ++report.unjudged_no_gaze; break;
            case Unjudged::after_recording: ++report.unjudged_after_recording; break;
            case Unjudged::no_view: break;
        }
        report.per_frame.push_back(j);
    }
    for (std::size_t s = 0; s < kStageCount; ++s) report.stage_ms[s] = percentiles(std::move(stage_values[s]));
    report.abs_prediction_ms = percentiles(std::move(predictions));
    if (frames.size() > 1) {
        const double span_s = to_seconds(frames.back().photon - frames.front().photon);
        if (span_s > 0) report.frame_rate_hz = static_cast<double>(frames.size() - 1) / span_s;
    }
    report.frame_interval_ms = percentiles(std::move(intervals));
    report.error_deg = percentiles(std::move(errors));
    report.outside_deg = percentiles(std::move(outsides));
    for (const FrameKind kind : {FrameKind::rendered, FrameKind::extrapolated})
        report.kinds[static_cast<std::size_t>(kind)] = report_of(kind, report.per_frame);
    return report;
}

}  // namespace fovea::replay
