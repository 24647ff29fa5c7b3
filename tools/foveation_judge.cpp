#include "tools/foveation_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>

#include "protocol/sphere.hpp"
#include "render/effects/smoothing.hpp"
#include "render/density/acuity.hpp"
#include "render/density/fovea_size.hpp"
#include "render/gl/context.hpp"
#include "render/scene/scene.hpp"
#include "tools/embedded_png.hpp"
#include "tools/image_quality.hpp"

namespace fovea::tools {
namespace {

using foveation::Method;
using Pixels = std::vector<std::uint8_t>;

constexpr std::array<NdcPoint, 3> kGazes{{{0.05, -0.10}, {-0.45, 0.20}, {0.60, -0.50}}};
// Smooth pursuit at 20 degrees per second, 90 frames per second: 0.22 degrees a frame, 0.005 NDC of a 90 degree view.
constexpr int kPursuitFrames = 6;
constexpr double kPursuitStep_ndc = 0.005;
constexpr int kCrop_px = 96;

double now_ms(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double median(std::vector<double> v) {
    if (v.empty()) return 0;
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
}

struct Drawn {
    double cpu_ms = 0, wall_ms = 0, late_ms = 0;
    foveation::FrameCost cost;
};

// A setting with its methods: one that is timed and looked at, one that counts.
struct Candidate {
    const quality::Setting* setting = nullptr;
    std::unique_ptr<Method> timed, counting;
};

class Stage {
public:
    Result<void> open(const std::string& scene, const JudgeOptions& o) {
        options_ = &o;
        auto s = scene::Scene::create({.name = scene, .count_fragments = true});
        if (!s) return std::unexpected(s.error());
        scene_.emplace(*std::move(s));
        for (std::size_t i = 0; i < eyes_.size(); ++i) {
            auto t = gl::RenderTarget::create({.width_px = o.size_px, .height_px = o.size_px});
            if (!t) return std::unexpected(t.error());
            owned_.push_back(*std::move(t));
            targets_.push_back({owned_.back().framebuffer(), 0, 0, o.size_px, o.size_px});
        }
        auto smoothing = effects::Smoothing::create();
        if (!smoothing) return std::unexpected(smoothing.error());
        smoothing_.emplace(*std::move(smoothing));
        if (auto r = smoothing_->prepare(o.size_px, o.size_px, 1); !r) return r;
        scene_->record(3.0, eyes_, draws_);
        weigh();
        return {};
    }

    Result<Candidate> prepare(const quality::Setting& setting) {
        Candidate c{&setting, nullptr, nullptr};
        for (const bool counting : {false, true}) {
            foveation::MethodSettings s = setting.parameters;
            s.count_fragments = counting;
            auto m = foveation::create_method(setting.method, s);
            if (!m) return std::unexpected(m.error());
            if (auto r = (*m)->prepare(targets_); !r) return std::unexpected(r.error());
            (counting ? c.counting : c.timed) = *std::move(m);
        }
        return c;
    }

    Drawn draw(Method& m, double gain, NdcPoint gaze) {
        std::array<foveation::ViewFocus, 2> focus;
        for (std::size_t i = 0; i < focus.size(); ++i) {
            focus[i].points[0] = point(eyes_[i].fov, gain, gaze);
            focus[i].count = 1;
        }
        const double cpu = now_ms(CLOCK_PROCESS_CPUTIME_ID), wall = now_ms(CLOCK_MONOTONIC);
        scene_->record(3.0, eyes_, draws_);
        if (m.late_fovea()) {
            m.submit_early(draws_, targets_, focus);
            gl::finish();
        }
        Drawn d;
        const double latch = now_ms(CLOCK_MONOTONIC);
        d.cost = m.submit(draws_, targets_, focus);
        gl::finish();
        d.cpu_ms = now_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu;
        const double end = now_ms(CLOCK_MONOTONIC);
        d.wall_ms = end - wall;
        d.late_ms = end - latch;
        return d;
    }

    void picture(Pixels& p) const {
        p.resize(pixels() * 4);
        gl::read_pixels(targets_[0].framebuffer, 0, 0, options_->size_px, options_->size_px, p);
    }

    // The last picture, mixed with those before it where it is not at full resolution.
    void smoothed(const Candidate& c, Pixels& p) {
        const bool drawn = smoothing_->draw(0, owned_[0].color_texture(), c.timed->plan(0), c.timed->full_region(0), eyes_[0].fov, {});
        p.resize(pixels() * 4);
        gl::read_pixels(drawn ? smoothing_->result(0).framebuffer() : targets_[0].framebuffer, 0, 0, options_->size_px, options_->size_px, p);
    }

    // 255 where the last frame of the method is not at full resolution.
    void outside(const Method& m, Pixels& mask) const {
        const int size = options_->size_px;
        mask.assign(pixels(), 0);
        const Method::Region region = m.full_region(0);
        const density::Plan* plan = m.plan(0);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const NdcPoint at = centre(x, y);
                const double dx = (at.x - region.x_ndc) / region.half_width_ndc, dy = (at.y - region.y_ndc) / region.half_height_ndc;
                const bool full = plan != nullptr ? plan->level_at(x / plan->bin_px(), y / plan->bin_px()) == 0 : dx * dx + dy * dy < 1;
                if (!full) mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x)] = 255;
            }
    }

