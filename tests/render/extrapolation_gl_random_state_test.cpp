// Any mixture of the state that programs set, and what a call under it must neither see nor change.
#include <functional>
#include <random>

#include "tests/render/extrapolation_gl_state.hpp"

namespace fovea::test {

// One thing that a program may have set, and its undoing.
struct Disturbance {
    const char* name;
    std::function<void()> set, undo;
};

class ExtrapolationGlRandomState : public ExtrapolationGl {
protected:
    void SetUp() override {
        ExtrapolationGl::SetUp();
        if (IsSkipped()) return;
        FOVEA_PROC(GENBUFFERS, GenBuffers)(1, &buffer_);
        gl().BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer_);
        FOVEA_PROC(BUFFERDATA, BufferData)(GL_SHADER_STORAGE_BUFFER, 1 << 16, nullptr, GL_STATIC_DRAW);
        gl().BindBuffer(GL_SHADER_STORAGE_BUFFER, 0);
        gl().GenSamplers(1, &sampler_);
        gl().SamplerParameteri(sampler_, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        gl().SamplerParameteri(sampler_, GL_TEXTURE_WRAP_S, GL_REPEAT);
        gl().GenVertexArrays(1, &array_);
        gl().GenFramebuffers(1, &framebuffer_);
    }
    void TearDown() override {
        if (buffer_ != 0) {
            FOVEA_PROC(DELETEBUFFERS, DeleteBuffers)(1, &buffer_);
            gl().DeleteSamplers(1, &sampler_);
            gl().DeleteVertexArrays(1, &array_);
            gl().DeleteFramebuffers(1, &framebuffer_);
        }
        ExtrapolationGl::TearDown();
    }
    static Disturbance enable(const char* name, GLenum what) {
        return {name, [what] { gl().Enable(what); }, [what] { gl().Disable(what); }};
    }
    static Disturbance store(const char* name, GLenum what, GLint value, GLint standard = 0) {
        return {name, [=] { gl().PixelStorei(what, value); }, [=] { gl().PixelStorei(what, standard); }};
    }
    Disturbance bind(const char* name, GLenum target) {
        return {name, [=, this] { gl().BindBuffer(target, buffer_); }, [=] { gl().BindBuffer(target, 0); }};
    }
    // `sources`: textures of the call, to be bound wherever textures are.
    std::vector<Disturbance> disturbances(const std::array<GLuint, 3>& sources) {
        std::vector<Disturbance> all{
            enable("blend", GL_BLEND), enable("cull", GL_CULL_FACE), enable("depth test", GL_DEPTH_TEST), enable("stencil test", GL_STENCIL_TEST), enable("scissor", GL_SCISSOR_TEST),
            enable("polygon offset", GL_POLYGON_OFFSET_FILL), enable("rasterizer discard", GL_RASTERIZER_DISCARD), enable("alpha to coverage", GL_SAMPLE_ALPHA_TO_COVERAGE),
            enable("sample coverage", GL_SAMPLE_COVERAGE), enable("sample mask", GL_SAMPLE_MASK), enable("primitive restart", GL_PRIMITIVE_RESTART_FIXED_INDEX),
            {"no dither", [] { gl().Disable(GL_DITHER); }, [] { gl().Enable(GL_DITHER); }},
            {"blend function", [] { FOVEA_PROC(BLENDFUNC, BlendFunc)(GL_ZERO, GL_SRC_COLOR); }, [] { FOVEA_PROC(BLENDFUNC, BlendFunc)(GL_ONE, GL_ZERO); }},
            {"depth", [] { FOVEA_PROC(DEPTHFUNC, DepthFunc)(GL_NEVER); FOVEA_PROC(DEPTHRANGEF, DepthRangef)(0.7f, 0.2f); }, [] { FOVEA_PROC(DEPTHFUNC, DepthFunc)(GL_LESS); FOVEA_PROC(DEPTHRANGEF, DepthRangef)(0, 1); }},
            {"stencil function", [] { FOVEA_PROC(STENCILFUNC, StencilFunc)(GL_NEVER, 1, 1); }, [] { FOVEA_PROC(STENCILFUNC, StencilFunc)(GL_ALWAYS, 0, ~0u); }},
            {"cull face", [] { FOVEA_PROC(CULLFACE, CullFace)(GL_FRONT_AND_BACK); }, [] { FOVEA_PROC(CULLFACE, CullFace)(GL_BACK); }},
            {"front face", [] { FOVEA_PROC(FRONTFACE, FrontFace)(GL_CW); }, [] { FOVEA_PROC(FRONTFACE, FrontFace)(GL_CCW); }},
            {"coverage", [] { FOVEA_PROC(SAMPLECOVERAGE, SampleCoverage)(0.0f, GL_FALSE); FOVEA_PROC(SAMPLEMASKI, SampleMaski)(0, 0); }, [] { FOVEA_PROC(SAMPLECOVERAGE, SampleCoverage)(1, GL_FALSE); FOVEA_PROC(SAMPLEMASKI, SampleMaski)(0, ~0u); }},
            {"viewport", [] { gl().Viewport(3, 4, 5, 6); }, [] { gl().Viewport(0, 0, 64, 64); }},
            {"scissor box", [] { FOVEA_PROC(SCISSOR, Scissor)(1, 2, 3, 4); }, [] { FOVEA_PROC(SCISSOR, Scissor)(0, 0, 64, 64); }},
            {"color mask", [] { gl().ColorMask(GL_FALSE, GL_TRUE, GL_FALSE, GL_FALSE); }, [] { gl().ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE); }},
            {"clear color", [] { FOVEA_PROC(CLEARCOLOR, ClearColor)(0.3f, 7, -1, 0); }, [] { FOVEA_PROC(CLEARCOLOR, ClearColor)(0, 0, 0, 0); }},
            store("pack alignment", GL_PACK_ALIGNMENT, 8, 4), store("pack row", GL_PACK_ROW_LENGTH, 201), store("pack pixels", GL_PACK_SKIP_PIXELS, 2), store("pack rows", GL_PACK_SKIP_ROWS, 3),
            store("unpack alignment", GL_UNPACK_ALIGNMENT, 8, 4), store("unpack row", GL_UNPACK_ROW_LENGTH, 177), store("unpack pixels", GL_UNPACK_SKIP_PIXELS, 5), store("unpack rows", GL_UNPACK_SKIP_ROWS, 1),
            store("unpack height", GL_UNPACK_IMAGE_HEIGHT, 99), store("unpack images", GL_UNPACK_SKIP_IMAGES, 4),
            bind("pack buffer", GL_PIXEL_PACK_BUFFER), bind("unpack buffer", GL_PIXEL_UNPACK_BUFFER), bind("indirect draws", GL_DRAW_INDIRECT_BUFFER), bind("indirect dispatches", GL_DISPATCH_INDIRECT_BUFFER),
            bind("vertices", GL_ARRAY_BUFFER), bind("storage", GL_SHADER_STORAGE_BUFFER), bind("uniforms", GL_UNIFORM_BUFFER),
            {"vertex array", [this] { gl().BindVertexArray(array_); }, [] { gl().BindVertexArray(0); }},
            {"output attached and bound", [this, sources] { attach(sources[2]); }, [this] { attach(0); }},
            {"source attached and bound", [this, sources] { attach(sources[1]); }, [this] { attach(0); }},
        };
        for (GLuint unit : {0u, 1u, 2u, 5u}) {
            all.push_back({"texture on a unit", [=] { gl().ActiveTexture(GL_TEXTURE0 + unit); gl().BindTexture(GL_TEXTURE_2D, sources[unit % 3]); }, [=] { gl().ActiveTexture(GL_TEXTURE0 + unit); gl().BindTexture(GL_TEXTURE_2D, 0); gl().ActiveTexture(GL_TEXTURE0); }});
            all.push_back({"sampler on a unit", [=, this] { gl().BindSampler(unit, sampler_); }, [=] { gl().BindSampler(unit, 0); }});
        }
        for (GLuint unit : {0u, 1u})
            all.push_back({"image on a unit", [=] { gl().BindImageTexture(unit, sources[1 + unit], 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA8); }, [=] { gl().BindImageTexture(unit, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R32UI); }});
        if (has_extension("GL_OES_draw_buffers_indexed"))
            for (GLuint i : {0u, 1u, 2u}) {
                all.push_back({"color mask of one buffer", [=] { FOVEA_PROC(COLORMASKI, ColorMaski)(i, GL_FALSE, GL_TRUE, GL_FALSE, GL_TRUE); }, [] { gl().ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE); }});
                all.push_back({"blend of one buffer", [=] { FOVEA_PROC(ENABLEI, Enablei)(GL_BLEND, i); FOVEA_PROC(BLENDFUNCI, BlendFunci)(i, GL_ZERO, GL_ONE); }, [=] { FOVEA_PROC(DISABLEI, Disablei)(GL_BLEND, i); FOVEA_PROC(BLENDFUNCI, BlendFunci)(i, GL_ONE, GL_ZERO); }});
            }
        if (has_extension("GL_OES_viewport_array"))
            for (GLuint i : {0u, 1u, 3u}) {
                all.push_back({"one viewport", [=] { proc<PFNGLVIEWPORTINDEXEDFOESPROC>("glViewportIndexedfOES")(i, 1.5f, 2.25f, 7.5f, 3); }, [] { gl().Viewport(0, 0, 64, 64); }});
                all.push_back({"one scissor test", [=] { FOVEA_PROC(ENABLEI, Enablei)(GL_SCISSOR_TEST, i); }, [] { gl().Disable(GL_SCISSOR_TEST); }});
            }
        if (has_extension("GL_EXT_clip_control"))
            all.push_back({"clip control", [] { proc<PFNGLCLIPCONTROLEXTPROC>("glClipControlEXT")(GL_UPPER_LEFT_EXT, GL_ZERO_TO_ONE_EXT); }, [] { proc<PFNGLCLIPCONTROLEXTPROC>("glClipControlEXT")(GL_LOWER_LEFT_EXT, GL_NEGATIVE_ONE_TO_ONE_EXT); }});
        if (has_extension("GL_EXT_clip_cull_distance"))
            for (GLenum i : {0u, 3u}) all.push_back(enable("clip distance", GL_CLIP_DISTANCE0_EXT + i));
        if (has_extension("GL_EXT_sRGB_write_control")) all.push_back({"no sRGB", [] { gl().Disable(GL_FRAMEBUFFER_SRGB_EXT); }, [] { gl().Enable(GL_FRAMEBUFFER_SRGB_EXT); }});
        if (has_extension("GL_ANGLE_pack_reverse_row_order")) all.push_back(store("reverse rows", GL_PACK_REVERSE_ROW_ORDER_ANGLE, GL_TRUE, GL_FALSE));
        return all;
    }

