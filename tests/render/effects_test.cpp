// The planner alone: what calls for what, and what the settings become.
#include "render/effects/effects.hpp"

#include <gtest/gtest.h>

using namespace fovea;
using effects::Effect;

namespace {

// A scene with a bit of everything, heavy fragments, in a hurry.
effects::Needs everything() {
    effects::Needs n;
    n.triangles = 1000;
    n.thin_share = n.text_share = n.glossy_share = n.moving_share = 0.1;
    n.object_px = n.camera_px = 5;
    n.lens_radius = 1.1;
    n.vertex_ms = 1;
    n.full_ms = 100;
    n.foveated_ms = 25;
    return n;
}

TEST(EffectsPlanner, TableNamesEveryEffectOnceAndInOrder) {
    std::size_t i = 0;
    for (const auto& e : effects::effect_entries()) EXPECT_EQ(static_cast<std::size_t>(e.effect), i++) << e.name;
    EXPECT_EQ(i, effects::kEffects);
}

TEST(EffectsPlanner, AnEmptySceneCallsForNothingButFoveation) {
    const auto p = effects::plan({}, {.method = "inset_outset"});
    for (const auto& e : effects::effect_entries()) {
        EXPECT_EQ(p.on(e.effect), e.effect == Effect::foveation || e.effect == Effect::level_mask) << e.name;
        EXPECT_FALSE(p.decision(e.effect).reason.empty()) << e.name;
    }
    foveation::MethodSettings s;
    p.apply(s);
    EXPECT_EQ(s.inset_outset.samples, 0);
    EXPECT_EQ(s.inset_outset.contrast, 0);
    EXPECT_EQ(s.inset_outset.blend_px, 0);
    EXPECT_EQ(s.inset_outset.hidden_radius, 0);
    EXPECT_EQ(s.plan.reading, density::Reading::linear);
    EXPECT_FALSE(s.count_fragments);
}

TEST(EffectsPlanner, EveryEffectIsOnForASceneThatNeedsItAndReachesTheSettings) {
    effects::Declared headset;
    headset.lens = effects::Lens{.k1 = 0.22};
    const auto p = effects::plan(everything(), {.method = "inset_outset", .budget_ms = 11, .count_fragments = true}, headset);
    for (const auto& e : effects::effect_entries())
        EXPECT_EQ(p.on(e.effect), e.effect != Effect::finer_periphery) << e.name << ": " << p.decision(e.effect).reason;
    foveation::MethodSettings s;
    p.apply(s);
    EXPECT_EQ(s.inset_outset.samples, 4);
    EXPECT_GT(s.inset_outset.contrast, 0);
    EXPECT_GT(s.inset_outset.blend_px, 0);
    EXPECT_EQ(s.inset_outset.hidden_radius, 1.1);
    EXPECT_TRUE(s.inset_outset.masks);
    EXPECT_TRUE(s.count_fragments);
    foveation::MethodSettings bins;
    effects::plan(everything(), {}).apply(bins);
    EXPECT_EQ(bins.plan.reading, density::Reading::area);
}

TEST(EffectsPlanner, OneNeedSwitchesOneThing) {
    effects::Needs n;
    n.text_share = 0.3;
    const auto p = effects::plan(n, {.method = "inset_outset"});
    EXPECT_TRUE(p.on(Effect::contrast));
    EXPECT_TRUE(p.on(Effect::blend));
    EXPECT_FALSE(p.on(Effect::msaa)) << "print in a texture has no edges of geometry";
    n = {};
    n.glossy_share = 0.3;
    EXPECT_FALSE(effects::plan(n, {}).on(Effect::finer_periphery)) << "nothing crawls in a still picture";
    n.camera_px = 3;
    EXPECT_TRUE(effects::plan(n, {}).on(Effect::finer_periphery));
}

TEST(EffectsPlanner, AVertexBoundSceneIsToldSoAndDrawnInFull) {
    effects::Needs n = everything();
    n.vertex_ms = 80;
    n.foveated_ms = 150;
    const auto p = effects::plan(n, {});
    EXPECT_EQ(p.method(), "full");
    EXPECT_NE(p.decision(Effect::foveation).reason.find("foveation does not pay"), std::string::npos) << p.decision(Effect::foveation).reason;
    EXPECT_NE(p.decision(Effect::foveation).reason.find("vertices"), std::string::npos);
    EXPECT_FALSE(p.on(Effect::level_mask));
    EXPECT_FALSE(p.on(Effect::finer_periphery));
    n.foveated_ms = 0;   // predicted from what a frame is made of
    EXPECT_EQ(effects::plan(n, {}).method(), "full");
    n.vertex_ms = 2;
    EXPECT_EQ(effects::plan(n, {}).method(), "scaled_bins");
    effects::Needs counted;   // from the count of triangles alone
    counted.triangles = 2e6;
    EXPECT_EQ(effects::plan(counted, {.width_px = 512, .height_px = 512}).method(), "full");
    counted.triangles = 2e4;
    EXPECT_EQ(effects::plan(counted, {.width_px = 512, .height_px = 512}).method(), "auto") << "unmeasured: the frames decide";
}

TEST(EffectsPlanner, AMethodThatWasAskedForIsDrawn) {
    effects::Needs n = everything();
    n.foveated_ms = 150;
    EXPECT_EQ(effects::plan(n, {.method = "scaled_bins"}).method(), "scaled_bins");
    EXPECT_EQ(effects::plan(everything(), {.method = "full"}).method(), "full");
}

TEST(EffectsPlanner, ADeclarationWinsOverTheMeasurement) {
    effects::Declared d;
    d.origin = "room.toml";
    d.effects[static_cast<std::size_t>(Effect::msaa)] = false;
    d.effects[static_cast<std::size_t>(Effect::contrast)] = true;
    const auto p = effects::plan(everything(), {.method = "inset_outset"}, d);
    EXPECT_FALSE(p.on(Effect::msaa));
    EXPECT_EQ(p.decision(Effect::msaa).reason, "declared by room.toml");
    EXPECT_TRUE(p.on(Effect::contrast));
    EXPECT_FALSE(effects::plan(everything(), {.method = "full"}, d).on(Effect::contrast)) << "full has none, whatever is declared";
    effects::Declared numbers;
    numbers.needs[2] = 7;
    numbers.needs[3] = 0;   // thin_share
    const auto q = effects::plan(everything(), {.method = "inset_outset"}, numbers);
    EXPECT_FALSE(q.on(Effect::msaa));
    EXPECT_EQ(q.needs().triangle_px, 7);
}

TEST(EffectsPlanner, ExtrapolationWantsMotionAndAMissedBudget) {
    effects::Needs n;
    n.camera_px = 4;
    EXPECT_TRUE(effects::extrapolation_called_for(n, 20, 11));
    EXPECT_FALSE(effects::extrapolation_called_for(n, 10, 11));
    EXPECT_FALSE(effects::extrapolation_called_for(n, 20, 0));
    EXPECT_FALSE(effects::extrapolation_called_for(n, 0, 11));
    n.camera_px = 0.1;
    EXPECT_FALSE(effects::extrapolation_called_for(n, 20, 11));
    n.object_px = 4;
    EXPECT_FALSE(effects::extrapolation_called_for(n, 20, 11)) << "no object that moves";
    n.moving_share = 0.01;
    EXPECT_TRUE(effects::extrapolation_called_for(n, 20, 11));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(effects::extrapolation_called_for(n, nan, 11));
    EXPECT_FALSE(effects::extrapolation_called_for(n, 11, 11)) << "in time is in time";
    n.object_px = effects::kMoves_px;
    EXPECT_TRUE(effects::extrapolation_called_for(n, 20, 11)) << "the least that is seen to repeat";
    EXPECT_FALSE(effects::extrapolation_called_for(n, 20, 11, false)) << "its author does not want it";
    EXPECT_TRUE(effects::extrapolation_called_for({}, 5, 11, true)) << "its author wants it";
}

TEST(EffectsPlanner, ExtrapolationIsPlannedForTheFrameThatIsDrawn) {
    const auto planned = [](const char* method, double budget_ms, const effects::Needs& n) { return effects::plan(n, {.method = method, .budget_ms = budget_ms}).decision(Effect::extrapolation); };
    const effects::Needs n = everything();   // 100 ms in full, 25 ms foveated
    EXPECT_TRUE(planned("full", 30, n).on);
    EXPECT_FALSE(planned("scaled_bins", 30, n).on) << "foveated it is in time";
    EXPECT_TRUE(planned("scaled_bins", 20, n).on);
    EXPECT_NE(planned("scaled_bins", 20, n).reason.find("25.0 ms of a budget of 20.0 ms"), std::string::npos) << planned("scaled_bins", 20, n).reason;
    EXPECT_FALSE(planned("scaled_bins", 0, n).on);
    EXPECT_EQ(planned("scaled_bins", 0, n).reason, "no frame budget is set");
    effects::Needs still = n;
    still.camera_px = still.object_px = 0;
    EXPECT_FALSE(planned("full", 30, still).on) << "nothing moves";
}

}  // namespace
