#include <algorithm>
#include <cstring>
#include <limits>
#include <tuple>

#include "tests/render/extrapolation_gl.hpp"

namespace fovea::test {

TEST_F(ExtrapolationGl, EveryBackendFollowsAMotionAndLeavesTheSourcesAlone) {
    const Picture a = moved_noise(200, 150, Format::rgba8, 0, 0), b = moved_noise(200, 150, Format::rgba8, 4.3f, -2.6f), truth = moved_noise(200, 150, Format::rgba8, 6.45f, -3.9f);
    const GLuint src1 = texture(a), src2 = texture(b, 3), out = texture(a);
    for (auto& [k, e] : sides_) {
        EXPECT_EQ(e.backend(), k);
        EXPECT_EQ(e.reason(), "asked for");
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << backend_name(k);
        const Picture result = read(out, a);
        EXPECT_GT(psnr(result, truth, 12), psnr(b, truth, 12) + 7) << backend_name(k);
        EXPECT_EQ(read(src1, a), a);
        EXPECT_EQ(read(src2, b), b);
        ASSERT_EQ(e.extrapolate(src1, src2, out, -0.75f), static_cast<GLenum>(GL_NO_ERROR));
        const Picture between = moved_noise(200, 150, Format::rgba8, 0.25f * 4.3f, -0.25f * 2.6f);
        EXPECT_GT(psnr(read(out, a), between, 12), psnr(a, between, 12) + 5) << backend_name(k);
        EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
    }
}

TEST_F(ExtrapolationGl, TheShadersComeAsCloseToTheTruthAsTheProcessorDoes) {
    // A square crosses a background that moves the other way: it covers on one side, and uncovers on the other.
    const auto at = [](float t) {
        Picture p = moved_noise(200, 150, Format::rgba8, -2.2f * t, 0.7f * t, 5);
        for (int y = 0; y < 150; ++y)
            for (int x = 0; x < 200; ++x) {
                const float u = static_cast<float>(x) - 60 - 9 * t, v = static_cast<float>(y) - 50 - 2 * t;
                if (u < 0 || u >= 50 || v < 0 || v >= 50) continue;
                const float n = noise(2 * u, 2 * v, 77);
                p.set(x, y, {0.5f + 0.5f * n, n, 0.9f - 0.5f * n, 1});
            }
        return p;
    };
    const Picture a = at(0), b = at(1), truth = at(1.5f);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    constexpr double kTolerance_db = 0.5;
    std::optional<Picture> processor;
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        const Picture result = read(out, a);
        if (!processor) processor = result;
        RecordProperty(backend_name(k), std::to_string(psnr(result, truth)));
        EXPECT_GT(psnr(result, truth), psnr(*processor, truth) - kTolerance_db) << backend_name(k) << ", repeating: " << psnr(b, truth);
    }
}

TEST_F(ExtrapolationGl, EveryBackendKeepsFineDetail) {
    const auto at = [](float x) {
        Picture p(160, 120, Format::rgba8);
        for (int j = 0; j < 120; ++j)
            for (int i = 0; i < 160; ++i) {
                const float u = static_cast<float>(i) - x, v = static_cast<float>(j), n = noise(u, v, 3);
                const float detail = 0.1f * std::sin(2.1f * u) * std::sin(0.3f * v);   // a period of three pixels
                p.set(i, j, {0.25f + 0.5f * n + detail, 0.25f + 0.5f * n, 0.25f + 0.5f * n - detail, 1});
            }
        return p;
    };
    const Picture a = at(0), b = at(5), truth = at(7.5f);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_GT(psnr(read(out, a), truth, 16), 36) << backend_name(k) << ": a linear gather costs 3 dB";
    }
}

