// What the levels of scaled_bins are made of and how they come back: filters, formats, layers, depth, masks.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/foveation/upsample.hpp"
#include "tests/render/surfaces.hpp"

using namespace fovea;
using namespace fovea::test;
using foveation::MethodSettings;
using foveation::Resolver;

namespace {

constexpr int kSize = 128;
constexpr density::FocalPoint kFocus{0.1f, -0.2f, 6, 6, 0};

using Resolve = GlTest;

int largest_difference(const Pixels& a, const Pixels& b) {
    int worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(int{a[i]} - int{b[i]}));
    return worst;
}

// The filters by their definition, from the small image of a level: nearest, and Catmull-Rom with clamped edges.
TEST(Upsample, NearestAndCubicFollowTheirDefinition) {
    constexpr int kWidth = 11, kHeight = 7;
    std::vector<std::uint8_t> small(kWidth * kHeight * 4);
    for (std::size_t i = 0; i < small.size(); ++i) small[i] = static_cast<std::uint8_t>(i * 7919 % 251);
    const foveation::SmallImage image{small.data(), kWidth * 4, 0, 0, kWidth, kHeight};
    const auto at = [&](int x, int y, int c) { return double{1.0 * small[static_cast<std::size_t>((std::clamp(y, 0, kHeight - 1) * kWidth + std::clamp(x, 0, kWidth - 1)) * 4 + c)]}; };
    const auto weight = [](double d) {
        d = std::abs(d);
        return d < 1 ? (1.5 * d - 2.5) * d * d + 1 : d < 2 ? ((-0.5 * d + 2.5) * d - 4) * d + 2 : 0;
    };
    for (int sx = 0; sx <= 3; ++sx)
        for (int sy = 0; sy <= 3; ++sy) {
            const int w = kWidth << sx, h = kHeight << sy, seam = 4 << sx;
            const std::size_t stride = static_cast<std::size_t>(w) * 4;
            std::vector<std::uint8_t> cubic(stride * static_cast<std::size_t>(h), 99), nearest = cubic;
            std::vector<float> scratch(static_cast<std::size_t>(kWidth + 4) * 4);
            for (const auto& [x0, x1] : {std::pair{0, seam}, {seam, w}}) {
                foveation::enlarge_cubic(image, sx, sy, x0, 0, x1, h, cubic.data() + x0 * 4, stride, scratch);
                foveation::enlarge_nearest(image, sx, sy, x0, 0, x1, h, nearest.data() + x0 * 4, stride);
            }
            for (int y = 0; y < h; ++y)
                for (int x = 0; x < w; ++x)
                    for (int c = 0; c < 4; ++c) {
                        const double u = (x + 0.5) / (1 << sx) - 0.5, v = (y + 0.5) / (1 << sy) - 0.5;
                        double want = 0;
                        for (int j = -2; j <= 2; ++j)
                            for (int i = -2; i <= 2; ++i) {
                                const int tx = static_cast<int>(std::floor(u)) + i, ty = static_cast<int>(std::floor(v)) + j;
                                want += weight(u - tx) * weight(v - ty) * at(tx, ty, c);
                            }
                        const std::size_t k = static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x * 4 + c);
                        ASSERT_NEAR(cubic[k], std::clamp(want, 0.0, 255.0), 0.51) << x << "," << y << " shifts " << sx << "," << sy;
                        ASSERT_EQ(nearest[k], at(x >> sx, y >> sy, c)) << x << "," << y;
                    }
        }
}

TEST_F(Resolve, GpuAndProcessorAgreeWithEveryFilterAndNumberOfThreads) {
    const QuadDraw quad(kPattern);
    std::array<Pixels, 3> by_filter;
    for (const auto filter : {gl::Filter::nearest, gl::Filter::linear, gl::Filter::cubic}) {
        MethodSettings settings;
        settings.filter = filter;
        settings.plan.levels = density::standard_levels();
        settings.plan.level_count = 4;
        Pixels& gpu = by_filter[static_cast<std::size_t>(filter)];
        for (const auto resolver : {Resolver::gpu, Resolver::processor})
            for (const int threads : {1, 2, 5}) {
                settings.resolver = resolver;
                settings.resolve_threads = threads;
                const Surface s = color_surface(kSize);
                submit(*make_method("scaled_bins", s, settings), quad.list(), s, kFocus);
                const Pixels got = read(s.target);
                if (gpu.empty()) gpu = got;
                EXPECT_LE(largest_difference(got, gpu), filter == gl::Filter::nearest ? 0 : 2) << "roundings of two filters";
            }
    }
    EXPECT_GT(largest_difference(by_filter[0], by_filter[1]), 30);
    EXPECT_GT(largest_difference(by_filter[1], by_filter[2]), 10);
}

