// What tests of recorded draws begin with: a foveated surface with its focus in the middle, cleared to black, and a program
// whose vertices bring their colour.
#pragma once

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class LateFixture : public LayerTest {
protected:
    static constexpr Rgba kRed{255, 0, 0, 255}, kGreen{0, 255, 0, 255}, kBlue{0, 0, 255, 255}, kBlack{0, 0, 0, 255};
    static constexpr float kCover[6] = {-1, -1, 3, -1, -1, 3};   // a triangle over everything
    Surface foveated(bool depth = true) {
        const Surface s = surface(256, 256, depth);
        foveate(s);
        focus(s, 0, 0, 8);
        glClearColor(0, 0, 0, 1);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        return s;
    }
    GLuint attribute_program() {
        return program("#version 300 es\nlayout(location = 0) in vec2 p; layout(location = 1) in vec4 c; out vec4 v;\n"
                       "void main() { v = c; gl_Position = vec4(p, 0, 1); }",
                       "#version 300 es\nprecision highp float; in vec4 v; out vec4 c; void main() { c = v; }");
    }
};

}  // namespace fovea::layer_test
