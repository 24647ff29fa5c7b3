// Single kernels of the shader backends, where the whole frame would not show which of them failed.
#include "render/extrapolation/gl_runner.hpp"
#include "tests/render/extrapolation_gl.hpp"

namespace fovea::test {

class ExtrapolationGlSteps : public ExtrapolationGl {};

// As of the processor's kernel: doubted cells on both sides of an edge of luma go with their own side.
TEST_F(ExtrapolationGlSteps, SmoothingStopsAtEdgesOfLuma) {
    constexpr int kWidth = 48, kHeight = 24, kEdge = 21;
    for (const bool compute : {false, true}) {
        if (compute && sides_.size() < 3) continue;   // a driver whose compute shaders are not used
        const GlStateGuard guard(gl(), true);
        GlRunner runner(gl());
        ASSERT_TRUE(runner.build(compute, 2, true).has_value());
        const GLuint in = runner.make_image(kWidth, kHeight), out = runner.make_image(kWidth, kHeight);
        std::vector<float> cells(4 * kWidth * kHeight), smoothed(cells);
        for (int i = 0; i < kWidth * kHeight; ++i) {
            const int x = i % kWidth;
            const bool left = x < kEdge, doubted = x >= kEdge - 1 && x < kEdge + 1;
            const float cell[4] = {doubted ? 30.0f : left ? 5.0f : -5.0f, left ? -1.0f : 2.0f, doubted ? 0.02f : 1.0f, left ? 60.0f : 180.0f};   // motion, trust, luma
            std::copy_n(cell, 4, cells.begin() + 4 * i);
        }
        gl().BindTexture(GL_TEXTURE_2D, in);
        gl().TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kWidth, kHeight, GL_RGBA, GL_FLOAT, cells.data());
        runner.begin();
        runner.use(Kernel::smooth);
        runner.bind(0, in);
        runner.set_size(kWidth, kHeight);
        runner.set_rounds(2);   // cells away
        runner.pass(Kernel::smooth, out, kWidth, kHeight, over_all());
        runner.attach(out);
        gl().BindFramebuffer(GL_READ_FRAMEBUFFER, runner.framebuffer());
        gl().ReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_FLOAT, smoothed.data());
        runner.end();
        for (int i = 0; i < kWidth * kHeight; ++i) {
            const bool left = i % kWidth < kEdge;
            ASSERT_NEAR(smoothed[static_cast<std::size_t>(4 * i)], left ? 5 : -5, 2.5) << "compute " << compute << ", column " << i % kWidth;
            ASSERT_NEAR(smoothed[static_cast<std::size_t>(4 * i + 1)], left ? -1 : 2, 0.1) << "compute " << compute << ", column " << i % kWidth;
        }
        const GLuint both[] = {in, out};
        gl().DeleteTextures(2, both);
    }
}

}  // namespace fovea::test