TEST_F(ExtrapolationGl, StaticPairsAndCutsReturnTheLastFrameBitForBit) {
    for (const FormatRow& row : kRows) {
        const Picture a = moved_noise(201, 163, row.format, 0, 0), b = moved_noise(201, 163, row.format, 0, 0, 700);
        const GLuint src1 = texture(a), other = texture(b), out = texture(b), out2 = texture(a);
        const auto expected = read(src1, a), cut = read(other, b);
        for (auto& [k, e] : sides_) {
            const GLenum error = e.extrapolate(src1, src1, out, 0.5f);
                ASSERT_EQ(error, static_cast<GLenum>(GL_NO_ERROR)) << format_name(row.format);
            EXPECT_EQ(read(out, a), expected) << format_name(row.format) << " " << backend_name(k);
            ASSERT_EQ(e.extrapolate(src1, other, out2, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            EXPECT_EQ(read(out2, a), cut) << format_name(row.format) << " " << backend_name(k);
        }
    }
}

TEST_F(ExtrapolationGl, ErrorsAreThoseOfTheSpecificationAndWriteNothing) {
    const Picture a = moved_noise(16, 16, Format::rgba8, 0, 0), b = moved_noise(16, 16, Format::rgba8, 1, 0);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), half = texture(moved_noise(16, 16, Format::rgba16f, 0, 0)), small = texture(moved_noise(16, 15, Format::rgba8, 0, 0)), narrow = texture(moved_noise(15, 16, Format::rgba8, 0, 0));
    GLuint odd[3];
    gl().GenTextures(3, odd);
    textures_.insert(textures_.end(), odd, odd + 3);
    gl().BindTexture(GL_TEXTURE_2D, odd[0]);
    gl().TexStorage2D(GL_TEXTURE_2D, 1, GL_RG8, 16, 16);
    gl().BindTexture(GL_TEXTURE_CUBE_MAP, odd[1]);
    gl().TexStorage2D(GL_TEXTURE_CUBE_MAP, 1, GL_RGBA8, 16, 16);
    gl().BindTexture(GL_TEXTURE_CUBE_MAP, 0);
    gl().BindTexture(GL_TEXTURE_2D, odd[2]);   // never given an image
    gl().BindTexture(GL_TEXTURE_2D, 0);
    const GLenum operation = GL_INVALID_OPERATION, value = GL_INVALID_VALUE;
    for (auto& [k, e] : sides_) {
        EXPECT_EQ(e.extrapolate(src1, src2, out, 0.0f), value);
        EXPECT_EQ(e.extrapolate(src1, src2, out, -0.0f), value);
        EXPECT_EQ(e.extrapolate(half, src2, out, 1), operation);
        EXPECT_EQ(e.extrapolate(src1, src2, half, 1), operation);
        EXPECT_EQ(e.extrapolate(src1, small, out, 1), operation);
        EXPECT_EQ(e.extrapolate(src1, src2, narrow, 1), operation);
        EXPECT_EQ(e.extrapolate(odd[0], odd[0], odd[0], 1), operation);
        EXPECT_EQ(e.extrapolate(odd[1], odd[1], odd[1], 1), operation);
        EXPECT_EQ(e.extrapolate(odd[2], odd[2], odd[2], 1), operation);
        EXPECT_EQ(e.extrapolate(0, src2, out, 1), operation);
        EXPECT_EQ(e.extrapolate(src1, 987654, out, 1), operation);
        EXPECT_EQ(read(out, a), a);
        EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
    }
}

TEST_F(ExtrapolationGl, FactorsWithoutMeaningRepeatAndTinyTexturesWork) {
    for (const auto& [w, h] : {std::pair{1, 1}, {1, 19}, {33, 17}}) {
        const Picture a = moved_noise(w, h, Format::rgba8, 0, 0), b = moved_noise(w, h, Format::rgba8, 0.7f, 0.4f);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        for (auto& [k, e] : sides_) {
            for (const float factor : {0.5f, -0.3f, 3.0f}) EXPECT_EQ(e.extrapolate(src1, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR));
            for (const float factor : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f, 1e-30f}) {
                EXPECT_EQ(e.extrapolate(src1, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR));
                EXPECT_EQ(read(out, b), b) << backend_name(k) << " " << factor << " " << w << "x" << h;
            }
            EXPECT_EQ(e.extrapolate(src1, src2, out, -1e30f), static_cast<GLenum>(GL_NO_ERROR));
            EXPECT_EQ(read(out, a), a) << backend_name(k);
        }
    }
}

TEST_F(ExtrapolationGl, WhatAFactorCarriesBeyondReachIsRepeatedWhereItWas) {
    const Picture a = moved_noise(128, 96, Format::rgba8, 0, 0), b = moved_noise(128, 96, Format::rgba8, 4, 1);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 12), static_cast<GLenum>(GL_NO_ERROR));   // 48 pixels; the limit is 32
        EXPECT_EQ(read(out, b), b) << backend_name(k);
        ASSERT_EQ(e.extrapolate(src1, src2, out, 3), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_NE(read(out, b), b) << backend_name(k);
    }
}

