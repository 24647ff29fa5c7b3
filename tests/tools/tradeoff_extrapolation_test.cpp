#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <nlohmann/json.hpp>

#include "tests/tools/command_runner.hpp"
#include "tools/extrapolation_scenes.hpp"
#include "tools/extrapolation_targets.hpp"
#include "tools/image_quality.hpp"

namespace {

using fovea::test::CommandTest;

class TradeoffExtrapolation : public CommandTest {};

TEST_F(TradeoffExtrapolation, PresetsBeatRepeatingAndNeverLoseToIt) {
    const auto r = fovea("tradeoff extrapolation --size 192 --scene rotation cut --repeat 1 --json --csv " + file("t.csv") + " --html " + file("t.html"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto all = nlohmann::json::parse(r.out);
    std::map<std::string, std::map<std::string, double>> psnr, ssim;
    for (const auto& m : all["methods"])
        for (const auto& c : m["cases"]) {
            psnr[m["method"]][c["scene"]] = c["psnr_db"];
            ssim[m["method"]][c["scene"]] = c["ssim"];
        }
    EXPECT_LT(ssim["hold"]["rotation"], 0.99);
    for (const char* preset : {"draft", "fast", "balanced", "best", "known-motion"}) {
        EXPECT_GT(psnr[preset]["rotation"], psnr["hold"]["rotation"] + 3) << preset;
        EXPECT_GE(psnr[preset]["cut"], psnr["hold"]["cut"]) << preset;
        EXPECT_GT(ssim[preset]["rotation"], ssim["hold"]["rotation"]) << preset;
        EXPECT_GE(ssim[preset]["cut"], ssim["hold"]["cut"]) << preset;
    }
    EXPECT_NEAR(psnr["known-ahead"]["rotation"], psnr["known-motion"]["rotation"], 0.3) << "one frame's motion tells how a turn bends paths";
    if (!psnr.contains("gl processor")) GTEST_LOG_(INFO) << "no OpenGL ES driver: no rows of it";
    for (const char* backend : {"gl processor", "gl compute", "gl fragment"})
        if (psnr.contains(backend)) {
            EXPECT_GT(psnr[backend]["rotation"], psnr["hold"]["rotation"] + 3) << backend;
        }
    if (psnr.contains("gl processor")) {
        EXPECT_EQ(psnr["gl processor"]["rotation"], psnr["balanced"]["rotation"]) << "the same engine";
    }
    EXPECT_EQ(psnr["balanced"]["cut"], psnr["hold"]["cut"]) << "a cut repeats the last frame";
    EXPECT_GT(psnr["reprojection"]["rotation"], psnr["hold"]["rotation"] + 3);
    // All that the presets are judged by, in one run.
    std::set<std::string> baselines;
    for (const auto& m : all["methods"])
        if (m["baseline"]) baselines.insert(m["method"]);
    EXPECT_EQ(baselines, (std::set<std::string>{"hold", "reprojection", "dis-ultrafast", "dis-fast", "dis-medium", "farneback"}));
    // On the frontier is what nothing else beats, or equals, in both; ties are all on it.
    for (const auto& m : all["methods"]) {
        const double ms = m["processor_ms"], db = m["psnr_db"];
        const bool beaten = std::any_of(all["methods"].begin(), all["methods"].end(), [&](const nlohmann::json& other) {
            const double other_ms = other["processor_ms"], other_db = other["psnr_db"];
            return other_ms <= ms && other_db >= db && (other_ms < ms || other_db > db);
        });
        EXPECT_EQ(m["frontier"].get<bool>(), !beaten) << m["method"];
    }
    const auto count = [](const std::string& text, const char* part) {
        std::size_t n = 0;
        for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
        return n;
    };
    const std::string csv = bytes(file("t.csv")), html = bytes(file("t.html"));
    const std::size_t methods = all["methods"].size();
    EXPECT_NE(csv.find("\nbalanced,0,"), std::string::npos);
    EXPECT_EQ(count(csv, "\n"), 1 + 2 * methods);
    EXPECT_EQ(count(html, "<figure><img alt='rotation"), methods + 1) << "a crop of each, and of the truth";
    EXPECT_EQ(count(html, "src='data:image/png;base64,iVBORw0KGgo"), 2 * (methods + 1));
    EXPECT_EQ(count(html, "<circle "), methods);
    EXPECT_EQ(count(html, "<tr class='frontier'>"), static_cast<std::size_t>(std::count_if(all["methods"].begin(), all["methods"].end(), [](const auto& m) { return m["frontier"].template get<bool>(); })));
    EXPECT_EQ(count(html, "<polyline "), 1u);
    EXPECT_NE(html.find("</html>"), std::string::npos);
}

TEST_F(TradeoffExtrapolation, HasASceneOfEveryKind) {
    std::set<std::string> names;
    for (const auto& s : fovea::tools::extrapolation_scenes()) names.insert(s.name);
    EXPECT_EQ(names, (std::set<std::string>{"rotation", "translation", "object", "occlusion", "thin", "specular", "repetitive", "flicker", "cut"}));
}

TEST_F(TradeoffExtrapolation, AnImpossibleBudgetOrSceneIsSaidSo) {
    const auto nothing = fovea("tradeoff extrapolation --size 32 --scene cut --repeat 1 --budget-ms 0");
    EXPECT_EQ(nothing.exit_code, 1);
    EXPECT_NE(nothing.err.find("no preset takes 0 ms or less"), std::string::npos);
    EXPECT_NE(nothing.out.find("\n* "), std::string::npos) << "the table, and who is on the frontier\n" << nothing.out;
    EXPECT_NE(nothing.out.find("target "), std::string::npos);
    EXPECT_EQ(fovea("tradeoff extrapolation --size 32 --scene cut --factor 0").exit_code, 2) << "no time ahead";
    EXPECT_EQ(fovea("tradeoff extrapolation --scene nowhere").exit_code, 2);
}

TEST_F(TradeoffExtrapolation, ASeedIsACaseOfItsOwnAndTargetsNameTheWorst) {
    const auto r = fovea("tradeoff extrapolation --size 64 --scene object --seed 0 4 --repeat 1 --json --csv " + file("t.csv"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto all = nlohmann::json::parse(r.out);
    for (const auto& m : all["methods"]) {
        ASSERT_EQ(m["cases"].size(), 2u);
        EXPECT_EQ(m["cases"][0]["seed"], 0);
        EXPECT_EQ(m["cases"][1]["seed"], 4);
    }
    EXPECT_NE(all["methods"][0]["cases"][0]["psnr_db"], all["methods"][0]["cases"][1]["psnr_db"]) << "another picture";
    std::map<std::string, nlohmann::json> targets;
    for (const auto& t : all["targets"]) targets[t["target"]] = t;
    EXPECT_EQ(targets.at("balanced above hold, speeds to 1")["cases"], 2);
    EXPECT_EQ(targets.at("known-motion above dis-medium, mean")["limit"], 3);
    EXPECT_NE(bytes(file("t.csv")).find("\nbalanced,0,0,object,1,4,"), std::string::npos) << bytes(file("t.csv"));
}

using fovea::tools::ExtrapolationScore;

TEST(ExtrapolationTargets, MedianWorstAndMissedAreThoseOfTheCasesThatCount) {
    const std::vector<fovea::tools::ExtrapolationCase> cases = {{"rotation", 1, 0}, {"object", 1, 0}, {"object", 2, 0}, {"cut", 1, 0}, {"thin", 0.5, 7}};
    const std::vector<ExtrapolationScore> hold = {{20, 0, 1}, {25, 0, 1}, {20, 0, 1}, {20, 0, 1}, {30, 0, 1}};
    const std::vector<ExtrapolationScore> balanced = {{30, 0, 20}, {31, 0, 12}, {26, 0, 10}, {20, 0, 10}, {38, 0, 9}};
    const std::vector<ExtrapolationScore> gaze = {{29, 0, 9}, {28, 0, 3}, {25, 0, 4}, {20, 0, 9}, {36, 0, 9}};
    const std::vector<ExtrapolationScore> dis_fast = {{29, 0, 20}, {31, 0, 24}, {25, 0, 10}, {17, 0, 10}, {39, 0, 6}};
    std::map<std::string, fovea::tools::TargetLine> lines;
    for (auto& l : fovea::tools::extrapolation_targets({{"hold", &hold}, {"balanced", &balanced}, {"balanced+gaze", &gaze}, {"dis-fast", &dis_fast}}, cases)) lines[l.target] = l;
    const auto& above = lines.at("balanced above hold, speeds to 1");   // 10, 6, 8: neither speed 2 nor the cut
    EXPECT_EQ(above.cases, 3);
    EXPECT_EQ(above.median, 8);
    EXPECT_EQ(above.worst, 6);
    EXPECT_EQ(above.worst_case, "object/1");
    EXPECT_EQ(above.missed, 1);
    EXPECT_EQ(lines.at("balanced above hold, always").worst, 0);
    EXPECT_EQ(lines.at("balanced above hold, always").missed, 0);
    const auto& time = lines.at("balanced, time of dis-fast");   // 32 / 44 at speed 1, 1 at speed 2, 1.5 of the other seed
    EXPECT_EQ(time.cases, 3);
    EXPECT_EQ(time.worst, 1.5);
    EXPECT_EQ(time.worst_case, "mean/0.5#7");
    EXPECT_EQ(time.missed, 1);
    const auto& foveated = lines.at("balanced+gaze, time of balanced, same frame");
    EXPECT_NEAR(foveated.median, 0.325, 1e-12);
    EXPECT_EQ(foveated.worst_case, "object/2");
    EXPECT_FALSE(lines.contains("fast above dis-ultrafast")) << "not measured";
}

TEST(ExtrapolationScenes, AVariantIsTheSameKindOfSceneAndAlwaysTheSame) {
    const fovea::tools::ExtrapolationScene keeps_textures("cut", 1, 3), keeps_others("cut", 1, 4);
    for (const auto& row : fovea::tools::extrapolation_scenes()) {
        const fovea::tools::ExtrapolationScene first(row.name, 1, 3), again(row.name, 1, 3), other(row.name, 1, 4);
        const auto a = first.render(1, 48, true), b = again.render(1, 48, true), c = other.render(1, 48, true);
        EXPECT_EQ(a.rgba, b.rgba) << row.name;
        EXPECT_EQ(a.motion_px, b.motion_px) << row.name;
        EXPECT_NE(a.rgba, c.rgba) << row.name;
        EXPECT_NE(a.motion_px, c.motion_px) << row.name;
        float most = 0;
        for (const float m : a.motion_px) most = std::max(most, std::fabs(m));
        EXPECT_GT(most * 1024 / 48, 1.5) << row.name << ": something moves";
    }
}

std::vector<std::uint8_t> even(int value, int count) {
    std::vector<std::uint8_t> p(static_cast<std::size_t>(4 * count), static_cast<std::uint8_t>(value));
    return p;
}

TEST(ImageQuality, PsnrFollowsItsDefinition) {
    EXPECT_EQ(fovea::tools::psnr_db(even(7, 100), even(7, 100)), fovea::tools::kSamePicturePsnr_db);
    EXPECT_NEAR(fovea::tools::psnr_db(even(100, 64), even(110, 64)), 20 * std::log10(25.5), 1e-9);
}

TEST(ImageQuality, SsimOfEvenPicturesIsItsLuminanceTerm) {
    constexpr double kC1 = 0.01 * 255 * 0.01 * 255;
    EXPECT_NEAR(fovea::tools::ssim(even(100, 400), even(100, 400), 20, 20), 1, 1e-12);
    EXPECT_NEAR(fovea::tools::ssim(even(100, 400), even(50, 400), 20, 20), (2 * 100 * 50 + kC1) / (100 * 100 + 50 * 50 + kC1), 2e-5);   // single precision
    std::vector<std::uint8_t> stripes = even(0, 400), inverse = stripes;
    for (std::size_t i = 0; i < 400; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            stripes[4 * i + c] = i % 2 == 0 ? 200 : 50;
            inverse[4 * i + c] = i % 2 == 0 ? 50 : 200;
        }
    EXPECT_LT(fovea::tools::ssim(stripes, inverse, 20, 20), -0.8);
    EXPECT_NEAR(fovea::tools::ssim(stripes, stripes, 20, 20), 1, 1e-12);
    EXPECT_NEAR(fovea::tools::ssim(even(9, 1), even(9, 1), 1, 1), 1, 1e-12);
}

TEST(ImageQuality, AMaskLeavesOutWhatItDoesNotName) {
    std::vector<std::uint8_t> a = even(100, 400), b = a, mask(400, 255);
    for (std::size_t i = 0; i < 200; ++i) b[4 * i] = 130;   // the red of the upper half
    using fovea::tools::similarity;
    EXPECT_NEAR(similarity(a, b, 20, 20, mask).psnr_db, 10 * std::log10(255.0 * 255 / (30.0 * 30 / 6)), 1e-4);
    for (std::size_t i = 0; i < 200; ++i) mask[i] = 0;
    EXPECT_EQ(similarity(a, b, 20, 20, mask).psnr_db, fovea::tools::kSamePicturePsnr_db);
    for (std::size_t i = 0; i < 310; ++i) mask[i] = 0;      // SSIM looks five rows around
    EXPECT_NEAR(similarity(a, b, 20, 20, mask).ssim, 1, 1e-6);
    EXPECT_EQ(similarity(a, b, 20, 20, std::vector<std::uint8_t>(400)).ssim, 1) << "nothing to compare";
}

}  // namespace
