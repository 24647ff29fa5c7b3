// The shaders keep the rim of a window whose content scrolls, as the processor does: see extrapolation_window_test.cpp.
#include "tests/render/extrapolation_gl.hpp"
#include "tests/render/extrapolation_window.hpp"

namespace fovea::test {

class ExtrapolationGlWindow : public ExtrapolationGl {
protected:
    struct Made {
        const char* backend;
        double repeated, made;
    };
    std::vector<Made> measure(const window::Scene& s) {
        const Picture a = window::at_time(s, 0), b = window::at_time(s, 1), truth = window::at_time(s, 1.5f);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        std::vector<Made> all;
        for (auto& [k, e] : sides_) {
            EXPECT_EQ(e.extrapolate(src1, src2, out, 0.5f), static_cast<GLenum>(GL_NO_ERROR));
            all.push_back({backend_name(k), psnr(b, truth), psnr(read(out, truth), truth)});
        }
        return all;
    }
};

TEST_F(ExtrapolationGlWindow, ContentThatScrollsStaysInsideItsWindow) {
    for (const bool plain : {false, true})
        for (const bool corner : {false, true})
            for (const float speed : {2.0f, 5.3f, 16.0f})
                for (const auto& way : window::kWays) {
                    window::Scene s{61, 55, 125, 119, plain, false, speed * way[0], speed * way[1]};
                    if (corner) s = {0, 0, 71, 61, plain, false, speed * way[0], speed * way[1]};
                    for (const Made& m : measure(s))
                        EXPECT_GE(m.made, m.repeated - 0.1) << m.backend << (plain ? ", plain" : ", textured") << (corner ? ", corner, " : ", middle, ") << s.u << " " << s.v;
                }
}

TEST_F(ExtrapolationGlWindow, AThingOfTheSameSizeStillMoves) {
    for (const bool plain : {false, true})
        for (const float speed : {5.3f, 9.0f})
            for (const auto& way : window::kWays) {
                const window::Scene s{61, 55, 125, 119, plain, true, speed * way[0], speed * way[1]};
                for (const Made& m : measure(s)) EXPECT_GE(m.made, m.repeated + 3) << m.backend << (plain ? ", plain, " : ", textured, ") << s.u << " " << s.v;
            }
}

TEST_F(ExtrapolationGlWindow, TheFrameStandsInEveryFormatAndDirectionOfTime) {
    const window::Scene s{61, 55, 125, 119, false, false, 5, 3};
    for (const Format f : {Format::rgba8, Format::r8, Format::rgba16f}) {
        const Picture a = window::at_time(s, 0, f), b = window::at_time(s, 1, f);
        const GLuint src1 = texture(a), src2 = texture(b), out = texture(a);
        const Picture source = read(src2, b);
        for (auto& [k, e] : sides_)
            for (const float factor : {0.5f, 1.0f, -0.4f, -1.5f}) {
                ASSERT_EQ(e.extrapolate(src1, src2, out, factor), static_cast<GLenum>(GL_NO_ERROR));
                const Picture made = read(out, b);
                EXPECT_TRUE(window::frame_stands(made, source, s)) << format_name(f) << " " << backend_name(k) << " " << factor;
                EXPECT_FALSE(made == source) << format_name(f) << " " << backend_name(k) << " " << factor;
            }
    }
}

}  // namespace fovea::test