TEST_F(ExtrapolationGl, KnownMotionIsProjectedWhateverTheBackend) {
    // A square of 24 pixels goes 8 pixels to the right before a still background: with its motion and depth known, exactly.
    const auto square = [](int x0) {
        Picture p = moved_noise(96, 64, Format::rgba8, 0, 0);
        for (int y = 20; y < 44; ++y)
            for (int x = x0; x < x0 + 24; ++x) p.set(x, y, {noise(static_cast<float>(9 * (x - x0)), static_cast<float>(9 * y), 40), 0, 1, 1});
        return p;
    };
    const Picture a = square(20), b = square(28), truth = square(32);
    std::vector<float> motion(2 * 96 * 64), depth(96 * 64, 5.0f);
    for (int y = 20; y < 44; ++y)
        for (int x = 28; x < 52; ++x) {
            motion[static_cast<std::size_t>(2 * (y * 96 + x))] = 8;
            depth[static_cast<std::size_t>(y * 96 + x)] = 1;
        }
    const KnownMotion known{motion.data(), depth.data(), 96, 64};
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f, {.motion = &known}), static_cast<GLenum>(GL_NO_ERROR));
        const Picture result = read(out, a);
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x) {
                const bool uncovered = x >= 27 && x < 34;   // behind the square, and a cell's rounding
                const bool rim = x >= 31 && x < 57 && y >= 19 && y < 45 && !(x >= 32 && x < 56 && y >= 20 && y < 44);   // goes with it
                ASSERT_TRUE(uncovered || rim || std::memcmp(result.at(x, y), truth.at(x, y), 4) == 0) << backend_name(k) << " " << x << " " << y;
            }
    }
    const KnownMotion wrong{motion.data(), nullptr, 95, 64};
    const Picture before = read(out, a);
    for (auto& [k, e] : sides_) EXPECT_EQ(e.extrapolate(src1, src2, out, 0.5f, {.motion = &wrong}), static_cast<GLenum>(GL_INVALID_VALUE)) << backend_name(k);
    EXPECT_EQ(read(out, a), before);
}

TEST_F(ExtrapolationGl, ReadsThreeFloats) {
    const Picture a = moved_noise(37, 21, Format::rgb32f, 0, 0);
    const Picture back = read(texture(a), a);
    for (int y = 0; y < 21; ++y)
        for (int x = 0; x < 37; ++x) ASSERT_EQ(std::memcmp(back.at(x, y), a.at(x, y), 12), 0) << x << " " << y;
}

TEST_F(ExtrapolationGl, MovesEveryFormat) {
    for (const FormatRow& row : kRows) {
        const Picture a = moved_noise(160, 120, row.format, 0, 0), b = moved_noise(160, 120, row.format, 4, 2), ahead = moved_noise(160, 120, row.format, 6, 3);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), truth = texture(ahead);
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << format_name(row.format) << " " << backend_name(k);
            EXPECT_LT(red_off(read(out, a), read(truth, a)), 0.5 * red_off(read(src2, a), read(truth, a))) << format_name(row.format) << " " << backend_name(k);
        }
    }
}

