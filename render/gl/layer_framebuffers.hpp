// A framebuffer with all layers of its images attached at once (glFramebufferTexture), as one framebuffer per layer: what
// foveation draws to, with a view and focal points for each layer.
//
//   app's framebuffer: [layers 0..n-1]   ->   n framebuffers over the same images: [0] [1] ... [n-1]
//
// A draw of the app's goes to a layer by gl_Layer; recorded draws have no geometry stage and know their view instead. The
// pictures end up in the app's images; its framebuffer is not touched and can be sampled, blitted or read as ever.
// Source: OpenGL ES 3.2, 9.8 (layered framebuffers).
// Cost: some queries and n framebuffers, when the app makes or changes its own. Threads: the context's.
// Errors: a framebuffer that is not layered, or is incomplete; a driver below OpenGL ES 3.2.
#pragma once

#include <vector>

#include "protocol/error.hpp"
#include "render/gl/objects.hpp"

namespace fovea::gl {

class LayerFramebuffers {
public:
    // layered: with colour, and maybe depth and stencil, of 2D array textures or cube maps; as many layers as the fewest have.
    [[nodiscard]] static Result<LayerFramebuffers> create(Name layered);
    [[nodiscard]] std::size_t size() const noexcept { return layers_.size(); }
    [[nodiscard]] Name operator[](std::size_t layer) const noexcept { return layers_[layer].name(); }

private:
    std::vector<Framebuffer> layers_;
};

// True if any image of the framebuffer that is bound to GL_FRAMEBUFFER is attached with all its layers.
[[nodiscard]] bool bound_framebuffer_is_layered() noexcept;

}  // namespace fovea::gl
