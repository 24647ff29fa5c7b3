// What misled the search on scenes that nothing was tuned on, in small.
#include <algorithm>
#include <functional>

#include "tests/render/extrapolation_engine.hpp"

namespace fovea::test {
namespace {

using render::extrapolation::kPresets;
using render::extrapolation::Preset;
using render::extrapolation::preset_name;

// A grey picture of `at` (0 to 1), four by four points per pixel.
Picture drawn(int size, const std::function<float(float x, float y)>& at) {
    Picture p(size, size, Format::rgba8);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            float sum = 0;
            for (int k = 0; k < 16; ++k) sum += at(static_cast<float>(x) + 0.125f + 0.25f * static_cast<float>(k % 4), static_cast<float>(y) + 0.125f + 0.25f * static_cast<float>(k / 4));
            p.set(x, y, {sum / 16, 0.6f * sum / 16, 0.5f * sum / 16, 1.0f});
        }
    return p;
}

// Even bricks of 64x32 pixels behind mortar of 5, which turns about the middle and moves on.
Picture wall(int size, float time) {
    const float middle = 0.5f * static_cast<float>(size);
    return drawn(size, [&](float px, float py) {
        // Seen at a slant: what is to the right is further away.
        const float x = px - middle, y = py - middle, away = 1 / (1 - 0.0004f * x);
        const float u = x * away - 0.1f * y - 4.3f * time, v = (y + 0.12f * x) * away + 1.4f * time;
        const float row = std::floor(v / 58), along = u + (static_cast<int>(row) % 2 == 0 ? 0.0f : 55.0f);
        return v - 58 * row < 7 || along - 110 * std::floor(along / 110) < 7 ? 0.8f : 0.25f;
    });
}

// Along a line of mortar every place looks the same but for what reading between pixels makes of it: neither that, nor another
// brick's corner, is a reason to give up what is known from the coarser level.
TEST(ExtrapolationSearch, WallOfEvenBricksMovesAsOne) {
    const Picture a = wall(768, 0), b = wall(768, 1), truth = wall(768, 1.5f);
    for (const Preset preset : kPresets) {
        auto e = engine(preset);
        Picture out(768, 768, Format::rgba8);
        ASSERT_EQ(run(e, a, b, out, 0.5f), render::extrapolation::Outcome::ok);
        EXPECT_GT(psnr(out, truth, 16), 38.2) << preset_name(preset);
    }
}

// Stripes of five pixels are mixed at the cells of four where blocks are judged, and a match seems to leave as much as there is.
TEST(ExtrapolationSearch, FineStripesThatMoveRightlyAreNotHeldBack) {
    const auto stripes = [](float time) {
        return drawn(256, [&](float px, float py) {
            const float x = px - 6 * time;
            const bool fine = x > 64 && x < 160 && std::fmod(py, 48) > 6;
            return fine ? 0.5f + 0.25f * std::sin(x * 1.309f) : 0.25f + 0.5f * noise(x, py, 6);
        });
    };
    const Picture a = stripes(0), b = stripes(1), truth = stripes(1.5f);
    for (const Preset preset : kPresets) {
        auto e = engine(preset);
        Picture out(256, 256, Format::rgba8);
        ASSERT_EQ(run(e, a, b, out, 0.5f), render::extrapolation::Outcome::ok);
        EXPECT_GT(psnr(out, truth, 16), 40) << preset_name(preset);
    }
}

}  // namespace
}  // namespace fovea::test
