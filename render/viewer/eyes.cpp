#include "render/viewer/eyes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "render/effects/contents.hpp"
#include "render/effects/declared.hpp"
#include "render/effects/measure.hpp"
#include "render/effects/print.hpp"

namespace fovea::viewer {

std::expected<Eyes, Failure> Eyes::create(const Options& o, const TimeSource& time) {
    Eyes eyes(o.fovea);
    auto opened = effects::open_scene(o.scene);
    if (!opened) return failed(opened.error(), kUsage);
    for (const auto d : {gl::ViewDrawing::repeated, gl::ViewDrawing::instanced, gl::ViewDrawing::multiview2})
        if (o.views == gl::view_drawing_name(d)) eyes.drawing_ = d;
    eyes.declared_ = std::move(opened->declared);
    std::vector<effects::Spot> spots;
    eyes.needs_ = effects::look_at(opened->source, {.width_px = o.width_px, .height_px = o.height_px}, &spots);
    if (auto r = effects::add_print(spots, eyes.needs_); !r) return failed(r.error());
    eyes.needs_.object_px *= std::abs(o.speed);
    eyes.needs_.camera_px *= std::abs(o.speed);
    auto scene = scene::Scene::create({.name = o.scene, .speed = o.speed}, std::move(opened->source));
    if (!scene) return failed(scene.error(), kUsage);
    eyes.scene_.emplace(*std::move(scene));
    std::string method = o.quality == "off" ? o.method : "full";
    if (method == "auto") {   // what pays is measured once, here; `auto` itself goes on watching where it does
        const effects::Situation situation{.width_px = o.width_px, .height_px = o.height_px};
        if (auto r = effects::measure_frames(*eyes.scene_, situation, {.rounds = 1}, eyes.needs_); !r) return failed(r.error());
        const effects::Plan plan = eyes.plan(method, o.width_px, o.height_px);
        if (!plan.on(effects::Effect::foveation)) method = "full";
        if (!o.quiet && !o.json) std::fprintf(stderr, "fovea-view: auto draws with %s: %s\n", method == "full" ? "full" : "scaled_bins", plan.decision(effects::Effect::foveation).reason.c_str());
    }
    if (auto r = eyes.choose_method(method); !r) return failed(r.error(), kUsage);
    if (o.quality != "off") {
        auto ladder = o.quality == "auto" ? Result<quality::Ladder>(quality::built_in_ladder()) : quality::load_ladder(o.quality);
        if (!ladder) return failed(ladder.error(), kUnusableInput);
        std::optional<quality::GovernorSettings> governor;
        if (o.quality == "auto" || o.budget_ms > 0) governor.emplace().budget = seconds(o.budget_ms > 0 ? o.budget_ms * 1e-3 : 1 / o.scanout.refresh_hz);
        auto control = quality::Control::create(eyes.planned(*std::move(ladder), o.width_px, o.height_px), governor);
        if (!control) return failed(control.error(), kUsage);
        eyes.quality_.emplace(*std::move(control));
    }
    if (auto r = eyes.resize(o.width_px, o.height_px); !r) return failed(r.error());
    if (!eyes.warm_up(time)) return failed({"the GPU did not finish the first frame in 10 seconds", o.scene, "use a smaller --size"});
    return eyes;
}

effects::Plan Eyes::plan(const std::string& method, int width_px, int height_px) const {
    return effects::plan(needs_, {.method = method, .width_px = width_px, .height_px = height_px}, declared_);
}

quality::Ladder Eyes::planned(quality::Ladder ladder, int width_px, int height_px) const {
    for (quality::Setting& s : ladder.settings) {
        const effects::Plan wanted = plan(s.method, width_px, height_px);
        const density::Reading own = s.parameters.plan.reading;
        wanted.apply(s.parameters);
        if (!wanted.on(effects::Effect::finer_periphery)) s.parameters.plan.reading = own;   // the ladder may ask for more than the scene
    }
    return ladder;
}

std::vector<std::string> Eyes::effects() const {
    const effects::Plan p = plan(quality_ ? quality_->setting().method : method_name_, width(), height());
    std::vector<std::string> on;
    for (const auto& e : effects::effect_entries())
        if (p.on(e.effect)) on.emplace_back(e.name);
    return on;
}

Result<void> Eyes::resize(int width_px, int height_px) {
    if (width_px == width() && height_px == height()) return {};
    std::array<gl::RenderTarget, kEyes> made;
    for (auto& target : made) {
        auto t = gl::RenderTarget::create({.width_px = width_px, .height_px = height_px});
        if (!t) return std::unexpected(t.error());
        target = *std::move(t);
    }
    owned_ = std::move(made);
    for (std::size_t i = 0; i < kEyes; ++i) targets_[i] = {owned_[i].framebuffer(), 0, 0, width_px, height_px};
    if (quality_)
        if (auto r = quality_->prepare(targets_); !r) return r;
    if (auto r = method_->prepare(targets_); !r) return r;
    return draw_at_once();
}

// The scene's programs draw as many views at once as the method does.
Result<void> Eyes::draw_at_once() { return scene_->draw_at_once(quality_ ? gl::ViewsAtOnce{} : method_->views_at_once()); }

Result<void> Eyes::choose_method(const std::string& name) {
    quality_.reset();
    drawn_ = method_.get();
    if (name == method_name_) return {};
    foveation::MethodSettings settings;
    const effects::Plan planned = plan(name, width(), height());
    planned.apply(settings);
    settings.inset_outset.drawing = drawing_;
    auto method = foveation::create_method(name, settings);
    if (!method) return std::unexpected(method.error());
    if (width() > 0)
        if (auto r = (*method)->prepare(targets_); !r) return r;
    method_ = *std::move(method);
    method_name_ = name;
    effects_ = planned;
    drawn_ = method_.get();
    return draw_at_once();
}

void Eyes::focus_on(const Latched& latched) noexcept {
    density::FoveaSizeSettings size = fovea_;
    if (quality_) size.gain = quality_->setting().gain;
    for (std::size_t i = 0; i < kEyes; ++i) {
        const fovea_focal& f = latched.focals[i];
        focus_[i].points[0] = density::sized_focal_point(size, f.x_ndc, f.y_ndc, f.radius95_rad, f.ndc_per_rad_x, f.ndc_per_rad_y);
        focus_[i].count = next().wants_gaze_status() && (f.flags & FOVEA_FOCAL_STATIC) != 0 ? 0 : 1;
    }
}

void Eyes::submit_early(const Latched& latched) noexcept {
    focus_on(latched);
    next().submit_early(draws_, targets_, focus_);
}

foveation::FrameCost Eyes::submit(const Latched& latched) noexcept {
    focus_on(latched);
    drawn_ = &next();
    return drawn_->submit(draws_, targets_, focus_);
}

// The driver compiles shaders at their first use: not in the first frame that counts. An off-centre fovea of each size
// uses every level.
bool Eyes::warm_up(const TimeSource& time) {
    record(0);
    if (quality_) {
        quality_->warm_up(draws_, targets_);
        drawn_ = &next();
        return gl::Fence::insert().wait(time).has_value();
    }
    for (const float gain : {3.0f, 12.0f}) {
        for (auto& f : focus_) {
            f.points[0] = {0.3f, 0.2f, gain, gain, 0};
            f.count = 1;
        }
        method_->submit(draws_, targets_, focus_);
        if (!gl::Fence::insert().wait(time)) return false;
    }
    return true;
}

const density::Plan* Eyes::levels(std::size_t eye) {
    if (const density::Plan* plan = drawn_->plan(eye)) return plan;
    const double scale = drawn_->outside_scale();
    if (!(scale > 0 && scale < 1)) return nullptr;
    std::optional<density::Plan>& plan = like_a_plan_[eye];
    if (!plan || plan->settings().width_px != width() || plan->settings().height_px != height()) {
        density::PlanSettings s;
        s.width_px = width();
        s.height_px = height();
        s.bin_px = std::max(4, width() / 192);   // fine enough for a circle
        auto made = density::Plan::create(s);
        if (!made) return nullptr;
        plan.emplace(*std::move(made));
    }
    const foveation::Method::Region r = drawn_->full_region(eye);
    const auto outside = static_cast<std::uint8_t>(std::clamp(std::lround(-std::log2(scale)), 1L, 2L));
    levels_.clear();
    for (int row = 0; row < plan->rows(); ++row)
        for (int column = 0; column < plan->columns(); ++column) {
            const double dx = ((2.0 * column + 1) * plan->bin_px() / width() - 1 - r.x_ndc) / r.half_width_ndc;
            const double dy = ((2.0 * row + 1) * plan->bin_px() / height() - 1 - r.y_ndc) / r.half_height_ndc;
            levels_.push_back(dx * dx + dy * dy < 1 ? std::uint8_t{0} : outside);
        }
    plan->assign_levels(levels_);
    return &*plan;
}

}  // namespace fovea::viewer
