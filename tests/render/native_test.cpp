// Foveation by the driver itself, against a recording fake of its calls: no driver here has those extensions. The fake changes
// nothing, so the pictures are full ones; what is checked is who is told what, when, and that nothing is drawn twice or not
// at all.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdarg>
#include <cstdio>

#include "render/foveation/driver_traits.hpp"
#include "render/foveation/native_calls.hpp"
#include "tests/render/surfaces.hpp"

using namespace fovea;
using namespace fovea::test;
using foveation::MethodSettings;
using foveation::NativeCalls;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

namespace {

constexpr int kSize = 128;

struct Fake {
    std::vector<std::string> calls;
    int focal_points = 4, features = 3;
    std::uint32_t provided = 3;
    gl::Name rates = 0;   // the attached map
};
Fake fake;   // the calls are plain functions

[[gnu::format(printf, 1, 2)]] void note(const char* format, ...) {
    char text[200];
    va_list args;
    va_start(args, format);
    std::vsnprintf(text, sizeof text, format, args);
    va_end(args);
    fake.calls.emplace_back(text);
}

NativeCalls recording() {
    NativeCalls c;
    c.framebuffer_config = [](gl::Name, std::uint32_t layers, std::uint32_t points, std::uint32_t features, std::uint32_t* provided) {
        note("config layers %u points %u features %u", layers, points, features);
        *provided = fake.provided;
    };
    c.framebuffer_parameters = [](gl::Name, std::uint32_t layer, std::uint32_t point, float x, float y, float gx, float gy, float area) {
        note("framebuffer layer %u point %u: %g %g gain %g %g area %g", layer, point, double{x}, double{y}, double{gx}, double{gy}, double{area});
    };
    c.texture_parameters = [](gl::Name, std::uint32_t layer, std::uint32_t point, float x, float y, float gx, float gy, float area) {
        note("texture layer %u point %u: %g %g gain %g %g area %g", layer, point, double{x}, double{y}, double{gx}, double{gy}, double{area});
    };
    c.texture_integer = [](std::uint32_t target, std::uint32_t name, std::int32_t value) { note("set %s 0x%x = %d", target == GL_TEXTURE_2D ? "2D" : "array", name, value); };
    c.texture_real = [](std::uint32_t, std::uint32_t name, float value) { note("set 0x%x = %g", name, double{value}); };
    c.get_texture_integer = [](std::uint32_t, std::uint32_t name, std::int32_t* value) { *value = name == GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM ? fake.features : fake.focal_points; };
    c.rate = [](std::uint32_t rate) { note("rate 0x%x", rate); };
    c.rate_combiners = [](std::uint32_t a, std::uint32_t b) { note("combine 0x%x 0x%x", a, b); };
    c.attach_rates = [](std::uint32_t, std::uint32_t point, gl::Name texture, std::int32_t, std::int32_t layers, std::int32_t w, std::int32_t h) {
        note("attach 0x%x %s layers %d tiles %dx%d", point, texture != 0 ? "map" : "nothing", layers, w, h);
        if (texture != 0) fake.rates = texture;
    };
    return c;
}

class Native : public GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        fake = {};
    }
    const bool current_ = context().make_current();   // before the quad is made
    NativeCalls calls_ = recording();
    QuadDraw quad_{kPattern};
    MethodSettings settings() {
        MethodSettings s;
        s.native = &calls_;
        return s;
    }
    std::vector<std::string> take() { return std::exchange(fake.calls, {}); }
};

TEST_F(Native, ThisDriversCallsAreThoseItNames) {
    const NativeCalls c = foveation::driver_calls();
    EXPECT_EQ(c.framebuffer_foveated, context().info().qcom_framebuffer_foveated);
    EXPECT_EQ(c.texture_foveated, context().info().qcom_texture_foveated);
    EXPECT_EQ(c.framebuffer_foveated, c.framebuffer_config != nullptr && c.framebuffer_parameters != nullptr);
}

TEST_F(Native, ATextureIsToldItsFocalPointsAfterTheLatchAndDrawnToOnce) {
    calls_.texture_foveated = calls_.framebuffer_foveated = true;
    MethodSettings s = settings();
    s.plan.min_density = 0.25;
    const Surface target = color_surface(kSize);
    auto m = make_method("scaled_bins", target, s);
    EXPECT_EQ(m->name(), "scaled_bins");
    EXPECT_EQ(m->native_extension(), "GL_QCOM_texture_foveated");
    EXPECT_THAT(take(), ElementsAre("set 2D 0x8bfb = 3", "set 0x8bfc = 0.25"));
    ASSERT_TRUE(m->prepare({&target.target, 1}).has_value());
    EXPECT_THAT(take(), IsEmpty()) << "told once";
    const auto cost = submit(*m, quad_.list(), target, {0.5f, -0.25f, 4, 3, 1});
    EXPECT_THAT(take(), ElementsAre("texture layer 0 point 0: 0.5 -0.25 gain 4 3 area 1", "texture layer 0 point 1: 0.5 -0.25 gain 4 3 area 1"));
    EXPECT_EQ(cost.submissions, 1u);
    EXPECT_LT(cost.pixels_shaded, cost.pixels_full / 2) << "what the driver is expected to shade";
    EXPECT_EQ(read(target.target), full_picture(quad_.list(), color_surface(kSize)));
    take();
    m.reset();   // foveation of a texture cannot be switched off
    EXPECT_THAT(take(), ElementsAre("texture layer 0 point 0: 0 0 gain 0 0 area 0", "texture layer 0 point 1: 0 0 gain 0 0 area 0"));
}

