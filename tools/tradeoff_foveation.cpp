// `fovea tradeoff foveation`: frame time against error of every foveation method and setting, in one run.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "command_line/checks.hpp"
#include "render/gl/context.hpp"
#include "render/quality/ladder.hpp"
#include "render/scene/scene.hpp"
#include "tools/commands.hpp"
#include "tools/foveation_judge.hpp"
#include "tools/outputs.hpp"
#include "tools/tradeoff_report.hpp"

namespace fovea::tools {
namespace {

struct Options {
    std::vector<std::string> scenes{"circuit", "fragbox"}, methods;
    JudgeOptions judge;
    double budget_ms = -1;
    std::string csv, html, toml;
    bool json = false;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea tradeoff foveation: {}\n", error.message());
    return code;
}

struct Judged {
    std::string scene;
    std::vector<FoveationScore> scores;   // of the settings
};

double cost_ms(const FoveationScore& s, bool processor) { return processor ? s.cpu_ms : s.wall_ms; }
double cost_ratio(const FoveationScore& s, bool processor) { return processor ? s.cpu_ratio : s.wall_ratio; }

TradeoffTable table_of(const Judged& j, const std::vector<quality::Setting>& settings, const Options& o, bool processor) {
    TradeoffTable t{"foveation, scene " + j.scene,
                    fmt::format("2 eyes of {0}x{0}, judged in the left one, 3 gazes; ratios of medians of {1} pairs (full, setting in turn), cost by {2} time; "
                                "weighted error and flicker of 255; PSNR, SSIM and flicker outside the fovea. Crops: 96 pixels around the first gaze, and where its periphery has most detail.",
                                o.judge.size_px, o.judge.frames, processor ? "processor" : "wall"),
                    "ms/frame", "weighted error", 1e6,
                    {"error", "cpu ratio", "wall ratio", "latch-done", "pixels %", "fragments %", "exact %", "PSNR out", "SSIM out", "flicker", "flicker smooth"}, {}};
    for (std::size_t i = 0; i < settings.size(); ++i) {
        const FoveationScore& s = j.scores[i];
        t.rows.push_back({settings[i].label, cost_ms(s, processor) * 1e6, s.weighted_error,
                          {s.weighted_error, s.cpu_ratio, s.wall_ratio, s.latch_to_done_ratio, 100 * s.pixels, 100 * s.fragments, 100 * s.exact, s.psnr_out_db, s.ssim_out, s.flicker, s.flicker_smooth},
                          false, {}, {{"fovea", s.fovea_png}, {"periphery", s.periphery_png}}});
    }
    mark_frontier(t);
    return t;
}

// A ladder over all scenes: mean cost and error of each setting.
Result<quality::Ladder> ladder_of(const std::vector<Judged>& all, std::vector<quality::Setting> settings, bool processor, const std::string& pick) {
    for (std::size_t i = 0; i < settings.size(); ++i) {
        settings[i].cost = settings[i].error = 0;
        for (const Judged& j : all) {
            settings[i].cost += cost_ratio(j.scores[i], processor) / static_cast<double>(all.size());
            settings[i].error += j.scores[i].weighted_error / static_cast<double>(all.size());
        }
    }
    return quality::make_ladder(std::move(settings), pick);
}

// The setting with the least mean error whose frames fit into the budget in every scene.
std::optional<std::size_t> best_within(const std::vector<Judged>& all, std::size_t settings, double budget_ms, bool processor) {
    std::optional<std::size_t> best;
    double least = 0;
    for (std::size_t i = 0; i < settings; ++i) {
        double error = 0;
        bool fits = true;
        for (const Judged& j : all) {
            error += j.scores[i].weighted_error;
            fits = fits && cost_ms(j.scores[i], processor) <= budget_ms;
        }
        if (!fits || (best && error >= least)) continue;
        best = i;
        least = error;
    }
    return best;
}

int write_outputs(const Options& o, Outputs& outputs, const std::vector<TradeoffTable>& tables) {
    std::vector<TradeoffPlot> plots;
    std::string csv;
    for (const auto& t : tables) {
        plots.push_back(plot_of(t));
        csv += to_csv(t);
    }
    if (o.json) fmt::print("{}", to_json(tables));
    else
        for (const auto& t : tables) fmt::print("{}\n", to_text(t));
    if (!o.csv.empty())
        if (auto ok = outputs.put(o.csv, csv); !ok) return report(ok.error(), kFailed);
    if (!o.html.empty())
        if (auto ok = outputs.put(o.html, to_html("Fovea: foveation methods, error against time", tables, plots)); !ok) return report(ok.error(), kFailed);
    return kSuccess;
}

int choose(const Options& o, Outputs& outputs, const std::vector<Judged>& all, const std::vector<quality::Setting>& settings, bool processor, const std::string& renderer) {
    std::string pick;
    if (o.budget_ms >= 0) {
        const auto best = best_within(all, settings.size(), o.budget_ms, processor);
        if (!best) return report({fmt::format("nothing takes {:g} ms or less", o.budget_ms), "", "allow more with --budget-ms"}, kFailed);
        pick = settings[*best].label;
        for (const Judged& j : all)
            fmt::print(stderr, "within {:g} ms, {}: {} ({:.1f} ms, weighted error {:.2f} of 255)\n", o.budget_ms, j.scene, pick, cost_ms(j.scores[*best], processor),
                       j.scores[*best].weighted_error);
    }
    if (o.toml.empty()) return kSuccess;
    auto ladder = ladder_of(all, settings, processor, pick);
    if (!ladder) {   // the pick is dearer, on average, than a better setting: that one is the ladder's
        ladder = ladder_of(all, settings, processor, "");
        if (!ladder) return report(ladder.error(), kFailed);
        double cost = 0;
        for (std::size_t i = 0; i < settings.size(); ++i)
            if (settings[i].label == pick)
                for (const Judged& j : all) cost += cost_ratio(j.scores[i], processor) / static_cast<double>(all.size());
        while (ladder->pick + 1 < ladder->settings.size() && ladder->settings[ladder->pick].cost > cost) ++ladder->pick;
    }
    std::string scenes;
    for (const Judged& j : all) scenes += " " + j.scene;
    const std::string head = fmt::format("# fovea tradeoff foveation --scenes{} --size {} --frames {}\n# {}; costs by {} time\n", scenes, o.judge.size_px, o.judge.frames, renderer,
                                         processor ? "processor" : "wall");
    if (auto ok = outputs.put(o.toml, head + to_toml(*ladder)); !ok) return report(ok.error(), kFailed);
    return kSuccess;
}

int run(Options& o) {
    auto outputs = Outputs::open({o.csv, o.html, o.toml});
    if (!outputs) return report(outputs.error(), kFailed);
    auto context = gl::Context::create();
    if (!context) return report(context.error(), kFailed);
    const std::string renderer = context->info().renderer;
    const bool processor = context->info().software;   // it does the GPU's work, and its time is the steadier measure
    std::vector<quality::Setting> settings = foveation_settings();
    if (!o.methods.empty())
        std::erase_if(settings, [&](const quality::Setting& s) { return s.method != "full" && std::ranges::find(o.methods, s.method) == o.methods.end(); });
    const bool terminal = ::isatty(STDERR_FILENO) != 0;
    std::vector<Judged> all;
    o.judge.progress = [&](const std::string& what, std::size_t done, std::size_t of) {
        const std::size_t before = all.size() * of, total = o.scenes.size() * of;
        if (terminal) fmt::print(stderr, "\r\033[K{} of {}: {}", before + done, total, what);
        else if (done == 1 || done % 8 == 0) fmt::print(stderr, "{} of {}: {}\n", before + done, total, what);
    };
    std::vector<TradeoffTable> tables;
    for (const std::string& name : o.scenes) {
        auto scores = judge_foveation(name, settings, o.judge);
        if (terminal) fmt::print(stderr, "\r\033[K");
        if (!scores) return report(scores.error(), kFailed);
        all.push_back({name, *std::move(scores)});
        tables.push_back(table_of(all.back(), settings, o, processor));
    }
    if (const int code = write_outputs(o, *outputs, tables); code != kSuccess) return code;
    return choose(o, *outputs, all, settings, processor, renderer);
}

}  // namespace

void add_tradeoff_foveation(CLI::App& parent, int* exit_code);
void add_tradeoff_foveation(CLI::App& parent, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = parent.add_subcommand("foveation", "Foveation methods and settings: frame time, fragments, exactness, error and flicker against a full render");
    std::vector<std::string> scenes, methods;
    for (const auto& s : scene::scenes()) scenes.emplace_back(s.name);
    for (const auto& s : foveation_settings())
        if (s.method != "full" && std::ranges::find(methods, s.method) == methods.end()) methods.push_back(s.method);
    c->add_option("--scenes,--scene", o->scenes, "Scenes (default circuit fragbox)")->check(CLI::IsMember(scenes));
    c->add_option("--methods,--method", o->methods, "Only these methods, beside full")->check(CLI::IsMember(methods));
    c->add_option("--size", o->judge.size_px, "Edge of each eye's picture, pixels (default 512)")->check(CLI::Range(64, 4096));
    c->add_option("--frames", o->judge.frames, "Timed pairs of frames per setting; medians count (default 5)")->check(CLI::Range(1, 1000));
    c->add_option("--fovea-deg", o->judge.fovea_deg, "Radius at full resolution of the scaled_bins settings, degrees (default 5); 0: 1/gain, the equation with area 0")->check(command_line::within(0.0, 60.0));
    c->add_option("--budget-ms", o->budget_ms, "Pick the setting with the least error whose frames take no longer in any of the scenes")->check(command_line::within(0.0, 1e6));
    c->add_option("--toml", o->toml, "Write the frontier here, with the pick, for fovea-view --quality")->check(command_line::file_name());
    c->add_option("--csv", o->csv, "Also write the tables here")->check(command_line::file_name());
    c->add_option("--html", o->html, "Also write a self-contained page with plots and crops here")->check(command_line::file_name());
    c->add_flag("--json", o->json, "Print JSON instead of tables");
    c->footer("error: RMS difference of 255 to the full render, each pixel weighted by the share of it that the eye resolves there.\n"
              "exact: pixels of the full-resolution region that equal the full render's, bit for bit. A * marks the frontier.\n"
              "flicker: change of the periphery of a still scene while the gaze moves at 20 degrees per second; full has none;\n"
              "         flicker smooth: the same with temporal smoothing.\n"
              "Example: fovea tradeoff foveation --scenes circuit --html foveation.html --budget-ms 20 --toml quality.toml\n"
              "Exit codes: 0 measured, 1 no driver, cannot write, or nothing within the budget, 2 wrong usage.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
