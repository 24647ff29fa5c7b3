#include "tools/latency_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tools/axis_ticks.hpp"
#include "tools/html_text.hpp"

namespace fovea::tools {

namespace {

using replay::kStageCount;
using replay::Stage;

// Okabe and Ito's palette, which colour-blind readers can tell apart; one colour per stage.
constexpr const char* kStageColor[] = {"#0072B2", "#56B4E9", "#CC79A7", "#F0E442", "#E69F00", "#D55E00", "#009E73"};

// Where an axis ends that has to show `highest`: on a step of its grid.
double axis_end(double highest) {
    const double step = round_step(highest, 4);
    return std::max(step, std::ceil(highest / step - 1e-9) * step);
}

struct Axes {
    double width = 960, height = 240, left = 52, right = 12, top = 12, bottom = 34;
    double x_max = 1, y_max = 1;   // both axes begin at 0
    [[nodiscard]] double x(double v) const { return left + v / x_max * (width - left - right); }
    [[nodiscard]] double y(double v) const { return height - bottom - v / y_max * (height - top - bottom); }
};

std::string axes_svg(const Axes& a, const char* x_name, const char* y_name) {
    std::string s = fmt::format("<svg viewBox='0 0 {} {}' role='img'>", a.width, a.height);
    const double y_step = round_step(a.y_max, 4), x_step = std::max(1.0, round_step(a.x_max, 6));
    for (double v = 0; v <= a.y_max * 1.001; v += y_step)
        s += fmt::format("<line class='grid' x1='{:.1f}' x2='{:.1f}' y1='{:.1f}' y2='{:.1f}'/>"
                         "<text x='{:.1f}' y='{:.1f}' text-anchor='end'>{:g}</text>",
                         a.left, a.width - a.right, a.y(v), a.y(v), a.left - 6, a.y(v) + 4, v);
    for (double v = 0; v <= a.x_max * 1.001; v += x_step)
        s += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='middle'>{:g}</text>", a.x(v), a.height - a.bottom + 16, v);
    s += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>", (a.left + a.width - a.right) / 2, a.height - 2, x_name);
    s += fmt::format("<text transform='translate(12 {:.1f}) rotate(-90)' text-anchor='middle'>{}</text>",
                     (a.top + a.height - a.bottom) / 2, y_name);
    return s;
}

// One thin stacked column per frame, coloured by stage.
std::string stages_chart(const replay::LatencyReport& report) {
    Axes a;
    double highest = 0;
    for (const auto& f : report.per_frame) highest = std::max(highest, f.stage_ms[kStageCount - 1]);
    a.x_max = std::max<double>(1, static_cast<double>(report.per_frame.size()));
    a.y_max = axis_end(highest);
    std::string s = axes_svg(a, "frame", "ms");
    const double w = std::max(0.5, (a.width - a.left - a.right) / a.x_max);
    // Few columns are drawn one by one; of many, every n-th, so that the page stays small.
    const std::size_t step = std::max<std::size_t>(1, report.per_frame.size() / 480);
    for (std::size_t i = 0; i < report.per_frame.size(); i += step) {
        double base = 0;
        for (std::size_t k = 0; k + 1 < kStageCount; ++k) {
            const double v = std::max(0.0, report.per_frame[i].stage_ms[k]);
            if (a.y(base) - a.y(base + v) > 0.05)
                s += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.2f}' height='{:.2f}' fill='{}'/>", a.x(static_cast<double>(i)),
                                 a.y(base + v), w * static_cast<double>(step), a.y(base) - a.y(base + v), kStageColor[k]);
            base += v;
        }
    }
    return s + "</svg>";
}

constexpr std::size_t kMostDots = 4000;   // of hits, and of misses