TEST_F(Native, AnotherTextureOnTheSameFramebufferIsToldToo) {
    calls_.texture_foveated = true;
    Surface target = color_surface(kSize);
    const auto m = make_method("scaled_bins", target, settings());
    take();
    const gl::Texture before = std::move(target.color[0]);
    target.color[0] = color_texture(kSize, GL_RGBA8);
    glBindFramebuffer(GL_FRAMEBUFFER, target.target.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target.color[0].name(), 0);
    ASSERT_TRUE(m->prepare({&target.target, 1}).has_value());
    EXPECT_THAT(take(), ElementsAre("set 2D 0x8bfb = 3", "set 0x8bfc = 0"));
}

TEST_F(Native, TwoViewsOfAFramebufferShareItsFocalPoints) {
    calls_.framebuffer_foveated = true;
    const Surface target = color_surface(kSize, {.renderbuffer = true});
    const foveation::ViewTarget eyes[] = {{target.target.framebuffer, 0, 0, kSize / 2, kSize}, {target.target.framebuffer, kSize / 2, 0, kSize / 2, kSize}};
    auto m = *foveation::create_method("scaled_bins", settings());
    ASSERT_TRUE(m->prepare(eyes).has_value());
    EXPECT_EQ(m->native_extension(), "GL_QCOM_framebuffer_foveated");
    EXPECT_THAT(take(), ElementsAre("config layers 1 points 4 features 3"));
    foveation::ViewFocus focus[2];
    focus[0].points[0] = {0, 0.5f, 4, 4, 0};
    focus[0].count = 1;
    focus[1].points = {{{0.5f, 0, 5, 5, 0}, {-0.5f, 0, 6, 6, 0}}};
    focus[1].count = 2;
    m->submit(quad_.list(), eyes, focus);
    EXPECT_THAT(take(), ElementsAre("framebuffer layer 0 point 0: -0.5 0.5 gain 8 4 area 0", "framebuffer layer 0 point 1: -0.5 0.5 gain 8 4 area 0",
                                    "framebuffer layer 0 point 2: 0.75 0 gain 10 5 area 0", "framebuffer layer 0 point 3: 0.25 0 gain 12 6 area 0"));
    focus[1].count = 3;   // more than the driver was told of: full density
    m->submit(quad_.list(), {eyes, 2}, focus);
    EXPECT_EQ(take().back(), "framebuffer layer 0 point 3: 0 0 gain 0 0 area 0");
    EXPECT_EQ(m->full_region(1).half_width_ndc, foveation::Method::Region{}.half_width_ndc);
}

TEST_F(Native, LayersOfAnArrayAreToldByTheirNumber) {
    calls_.texture_foveated = true;
    gl::Name name = 0;
    glGenTextures(1, &name);
    const gl::Texture array(name);
    glBindTexture(GL_TEXTURE_2D_ARRAY, name);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, kSize, kSize, 2);
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    const Surface target = color_surface(kSize);
    glBindFramebuffer(GL_FRAMEBUFFER, target.target.framebuffer);
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array.name(), 0, 1);
    const auto m = make_method("scaled_bins", target, settings());
    EXPECT_EQ(take().front(), "set array 0x8bfb = 3");
    submit(*m, quad_.list(), target, {0, 0, 2, 2, 0});
    EXPECT_EQ(take().front(), "texture layer 1 point 0: 0 0 gain 2 2 area 0");
}

TEST_F(Native, ADriverThatDoesNotWantToIsDrawnInFullAndSaysSo) {
    calls_.texture_foveated = true;
    fake.focal_points = 1;
    const Surface target = color_surface(kSize);
    auto m = *foveation::create_method("scaled_bins", settings());
    const auto r = m->prepare({&target.target, 1});
    ASSERT_FALSE(r.has_value());
    EXPECT_NE(r.error().message().find("emulate"), std::string::npos);
    const auto cost = submit(*m, quad_.list(), target, {0, 0, 4, 4, 0});
    EXPECT_TRUE(cost.fell_back);
    EXPECT_STRNE(cost.note, "");
    EXPECT_THAT(take(), IsEmpty()) << "nothing is told to a texture that was refused";
    EXPECT_EQ(read(target.target), full_picture(quad_.list(), color_surface(kSize)));
}

TEST_F(Native, EmulationAsksTheDriverNothing) {
    calls_.texture_foveated = calls_.framebuffer_foveated = calls_.rate_attachment = calls_.rate_per_draw = true;
    MethodSettings s = settings();
    s.emulate = true;
    const Surface target = color_surface(kSize);
    for (const char* name : {"scaled_bins", "shading_rate", "auto"}) {
        const auto m = make_method(name, target, s);
        EXPECT_EQ(m->native_extension(), "");
        submit(*m, quad_.list(), target, {0, 0, 6, 6, 0});
        EXPECT_NE(read(target.target), full_picture(quad_.list(), color_surface(kSize)));
    }
    EXPECT_THAT(take(), IsEmpty());
}

