// What is off costs nothing: the GL calls of every effect, on and off, counted by name.
#include "tests/render/gl_calls.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>

#include "render/effects/declared.hpp"
#include "render/effects/effects.hpp"
#include "render/foveation/driver_traits.hpp"
#include "render/scene/scene.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::test;
using effects::Effect;

namespace {

// Makes a method as planned and draws two frames with it, with everything that it needs ready before.
struct Used {
    GlCalls making, drawing;
};

class GlCallsTest : public GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        static_cast<void>(foveation::driver_traits());   // the probe draws once per process
    }

    Used use(const std::string& method, const foveation::MethodSettings& settings) {
        Views v(128, 128, 2);
        v.look(0, {0.2f, 0.1f, 6, 6, 0});
        v.look(1, {0.1f, 0.1f, 6, 6, 0});
        const QuadDraw quad(kPattern);
        Used u;
        std::unique_ptr<foveation::Method> m;
        u.making = calls_of([&] {
            auto made = foveation::create_method(method, settings);
            EXPECT_TRUE(made.has_value());
            m = *std::move(made);
            EXPECT_TRUE(m->prepare(v.targets).has_value());
        });
        u.drawing = calls_of([&] {
            for (int i = 0; i < 2; ++i) m->submit(quad.list(), v.targets, v.focus);
        });
        gl::finish();
        return u;
    }

    Used use_planned(const std::string& method, Effect effect, bool on) {
        effects::Needs needs;
        needs.lens_radius = 0.9;
        effects::Declared only;
        for (auto& e : only.effects) e = false;
        only.effects[static_cast<std::size_t>(Effect::level_mask)] = effect != Effect::level_mask || on;
        only.effects[static_cast<std::size_t>(effect)] = on;
        const auto plan = effects::plan(needs, {.method = method}, only);
        EXPECT_EQ(plan.on(effect), on);
        foveation::MethodSettings settings;
        settings.resolver = foveation::Resolver::gpu;
        plan.apply(settings);
        return use(plan.method(), settings);
    }
};

// Names that begin so make an object, build a shader or ask a question.
std::uint64_t objects_and_queries(const GlCalls& c) {
    return c.of_all("glGen") + c.of_all("glCreate") + c.of_all("glTexStorage") + c.of_all("glRenderbufferStorage") + c.of_all("glBufferData") + c.of_all("glFenceSync") + c.of_all("glShaderSource");
}

TEST_F(GlCallsTest, EveryCallThatMakesOrDrawsIsCountedAndNoneIsAQuery) {
    std::set<std::string> called;
    const std::regex call(R"(\b(gl[A-Z][A-Za-z0-9]*)\s*\()");
    for (const char* room : {"gl", "foveation", "scene", "effects", "quality"})
        for (const auto& e : std::filesystem::directory_iterator(std::filesystem::path(FOVEA_SOURCE_DIR) / "render" / room)) {
            if (e.path().extension() != ".cpp") continue;
            std::ifstream in(e.path());
            const std::string text{std::istreambuf_iterator<char>(in), {}};
            for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) called.insert((*it)[1]);
        }
    const auto counted = counted_gl_calls();
    const std::regex makes("^gl(Gen|Create|Begin|Draw|Dispatch|Blit|Clear|Copy|FenceSync|BufferData|ShaderSource)|Storage|Image");
    for (const std::string& name : called) {
        if (std::regex_search(name, makes)) {
            EXPECT_THAT(counted, testing::Contains(name)) << "add it to tests/render/gl_calls.cpp";
        }
        EXPECT_EQ(name.find("Quer"), name.npos) << "a timer or occlusion query: its cost and who asks for it belong in the planner's table";
    }
    EXPECT_GT(called.size(), 60u);
}

