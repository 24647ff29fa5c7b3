// GL_QCOM_frame_extrapolation through the layer: listing, errors, and that programs see nothing but the output change.
// What the pictures look like is tested with the engine (tests/render).
#include <cmath>
#include <cstdlib>
#include <limits>
#include <tuple>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class FrameExtrapolation : public LayerTest {
protected:
    GLuint square(int x, int size = 64) {
        const GLuint t = texture(size, size);
        std::vector<Rgba> pixels(static_cast<std::size_t>(size * size));
        for (int row = 0; row < size; ++row)
            for (int column = 0; column < size; ++column) {
                const int u = column - x, v = row - 20;
                const bool inside = u >= 0 && u < 20 && v >= 0 && v < 20;
                pixels[static_cast<std::size_t>(row * size + column)] =
                    inside ? Rgba{static_cast<std::uint8_t>(100 + 7 * u), static_cast<std::uint8_t>(90 + 8 * v), static_cast<std::uint8_t>((u * v) % 256), 255}
                           : Rgba{20, 20, 20, 255};
            }
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
        return t;
    }
    Picture read_texture(GLuint t, int size = 64) {
        Surface s{.framebuffer = 0, .color = t, .depth = 0, .width = size, .height = size};
        glGenFramebuffers(1, &s.framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t, 0);
        return read(s);
    }
};

TEST_F(FrameExtrapolation, AScaleFactorOfZeroIsAnInvalidValue) {
    const GLuint a = square(10), b = square(14), out = texture(64, 64);
    ext.extrapolate(a, b, out, 0.0f);
    EXPECT_GL(GL_INVALID_VALUE);
    ext.extrapolate(a, b, out, -0.0f);
    EXPECT_GL(GL_INVALID_VALUE);
}

TEST_F(FrameExtrapolation, FormatsThatDifferAreInvalidOperations) {
    const GLuint a = square(10), b = square(14), half = texture(64, 64, GL_RGBA16F);
    ext.extrapolate(a, b, half, 0.5f);
    EXPECT_GL(GL_INVALID_OPERATION);
    ext.extrapolate(half, b, a, 0.5f);
    EXPECT_GL(GL_INVALID_OPERATION);
    ext.extrapolate(a, half, b, 0.5f);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FrameExtrapolation, SizesThatDifferAreInvalidOperations) {
    const GLuint a = square(10), b = square(14), larger = texture(65, 64);
    ext.extrapolate(a, b, larger, 0.5f);
    EXPECT_GL(GL_INVALID_OPERATION);
    ext.extrapolate(larger, a, b, 0.5f);
    EXPECT_GL(GL_INVALID_OPERATION);
}

TEST_F(FrameExtrapolation, FormatsOutsideTheTableAreInvalidOperations) {
    for (const GLenum format : {GL_RGBA8UI, GL_RG8, GL_RGB10_A2, GL_SRGB8_ALPHA8, GL_DEPTH_COMPONENT24}) {
        const GLuint a = texture(16, 16, format), b = texture(16, 16, format), out = texture(16, 16, format);
        ext.extrapolate(a, b, out, 0.5f);
        EXPECT_GL(GL_INVALID_OPERATION);
    }
}

TEST_F(FrameExtrapolation, FormatsOfTheTableAreAccepted) {
    for (const GLenum format : {GL_RGBA8, GL_RGB8, GL_R8, GL_RGBA16F, GL_RGB16F, GL_RGBA32F, GL_RGB32F}) {
        const GLuint a = texture(16, 16, format), b = texture(16, 16, format), out = texture(16, 16, format);
        ext.extrapolate(a, b, out, 0.5f);
        EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)) << std::hex << format;
    }
}

