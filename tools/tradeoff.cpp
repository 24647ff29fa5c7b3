// `fovea tradeoff`: error and cost of each method, measured in one run on recordings.
#include <algorithm>
#include <cmath>
#include <limits>

#include <unistd.h>

#include <fmt/format.h>

#include "command_line/checks.hpp"
#include "daemon/pipeline/settings_table.hpp"
#include "tools/commands.hpp"
#include "tools/outputs.hpp"
#include "tools/tradeoff_gaze.hpp"
#include "tools/tradeoff_pupil.hpp"

namespace fovea::tools {
namespace {

struct Options {
    std::vector<std::string> paths;
    std::vector<double> horizons_ms = {10, 20, 30, 50, 70};
    std::string csv, html, toml;
    double budget_us = -1, budget_ns = -1;
    bool json = false, groups = false;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea tradeoff: {}\n", error.message());
    return code;
}

int run(const Options& o, const char* title, TradeoffResult (*judge)(const TradeoffRequest&)) {
    const double budget = o.budget_ns >= 0 ? o.budget_ns : o.budget_us * 1e3;
    if (!o.toml.empty() && budget < 0) return report({"--toml writes what is picked within a budget, and there is none", o.toml, "say --budget-us or --budget-ns too"}, kUsage);
    for (const std::string& path : o.paths)
        if (auto ok = keep_inputs({path}, {o.csv, o.html, o.toml}); !ok) return report(ok.error(), kUsage);
    auto outputs = Outputs::open({o.csv, o.html, o.toml});
    if (!outputs) return report(outputs.error(), kFailed);
    auto recordings = load_recordings(o.paths, [](const Error& e) { fmt::print(stderr, "left out: {}\n", e.message()); });
    if (!recordings) return report(recordings.error(), kBadInput);
    TradeoffRequest request{*recordings, {}, o.groups, {}};
    for (const double ms : o.horizons_ms) request.horizons_ns.push_back(seconds(ms * 1e-3).count());
    const bool terminal = ::isatty(STDERR_FILENO) != 0;
    request.progress = [&](const std::string& what, std::size_t done, std::size_t of) {
        if (terminal) fmt::print(stderr, "\r\033[K{} of {}: {}", done, of, what);
        else if (done % 8 == 0 || done == of) fmt::print(stderr, "{} of {}: {}\n", done, of, what);
    };
    const TradeoffResult result = judge(request);
    if (terminal) fmt::print(stderr, "\r\033[K");
    if (result.tables.empty())
        return report({"these recordings have nothing to judge by", o.paths.front(), result.missing}, kBadInput);

    if (o.json) fmt::print("{}", to_json(result.tables));
    else
        for (const auto& t : result.tables) fmt::print("{}\n", to_text(t));
    std::string csv;
    for (const auto& t : result.tables) csv += to_csv(t);
    if (auto ok = outputs->put(o.csv, csv); !ok) return report(ok.error(), kFailed);
    if (!o.html.empty())
        if (auto ok = outputs->put(o.html, to_html(title, result.tables, result.plots)); !ok)
            return report(ok.error(), kFailed);
    if (budget >= 0) {
        const TradeoffRow* best = best_within(result.tables.front(), budget);
        if (!best) return report({fmt::format("nothing costs {:.0f} ns or less", budget), "", "allow more with --budget-us"}, kFailed);
        fmt::print(stderr, "within {:.0f} ns per sample: {} ({:.0f} ns, {} {:.3f})\n", budget, best->method, best->cost_ns, result.tables.front().error_name, best->error);
        if (o.toml.empty()) fmt::print(stderr, "{}", best->toml);
        else if (auto ok = outputs->put(o.toml, best->toml); !ok) return report(ok.error(), kFailed);
    }
    return kSuccess;
}

void add_subject(CLI::App& parent, int* exit_code, const char* name, const char* title, const char* text, bool budget,
                 TradeoffResult (*judge)(const TradeoffRequest&)) {
    auto o = std::make_shared<Options>();
    auto* c = parent.add_subcommand(name, text);
    c->add_option("recordings", o->paths, "Recordings, or directories that hold some")->required();
    c->add_option("--horizon", o->horizons_ms, "Horizons, milliseconds (default 10 20 30 50 70)")->check(command_line::within(0.0, 150.0));
    c->add_option("--csv", o->csv, "Also write the tables here")->check(command_line::file_name());
    c->add_option("--html", o->html, "Also write a self-contained page with plots here")->check(command_line::file_name());
    c->add_flag("--json", o->json, "Print JSON instead of tables");
    c->add_flag("--groups", o->groups, "Also one table per device");
    if (budget) {
        c->add_option("--budget-us", o->budget_us, "Pick the most accurate setting within this cost, microseconds per sample")->check(command_line::within(0.0, 1e6));
        c->add_option("--budget-ns", o->budget_ns, "The same in nanoseconds")->check(command_line::within(0.0, 1e9));
        c->add_option("--toml", o->toml, "Write the picked setting here, for the daemon's config")->check(command_line::file_name());
    }
    c->footer("The protocol: docs/pipeline.md. A * marks what no other method beats in both cost and error.\n"
              "Example: fovea tradeoff " + std::string(name) + " tests/data/recordings\n"
              "Exit codes: 0 judged, 1 cannot write or nothing within the budget, 2 wrong usage, 3 no usable recording.");
    c->callback([o, exit_code, title, judge] { *exit_code = run(*o, title, judge); });
}

}  // namespace

void add_tradeoff_extrapolation(CLI::App& parent, int* exit_code);
void add_tradeoff_foveation(CLI::App& parent, int* exit_code);

void add_tradeoff(CLI::App& app, int* exit_code) {
    auto* c = app.add_subcommand("tradeoff", "What accuracy costs: error and time of each method, in one run");
    c->require_subcommand(1);
    add_subject(*c, exit_code, "predict", "Fovea: predictors, error against cost", "Predictors: error per class of movement and horizon, and nanoseconds per sample", true, judge_predictors);
    add_subject(*c, exit_code, "filter", "Fovea: filters, error against cost", "Filters: jitter, lag and error, and nanoseconds per sample", true, judge_filters);
    add_subject(*c, exit_code, "classify", "Fovea: classifier settings, agreement against cost", "Classifier settings: agreement with the recordings' labels, and delay", true, judge_classifiers);
    add_subject(*c, exit_code, "fovea", "Fovea: frames that miss the eye against the sharp region's area", "Share of frames whose eye lies outside the sharp region, against its area", false, judge_foveas);
    add_tradeoff_pupil(*c, exit_code);
    add_tradeoff_extrapolation(*c, exit_code);
    add_tradeoff_foveation(*c, exit_code);
}

}  // namespace fovea::tools