    void judge(Candidate& c, std::size_t gaze_index, const Pixels& truth, std::uint64_t full_fragments, FoveationScore& score) {
        const int size = options_->size_px;
        const double share = 1.0 / kGazes.size();
        const NdcPoint gaze = kGazes[gaze_index];
        draw(*c.timed, c.setting->gain, gaze);
        Pixels got, mask;
        picture(got);
        outside(*c.timed, mask);
        const std::vector<float>& weights = weights_[gaze_index];
        double error = 0, weight = 0;
        std::size_t inside = 0, same = 0;
        for (std::size_t i = 0; i < pixels(); ++i) {
            double d2 = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double d = double(got[4 * i + k]) - double(truth[4 * i + k]);
                d2 += d * d / 3;
            }
            error += weights[i] * d2;
            weight += weights[i];
            if (mask[i] == 0) {
                ++inside;
                same += d2 == 0;
            }
        }
        const Similarity out = similarity(got, truth, size, size, mask);
        score.weighted_error += share * std::sqrt(error / weight);
        score.exact += share * (inside != 0 ? static_cast<double>(same) / static_cast<double>(inside) : 1);
        score.psnr_out_db += share * out.psnr_db;
        score.ssim_out += share * out.ssim;
        if (gaze_index == 0) {
            score.fovea_png = png_data_uri(got, size, around(gaze));
            score.periphery_png = png_data_uri(got, size, periphery_);
        }
        flicker(c, gaze, got, mask, score);
        const Drawn counted = draw(*c.counting, c.setting->gain, gaze);
        score.pixels += share * static_cast<double>(counted.cost.pixels_shaded) / static_cast<double>(counted.cost.pixels_full);
        score.fragments += share * static_cast<double>(c.counting->counted_fragments()) / static_cast<double>(full_fragments);
    }

    // The window of the first gaze's periphery that has the most detail.
    void choose_periphery(const Pixels& truth) {
        const int size = options_->size_px, edge = std::min(kCrop_px, size);
        periphery_ = {0, 0, edge};
        double most = -1;
        for (int y = 0; y + edge <= size; y += edge / 2)
            for (int x = 0; x + edge <= size; x += edge / 2) {
                const NdcPoint at = centre(x + edge / 2, y + edge / 2);
                if (std::hypot(at.x - kGazes[0].x, at.y - kGazes[0].y) < 0.6) continue;
                double detail = 0;
                for (int j = y; j < y + edge; ++j)
                    for (int i = x + 1; i < x + edge; ++i) {
                        const auto k = static_cast<std::size_t>(4 * (j * size + i) + 1);
                        detail += std::abs(double(truth[k]) - double(truth[k - 4]));
                    }
                if (detail > most) {
                    most = detail;
                    periphery_.x = x;
                    periphery_.y = y;
                }
            }
    }