// What is no finite number stays at its pixel, in every float format, and at an edge of motion as well.
TEST_F(ExtrapolationGl, NansAndInfinitiesStayWhereTheyAreAndDoNotSpread) {
    constexpr int kPlaces[][2] = {{40, 30}, {20, 50}, {61, 20}, {0, 0}, {79, 63}};   // the third at the rim of what moves by itself
    for (const Format format : {Format::rgba16f, Format::rgb16f, Format::rgba32f, Format::rgb32f}) {
        const auto at = [&](float t) {
            Picture p = moved_noise(80, 64, format, 3.5f * t, 1.5f * t);
            const int x0 = 50 - static_cast<int>(4 * t);
            for (int y = 10; y < 30; ++y)
                for (int x = x0; x < x0 + 16; ++x) p.set(x, y, {noise(5.0f * static_cast<float>(x - x0), 5.0f * static_cast<float>(y), 8), 1, 0.2f, 1});
            return p;
        };
        const Picture a = at(0);
        Picture b = at(1);
        int which = 0;
        for (const auto& [x, y] : kPlaces) {
            const bool halves = bytes_per_channel(format) == 2;
            const std::uint32_t words[] = {0x7fc00000u, 0x7f800000u, 0xff800000u};   // NaN, infinity, -infinity
            const std::uint16_t half_words[] = {0x7e00u, 0x7c00u, 0xfc00u};
            const int channel = which % channel_count(format);
            std::memcpy(b.at(x, y) + bytes_per_channel(format) * channel, halves ? static_cast<const void*>(&half_words[which % 3]) : &words[which % 3], static_cast<std::size_t>(bytes_per_channel(format)));
            ++which;
        }
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        const Picture held = read(src2, a);
        for (auto& [k, e] : sides_)
            for (const float factor : {0.5f, -0.3f}) {
                ASSERT_EQ(e.extrapolate(src1, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR));
                const Picture result = read(out, a);
                for (int y = 0; y < 64; ++y)
                    for (int x = 0; x < 80; ++x) {
                        float v[4], was[4];
                        std::memcpy(v, result.at(x, y), 16);
                        std::memcpy(was, held.at(x, y), 16);
                        const bool placed = std::any_of(std::begin(kPlaces), std::end(kPlaces), [&](const int (&p)[2]) { return p[0] == x && p[1] == y; });
                        for (int c = 0; c < 4; ++c) {
                            if (placed)
                                ASSERT_TRUE(v[c] == was[c] || (std::isnan(v[c]) && std::isnan(was[c]))) << backend_name(k) << " " << format_name(format) << " " << x << " " << y << ": " << v[c] << " for " << was[c];
                            else
                                ASSERT_TRUE(std::isfinite(v[c])) << backend_name(k) << " " << format_name(format) << " " << x << " " << y;
                        }
                    }
            }
    }
}

TEST_F(ExtrapolationGl, OutputMayBeASource) {
    const Picture a = moved_noise(64, 64, Format::rgba8, 0, 0), b = moved_noise(64, 64, Format::rgba8, 3, 1);
    for (auto& [k, e] : sides_) {
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        ASSERT_EQ(sides_[0].engine.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        ASSERT_EQ(e.extrapolate(src1, src2, src2, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_EQ(read(src2, a), read(out, a));
    }
}

TEST_F(ExtrapolationGl, TheApplicationsStateIsAsBefore) {
    const Picture a = moved_noise(48, 48, Format::rgba8, 0, 0), b = moved_noise(48, 48, Format::rgba8, 2, 1);
    const GLuint src1 = texture(a), src2 = texture(b), bound = texture(a), bound3 = texture(b), clean = texture(a), dirty = texture(moved_noise(48, 48, Format::rgba8, 0, 0, 300));
    GLuint framebuffers[2], sampler = 0, array = 0;
    gl().GenFramebuffers(2, framebuffers);
    gl().GenSamplers(1, &sampler);
    gl().GenVertexArrays(1, &array);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, clean, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        gl().BindVertexArray(array);
        gl().BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers[0]);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers[1]);
        gl().ActiveTexture(GL_TEXTURE3);
        gl().BindTexture(GL_TEXTURE_2D, bound3);
        gl().BindSampler(3, sampler);
        gl().ActiveTexture(GL_TEXTURE0);
        gl().BindTexture(GL_TEXTURE_2D, bound);
        gl().ActiveTexture(GL_TEXTURE5);
        gl().BindImageTexture(0, bound, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA8);
        gl().PixelStorei(GL_UNPACK_ROW_LENGTH, 77);
        gl().PixelStorei(GL_PACK_SKIP_ROWS, 3);
        gl().Viewport(3, 4, 5, 6);
        gl().Enable(GL_SCISSOR_TEST);
        gl().Enable(GL_BLEND);
        gl().ColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
        ASSERT_EQ(e.extrapolate(src1, src2, dirty, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        const auto get = [](GLenum name) {
            GLint v[4] = {};
            gl().GetIntegerv(name, v);
            return v[0];
        };
        EXPECT_EQ(get(GL_ACTIVE_TEXTURE), GL_TEXTURE5);
        EXPECT_EQ(get(GL_VERTEX_ARRAY_BINDING), static_cast<GLint>(array));
        EXPECT_EQ(get(GL_DRAW_FRAMEBUFFER_BINDING), static_cast<GLint>(framebuffers[0]));
        EXPECT_EQ(get(GL_READ_FRAMEBUFFER_BINDING), static_cast<GLint>(framebuffers[1]));
        EXPECT_EQ(get(GL_UNPACK_ROW_LENGTH), 77);
        EXPECT_EQ(get(GL_PACK_SKIP_ROWS), 3);
        EXPECT_EQ(get(GL_VIEWPORT), 3);
        EXPECT_EQ(get(GL_CURRENT_PROGRAM), 0);
        EXPECT_NE(gl().IsEnabled(GL_SCISSOR_TEST), GL_FALSE);
        EXPECT_NE(gl().IsEnabled(GL_BLEND), GL_FALSE);
        EXPECT_EQ(gl().IsEnabled(GL_DEPTH_TEST), GL_FALSE);
        GLboolean mask[4];
        gl().GetBooleanv(GL_COLOR_WRITEMASK, mask);
        EXPECT_EQ(mask[1], GL_FALSE);
        GLint image = 0;
        gl().GetIntegeri_v(GL_IMAGE_BINDING_NAME, 0, &image);
        EXPECT_EQ(image, static_cast<GLint>(bound));
        gl().ActiveTexture(GL_TEXTURE3);
        EXPECT_EQ(get(GL_TEXTURE_BINDING_2D), static_cast<GLint>(bound3));
        EXPECT_EQ(get(GL_SAMPLER_BINDING), static_cast<GLint>(sampler));
        gl().ActiveTexture(GL_TEXTURE0);
        EXPECT_EQ(get(GL_TEXTURE_BINDING_2D), static_cast<GLint>(bound));
        EXPECT_EQ(get(GL_SAMPLER_BINDING), 0);
        EXPECT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR));
        gl().PixelStorei(GL_UNPACK_ROW_LENGTH, 0);
        gl().PixelStorei(GL_PACK_SKIP_ROWS, 0);
        gl().Disable(GL_SCISSOR_TEST);
        gl().Disable(GL_BLEND);
        gl().ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
        gl().BindImageTexture(0, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA8);
        gl().BindSampler(3, 0);
        EXPECT_EQ(read(dirty, a), read(clean, a)) << backend_name(k) << ": a scissor, mask or blend must not reach the passes";
    }
    gl().DeleteFramebuffers(2, framebuffers);
    gl().DeleteSamplers(1, &sampler);
    gl().DeleteVertexArrays(1, &array);
}

