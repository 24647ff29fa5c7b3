// What the call must leave as it was: every piece of state that a pass or a read touches, the sources, and the output when
// there is an error.
#include <functional>
#include <limits>

#include "tests/render/extrapolation_gl_state.hpp"

namespace fovea::test {

class ExtrapolationGlState : public ExtrapolationGl {
protected:
    // Sets everything to something unusual; each piece of it would reach a pass, an upload or a read that did not look after itself.
    void disturb(const Picture& p) {
        gl().GenFramebuffers(2, framebuffers_);
        gl().GenSamplers(6, samplers_);
        gl().GenVertexArrays(1, &array_);
        FOVEA_PROC(GENBUFFERS, GenBuffers)(3, buffers_);
        for (const GLuint b : buffers_) {
            gl().BindBuffer(GL_SHADER_STORAGE_BUFFER, b);
            FOVEA_PROC(BUFFERDATA, BufferData)(GL_SHADER_STORAGE_BUFFER, 16, nullptr, GL_STATIC_DRAW);
        }
        gl().BindVertexArray(array_);
        gl().BindBuffer(GL_ARRAY_BUFFER, buffers_[2]);
        gl().BindBuffer(GL_PIXEL_PACK_BUFFER, buffers_[0]);
        gl().BindBuffer(GL_DRAW_INDIRECT_BUFFER, buffers_[0]);
        gl().BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffers_[1]);
        gl().BindBuffer(GL_PIXEL_UNPACK_BUFFER, buffers_[1]);
        FOVEA_PROC(BINDBUFFERBASE, BindBufferBase)(GL_SHADER_STORAGE_BUFFER, 0, buffers_[2]);
        const GLuint target = texture_of_this(p), other = texture_of_this(p);
        for (GLuint unit = 0; unit < 6; ++unit) {
            gl().ActiveTexture(GL_TEXTURE0 + unit);
            gl().BindTexture(GL_TEXTURE_2D, unit % 2 == 0 ? target : other);
            gl().SamplerParameteri(samplers_[unit], GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
            gl().SamplerParameteri(samplers_[unit], GL_TEXTURE_WRAP_S, GL_REPEAT);
            gl().BindSampler(unit, samplers_[unit]);
        }
        gl().ActiveTexture(GL_TEXTURE6);
        const GLuint image = texture_of_this(p, GL_RGBA8);
        gl().BindImageTexture(0, image, 0, GL_TRUE, 0, GL_READ_ONLY, GL_RGBA8UI);
        gl().BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers_[0]);
        gl().FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, image, 0);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers_[1]);
        gl().FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, image, 0);
        for (const auto& [name, value] : std::initializer_list<std::pair<GLenum, GLint>>{{GL_PACK_ALIGNMENT, 8}, {GL_PACK_ROW_LENGTH, 61}, {GL_PACK_SKIP_PIXELS, 2}, {GL_PACK_SKIP_ROWS, 3}, {GL_UNPACK_ALIGNMENT, 2},
                                                                                         {GL_UNPACK_ROW_LENGTH, 77}, {GL_UNPACK_SKIP_PIXELS, 5}, {GL_UNPACK_SKIP_ROWS, 1}, {GL_UNPACK_IMAGE_HEIGHT, 99}, {GL_UNPACK_SKIP_IMAGES, 4}})
            gl().PixelStorei(name, value);
        gl().Viewport(3, 4, 5, 6);
        FOVEA_PROC(SCISSOR, Scissor)(1, 2, 3, 4);
        FOVEA_PROC(BLENDFUNC, BlendFunc)(GL_ZERO, GL_SRC_COLOR);
        FOVEA_PROC(DEPTHFUNC, DepthFunc)(GL_NEVER);
        FOVEA_PROC(STENCILFUNC, StencilFunc)(GL_NEVER, 1, 1);
        FOVEA_PROC(CULLFACE, CullFace)(GL_FRONT_AND_BACK);
        FOVEA_PROC(SAMPLECOVERAGE, SampleCoverage)(0.0f, GL_FALSE);
        FOVEA_PROC(SAMPLEMASKI, SampleMaski)(0, 0);
        for (const GLenum s : kOn) gl().Enable(s);
        gl().Disable(GL_DITHER);
        gl().ColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
    }
    void calm() {
        for (const GLenum s : kOn) gl().Disable(s);
        gl().Enable(GL_DITHER);
        gl().ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        FOVEA_PROC(BLENDFUNC, BlendFunc)(GL_ONE, GL_ZERO);
        FOVEA_PROC(DEPTHFUNC, DepthFunc)(GL_LESS);
        FOVEA_PROC(STENCILFUNC, StencilFunc)(GL_ALWAYS, 0, ~0u);
        FOVEA_PROC(CULLFACE, CullFace)(GL_BACK);
        FOVEA_PROC(SAMPLECOVERAGE, SampleCoverage)(1.0f, GL_FALSE);
        FOVEA_PROC(SAMPLEMASKI, SampleMaski)(0, ~0u);
        for (const GLenum name : {GL_PACK_ROW_LENGTH, GL_PACK_SKIP_PIXELS, GL_PACK_SKIP_ROWS, GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_ROWS, GL_UNPACK_IMAGE_HEIGHT, GL_UNPACK_SKIP_IMAGES})
            gl().PixelStorei(name, 0);
        gl().PixelStorei(GL_PACK_ALIGNMENT, 4);
        gl().PixelStorei(GL_UNPACK_ALIGNMENT, 4);
        for (const GLenum target : {GL_PIXEL_PACK_BUFFER, GL_PIXEL_UNPACK_BUFFER, GL_ARRAY_BUFFER, GL_SHADER_STORAGE_BUFFER, GL_DRAW_INDIRECT_BUFFER, GL_DISPATCH_INDIRECT_BUFFER}) gl().BindBuffer(target, 0);
        gl().BindVertexArray(0);
        gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
        gl().BindImageTexture(0, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R32UI);
        for (GLuint unit = 0; unit < 6; ++unit) gl().BindSampler(unit, 0);
        gl().ActiveTexture(GL_TEXTURE0);
        gl().BindTexture(GL_TEXTURE_2D, 0);
        gl().DeleteFramebuffers(2, framebuffers_);
        gl().DeleteSamplers(6, samplers_);
        gl().DeleteVertexArrays(1, &array_);
        FOVEA_PROC(DELETEBUFFERS, DeleteBuffers)(3, buffers_);
    }
    GLuint texture_of_this(const Picture& p, GLenum format = GL_RGBA8) {
        GLuint t = 0;
        gl().GenTextures(1, &t);
        textures_.push_back(t);
        gl().BindTexture(GL_TEXTURE_2D, t);
        gl().TexStorage2D(GL_TEXTURE_2D, 1, format, p.width, p.height);
        return t;
    }