private:
    [[nodiscard]] std::size_t pixels() const { return static_cast<std::size_t>(options_->size_px) * static_cast<std::size_t>(options_->size_px); }
    [[nodiscard]] NdcPoint centre(int x, int y) const { return {(2.0 * x + 1) / options_->size_px - 1, (2.0 * y + 1) / options_->size_px - 1}; }

    [[nodiscard]] PixelWindow around(NdcPoint gaze) const {
        const int size = options_->size_px, edge = std::min(kCrop_px, size);
        const auto place = [&](double ndc) { return std::clamp(static_cast<int>((ndc + 1) / 2 * size) - edge / 2, 0, size - edge); };
        return {place(gaze.x), place(gaze.y), edge};
    }

    [[nodiscard]] density::FocalPoint point(const FieldOfView& view, double gain, NdcPoint gaze) const {
        const auto g = static_cast<float>(gain);
        if (!(options_->fovea_deg > 0)) return {static_cast<float>(gaze.x), static_cast<float>(gaze.y), g, g, 0};
        const auto per_rad = [](double low, double high, double ndc) {   // an angle's length in NDC there, along this axis
            const double half = (high - low) / 2, t = low + (ndc + 1) * half;
            return (1 + t * t) / half;
        };
        density::FoveaSizeSettings s;
        s.gain = gain;
        s.min_radius_rad = options_->fovea_deg * 0.017453292519943295;
        return density::sized_focal_point(s, gaze.x, gaze.y, 0, per_rad(view.tan_left, view.tan_right, gaze.x), per_rad(view.tan_down, view.tan_up, gaze.y));
    }

    // What the eye makes of each pixel of the left view, per gaze.
    void weigh() {
        const FieldOfView& view = eyes_[0].fov;
        const density::AcuitySettings acuity;
        const double pixel = std::max(view.tan_right - view.tan_left, view.tan_up - view.tan_down) / options_->size_px;
        for (std::size_t g = 0; g < kGazes.size(); ++g) {
            const Direction<ViewFrame> eye = unproject(view, kGazes[g]);
            weights_[g].reserve(pixels());
            for (int y = 0; y < options_->size_px; ++y)
                for (int x = 0; x < options_->size_px; ++x) {
                    const double scale = density::needed_scale(acuity, angle_between(eye, unproject(view, centre(x, y))), 0, pixel);
                    weights_[g].push_back(static_cast<float>(scale * scale));
                }
        }
    }

    void flicker(Candidate& c, NdcPoint gaze, Pixels before, Pixels before_mask, FoveationScore& score) {
        Pixels after, mask, smooth_before, smooth;
        double sum = 0, smooth_sum = 0;
        smoothing_->forget();
        smoothed(c, smooth_before);
        std::size_t count = 0;
        for (int step = 1; step <= kPursuitFrames; ++step) {
            draw(*c.timed, c.setting->gain, {gaze.x + kPursuitStep_ndc * step, gaze.y});
            picture(after);
            smoothed(c, smooth);
            outside(*c.timed, mask);
            for (std::size_t i = 0; i < pixels(); ++i) {
                if (mask[i] == 0 || before_mask[i] == 0) continue;
                ++count;
                for (std::size_t k = 4 * i; k < 4 * i + 3; ++k) {
                    sum += std::abs(double(after[k]) - double(before[k]));
                    smooth_sum += std::abs(double(smooth[k]) - double(smooth_before[k]));
                }
            }
            std::swap(before, after);
            std::swap(smooth_before, smooth);
            std::swap(before_mask, mask);
        }
        if (count != 0) {
            score.flicker += sum / (3.0 * static_cast<double>(count)) / kGazes.size();
            score.flicker_smooth += smooth_sum / (3.0 * static_cast<double>(count)) / kGazes.size();
        }
    }

    const JudgeOptions* options_ = nullptr;
    std::optional<scene::Scene> scene_;
    std::array<scene::SceneView, 2> eyes_ = scene::stereo_views();
    std::vector<gl::RenderTarget> owned_;
    std::vector<foveation::ViewTarget> targets_;
    gl::CommandList draws_;
    std::optional<effects::Smoothing> smoothing_;
    std::array<std::vector<float>, kGazes.size()> weights_;
    PixelWindow periphery_;
};

}  // namespace

