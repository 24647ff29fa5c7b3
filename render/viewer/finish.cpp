#include "render/viewer/finish.hpp"

namespace fovea::viewer {

Result<void> Finish::prepare(const Eyes& eyes) {
    const effects::Plan& plan = eyes.planned();
    if (plan.on(effects::Effect::temporal_smoothing) != smoothing_.has_value()) {
        smoothing_.reset();
        if (plan.on(effects::Effect::temporal_smoothing)) {
            auto made = effects::Smoothing::create();
            if (!made) return std::unexpected(made.error());
            smoothing_.emplace(*std::move(made));
        }
    }
    if (plan.on(effects::Effect::lens_distortion) != lens_.has_value()) {
        lens_.reset();
        if (plan.on(effects::Effect::lens_distortion)) {
            auto made = effects::LensPass::create(plan.lens());
            if (!made) return std::unexpected(made.error());
            lens_.emplace(*std::move(made));
        }
    }
    if (smoothing_)
        if (auto r = smoothing_->prepare(eyes.width(), eyes.height(), kEyes); !r) return r;
    if (lens_)
        if (auto r = lens_->prepare(eyes.width(), eyes.height(), kEyes); !r) return r;
    return {};
}

void Finish::draw(Eyes& eyes, const Frame& frame) noexcept {
    std::array<const gl::RenderTarget*, kEyes> pictures{};
    for (std::size_t i = 0; i < kEyes; ++i) {
        pictures[i] = &eyes.target(i);
        if (!smoothing_) continue;
        const density::Plan* plan = frame.cost.fell_back ? nullptr : eyes.method().plan(i);
        if (smoothing_->draw(i, eyes.target(i).color_texture(), plan, frame.regions[i], Eyes::views()[i].fov, eyes.camera(frame.scene_s))) pictures[i] = &smoothing_->result(i);
    }
    rendered_ = pictures;
    draw(pictures);
}

void Finish::draw(const std::array<const gl::RenderTarget*, kEyes>& pictures) noexcept {
    flat_ = pictures;
    for (std::size_t i = 0; i < kEyes && lens_; ++i) {
        lens_->draw(i, pictures[i]->color_texture());
        warped_[i] = &lens_->result(i);
    }
}

}  // namespace fovea::viewer