// The foveal error of each judged frame: a dot, red where the fovea missed the eye.
std::string error_chart(const replay::LatencyReport& report) {
    Axes a;
    double highest = 0;
    for (const auto& f : report.per_frame)
        if (f.unjudged == replay::Unjudged::no) highest = std::max(highest, f.worst_error_deg());
    a.x_max = std::max<double>(1, static_cast<double>(report.per_frame.size()));
    a.y_max = axis_end(highest);
    std::string s = axes_svg(a, "frame", "degrees from the fovea's centre");
    // Of very many dots each n-th, hits and misses apart, so that a session of hours is a page that opens.
    const std::size_t miss_step = report.missed / kMostDots + 1, hit_step = (report.judged - report.missed) / kMostDots + 1;
    std::size_t hits = 0, misses = 0;
    for (std::size_t i = 0; i < report.per_frame.size(); ++i) {
        const auto& f = report.per_frame[i];
        if (f.unjudged != replay::Unjudged::no) continue;
        if (f.missed() ? misses++ % miss_step != 0 : hits++ % hit_step != 0) continue;
        s += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' class='{}'><title>frame {}: {:.2f} deg, {:.2f} deg outside</title></circle>",
                         a.x(static_cast<double>(i)), a.y(f.worst_error_deg()), f.missed() ? 3 : 1.8, f.missed() ? "miss" : "hit",
                         f.frame, f.worst_error_deg(), f.worst_outside_deg());
    }
    return s + "</svg>";
}

std::string stage_table(const replay::LatencyReport& report) {
    std::string s =
        "<table><thead><tr><th>stage</th><th></th><th>p50 ms</th><th>p95 ms</th><th>p99 ms</th><th>max ms</th></tr></thead><tbody>";
    for (std::size_t k = 0; k < kStageCount; ++k) {
        const auto& p = report.stage_ms[k];
        const bool total = k + 1 == kStageCount;
        const std::string swatch =
            total ? std::string{} : fmt::format("<span class='swatch' style='background:{}'></span>", kStageColor[k]);
        s += fmt::format("<tr{}><td>{}{}</td><td class='why'>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td></tr>",
                         total ? " class='total'" : "", swatch, escaped(to_string(static_cast<Stage>(k))),
                         explain(static_cast<Stage>(k)), p.p50, p.p95, p.p99, p.max);
    }
    return s + "</tbody></table>";
}

std::string picture(const std::string& png, const char* caption) {
    if (png.empty()) return {};
    return fmt::format("<figure><img alt='{0}' src='data:image/png;base64,{1}'><figcaption>{0}</figcaption></figure>", caption,
                       base64(png));
}

