// Any two pictures, any factor, any hint: a frame comes out, of the sources' own light, and nothing else is written.
//
// Input: size, format, preset and which hints; factor; gaze; motion and light of the pictures; then rectangles of any bits
// (which picture, place, size, four bytes) until the input ends.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "render/extrapolation/extrapolation.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/render/extrapolation_pictures.hpp"

namespace {

using namespace fovea::render::extrapolation;
using fovea::test::Picture;

constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

// A value of the table, or the next four bytes as they are.
template <std::size_t N>
float number(fovea::fuzz::Input& in, const std::array<float, N>& table) {
    const auto which = in.take<std::uint8_t>();
    return which < 0xE0 ? table[which % N] : in.take<float>();
}

float channel(const Picture& p, int x, int y, int c) {
    const std::byte* at = p.at(x, y) + c * bytes_per_channel(p.format);
    if (bytes_per_channel(p.format) == 1) return static_cast<float>(std::to_integer<int>(*at));
    if (bytes_per_channel(p.format) == 4) {
        float v;
        std::memcpy(&v, at, 4);
        return v;
    }
    std::uint16_t h;
    std::memcpy(&h, at, 2);
    const float sign = (h & 0x8000) != 0 ? -1.0f : 1.0f;
    const int exponent = h >> 10 & 31, mantissa = h & 1023;
    if (exponent == 31) return mantissa != 0 ? kNan : sign * kInf;
    return sign * std::ldexp(static_cast<float>(exponent == 0 ? mantissa : mantissa + 1024), (exponent == 0 ? 1 : exponent) - 25);
}

void fill(Picture& p, fovea::fuzz::Input& in) {
    const int x0 = in.take<std::uint8_t>() % p.width, y0 = in.take<std::uint8_t>() % p.height;
    const int x1 = std::min(x0 + 1 + in.take<std::uint8_t>() % 24, p.width), y1 = std::min(y0 + 1 + in.take<std::uint8_t>() % 24, p.height);
    const auto bits = in.take<std::array<std::uint8_t, 4>>();
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x)
            for (int k = 0; k < bytes_per_pixel(p.format); ++k) p.at(x, y)[k] = std::byte{bits[static_cast<std::size_t>(k % 4)]};
}

Extrapolator engine(Preset preset, int threads, bool vector_code) {
    auto made = Extrapolator::create({.preset = preset, .threads = threads, .vector_code = vector_code});
    FOVEA_FUZZ_CHECK(made.has_value());
    return std::move(*made);
}

