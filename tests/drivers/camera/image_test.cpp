#include "drivers/camera/image.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/drivers/camera/jpeg_picture.hpp"

using namespace fovea::drivers::camera;

namespace {

std::vector<std::uint8_t> jpeg(int width, int height, std::uint8_t level) {
    return fovea::tests::as_jpeg(std::vector<std::uint8_t>(static_cast<std::size_t>(width * height), level), width, height);
}

}  // namespace

TEST(GreyConverter, ReadsTheLuminanceOfEveryFormat) {
    GreyConverter c;
    const std::vector<std::uint8_t> grey = {1, 2, 99, 3, 4, 99};   // stride 3
    GreyImage g = c.convert(grey, PixelFormat::grey, 2, 2, 3);
    ASSERT_NE(g.pixels, nullptr);
    EXPECT_EQ(g.pixels[g.stride + 1], 4);
    const std::vector<std::uint8_t> yuyv = {10, 128, 20, 128, 30, 128, 40, 128};
    g = c.convert(yuyv, PixelFormat::yuyv, 2, 2, 0);
    ASSERT_NE(g.pixels, nullptr);
    EXPECT_EQ((std::vector<int>{g.pixels[0], g.pixels[1], g.pixels[2], g.pixels[3]}), (std::vector<int>{10, 20, 30, 40}));
    const std::vector<std::uint8_t> y16 = {0, 10, 0, 20, 0, 30, 0, 40};
    g = c.convert(y16, PixelFormat::y16, 2, 2, 0);
    ASSERT_NE(g.pixels, nullptr);
    EXPECT_EQ(g.pixels[2], 30);
    const auto j = jpeg(48, 32, 130);
    g = c.convert(j, PixelFormat::mjpg, 48, 32, 0);
    ASSERT_NE(g.pixels, nullptr);
    EXPECT_NEAR(g.pixels[100], 130, 2);
}

TEST(GreyConverter, RefusesFramesThatAreShorterThanTheirFormat) {
    GreyConverter c;
    const std::vector<std::uint8_t> bytes(640 * 480, 7);
    EXPECT_EQ(c.convert({bytes.data(), bytes.size() - 1}, PixelFormat::grey, 640, 480, 0).pixels, nullptr);
    EXPECT_NE(c.convert(bytes, PixelFormat::grey, 640, 480, 640).pixels, nullptr);
    EXPECT_EQ(c.convert(bytes, PixelFormat::grey, 640, 480, 641).pixels, nullptr);
    EXPECT_EQ(c.convert(bytes, PixelFormat::grey, 640, 480, 600).pixels, nullptr);
    EXPECT_EQ(c.convert(bytes, PixelFormat::yuyv, 640, 480, 0).pixels, nullptr);
    EXPECT_EQ(c.convert(bytes, PixelFormat::grey, 0, 480, 0).pixels, nullptr);
    EXPECT_EQ(c.convert(bytes, PixelFormat::grey, 100000, 1, 0).pixels, nullptr);
    EXPECT_EQ(c.convert(bytes, PixelFormat::mjpg, 640, 480, 0).pixels, nullptr);
    EXPECT_EQ(c.convert({}, PixelFormat::mjpg, 640, 480, 0).pixels, nullptr);
    EXPECT_EQ(c.convert(jpeg(64, 48, 9), PixelFormat::mjpg, 48, 64, 0).pixels, nullptr) << "another size than agreed";
}

TEST(GreyConverter, SurvivesTornAndChangedJpegs) {
    GreyConverter c;
    const auto whole = jpeg(64, 64, 100);
    std::mt19937 rng(1);
    int decoded = 0;
    for (int i = 0; i < 20000; ++i) {
        auto bytes = whole;
        for (std::size_t n = rng() % 8; n > 0; --n) bytes[rng() % bytes.size()] = static_cast<std::uint8_t>(rng());
        if (rng() % 2 == 0) bytes.resize(rng() % bytes.size());
        decoded += c.convert(bytes, PixelFormat::mjpg, 64, 64, 0).pixels != nullptr ? 1 : 0;
    }
    EXPECT_GT(decoded, 100);
    EXPECT_LT(decoded, 20000);
}
