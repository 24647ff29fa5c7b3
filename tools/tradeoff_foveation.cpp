// `fovea tradeoff foveation`: frame time against error of every foveation method and setting, in one run.
//
// Error of the frontier: the root mean square difference to the full render (of 255), each pixel weighted by how well the
// eye resolves it: 1 / (1 + eccentricity / 2.3 degrees) (the cortical magnification of Rovamo and Virsu 1979, rounded).
// Flicker: the mean difference between successive pictures of a still scene while the gaze drifts by about a degree,
// outside the fovea. Full pixels, exactness and fragments are counted, not computed.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>

#include "protocol/sphere.hpp"
#include "render/foveation/method.hpp"
#include "render/gl/context.hpp"
#include "render/scene/scene.hpp"
#include "tools/commands.hpp"
#include "tools/image_quality.hpp"
#include "tools/output_file.hpp"
#include "tools/tradeoff_report.hpp"

namespace fovea::tools {
namespace {

using foveation::Method;
using Pixels = std::vector<std::uint8_t>;

struct Options {
    std::vector<std::string> scenes{"circuit", "fragbox"};
    int size_px = 512, repeats = 5;
    double budget_ms = -1;
    std::string csv, html;
    bool json = false;
};

// One row of the table: a method with a setting.
struct Variant {
    std::string label, method;
    float gain = 4;
    foveation::MethodSettings settings;
    std::unique_ptr<Method> timed, counting;
};

struct Score {
    std::vector<double> cpu_ms, wall_ms, late_ms;
    double pixels = 1, fragments = 0, exact = 0, weighted = 0, psnr_out = 0, ssim = 0, flicker = 0;
};

constexpr std::array<NdcPoint, 3> kGazes{{{0.05, -0.10}, {-0.45, 0.20}, {0.60, -0.50}}};
constexpr int kDriftSteps = 4;
constexpr double kDrift_ndc = 0.02;   // a degree of a 90 degree view

std::vector<Variant> variants() {
    std::vector<Variant> all;
    const auto add = [&](std::string label, const char* method, float gain, foveation::MethodSettings s = {}) {
        all.push_back({std::move(label), method, gain, std::move(s), nullptr, nullptr});
    };
    add("full", "full", 4);
    for (const float gain : {2.0f, 4.0f, 10.0f}) add(fmt::format("scaled_bins linear, gain {:g}", gain), "scaled_bins", gain);
    foveation::MethodSettings area;
    area.plan.reading = density::Reading::area;
    add("scaled_bins area, gain 4", "scaled_bins", 4, area);
    area.plan.levels = density::standard_levels(true);
    area.plan.level_count = 5;
    add("scaled_bins area pairs, gain 4", "scaled_bins", 4, area);
    foveation::MethodSettings four;
    four.plan.levels = density::standard_levels();
    four.plan.level_count = 4;
    add("scaled_bins to 1/8, gain 10", "scaled_bins", 10, four);
    add("scaled_bins_late, gain 10", "scaled_bins_late", 10);
    for (const double ratio : {0.35, 0.5, 0.7}) {
        foveation::MethodSettings s;
        s.inset_outset.ratio = ratio;
        add(fmt::format("inset_outset {:g}", ratio), "inset_outset", 4, s);
    }
    add("dynamic_viewports", "dynamic_viewports", 4);
    add("shading_rate", "shading_rate", 4);
    return all;
}

double now_ms(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.empty() ? 0 : v[v.size() / 2];
}

class Stage {
public:
    [[nodiscard]] static Result<std::unique_ptr<Stage>> create(const std::string& scene, int size) {
        auto stage = std::make_unique<Stage>();
        auto s = scene::Scene::create({.name = scene, .count_fragments = true});
        if (!s) return std::unexpected(s.error());
        stage->scene_.emplace(*std::move(s));
        for (std::size_t i = 0; i < 2; ++i) {
            auto t = gl::RenderTarget::create({.width_px = size, .height_px = size});
            if (!t) return std::unexpected(t.error());
            stage->owned_.push_back(*std::move(t));
            stage->targets_.push_back({stage->owned_.back().framebuffer(), 0, 0, size, size});
        }
        stage->size_ = size;
        stage->scene_->record(3.0, stage->eyes_, stage->draws_);
        return stage;
    }

    Result<void> prepare(Variant& v) {
        for (const bool counting : {false, true}) {
            v.settings.count_fragments = counting;
            auto m = foveation::create_method(v.method, v.settings);
            if (!m) return std::unexpected(m.error());
            if (auto r = (*m)->prepare(targets_); !r) return r;
            (counting ? v.counting : v.timed) = *std::move(m);
        }
        return {};
    }