// glTexImage2D, with the unsized formats as well, and base levels of their own: what the specification calls the base level is
// the texture's.
TEST_F(ExtrapolationGl, MutableTexturesUnsizedFormatsAndBaseLevelsWork) {
    const auto tex_image = reinterpret_cast<PFNGLTEXIMAGE2DPROC>(load_gl("glTexImage2D"));
    const Picture a = moved_noise(160, 120, Format::rgba8, 0, 0), b = moved_noise(160, 120, Format::rgba8, 4, 2), ahead = moved_noise(160, 120, Format::rgba8, 6, 3);
    const auto mutable_texture = [&](const Picture& p, GLenum internal, int base) {
        GLuint t = 0;
        gl().GenTextures(1, &t);
        textures_.push_back(t);
        gl().BindTexture(GL_TEXTURE_2D, t);
        gl().PixelStorei(GL_UNPACK_ALIGNMENT, 1);
        const std::vector<std::byte> grey(static_cast<std::size_t>(p.width * p.height * 16), std::byte{90});
        if (base > 0) tex_image(GL_TEXTURE_2D, 0, static_cast<GLint>(internal), 2 * p.width, 2 * p.height, 0, GL_RGBA, GL_UNSIGNED_BYTE, grey.data());
        tex_image(GL_TEXTURE_2D, base, static_cast<GLint>(internal), p.width, p.height, 0, GL_RGBA, GL_UNSIGNED_BYTE, p.bytes.data());
        tex_image(GL_TEXTURE_2D, base + 1, static_cast<GLint>(internal), p.width / 2, p.height / 2, 0, GL_RGBA, GL_UNSIGNED_BYTE, grey.data());
        gl().TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, base);
        gl().TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, base + 1);
        return t;
    };
    const auto read_level = [&](GLuint t, int level, int width, int height) {
        GLuint f = 0;
        gl().GenFramebuffers(1, &f);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, f);
        gl().FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t, level);
        Picture result(width, height, Format::rgba8);
        gl().PixelStorei(GL_PACK_ALIGNMENT, 1);
        gl().ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, result.bytes.data());
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, 0);
        gl().DeleteFramebuffers(1, &f);
        return result;
    };
    for (auto& [k, e] : sides_)
        for (const auto& [internal, base1, base2, base_out] : {std::tuple{GL_RGBA8, 0, 0, 0}, {GL_RGBA, 0, 0, 0}, {GL_RGBA8, 1, 0, 0}, {GL_RGBA8, 0, 1, 1}}) {
            const std::string where = std::string(backend_name(k)) + " " + std::to_string(internal) + " " + std::to_string(base1) + std::to_string(base2) + std::to_string(base_out);
            const GLuint src1 = mutable_texture(a, static_cast<GLenum>(internal), base1), src2 = mutable_texture(b, static_cast<GLenum>(internal), base2), out = mutable_texture(a, static_cast<GLenum>(internal), base_out);
            ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << where;
            EXPECT_GT(psnr(read_level(out, base_out, 160, 120), ahead, 12), psnr(b, ahead, 12) + 7) << where;
            Picture grey(80, 60, Format::rgba8);
            std::fill(grey.bytes.begin(), grey.bytes.end(), std::byte{90});
            EXPECT_EQ(read_level(out, base_out + 1, 80, 60), grey) << where << ": the other levels are nobody's";
            EXPECT_EQ(read_level(src2, base2, 160, 120), b) << where;
        }
}