Result<std::vector<FoveationScore>> judge_foveation(const std::string& scene, const std::vector<quality::Setting>& settings, const JudgeOptions& o) {
    FOVEA_REQUIRE(!settings.empty() && settings[0].method == "full");
    Stage stage;
    if (auto r = stage.open(scene, o); !r) return std::unexpected(r.error());
    auto reference = stage.prepare(settings[0]);
    if (!reference) return std::unexpected(reference.error());
    std::array<Pixels, kGazes.size()> truths;
    std::array<std::uint64_t, kGazes.size()> fragments{};
    for (std::size_t g = 0; g < kGazes.size(); ++g) {
        stage.draw(*reference->timed, 4, kGazes[g]);
        stage.picture(truths[g]);
        stage.draw(*reference->counting, 4, kGazes[g]);
        fragments[g] = std::max<std::uint64_t>(reference->counting->counted_fragments(), 1);
    }
    stage.choose_periphery(truths[0]);

    std::vector<FoveationScore> scores;
    std::vector<double> all_cpu, all_wall;   // of every full frame
    for (const quality::Setting& setting : settings) {
        if (o.progress) o.progress(scene + ": " + setting.label, scores.size() + 1, settings.size());
        auto c = stage.prepare(setting);
        if (!c) return std::unexpected(c.error());
        FoveationScore s;
        s.pixels = s.fragments = s.exact = s.psnr_out_db = s.ssim_out = 0;
        for (std::size_t g = 0; g < kGazes.size(); ++g) stage.judge(*c, g, truths[g], fragments[g], s);   // also warms it up
        // Full and foveated in turn, so that whatever else the machine does falls on both.
        std::vector<double> cpu, wall, late, full_cpu, full_wall;
        for (int i = 0; i < o.frames; ++i) {
            const NdcPoint gaze = kGazes[static_cast<std::size_t>(i) % kGazes.size()];
            const Drawn full = stage.draw(*reference->timed, 4, gaze), mine = stage.draw(*c->timed, setting.gain, gaze);
            full_cpu.push_back(full.cpu_ms);
            full_wall.push_back(full.wall_ms);
            cpu.push_back(mine.cpu_ms);
            wall.push_back(mine.wall_ms);
            late.push_back(mine.late_ms);
        }
        s.cpu_ratio = median(cpu) / median(full_cpu);
        s.wall_ratio = median(wall) / median(full_wall);
        s.latch_to_done_ratio = median(late) / median(full_wall);
        all_cpu.insert(all_cpu.end(), full_cpu.begin(), full_cpu.end());
        all_wall.insert(all_wall.end(), full_wall.begin(), full_wall.end());
        scores.push_back(std::move(s));
    }
    // Milliseconds of a quiet moment are not to be had for every setting alike: each ratio times one full frame's time.
    scores[0].cpu_ratio = scores[0].wall_ratio = 1;
    for (FoveationScore& s : scores) {
        s.cpu_ms = s.cpu_ratio * median(all_cpu);
        s.wall_ms = s.wall_ratio * median(all_wall);
    }
    return scores;
}

std::vector<quality::Setting> foveation_settings() {
    std::vector<quality::Setting> all;
    const auto add = [&](std::string label, const char* method) -> quality::Setting& {
        quality::Setting s;
        s.label = std::move(label);
        s.method = method;
        s.parameters.plan.levels = density::standard_levels();
        all.push_back(std::move(s));
        return all.back();
    };
    add("full", "full");
    for (const double gain : {1.5, 2.0, 3.0, 4.0, 6.0, 10.0}) add(fmt::format("scaled_bins, gain {:g}", gain), "scaled_bins").gain = gain;
    for (const double gain : {4.0, 10.0}) {
        auto& s = add(fmt::format("scaled_bins by rectangle lists, gain {:g}", gain), "scaled_bins");
        s.gain = gain;
        s.parameters.executor = foveation::BinExecutor::rectangles;
    }
    for (const bool pairs : {false, true}) {
        auto& s = add(pairs ? "scaled_bins area pairs, gain 4" : "scaled_bins area, gain 4", "scaled_bins");
        s.parameters.plan.reading = density::Reading::area;
        s.parameters.plan.levels = density::standard_levels(pairs);
        s.parameters.plan.level_count = pairs ? 5 : 3;
    }
    for (const double gain : {4.0, 10.0}) {
        auto& s = add(fmt::format("scaled_bins to 1/8, gain {:g}", gain), "scaled_bins");
        s.gain = gain;
        s.parameters.plan.level_count = 4;
    }
    for (const double gain : {4.0, 10.0}) add(fmt::format("scaled_bins_late, gain {:g}", gain), "scaled_bins_late").gain = gain;
    for (const double ratio : {0.35, 0.5, 0.7}) add(fmt::format("inset_outset, ratio {:g}", ratio), "inset_outset").parameters.inset_outset.ratio = ratio;
    for (const double scale : {0.3, 0.4, 0.6}) add(fmt::format("dynamic_viewports, context {:g}", scale), "dynamic_viewports").parameters.dynamic_viewports.context_scale = scale;
    for (const double radius : {0.10, 0.20}) {
        auto& s = add(fmt::format("shading_rate, radius {:g}", radius), "shading_rate").parameters.shading_rate;
        s.inner_radius = radius;
        s.outer_radius = 1.5 * radius;
    }
    return all;
}

}  // namespace fovea::tools
