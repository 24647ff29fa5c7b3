#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/tools/command_runner.hpp"

namespace {

using testing::HasSubstr;

class TradeoffFoveation : public fovea::test::CommandTest {};

// One small run: what does not depend on the machine's speed.
TEST_F(TradeoffFoveation, JudgesEverySettingAgainstAFullRender) {
    const auto r = fovea("tradeoff foveation --scenes fragbox --methods scaled_bins inset_outset --size 128 --frames 1 --fovea-deg 0 --json --budget-ms 100000 --csv " +
                         file("t.csv") + " --html " + file("t.html") + " --toml " + file("q.toml"));
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto table = nlohmann::json::parse(r.out)[0];
    std::map<std::string, nlohmann::json> rows;
    for (const auto& row : table["rows"]) rows[row["method"]] = row;
    const auto of = [&](const char* label, const char* column) { return rows.at(label).at(column).get<double>(); };
    EXPECT_EQ(of("full", "error"), 0);
    EXPECT_EQ(of("full", "flicker"), 0);
    EXPECT_EQ(of("full", "PSNR out"), 99);
    EXPECT_EQ(of("full", "SSIM out"), 1);
    EXPECT_EQ(of("full", "fragments %"), 100);
    EXPECT_EQ(of("full", "cpu ratio"), 1);
    EXPECT_EQ(of("full", "pixels %"), 100);
    double fragments = 100, pixels = 100, error = 0;
    for (const char* label : {"scaled_bins, gain 1.5", "scaled_bins, gain 3", "scaled_bins, gain 10"}) {
        EXPECT_EQ(of(label, "exact %"), 100) << label;
        EXPECT_LT(of(label, "fragments %"), fragments) << label;
        EXPECT_GT(of(label, "error"), error) << label;
        EXPECT_LT(of(label, "PSNR out"), 45) << label;
        EXPECT_LT(of(label, "SSIM out"), 0.95) << label;
        EXPECT_GT(of(label, "flicker"), 0) << label;
        EXPECT_GT(of(label, "flicker smooth"), 0) << label;
        EXPECT_LT(of(label, "flicker smooth"), of(label, "flicker")) << label;
        EXPECT_LT(of(label, "pixels %"), pixels) << label;
        pixels = of(label, "pixels %");
        fragments = of(label, "fragments %");
        error = of(label, "error");
    }
    // A wide fovea leaves its errors to where the eye resolves little: beside the plain root mean square out there (0.63 of it over the
    // whole view) they count for less.
    const double weighted = of("scaled_bins, gain 1.5", "error") / (255 * std::pow(10, -of("scaled_bins, gain 1.5", "PSNR out") / 20));
    EXPECT_LT(weighted, 0.56);
    EXPECT_GT(weighted, 0.45);
    // Another way to the same picture, with what it shades beyond the masks.
    for (const char* gain : {"gain 4", "gain 10"}) {
        const std::string masks = std::string("scaled_bins, ") + gain, lists = std::string("scaled_bins by rectangle lists, ") + gain;
        for (const char* column : {"error", "PSNR out", "SSIM out", "exact %"}) EXPECT_EQ(of(lists.c_str(), column), of(masks.c_str(), column)) << lists << " " << column;
        EXPECT_GT(of(lists.c_str(), "fragments %"), of(masks.c_str(), "fragments %"));
    }
    EXPECT_LT(of("inset_outset, ratio 0.5", "fragments %"), 60);
    EXPECT_FALSE(rows.contains("shading_rate, radius 0.1"));
    EXPECT_THAT(r.err, HasSubstr("within 100000 ms, fragbox: full"));
    EXPECT_THAT(bytes(file("t.csv")), HasSubstr("\"foveation, scene fragbox\",\"scaled_bins, gain 10\","));
    const std::string html = bytes(file("t.html")), toml = bytes(file("q.toml"));
    for (const char* part : {"src='data:image/png;base64,iVBORw0KGgo", "prefers-color-scheme:dark", "Pareto frontier", "</html>"}) EXPECT_THAT(html, HasSubstr(part));
    EXPECT_EQ(html.find("http"), std::string::npos) << "self-contained";
    EXPECT_THAT(toml, HasSubstr("pick = \"full\""));
    EXPECT_THAT(toml, HasSubstr("method = \"scaled_bins\""));
}

TEST_F(TradeoffFoveation, SaysWhatCannotBe) {
    const auto nothing = fovea("tradeoff foveation --scenes fragbox --methods shading_rate --size 64 --frames 1 --budget-ms 0");
    EXPECT_EQ(nothing.exit_code, 1);
    EXPECT_THAT(nothing.err, HasSubstr("nothing takes 0 ms or less"));
    EXPECT_EQ(fovea("tradeoff foveation --scenes nowhere").exit_code, 2);
    EXPECT_EQ(fovea("tradeoff foveation --methods magic").exit_code, 2);
}

}  // namespace
