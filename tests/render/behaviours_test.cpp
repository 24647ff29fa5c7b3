// What a foveated picture must survive: the sixteen behaviours that test suites of the extensions name, for every method, by
// the pixels, against the same frames drawn in full.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

#include "tests/render/gl_fixture.hpp"
#include "tests/render/surfaces.hpp"

using namespace fovea;
using namespace fovea::test;
using foveation::FrameCost;
using foveation::Method;
using foveation::MethodSettings;

namespace {

constexpr int kSize = 128;
constexpr density::FocalPoint kFocus{0.1f, -0.2f, 6, 6, 0};

class Behaviours : public GlTest, public ::testing::WithParamInterface<const char*> {
protected:
    std::unique_ptr<Method> make(const Surface& s, MethodSettings settings = {}) {
        settings.inset_outset.blend_px = 6;   // of a small picture
        return make_method(GetParam(), s, settings);
    }
    // True where the method is one that goes on over a picture without drawing it in full.
    static bool continues() { return GetParam() == std::string("scaled_bins") || GetParam() == std::string("shading_rate") || GetParam() == std::string("auto") || GetParam() == std::string("auto_late"); }
    static bool composes() { return GetParam() == std::string("inset_outset") || GetParam() == std::string("dynamic_viewports"); }

    // The fovea is that of the full picture; the rest resembles it, and is not the same.
    static void expect_foveated(const Method& m, const Pixels& got, const Pixels& expected, double least_psnr = 24) {
        std::size_t in_fovea = 0, differ = 0;
        const Method::Region region = m.full_region(0);
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x) {
                const std::size_t i = static_cast<std::size_t>(y * kSize + x) * 4;
                int worst = 0;
                for (std::size_t c = 0; c < 4; ++c) worst = std::max(worst, std::abs(int{got[i + c]} - int{expected[i + c]}));
                if (const density::Plan* plan = m.plan(0); plan != nullptr) {
                    if (plan->level_at(x / plan->bin_px(), y / plan->bin_px()) == 0) {
                        ++in_fovea;
                        ASSERT_EQ(worst, 0) << x << "," << y;
                    }
                } else {
                    const double dx = ((2.0 * x + 1) / kSize - 1 - region.x_ndc) / region.half_width_ndc, dy = ((2.0 * y + 1) / kSize - 1 - region.y_ndc) / region.half_height_ndc;
                    if (dx * dx + dy * dy < 1) {
                        ++in_fovea;
                        ASSERT_LE(worst, 3) << x << "," << y;
                    }
                }
                differ += worst > 0;
            }
        EXPECT_GT(in_fovea, 150u);
        EXPECT_GT(differ, static_cast<std::size_t>(kSize * kSize / 4)) << "nothing was foveated";
        EXPECT_GT(psnr(got, expected), least_psnr);
    }
    static void expect_color(const Pixels& p, int x, int y, std::array<int, 3> rgb) {
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(p[static_cast<std::size_t>(y * kSize + x) * 4 + c], rgb[c], 1) << x << "," << y << " channel " << c;
    }
};

TEST_P(Behaviours, Clear) {
    Surface s = color_surface(kSize);
    const auto m = make(s);
    gl::CommandList list;
    list.begin({.color = {1, 0, 0, 1}}, {});
    const FrameCost cost = submit(*m, list, s, kFocus);
    EXPECT_EQ(cost.pixels_shaded, 0u);
    const Pixels p = read(s.target);
    for (std::size_t i = 0; i < p.size(); i += 4) ASSERT_TRUE(p[i] == 255 && p[i + 1] == 0 && p[i + 3] == 255) << i / 4;
}

TEST_P(Behaviours, ClearThenDraw) {
    Surface s = color_surface(kSize);
    const auto m = make(s);
    const QuadDraw quad("color = vec4(0.0, 1.0, 0.0, 1.0);", {.where = {-1, -1, 0.5f, 0.5f}});
    submit(*m, quad.after({.color = {1, 0, 0, 1}}), s, kFocus);
    const Pixels p = read(s.target);
    expect_color(p, 1, 1, {0, 255, 0});
    expect_color(p, 60, 60, {0, 255, 0});
    expect_color(p, 2, 120, {255, 0, 0});
    expect_color(p, 120, 120, {255, 0, 0});
}