// Every pixel is the sources' light, and what is no number is where the source that was moved has it.
void check_light(const Picture& src1, const Picture& src2, const Picture& out, bool first) {
    const Picture& near = first ? src1 : src2;
    for (int c = 0; c < channel_count(out.format); ++c) {
        float low = kInf, high = -kInf;
        for (const Picture* p : {&src1, &src2})
            for (int y = 0; y < p->height; ++y)
                for (int x = 0; x < p->width; ++x) {
                    const float v = channel(*p, x, y, c);
                    if (!std::isfinite(v)) continue;
                    low = std::min(low, v);
                    high = std::max(high, v);
                }
        for (int y = 0; y < out.height; ++y)
            for (int x = 0; x < out.width; ++x) {
                const float is = channel(out, x, y, c), was = channel(near, x, y, c);
                FOVEA_FUZZ_CHECK(std::isfinite(is) == std::isfinite(was));
                FOVEA_FUZZ_CHECK(!is_float(out.format) || !std::isfinite(is) || (is >= low && is <= high));   // 8 bits may ring
                if (!std::isfinite(was)) FOVEA_FUZZ_CHECK(std::memcmp(out.at(x, y), near.at(x, y), static_cast<std::size_t>(bytes_per_pixel(out.format))) == 0);
            }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fovea::fuzz::Input in(data, size);
    const int w = 1 + in.take<std::uint8_t>() % 70, h = 1 + in.take<std::uint8_t>() % 70;
    const auto format = static_cast<Format>(in.take<std::uint8_t>() % kFormatCount);
    const auto flags = in.take<std::uint8_t>();
    const Preset preset = kPresets[flags & 3];
    const float factor = number(in, std::array{0.5f, 1.0f, -0.25f, -0.5f, -0.75f, -1.0f, -2.0f, 3.0f, 12.0f, 1e-30f, -1e30f, 1e30f, kNan, kInf, -kInf, 0.0f});
    constexpr std::array kPlaces{0.0f, 20.0f, 35.0f, -4.0f, 69.0f, 1e9f, -1e30f, kNan, kInf, -kInf};
    constexpr std::array kRadii{0.0f, 3.0f, 8.0f, 20.0f, 100.0f, 1e30f, kInf, kNan, -1.0f};
    Gaze gaze;
    gaze.x_px = number(in, kPlaces);
    gaze.y_px = number(in, kPlaces);
    gaze.full_radius_px = number(in, kRadii);
    gaze.coarse_radius_px = number(in, kRadii);

    const int slack = 3 * bytes_per_channel(format);
    const float dx = in.take<std::int8_t>() / 8.0f, dy = in.take<std::int8_t>() / 8.0f;
    constexpr std::array kLights{1.0f, 255.0f, 60000.0f, 1e-6f, 1e-39f, 1e30f, 3e38f, -5.0f};
    const float light = is_float(format) ? kLights[in.take<std::uint8_t>() % kLights.size()] : 1.0f;
    Picture src1 = fovea::test::moved_noise(w, h, format, 0, 0, 1, slack), src2 = fovea::test::moved_noise(w, h, format, dx, dy, 1, slack);
    if (bytes_per_channel(format) == 4 || light == 60000.0f)
        for (Picture* p : {&src1, &src2})
            for (int y = 0; y < h; ++y)
                for (int x = 0; x < w; ++x) {
                    std::array<float, 4> v{};
                    for (int c = 0; c < channel_count(format); ++c) v[static_cast<std::size_t>(c)] = light * channel(*p, x, y, c);
                    p->set(x, y, v);
                }

    std::vector<float> motion, ahead, depth;
    KnownMotion known;
    if ((flags & 8) != 0) {
        const int cell = 1 << in.take<std::uint8_t>() % 4;
        known.width = (w + cell - 1) / cell;
        known.height = (h + cell - 1) / cell;
        const auto cells = static_cast<std::size_t>(known.width) * static_cast<std::size_t>(known.height);
        motion.resize(2 * cells);
        depth.resize(cells);
        for (std::size_t i = 0; i < cells; ++i) {
            motion[2 * i] = dx;
            motion[2 * i + 1] = dy;
            depth[i] = static_cast<float>(1 + (i / 5 + i / static_cast<std::size_t>(7 * known.width)) % 3);
        }
        for (int n = in.take<std::uint8_t>() % 16; n > 0; --n) {
            const std::size_t i = in.take<std::uint16_t>() % cells;
            motion[2 * i] = number(in, std::array{0.0f, 3.0f, -7.5f, 1e9f, -1e38f, kNan, kInf});
            motion[2 * i + 1] = number(in, std::array{0.0f, -2.0f, 5.25f, -1e9f, kNan, -kInf});
            depth[i] = number(in, std::array{0.0f, 1.0f, 5.0f, -3e38f, kNan, kInf, -kInf});
        }
        ahead = motion;
        std::reverse(ahead.begin(), ahead.end());
        if ((flags & 16) != 0) known.depth = depth.data();
        if ((flags & 32) != 0) known.ahead_px = ahead.data();
        if ((flags & 32) == 0 || (flags & 64) == 0) known.motion_px = motion.data();
    }
    while (!in.rest().empty()) fill((in.take<std::uint8_t>() & 1) != 0 ? src2 : src1, in);

    const Hints hints{known.width > 0 ? &known : nullptr, (flags & 4) != 0 ? &gaze : nullptr};
    const Picture was1 = src1, was2 = src2, blank(w, h, format, slack);
    Picture out = blank, again = blank;
    static std::array<std::optional<Extrapolator>, std::size(kPresets)> used;   // of all inputs so far
    auto& steady = used[static_cast<std::size_t>(preset)];
    if (!steady) steady = engine(preset, 2, true);
    const Outcome outcome = steady->extrapolate(src1.view(), src2.view(), out.target(), factor, hints);
    FOVEA_FUZZ_CHECK(outcome == (factor == 0 ? Outcome::factor_is_zero : Outcome::ok));
    FOVEA_FUZZ_CHECK(src1 == was1 && src2 == was2);
    if (outcome != Outcome::ok) {
        FOVEA_FUZZ_CHECK(out == blank);
        return 0;
    }
    for (int y = 0; y < h; ++y) FOVEA_FUZZ_CHECK(std::all_of(out.at(w, y), out.at(w, y) + slack, [](std::byte b) { return b == Picture::kSlack; }));
    const bool first = factor == -1 || factor == -kInf || (hints.motion == nullptr && factor < -0.5f);
    check_light(src1, src2, out, first);
    if (src1 == src2) FOVEA_FUZZ_CHECK(std::memcmp(out.bytes.data(), src2.bytes.data(), out.bytes.size()) == 0);
    // Neither what came before, nor the number of threads, nor the width of vectors changes a bit.
    Extrapolator fresh = engine(preset, 1, (flags & 128) != 0);
    FOVEA_FUZZ_CHECK(fresh.extrapolate(src1.view(), src2.view(), again.target(), factor, hints) == Outcome::ok);
    FOVEA_FUZZ_CHECK(again == out);
    return 0;
}
