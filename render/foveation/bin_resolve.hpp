// The resolve of scaled_bins on the GPU: rectangles of the app's framebuffer, drawn from a level with the filter asked for,
// all colour attachments at once, depth too where it is wanted.
//
// Filters: nearest; linear; cubic (Catmull-Rom, 16 texels). Integer attachments are always nearest, and so is depth.
// Threads: the context's. Errors: a program that does not build.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/gl/framebuffer_shape.hpp"

namespace fovea::foveation {

// Vertex stage of everything that is drawn as instanced rectangles: vec4 attribute 0 in NDC, x0 y0 x1 y1, as a strip of four
// corners; uniform location 1 is the window depth they get; `uv` goes from 0 to 1 over the viewport.
extern const char* const kRectVertex;

class BinResolve {
public:
    // Built on first use and kept. depth: also write gl_FragDepth; color false: nothing but depth.
    [[nodiscard]] Result<gl::Name> program(const gl::FramebufferShape& shape, gl::Filter filter, bool color, bool depth);

private:
    struct Entry {
        std::string source;
        gl::Program program;
    };
    std::vector<Entry> programs_;
};

// The mask that also clears: writes the clear colour to every attachment (uniform location 0; integers get 0).
[[nodiscard]] std::string clearing_fragment(const gl::FramebufferShape& shape);

}  // namespace fovea::foveation
