// Predictors: `fovea tradeoff predict` and `fovea tradeoff fovea`.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "daemon/pipeline/settings_table.hpp"
#include "tools/tradeoff_gaze.hpp"

namespace fovea::tools {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<Method> predictor_methods() {
    std::vector<Method> methods;
    for (const char* name : pipeline::predictor_names()) {
        Method m{name, {}};
        m.settings.predictor.name = name;
        if (m.name != "auto") m.settings.filter = "none";  // each at its best: a filter only makes them later
        methods.push_back(m);
        if (m.name == "hold") methods.front().name = "hold";
    }
    for (const double damping : {0.5, 1.0}) {
        Method m{fmt::format("damped_velocity {:g}", damping), {}};
        m.settings.filter = "none";
        m.settings.predictor.name = "damped_velocity";
        m.settings.predictor.damping = damping;
        methods.push_back(m);
    }
    return methods;
}

std::string toml_of(const Method& m) {
    return fmt::format("[filter]\nname = \"{}\"\n\n[predictor]\nname = \"{}\"\ndamping = {}\n", m.settings.filter, m.settings.predictor.name, pipeline::toml_value(m.settings.predictor.damping));
}

std::vector<Judgement> judge_all(const TradeoffRequest& request, const std::vector<Method>& methods) {
    std::vector<Judgement> judgements;
    std::size_t done = 0;
    for (const Method& m : methods) {
        Judgement& j = judgements.emplace_back(request.horizons_ns);
        for (const auto& r : request.recordings) {
            (void)j.run(m, r.recording);  // the settings are ours and legal
            request.progress(m.name, ++done, methods.size() * request.recordings.size());
        }
    }
    return judgements;
}

TradeoffTable class_table(const TradeoffRequest& request, const std::vector<Method>& methods,
                          const std::vector<Judgement>& judgements, const std::string& group, std::size_t c) {
    TradeoffTable t;
    t.title = fmt::format("{}{}: error, degrees", group.empty() ? "" : group + ", ", kGazeClasses[c].name);
    t.error_name = fmt::format("mean error at {:g} ms, degrees", static_cast<double>(request.horizons_ns.back()) * 1e-6);
    for (const char* what : {"mean", "p95", "median", "p99"})
        for (const auto h : request.horizons_ns) t.columns.push_back(fmt::format("{}_{:g}ms", what, static_cast<double>(h) * 1e-6));
    t.columns.push_back("in68");
    t.columns.push_back("in95");
    t.text_columns = 2 * request.horizons_ns.size();   // all of them would be some 25 beside each other
    for (std::size_t m = 0; m < methods.size(); ++m) {
        TradeoffRow row{methods[m].name, judgements[m].nanoseconds_per_sample(), kNan, {}, false, toml_of(methods[m])};
        std::vector<Statistics> s;
        for (std::size_t h = 0; h < request.horizons_ns.size(); ++h) s.push_back(judgements[m].statistics(group, c, h));
        for (const auto& x : s) row.values.push_back(x.mean);
        for (const auto& x : s) row.values.push_back(x.p95);
        for (const auto& x : s) row.values.push_back(x.median);
        for (const auto& x : s) row.values.push_back(x.p99);
        row.values.push_back(s.back().within68);
        row.values.push_back(s.back().within95);
        row.error = s.back().mean;
        t.rows.push_back(std::move(row));
    }
    mark_frontier(t);
    return t;
}

// One way to size a sharp region: the radius for an outcome at setting x of its own parameter, and the x at which the
// outcome just lies inside.
struct Rule {
    const char* name;
    double (*radius_deg)(const Outcome& o, double x);
    double (*needs)(const Outcome& o);
};
double error_of(const Outcome& o) { return static_cast<double>(o.error_deg); }
double r95_of(const Outcome& o) { return static_cast<double>(o.r95_deg); }
constexpr double kFloor_deg = 4;   // what render/density keeps sharp around a certain gaze
constexpr Rule kFixed{"fixed radius", [](const Outcome&, double x) { return x; }, error_of};
constexpr Rule kBySize[] = {
    {"uncertainty-sized", sized, [](const Outcome& o) { return error_of(o) / sized(o, 1); }},
    {"x + r95", [](const Outcome& o, double x) { return std::max(0.0, x + r95_of(o)); }, [](const Outcome& o) { return error_of(o) - r95_of(o); }},
    {"max(4, x + r95)", [](const Outcome& o, double x) { return std::max(kFloor_deg, x + r95_of(o)); },
     [](const Outcome& o) { return error_of(o) <= kFloor_deg ? -100 : error_of(o) - r95_of(o); }},
    {"max(4, x r95^0.4)", [](const Outcome& o, double x) { return std::max(kFloor_deg, sized(o, x)); },
     [](const Outcome& o) { return error_of(o) <= kFloor_deg ? 0 : error_of(o) / sized(o, 1); }},
};
struct Sizing {
    std::string name;
    std::size_t method;
    const Rule* rule;
};

struct AreaPoint {
    double miss, area_deg2;
};

}  // namespace

