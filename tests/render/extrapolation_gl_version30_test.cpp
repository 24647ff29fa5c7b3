#include <cstring>

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include "render/extrapolation/gl_float_reader.hpp"
#include "tests/render/extrapolation_gl_state.hpp"

namespace fovea::test {

namespace {

struct OwnContext {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;

    explicit OwnContext(bool no_errors = false) {
        display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
        if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE) return;
        eglBindAPI(EGL_OPENGL_ES_API);
        EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, no_errors ? EGL_CONTEXT_OPENGL_NO_ERROR_KHR : EGL_NONE, EGL_TRUE, EGL_NONE};
        context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
        if (context != EGL_NO_CONTEXT) make_current();
    }
    ~OwnContext() {
        if (context == EGL_NO_CONTEXT) return;
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglDestroyContext(display, context);
    }
    OwnContext(const OwnContext&) = delete;
    OwnContext& operator=(const OwnContext&) = delete;
    void make_current() const { eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context); }
};

constexpr GLenum kOk = GL_NO_ERROR, kOperation = GL_INVALID_OPERATION;

}  // namespace

// Run again by fovea_extrapolation_gl_version30, where the driver gives no more than 3.0.
class ExtrapolationGlVersion30 : public ExtrapolationGl {
protected:
    static void SetUpTestSuite() {
        own_.emplace();
        if (own_->context == EGL_NO_CONTEXT) {
            version_ = "none";
            return;
        }
        version_ = reinterpret_cast<const char*>(FOVEA_PROC(GETSTRING, GetString)(GL_VERSION));
        if (!is_30()) return;
        auto e = GlExtrapolator::create(load_gl);
        ASSERT_TRUE(e.has_value()) << e.error().message();
        engine_.emplace(std::move(*e));
    }
    static void TearDownTestSuite() {
        engine_.reset();
        own_.reset();
    }
    void SetUp() override {
        if (!is_30()) GTEST_SKIP() << "no context of OpenGL ES 3.0 but: " << version_;
        ASSERT_TRUE(engine_.has_value());
    }
    static bool is_30() { return version_.starts_with("OpenGL ES 3.0"); }

    // As the base's, but what cannot be attached goes through the reader of 3.0; ReadsFloatsAsTheyWere holds it to the upload.
    static Picture read(GLuint t, const Picture& like) {
        if (like.format != Format::rgb32f) return ExtrapolationGl::read(t, like);
        Picture result(like.width, like.height, Format::rgba32f);
        GlStateGuard guard(gl(), true);
        const auto reader = GlFloatReader::create(gl());
        EXPECT_NE(reader, nullptr);
        EXPECT_TRUE(reader != nullptr && reader->read(t, like.width, like.height, result.bytes.data()));
        return result;
    }
    GLuint named() {
        GLuint t = 0;
        gl().GenTextures(1, &t);
        textures_.push_back(t);
        gl().BindTexture(GL_TEXTURE_2D, t);
        return t;
    }
    GLuint empty(GLenum internal, int width = 16, int height = 16) {
        const GLuint t = named();
        gl().TexStorage2D(GL_TEXTURE_2D, 1, internal, width, height);
        EXPECT_EQ(gl().GetError(), kOk) << internal;
        gl().BindTexture(GL_TEXTURE_2D, 0);
        return t;
    }

    static inline std::optional<OwnContext> own_;
    static inline std::string version_ = "none";
    static inline std::optional<GlExtrapolator> engine_;
};

TEST_F(ExtrapolationGlVersion30, TheProcessorServesAndSaysWhy) {
    EXPECT_EQ(gl().version, 30);
    EXPECT_EQ(gl().DispatchCompute, nullptr);   // the driver hands it out, but this context has it not
    EXPECT_EQ(engine_->backend(), Backend::processor);
    EXPECT_NE(engine_->reason().find("need OpenGL ES 3.1"), std::string::npos) << engine_->reason();
    for (const Backend b : {Backend::compute, Backend::fragment}) {
        const auto asked = GlExtrapolator::create(load_gl, {.backend = b});
        ASSERT_FALSE(asked.has_value());
        EXPECT_NE(asked.error().message().find("OpenGL ES 3.1"), std::string::npos);
    }
    const auto asked = GlExtrapolator::create(load_gl, {.backend = Backend::processor});
    ASSERT_TRUE(asked.has_value());
    EXPECT_EQ(asked->reason(), "asked for");
    EXPECT_EQ(gl().GetError(), kOk);
}

TEST_F(ExtrapolationGlVersion30, EveryFormatFollowsAMotion) {
    for (const FormatRow& row : kRows) {
        const Picture a = moved_noise(160, 120, row.format, 0, 0), b = moved_noise(160, 120, row.format, 4.3f, -2.6f), t = moved_noise(160, 120, row.format, 6.45f, -3.9f);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), truth = texture(t);
        ASSERT_EQ(engine_->extrapolate(src1, src2, out, 0.5f), kOk) << format_name(row.format);
        EXPECT_LT(red_off(read(out, a), read(truth, a)), 0.5 * red_off(read(src2, a), read(truth, a))) << format_name(row.format);
        EXPECT_EQ(engine_->work().tiles, 80);
        ASSERT_EQ(engine_->extrapolate(src2, src2, out, 0.5f), kOk);
        EXPECT_EQ(read(out, a), read(src2, a)) << format_name(row.format);
        EXPECT_EQ(gl().GetError(), kOk);
    }
}