TEST_F(ExtrapolationGl, ALayerOfAnArraySeenThroughAViewIsATexture) {
    auto view = reinterpret_cast<PFNGLTEXTUREVIEWOESPROC>(load_gl("glTextureViewOES"));
    GLint count = 0;
    gl().GetIntegerv(GL_NUM_EXTENSIONS, &count);
    bool listed = false;
    const auto name_of = reinterpret_cast<PFNGLGETSTRINGIPROC>(load_gl("glGetStringi"));
    for (GLint i = 0; i < count; ++i) listed |= std::strcmp(reinterpret_cast<const char*>(name_of(GL_EXTENSIONS, static_cast<GLuint>(i))), "GL_OES_texture_view") == 0;
    if (!listed) GTEST_SKIP() << "the driver has no GL_OES_texture_view";
    const Picture a = moved_noise(160, 120, Format::rgba8, 0, 0), b = moved_noise(160, 120, Format::rgba8, 4, 2), ahead = moved_noise(160, 120, Format::rgba8, 6, 3);
    GLuint array = 0, views[3];
    gl().GenTextures(1, &array);
    gl().GenTextures(3, views);
    textures_.push_back(array);
    textures_.insert(textures_.end(), views, views + 3);
    gl().BindTexture(GL_TEXTURE_2D_ARRAY, array);
    reinterpret_cast<PFNGLTEXSTORAGE3DPROC>(load_gl("glTexStorage3D"))(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, 160, 120, 3);
    gl().BindTexture(GL_TEXTURE_2D_ARRAY, 0);
    gl().PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (GLuint i = 0; i < 3; ++i) {
        view(views[i], GL_TEXTURE_2D, array, GL_RGBA8, 0, 1, i, 1);
        gl().BindTexture(GL_TEXTURE_2D, views[i]);
        gl().TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 160, 120, GL_RGBA, GL_UNSIGNED_BYTE, (i == 1 ? b : a).bytes.data());
    }
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(views[0], views[1], views[2], 0.5f), static_cast<GLenum>(GL_NO_ERROR)) << backend_name(k);
        EXPECT_GT(psnr(read(views[2], a), ahead, 12), psnr(b, ahead, 12) + 7) << backend_name(k);
        EXPECT_EQ(read(views[0], a), a);
        EXPECT_EQ(read(views[1], b), b);
        EXPECT_EQ(e.extrapolate(array, views[1], views[2], 0.5f), static_cast<GLenum>(GL_INVALID_OPERATION)) << "an array is no 2D texture";
    }
}

TEST_F(ExtrapolationGl, WhatOnlyAlphaShowsMovesToo) {
    const auto at = [](float t) {
        Picture p(160, 120, Format::rgba8);
        for (int y = 0; y < 120; ++y)
            for (int x = 0; x < 160; ++x) p.set(x, y, {0.5f, 0.5f, 0.5f, noise(2 * (static_cast<float>(x) - 4 * t), 2 * (static_cast<float>(y) - 2 * t), 3)});
        return p;
    };
    const Picture a = at(0), b = at(1), ahead = at(1.5f);
    const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
    for (auto& [k, e] : sides_) {
        ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
        EXPECT_GT(psnr(read(out, a), ahead, 12), psnr(b, ahead, 12) + 7) << backend_name(k);
    }
}