TEST_F(GlCallsTest, FullMakesNoObjectAndDrawsEachViewOnce) {
    const Used u = use("full", {});
    EXPECT_EQ(objects_and_queries(u.making), 0u);
    EXPECT_EQ(objects_and_queries(u.drawing), 0u);
    EXPECT_EQ(u.drawing.of("glDrawElements"), 4u);
    EXPECT_EQ(u.drawing.of("glClear"), 4u);
    for (const char* none : {"glStencilFunc", "glStencilOp", "glBlitFramebuffer", "glDrawArrays", "glDrawArraysInstanced", "glFinish", "glFlush", "glReadPixels", "glBufferSubData", "glMemoryBarrier", "glDispatchCompute"})
        EXPECT_EQ(u.drawing.of(none), 0u) << none;
}

TEST_F(GlCallsTest, AFrameOfAnyMethodMakesNothing) {
    for (const auto& m : foveation::methods()) {
        if (std::string(m.name) == "auto") continue;   // it tries both ways, with what it made before
        const Used u = use(m.name, {});
        EXPECT_EQ(objects_and_queries(u.drawing), 0u) << m.name;
    }
}

TEST_F(GlCallsTest, AVertexBoundSceneUnderAutoCostsWhatFullCosts) {
    effects::Needs n;
    n.triangles = 2e6;
    n.vertex_ms = 80;
    n.full_ms = 100;
    const auto plan = effects::plan(n, {});
    foveation::MethodSettings s;
    plan.apply(s);
    use("full", {});   // each GL function asks for the version at its first call in a process: not in what is compared
    const Used planned = use(plan.method(), s), full = use("full", {});
    EXPECT_EQ(planned.making.by_name, full.making.by_name);
    EXPECT_EQ(planned.drawing.by_name, full.drawing.by_name);
}

TEST_F(GlCallsTest, MsaaOffMakesNoSamplesAndNoResolve) {
    const Used off = use_planned("inset_outset", Effect::msaa, false), on = use_planned("inset_outset", Effect::msaa, true);
    EXPECT_EQ(off.making.of("glTexStorage2DMultisample") + off.drawing.of("glBlitFramebuffer"), 0u);
    EXPECT_GT(on.making.of("glRenderbufferStorageMultisample"), off.making.of("glRenderbufferStorageMultisample")) << "else this test sees nothing";
    EXPECT_EQ(on.drawing.of("glBlitFramebuffer"), 8u) << "two images of two eyes, twice";
    EXPECT_EQ(off.making.of("glGenFramebuffers"), 4u);
    EXPECT_EQ(on.making.of("glGenFramebuffers"), 8u);
}

TEST_F(GlCallsTest, MasksOffDrawNoDiscAndTouchNoStencil) {
    const Used off = use_planned("inset_outset", Effect::level_mask, false), on = use_planned("inset_outset", Effect::level_mask, true);
    EXPECT_EQ(off.drawing.of("glStencilFunc") + off.drawing.of("glStencilOp"), 0u);
    EXPECT_EQ(off.making.of("glLinkProgram") + 1, on.making.of("glLinkProgram"));
    EXPECT_GT(on.drawing.of("glDrawArrays"), off.drawing.of("glDrawArrays"));
    EXPECT_GT(on.drawing.of("glStencilFunc") + on.drawing.of("glDepthFunc"), off.drawing.of("glStencilFunc") + off.drawing.of("glDepthFunc"));
}

TEST_F(GlCallsTest, BlendAndContrastAreInNoShaderWhenOff) {
    for (const auto& [effect, word] : {std::pair{Effect::blend, "smoothstep"}, std::pair{Effect::contrast, "contrast"}}) {
        const Used off = use_planned("inset_outset", effect, false), on = use_planned("inset_outset", effect, true);
        EXPECT_FALSE(off.making.any_shader_has(word)) << word;
        EXPECT_TRUE(on.making.any_shader_has(word)) << word;
        EXPECT_EQ(off.making.of("glLinkProgram"), on.making.of("glLinkProgram")) << "another variant, not one more";
    }
}

TEST_F(GlCallsTest, AHiddenAreaThatIsOffDrawsNoDiscForIt) {
    const Used off = use_planned("inset_outset", Effect::hidden_area, false), on = use_planned("inset_outset", Effect::hidden_area, true);
    EXPECT_EQ(off.drawing.of("glDrawArrays") + 4, on.drawing.of("glDrawArrays")) << "one a view and frame";
}

