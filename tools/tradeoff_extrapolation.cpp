// `fovea tradeoff extrapolation`: error and time of every way to make the frame in between, in one run.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <map>
#include <nlohmann/json.hpp>

#include "command_line/checks.hpp"
#include "tools/axis_ticks.hpp"
#include "tools/commands.hpp"
#include "tools/embedded_png.hpp"
#include "tools/extrapolation_methods.hpp"
#include "tools/extrapolation_targets.hpp"
#include "tools/image_quality.hpp"
#include "tools/outputs.hpp"
#include "tools/tradeoff_report.hpp"

namespace fovea::tools {

namespace {

struct Options {
    std::vector<std::string> scenes;
    std::vector<double> speeds = {1};
    std::vector<int> seeds = {0};
    double factor = 0.5, budget_ms = -1;
    int size_px = 1024, repeats = 5;
    std::string csv, html;
    bool json = false;
};

using Score = ExtrapolationScore;
using Case = ExtrapolationCase;
struct Row {
    std::string method;
    bool baseline = false, frontier = false;
    std::vector<Score> scores;   // one per case
    Score mean;
};
struct Crop {
    std::string scene, method, png;   // png: a data URI
    double psnr_db;
};

// Processor time of all threads of this process: on a shared machine the wall clock measures the neighbours.
double processor_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

// Where repeating the last frame is most wrong: that is where methods differ.
PixelWindow worst_window(const std::vector<std::uint8_t>& held, const std::vector<std::uint8_t>& truth, int size) {
    PixelWindow best{0, 0, std::min(size, 192)};
    double most = -1;
    for (int y = 0; y + best.edge <= size; y += best.edge / 2)
        for (int x = 0; x + best.edge <= size; x += best.edge / 2) {
            double sum = 0;
            for (int j = y; j < y + best.edge; j += 2)
                for (int i = x; i < x + best.edge; i += 2)
                    for (int c = 0; c < 3; ++c) {
                        const auto at = static_cast<std::size_t>(4 * (j * size + i) + c);
                        const int d = held[at] - truth[at];
                        sum += d * d;
                    }
            if (sum > most) {
                most = sum;
                best.x = x;
                best.y = y;
            }
        }
    return best;
}

void mark_frontier(std::vector<Row>& rows) {
    for (Row& a : rows)
        a.frontier = std::none_of(rows.begin(), rows.end(), [&](const Row& b) {
            return b.mean.psnr_db >= a.mean.psnr_db && b.mean.ms <= a.mean.ms && (b.mean.psnr_db > a.mean.psnr_db || b.mean.ms < a.mean.ms);
        });
}

std::vector<TargetLine> targets(const std::vector<Row>& rows, const std::vector<Case>& cases) {
    std::vector<MethodScores> methods;
    for (const Row& r : rows) methods.push_back({r.method, &r.scores});
    return extrapolation_targets(methods, cases);
}

std::string to_text(const std::vector<Row>& rows, const std::vector<Case>& cases) {
    std::string s = fmt::format("PSNR, dB (columns: scene, speed); * on the Pareto frontier of mean PSNR and mean time\n  {:<14}{:>8}{:>8}{:>8}", "method", "ms", "PSNR", "SSIM");
    for (const Case& c : cases) s += fmt::format(" {:>{}}", case_name(c).substr(0, 13), 7);
    s += '\n';
    for (const Row& r : rows) {
        s += fmt::format("{} {:<14}{:>8.1f}{:>8.2f}{:>8.4f}", r.frontier ? '*' : ' ', r.method, r.mean.ms, r.mean.psnr_db, r.mean.ssim);
        for (std::size_t i = 0; i < cases.size(); ++i) s += fmt::format(" {:>{}.2f}", r.scores[i].psnr_db, std::max<std::size_t>(7, case_name(cases[i]).substr(0, 13).size()));
        s += '\n';
    }
    s += fmt::format("\n{:<46}{:>9}{:>9}{:>9}  {}\n", "target", "wanted", "median", "worst", "worst case (missed of cases)");
    for (const TargetLine& t : targets(rows, cases))
        s += fmt::format("{:<46}{:>9}{:>9.2f}{:>9.2f}  {} ({} of {})\n", t.target, fmt::format("{} {:.2f} {}", t.unit == "dB" ? ">=" : "<=", t.limit, t.unit), t.median, t.worst, t.worst_case, t.missed, t.cases);
    return s;
}

std::string to_csv(const std::vector<Row>& rows, const std::vector<Case>& cases) {
    std::string s = "method,baseline,frontier,scene,speed,seed,psnr_db,ssim,processor_ms\n";
    for (const Row& r : rows)
        for (std::size_t i = 0; i < cases.size(); ++i)
            s += fmt::format("{},{:d},{:d},{},{:g},{},{:.3f},{:.5f},{:.3f}\n", r.method, r.baseline, r.frontier, cases[i].scene, cases[i].speed, cases[i].seed, r.scores[i].psnr_db, r.scores[i].ssim, r.scores[i].ms);
    return s;
}

std::string to_json(const std::vector<Row>& rows, const std::vector<Case>& cases, const Options& o) {
    nlohmann::json all = {{"size_px", o.size_px}, {"factor", o.factor}, {"methods", nlohmann::json::array()}};
    for (const Row& r : rows) {
        nlohmann::json row = {{"method", r.method}, {"baseline", r.baseline}, {"frontier", r.frontier}, {"processor_ms", r.mean.ms}, {"psnr_db", r.mean.psnr_db}, {"ssim", r.mean.ssim}, {"cases", nlohmann::json::array()}};
        for (std::size_t i = 0; i < cases.size(); ++i)
            row["cases"].push_back({{"scene", cases[i].scene}, {"speed", cases[i].speed}, {"seed", cases[i].seed}, {"psnr_db", r.scores[i].psnr_db}, {"ssim", r.scores[i].ssim}, {"processor_ms", r.scores[i].ms}});
        all["methods"].push_back(std::move(row));
    }
    for (const TargetLine& t : targets(rows, cases))
        all["targets"].push_back({{"target", t.target}, {"unit", t.unit}, {"limit", t.limit}, {"median", t.median}, {"worst", t.worst}, {"worst_case", t.worst_case}, {"cases", t.cases}, {"missed", t.missed}});
    return all.dump(1) + "\n";
}

std::string plot(const std::vector<Row>& rows) {
    constexpr double kWidth = 760, kHeight = 400, kLeft = 60, kBottom = 40;
    double low_db = 1e9, high_db = -1e9, low_ms = 1e9, high_ms = 0;
    for (const Row& r : rows) {
        low_db = std::min(low_db, r.mean.psnr_db);
        high_db = std::max(high_db, r.mean.psnr_db);
        low_ms = std::min(low_ms, std::max(r.mean.ms, 0.1));
        high_ms = std::max(high_ms, r.mean.ms);
    }
    const double log_low = std::log10(low_ms) - 0.1, log_high = std::log10(std::max(high_ms, 2 * low_ms)) + 0.35;
    const auto x = [&](double ms) { return kLeft + (std::log10(std::max(ms, 0.1)) - log_low) / (log_high - log_low) * (kWidth - kLeft - 10); };
    const auto y = [&](double db) { return kHeight - kBottom - (db - low_db + 1) / (high_db - low_db + 2) * (kHeight - kBottom - 10); };
    std::string s = fmt::format("<svg viewBox='0 0 {0} {1}' width='{0}' font-family='sans-serif' font-size='12' fill='currentColor'>", kWidth, kHeight);
    for (const double db : axis_ticks(low_db - 1, high_db + 1, false))
        s += fmt::format("<line x1='{0}' x2='{1}' y1='{2:.1f}' y2='{2:.1f}' stroke='var(--line)'/><text x='{3}' y='{4:.1f}' text-anchor='end'>{5:g}</text>", kLeft, kWidth - 10, y(db), kLeft - 5, y(db) + 4, db);
    for (const double ms : axis_ticks(std::pow(10, log_low), std::pow(10, log_high), true))
        s += fmt::format("<line x1='{0:.1f}' x2='{0:.1f}' y1='10' y2='{1}' stroke='var(--line)'/><text x='{0:.1f}' y='{2}' text-anchor='middle'>{3:g}</text>", x(ms), kHeight - kBottom, kHeight - kBottom + 16, ms);
    std::vector<const Row*> frontier;
    for (const Row& r : rows)
        if (r.frontier) frontier.push_back(&r);
    std::sort(frontier.begin(), frontier.end(), [](const Row* a, const Row* b) { return a->mean.ms < b->mean.ms; });
    s += "<polyline fill='none' stroke='#2f855a' points='";
    for (const Row* r : frontier) s += fmt::format("{:.1f},{:.1f} ", x(r->mean.ms), y(r->mean.psnr_db));
    s += "'/>";
    // Names that would lie on one another, or on another's mark, step down.
    constexpr double kCharacter = 7, kLine = 13;
    std::vector<std::array<double, 3>> taken;   // left, right, base line
    for (const Row& r : rows) taken.push_back({x(r.mean.ms) - 5, x(r.mean.ms) + 5, y(r.mean.psnr_db) + 4});
    for (const Row& r : rows) {
        const double left = x(r.mean.ms) + 7, right = left + kCharacter * static_cast<double>(r.method.size());
        double base = y(r.mean.psnr_db) + 4;
        while (std::any_of(taken.begin(), taken.end(), [&](const auto& t) { return left < t[1] && right > t[0] && std::abs(base - t[2]) < kLine; })) base += 1;
        taken.push_back({left, right, base});
        s += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'/><text x='{:.1f}' y='{:.1f}'>{}</text>", x(r.mean.ms), y(r.mean.psnr_db), r.baseline ? "#888" : "#1b6ca8", left, base, r.method);
    }
    return s + fmt::format("<text x='{}' y='{}' text-anchor='middle'>processor time, ms (log)</text><text x='4' y='20'>dB</text></svg>\n", kWidth / 2, kHeight - 6);
}

std::string to_html(const std::vector<Row>& rows, const std::vector<Case>& cases, const std::vector<Crop>& crops, const Options& o) {
    std::string s = page_head("Fovea: frame extrapolation, error against time");
    s += fmt::format("<p>{0}x{0} RGBA8, factor {1:g}; mean PSNR over {2} case{3} against the frame rendered at that time. Grey: baselines; green: on the Pareto frontier, which the line joins.</p>\n", o.size_px, o.factor, cases.size(), cases.size() == 1 ? "" : "s");
    s += plot(rows) + "<div class='wide'><table><tr><th>method<th>ms<th>PSNR<th>SSIM";
    for (const Case& c : cases) s += "<th>" + case_name(c);
    for (const Row& r : rows) {
        s += fmt::format("\n<tr{}><td>{}<td>{:.1f}<td>{:.2f}<td>{:.4f}", r.frontier ? " class='frontier'" : "", r.method, r.mean.ms, r.mean.psnr_db, r.mean.ssim);
        for (const Score& c : r.scores) s += fmt::format("<td>{:.2f}", c.psnr_db);
    }
    s += "</table></div>\n<h2>Targets</h2><div class='wide'><table><tr><th>target<th>wanted<th>median<th>worst<th>worst case<th>missed";
    for (const TargetLine& t : targets(rows, cases))
        s += fmt::format("\n<tr><td>{}<td>{} {:.2f} {}<td>{:.2f}<td>{:.2f}<td>{}<td>{} of {}", t.target, t.unit == "dB" ? "&ge;" : "&le;", t.limit, t.unit, t.median, t.worst, t.worst_case, t.missed, t.cases);
    s += "</table></div>\n<h2>Where repeating the last frame is most wrong</h2>\n";
    std::string scene;
    for (const Crop& c : crops) {
        if (c.scene != scene) s += fmt::format("<h3>{}</h3>\n", c.scene);
        scene = c.scene;
        s += fmt::format("<figure><img alt='{0}: {1}' src='{2}'><figcaption>{1}{3}</figcaption></figure>\n", c.scene, c.method, c.png, c.psnr_db > 0 ? fmt::format(", {:.1f} dB", c.psnr_db) : "");
    }
    return s + "</html>\n";
}

int fail_with(const Error& error, int code) {
    fmt::print(stderr, "fovea tradeoff extrapolation: {}\n", error.message());
    return code;
}

int run(const Options& o) {
    auto outputs = Outputs::open({o.csv, o.html});
    if (!outputs) return fail_with(outputs.error(), kFailed);
    std::vector<Case> cases;
    for (const int seed : o.seeds)
        for (const double speed : o.speeds)
            for (const SceneRow& s : extrapolation_scenes())
                if (o.scenes.empty() || std::find(o.scenes.begin(), o.scenes.end(), s.name) != o.scenes.end()) cases.push_back({s.name, speed, seed});
    auto methods = extrapolation_methods();
    std::vector<Row> rows;
    for (const auto& m : methods) rows.push_back({m.name, m.baseline, false, {}, {}});
    std::vector<Crop> crops;
    const bool terminal = ::isatty(STDERR_FILENO) != 0;
    std::size_t done = 0;
    for (const Case& c : cases) {
        fmt::print(stderr, "{}{} of {}: {}{}", terminal ? "\r\033[K" : "", ++done, cases.size(), case_name(c), terminal ? "" : "\n");
        const ExtrapolationScene scene(c.scene, c.speed, c.seed);
        const SceneFrame src1 = scene.render(0, o.size_px, false), src2 = scene.render(1, o.size_px, true, o.factor), truth = scene.render(1 + o.factor, o.size_px, false);
        const ExtrapolationInput input{&src1, &src2, &scene, static_cast<float>(o.factor)};
        const PixelWindow window = worst_window(src2.rgba, truth.rgba, o.size_px);
        const bool with_crops = c.speed == o.speeds.front() && c.seed == o.seeds.front();
        if (with_crops) crops.push_back({case_name(c), "rendered at that time", png_data_uri(truth.rgba, o.size_px, window, RowOrder::top_first), 0});
        std::vector<std::uint8_t> out(src1.rgba.size());
        std::vector<std::vector<double>> times(methods.size());
        // Once to warm up; then in turn, so that a slow moment of the machine meets every method.
        for (int repeat = 0; repeat <= o.repeats; ++repeat)
            for (std::size_t m = 0; m < methods.size(); ++m) {
                if (methods[m].before) methods[m].before(input);
                const double before = processor_ms();
                methods[m].run(input, out);
                if (repeat > 0) times[m].push_back(processor_ms() - before);
                if (repeat < o.repeats) continue;
                if (methods[m].after) methods[m].after(out);
                rows[m].scores.push_back({psnr_db(out, truth.rgba), ssim(out, truth.rgba, o.size_px, o.size_px), median(times[m])});
                if (with_crops) crops.push_back({case_name(c), methods[m].name, png_data_uri(out, o.size_px, window, RowOrder::top_first), rows[m].scores.back().psnr_db});
            }
    }
    if (terminal) fmt::print(stderr, "\r\033[K");
    for (Row& r : rows) {
        for (const Score& s : r.scores) {
            r.mean.psnr_db += s.psnr_db / static_cast<double>(cases.size());
            r.mean.ssim += s.ssim / static_cast<double>(cases.size());
            r.mean.ms += s.ms / static_cast<double>(cases.size());
        }
    }
    mark_frontier(rows);
    fmt::print("{}", o.json ? to_json(rows, cases, o) : to_text(rows, cases));
    if (!o.csv.empty())
        if (auto ok = outputs->put(o.csv, to_csv(rows, cases)); !ok) return fail_with(ok.error(), kFailed);
    if (!o.html.empty())
        if (auto ok = outputs->put(o.html, to_html(rows, cases, crops, o)); !ok) return fail_with(ok.error(), kFailed);
    if (o.budget_ms >= 0) {
        const Row* best = nullptr;
        for (const Row& r : rows)
            if (r.mean.ms <= o.budget_ms && !r.baseline && (best == nullptr || r.mean.psnr_db > best->mean.psnr_db)) best = &r;
        if (best == nullptr) return fail_with({fmt::format("no preset takes {:g} ms or less", o.budget_ms), "", "allow more with --budget-ms"}, kFailed);
        fmt::print(stderr, "within {:g} ms: {} ({:.1f} ms, {:.2f} dB)\n", o.budget_ms, best->method, best->mean.ms, best->mean.psnr_db);
    }
    return kSuccess;
}

}  // namespace

void add_tradeoff_extrapolation(CLI::App& parent, int* exit_code);
void add_tradeoff_extrapolation(CLI::App& parent, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = parent.add_subcommand("extrapolation", "Frame extrapolation: PSNR and SSIM against the frame really rendered, and processor time");
    std::vector<std::string> names;
    for (const SceneRow& s : extrapolation_scenes()) names.emplace_back(s.name);
    c->add_option("--scene", o->scenes, "Only these scenes")->check(CLI::IsMember(names));
    c->add_option("--speed", o->speeds, "Speeds; 1 is about 7 pixels per frame at 1024x1024 (default 1)")->check(command_line::within(0.0, 20.0));
    c->add_option("--seed", o->seeds, "Other textures, places, directions and paces; 0 (default) is what everything was tuned on")->check(CLI::Range(0, 1000000));
    c->add_option("--factor", o->factor, "How far ahead, frame times; not 0 (default 0.5)")
        ->check(command_line::within(-1.0, 2.0))
        ->check([](const std::string& text) { return std::strtod(text.c_str(), nullptr) == 0 ? std::string("0 is the last frame itself") : std::string(); });
    c->add_option("--size", o->size_px, "Edge of the pictures, pixels (default 1024)")->check(CLI::Range(32, 4096));
    c->add_option("--repeat", o->repeats, "Timed runs per method and case; the median counts (default 5)")->check(CLI::Range(1, 1000));
    c->add_option("--budget-ms", o->budget_ms, "Name the best preset within this processor time per frame")->check(command_line::within(0.0, 1e6));
    c->add_option("--csv", o->csv, "Also write every score here")->check(command_line::file_name());
    c->add_option("--html", o->html, "Also write a self-contained page with plot and crops here")->check(command_line::file_name());
    c->add_flag("--json", o->json, "Print JSON instead of the table");
    std::string footer = "Scenes:\n";
    for (const SceneRow& s : extrapolation_scenes()) footer += fmt::format("  {:<12} {}\n", s.name, s.what);
    c->footer(footer + "Example: fovea tradeoff extrapolation --speed 0.5 1 2 --html extrapolation.html\n"
                       "         fovea tradeoff extrapolation --seed 1 2 3 4 5 --speed 0.5 1   (scenes that nothing was tuned on)\n"
                       "Exit codes: 0 measured, 1 cannot write or nothing within the budget, 2 wrong usage.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