TEST_F(FrameExtrapolation, AStaticPairReturnsItself) {
    const GLuint a = square(10), b = square(10), out = texture(64, 64);
    ext.extrapolate(a, b, out, 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(read_texture(out), read_texture(b));
}

TEST_F(FrameExtrapolation, MotionIsCarriedOnAndBack) {
    const GLuint a = square(10), b = square(14), out = texture(64, 64);
    for (const auto& [factor, x] : {std::pair{1.0f, 18}, std::pair{0.5f, 16}, std::pair{-0.5f, 12}}) {
        ext.extrapolate(a, b, out, factor);
        EXPECT_GL(GL_NO_ERROR);
        const Picture p = read_texture(out), wanted = read_texture(square(x)), held = read_texture(b);
        double error = 0, hold = 0;
        for (std::size_t i = 0; i < p.pixels.size(); ++i) {
            error += std::abs(p.pixels[i].r - wanted.pixels[i].r);
            hold += std::abs(held.pixels[i].r - wanted.pixels[i].r);
        }
        EXPECT_LT(error, hold * 0.5) << factor;
    }
}

TEST_F(FrameExtrapolation, PendingFoveatedDrawsAreInTheSource) {
    const GLuint out = texture(64, 64);
    const Surface s = surface(64, 64, false);
    foveate(s);
    focus(s, 0, 0, 8);
    glClearColor(0, 0, 1, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    draw_scene();   // nothing after it that would submit it, but for the call
    ext.extrapolate(s.color, s.color, out, 0.5f);   // a static pair, of whatever is in it
    EXPECT_GL(GL_NO_ERROR);
    const Picture drawn = read(s), result = read_texture(out);
    EXPECT_NE(drawn.pixels, std::vector<Rgba>(64 * 64, drawn.pixels[0])) << "the scene has detail";
    EXPECT_EQ(result, drawn);
}

TEST_F(FrameExtrapolation, OnlyTheBaseLevelIsReadAndWritten) {
    GLuint pictures[3];
    glGenTextures(3, pictures);
    for (int i = 0; i < 3; ++i) {
        glBindTexture(GL_TEXTURE_2D, pictures[i]);
        glTexStorage2D(GL_TEXTURE_2D, 3, GL_RGBA8, 64, 64);
        for (int level = 0; level < 3; ++level) {
            const int size = 64 >> level;
            const Rgba fill = level == 0 ? Rgba{static_cast<std::uint8_t>(i < 2 ? 90 : 0), 0, 0, 255} : Rgba{0, static_cast<std::uint8_t>(60 * i + level), 0, 255};
            const std::vector<Rgba> pixels(static_cast<std::size_t>(size * size), fill);
            glTexSubImage2D(GL_TEXTURE_2D, level, 0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
        }
    }
    ext.extrapolate(pictures[0], pictures[1], pictures[2], 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    for (const Rgba& pixel : read_texture(pictures[2]).pixels) ASSERT_EQ(pixel, (Rgba{90, 0, 0, 255}));
    Surface level{.framebuffer = 0, .color = pictures[2], .depth = 0, .width = 32, .height = 32};
    glGenFramebuffers(1, &level.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, level.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, pictures[2], 1);
    for (const Rgba& pixel : read(level).pixels) ASSERT_EQ(pixel, (Rgba{0, 121, 0, 255}));
}

TEST_F(FrameExtrapolation, ErrorsPendingBeforeStay) {
    const GLuint a = square(10), b = square(14), out = texture(64, 64);
    glEnable(0x1234);
    ext.extrapolate(a, b, out, 0.5f);
    EXPECT_GL(GL_INVALID_ENUM);
    EXPECT_GL(GL_NO_ERROR);
}

TEST_F(FrameExtrapolation, AnErrorWritesNothing) {
    const GLuint a = square(10), b = square(14), out = square(30), half = texture(64, 64, GL_RGBA16F), larger = texture(65, 64), outside = texture(64, 64, GL_RGB10_A2);
    const Picture before = read_texture(out);
    for (const auto& [src1, src2, factor] : {std::tuple{a, b, 0.0f}, {half, b, 0.5f}, {a, larger, 0.5f}, {outside, outside, 0.5f}, {a, 4711u, 0.5f}}) {
        ext.extrapolate(src1, src2, out, factor);
        EXPECT_NE(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_GL(GL_NO_ERROR);
        EXPECT_EQ(read_texture(out), before);
    }
}

TEST_F(FrameExtrapolation, NamesWithoutA2DImageAreInvalidOperations) {
    const GLuint a = square(10), b = square(14), out = square(30);
    GLuint cube = 0, empty = 0;
    glGenTextures(1, &cube);
    glBindTexture(GL_TEXTURE_CUBE_MAP, cube);
    glTexStorage2D(GL_TEXTURE_CUBE_MAP, 1, GL_RGBA8, 64, 64);
    glGenTextures(1, &empty);
    glBindTexture(GL_TEXTURE_2D, empty);
    for (const GLuint bad : {0u, 4711u, cube, empty})
        for (const auto& [src1, src2, output] : {std::tuple{bad, b, out}, {a, bad, out}, {a, b, bad}}) {
            ext.extrapolate(src1, src2, output, 0.5f);
            EXPECT_GL(GL_INVALID_OPERATION);
        }
}

TEST_F(FrameExtrapolation, EveryFactorButZeroIsLegalAndFarOnesRepeat) {
    const GLuint a = square(10), b = square(14), out = texture(64, 64);
    const Picture first = read_texture(a), second = read_texture(b);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (const auto& [factor, wanted] : {std::pair{1e-30f, &second}, {1e30f, &second}, {kInfinity, &second}, {std::numeric_limits<float>::quiet_NaN(), &second}, {-1.0f, &first}, {-1e30f, &first}, {-kInfinity, &first}}) {
        ext.extrapolate(a, b, out, factor);
        EXPECT_GL(GL_NO_ERROR);
        EXPECT_EQ(read_texture(out), *wanted) << factor;
    }
}

TEST_F(FrameExtrapolation, OddAndSmallestSizesAreAccepted) {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 37}, {35, 1}, {33, 17}}) {
        const GLuint a = texture(width, height), b = texture(width, height), out = texture(width, height);
        ext.extrapolate(a, b, out, 0.5f);
        EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)) << width << "x" << height;
    }
}

