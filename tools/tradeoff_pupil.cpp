#include "tools/tradeoff_pupil.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>

#include <time.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line/checks.hpp"
#include "drivers/camera/pupil_detector.hpp"
#include "drivers/synthetic/eye_image.hpp"
#include "tools/outputs.hpp"
#include "tools/pupil_baselines.hpp"

namespace fovea::tools {

namespace {

using namespace fovea::drivers::camera;
using drivers::synthetic::EyeImageScene;

struct Picture {
    EyeImageScene scene;
    bool closed = false;      // no pupil to be found
    std::vector<std::uint8_t> pixels;
};

struct Case {
    const char* name;
    std::function<void(EyeImageScene&, std::mt19937_64&)> change;
    bool closed = false;
};

// Each case turns on what it is about and nothing else; the last turns on all of it.
const Case kCases[] = {
    {"clean", [](EyeImageScene&, std::mt19937_64&) {}},
    {"noise", [](EyeImageScene& s, std::mt19937_64&) { s.noise = 10; }},
    {"blur", [](EyeImageScene& s, std::mt19937_64&) { s.blur_px = 0.012 * s.width; }},
    {"glints", [](EyeImageScene& s, std::mt19937_64& r) { s.glints = 2; s.glint_offset = 0.2 + 0.8 * std::uniform_real_distribution<>(0, 1)(r); }},
    {"off-axis", [](EyeImageScene& s, std::mt19937_64& r) { s.pupil_b = s.pupil_a * std::uniform_real_distribution<>(0.5, 0.7)(r); s.pupil_angle_rad = std::uniform_real_distribution<>(0, std::numbers::pi)(r); }},
    {"lid", [](EyeImageScene& s, std::mt19937_64& r) { s.upper_lid = std::uniform_real_distribution<>(0.32, 0.46)(r); }},
    {"lashes", [](EyeImageScene& s, std::mt19937_64&) { s.upper_lid = 0.2; s.lashes = 25; }},
    {"dark iris", [](EyeImageScene& s, std::mt19937_64&) { s.iris_level = 55; }},
    {"all", [](EyeImageScene& s, std::mt19937_64& r) { s.noise = 6; s.blur_px = 0.006 * s.width; s.glints = 2; s.pupil_b = 0.75 * s.pupil_a; s.pupil_angle_rad = std::uniform_real_distribution<>(0, std::numbers::pi)(r); s.upper_lid = 0.28; s.lashes = 15; s.shade = 0.25; }},
    {"closed", [](EyeImageScene& s, std::mt19937_64&) { s.upper_lid = 1; s.lashes = 15; s.noise = 4; }, true},
};

std::vector<Picture> pictures(const Case& c, int side, int count) {
    std::vector<Picture> all;
    std::mt19937_64 rng(std::hash<std::string>{}(c.name) ^ static_cast<std::uint64_t>(side));
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < count; ++i) {
        Picture p;
        EyeImageScene& s = p.scene;
        s.width = s.height = side;
        s.seed = rng();
        s.pupil_x = side * (0.38 + 0.24 * unit(rng));
        s.pupil_y = side * (0.40 + 0.20 * unit(rng));
        s.pupil_a = s.pupil_b = side * (0.06 + 0.09 * unit(rng));
        c.change(s, rng);
        p.closed = c.closed;
        p.pixels = drivers::synthetic::render_eye(s);
        all.push_back(std::move(p));
    }
    return all;
}

struct Score {
    std::vector<double> errors_px, times_us;   // errors of what was found
    int shown = 0, within_5px = 0, closed = 0, imagined = 0;

    void add(const Score& o) {
        errors_px.insert(errors_px.end(), o.errors_px.begin(), o.errors_px.end());
        times_us.insert(times_us.end(), o.times_us.begin(), o.times_us.end());
        shown += o.shown, within_5px += o.within_5px, closed += o.closed, imagined += o.imagined;
    }
    static double quantile(std::vector<double> v, double q) {
        if (v.empty()) return std::nan("");
        std::ranges::sort(v);
        return v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1) + 0.5)];
    }
    [[nodiscard]] double rate() const { return shown > 0 ? static_cast<double>(within_5px) / shown : std::nan(""); }
};

