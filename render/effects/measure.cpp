#include "render/effects/measure.hpp"

#include <algorithm>
#include <ctime>
#include <optional>
#include <thread>
#include <vector>

#include "render/effects/lens_pass.hpp"
#include "render/effects/smoothing.hpp"
#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/gl/context.hpp"

namespace fovea::effects {
namespace {

constexpr float kGain = 4;              // the viewer's
constexpr int kTiny_px = 16;            // next to nothing is shaded
constexpr Lens kSomeLens{.k1 = 0.22, .k2 = 0.24};   // for the cost of distortion where no lens is known
constexpr double kFrame_s = 1.0 / 90;   // between two frames of an extrapolation
constexpr float kAhead = 0.5f;          // of that: the viewer's
constexpr double kLens_ndc = 1.0;       // for the cost of a hidden area where no lens is known

double now_ms(bool processor) noexcept {
    timespec t{};
    clock_gettime(processor ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double median(std::vector<double> v) {
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
}

// One way to draw a frame, with targets of its own size.
class Way {
public:
    static Result<Way> create(const std::string& method, const foveation::MethodSettings& settings, int width_px, int height_px) {
        Way w;
        auto m = foveation::create_method(method, settings);
        if (!m) return std::unexpected(m.error());
        w.method_ = *std::move(m);
        for (std::size_t i = 0; i < 2; ++i) {
            auto t = gl::RenderTarget::create({.width_px = width_px, .height_px = height_px});
            if (!t) return std::unexpected(t.error());
            w.owned_[i] = *std::move(t);
            w.targets_[i] = {w.owned_[i].framebuffer(), 0, 0, width_px, height_px};
        }
        if (auto ok = w.method_->prepare(w.targets_); !ok) return std::unexpected(ok.error());
        return w;
    }
    // With a pass after the method's.
    Result<void> add(Effect e, const Lens& lens) {
        const int w = targets_[0].width_px, h = targets_[0].height_px;
        if (e == Effect::lens_distortion) {
            auto p = LensPass::create(lens);
            if (!p) return std::unexpected(p.error());
            lens_.emplace(*std::move(p));
            return lens_->prepare(w, h, 2);
        }
        auto p = Smoothing::create();
        if (!p) return std::unexpected(p.error());
        smoothing_.emplace(*std::move(p));
        return smoothing_->prepare(w, h, 2);
    }
    void draw(const gl::CommandList& list, bool processor) {
        std::array<foveation::ViewFocus, 2> focus;
        for (auto& f : focus) {
            f.points[0] = {0.05f, -0.1f, kGain, kGain, 0};
            f.count = 1;
        }
        const double start = now_ms(processor);
        method_->submit(list, targets_, focus);
        for (std::size_t i = 0; i < 2; ++i) {
            if (lens_) lens_->draw(i, owned_[i].color_texture());
            if (smoothing_) smoothing_->draw(i, owned_[i].color_texture(), method_->plan(i), method_->full_region(i), scene::stereo_views()[i].fov, {});
        }
        if (extrapolator_ != nullptr) follow();
        gl::finish();
        times_ms_.push_back(now_ms(processor) - start);
    }
    // From now on each frame is followed by an extrapolated one.
    Result<void> extrapolate() {
        namespace extrapolation = render::extrapolation;
        auto made = extrapolation::GlExtrapolator::create(gl::driver_function, {.threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4), .backend = {}});
        if (!made) return std::unexpected(made.error());
        for (auto* targets : {&last_, &between_})
            for (std::size_t i = 0; i < 2; ++i) {
                auto t = gl::RenderTarget::create({.width_px = owned_[i].width(), .height_px = owned_[i].height(), .depth_stencil = false});
                if (!t) return std::unexpected(t.error());
                (*targets)[i] = *std::move(t);
            }
        extrapolator_ = std::make_unique<extrapolation::GlExtrapolator>(*std::move(made));
        return {};
    }
    void forget() { times_ms_.clear(); }
    [[nodiscard]] double cost_ms() const { return median(times_ms_); }

private:
    void follow() {
        for (std::size_t i = 0; i < 2; ++i) {
            static_cast<void>(extrapolator_->extrapolate(last_[i].color_texture(), owned_[i].color_texture(), between_[i].color_texture(), kAhead));
            gl::copy_color(owned_[i], last_[i]);
        }
    }
    std::unique_ptr<foveation::Method> method_;
    std::optional<LensPass> lens_;
    std::optional<Smoothing> smoothing_;
    std::unique_ptr<render::extrapolation::GlExtrapolator> extrapolator_;
    std::array<gl::RenderTarget, 2> last_, between_;   // with an extrapolator
    std::array<gl::RenderTarget, 2> owned_;
    std::array<foveation::ViewTarget, 2> targets_{};
    std::vector<double> times_ms_;
};

void draw_in_turn(std::span<Way> ways, const gl::CommandList& list, const MeasureSettings& s) {
    for (Way& w : ways) w.draw(list, s.software);   // compiles shaders
    for (Way& w : ways) w.forget();
    for (int i = 0; i < s.rounds; ++i)
        for (Way& w : ways) w.draw(list, s.software);
}

Result<std::optional<Cost>> measure_extrapolation(const scene::Scene& scene, const Plan& planned, const Situation& s, const MeasureSettings& settings) {
    std::vector<Way> ways;
    foveation::MethodSettings m;
    planned.apply(m);
    for (const bool followed : {false, true}) {
        auto way = Way::create(planned.method(), m, s.width_px, s.height_px);
        if (!way) return std::unexpected(way.error());
        if (followed)
            if (auto r = way->extrapolate(); !r) return std::unexpected(r.error());
        ways.push_back(*std::move(way));
    }
    // Two moments in turn: a picture that stands still is not searched.
    gl::CommandList list;
    for (int i = -2; i < settings.rounds; ++i) {
        scene.record(settings.time_s + (i % 2 == 0 ? 0 : kFrame_s), scene::stereo_views(), list);
        for (Way& w : ways) {
            if (i == 0) w.forget();   // the first two compile shaders and fill the frame before
            w.draw(list, settings.software);
        }
    }
    return Cost{ways[0].cost_ms(), ways[1].cost_ms()};
}

}  // namespace

Result<void> measure_frames(const scene::Scene& scene, const Situation& s, const MeasureSettings& settings, Needs& needs) {
    gl::CommandList list;
    scene.record(settings.time_s, scene::stereo_views(), list);
    std::vector<Way> ways;
    struct Wanted {
        const char* method;
        int width, height;
    };
    for (const Wanted& w : {Wanted{"full", kTiny_px, kTiny_px}, Wanted{"full", s.width_px, s.height_px},
                            Wanted{s.method == "auto" || s.method == "full" ? "scaled_bins" : s.method.c_str(), s.width_px, s.height_px}}) {
        auto way = Way::create(w.method, {}, w.width, w.height);
        if (!way) return std::unexpected(way.error());
        ways.push_back(*std::move(way));
    }
    draw_in_turn(ways, list, settings);
    needs.vertex_ms = ways[0].cost_ms();
    needs.full_ms = ways[1].cost_ms();
    needs.foveated_ms = ways[2].cost_ms();
    return {};
}

Result<std::optional<Cost>> measure_effect(Effect e, const scene::Scene& scene, const Plan& planned, const Situation& s, const MeasureSettings& settings) {
    if (e == Effect::foveation) return std::optional<Cost>{};
    if (e == Effect::extrapolation) return measure_extrapolation(scene, planned, s, settings);
    std::vector<Way> ways;
    Situation situation = s;
    situation.method = planned.method();
    for (const bool on : {false, true}) {
        Needs needs = planned.needs();
        if (e == Effect::hidden_area && needs.lens_radius <= 0) needs.lens_radius = kLens_ndc;
        Declared forced;
        if (e == Effect::lens_distortion) forced.lens = planned.lens().distorts() ? planned.lens() : kSomeLens;
        for (std::size_t i = 0; i < kEffects; ++i) forced.effects[i] = planned.on(static_cast<Effect>(i));
        forced.effects[static_cast<std::size_t>(e)] = on;
        const Plan with = plan(needs, situation, forced);
        if (with.on(e) != on) return std::optional<Cost>{};   // the method has none
        foveation::MethodSettings m;
        with.apply(m);
        auto way = Way::create(with.method(), m, s.width_px, s.height_px);
        if (!way) return std::unexpected(way.error());
        if (on && (e == Effect::lens_distortion || e == Effect::temporal_smoothing))
            if (auto ok = way->add(e, planned.lens().distorts() ? planned.lens() : kSomeLens); !ok) return std::unexpected(ok.error());
        ways.push_back(*std::move(way));
    }
    gl::CommandList list;
    scene.record(settings.time_s, scene::stereo_views(), list);
    draw_in_turn(ways, list, settings);
    return Cost{ways[0].cost_ms(), ways[1].cost_ms()};
}

}  // namespace fovea::effects
