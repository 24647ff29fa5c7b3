// What the layer delivers, read back pixel by pixel.
#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class Density : public LayerTest {
protected:
    // Every pixel of a footprint picture has at least the density of the specification, as a share of pixels (the
    // stricter reading: half the density is half as many pixels). Returns the mean share of pixels that were drawn.
    static double expect_delivered(const Picture& p, const std::vector<std::array<float, 5>>& points, double least = 0) {
        double sum = 0;
        int bad = 0;
        for (int y = 0; y < p.height; ++y)
            for (int x = 0; x < p.width; ++x) {
                const double across = p.at(x, y).r * 8.0 / 255, along = p.at(x, y).g * 8.0 / 255;
                const double delivered = 1.0 / (across * along);
                const double asked = spec_density(points, (x + 0.5) / p.width * 2 - 1, (y + 0.5) / p.height * 2 - 1, least);
                if (across * along <= 0 || delivered < asked * 0.98) ++bad;  // 8 bits hold a footprint of 1 to 0.4 %
                sum += delivered;
            }
        EXPECT_EQ(bad, 0);
        return sum / (p.width * p.height);
    }
};

TEST_F(Density, NeverFallsBelowTheEquationAndSavesPixels) {
    for (const auto& point : {std::array{0.0f, 0.0f, 4.0f, 4.0f, 0.0f}, std::array{0.5f, -0.3f, 10.0f, 10.0f, 0.0f},
                              std::array{-0.9f, 0.9f, 8.0f, 3.0f, 2.0f}, std::array{3.0f, 0.0f, 4.0f, 4.0f, 0.0f}}) {
        const Surface s = surface(512, 512);
        foveate(s);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        ext.parameters(s.framebuffer, 0, 0, point[0], point[1], point[2], point[3], point[4]);  // late
        const double share = expect_delivered(read(s), {point});
        EXPECT_LT(share, 0.7);
        EXPECT_GL(GL_NO_ERROR);
    }
}

TEST_F(Density, OfSizesThatAreNoMultipleOfABin) {
    for (const auto& [w, h] : {std::pair{317, 211}, std::pair{64, 600}, std::pair{1023, 33}}) {
        const Surface s = surface(w, h);
        foveate(s);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_footprint();
        focus(s, 0.2f, 0.1f, 8);
        expect_delivered(read(s), {{0.2f, 0.1f, 8, 8, 0}});
        EXPECT_GL(GL_NO_ERROR);
    }
}

TEST_F(Density, FullDensityRegionIsBitExact) {
    const Surface plain = surface(512, 512), foveated = surface(512, 512);
    foveate(foveated);
    for (const Surface* s : {&plain, &foveated}) {
        glBindFramebuffer(GL_FRAMEBUFFER, s->framebuffer);
        glEnable(GL_DEPTH_TEST);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_triangle(-0.3f, -0.3f, 0.4f, 0.1f, {1, 0, 0, 1});
        draw_scene();
        draw_triangle(0.1f, 0.1f, 0.3f, 0.2f, {0, 1, 0, 1});
    }
    focus(foveated, 0, 0, 4);
    const Picture a = read(plain), b = read(foveated);
    int different = 0;
    for (int y = 0; y < 512; ++y)
        for (int x = 0; x < 512; ++x) {
            const double density = spec_density({{0, 0, 4, 4, 0}}, (x + 0.5) / 256 - 1, (y + 0.5) / 256 - 1);
            if (density >= 1)
                EXPECT_EQ(a.at(x, y), b.at(x, y)) << x << ' ' << y;
            else
                different += !(a.at(x, y) == b.at(x, y));
        }
    EXPECT_GT(different, 10000);
}

TEST_F(Density, TwoFocalPointsOfADoubleWideTarget) {
    const Surface s = surface(1024, 512);
    foveate(s, 2);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_footprint();
    ext.parameters(s.framebuffer, 0, 0, -0.5f, 0, 20, 10, 0);
    ext.parameters(s.framebuffer, 0, 1, 0.5f, 0, 20, 10, 0);
    expect_delivered(read(s), {{-0.5f, 0, 20, 10, 0}, {0.5f, 0, 20, 10, 0}});
}

TEST_F(Density, MinimumOfATextureIsKept) {
    const Surface s = surface(512, 512);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM, GL_FOVEATION_ENABLE_BIT_QCOM);
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM, 0.25f);
    ext.texture_parameters(s.color, 0, 0, 0, 0, 20, 20, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_footprint();
    const double share = expect_delivered(read(s), {{0, 0, 20, 20, 0}}, 0.25);
    EXPECT_LT(share, 0.5);
    EXPECT_GE(share, 0.25);
}

TEST_F(Density, GainZeroIsThePlainDriversPicture) {
    const Surface plain = surface(256, 256), foveated = surface(256, 256);
    foveate(foveated);
    for (const Surface* s : {&plain, &foveated}) {
        draw_scene_to(*s);
    }
    EXPECT_EQ(read(plain), read(foveated));
}

TEST_F(Density, LayersOfATextureArrayHaveTheirOwnFocalPoints) {
    GLuint array = 0, framebuffers[2];
    glGenTextures(1, &array);
    glBindTexture(GL_TEXTURE_2D_ARRAY, array);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, 256, 256, 16);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM,
                    GL_FOVEATION_ENABLE_BIT_QCOM | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM);
    ext.texture_parameters(array, 3, 0, -0.5f, 0, 8, 8, 0);
    ext.texture_parameters(array, 15, 0, 0.5f, 0.5f, 8, 8, 0);
    glGenFramebuffers(2, framebuffers);
    glViewport(0, 0, 256, 256);
    const struct {
        GLint layer;
        std::array<float, 5> point;
    } cases[] = {{3, {-0.5f, 0, 8, 8, 0}}, {15, {0.5f, 0.5f, 8, 8, 0}}};
    for (int i = 0; i < 2; ++i) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffers[i]);
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, array, 0, cases[i].layer);
        glClear(GL_COLOR_BUFFER_BIT);
        draw_footprint();
    }
    for (int i = 0; i < 2; ++i) {
        const Surface s{framebuffers[i], array, 0, 256, 256};
        EXPECT_LT(expect_delivered(read(s), {cases[i].point}), 0.6);
    }
    EXPECT_GL(GL_NO_ERROR);
}

}  // namespace fovea::layer_test