TEST_F(ExtrapolationGlVersion30, ReadsFloatsAsTheyWere) {
    for (const Format format : {Format::rgb16f, Format::rgb32f, Format::rgba32f}) {
        const Picture a = moved_noise(33, 17, format, 0, 0);
        const GLuint t = texture(a);
        std::vector<float> got(33 * 17 * 4);
        GlStateGuard guard(gl(), true);
        const auto reader = GlFloatReader::create(gl());
        ASSERT_NE(reader, nullptr);
        ASSERT_TRUE(reader->read(t, 33, 17, got.data()));
        if (format == Format::rgb16f) {   // attachable here: the driver's own conversion
            const Picture attached = ExtrapolationGl::read(t, a);
            EXPECT_EQ(std::memcmp(got.data(), attached.bytes.data(), attached.bytes.size()), 0);
            continue;
        }
        const auto channels = static_cast<std::size_t>(channel_count(format));
        for (std::size_t pixel = 0; pixel < 33 * 17; ++pixel)
            ASSERT_EQ(std::memcmp(&got[4 * pixel], a.bytes.data() + 4 * channels * pixel, 4 * channels), 0) << format_name(format) << " " << pixel;
    }
}

TEST_F(ExtrapolationGlVersion30, UnsizedTexturesAndBaseLevelsAreKnownByTheirEffectiveFormat) {
    const Picture a = moved_noise(64, 48, Format::rgba8, 0, 0), b = moved_noise(64, 48, Format::rgba8, 3, 1);
    const GLuint src1 = texture(a), src2 = texture(b), sized = texture(a);
    ASSERT_EQ(engine_->extrapolate(src1, src2, sized, 0.5f), kOk);
    for (const GLint level : {0, 1, 3}) {
        const GLuint out = named();
        gl().TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, level);
        FOVEA_PROC(TEXIMAGE2D, TexImage2D)(GL_TEXTURE_2D, level, GL_RGBA, 64, 48, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
        gl().BindTexture(GL_TEXTURE_2D, 0);
        ASSERT_EQ(engine_->extrapolate(src1, src2, out, 0.5f), kOk) << level;
        const GLuint again = texture(a);
        ASSERT_EQ(engine_->extrapolate(out, out, again, 1), kOk);   // a still pair: a copy
        EXPECT_EQ(read(again, a), read(sized, a)) << level;
    }
    EXPECT_EQ(gl().GetError(), kOk);
}

TEST_F(ExtrapolationGlVersion30, ErrorsAreThoseOfTheSpecificationAndWriteNothing) {
    const Picture a = moved_noise(16, 16, Format::rgba8, 0, 0);
    const GLuint src1 = texture(a), src2 = texture(moved_noise(16, 16, Format::rgba8, 1, 0)), out = texture(a);
    EXPECT_EQ(engine_->extrapolate(src1, src2, out, 0.0f), static_cast<GLenum>(GL_INVALID_VALUE));
    for (const FormatRow& row : kRows) {
        const GLuint right = empty(row.internal);
        for (const FormatRow& other : kRows) {
            const GLuint t = empty(other.internal), expected = &row == &other ? kOk : kOperation;
            EXPECT_EQ(engine_->extrapolate(t, right, empty(row.internal), 1), expected) << format_name(row.format) << " " << format_name(other.format);
            EXPECT_EQ(engine_->extrapolate(right, right, t, 1), expected) << format_name(row.format) << " " << format_name(other.format);
        }
    }
    // What looks much like one of table 8.28.
    for (const GLenum internal : {GL_RG8, GL_SRGB8, GL_SRGB8_ALPHA8, GL_RGB565, GL_RGBA4, GL_RGB5_A1, GL_RGB10_A2, GL_RGB9_E5, GL_R11F_G11F_B10F, GL_RGBA8UI, GL_RGBA8I, GL_RGBA8_SNORM, GL_R8UI,
                                  GL_R16F, GL_R32F, GL_RG16F, GL_DEPTH_COMPONENT16, GL_DEPTH24_STENCIL8, GL_COMPRESSED_RGB8_ETC2, GL_COMPRESSED_RGBA8_ETC2_EAC}) {
        const GLuint t = empty(internal);
        EXPECT_EQ(engine_->extrapolate(t, t, t, 1), kOperation) << internal;
    }
    for (const auto& [w, h] : {std::pair{15, 16}, {17, 16}, {16, 15}, {16, 17}, {8, 8}, {200, 1}}) {
        const GLuint t = empty(GL_RGBA8, w, h);
        EXPECT_EQ(engine_->extrapolate(t, src2, out, 1), kOperation) << w << "x" << h;
        EXPECT_EQ(engine_->extrapolate(src1, src2, t, 1), kOperation) << w << "x" << h;
        EXPECT_EQ(engine_->extrapolate(t, t, t, 1), kOk) << w << "x" << h;
    }
    GLuint cube = 0;
    gl().GenTextures(1, &cube);
    textures_.push_back(cube);
    gl().BindTexture(GL_TEXTURE_CUBE_MAP, cube);
    gl().TexStorage2D(GL_TEXTURE_CUBE_MAP, 1, GL_RGBA8, 16, 16);
    gl().BindTexture(GL_TEXTURE_CUBE_MAP, 0);
    const GLuint no_image = named();
    gl().BindTexture(GL_TEXTURE_2D, 0);
    for (const GLuint t : {cube, no_image, GLuint{0}, GLuint{987654}}) EXPECT_EQ(engine_->extrapolate(t, src2, out, 1), kOperation) << t;
    EXPECT_EQ(read(out, a), a);
    EXPECT_EQ(gl().GetError(), kOk);
}

