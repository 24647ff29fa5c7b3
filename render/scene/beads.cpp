// A molecule's picture: balls that are cast in the boxes around them. Their fragments write their own depth, so no driver can
// reject them before they are shaded, except by the scissor.
#include <cmath>

#include "render/scene/generators.hpp"

namespace fovea::scene {

Mesh beads_mesh() {
    constexpr int kDraws = 160, kBalls = 10;
    constexpr float kTau = 6.28318530718f, kLength = 7.0f, kWide = 0.75f;
    MeshBuilder m;
    m.material(kSky);
    m.room({-60, -60, -60}, {60, 60, 60});
    m.end_chunk();
    Dice dice(23);
    for (int draw = 0; draw < kDraws; ++draw) {
        // Along x: two strands and the rungs between them, three turns.
        const float along = static_cast<float>(draw / 2) / (kDraws / 2), x = (along - 0.5f) * kLength, turn = 3 * kTau * along + (draw % 2 == 0 ? 0 : kTau / 2);
        m.material(kBall, static_cast<std::uint8_t>(40 * (draw % 2) + dice.below(30)));
        for (int i = 0; i < kBalls; ++i) {
            const float in = static_cast<float>(i) / kBalls, wide = kWide * (1 - in), wobble = dice.uniform(-0.02f, 0.02f);
            m.ball_box({x + wobble, 1.2f + wide * std::cos(turn), wide * std::sin(turn) + wobble}, i == 0 ? 0.13f : dice.uniform(0.045f, 0.075f));
        }
        m.end_chunk();
    }
    return m.take();
}

}  // namespace fovea::scene