// Motion is found in light of any range: luma is taken in parts of what the picture has.
TEST_F(ExtrapolationGl, DimAndGlaringLightMovesAsWellAsAnyOther) {
    for (const auto& [format, light] : {std::pair{Format::rgba16f, 2e-3f}, {Format::rgba16f, 2e4f}, {Format::rgba32f, 1e-6f}, {Format::rgba32f, 1e9f}}) {
        const auto at = [&](float t) {
            Picture p(160, 120, format);
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 160; ++x) {
                    const float n = light * (0.6f + noise(static_cast<float>(x) - 4 * t, static_cast<float>(y) - 2 * t, 3));
                    p.set(x, y, {n, 0.8f * n, 0.5f * n, 1});
                }
            return p;
        };
        const Picture a = at(0), b = at(1), ahead = at(1.5f);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        const Picture truth = read(texture(ahead), a), held = read(src2, a);
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            const Picture result = read(out, a);
            double off = 0, off_held = 0;
            for (int y = 12; y < 108; ++y)
                for (int x = 12; x < 148; ++x) {
                    float r = 0, w = 0, h = 0;
                    std::memcpy(&r, result.at(x, y), 4);
                    std::memcpy(&w, truth.at(x, y), 4);
                    std::memcpy(&h, held.at(x, y), 4);
                    off += std::fabs(static_cast<double>(r - w));
                    off_held += std::fabs(static_cast<double>(h - w));
                }
            EXPECT_LT(off, 0.4 * off_held) << backend_name(k) << " " << format_name(format) << " " << light;
        }
    }
}

// Light of 10,000 and alpha are carried as they are: nothing is clamped to 1, nothing is made opaque.
TEST_F(ExtrapolationGl, HighLightAndAlphaKeepTheirRange) {
    for (const Format format : {Format::rgba16f, Format::rgba32f}) {
        const auto at = [&](float t) {
            Picture p(160, 120, format);
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 160; ++x) {
                    const float u = static_cast<float>(x) - 4 * t, v = static_cast<float>(y) - 2 * t, n = noise(u, v, 3);
                    p.set(x, y, {10000 * n * n, 8 * n, 0.01f + n, noise(u, v, 9)});
                }
            return p;
        };
        const Picture a = at(0), b = at(1), ahead = at(1.5f);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a), wanted = texture(ahead);
        const Picture truth = read(wanted, a), held = read(src2, a);
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            const Picture result = read(out, a);
            double off[4] = {}, off_held[4] = {};
            for (int y = 12; y < 108; ++y)
                for (int x = 12; x < 148; ++x) {
                    float r[4], w[4], h[4];
                    std::memcpy(r, result.at(x, y), 16);
                    std::memcpy(w, truth.at(x, y), 16);
                    std::memcpy(h, held.at(x, y), 16);
                    for (int c = 0; c < 4; ++c) {
                        off[c] += std::fabs(static_cast<double>(r[c] - w[c]));
                        off_held[c] += std::fabs(static_cast<double>(h[c] - w[c]));
                    }
                }
            for (int c = 0; c < 4; ++c) EXPECT_LT(off[c], 0.5 * off_held[c]) << backend_name(k) << " " << format_name(format) << " channel " << c;
        }
    }
}

TEST_F(ExtrapolationGl, ShadersWorkOnTheMainSoftwareDriver) {
    if (context_->info().renderer.find("llvmpipe") == std::string::npos) GTEST_SKIP() << context_->info().renderer;
    EXPECT_EQ(sides_.size(), 3u);
}

TEST_F(ExtrapolationGl, TheProbeChoosesABackendAndSaysWhy) {
    auto e = GlExtrapolator::create(load_gl);
    ASSERT_TRUE(e.has_value()) << e.error().message();
    EXPECT_FALSE(e->reason().empty());
    RecordProperty("backend", backend_name(e->backend()));
    RecordProperty("reason", e->reason());
    if (context_->info().software) {
        EXPECT_NE(e->reason().find("probe"), std::string::npos);
    }
    std::printf("%s: %s; %s\n", context_->info().renderer.c_str(), backend_name(e->backend()), e->reason().c_str());
    EXPECT_FALSE(GlExtrapolator::create([](const char*) -> GlFunction { return nullptr; }).has_value());
}

}  // namespace fovea::test