TEST_P(Behaviours, DrawClearDrawWithAFlushBetween) {
    Surface s = color_surface(kSize);
    const auto m = make(s);
    const QuadDraw first(kPattern), second("color = vec4(0.0, 1.0, 0.0, 1.0);", {.where = {-1, -1, 0, 1}});
    submit(*m, first.list(), s, kFocus);
    gl::flush();
    submit(*m, second.after({.color = {0, 0, 1, 1}}), s, kFocus);
    const Pixels p = read(s.target);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            if (x < kSize / 2 - 4 || x > kSize / 2 + 4) expect_color(p, x, y, {0, x < kSize / 2 ? 255 : 0, x < kSize / 2 ? 0 : 255});
}

TEST_P(Behaviours, ARenderbufferAttachment) {
    const QuadDraw quad(kSmooth);
    Surface s = color_surface(kSize, {.renderbuffer = true});
    const auto m = make(s);
    submit(*m, quad.list(), s, kFocus);
    expect_foveated(*m, read(s.target), full_picture(quad.list(), color_surface(kSize)));
}

TEST_P(Behaviours, FoveationEnabledBetweenDraws) {
    const QuadDraw below(kSmooth), above("color = vec4(1.0, 0.5 + 0.5 * sin(ndc.x * 20.0), 0.0, 1.0);", {.where = {-0.8f, -0.8f, 0.4f, 0.3f}, .depth = 0.3f, .depth_right = 0.3f});
    const auto go_on = above.after({.keep_color = true});
    Surface expected = color_surface(kSize), s = color_surface(kSize);
    const auto full = make_method("full", expected), also_full = make_method("full", s);
    submit(*full, below.list(), expected, kFocus);
    submit(*full, go_on, expected, kFocus);
    submit(*also_full, below.list(), s, kFocus);
    const auto m = make(s);
    const FrameCost cost = submit(*m, go_on, s, kFocus);
    EXPECT_EQ(cost.fell_back, !continues()) << cost.note;
    if (continues()) expect_foveated(*m, read(s.target), read(expected.target));
    else EXPECT_EQ(read(s.target), read(expected.target));
    EXPECT_EQ(std::string(cost.note).empty(), continues());
}

TEST_P(Behaviours, ParametersChangedBetweenDraws) {
    const QuadDraw below(kSmooth), above("color = vec4(1.0, 0.5 + 0.5 * sin(ndc.x * 20.0), 0.0, 1.0);", {.where = {-0.3f, -0.8f, 0.9f, 0.9f}, .depth = 0.3f, .depth_right = 0.3f});
    const auto go_on = above.after({.keep_color = true});
    Surface expected = color_surface(kSize), s = color_surface(kSize);
    const auto full = make_method("full", expected);
    submit(*full, below.list(), expected, kFocus);
    submit(*full, go_on, expected, kFocus);
    const auto m = make(s);
    submit(*m, below.list(), s, {0.5f, 0.5f, 3, 3, 1});
    submit(*m, go_on, s, kFocus);
    EXPECT_GT(psnr(read(s.target), read(expected.target)), 20) << "made smaller twice";
    // Where the second draw covers the new fovea, it is exact.
    const Pixels got = read(s.target), want = read(expected.target);
    const std::size_t middle = static_cast<std::size_t>((kSize * 2 / 5) * kSize + kSize * 11 / 20) * 4;
    EXPECT_TRUE(std::equal(&got[middle], &got[middle] + 4, &want[middle]));
}

TEST_P(Behaviours, DepthIsGoneOnFromWhereItIsResolved) {
    MethodSettings settings;
    settings.resolve_depth = true;
    // A slope of depth, then a plane that lies in front of it on the right half only.
    const QuadDraw slope(kSmooth, {.depth = 0.2f, .depth_right = 0.8f}), plane("color = vec4(0.0, 0.0, 1.0, 1.0);", {.depth = 0.5f, .depth_right = 0.5f});
    const auto go_on = plane.after({.keep_color = true, .keep_depth = true});
    Surface expected = color_surface(kSize), s = color_surface(kSize);
    const auto full = make_method("full", expected);
    submit(*full, slope.list(), expected, kFocus);
    submit(*full, go_on, expected, kFocus);
    const auto m = make(s, settings);
    if (composes()) GTEST_SKIP() << "leaves no depth in the app's framebuffer";
    submit(*m, slope.list(), s, kFocus);
    submit(*m, go_on, s, {-0.5f, 0.4f, 7, 7, 0});
    const Pixels got = read(s.target), want = read(expected.target);
    expect_color(got, kSize - 8, 5, {0, 0, 255});
    expect_color(got, kSize - 8, kSize - 5, {0, 0, 255});
    EXPECT_GT(psnr(got, want), 24);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize / 2 - 5; ++x) ASSERT_NEAR(got[static_cast<std::size_t>(y * kSize + x) * 4 + 2], want[static_cast<std::size_t>(y * kSize + x) * 4 + 2], 12) << x << "," << y;
}