struct Method {
    std::string name;
    std::function<PupilResult(const GreyImage&)> detect;
};

std::vector<Method> methods() {
    std::vector<Method> all;
    for (const PupilBaseline& b : kPupilBaselines) all.push_back({b.name, b.detect});
    for (const PupilPreset preset : {PupilPreset::draft, PupilPreset::fast, PupilPreset::balanced, PupilPreset::best}) {
        auto detector = std::make_shared<PupilDetector>(PupilSettings{.preset = preset});
        all.push_back({to_string(preset), [detector](const GreyImage& g) { return detector->detect(g); }});
    }
    return all;
}

void judge(const Method& m, const std::vector<Picture>& shown, Score& score) {
    // The processor's time, not the clock's: what else runs on the machine is no part of a detector.
    const auto now_us = [] {
        timespec t{};
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
        return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
    };
    for (const Picture& p : shown) {
        const GreyImage image{p.pixels.data(), p.scene.width, p.scene.height, p.scene.width};
        const double start = now_us();
        const PupilResult r = m.detect(image);
        score.times_us.push_back(now_us() - start);
        if (p.closed) {
            ++score.closed;
            score.imagined += r.found ? 1 : 0;
            continue;
        }
        ++score.shown;
        if (!r.found) continue;
        const double e = std::hypot(r.ellipse.x - p.scene.pupil_x, r.ellipse.y - p.scene.pupil_y);
        score.errors_px.push_back(e);
        score.within_5px += e <= 5 ? 1 : 0;
    }
}

struct Options {
    int count = 60;
    std::vector<int> sides = {192, 400};
    double budget_us = 0;
    std::string csv;
    bool cases = false, json = false;
};