TradeoffResult judge_predictors(const TradeoffRequest& request) {
    const auto methods = predictor_methods();
    const auto judgements = judge_all(request, methods);
    TradeoffResult result;
    std::vector<std::string> groups = {""};
    if (request.groups)
        for (const auto& g : judgements.front().groups()) groups.push_back(g);
    for (const auto& g : groups)
        for (std::size_t c = 0; c < kClassCount; ++c) {
            TradeoffTable t = class_table(request, methods, judgements, g, c);
            if (std::none_of(t.rows.begin(), t.rows.end(), [](const auto& r) { return std::isfinite(r.error); })) continue;
            t.note = g.empty() ? "Device groups weigh the same. Also in the page, CSV and JSON: medians, p99, and in68, in95: share of outcomes within the stated radii, at the last horizon." : "";
            if (g.empty()) result.plots.push_back(plot_of(t));
            result.tables.push_back(std::move(t));
        }
    result.missing = "they need at least 50 samples with 100 ms of valid gaze around them";
    return result;
}

TradeoffResult judge_foveas(const TradeoffRequest& request) {
    const auto methods = predictor_methods();
    const auto judgements = judge_all(request, methods);
    std::vector<Sizing> sizings;
    for (std::size_t m = 0; m < methods.size(); ++m) sizings.push_back({"fixed radius + " + methods[m].name, m, &kFixed});
    for (std::size_t m = 0; m < methods.size(); ++m)
        if (methods[m].name == "auto")
            for (const Rule& r : kBySize) sizings.push_back({std::string(r.name) + " + auto", m, &r});
    constexpr double kMisses[] = {0.01, 0.02, 0.05, 0.10};
    constexpr double kLargest_deg = 60;  // covers any display

    TradeoffResult result;
    for (std::size_t h = 0; h < request.horizons_ns.size(); ++h) {
        TradeoffTable t;
        const double ms = static_cast<double>(request.horizons_ns[h]) * 1e-6;
        t.title = fmt::format("{:g} ms: area of the sharp region, square degrees, at equal share of misses", ms);
        t.error_name = "area at 5 % misses, square degrees";
        for (const double miss : kMisses) t.columns.push_back(fmt::format("area_at_{:g}%", miss * 100));
        for (const double miss : kMisses) t.columns.push_back(fmt::format("vs_hold_{:g}%", miss * 100));
        for (const double miss : kMisses) t.columns.push_back(fmt::format("x_at_{:g}%", miss * 100));
        TradeoffPlot plot{fmt::format("{:g} ms", ms), "mean area of the sharp region, square degrees", "share of frames that miss", true, true, {}};
        std::vector<double> hold;
        for (const Sizing& z : sizings) {
            // Per group a curve over the sizing's parameter; then the mean over groups at equal misses.
            std::vector<double> area(std::size(kMisses), 0), setting(std::size(kMisses), 0);
            TradeoffCurve curve{z.name, {}};
            double groups = 0;
            for (const auto& g : judgements[z.method].groups()) {
                const auto& outcomes = judgements[z.method].outcomes(g, 0, h);
                if (outcomes.size() < Judgement::kLeast) continue;
                groups += 1;
                // The parameter at which exactly `miss` of the outcomes lie outside: a quantile of what each would need.
                std::vector<double> need;
                for (const auto& o : outcomes)
                    need.push_back(z.rule->needs(o));
                std::sort(need.begin(), need.end());
                for (std::size_t k = 0; k < std::size(kMisses); ++k) {
                    const auto n = static_cast<double>(need.size());
                    const double x = need[std::min(need.size() - 1, static_cast<std::size_t>((1 - kMisses[k]) * n))];
                    double sum = 0;
                    for (const auto& o : outcomes) {
                        const double r = std::min(z.rule->radius_deg(o, x), kLargest_deg);
                        sum += std::numbers::pi * r * r;
                    }
                    area[k] += sum / n;
                    setting[k] += x;
                }
            }
            if (groups < 1) continue;
            for (double& a : area) a /= groups;
            for (double& x : setting) x /= groups;
            for (std::size_t k = 0; k < std::size(kMisses); ++k) curve.points.push_back({area[k], kMisses[k]});
            if (hold.empty()) hold = area;  // the first sizing is fixed radius + hold
            TradeoffRow row{z.name, judgements[z.method].nanoseconds_per_sample(), area[2], area, false, toml_of(methods[z.method])};
            for (std::size_t k = 0; k < area.size(); ++k) row.values.push_back(area[k] / hold[k] - 1);
            row.values.insert(row.values.end(), setting.begin(), setting.end());
            t.rows.push_back(std::move(row));
            plot.curves.push_back(std::move(curve));
        }
        if (t.rows.empty()) continue;
        t.note = "vs_hold: share of the area that is saved (negative) against fixed radius + hold. x_at: the sizing's parameter, mean over the groups. Device groups weigh the same.";
        mark_frontier(t);
        result.tables.push_back(std::move(t));
        result.plots.push_back(std::move(plot));
    }
    result.missing = "they need at least 50 samples with 100 ms of valid gaze around them";
    return result;
}

}  // namespace fovea::tools