TEST_P(Behaviours, UsedAsBlitSource) {
    const QuadDraw quad(kSmooth);
    Surface s = color_surface(kSize), to = color_surface(kSize);
    const auto m = make(s);
    submit(*m, quad.list(), s, kFocus);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.target.framebuffer);
    glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    expect_foveated(*m, read(to.target), full_picture(quad.list(), color_surface(kSize)));
    EXPECT_EQ(read(to.target), read(s.target));
}

TEST_P(Behaviours, UsedAsBlitTarget) {
    const QuadDraw quad(kSmooth), over("color = vec4(0.0, 0.0, 1.0, 1.0);", {.where = {-1, -1, 0, 0}, .depth = 0.2f, .depth_right = 0.2f});
    Surface s = color_surface(kSize), from = color_surface(kSize);
    const auto m = make(s), green = make_method("full", from);
    gl::CommandList list;
    list.begin({.color = {0, 1, 0, 1}}, {});
    submit(*green, list, from, kFocus);
    submit(*m, quad.list(), s, kFocus);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from.target.framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.target.framebuffer);
    glBlitFramebuffer(0, 0, kSize, kSize, 0, 0, kSize / 2, kSize, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    // Drawing goes on over what was blitted.
    submit(*m, over.after({.keep_color = true}), s, kFocus);
    const Pixels p = read(s.target);
    expect_color(p, 3, 3, {0, 0, 255});
    expect_color(p, 40, 40, {0, 0, 255});
    expect_color(p, 3, 100, {0, 255, 0});
    expect_color(p, 50, 120, {0, 255, 0});
    EXPECT_GT(p[static_cast<std::size_t>(40 * kSize + 120) * 4 + 2], 200) << "what neither blit nor draw touched";
}

TEST_P(Behaviours, ReusedByAnotherFramebuffer) {
    const QuadDraw quad(kSmooth), other("color = vec4(1.0, 0.0, 0.0, 1.0);");
    const Pixels expected = full_picture(quad.list(), color_surface(kSize));
    Surface first = color_surface(kSize);
    Surface second = surface_over(first);   // the same texture, another framebuffer
    const auto m = make(first);
    submit(*m, other.list(), first, kFocus);
    ASSERT_TRUE(m->prepare({&second.target, 1}).has_value());
    submit(*m, quad.list(), second, kFocus);
    expect_foveated(*m, read(first.target), expected);
    // And a framebuffer that got the name of a deleted one, of the same size, but made of something else.
    const gl::Name name = first.target.framebuffer;
    for (const SurfaceOptions& o : {SurfaceOptions{}, {.renderbuffer = true}, {.samples = 4}, {.format = GL_RGBA16F}, {}}) {
        if (o.samples > context().info().max_samples) continue;
        first = Surface{};
        first = color_surface(kSize, o, name);
        ASSERT_EQ(first.target.framebuffer, name);
        ASSERT_TRUE(m->prepare({&first.target, 1}).has_value());
        submit(*m, quad.list(), first, kFocus);
        expect_foveated(*m, read_resolved(first), full_picture(quad.list(), color_surface(kSize, o)));
    }
    EXPECT_EQ(gl::pending_error(), "");
}

TEST_P(Behaviours, AnotherTextureAttachedToTheSameFramebuffer) {
    const QuadDraw quad(kSmooth);
    const Pixels expected = full_picture(quad.list(), color_surface(kSize));
    Surface s = color_surface(kSize);
    const auto m = make(s);
    submit(*m, quad.list(), s, kFocus);
    const gl::Texture before = std::move(s.color[0]);
    s.color[0] = color_texture(kSize, GL_RGBA8);
    glBindFramebuffer(GL_FRAMEBUFFER, s.target.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.color[0].name(), 0);
    ASSERT_TRUE(m->prepare({&s.target, 1}).has_value());
    submit(*m, quad.list(), s, kFocus);
    expect_foveated(*m, read(s.target), expected);
}