    foveation::FrameCost draw(Method& m, float gain, NdcPoint gaze, double* late_ms = nullptr) {
        std::array<foveation::ViewFocus, 2> focus;
        for (auto& f : focus) {
            f.points[0] = {static_cast<float>(gaze.x), static_cast<float>(gaze.y), gain, gain, 0};
            f.count = 1;
        }
        if (m.late_fovea()) {
            m.submit_early(draws_, targets_, focus);
            gl::finish();
        }
        const double start = now_ms(CLOCK_MONOTONIC);
        const auto cost = m.submit(draws_, targets_, focus);
        gl::finish();
        if (late_ms != nullptr) *late_ms = now_ms(CLOCK_MONOTONIC) - start;
        return cost;
    }

    Pixels picture() const {
        Pixels p(static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_) * 4);
        gl::read_pixels(targets_[0].framebuffer, 0, 0, size_, size_, p);
        return p;
    }

    void judge(const Variant& v, NdcPoint gaze, const Pixels& truth, Score& score) {
        const double share = 1.0 / kGazes.size();
        draw(*v.timed, v.gain, gaze);
        const Pixels got = picture();
        const Method::Region region = v.timed->full_region(0);
        const density::Plan* plan = v.timed->plan(0);
        double error = 0, weight = 0, outside_error = 0;
        std::size_t inside = 0, same = 0, outside = 0;
        const FieldOfView view = eyes_[0].fov;
        const Direction<ViewFrame> eye = unproject(view, gaze);
        for (int y = 0; y < size_; ++y)
            for (int x = 0; x < size_; ++x) {
                const std::size_t k = (static_cast<std::size_t>(y) * static_cast<std::size_t>(size_) + static_cast<std::size_t>(x)) * 4;
                double d2 = 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    const double d = double(got[k + c]) - double(truth[k + c]);
                    d2 += d * d / 3;
                }
                const NdcPoint at{(2.0 * x + 1) / size_ - 1, (2.0 * y + 1) / size_ - 1};
                const double w = 1 / (1 + angle_between(eye, unproject(view, at)) / (2.3 * 0.017453292519943295));
                error += w * d2;
                weight += w;
                const double dx = (at.x - region.x_ndc) / region.half_width_ndc, dy = (at.y - region.y_ndc) / region.half_height_ndc;
                const bool full = plan != nullptr ? plan->level_at(x / plan->bin_px(), y / plan->bin_px()) == 0 : dx * dx + dy * dy < 1;
                if (full) {
                    ++inside;
                    same += d2 == 0;
                } else {
                    ++outside;
                    outside_error += d2;
                }
            }
        score.weighted += share * std::sqrt(error / weight);
        score.exact += share * (inside != 0 ? 100.0 * static_cast<double>(same) / static_cast<double>(inside) : 100);
        const double mean = outside != 0 ? outside_error / static_cast<double>(outside) : 0;
        score.psnr_out += share * (mean > 0 ? std::min(kSamePicturePsnr_db, 10 * std::log10(255.0 * 255.0 / mean)) : kSamePicturePsnr_db);
        score.ssim += share * ssim(got, truth, size_, size_);
        // Flicker: nothing moves but the gaze.
        Pixels before = got;
        for (int step = 1; step <= kDriftSteps; ++step) {
            draw(*v.timed, v.gain, {gaze.x + kDrift_ndc * step / kDriftSteps, gaze.y});
            Pixels after = picture();
            double sum = 0;
            for (std::size_t i = 0; i < after.size(); ++i) sum += std::abs(double(after[i]) - double(before[i]));
            score.flicker += share / kDriftSteps * sum / (0.75 * static_cast<double>(after.size()));
            before = std::move(after);
        }
        const auto cost = draw(*v.counting, v.gain, gaze);
        score.pixels += share * (static_cast<double>(cost.pixels_shaded) / static_cast<double>(cost.pixels_full) - 1);
        score.fragments += share * static_cast<double>(v.counting->counted_fragments());
    }

private:
    int size_ = 0;
    std::optional<scene::Scene> scene_;
    std::array<scene::SceneView, 2> eyes_ = scene::stereo_views();
    std::vector<gl::RenderTarget> owned_;
    std::vector<foveation::ViewTarget> targets_;
    gl::CommandList draws_;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea tradeoff foveation: {}\n", error.message());
    return code;
}

