#include "render/layer/replay.hpp"

#include <algorithm>

namespace fovea::layer {

void Replay::begin(const LevelView& view) {
    view_ = view;
    if (view_.native) return;
    gl.GetIntegerv(GL_VIEWPORT, viewport_.data());
    gl.GetIntegerv(GL_SCISSOR_BOX, scissor_.data());
    scissor_on_ = gl.IsEnabled(GL_SCISSOR_TEST) == GL_TRUE;
    gl.Enable(GL_SCISSOR_TEST);
    apply_viewport();
    apply_scissor();
    if (!view_.masked) return;
    gl.Enable(GL_STENCIL_TEST);
    gl.StencilFunc(GL_EQUAL, static_cast<GLint>(kMaskBit), kMaskBit);
    gl.StencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    gl.StencilMask(~kMaskBit);  // the program's clears of the stencil buffer leave the mask alone
}

void Replay::viewport(GLint x, GLint y, GLsizei w, GLsizei h) {
    if (view_.native) return gl.Viewport(x, y, w, h);
    if (w < 0 || h < 0) return;
    viewport_ = {x, y, w, h};
    apply_viewport();
}

void Replay::scissor(GLint x, GLint y, GLsizei w, GLsizei h) {
    if (view_.native) return gl.Scissor(x, y, w, h);
    if (w < 0 || h < 0) return;
    scissor_ = {x, y, w, h};
    apply_scissor();
}

void Replay::set_enabled(GLenum capability, bool on) {
    if (!view_.native && capability == GL_SCISSOR_TEST) {
        scissor_on_ = on;
        return apply_scissor();
    }
    if (view_.masked && capability == GL_STENCIL_TEST) return;
    on ? gl.Enable(capability) : gl.Disable(capability);
}

void Replay::apply_viewport() const {
    const auto [x, y, w, h] = viewport_;
    if (view_.x_shift == 0 && view_.y_shift == 0) return gl.Viewport(x, y, w, h);
    const float sx = 1.0f / static_cast<float>(1 << view_.x_shift), sy = 1.0f / static_cast<float>(1 << view_.y_shift);
    const auto scaled = [](GLint v, float s) { return static_cast<float>(v) * s; };
    if (view_.float_viewport) {
        gl.ViewportIndexedfOES(0, scaled(x, sx), scaled(y, sy), scaled(w, sx), scaled(h, sy));
        return;
    }
    const auto rounded = [&](GLint v, float s) { return static_cast<GLint>(scaled(v, s) + (v < 0 ? -0.5f : 0.5f)); };
    gl.Viewport(rounded(x, sx), rounded(y, sy), std::max(1, rounded(w, sx)), std::max(1, rounded(h, sy)));
}

void Replay::apply_scissor() const {
    std::int64_t x0 = view_.bounds.x0, y0 = view_.bounds.y0, x1 = view_.bounds.x1, y1 = view_.bounds.y1;
    if (scissor_on_) {
        x0 = std::max<std::int64_t>(x0, scissor_[0]);
        y0 = std::max<std::int64_t>(y0, scissor_[1]);
        x1 = std::min(x1, std::int64_t{scissor_[0]} + scissor_[2]);
        y1 = std::min(y1, std::int64_t{scissor_[1]} + scissor_[3]);
    }
    if (x0 >= x1 || y0 >= y1) return gl.Scissor(0, 0, 0, 0);
    const auto up = [](std::int64_t v, int shift) { return (v + (std::int64_t{1} << shift) - 1) >> shift; };
    const GLint left = static_cast<GLint>(x0 >> view_.x_shift), bottom = static_cast<GLint>(y0 >> view_.y_shift);
    gl.Scissor(left, bottom, static_cast<GLsizei>(up(x1, view_.x_shift)) - left,
               static_cast<GLsizei>(up(y1, view_.y_shift)) - bottom);
}

}  // namespace fovea::layer