constexpr const char* kStyle = R"css(
:root{--ink:#1c2330;--soft:#5b6678;--line:#d9dee6;--paper:#fbfcfd;--card:#fff;--miss:#c3302b;--hit:#0072B2}
@media(prefers-color-scheme:dark){:root{--ink:#e8ecf2;--soft:#9aa6b8;--line:#303946;--paper:#12161c;--card:#1a2028;--miss:#ff6b61;--hit:#56B4E9}}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
main{max-width:1000px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:24px;margin:0 0 4px}h2{font-size:17px;margin:34px 0 8px}p{margin:6px 0}
.soft,.why,figcaption{color:var(--soft)}.why{font-size:13px}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(170px,1fr));gap:12px;margin:18px 0}
.tile{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:12px 14px}
.tile b{display:block;font-size:24px;line-height:1.25;font-variant-numeric:tabular-nums}
table{border-collapse:collapse;width:100%;background:var(--card);border:1px solid var(--line);font-variant-numeric:tabular-nums}
th,td{padding:6px 10px;text-align:right;border-top:1px solid var(--line)}thead th{border-top:0;color:var(--soft);font-weight:500}
th:first-child,td:first-child,td:nth-child(2){text-align:left}.total td{font-weight:600;border-top:2px solid var(--ink)}
.facts td{text-align:left;overflow-wrap:anywhere;white-space:pre-line;vertical-align:top}.swatch{display:inline-block;width:11px;height:11px;border-radius:2px;margin-right:8px}
svg{width:100%;height:auto;background:var(--card);border:1px solid var(--line)}svg text{fill:var(--soft);font-size:11px}
.grid{stroke:var(--line)}.hit{fill:var(--hit);opacity:.75}.miss{fill:var(--miss)}
.pictures{display:grid;gap:14px}figure{margin:0}img{width:100%;border:1px solid var(--line);border-radius:6px}
.note{border-left:3px solid #E69F00;padding:2px 12px;margin:10px 0}
)css";

std::string tile(const std::string& value, const std::string& label) {
    return fmt::format("<div class='tile'><b>{}</b><span class='soft'>{}</span></div>", escaped(value), escaped(label));
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

// Only where a frame was extrapolated.
std::string kind_table(const replay::LatencyReport& r) {
    if (r.of(FrameKind::extrapolated).frames == 0) return {};
    std::string s = "<h2>Rendered and extrapolated frames</h2><table><thead><tr><th>kind</th><th>frames</th><th>motion to photon p50 ms</th>"
                    "<th>p99 ms</th><th>submitted to gpu done p50 ms</th><th>foveal error p50 deg</th><th>misses of judged</th></tr></thead><tbody>";
    for (const FrameKind kind : {FrameKind::rendered, FrameKind::extrapolated}) {
        const auto& k = r.of(kind);
        s += fmt::format("<tr><td>{}</td><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.2f}</td><td>{} of {} ({:.1f} %)</td></tr>", replay::to_string(kind), k.frames,
                         k.motion_to_photon_ms.p50, k.motion_to_photon_ms.p99, k.submitted_to_gpu_done_ms.p50, k.error_deg.p50, k.missed, k.judged,
                         percent(static_cast<double>(k.missed), static_cast<double>(k.judged)));
    }
    return s + "</tbody></table><p class='soft'>An extrapolated frame continues the rendered one before it: its motion to photon counts from that frame's sample.</p>";
}

}  // namespace

std::string latency_html(const replay::LatencyReport& r, const ReportPage& page) {
    std::string s = "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
                    "<meta name='viewport' content='width=device-width,initial-scale=1'>";
    s += fmt::format("<title>Fovea: {}</title><style>{}</style></head><body><main>", escaped(page.title), kStyle);
    s += fmt::format("<h1>Motion to photon</h1><p class='soft'>{}</p>", escaped(page.title));
    s += "<div class='tiles'>";
    s += tile(fmt::format("{:.1f} ms", r.stage_ms[kStageCount - 1].p50), "motion to photon, median");
    s += tile(fmt::format("{:.1f} ms", r.stage_ms[kStageCount - 1].p99), "motion to photon, p99");
    s += tile(fmt::format("{} of {}", r.missed, r.judged), fmt::format("judged frames missed the eye ({:.1f} %)",
                                                                       percent(static_cast<double>(r.missed), static_cast<double>(r.judged))));
    s += tile(fmt::format("{:.1f} %", percent(static_cast<double>(r.pixels_shaded), static_cast<double>(r.pixels_full))),
              "of the full frame's pixels shaded");
    s += tile(fmt::format("{:.1f} Hz", r.frame_rate_hz), fmt::format("{} frames", r.frames));
    s += "</div>";
    if (r.photon_simulated)
        s += "<p class='note'>Photon times come from a <b>simulated</b> scan-out clock: no display took part.</p>";
    if (r.photon_estimated)
        s += "<p class='note'>Photon times are <b>estimated</b>: the display did not tell them.</p>";
    if (r.exposed_estimated)
        s += "<p class='note'>Exposure times are <b>estimated</b>: the tracker did not give its own.</p>";

    s += "<h2>Where the time goes</h2>" + stage_table(r);
    s += fmt::format("<p class='soft'>Nearest-rank percentiles over {} frames. The photon time asked of the latch was off by "
                     "{:.2f} ms (median), {:.2f} ms (p99).</p>",
                     r.per_frame.size(), r.abs_prediction_ms.p50, r.abs_prediction_ms.p99);
    s += kind_table(r);
    s += "<h2>Frame by frame</h2>" + stages_chart(r);
    s += "<h2>Foveal error: where the eye really was at photon time</h2>" + error_chart(r);
    s += fmt::format("<p class='soft'>Worst view of each frame: {:.2f} deg (median), {:.2f} (p95), {:.2f} (p99), {:.2f} (max). "
                     "Red: the eye was outside the full-resolution region, by {:.2f} deg (median of those), {:.2f} (max). "
                     "Not judged: {} frames in a blink or loss, {} whose photon came after the recording's end.</p>",
                     r.error_deg.p50, r.error_deg.p95, r.error_deg.p99, r.error_deg.max, r.outside_deg.p50, r.outside_deg.max,
                     r.unjudged_no_gaze, r.unjudged_after_recording);
    if (!page.frame_png.empty() || !page.levels_png.empty()) {
        s += "<h2>One frame</h2><div class='pictures'>";
        s += picture(page.frame_png, "as shown");
        s += picture(page.levels_png, "the same frame with its foveation levels");
        s += "</div>";
    }
    if (!page.facts.empty()) {
        s += "<h2>What was run</h2><table class='facts'><tbody>";
        for (const auto& [key, value] : page.facts) s += fmt::format("<tr><td>{}</td><td>{}</td></tr>", escaped(key), escaped(value));
        s += "</tbody></table>";
    }
    return s + "</main></body></html>\n";
}

}  // namespace fovea::tools