TEST_P(Behaviours, FramebufferDestroyedWithWorkPending) {
    const QuadDraw quad(kSmooth);
    Surface s = color_surface(kSize);
    const auto m = make(s);
    submit(*m, quad.list(), s, kFocus);
    s.framebuffer.reset();   // nothing was flushed
    Surface again = surface_over(s);
    expect_foveated(*m, read(again.target), full_picture(quad.list(), color_surface(kSize)));
    // And the method itself, with its own targets.
    auto doomed = make(again);
    submit(*doomed, quad.list(), again, kFocus);
    const Pixels expected = read(again.target);
    submit(*doomed, quad.list(), again, kFocus);
    doomed.reset();
    EXPECT_EQ(read(again.target), expected);
}

TEST_P(Behaviours, Multisampled) {
    // Slanted edges: their samples are averaged.
    const QuadDraw quad(kSmooth, {.where = {-0.9f, -0.87f, 0.77f, 0.93f}});
    GLint most = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    for (const int samples : {2, 4, 8}) {
        if (samples > most) continue;   // nobody can make such a framebuffer
        Surface plain = color_surface(kSize, {.samples = samples}), s = color_surface(kSize, {.samples = samples});
        const auto full = make_method("full", plain), m = make(s);
        submit(*full, quad.list(), plain, kFocus);
        const FrameCost cost = submit(*m, quad.list(), s, kFocus);
        EXPECT_FALSE(cost.fell_back) << cost.note;
        expect_foveated(*m, read_resolved(s), read_resolved(plain));
    }
}

TEST_P(Behaviours, AMultisampledTextureUsedAsBlitSource) {
    const auto& info = context().info();
    if (info.max_samples < 4) GTEST_SKIP() << "this driver has no multisampling: at most " << info.max_samples << " samples";
    const QuadDraw quad(kSmooth);
    Surface plain = color_surface(kSize), s = color_surface(kSize, {.samples = 4, .multisample_texture = true});
    const auto m = make(s);
    submit(*m, quad.list(), s, kFocus);
    expect_foveated(*m, read_resolved(s), full_picture(quad.list(), plain));
}

TEST_P(Behaviours, SeveralAttachmentsWithOneOff) {
    // As many pictures as attachments; attachment 1 is there, but not drawn to.
    const QuadDraw quad(std::string(kSmooth) + "color2 = color.bgra; color3 = color.gbra;", {.outputs = 4});
    Surface plain = color_surface(kSize, {.colors = 4, .off = 1}), s = color_surface(kSize, {.colors = 4, .off = 1});
    const auto full = make_method("full", plain), m = make(s);
    submit(*full, quad.list(), plain, kFocus);
    const FrameCost cost = submit(*m, quad.list(), s, kFocus);
    EXPECT_EQ(cost.fell_back, composes()) << cost.note;
    for (const int attachment : {0, 2, 3}) {
        const Pixels got = read_color(s, attachment), want = read_color(plain, attachment);
        if (composes()) {
            EXPECT_EQ(got, want);
        } else {
            expect_foveated(*m, got, want);
        }
    }
    const Pixels zero = read_color(s, 0), two = read_color(s, 2);
    for (std::size_t i = 0; i < zero.size(); i += 4) ASSERT_TRUE(zero[i] == two[i + 2] && zero[i + 1] == two[i + 1] && zero[i + 2] == two[i]) << i / 4;
}

TEST_P(Behaviours, SampledAfterwards) {
    const QuadDraw quad(kSmooth);
    Surface s = color_surface(kSize);
    const auto m = make(s);
    submit(*m, quad.list(), s, kFocus);
    const Pixels expected = read(s.target);
    const QuadDraw copy("color = texelFetch(image, ivec2(gl_FragCoord.xy), 0);", {.more_outputs = "layout(binding = 3) uniform highp sampler2D image;\n"});
    Surface to = color_surface(kSize);
    glActiveTexture(GL_TEXTURE3);
    glBindTexture(GL_TEXTURE_2D, s.color[0].name());
    glActiveTexture(GL_TEXTURE0);
    submit(*make_method("full", to), copy.list(), to, kFocus);
    EXPECT_EQ(read(to.target), expected);
    // And again after another frame: nothing stale was cached.
    const QuadDraw second("color = vec4(ndc, 0.0, 1.0);");
    submit(*m, second.list(), s, {-0.4f, 0.3f, 7, 7, 0});
    glActiveTexture(GL_TEXTURE3);
    glBindTexture(GL_TEXTURE_2D, s.color[0].name());
    glActiveTexture(GL_TEXTURE0);
    submit(*make_method("full", to), copy.list(), to, kFocus);
    EXPECT_EQ(read(to.target), read(s.target));
    glActiveTexture(GL_TEXTURE3);
    glBindTexture(GL_TEXTURE_2D, 0);
    glActiveTexture(GL_TEXTURE0);
}