TEST_F(Resolve, CubicIsCloserToTheFullPictureThanLinear) {
    const QuadDraw quad(kSmooth);
    const Pixels expected = full_picture(quad.list(), color_surface(kSize));
    const auto quality = [&](gl::Filter filter) {
        MethodSettings settings;
        settings.filter = filter;
        const Surface s = color_surface(kSize);
        submit(*make_method("scaled_bins", s, settings), quad.list(), s, kFocus);
        return psnr(read(s.target), expected);
    };
    EXPECT_GT(quality(gl::Filter::linear), quality(gl::Filter::nearest) + 3);
    EXPECT_GT(quality(gl::Filter::cubic), quality(gl::Filter::linear) + 1);
}

// A wider filter needs a wider ring of texels around a level's bins.
TEST_F(Resolve, NoClearColourBleedsThroughACubicFilter) {
    const QuadDraw quad("color = vec4(1.0);");
    for (const auto resolver : {Resolver::gpu, Resolver::processor}) {
        MethodSettings settings;
        settings.filter = gl::Filter::cubic;
        settings.resolver = resolver;
        settings.count_fragments = true;
        const Surface s = color_surface(256);
        const auto m = make_method("scaled_bins", s, settings);
        for (int step = 0; step < 6; ++step) {
            const auto cost = submit(*m, quad.list(), s, {-1.2f + 0.4f * static_cast<float>(step), 0.26f * static_cast<float>(step) - 0.7f, 6, 6, 0});
            EXPECT_EQ(m->counted_fragments(), cost.pixels_shaded);
            const Pixels got = read(s.target);
            EXPECT_EQ(*std::ranges::min_element(got), 255) << "step " << step;
        }
    }
}

TEST_F(Resolve, EveryFormatComesBack) {
    const QuadDraw quad(kSmooth);
    for (const GLenum format : {GL_SRGB8_ALPHA8, GL_RGB10_A2, GL_RGBA16F, GL_RGBA32F, GL_R11F_G11F_B10F, GL_RGB565}) {
        const Surface plain = color_surface(kSize, {.format = format}), s = color_surface(kSize, {.format = format});
        submit(*make_method("full", plain), quad.list(), plain, kFocus);
        const auto m = make_method("scaled_bins", s);
        const auto cost = submit(*m, quad.list(), s, kFocus);
        EXPECT_FALSE(cost.fell_back) << cost.note;
        const bool real = format == GL_RGBA16F || format == GL_RGBA32F || format == GL_R11F_G11F_B10F;
        const Pixels got = real ? read_resolved(s) : read(s.target), want = real ? read_resolved(plain) : read(plain.target);
        EXPECT_GT(psnr(got, want), 26) << "format " << std::hex << format;
        EXPECT_LT(psnr(got, want), 60) << "nothing was foveated";
    }
}

