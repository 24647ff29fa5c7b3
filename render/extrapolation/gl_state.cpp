#include "render/extrapolation/gl_state.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <type_traits>

#include <GLES2/gl2ext.h>

namespace fovea::render::extrapolation {

namespace {

struct Storage {
    GLenum name;
    GLint standard;
};
constexpr std::array<Storage, 10> kStorage{{{GL_PACK_ALIGNMENT, 1}, {GL_PACK_ROW_LENGTH, 0}, {GL_PACK_SKIP_PIXELS, 0}, {GL_PACK_SKIP_ROWS, 0},
                                            {GL_UNPACK_ALIGNMENT, 1}, {GL_UNPACK_ROW_LENGTH, 0}, {GL_UNPACK_SKIP_PIXELS, 0}, {GL_UNPACK_SKIP_ROWS, 0},
                                            {GL_UNPACK_IMAGE_HEIGHT, 0}, {GL_UNPACK_SKIP_IMAGES, 0}}};
constexpr std::array<GLenum, 7> kSwitches{GL_CULL_FACE, GL_DEPTH_TEST, GL_DITHER, GL_RASTERIZER_DISCARD, GL_STENCIL_TEST, GL_SAMPLE_ALPHA_TO_COVERAGE, GL_SAMPLE_COVERAGE};

}  // namespace

void load_optional(GlFunctions& gl, GlLoader loader) noexcept {
    bool buffers = false, viewports = false, clip = false;
    GLint count = 0, major = 0, minor = 0;
    gl.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl.GetIntegerv(GL_MINOR_VERSION, &minor);
    gl.GetIntegerv(GL_NUM_EXTENSIONS, &count);
    gl.counts_primitives = major * 10 + minor >= 32;
    const char* indexed = major * 10 + minor >= 32 ? "" : nullptr;   // the suffix of functions of one draw buffer
    for (GLint i = 0; i < count; ++i) {
        const auto* name = reinterpret_cast<const char*>(gl.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
        if (name == nullptr) continue;
        const auto is = [name](const char* other) { return std::strcmp(name, other) == 0; };
        if (indexed == nullptr && is("GL_OES_draw_buffers_indexed")) indexed = "OES";
        if (indexed == nullptr && is("GL_EXT_draw_buffers_indexed")) indexed = "EXT";
        gl.counts_primitives |= is("GL_OES_geometry_shader") || is("GL_EXT_geometry_shader");
        viewports |= is("GL_OES_viewport_array");
        clip |= is("GL_EXT_clip_control");
        gl.reverses_rows |= is("GL_ANGLE_pack_reverse_row_order");
        if (is("GL_EXT_clip_cull_distance") || is("GL_APPLE_clip_distance")) gl.GetIntegerv(GL_MAX_CLIP_DISTANCES_EXT, &gl.clip_distances);
    }
    gl.clip_distances = std::min(gl.clip_distances, 32);
    const auto find = [&](auto& to, const char* name, const char* suffix) {
        char whole[64];
        std::snprintf(whole, sizeof whole, "%s%s", name, suffix);
        to = reinterpret_cast<std::remove_reference_t<decltype(to)>>(loader(whole));
        return to != nullptr;
    };
    buffers = indexed != nullptr && find(gl.Enablei, "glEnablei", indexed) && find(gl.Disablei, "glDisablei", indexed) && find(gl.IsEnabledi, "glIsEnabledi", indexed) &&
              find(gl.ColorMaski, "glColorMaski", indexed) && find(gl.GetBooleani_v, "glGetBooleani_v", "");
    if (!buffers) {
        gl.ColorMaski = nullptr;
        gl.Enablei = nullptr;
    }
    if (!(viewports && find(gl.ViewportIndexedfv, "glViewportIndexedfv", "OES") && find(gl.GetFloati_v, "glGetFloati_v", "OES") &&
          (gl.Enablei != nullptr || (find(gl.Enablei, "glEnablei", "OES") && find(gl.Disablei, "glDisablei", "OES") && find(gl.IsEnabledi, "glIsEnabledi", "OES")))))
        gl.ViewportIndexedfv = nullptr;
    if (clip) find(gl.ClipControl, "glClipControl", "EXT");
}

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
    if (gl.reverses_rows) {
        gl.GetIntegerv(GL_PACK_REVERSE_ROW_ORDER_ANGLE, &reversed_);
        gl.PixelStorei(GL_PACK_REVERSE_ROW_ORDER_ANGLE, GL_FALSE);
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
    if (gl.version >= 31) {
        gl.GetIntegeri_v(GL_IMAGE_BINDING_NAME, 0, &image_.name);
        gl.GetIntegeri_v(GL_IMAGE_BINDING_LEVEL, 0, &image_.level);
        gl.GetIntegeri_v(GL_IMAGE_BINDING_LAYERED, 0, &image_.layered);
        gl.GetIntegeri_v(GL_IMAGE_BINDING_LAYER, 0, &image_.layer);
        gl.GetIntegeri_v(GL_IMAGE_BINDING_ACCESS, 0, &image_.access);
        gl.GetIntegeri_v(GL_IMAGE_BINDING_FORMAT, 0, &image_.format);
        gl.GetIntegerv(GL_DRAW_INDIRECT_BUFFER_BINDING, &draw_buffer_);
        gl.GetIntegerv(GL_DISPATCH_INDIRECT_BUFFER_BINDING, &dispatch_buffer_);
    }
    GLint feedback = 0, feedback_paused = 0;
    gl.GetIntegerv(GL_TRANSFORM_FEEDBACK_ACTIVE, &feedback);
    gl.GetIntegerv(GL_TRANSFORM_FEEDBACK_PAUSED, &feedback_paused);
    paused_ = feedback != 0 && feedback_paused == 0;
    if (paused_) gl.PauseTransformFeedback();
    gl.GetIntegerv(GL_CURRENT_PROGRAM, &program_);
    gl.GetIntegerv(GL_VERTEX_ARRAY_BINDING, &array_);
    // Of state per viewport and per draw buffer, only what a pass meets is touched: setting all would lose the others'.
    if (gl.ViewportIndexedfv != nullptr) {
        gl.GetFloati_v(GL_VIEWPORT, 0, first_viewport_.data());
        first_scissor_ = gl.IsEnabledi(GL_SCISSOR_TEST, 0);
        gl.Disablei(GL_SCISSOR_TEST, 0);
    } else {
        gl.GetIntegerv(GL_VIEWPORT, viewport_.data());
        first_scissor_ = gl.IsEnabled(GL_SCISSOR_TEST);
        gl.Disable(GL_SCISSOR_TEST);
    }
    if (gl.ColorMaski != nullptr) {
        for (GLuint i = 0; i < kBuffers; ++i) {
            if (gl.version >= 31) {
                gl.GetBooleani_v(GL_COLOR_WRITEMASK, i, masks_[i].data());
            } else {   // that call is of 3.1
                GLint mask[4] = {GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE};
                gl.GetIntegeri_v(GL_COLOR_WRITEMASK, i, mask);
                for (std::size_t k = 0; k < 4; ++k) masks_[i][k] = mask[k] != 0 ? GL_TRUE : GL_FALSE;
            }
            blends_[i] = gl.IsEnabledi(GL_BLEND, i);
            gl.ColorMaski(i, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
            gl.Disablei(GL_BLEND, i);
        }
    } else {
        gl.GetBooleanv(GL_COLOR_WRITEMASK, masks_[0].data());
        blends_[0] = gl.IsEnabled(GL_BLEND);
        gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        gl.Disable(GL_BLEND);
    }
    for (std::size_t i = 0; i < kSwitches.size(); ++i) {
        enabled_[i] = gl.IsEnabled(kSwitches[i]);
        gl.Disable(kSwitches[i]);
    }
    if (gl.ClipControl != nullptr) {
        gl.GetIntegerv(GL_CLIP_ORIGIN_EXT, &clip_origin_);
        gl.GetIntegerv(GL_CLIP_DEPTH_MODE_EXT, &clip_depth_);
        gl.ClipControl(GL_LOWER_LEFT_EXT, GL_NEGATIVE_ONE_TO_ONE_EXT);
    }
    for (int i = 0; i < gl.clip_distances; ++i) {
        const GLenum distance = GL_CLIP_DISTANCE0_EXT + static_cast<GLenum>(i);
        if (gl.IsEnabled(distance) == GL_FALSE) continue;
        clip_distances_ |= 1u << i;
        gl.Disable(distance);
    }
}

GlStateGuard::~GlStateGuard() {
    const GlFunctions& gl = gl_;
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(read_framebuffer_));
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(draw_framebuffer_));
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(pack_buffer_));
    gl.BindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(unpack_buffer_));
    for (std::size_t i = 0; i < kStorage.size(); ++i) gl.PixelStorei(kStorage[i].name, storage_[i]);
    if (gl.reverses_rows) gl.PixelStorei(GL_PACK_REVERSE_ROW_ORDER_ANGLE, reversed_);
    const int units = passes_ ? kUnits : 1;
    for (int i = 0; i < units; ++i) {
        const auto k = static_cast<std::size_t>(i);
        gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
        gl.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(textures_[k]));
        if (passes_) gl.BindSampler(static_cast<GLuint>(i), static_cast<GLuint>(samplers_[k]));
    }
    gl.ActiveTexture(static_cast<GLenum>(active_));
    if (!passes_) return;
    if (gl.version >= 31) {
        gl.BindImageTexture(0, static_cast<GLuint>(image_.name), image_.level, image_.layered != 0, image_.layer, static_cast<GLenum>(image_.access), static_cast<GLenum>(image_.format));
        gl.BindBuffer(GL_DRAW_INDIRECT_BUFFER, static_cast<GLuint>(draw_buffer_));
        gl.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, static_cast<GLuint>(dispatch_buffer_));
    }
    gl.UseProgram(static_cast<GLuint>(program_));
    gl.BindVertexArray(static_cast<GLuint>(array_));
    if (gl.ViewportIndexedfv != nullptr) {
        gl.ViewportIndexedfv(0, first_viewport_.data());
        (first_scissor_ != GL_FALSE ? gl.Enablei : gl.Disablei)(GL_SCISSOR_TEST, 0);
    } else {
        gl.Viewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
        (first_scissor_ != GL_FALSE ? gl.Enable : gl.Disable)(GL_SCISSOR_TEST);
    }
    if (gl.ColorMaski != nullptr) {
        for (GLuint i = 0; i < kBuffers; ++i) {
            gl.ColorMaski(i, masks_[i][0], masks_[i][1], masks_[i][2], masks_[i][3]);
            (blends_[i] != GL_FALSE ? gl.Enablei : gl.Disablei)(GL_BLEND, i);
        }
    } else {
        gl.ColorMask(masks_[0][0], masks_[0][1], masks_[0][2], masks_[0][3]);
        (blends_[0] != GL_FALSE ? gl.Enable : gl.Disable)(GL_BLEND);
    }
    if (gl.ClipControl != nullptr) gl.ClipControl(static_cast<GLenum>(clip_origin_), static_cast<GLenum>(clip_depth_));
    for (int i = 0; i < gl.clip_distances; ++i)
        if ((clip_distances_ >> i & 1u) != 0) gl.Enable(GL_CLIP_DISTANCE0_EXT + static_cast<GLenum>(i));
    for (std::size_t i = 0; i < kSwitches.size(); ++i) (enabled_[i] != GL_FALSE ? gl.Enable : gl.Disable)(kSwitches[i]);
    if (paused_) gl.ResumeTransformFeedback();
}

}  // namespace fovea::render::extrapolation