Pixels attached_rates(int columns, int rows) {
    gl::Name name = 0;
    glGenFramebuffers(1, &name);
    const gl::Framebuffer f(name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, fake.rates, 0);
    std::vector<std::uint32_t> wide(static_cast<std::size_t>(columns * rows) * 4);
    glFinish();
    glReadPixels(0, 0, columns, rows, GL_RGBA_INTEGER, GL_UNSIGNED_INT, wide.data());
    Pixels p(wide.size() / 4);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = static_cast<std::uint8_t>(wide[4 * i]);
    return p;
}

TEST_F(Native, TheRateMapBecomesTheAttachmentWhoeverMakesIt) {
    calls_.rate_attachment = true;
    calls_.least_texel_px = calls_.most_texel_px = 8;   // the device's only size
    for (const std::uint32_t flags : {0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u})
        for (const auto maker : {foveation::RateMaker::processor, foveation::RateMaker::gpu}) {
            MethodSettings s = settings();
            s.rate_maker = maker;
            s.shading_rate.flags = flags;
            s.shading_rate.tile_px = 16;
            const Surface target = color_surface(kSize);
            auto m = make_method("shading_rate", target, s);
            EXPECT_EQ(m->native_extension(), "GL_EXT_fragment_shading_rate");
            EXPECT_THAT(take(), ElementsAre("attach 0x96d1 map layers 1 tiles 8x8"));
            for (const float x : {-0.4f, 0.3f}) {
                const auto cost = submit(*m, quad_.list(), target, {x, 0.1f, 4, 4, 0});
                EXPECT_THAT(take(), ElementsAre("rate 0x96a6", "combine 0x96d2 0x96d3", "combine 0x96d2 0x96d2"));
                EXPECT_EQ(cost.submissions, 1u);
                density::RateSettings rates = s.shading_rate;
                rates.tile_px = 8;
                const auto input = density::rate_input(rates, kSize, kSize, {x, static_cast<double>(0.1f)});
                Pixels expected(16 * 16);
                density::fill_rate_map(input, expected);
                EXPECT_EQ(attached_rates(16, 16), expected) << "flags " << flags;
            }
            m.reset();
            EXPECT_THAT(take(), ElementsAre("attach 0x96d1 nothing layers 0 tiles 0x0"));
        }
}

TEST_F(Native, OneRateADrawShadesEveryPixelOnce) {
    calls_.rate_per_draw = true;
    MethodSettings s = settings();
    s.count_fragments = true;
    s.shading_rate.tile_px = 8;
    const Surface target = color_surface(kSize);
    const auto m = make_method("shading_rate", target, s);
    EXPECT_EQ(m->native_extension(), "GL_QCOM_shading_rate");
    const Pixels expected = full_picture(quad_.list(), color_surface(kSize));
    for (const float x : {0.0f, 0.4f}) {
        const auto cost = submit(*m, quad_.list(), target, {x, 0.1f, 4, 4, 0});
        EXPECT_THAT(take(), ElementsAre("rate 0x96ae", "rate 0x96a9", "rate 0x96a6", "rate 0x96a6")) << "coarse to fine, and left at 1x1";
        if (foveation::driver_traits().early_stencil) {   // else what the stencil rejects is counted too
            EXPECT_EQ(m->counted_fragments(), cost.pixels_full) << "this driver ignores the rates: each pixel once";
        }
        EXPECT_LT(cost.pixels_shaded, cost.pixels_full / 2);
        EXPECT_EQ(read(target.target), expected);
    }
    // Nobody looks: only the hidden corners are coarse.
    s.shading_rate.flags = density::kRateGaze | density::kRateOcclusion;
    foveation::ViewFocus lost;
    m->submit(quad_.list(), {&target.target, 1}, {&lost, 1});
    EXPECT_THAT(take(), ElementsAre("rate 0x96ae", "rate 0x96a6", "rate 0x96a6"));
}

TEST_F(Native, TheEmulationTakesItsMapFromEitherMaker) {
    const Surface target = color_surface(kSize);
    std::vector<Pixels> pictures;
    for (const auto maker : {foveation::RateMaker::processor, foveation::RateMaker::gpu}) {
        MethodSettings s;
        s.rate_maker = maker;
        s.emulate = true;
        const auto m = make_method("shading_rate", target, s);
        submit(*m, quad_.list(), target, {0.2f, 0.1f, 4, 4, 0});
        pictures.push_back(read(target.target));
        submit(*m, quad_.list(), target, {-0.2f, 0.1f, 4, 4, 0});
        pictures.push_back(read(target.target));
    }
    EXPECT_EQ(pictures[0], pictures[2]);
    EXPECT_EQ(pictures[1], pictures[3]);
    EXPECT_NE(pictures[0], pictures[1]);
}

}  // namespace