private:
    static constexpr GLenum kOn[] = {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_STENCIL_TEST, GL_SCISSOR_TEST, GL_RASTERIZER_DISCARD, GL_SAMPLE_ALPHA_TO_COVERAGE, GL_SAMPLE_COVERAGE, GL_SAMPLE_MASK};
    GLuint framebuffers_[2] = {}, samplers_[6] = {}, array_ = 0, buffers_[3] = {};
};

TEST_F(ExtrapolationGlState, NothingOfItChangesAndNothingOfItReachesTheResult) {
    for (const Format format : {Format::rgba8, Format::rgb32f, Format::rgba16f}) {   // through passes, a copying pass, half floats
        const Picture a = moved_noise(48, 40, format, 0, 0), b = moved_noise(48, 40, format, 2, 1);
        const GLuint src1 = texture(a), src2 = texture(b), clean = texture(a), disturbed = texture(moved_noise(48, 40, format, 0, 0, 300));
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(src1, src2, clean, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            disturb(a);
            const auto before = state_now();
            EXPECT_EQ(e.extrapolate(src1, src2, disturbed, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            const std::string where = std::string(backend_name(k)) + " " + format_name(format);
            expect_same(before, state_now(), where);
            EXPECT_EQ(e.extrapolate(src1, src2, disturbed, 0.0f), static_cast<GLenum>(GL_INVALID_VALUE));
            EXPECT_EQ(e.extrapolate(src1, 4711, disturbed, 0.5f), static_cast<GLenum>(GL_INVALID_OPERATION));
            expect_same(before, state_now(), where + ", errors");
            calm();
            EXPECT_EQ(read(disturbed, a), read(clean, a)) << where;
            EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
        }
    }
}

TEST_F(ExtrapolationGlState, CreationAndDestructionLeaveItAsItWas) {
    const Picture p(32, 32, Format::rgba8);
    for (const Backend b : {Backend::processor, Backend::compute, Backend::fragment}) {
        disturb(p);
        const auto before = state_now();
        {
            const auto made = GlExtrapolator::create(load_gl, {.preset = Preset::draft, .backend = b});
            expect_same(before, state_now(), std::string("creation of ") + backend_name(b));
        }
        expect_same(before, state_now(), std::string("destruction of ") + backend_name(b));
        calm();
    }
}

TEST_F(ExtrapolationGlState, ActiveTransformFeedbackIsPausedAndGoesOn) {
    const char* const vertex = "#version 310 es\nout float v;\nvoid main() { v = 7.0; gl_Position = vec4(0); }";
    const char* const fragment = "#version 310 es\nvoid main() {}";
    const GLuint program = program_of(vertex, fragment);
    const char* const captured = "v";
    FOVEA_PROC(TRANSFORMFEEDBACKVARYINGS, TransformFeedbackVaryings)(program, 1, &captured, GL_INTERLEAVED_ATTRIBS);
    gl().LinkProgram(program);
    GLuint buffer = 0;
    FOVEA_PROC(GENBUFFERS, GenBuffers)(1, &buffer);
    const Picture a = moved_noise(48, 40, Format::rgba8, 0, 0), b = moved_noise(48, 40, Format::rgba8, 2, 1);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), drawn_to = texture(a);
    GLuint framebuffer = 0;   // there is no window to draw to
    gl().GenFramebuffers(1, &framebuffer);
    gl().BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl().FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, drawn_to, 0);
    for (auto& [k, e] : sides_) {
        gl().UseProgram(program);
        FOVEA_PROC(BINDBUFFERBASE, BindBufferBase)(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
        const float zeros[4] = {};
        FOVEA_PROC(BUFFERDATA, BufferData)(GL_TRANSFORM_FEEDBACK_BUFFER, sizeof zeros, zeros, GL_STATIC_READ);
        gl().Enable(GL_RASTERIZER_DISCARD);
        FOVEA_PROC(BEGINTRANSFORMFEEDBACK, BeginTransformFeedback)(GL_POINTS);
        gl().DrawArrays(GL_POINTS, 0, 1);
        const auto before = state_now();
        EXPECT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << backend_name(k);
        expect_same(before, state_now(), backend_name(k));
        gl().DrawArrays(GL_POINTS, 0, 1);
        FOVEA_PROC(ENDTRANSFORMFEEDBACK, EndTransformFeedback)();
        gl().Disable(GL_RASTERIZER_DISCARD);
        const auto* values = static_cast<const float*>(FOVEA_PROC(MAPBUFFERRANGE, MapBufferRange)(GL_TRANSFORM_FEEDBACK_BUFFER, 0, sizeof zeros, GL_MAP_READ_BIT));
        ASSERT_NE(values, nullptr);
        EXPECT_EQ(values[0], 7.0f);
        EXPECT_EQ(values[1], 7.0f) << backend_name(k) << ": the draw after the call goes on where the one before ended";
        EXPECT_EQ(values[2], 0.0f);
        FOVEA_PROC(UNMAPBUFFER, UnmapBuffer)(GL_TRANSFORM_FEEDBACK_BUFFER);
        gl().UseProgram(0);
        EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
    }
    gl().DeleteFramebuffers(1, &framebuffer);
    gl().DeleteProgram(program);
    FOVEA_PROC(DELETEBUFFERS, DeleteBuffers)(1, &buffer);
}

TEST_F(ExtrapolationGlState, SourcesKeepTheirBitsAndParameters) {
    for (const FormatRow& row : kRows) {
        const Picture a = moved_noise(33, 21, row.format, 0, 0), b = moved_noise(33, 21, row.format, 2, 1);
        const GLuint src1 = texture(a, 3), src2 = texture(b), out = texture(a);
        const Picture was1 = read(src1, a), was2 = read(src2, a);
        gl().BindTexture(GL_TEXTURE_2D, src1);
        gl().TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_LINEAR);
        gl().TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_MIRRORED_REPEAT);
        gl().TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 2);
        for (auto& [k, e] : sides_) {
            for (const float factor : {0.5f, -0.75f, 1e-30f}) ASSERT_EQ(e.extrapolate(src1, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR));
            EXPECT_EQ(read(src1, a), was1) << format_name(row.format) << " " << backend_name(k);
            EXPECT_EQ(read(src2, a), was2) << format_name(row.format) << " " << backend_name(k);
            gl().BindTexture(GL_TEXTURE_2D, src1);
            for (const auto& [what, value] : {std::pair{GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_LINEAR}, {GL_TEXTURE_WRAP_T, GL_MIRRORED_REPEAT}, {GL_TEXTURE_MAX_LEVEL, 2}, {GL_TEXTURE_BASE_LEVEL, 0}}) {
                GLint v = 0;
                gl().GetTexParameteriv(GL_TEXTURE_2D, static_cast<GLenum>(what), &v);
                EXPECT_EQ(v, value) << backend_name(k);
            }
        }
    }
}

}  // namespace fovea::test
