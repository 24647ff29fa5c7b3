#include "render/extrapolation/border_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fovea::render::extrapolation {

namespace {

constexpr int kDepth_px = 8, kAlong_px = 8;   // a place is judged by this far inwards, and to either side
constexpr float kSteepest = 3.0f;             // pixels along the border for each one outwards
constexpr float kFarthest_px = 32.0f;         // lines are not followed further than that
// Squared levels that count as no line, per row: what holds less contrast is continued straight.
constexpr float kNoise = 30.0f;

float luma(const std::uint8_t* p, bool floats) noexcept {
    if (!floats) return 0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2];
    float v[3];
    std::memcpy(v, p, sizeof v);
    const float light = 0.299f * v[0] + 0.587f * v[1] + 0.114f * v[2];
    // 0 to 255 for light of any range; what is no number is black, as everywhere.
    if (!(light > 0)) return 0;
    return light > 3e38f ? 255.0f : 255.0f * light / (light + 1.0f);
}

}  // namespace

void BorderLines::resize(int width_px, int height_px) {
    width_ = width_px;
    height_ = height_px;
    for (const Side side : {kLeft, kRight, kTop, kBottom}) shift_[side].assign(static_cast<std::size_t>(side < kTop ? height_px : width_px), 0.0f);
    const auto longer = static_cast<std::size_t>(std::max(width_px, height_px));
    luma_.assign((kDepth_px + 1) * longer, 0.0f);
    across_.assign(longer, 0.0f);
    along_ = across_;
}

void BorderLines::find(const Gatherable& source, bool floats) noexcept {
    for (const Side side : {kLeft, kRight, kTop, kBottom}) find_side(side, source, floats);
}

void BorderLines::find_side(Side side, const Gatherable& source, bool floats) noexcept {
    const bool upright = side == kLeft || side == kRight;
    const int length = upright ? height_ : width_, inwards = upright ? width_ : height_;
    std::vector<float>& shift = shift_[side];
    if (inwards <= kDepth_px || length < 3) {
        std::fill(shift.begin(), shift.end(), 0.0f);
        return;
    }
    const std::ptrdiff_t pixel = floats ? 16 : 4;
    for (int a = 0; a < length; ++a)
        for (int d = 0; d <= kDepth_px; ++d) {
            const int inside = side == kLeft || side == kTop ? d : inwards - 1 - d;
            const std::uint8_t* p = source.pixels + (upright ? a : inside) * source.row_bytes + pixel * (upright ? inside : a);
            luma_[static_cast<std::size_t>(d * length + a)] = luma(p, floats);
        }
    const auto at = [&](int d, int a) { return luma_[static_cast<std::size_t>(d * length + a)]; };
    for (int a = 0; a < length; ++a) {
        float both = 0, own = 0;
        for (int d = 0; d < kDepth_px; ++d) {
            const float inner = d == 0 ? at(1, a) - at(0, a) : 0.5f * (at(d + 1, a) - at(d - 1, a));
            const float side_on = 0.5f * (at(d, std::min(a + 1, length - 1)) - at(d, std::max(a - 1, 0)));
            both += inner * side_on;
            own += side_on * side_on;
        }
        across_[static_cast<std::size_t>(a)] = both;
        along_[static_cast<std::size_t>(a)] = own;
    }
    for (int a = 0; a < length; ++a) {
        float both = 0, own = kNoise * kDepth_px;
        for (int k = std::max(a - kAlong_px, 0); k <= std::min(a + kAlong_px, length - 1); ++k) {
            both += across_[static_cast<std::size_t>(k)];
            own += along_[static_cast<std::size_t>(k)];
        }
        shift[static_cast<std::size_t>(a)] = std::clamp(-both / own, -kSteepest, kSteepest);
    }
}

void BorderLines::follow(float x, float y, float& u, float& v) const noexcept {
    const float px = x + u, py = y + v, right = static_cast<float>(width_ - 1), bottom = static_cast<float>(height_ - 1);
    const float beyond_x = px < 0 ? -px : px - right, beyond_y = py < 0 ? -py : py - bottom;
    const auto place = [](float p, float last) { return static_cast<std::size_t>(std::clamp(p, 0.0f, last) + 0.5f); };
    if (beyond_x > 0 && !(beyond_y > 0))
        v += shift_[px < 0 ? kLeft : kRight][place(py, bottom)] * std::min(beyond_x, kFarthest_px);
    else if (beyond_y > 0 && !(beyond_x > 0))
        u += shift_[py < 0 ? kTop : kBottom][place(px, right)] * std::min(beyond_y, kFarthest_px);
}

}  // namespace fovea::render::extrapolation