TEST_F(Resolve, IntegerAttachmentsBesideOthersKeepTheirValues) {
    // Attachment 1: identities, which no filter may mix; where nothing is drawn they are 0.
    std::string body = "id = uvec4(1000u + uint(ndc.x > 0.0) * 7u, 3u, 0u, 1u);";
    body += kSmooth;
    const QuadDraw quad(body, {.where = {-1, -1, 1, 0.5f}, .more_outputs = "layout(location = 1) out highp uvec4 id;\n"});
    SurfaceOptions o{.colors = 2};
    o.formats = {GL_RGBA8, GL_RGBA16UI};
    for (const char* name : {"scaled_bins", "scaled_bins_late", "full"}) {
        const Surface s = color_surface(kSize, o);
        const auto m = make_method(name, s);
        EXPECT_FALSE(submit(*m, quad.list(), s, kFocus).fell_back);
        std::vector<std::uint32_t> ids(kSize * kSize * 4);
        glFinish();
        glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target.framebuffer);
        glReadBuffer(GL_COLOR_ATTACHMENT1);
        glReadPixels(0, 0, kSize, kSize, GL_RGBA_INTEGER, GL_UNSIGNED_INT, ids.data());
        glReadBuffer(GL_COLOR_ATTACHMENT0);
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x) {
                const std::uint32_t id = ids[static_cast<std::size_t>(y * kSize + x) * 4];
                const int edge = std::min(std::abs(x - kSize / 2), std::abs(y - kSize * 3 / 4));
                ASSERT_TRUE(id == 0 || id == 1000 || id == 1007) << name << " mixed " << id << " at " << x << "," << y;
                if (edge > 4) {
                    ASSERT_EQ(id, y >= kSize * 3 / 4 ? 0u : x < kSize / 2 ? 1000u : 1007u) << name << " " << x << "," << y;
                }
            }
    }
}

TEST_F(Resolve, LayersOfAnArrayHaveFocalPointsOfTheirOwn) {
    constexpr int kLayers = 3;
    const QuadDraw quad(kPattern);
    const Pixels expected = full_picture(quad.list(), color_surface(kSize));
    gl::Name name = 0;
    glGenTextures(1, &name);
    const gl::Texture array(name);
    glBindTexture(GL_TEXTURE_2D_ARRAY, name);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, kSize, kSize, kLayers);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    std::vector<Surface> layers;
    std::vector<foveation::ViewTarget> targets;
    std::vector<foveation::ViewFocus> focus(kLayers);
    for (int i = 0; i < kLayers; ++i) {
        layers.push_back(color_surface(kSize));
        glBindFramebuffer(GL_FRAMEBUFFER, layers.back().target.framebuffer);
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array.name(), 0, i);
        targets.push_back(layers.back().target);
        focus[static_cast<std::size_t>(i)].points[0] = {-0.6f + 0.6f * static_cast<float>(i), 0.5f - 0.5f * static_cast<float>(i), 7, 7, 0};
        focus[static_cast<std::size_t>(i)].points[1] = {0.9f, -0.9f, 9, 9, 0};
        focus[static_cast<std::size_t>(i)].count = i == 1 ? 2 : 1;   // the second layer has two
    }
    for (const auto resolver : {Resolver::gpu, Resolver::processor}) {
        MethodSettings settings;
        settings.resolver = resolver;
        auto m = *foveation::create_method("scaled_bins", settings);
        ASSERT_TRUE(m->prepare(targets).has_value());
        EXPECT_FALSE(m->submit(quad.list(), targets, focus).fell_back);
        for (std::size_t i = 0; i < kLayers; ++i) {
            const Pixels got = read(targets[i]);
            const density::Plan& plan = *m->plan(i);
            std::size_t fovea = 0;
            for (int y = 0; y < kSize; ++y)
                for (int x = 0; x < kSize; ++x) {
                    if (plan.level_at(x / plan.bin_px(), y / plan.bin_px()) != 0) continue;
                    ++fovea;
                    const std::size_t k = static_cast<std::size_t>(y * kSize + x) * 4;
                    ASSERT_TRUE(std::equal(&got[k], &got[k] + 4, &expected[k])) << "layer " << i << " " << x << "," << y;
                }
            EXPECT_GT(fovea, 100u);
            EXPECT_LT(psnr(got, expected), 25) << "layer " << i;
            // Each layer is sharp where its own points are: the plan is the one of a view alone.
            const Surface alone = color_surface(kSize);
            auto one = make_method("scaled_bins", alone, settings);
            one->submit(quad.list(), {&alone.target, 1}, {&focus[i], 1});
            EXPECT_EQ(got, read(alone.target)) << "layer " << i;
        }
    }
}

