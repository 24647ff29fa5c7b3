// Print that procedural shaders make: found where there is some, not in stone or wood; and nothing of the search stays.
#include "render/effects/print.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/render/gl_calls.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::test;

namespace {

constexpr double kEnough = 0.02;   // of the picture: what the planner takes for print that counts

using Print = GlTest;

double share(const char* name) {
    std::vector<effects::Spot> spots;
    effects::Needs n = effects::look_at(*scene::load_source(name), {}, &spots);
    EXPECT_FALSE(spots.empty()) << name;
    n.text_share = 0;   // of textures: not asked here
    EXPECT_TRUE(effects::add_print(spots, n).has_value());
    return n.text_share;
}

TEST_F(Print, IsFoundOnTheCircuitAndNotInHallsOfMarbleAndWood) {
    EXPECT_GT(share("circuit"), 2 * kEnough);
    for (const char* hall : {"fragbox", "text"}) EXPECT_LT(share(hall), 0.25 * kEnough) << hall;
}

scene::Image tile_of(const scene::MaterialTile& tile) { return scene::draw_tiles(std::span(&tile, 1), 64)->at(0); }

TEST_F(Print, IsOnAPartsTopAndNotOnItsSides) {
    scene::MaterialTile part{.material = scene::kEpoxy, .variant = 3, .normal = {0, 1, 0}, .middle = {0.7f, 0.5f}, .edge = 0.6f};
    const double stroke = effects::print_texels(tile_of(part));
    constexpr double kPoint = 64 / 0.6 / (13 * 4);   // of a letter, texels
    EXPECT_GT(stroke, 0.9 * kPoint);
    EXPECT_LT(stroke, 4 * kPoint);
    part.normal = {1, 0, 0};
    EXPECT_EQ(effects::print_texels(tile_of(part)), 0);
}

TEST_F(Print, TilesAreInTheOrderAskedForWhateverTheirProgram) {
    std::vector<scene::MaterialTile> tiles;
    for (int i = 0; i < 40; ++i)
        tiles.push_back({.material = i % 3 == 0 ? scene::kWood : i % 3 == 1 ? scene::kAnodised : scene::kBoard, .middle = {0.1f * static_cast<float>(i), 0.3f}, .edge = 0.2f});
    const auto all = scene::draw_tiles(tiles, 512);   // 16 on a sheet: three sheets
    ASSERT_TRUE(all.has_value());
    ASSERT_EQ(all->size(), tiles.size());
    for (const std::size_t i : {0u, 1u, 5u, 16u, 31u, 39u}) {
        const auto alone = scene::draw_tiles(std::span(&tiles[i], 1), 512)->at(0).rgba;
        double difference = 0;   // of rounding: uv is interpolated at another place on the sheet
        for (std::size_t k = 0; k < alone.size(); ++k) difference += std::abs((*all)[i].rgba[k] - alone[k]);
        EXPECT_LT(difference / static_cast<double>(alone.size()), 0.25) << i;
    }
}

TEST_F(Print, LeavesNothingBehindAndAsksNothingWithoutSpots) {
    std::vector<effects::Spot> spots;
    effects::Needs n = effects::look_at(*scene::load_source("circuit"), {}, &spots);
    const GlCalls c = calls_of([&] { EXPECT_TRUE(effects::add_print(spots, n).has_value()); });
    EXPECT_GT(c.of("glCreateProgram"), 0u);
    EXPECT_EQ(c.of("glCreateProgram"), c.of("glDeleteProgram"));
    EXPECT_EQ(c.of("glCreateShader"), c.of("glDeleteShader"));
    for (const char* kind : {"Buffers", "Textures", "Framebuffers", "Renderbuffers", "VertexArrays"})
        EXPECT_EQ(c.of(std::string("glGen") + kind), c.of(std::string("glDelete") + kind)) << kind;
    const GlCalls none = calls_of([&] { EXPECT_TRUE(effects::add_print({}, n).has_value()); });
    EXPECT_TRUE(none.by_name.empty());
}

}  // namespace
