// `fovea scene`: what a user is told about a scene, and about one that cannot be used.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/tools/command_runner.hpp"

namespace {

using testing::HasSubstr;

class SceneCommand : public fovea::test::CommandTest {
protected:
    [[nodiscard]] nlohmann::json explained(const std::string& arguments) const {
        const auto r = fovea("scene explain --json " + arguments);
        EXPECT_EQ(r.exit_code, 0) << r.err;
        return nlohmann::json::parse(r.out, nullptr, false);
    }
    [[nodiscard]] static nlohmann::json effect(const nlohmann::json& all, const std::string& name) {
        for (const auto& e : all["effects"])
            if (e["name"] == name) return e;
        return {};
    }
};

TEST_F(SceneCommand, ListsEveryScene) {
    const auto r = fovea("scene list");
    EXPECT_EQ(r.exit_code, 0);
    for (const char* name : {"circuit", "fragbox", "vert", "text", "thin", "specular", "moving", "beads"}) EXPECT_THAT(r.out, HasSubstr(name));
    EXPECT_EQ(nlohmann::json::parse(fovea("scene list --json").out).size(), 9u);
}

TEST_F(SceneCommand, ExplainsEachEffectWithItsReasonAndCost) {
    const auto all = explained("thin --method inset_outset --size 96 --repeat 1");
    ASSERT_EQ(all["effects"].size(), 11u);
    for (const auto& e : all["effects"]) EXPECT_NE(e["reason"], "") << e;
    EXPECT_EQ(effect(all, "msaa")["on"], true);
    EXPECT_THAT(effect(all, "msaa")["reason"].get<std::string>(), HasSubstr("thin geometry"));
    for (const char* measured : {"foveation", "level_mask", "blend", "contrast", "msaa", "hidden_area", "lens_distortion", "temporal_smoothing", "extrapolation", "fragment_counter"}) {
        EXPECT_GT(effect(all, measured)["cost"]["with_ms"].get<double>(), 0) << measured;
        EXPECT_GT(effect(all, measured)["cost"]["without_ms"].get<double>(), 0) << measured;
    }
    EXPECT_GT(all["needs"]["full_ms"].get<double>(), 0);
    const auto r = fovea("scene explain thin --no-cost");
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_THAT(r.out, HasSubstr("finer_periphery"));
}

TEST_F(SceneCommand, TellsAVertexBoundSceneThatFoveationDoesNotPay) {
    const auto all = explained("vert --size 128 --repeat 1");
    EXPECT_EQ(all["method"], "full");
    EXPECT_EQ(effect(all, "foveation")["on"], false);
    EXPECT_THAT(effect(all, "foveation")["reason"].get<std::string>(), HasSubstr("bound by its vertices: foveation does not pay"));
}

TEST_F(SceneCommand, ReadsDeclarations) {
    const std::string folder = FOVEA_SOURCE_DIR "/configs/scenes/";
    const auto gltf = explained(folder + "lantern.gltf --method inset_outset --no-cost");
    EXPECT_EQ(effect(gltf, "msaa")["on"], true);
    EXPECT_EQ(effect(gltf, "hidden_area")["on"], true);
    const auto toml = explained(folder + "lantern.toml --method inset_outset --no-cost");
    EXPECT_EQ(effect(toml, "msaa")["on"], false);
    EXPECT_THAT(effect(toml, "msaa")["reason"].get<std::string>(), HasSubstr("lantern.toml"));
    EXPECT_EQ(effect(toml, "hidden_area")["on"], false);
}

TEST_F(SceneCommand, SaysWhatIsWrongWithAScene) {
    EXPECT_EQ(fovea("scene explain nowhere").exit_code, 2);
    EXPECT_EQ(fovea("scene explain circuit --size 3").exit_code, 2);
    std::ofstream(file("a.gltf")) << R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]})";
    const auto r = fovea("scene explain " + file("a.gltf"));
    EXPECT_EQ(r.exit_code, 3);
    EXPECT_THAT(r.err, HasSubstr("a.gltf: needs the extension KHR_draco_mesh_compression (export without mesh compression"));
}

}  // namespace