TEST_P(Behaviours, SharedBetweenTheContextsOfTwoThreads) {
    Pixels expected;
    {
        const QuadDraw quad(kSmooth);
        expected = full_picture(quad.list(), color_surface(kSize));
    }
    Surface mine = color_surface(kSize);
    gl::Context::release();
    Pixels theirs;
    std::thread other([&] {
        auto second = gl::Context::create(&context());
        ASSERT_TRUE(second.has_value()) << second.error().message();
        const QuadDraw quad(kSmooth);
        Surface s = surface_over(mine);   // framebuffers are not shared, textures are
        const auto m = make(s);
        submit(*m, quad.list(), s, kFocus);
        gl::finish();
        theirs = read(s.target);
        expect_foveated(*m, theirs, expected);
    });
    other.join();
    ASSERT_TRUE(context().make_current());
    EXPECT_EQ(read(mine.target), theirs);
    const QuadDraw quad(kSmooth);
    const auto m = make(mine);
    submit(*m, quad.list(), mine, kFocus);
    EXPECT_EQ(read(mine.target), theirs) << "both contexts draw the same";
}

TEST_P(Behaviours, NegativeCalls) {
    const QuadDraw quad(kSmooth);
    Surface s = color_surface(kSize);
    const auto m = make(s);
    const auto refused = [&](foveation::ViewTarget t, const char* why) {
        const auto r = m->prepare({&t, 1});
        ASSERT_FALSE(r.has_value()) << why;
        EXPECT_NE(r.error().message().find(why), std::string::npos) << r.error().message();
        EXPECT_EQ(gl::pending_error(), "");
    };
    refused({s.target.framebuffer, 0, 0, 0, kSize}, "0x128");
    refused({s.target.framebuffer, 0, 0, kSize, -3}, "128x-3");
    refused({987654, 0, 0, kSize, kSize}, "no such framebuffer");
    gl::Name empty = 0;
    glGenFramebuffers(1, &empty);
    glBindFramebuffer(GL_FRAMEBUFFER, empty);
    refused({empty, 0, 0, kSize, kSize}, "incomplete");
    glDeleteFramebuffers(1, &empty);
    // The frame is drawn in full until the targets are right again.
    const FrameCost cost = submit(*m, quad.list(), s, kFocus);
    EXPECT_TRUE(cost.fell_back);
    EXPECT_EQ(read(s.target), full_picture(quad.list(), color_surface(kSize)));
    ASSERT_TRUE(m->prepare({&s.target, 1}).has_value());
    EXPECT_FALSE(submit(*m, quad.list(), s, kFocus).fell_back);
    ASSERT_TRUE(m->prepare({}).has_value());
    EXPECT_EQ(m->submit(quad.list(), {}, {}).pixels_full, 0u);
    // Focal points that are no points, and none at all.
    ASSERT_TRUE(m->prepare({&s.target, 1}).has_value());
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
    for (const density::FocalPoint p : {density::FocalPoint{kNan, kNan, kNan, kNan, kNan}, {kInf, -kInf, kInf, kInf, -kInf}, {1e38f, 0, 1e38f, 1e38f, 1e38f}, {0, 0, -5, -5, -1e30f}}) {
        submit(*m, quad.list(), s, p);
        const Pixels got = read(s.target);
        for (std::size_t i = 3; i < got.size(); i += 4) ASSERT_EQ(got[i], 255) << "a hole at " << i / 4;
    }
    foveation::ViewFocus none;
    m->submit(quad.list(), {&s.target, 1}, {&none, 1});
    const Pixels got = read(s.target);
    for (std::size_t i = 3; i < got.size(); i += 4) ASSERT_EQ(got[i], 255) << "a hole at " << i / 4;
}

INSTANTIATE_TEST_SUITE_P(Method, Behaviours, ::testing::Values("scaled_bins", "scaled_bins_late", "inset_outset", "dynamic_viewports", "shading_rate", "auto", "auto_late"),
                         [](const auto& i) { return std::string(i.param); });

}  // namespace