int run(const Options& o) {
    auto outputs = Outputs::open({o.csv});
    if (!outputs) {
        fmt::print(stderr, "fovea tradeoff pupil: {}\n", outputs.error().message());
        return kFailed;
    }
    const auto all = methods();
    std::string csv = "side_px,method,case,median_error_px,p95_error_px,rate_5px,imagined_when_closed,median_us,p99_us\n";
    nlohmann::json json = nlohmann::json::array();
    for (const int side : o.sides) {
        std::map<std::string, Score> total;
        std::map<std::string, std::map<std::string, Score>> by_case;
        for (const Case& c : kCases) {
            const auto shown = pictures(c, side, o.count);
            for (const Method& m : all) {
                Score& s = by_case[m.name][c.name];
                judge(m, shown, s);
                total[m.name].add(s);
            }
        }
        const auto row = [&](const std::string& method, const std::string& what, const Score& s) {
            const double median = Score::quantile(s.errors_px, 0.5), p95 = Score::quantile(s.errors_px, 0.95),
                         us = Score::quantile(s.times_us, 0.5), us99 = Score::quantile(s.times_us, 0.99),
                         imagined = s.closed > 0 ? static_cast<double>(s.imagined) / s.closed : 0;
            csv += fmt::format("{},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.1f},{:.1f}\n", side, method, what, median, p95, s.rate(), imagined, us, us99);
            json.push_back({{"side_px", side}, {"method", method}, {"case", what}, {"median_error_px", median}, {"p95_error_px", p95},
                            {"rate_5px", s.rate()}, {"imagined_when_closed", imagined}, {"median_us", us}, {"p99_us", us99}});
        };
        for (const auto& [method, cases] : by_case)
            for (const auto& [what, s] : cases) row(method, what, s);
        for (const Method& m : all) row(m.name, "total", total[m.name]);
        if (o.json) continue;
        // On the frontier: nobody is both cheaper and right more often.
        fmt::print("{0} x {0} pixels, {1} pictures of each of {2} cases\n", side, o.count, std::size(kCases));
        fmt::print("  {:<14}{:>10}{:>10}{:>11}{:>10}{:>11}{:>10}\n", "method", "median px", "p95 px", "within 5px", "imagined", "median us", "p99 us");
        for (const Method& m : all) {
            const Score& s = total[m.name];
            const double us = Score::quantile(s.times_us, 0.5);
            bool beaten = false;
            for (const auto& [name, other] : total)
                beaten = beaten || (name != m.name && Score::quantile(other.times_us, 0.5) <= us && other.rate() >= s.rate() &&
                                    Score::quantile(other.errors_px, 0.5) <= Score::quantile(s.errors_px, 0.5));
            fmt::print("{} {:<14}{:>10.3f}{:>10.3f}{:>10.1f}%{:>9.1f}%{:>11.0f}{:>10.0f}\n", beaten ? ' ' : '*', m.name,
                       Score::quantile(s.errors_px, 0.5), Score::quantile(s.errors_px, 0.95), 100 * s.rate(),
                       100.0 * s.imagined / std::max(1, s.closed), us, Score::quantile(s.times_us, 0.99));
        }
        if (o.cases) {
            fmt::print("  within 5 px, and median error in pixels, by case\n  {:<14}", "");
            for (const Case& c : kCases)
                if (!c.closed) fmt::print("{:>14}", c.name);
            fmt::print("\n");
            for (const Method& m : all) {
                fmt::print("  {:<14}", m.name);
                for (const Case& c : kCases) {
                    const Score& s = by_case[m.name][c.name];
                    if (!c.closed) fmt::print("{:>14}", fmt::format("{:.0f}% {:.2f}", 100 * s.rate(), Score::quantile(s.errors_px, 0.5)));
                }
                fmt::print("\n");
            }
        }
        if (o.budget_us > 0) {
            const Method* best = nullptr;
            for (const Method& m : all)
                if (Score::quantile(total[m.name].times_us, 0.5) <= o.budget_us &&
                    (best == nullptr || std::pair(total[m.name].rate(), -Score::quantile(total[m.name].errors_px, 0.5)) >
                                            std::pair(total[best->name].rate(), -Score::quantile(total[best->name].errors_px, 0.5))))
                    best = &m;
            if (best != nullptr) fmt::print("  within {:g} us per frame: {}\n", o.budget_us, best->name);
            else fmt::print("  nothing takes {:g} us or less per frame\n", o.budget_us);
        }
        fmt::print("\n");
    }
    if (o.json) fmt::print("{}\n", json.dump(1));
    if (!o.csv.empty())
        if (auto ok = outputs->put(o.csv, csv); !ok) {
            fmt::print(stderr, "fovea tradeoff pupil: {}\n", ok.error().message());
            return kFailed;
        }
    return kSuccess;
}

}  // namespace

void add_tradeoff_pupil(CLI::App& tradeoff, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = tradeoff.add_subcommand("pupil", "Pupil detectors: pixel error and detection rate, and microseconds per frame");
    c->add_option("--count", o->count, "Pictures per case (default 60)")->check(CLI::Range(1, 100000));
    c->add_option("--side", o->sides, "Picture sides, pixels (default 192 400)")->check(CLI::Range(64, 2048));
    c->add_option("--budget-us", o->budget_us, "Name the most reliable method within this time per frame, microseconds")->check(command_line::within(1.0, 1e6));
    c->add_option("--csv", o->csv, "Also write every case of every method here")->check(command_line::file_name());
    c->add_flag("--cases", o->cases, "Also one column per case");
    c->add_flag("--json", o->json, "Print JSON instead of tables");
    c->footer("Rendered eyes with the exact pupil known (drivers/synthetic/eye_image.hpp). \"imagined\": a pupil was found in\n"
              "a closed eye. Times are the processor's. A * marks what no other method beats in time, rate and error at once. Docs: docs/pupil_detection.md\n"
              "Exit codes: 0 judged, 1 cannot write, 2 wrong usage.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