Result<TradeoffTable> judge_scene(const std::string& name, const Options& o) {
    auto stage = Stage::create(name, o.size_px);
    if (!stage) return std::unexpected(stage.error());
    auto all = variants();
    for (Variant& v : all)
        if (auto r = (*stage)->prepare(v); !r) return std::unexpected(r.error());
    std::vector<Score> scores(all.size());
    for (const NdcPoint gaze : kGazes) {
        (*stage)->draw(*all[0].timed, 4, gaze);
        const Pixels truth = (*stage)->picture();
        for (std::size_t i = 0; i < all.size(); ++i) (*stage)->judge(all[i], gaze, truth, scores[i]);
    }
    // In turn, so that a slow moment of the machine meets every method.
    for (int r = 0; r < o.repeats; ++r)
        for (std::size_t i = 0; i < all.size(); ++i) {
            const double cpu = now_ms(CLOCK_PROCESS_CPUTIME_ID), wall = now_ms(CLOCK_MONOTONIC);
            double late = 0;
            (*stage)->draw(*all[i].timed, all[i].gain, kGazes[static_cast<std::size_t>(r) % kGazes.size()], &late);
            scores[i].cpu_ms.push_back(now_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu);
            scores[i].wall_ms.push_back(now_ms(CLOCK_MONOTONIC) - wall);
            scores[i].late_ms.push_back(late);
        }
    TradeoffTable t{"foveation, scene " + name,
                    fmt::format("2 x {0}x{0}, {1} gazes; processor time of all threads, medians of {2}; ratios to full in the same run", o.size_px, kGazes.size(), o.repeats),
                    "ns/frame", "weighted error",
                    {"cpu ratio", "wall ratio", "latch-done", "pixels %", "fragments %", "exact %", "PSNR out", "SSIM", "flicker"}, {}};
    const Score& full = scores[0];
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Score& s = scores[i];
        t.rows.push_back({all[i].label, median(s.cpu_ms) * 1e6, s.weighted,
                          {median(s.cpu_ms) / median(full.cpu_ms), median(s.wall_ms) / median(full.wall_ms), median(s.late_ms) / median(full.wall_ms),
                           100 * s.pixels, 100 * s.fragments / full.fragments, s.exact, s.psnr_out, s.ssim, s.flicker}, false, {}});
    }
    mark_frontier(t);
    return t;
}

int run(const Options& o) {
    auto context = gl::Context::create();
    if (!context) return report(context.error(), kFailed);
    std::vector<TradeoffTable> tables;
    std::vector<TradeoffPlot> plots;
    for (const std::string& name : o.scenes) {
        fmt::print(stderr, "{} of {}: {}\n", tables.size() + 1, o.scenes.size(), name);
        auto table = judge_scene(name, o);
        if (!table) return report(table.error(), kFailed);
        plots.push_back(plot_of(*table));
        tables.push_back(*std::move(table));
    }
    if (o.json) fmt::print("{}", to_json(tables));
    else
        for (const auto& t : tables) fmt::print("{}\n", to_text(t));
    std::string csv;
    for (const auto& t : tables) csv += to_csv(t);
    if (!o.csv.empty())
        if (auto ok = write_file(o.csv, csv); !ok) return report(ok.error(), kFailed);
    if (!o.html.empty())
        if (auto ok = write_file(o.html, to_html("Fovea: foveation methods, error against time", tables, plots)); !ok) return report(ok.error(), kFailed);
    if (o.budget_ms >= 0) {
        const TradeoffRow* best = best_within(tables.front(), o.budget_ms * 1e6);
        if (best == nullptr) return report({fmt::format("nothing takes {:g} ms or less", o.budget_ms), "", "allow more with --budget-ms"}, kFailed);
        fmt::print(stderr, "within {:g} ms: {} ({:.1f} ms, weighted error {:.2f} of 255)\n", o.budget_ms, best->method, best->cost_ns * 1e-6, best->error);
    }
    return kSuccess;
}

}  // namespace

void add_tradeoff_foveation(CLI::App& parent, int* exit_code);
void add_tradeoff_foveation(CLI::App& parent, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = parent.add_subcommand("foveation", "Foveation methods and settings: frame time, fragments, exactness, error and flicker against a full render");
    std::vector<std::string> names;
    for (const auto& s : scene::scenes()) names.emplace_back(s.name);
    c->add_option("--scene", o->scenes, "Scenes (default circuit fragbox)")->check(CLI::IsMember(names));
    c->add_option("--size", o->size_px, "Edge of each eye's picture, pixels (default 512)")->check(CLI::Range(64, 4096));
    c->add_option("--repeat", o->repeats, "Timed frames per method; the median counts (default 5)")->check(CLI::Range(1, 1000));
    c->add_option("--budget-ms", o->budget_ms, "Name the most accurate setting within this processor time per frame (first scene)")->check(CLI::Range(0.0, 1e6));
    c->add_option("--csv", o->csv, "Also write the tables here");
    c->add_option("--html", o->html, "Also write a self-contained page with plots here");
    c->add_flag("--json", o->json, "Print JSON instead of tables");
    c->footer("weighted error: RMS difference of 255 to the full render, weighted by how well the eye resolves each place.\n"
              "exact: pixels of the full-resolution region that equal the full render's, bit for bit. A * marks the frontier.\n"
              "Example: fovea tradeoff foveation --scene circuit --html foveation.html\n"
              "Exit codes: 0 measured, 1 no driver, cannot write, or nothing within the budget, 2 wrong usage.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