private:
    void attach(GLuint t) {
        gl().BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
        gl().FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t, 0);
        if (t == 0) gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
    }
    GLuint buffer_ = 0, sampler_ = 0, array_ = 0, framebuffer_ = 0;
};

// Each alone, then mixtures. The sources are bound for images as well: of a format that can be.
TEST_F(ExtrapolationGlRandomState, NoneOfItChangesAndNoneOfItReachesTheResult) {
    for (const Format format : {Format::rgba8, Format::rgba32f, Format::rgb16f}) {
        const Picture a = moved_noise(48, 40, format, 0, 0), b = moved_noise(48, 40, format, 2, 1);
        const Picture spoiled = moved_noise(48, 40, format, 0, 0, 300);
        const std::array<GLuint, 3> names{texture(a), texture(b), texture(spoiled)};
        const GLuint clean = texture(a);
        const FormatRow& row = row_of(format);
        const std::vector<Disturbance> all = disturbances(names);
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(names[0], names[1], clean, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            const Picture wanted = read(clean, a);
            std::minstd_rand random(11);
            const std::size_t alone = format == Format::rgba8 ? all.size() : 0, mixtures = 6;
            for (std::size_t round = 0; round < alone + mixtures; ++round) {
                gl().BindTexture(GL_TEXTURE_2D, names[2]);
                gl().PixelStorei(GL_UNPACK_ALIGNMENT, 1);
                gl().TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 48, 40, row.layout, row.type, spoiled.bytes.data());
                gl().BindTexture(GL_TEXTURE_2D, 0);
                gl().PixelStorei(GL_UNPACK_ALIGNMENT, 4);
                gl().GetError();
                std::string where = std::string(backend_name(k)) + " " + format_name(format) + ":";
                std::vector<const Disturbance*> now;
                for (std::size_t i = 0; i < all.size(); ++i)
                    if (round < alone ? i == round : random() % 3 == 0) {
                        now.push_back(&all[i]);
                        where += std::string(" ") + all[i].name + ",";
                    }
                for (const Disturbance* d : now) d->set();
                gl().GetError();   // an image of a format that images cannot have
                const auto before = state_now();
                EXPECT_EQ(e.extrapolate(names[0], names[1], names[2], 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << where;
                expect_same(before, state_now(), where);
                for (const Disturbance* d : now) d->undo();
                gl().GetError();
                EXPECT_EQ(read(names[2], a), wanted) << where;
                if (HasFailure()) break;
            }
        }
    }
}

// What the engine draws is nobody's sample.
TEST_F(ExtrapolationGlRandomState, AQueryCountsNothingOfIt) {
    const auto begin = FOVEA_PROC(BEGINQUERY, BeginQuery);
    const auto end = FOVEA_PROC(ENDQUERY, EndQuery);
    const auto result = FOVEA_PROC(GETQUERYOBJECTUIV, GetQueryObjectuiv);
    GLuint query = 0;
    FOVEA_PROC(GENQUERIES, GenQueries)(1, &query);
    std::vector<GLenum> targets{GL_ANY_SAMPLES_PASSED, GL_ANY_SAMPLES_PASSED_CONSERVATIVE};
    if (has_extension("GL_OES_geometry_shader")) targets.push_back(GL_PRIMITIVES_GENERATED);
    for (const Format format : {Format::rgba8, Format::r8, Format::rgba16f, Format::rgba32f}) {   // what can be attached and read
        const Picture a = moved_noise(48, 40, format, 0, 0), b = moved_noise(48, 40, format, 2, 1);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), plain = texture(a);
        for (auto& [k, e] : sides_)
            for (const GLenum target : targets) {
                ASSERT_EQ(e.extrapolate(src1, src2, plain, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
                begin(target, query);
                EXPECT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
                end(target);
                GLuint any = 7;
                result(query, GL_QUERY_RESULT, &any);
                EXPECT_EQ(any, 0u) << backend_name(k) << " " << format_name(format);
                EXPECT_NE(read(out, a), read(src2, a)) << backend_name(k) << " " << format_name(format);
                FOVEA_PROC(DELETEQUERIES, DeleteQueries)(1, &query);   // a query has one target for ever
                FOVEA_PROC(GENQUERIES, GenQueries)(1, &query);
            }
    }
    FOVEA_PROC(DELETEQUERIES, DeleteQueries)(1, &query);
    EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
}

// The shaders are tried and timed by drawing: where a query would count that, a later call does.
TEST_F(ExtrapolationGlRandomState, TheProbeWaitsForTheEndOfAQuery) {
    const Picture a = moved_noise(48, 40, Format::rgba8, 0, 0), b = moved_noise(48, 40, Format::rgba8, 2, 1);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    GLuint query = 0, any = 7;
    FOVEA_PROC(GENQUERIES, GenQueries)(1, &query);
    for (const Side& side : sides_) {
        if (side.backend == Backend::processor) continue;
        FOVEA_PROC(BEGINQUERY, BeginQuery)(GL_ANY_SAMPLES_PASSED, query);
        auto e = GlExtrapolator::create(load_gl, {.preset = Preset::draft, .backend = side.backend});
        ASSERT_TRUE(e.has_value());
        EXPECT_EQ(e->extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_EQ(e->backend(), Backend::processor);
        FOVEA_PROC(ENDQUERY, EndQuery)(GL_ANY_SAMPLES_PASSED);
        FOVEA_PROC(GETQUERYOBJECTUIV, GetQueryObjectuiv)(query, GL_QUERY_RESULT, &any);
        EXPECT_EQ(any, 0u) << backend_name(side.backend);
        EXPECT_EQ(e->extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_EQ(e->backend(), side.backend);
        EXPECT_EQ(e->reason(), "asked for");
        EXPECT_NE(read(out, a), b);
    }
    FOVEA_PROC(DELETEQUERIES, DeleteQueries)(1, &query);
}

// A program that was deleted while in use lives until another is used: that is the program's own doing, not ours.
TEST_F(ExtrapolationGlRandomState, ADeletedProgramInUseStaysInUse) {
    const char* const vertex = "#version 310 es\nvoid main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }";
    const char* const fragment = "#version 310 es\nprecision mediump float;\nout vec4 c;\nvoid main() { c = vec4(1.0); }";
    const Picture a = moved_noise(48, 40, Format::rgba8, 0, 0), b = moved_noise(48, 40, Format::rgba8, 2, 1);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        const GLuint program = program_of(vertex, fragment);
        gl().LinkProgram(program);
        gl().UseProgram(program);
        gl().DeleteProgram(program);
        EXPECT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << backend_name(k);
        GLint used = 0, linked = 0;
        gl().GetIntegerv(GL_CURRENT_PROGRAM, &used);
        EXPECT_EQ(static_cast<GLuint>(used), program) << backend_name(k);
        gl().GetProgramiv(program, GL_LINK_STATUS, &linked);
        EXPECT_EQ(linked, GL_TRUE) << backend_name(k);
        gl().UseProgram(0);
        gl().GetError();
    }
}

}  // namespace fovea::test
