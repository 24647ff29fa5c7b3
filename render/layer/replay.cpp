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
    stencil_on_ = gl.IsEnabled(GL_STENCIL_TEST) == GL_TRUE;
    stencil_ = {StencilFace::of_driver(false), StencilFace::of_driver(true)};
    gl.Enable(GL_STENCIL_TEST);
    apply_stencil();
}

StencilFace StencilFace::of_driver(bool back) {
    static constexpr GLenum kNames[2][7] = {
        {GL_STENCIL_FUNC, GL_STENCIL_REF, GL_STENCIL_VALUE_MASK, GL_STENCIL_WRITEMASK, GL_STENCIL_FAIL, GL_STENCIL_PASS_DEPTH_FAIL, GL_STENCIL_PASS_DEPTH_PASS},
        {GL_STENCIL_BACK_FUNC, GL_STENCIL_BACK_REF, GL_STENCIL_BACK_VALUE_MASK, GL_STENCIL_BACK_WRITEMASK, GL_STENCIL_BACK_FAIL,
         GL_STENCIL_BACK_PASS_DEPTH_FAIL, GL_STENCIL_BACK_PASS_DEPTH_PASS}};
    GLint v[7] = {};
    for (int i = 0; i < 7; ++i) gl.GetIntegerv(kNames[back ? 1 : 0][i], &v[i]);
    const auto u = [&v](int i) { return static_cast<GLuint>(v[i]); };
    return {u(0), v[1], u(2), u(3), u(4), u(5), u(6)};
}

bool StencilFace::leaves_top_bit() const noexcept {
    constexpr GLuint kTop = kMaskBit;
    const bool compares = func != GL_NEVER && func != GL_ALWAYS && (value_mask & kTop) != 0;
    const auto value = static_cast<GLuint>(std::clamp(ref, 0, 0xff));
    if (compares && (value & kTop)) return false;
    if ((write_mask & 0xff) == 0) return true;
    const bool writes_top = (write_mask & kTop) != 0;
    for (const GLenum op : {fail, depth_fail, pass}) {
        if (op == GL_KEEP || op == GL_ZERO) continue;
        if (op == GL_REPLACE && !(writes_top && (value & kTop))) continue;
        // Counting that wraps around and inverting are the same below the top bit; counting that stops is not.
        if (!writes_top && (op == GL_INVERT || op == GL_INCR_WRAP || op == GL_DECR_WRAP)) continue;
        return false;
    }
    return true;
}

template <class Change>
void Replay::change_stencil(GLenum face, Change change) {
    if (face == GL_FRONT || face == GL_FRONT_AND_BACK) change(stencil_[0]);
    if (face == GL_BACK || face == GL_FRONT_AND_BACK) change(stencil_[1]);
    apply_stencil();
}

void Replay::stencil_func(GLenum face, GLenum func, GLint ref, GLuint mask) {
    if (!view_.masked) return gl.StencilFuncSeparate(face, func, ref, mask);
    if (func < GL_NEVER || func > GL_ALWAYS) return;
    change_stencil(face, [&](StencilFace& f) { f.func = func, f.ref = ref, f.value_mask = mask; });
}

void Replay::stencil_mask(GLenum face, GLuint mask) {
    if (!view_.masked) return gl.StencilMaskSeparate(face, mask);
    change_stencil(face, [&](StencilFace& f) { f.write_mask = mask; });
}

void Replay::stencil_op(GLenum face, GLenum fail, GLenum depth_fail, GLenum pass) {
    if (!view_.masked) return gl.StencilOpSeparate(face, fail, depth_fail, pass);
    for (const GLenum op : {fail, depth_fail, pass})
        if (op != GL_KEEP && op != GL_ZERO && op != GL_REPLACE && op != GL_INCR && op != GL_DECR && op != GL_INVERT && op != GL_INCR_WRAP && op != GL_DECR_WRAP)
            return;
    change_stencil(face, [&](StencilFace& f) { f.fail = fail, f.depth_fail = depth_fail, f.pass = pass; });
}

void Replay::apply_stencil() const {
    constexpr auto kTop = static_cast<GLint>(kMaskBit);
    for (std::size_t i = 0; i < 2; ++i) {
        const StencilFace& f = stencil_[i];
        const GLenum face = i == 0 ? GL_FRONT : GL_BACK;
        gl.StencilMaskSeparate(face, f.write_mask & ~kMaskBit);  // the program's clears and draws leave the mask alone
        if (!stencil_on_) {
            gl.StencilFuncSeparate(face, GL_EQUAL, kTop, kMaskBit);
            gl.StencilOpSeparate(face, GL_KEEP, GL_KEEP, GL_KEEP);
            continue;
        }
        const GLint ref = std::clamp(f.ref, 0, 0xff);
        gl.StencilOpSeparate(face, f.fail, f.depth_fail, f.pass);
        switch (f.func) {
            case GL_ALWAYS: gl.StencilFuncSeparate(face, GL_EQUAL, ref | kTop, kMaskBit); break;
            case GL_EQUAL: case GL_LESS: case GL_LEQUAL: gl.StencilFuncSeparate(face, f.func, ref | kTop, f.value_mask | kMaskBit); break;
            default: gl.StencilFuncSeparate(face, f.func, ref, f.value_mask & ~kMaskBit); break;
        }
    }
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
    if (view_.masked && capability == GL_STENCIL_TEST) {
        stencil_on_ = on;
        return apply_stencil();
    }
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