TEST_F(Resolve, DepthComesBackToWithinATexelOfItsLevel) {
    // A slope along x: what is off by a texel of a level differs by the slope times its width.
    const QuadDraw slope(kSmooth, {.depth = 0.1f, .depth_right = 0.9f});
    for (const int samples : {0, 4})
        for (const auto mask : {foveation::Mask::stencil, foveation::Mask::depth})
            for (const char* name : {"scaled_bins", "scaled_bins_late"}) {
                if (samples > context().info().max_samples) continue;
                MethodSettings settings;
                settings.resolve_depth = true;
                settings.mask = mask;
                const Surface s = color_surface(kSize, {.samples = samples});
                submit(*make_method(name, s, settings), slope.list(), s, kFocus);
                // Thin planes across the slope are seen to the right of where the slope passes them, and nowhere else.
                for (const float at : {0.2f, 0.5f, 0.8f}) {
                    const QuadDraw plane("color = vec4(0.0, 0.0, 0.0, 1.0);", {.depth = at, .depth_right = at});
                    submit(*make_method("full", s), plane.after({.keep_color = true, .keep_depth = true}), s, kFocus);
                    const Pixels got = read_resolved(s);
                    const int passes = static_cast<int>((at - 0.1f) / 0.8f * kSize);
                    for (int y = 0; y < kSize; ++y)
                        for (int x = 0; x < kSize; ++x) {
                            const std::size_t k = static_cast<std::size_t>(y * kSize + x) * 4;
                            const bool seen = got[k] == 0 && got[k + 1] == 0 && got[k + 2] == 0;
                            if (x > passes + 4 || x < passes - 4) {
                                ASSERT_EQ(seen, x > passes) << name << " mask " << int(mask) << " samples " << samples << ": " << x << "," << y << " plane " << at;
                            }
                        }
                    submit(*make_method(name, s, settings), slope.list(), s, kFocus);
                }
            }
}

TEST_F(Resolve, FramebuffersWithoutStencilAreMaskedByDepthAndThoseWithoutBothAreRefused) {
    const QuadDraw quad(kSmooth);
    const Pixels expected = full_picture(quad.list(), color_surface(kSize));
    const Surface no_stencil = color_surface(kSize, {.stencil = false}), both = color_surface(kSize), neither = color_surface(kSize, {.depth = false});
    for (const char* name : {"scaled_bins", "scaled_bins_late"}) {
        const auto m = make_method(name, no_stencil);
        EXPECT_FALSE(submit(*m, quad.list(), no_stencil, kFocus).fell_back);
        submit(*make_method(name, both), quad.list(), both, kFocus);
        EXPECT_EQ(read(no_stencil.target), read(both.target));
        const auto refused = m->prepare({&neither.target, 1});
        ASSERT_FALSE(refused.has_value());
        EXPECT_NE(refused.error().message().find("DEPTH24_STENCIL8"), std::string::npos) << refused.error().message();
        const auto cost = submit(*m, quad.list(), neither, kFocus);
        EXPECT_TRUE(cost.fell_back);
        EXPECT_STRNE(cost.note, "");
        EXPECT_EQ(read(neither.target), expected) << "in full instead";
    }
}

// Issue 4 of the extension: gl_FragCoord counts the texels of the level.
TEST_F(Resolve, FragCoordIsScaledInALevel) {
    const QuadDraw quad("color = vec4(gl_FragCoord.xy / 255.0, gl_FragCoord.z, 1.0);");
    MethodSettings settings;
    settings.filter = gl::Filter::nearest;
    const Surface s = color_surface(kSize);
    const auto m = make_method("scaled_bins", s, settings);
    submit(*m, quad.list(), s, kFocus);
    const Pixels got = read(s.target);
    std::array<int, 3> seen{};
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const int level = m->plan(0)->level_at(x / m->plan(0)->bin_px(), y / m->plan(0)->bin_px());
            ++seen[static_cast<std::size_t>(level)];
            const std::size_t k = static_cast<std::size_t>(y * kSize + x) * 4;
            ASSERT_NEAR(got[k], (x >> level) + 0.5, 0.6) << x << "," << y << " level " << level;
            ASSERT_NEAR(got[k + 1], (y >> level) + 0.5, 0.6) << x << "," << y << " level " << level;
        }
    for (const int n : seen) EXPECT_GT(n, 200);
}

}  // namespace