TEST_F(FrameExtrapolation, SourcesAndTheProgramsStateAreAsBefore) {
    const GLuint a = square(10), b = square(14), out = texture(64, 64), bound = square(3);
    const Picture first = read_texture(a), second = read_texture(b);
    const Surface own = surface(32, 32);
    glBindFramebuffer(GL_FRAMEBUFFER, own.framebuffer);
    glActiveTexture(GL_TEXTURE2);
    glBindTexture(GL_TEXTURE_2D, bound);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 77);
    glViewport(1, 2, 3, 4);
    glEnable(GL_SCISSOR_TEST);
    glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
    ext.extrapolate(a, b, out, 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    for (const auto& [what, wanted] : {std::pair<GLenum, GLint>{GL_DRAW_FRAMEBUFFER_BINDING, static_cast<GLint>(own.framebuffer)}, {GL_READ_FRAMEBUFFER_BINDING, static_cast<GLint>(own.framebuffer)},
                                       {GL_ACTIVE_TEXTURE, GL_TEXTURE2}, {GL_TEXTURE_BINDING_2D, static_cast<GLint>(bound)}, {GL_UNPACK_ROW_LENGTH, 77}, {GL_VIEWPORT, 1}}) {
        GLint v[4] = {};
        glGetIntegerv(what, v);
        EXPECT_EQ(v[0], wanted) << std::hex << what;
    }
    EXPECT_TRUE(glIsEnabled(GL_SCISSOR_TEST));
    GLboolean mask[4] = {};
    glGetBooleanv(GL_COLOR_WRITEMASK, mask);
    EXPECT_EQ(mask[1], GL_FALSE);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glDisable(GL_SCISSOR_TEST);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glActiveTexture(GL_TEXTURE0);
    EXPECT_EQ(read_texture(a), first);
    EXPECT_EQ(read_texture(b), second);
}

// A source that is written over is always read on the processor; the pair before may have gone to the shaders, by what the probe
// measured on this machine, and their pictures differ a little.
TEST_F(FrameExtrapolation, TheOutputMayBeASource) {
    const GLuint a = square(10), b = square(14), out = texture(64, 64);
    const auto difference = [](const Picture& p, const Picture& q) {
        long sum = 0;
        for (std::size_t i = 0; i < p.pixels.size(); ++i) sum += std::abs(p.pixels[i].r - q.pixels[i].r) + std::abs(p.pixels[i].g - q.pixels[i].g) + std::abs(p.pixels[i].b - q.pixels[i].b);
        return sum;
    };
    const Picture source = read_texture(b);
    ext.extrapolate(a, b, out, 0.5f);
    const Picture wanted = read_texture(out);
    ext.extrapolate(a, b, b, 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_GT(difference(source, wanted), 0);
    EXPECT_LE(difference(read_texture(b), wanted), difference(source, wanted) / 4);
}

TEST_F(FrameExtrapolation, AnUnsizedFormatIsTheSizedOneThatItStandsFor) {
    const GLuint a = square(10), out = texture(64, 64);
    GLuint b = 0;
    glGenTextures(1, &b);
    glBindTexture(GL_TEXTURE_2D, b);
    const Picture same = read_texture(a);
    glBindTexture(GL_TEXTURE_2D, b);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 64, 64, 0, GL_RGBA, GL_UNSIGNED_BYTE, same.pixels.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    ext.extrapolate(a, b, out, 0.5f);
    EXPECT_GL(GL_NO_ERROR);
    EXPECT_EQ(read_texture(out), same);
}

}  // namespace fovea::layer_test
