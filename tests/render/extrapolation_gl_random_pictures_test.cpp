// Pictures of any size and content through every backend: what is no number stays at its pixel, and every other pixel is of the
// sources' own light. FOVEA_ROUNDS: more of them than the usual few.
#include <cstdlib>
#include <limits>
#include <random>

#include "tests/render/extrapolation_gl.hpp"

namespace fovea::test {

class ExtrapolationGlRandomPictures : public ExtrapolationGl {
protected:
    static float channel(const Picture& p, int x, int y, int c) {
        float v;
        std::memcpy(&v, p.at(x, y) + 4 * c, 4);
        return v;
    }
    // Noise of a light, and rectangles of odd numbers in it.
    static Picture picture(int w, int h, Format format, float dx, float dy, float light, std::minstd_rand& random) {
        Picture p = moved_noise(w, h, format, dx, dy);
        const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
        if (bytes_per_channel(format) == 4)
            for (int y = 0; y < h; ++y)
                for (int x = 0; x < w; ++x) {
                    float v[4] = {};
                    std::memcpy(v, p.at(x, y), static_cast<std::size_t>(bytes_per_pixel(format)));
                    for (float& f : v) f *= light;
                    std::memcpy(p.at(x, y), v, static_cast<std::size_t>(bytes_per_pixel(format)));
                }
        constexpr std::uint32_t kWords[] = {0x7fc00000u, 0x7f800000u, 0xff800000u, 0x7f7fffffu, 0xff7fffffu, 1u, 0x80000000u, 0x3f800000u, 0xc7000000u};
        constexpr std::uint16_t kHalves[] = {0x7e00u, 0x7c00u, 0xfc00u, 0x7bffu, 0xfbffu, 1u, 0x8000u, 0x3c00u, 0xc000u};
        const int bytes = bytes_per_channel(format);
        for (int n = below(6); n > 0; --n) {
            const int x0 = below(w), y0 = below(h), x1 = std::min(x0 + 1 + below(12), w), y1 = std::min(y0 + 1 + below(12), h), which = below(9), c = below(channel_count(format));
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x) {
                    if (bytes == 1) p.at(x, y)[c] = static_cast<std::byte>(kWords[which] >> 24);
                    if (bytes == 2) std::memcpy(p.at(x, y) + 2 * c, &kHalves[which], 2);
                    if (bytes == 4) std::memcpy(p.at(x, y) + 4 * c, &kWords[which], 4);
                }
        }
        return p;
    }
};

TEST_F(ExtrapolationGlRandomPictures, AreMadeOfTheirOwnLight) {
    const char* const more = std::getenv("FOVEA_ROUNDS");
    const unsigned rounds = more != nullptr ? static_cast<unsigned>(std::strtoul(more, nullptr, 10)) : 10;
    constexpr float kFactors[] = {0.5f, 1, -0.3f, -0.75f, 2.5f, 1e-3f, -2}, kLights[] = {1, 1e-6f, 60000, 1e30f, 3e38f};
    for (unsigned round = 0; round < rounds && !HasFailure(); ++round) {
        std::minstd_rand random(round + 1);
        random.discard(8);
        const int w = 1 + static_cast<int>(random() % 70), h = 1 + static_cast<int>(random() % 70);
        const Format format = kRows[round % kFormatCount].format;
        const float factor = kFactors[random() % 7], light = kLights[random() % 5], dx = static_cast<float>(random() % 64) / 8 - 4, dy = static_cast<float>(random() % 64) / 8 - 4;
        const Picture a = picture(w, h, format, 0, 0, light, random), b = picture(w, h, format, dx, dy, light, random);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        const Picture first = read(src1, a), second = read(src2, a);
        const Picture& near = factor < -0.5f ? first : second;
        for (auto& [k, e] : sides_) {
            const std::string where = std::string(backend_name(k)) + " " + format_name(format) + " " + std::to_string(w) + "x" + std::to_string(h) + " factor " + std::to_string(factor) + ", round " + std::to_string(round);
            ASSERT_EQ(e.extrapolate(src1, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR)) << where;
            ASSERT_EQ(gl().GetError(), static_cast<GLenum>(GL_NO_ERROR)) << where;
            EXPECT_TRUE(std::memcmp(read(src2, a).bytes.data(), second.bytes.data(), second.bytes.size()) == 0) << where;
            if (!is_float(format)) continue;
            const Picture result = read(out, a);
            for (int c = 0; c < channel_count(format); ++c) {
                float low = std::numeric_limits<float>::infinity(), high = -low;
                for (const Picture* p : {&first, &second})
                    for (int y = 0; y < h; ++y)
                        for (int x = 0; x < w; ++x) {
                            const float v = channel(*p, x, y, c);
                            if (!std::isfinite(v)) continue;
                            low = std::min(low, v);
                            high = std::max(high, v);
                        }
                for (int y = 0; y < h; ++y)
                    for (int x = 0; x < w; ++x) {
                        const float is = channel(result, x, y, c), was = channel(near, x, y, c);
                        ASSERT_EQ(std::isfinite(is), std::isfinite(was)) << where << ", pixel " << x << " " << y << " channel " << c << ": " << is << " for " << was;
                        const bool flushed = is == 0 && low < std::numeric_limits<float>::min() && high > -std::numeric_limits<float>::min();   // a driver may take what is smaller than any normal number for 0
                        ASSERT_TRUE(!std::isfinite(was) || flushed || (is >= low && is <= high)) << where << ", pixel " << x << " " << y << " channel " << c << ": " << is << " of " << low << " to " << high;
                    }
            }
        }
        TearDown();   // its textures
    }
}

// The mean of equal numbers may round to more than they are: an alpha above 1, an infinity from the largest number.
TEST_F(ExtrapolationGlRandomPictures, NoMeanIsMoreThanItsNumbers) {
    for (const float alpha : {1.0f, std::numeric_limits<float>::max()}) {
        const auto at = [&](float t) {
            Picture p(96, 80, Format::rgba32f);
            for (int y = 0; y < 80; ++y)
                for (int x = 0; x < 96; ++x) {
                    const float n = noise(static_cast<float>(x) - 4.3f * t, static_cast<float>(y) - 2.6f * t, 3);
                    // Beside what is no number a mean is of fewer than four. Few of them: a lattice that stands still is no motion to believe in.
                    p.set(x, y, {x % 29 == 3 && y % 23 == 2 ? std::numeric_limits<float>::quiet_NaN() : n, 1 - n, 0.5f, alpha});
                }
            return p;
        };
        const Picture a = at(0), b = at(1);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        for (auto& [k, e] : sides_) {
            ASSERT_EQ(e.extrapolate(src1, src2, out, 0.57f), static_cast<GLenum>(GL_NO_ERROR)) << backend_name(k);
            const Picture result = read(out, a);
            EXPECT_NE(result, b) << backend_name(k);
            for (int y = 0; y < 80; ++y)
                for (int x = 0; x < 96; ++x) ASSERT_EQ(channel(result, x, y, 3), alpha) << backend_name(k) << " " << x << " " << y;
        }
    }
}

}  // namespace fovea::test
