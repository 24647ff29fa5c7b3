// Everything that a context tells about what the engine could touch, before and after a call.
#pragma once

#include <string>
#include <vector>

#include "tests/render/extrapolation_gl.hpp"

namespace fovea::test {

template <class Proc>
inline Proc proc(const char* name) {
    const auto p = reinterpret_cast<Proc>(eglGetProcAddress(name));
    EXPECT_NE(p, nullptr) << name;
    return p;
}
#define FOVEA_PROC(type, name) proc<PFNGL##type##PROC>("gl" #name)

inline bool has_extension(const char* name) {
    const auto name_of = FOVEA_PROC(GETSTRINGI, GetStringi);
    GLint count = 0;
    gl().GetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; ++i)
        if (std::strcmp(reinterpret_cast<const char*>(name_of(GL_EXTENSIONS, static_cast<GLuint>(i))), name) == 0) return true;
    return false;
}

struct Entry {
    std::string name;
    std::vector<GLint> value;
    bool operator==(const Entry&) const = default;
};

inline std::vector<Entry> state_now() {
    std::vector<Entry> all;
    const auto integers = [&](const char* name, GLenum what, int count = 1) {
        std::vector<GLint> v(static_cast<std::size_t>(count));
        gl().GetIntegerv(what, v.data());
        all.push_back({name, v});
    };
#define FOVEA_STATE(name) integers(#name, name)
#define FOVEA_STATE4(name) integers(#name, name, 4)
    FOVEA_STATE(GL_ACTIVE_TEXTURE); FOVEA_STATE(GL_CURRENT_PROGRAM); FOVEA_STATE(GL_VERTEX_ARRAY_BINDING);
    FOVEA_STATE(GL_DRAW_FRAMEBUFFER_BINDING); FOVEA_STATE(GL_READ_FRAMEBUFFER_BINDING); FOVEA_STATE(GL_RENDERBUFFER_BINDING);
    FOVEA_STATE(GL_ARRAY_BUFFER_BINDING); FOVEA_STATE(GL_ELEMENT_ARRAY_BUFFER_BINDING); FOVEA_STATE(GL_PIXEL_PACK_BUFFER_BINDING);
    FOVEA_STATE(GL_PIXEL_UNPACK_BUFFER_BINDING); FOVEA_STATE(GL_UNIFORM_BUFFER_BINDING);
    if (gl().version >= 31) {
        FOVEA_STATE(GL_PROGRAM_PIPELINE_BINDING); FOVEA_STATE(GL_SHADER_STORAGE_BUFFER_BINDING); FOVEA_STATE(GL_DISPATCH_INDIRECT_BUFFER_BINDING);
        FOVEA_STATE(GL_DRAW_INDIRECT_BUFFER_BINDING);
    }
    FOVEA_STATE(GL_TRANSFORM_FEEDBACK_BINDING); FOVEA_STATE(GL_TRANSFORM_FEEDBACK_ACTIVE);
    FOVEA_STATE(GL_TRANSFORM_FEEDBACK_PAUSED);
    FOVEA_STATE(GL_PACK_ALIGNMENT); FOVEA_STATE(GL_PACK_ROW_LENGTH); FOVEA_STATE(GL_PACK_SKIP_PIXELS); FOVEA_STATE(GL_PACK_SKIP_ROWS);
    FOVEA_STATE(GL_UNPACK_ALIGNMENT); FOVEA_STATE(GL_UNPACK_ROW_LENGTH); FOVEA_STATE(GL_UNPACK_SKIP_PIXELS); FOVEA_STATE(GL_UNPACK_SKIP_ROWS);
    FOVEA_STATE(GL_UNPACK_IMAGE_HEIGHT); FOVEA_STATE(GL_UNPACK_SKIP_IMAGES);
    FOVEA_STATE4(GL_VIEWPORT); FOVEA_STATE4(GL_SCISSOR_BOX); FOVEA_STATE4(GL_COLOR_WRITEMASK); FOVEA_STATE4(GL_COLOR_CLEAR_VALUE); FOVEA_STATE(GL_DEPTH_WRITEMASK);
    FOVEA_STATE(GL_STENCIL_WRITEMASK); FOVEA_STATE(GL_DEPTH_FUNC); FOVEA_STATE(GL_STENCIL_FUNC); FOVEA_STATE(GL_BLEND_SRC_RGB); FOVEA_STATE(GL_BLEND_DST_RGB);
    FOVEA_STATE(GL_BLEND_EQUATION_RGB); FOVEA_STATE(GL_CULL_FACE_MODE); FOVEA_STATE(GL_FRONT_FACE); FOVEA_STATE(GL_READ_BUFFER); FOVEA_STATE(GL_DRAW_BUFFER0);
    FOVEA_STATE(GL_DRAW_BUFFER1);
#undef FOVEA_STATE
#undef FOVEA_STATE4
    for (const GLenum s : {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_DITHER, GL_POLYGON_OFFSET_FILL, GL_PRIMITIVE_RESTART_FIXED_INDEX, GL_RASTERIZER_DISCARD, GL_SAMPLE_ALPHA_TO_COVERAGE,
                           GL_SAMPLE_COVERAGE, GL_SCISSOR_TEST, GL_STENCIL_TEST})
        all.push_back({"switch " + std::to_string(s), {gl().IsEnabled(s)}});
    if (gl().version >= 31) all.push_back({"sample mask", {gl().IsEnabled(GL_SAMPLE_MASK)}});
    const GLint active = all[0].value[0];
    for (int unit = 0; unit < 8; ++unit) {
        gl().ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
        for (const GLenum what : {GL_TEXTURE_BINDING_2D, GL_TEXTURE_BINDING_3D, GL_TEXTURE_BINDING_2D_ARRAY, GL_TEXTURE_BINDING_CUBE_MAP, GL_SAMPLER_BINDING})
            integers(("unit " + std::to_string(unit) + " binding " + std::to_string(what)).c_str(), what);
    }
    gl().ActiveTexture(static_cast<GLenum>(active));
    const auto indexed = [&](const char* name, GLenum what, GLuint i) {
        GLint v = 0;
        gl().GetIntegeri_v(what, i, &v);
        all.push_back({name + std::to_string(i), {v}});
    };
    for (GLuint i = 0; i < 4; ++i) indexed("uniforms ", GL_UNIFORM_BUFFER_BINDING, i);
    for (GLuint i = 0; i < 4 && gl().version >= 31; ++i) {
        indexed("image name ", GL_IMAGE_BINDING_NAME, i);
        indexed("image level ", GL_IMAGE_BINDING_LEVEL, i);
        indexed("image layered ", GL_IMAGE_BINDING_LAYERED, i);
        indexed("image layer ", GL_IMAGE_BINDING_LAYER, i);
        indexed("image access ", GL_IMAGE_BINDING_ACCESS, i);
        indexed("image format ", GL_IMAGE_BINDING_FORMAT, i);
        indexed("storage ", GL_SHADER_STORAGE_BUFFER_BINDING, i);
    }
    // What extensions add: state per draw buffer and per viewport, clip space, the order of rows.
    if (has_extension("GL_OES_draw_buffers_indexed")) {
        const auto enabled = FOVEA_PROC(ISENABLEDI, IsEnabledi);
        for (GLuint i = 0; i < 4; ++i) {
            GLint mask[4] = {};
            gl().GetIntegeri_v(GL_COLOR_WRITEMASK, i, mask);
            all.push_back({"color mask " + std::to_string(i), {mask[0], mask[1], mask[2], mask[3]}});
            all.push_back({"blend " + std::to_string(i), {enabled(GL_BLEND, i)}});
            indexed("blend source ", GL_BLEND_SRC_RGB, i);
        }
    }
    if (has_extension("GL_OES_viewport_array")) {
        const auto enabled = FOVEA_PROC(ISENABLEDI, IsEnabledi);
        const auto floats = proc<PFNGLGETFLOATI_VOESPROC>("glGetFloati_vOES");
        for (GLuint i = 0; i < 4; ++i) {
            GLfloat box[4] = {};
            floats(GL_VIEWPORT, i, box);
            std::vector<GLint> eighths;
            for (const GLfloat v : box) eighths.push_back(static_cast<GLint>(std::lround(8 * v)));
            all.push_back({"viewport " + std::to_string(i), eighths});
            all.push_back({"scissor test " + std::to_string(i), {enabled(GL_SCISSOR_TEST, i)}});
        }
    }
    if (has_extension("GL_EXT_clip_control")) {
        integers("clip origin", GL_CLIP_ORIGIN_EXT);
        integers("clip depth", GL_CLIP_DEPTH_MODE_EXT);
    }
    if (has_extension("GL_EXT_clip_cull_distance"))
        for (GLenum i = 0; i < 8; ++i) all.push_back({"clip distance " + std::to_string(i), {gl().IsEnabled(GL_CLIP_DISTANCE0_EXT + i)}});
    if (has_extension("GL_EXT_sRGB_write_control")) all.push_back({"sRGB", {gl().IsEnabled(GL_FRAMEBUFFER_SRGB_EXT)}});
    if (has_extension("GL_ANGLE_pack_reverse_row_order")) integers("reverse row order", GL_PACK_REVERSE_ROW_ORDER_ANGLE);
    const auto query = FOVEA_PROC(GETQUERYIV, GetQueryiv);
    for (const GLenum target : {GL_ANY_SAMPLES_PASSED, GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN}) {
        GLint v = 0;
        query(target, GL_CURRENT_QUERY, &v);
        all.push_back({"query " + std::to_string(target), {v}});
    }
    EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
    return all;
}

inline void expect_same(const std::vector<Entry>& before, const std::vector<Entry>& after, const std::string& where) {
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(before[i].value, after[i].value) << where << ": " << before[i].name;
}

}  // namespace fovea::test