TEST_F(GlCallsTest, CountingOffHasNoBufferAndNoBarrier) {
    for (const char* method : {"full", "scaled_bins", "inset_outset"}) {
        const Used off = use_planned(method, Effect::fragment_counter, false), on = use_planned(method, Effect::fragment_counter, true);
        EXPECT_EQ(off.drawing.of("glBindBufferBase"), 0u) << method;
        EXPECT_EQ(off.making.of("glGenBuffers") + 1, on.making.of("glGenBuffers")) << method;
        EXPECT_EQ(on.drawing.of("glBindBufferBase"), 2u) << method;
    }
}

TEST_F(GlCallsTest, BinsMakeOneTargetPerLevelAndOnlyTheProgramsTheyUse) {
    const Used bins = use_planned("scaled_bins", Effect::finer_periphery, false);
    EXPECT_EQ(bins.making.of("glGenFramebuffers"), 4u) << "levels 1 and 2 of two eyes";
    EXPECT_EQ(bins.making.of("glLinkProgram"), 2u) << "mask and resolve";
    EXPECT_EQ(bins.drawing.of("glBlitFramebuffer"), 0u);
}

// ---- scenes ----

GlCalls making_of(const std::string& name, bool count = false) {
    return calls_of([&] {
        auto opened = effects::open_scene(name);
        ASSERT_TRUE(opened.has_value()) << opened.error().message();
        const auto scene = scene::Scene::create({.name = name, .count_fragments = count}, std::move(opened->source));
        ASSERT_TRUE(scene.has_value()) << scene.error().message();
    });
}

TEST_F(GlCallsTest, AScenePaysOnlyForWhatItHas) {
    const GlCalls hall = making_of("fragbox"), wires = making_of("thin"), lantern = making_of(FOVEA_SOURCE_DIR "/configs/scenes/lantern.gltf");
    EXPECT_EQ(hall.of("glGenTextures") + wires.of("glGenTextures"), 0u);
    EXPECT_EQ(lantern.of("glGenTextures"), 2u);
    EXPECT_FALSE(wires.any_shader_has("#define COLOR_IMAGE"));
    EXPECT_TRUE(lantern.any_shader_has("#define COLOR_IMAGE"));
    EXPECT_FALSE(lantern.any_shader_has("#define CUT_OUT"));
    EXPECT_FALSE(lantern.any_shader_has("#define SURFACE_IMAGE"));
    EXPECT_FALSE(lantern.any_shader_has("#define COUNT_FRAGMENTS"));
    EXPECT_EQ(making_of("thin", true).of("glLinkProgram"), 2 * wires.of("glLinkProgram"));
}

TEST_F(GlCallsTest, AStillSceneSendsNoObjectAndOnlyAGlassPaneBlends) {
    const auto frame = [](const std::string& name) {
        auto scene = scene::Scene::create({.name = name});
        EXPECT_TRUE(scene.has_value());
        gl::CommandList list;
        Views v(64, 64, 2);
        const auto full = *foveation::create_method("full", {});
        EXPECT_TRUE(full->prepare(v.targets).has_value());
        scene->record(0, scene::stereo_views(), list);
        return calls_of([&] {
            scene->record(0.1, scene::stereo_views(), list);
            full->submit(list, v.targets, v.focus);
        });
    };
    const GlCalls still = frame("thin"), moving = frame("moving"), lantern = frame(FOVEA_SOURCE_DIR "/configs/scenes/lantern.gltf");
    EXPECT_EQ(still.of("glBufferSubData") + 1, moving.of("glBufferSubData")) << "the views; and the objects";
    EXPECT_EQ(still.of("glBlendFuncSeparate") + still.of("glActiveTexture") + moving.of("glBlendFuncSeparate"), 0u);
    EXPECT_EQ(lantern.of("glBlendFuncSeparate"), 2u) << "once an eye";
    EXPECT_GT(moving.of("glBindTexture"), 0u);
}

}  // namespace
