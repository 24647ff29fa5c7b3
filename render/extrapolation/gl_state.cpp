#include "render/extrapolation/gl_state.hpp"

namespace fovea::render::extrapolation {

namespace {

struct Storage {
    GLenum name;
    GLint standard;
};
constexpr std::array<Storage, 10> kStorage{{{GL_PACK_ALIGNMENT, 1}, {GL_PACK_ROW_LENGTH, 0}, {GL_PACK_SKIP_PIXELS, 0}, {GL_PACK_SKIP_ROWS, 0},
                                            {GL_UNPACK_ALIGNMENT, 1}, {GL_UNPACK_ROW_LENGTH, 0}, {GL_UNPACK_SKIP_PIXELS, 0}, {GL_UNPACK_SKIP_ROWS, 0},
                                            {GL_UNPACK_IMAGE_HEIGHT, 0}, {GL_UNPACK_SKIP_IMAGES, 0}}};
constexpr std::array<GLenum, 9> kSwitches{GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_DITHER, GL_RASTERIZER_DISCARD, GL_SCISSOR_TEST, GL_STENCIL_TEST,
                                          GL_SAMPLE_ALPHA_TO_COVERAGE, GL_SAMPLE_COVERAGE};

}  // namespace

GlStateGuard::GlStateGuard(const GlFunctions& gl, bool passes) noexcept : gl_(gl), passes_(passes) {
    gl.GetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &read_framebuffer_);
    gl.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &draw_framebuffer_);
    gl.GetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &pack_buffer_);
    gl.GetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &unpack_buffer_);
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    gl.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    for (std::size_t i = 0; i < kStorage.size(); ++i) {
        gl.GetIntegerv(kStorage[i].name, &storage_[i]);
        gl.PixelStorei(kStorage[i].name, kStorage[i].standard);
    }
    gl.GetIntegerv(GL_ACTIVE_TEXTURE, &active_);
    const int units = passes ? kUnits : 1;
    for (int i = 0; i < units; ++i) {
        const auto k = static_cast<std::size_t>(i);
        gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
        gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &textures_[k]);
        if (passes) gl.GetIntegerv(GL_SAMPLER_BINDING, &samplers_[k]);
    }
    gl.ActiveTexture(GL_TEXTURE0);
    if (!passes) return;
    gl.GetIntegeri_v(GL_IMAGE_BINDING_NAME, 0, &image_.name);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_LEVEL, 0, &image_.level);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_LAYERED, 0, &image_.layered);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_LAYER, 0, &image_.layer);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_ACCESS, 0, &image_.access);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_FORMAT, 0, &image_.format);
    GLint feedback = 0, feedback_paused = 0;
    gl.GetIntegerv(GL_TRANSFORM_FEEDBACK_ACTIVE, &feedback);
    gl.GetIntegerv(GL_TRANSFORM_FEEDBACK_PAUSED, &feedback_paused);
    paused_ = feedback != 0 && feedback_paused == 0;
    if (paused_) gl.PauseTransformFeedback();
    gl.GetIntegerv(GL_DRAW_INDIRECT_BUFFER_BINDING, &draw_buffer_);
    gl.GetIntegerv(GL_DISPATCH_INDIRECT_BUFFER_BINDING, &dispatch_buffer_);
    gl.GetIntegerv(GL_CURRENT_PROGRAM, &program_);
    gl.GetIntegerv(GL_VERTEX_ARRAY_BINDING, &array_);
    gl.GetIntegerv(GL_VIEWPORT, viewport_.data());
    gl.GetBooleanv(GL_COLOR_WRITEMASK, mask_.data());
    for (std::size_t i = 0; i < kSwitches.size(); ++i) {
        enabled_[i] = gl.IsEnabled(kSwitches[i]);
        gl.Disable(kSwitches[i]);
    }
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

GlStateGuard::~GlStateGuard() {
    const GlFunctions& gl = gl_;
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(read_framebuffer_));
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(draw_framebuffer_));
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(pack_buffer_));
    gl.BindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(unpack_buffer_));
    for (std::size_t i = 0; i < kStorage.size(); ++i) gl.PixelStorei(kStorage[i].name, storage_[i]);
    const int units = passes_ ? kUnits : 1;
    for (int i = 0; i < units; ++i) {
        const auto k = static_cast<std::size_t>(i);
        gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
        gl.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(textures_[k]));
        if (passes_) gl.BindSampler(static_cast<GLuint>(i), static_cast<GLuint>(samplers_[k]));
    }
    gl.ActiveTexture(static_cast<GLenum>(active_));
    if (!passes_) return;
    gl.BindImageTexture(0, static_cast<GLuint>(image_.name), image_.level, image_.layered != 0, image_.layer, static_cast<GLenum>(image_.access), static_cast<GLenum>(image_.format));
    gl.BindBuffer(GL_DRAW_INDIRECT_BUFFER, static_cast<GLuint>(draw_buffer_));
    gl.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, static_cast<GLuint>(dispatch_buffer_));
    gl.UseProgram(static_cast<GLuint>(program_));
    gl.BindVertexArray(static_cast<GLuint>(array_));
    gl.Viewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
    gl.ColorMask(mask_[0], mask_[1], mask_[2], mask_[3]);
    for (std::size_t i = 0; i < kSwitches.size(); ++i) (enabled_[i] != GL_FALSE ? gl.Enable : gl.Disable)(kSwitches[i]);
    if (paused_) gl.ResumeTransformFeedback();
}

}  // namespace fovea::render::extrapolation