TEST_F(ExtrapolationGlVersion30, TheApplicationsStateIsAsBefore) {
    GLuint framebuffers[2], buffers[2], sampler = 0, array = 0;
    gl().GenFramebuffers(2, framebuffers);
    gl().GenBuffers(2, buffers);
    gl().GenSamplers(1, &sampler);
    gl().GenVertexArrays(1, &array);
    const auto mask_one = FOVEA_PROC(COLORMASKI, ColorMaski);   // of an extension here
    for (const Format format : {Format::rgba8, Format::rgb32f}) {   // the second is drawn to be read
        const Picture a = moved_noise(48, 48, format, 0, 0), b = moved_noise(48, 48, format, 2, 1);
        const GLuint src1 = texture(a), src2 = texture(b), bound = texture(a), clean = texture(a), dirty = texture(b);
        ASSERT_EQ(engine_->extrapolate(src1, src2, clean, 0.5f), kOk);
        gl().BindVertexArray(array);
        gl().BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers[0]);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers[1]);
        gl().BindBuffer(GL_PIXEL_PACK_BUFFER, buffers[0]);
        gl().BindBuffer(GL_PIXEL_UNPACK_BUFFER, buffers[1]);
        gl().BufferData(GL_PIXEL_UNPACK_BUFFER, 16, nullptr, GL_STREAM_DRAW);
        EXPECT_NE(gl().MapBufferRange(GL_PIXEL_UNPACK_BUFFER, 0, 16, GL_MAP_WRITE_BIT), nullptr);   // no upload may come from it
        gl().BindTexture(GL_TEXTURE_2D, bound);
        gl().BindSampler(0, sampler);
        gl().ActiveTexture(GL_TEXTURE3);
        gl().PixelStorei(GL_UNPACK_SKIP_ROWS, 7);
        gl().PixelStorei(GL_PACK_ROW_LENGTH, 99);
        gl().Viewport(3, 4, 5, 6);
        gl().Enable(GL_SCISSOR_TEST);
        gl().Enable(GL_BLEND);
        gl().Enable(GL_CULL_FACE);
        gl().ColorMask(GL_FALSE, GL_TRUE, GL_FALSE, GL_TRUE);
        if (has_extension("GL_OES_draw_buffers_indexed")) mask_one(1, GL_TRUE, GL_FALSE, GL_FALSE, GL_TRUE);
        const auto before = state_now();
        EXPECT_EQ(engine_->extrapolate(src1, src2, dirty, 0.5f), kOk) << format_name(format);
        EXPECT_EQ(gl().GetError(), kOk);
        expect_same(before, state_now(), format_name(format));
        EXPECT_EQ(engine_->extrapolate(src1, 987654, dirty, 0.5f), kOperation);
        expect_same(before, state_now(), "after an error");
        gl().UnmapBuffer(GL_PIXEL_UNPACK_BUFFER);
        for (const GLenum s : {GL_SCISSOR_TEST, GL_BLEND, GL_CULL_FACE}) gl().Disable(s);
        gl().ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        gl().PixelStorei(GL_UNPACK_SKIP_ROWS, 0);
        gl().PixelStorei(GL_PACK_ROW_LENGTH, 0);
        gl().ActiveTexture(GL_TEXTURE0);
        gl().BindSampler(0, 0);
        gl().BindVertexArray(0);
        gl().BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
        gl().BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
        gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
        EXPECT_EQ(read(dirty, a), read(clean, a)) << format_name(format);
    }
    gl().DeleteFramebuffers(2, framebuffers);
    gl().DeleteBuffers(2, buffers);
    gl().DeleteSamplers(1, &sampler);
    gl().DeleteVertexArrays(1, &array);
}

// It could tell formats and sizes only from errors.
TEST_F(ExtrapolationGlVersion30, AContextWithoutErrorsIsRefused) {
    {
        const OwnContext silent(true);
        if (silent.context != EGL_NO_CONTEXT) {
            const auto refused = GlExtrapolator::create(load_gl);
            ASSERT_FALSE(refused.has_value());
            EXPECT_NE(refused.error().message().find("no errors"), std::string::npos) << refused.error().message();
        }
    }
    own_->make_current();
}

}  // namespace fovea::test
