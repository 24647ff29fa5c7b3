// Puts the GL state back to what it was when recording began.
//
// The first recorded call that changes a piece of state saves it here, by asking the driver; later changes of the same
// piece cost a look-up. restore() brings every saved piece back, the last saved first, and keeps them: a log is replayed
// once per level. Each group below takes the arguments of the calls that calls.txt assigns to it.
// Threads: as the context that it belongs to.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "layer_gl.hpp"

namespace fovea::layer {

// Indices that a saved piece of state is known by; emptied in constant time.
class KeySet {
public:
    bool insert(std::uint64_t key);  // false: was there already
    void clear() noexcept { ++epoch_, count_ = 0; }

private:
    struct Slot {
        std::uint64_t key = 0;
        std::uint32_t epoch = 0;
    };
    void grow();
    std::vector<Slot> slots_;
    std::uint32_t epoch_ = 1;
    std::size_t count_ = 0;
};

// What glUniform* sets: 'f', 'i' or 'u'; a vector of `components`, or a matrix of `columns` vectors.
struct UniformShape {
    char kind;
    int components, columns;
};

class Undo {
public:
    void restore() const;
    void clear() noexcept;
    [[nodiscard]] bool empty() const noexcept { return pieces_.empty(); }
    // Blend state and colour masks per draw buffer are in use: save all of them from now on.
    void per_draw_buffer() noexcept { per_draw_buffer_ = true; }

    template <class... A>
    void blend(A...) { if (first(kBlend)) save_blend(); }
    template <class... A>
    void color_mask(A...) { if (first(kColorMask)) save_color_mask(); }
    template <class... A>
    void depth(A...) { if (first(kDepth)) save_depth(); }
    template <class... A>
    void raster(A...) { if (first(kRaster)) save_raster(); }
    template <class... A>
    void clear_values(A...) { if (first(kClearValues)) save_clear_values(); }
    template <class... A>
    void program(A...) { if (first(kProgram)) save_program(); }
    void active_texture(GLenum) { save_active_texture(); }
    void texture(GLenum target, GLuint) { save_texture(target); }
    void sampler(GLuint unit, GLuint) { if (first(kSampler, unit)) save_sampler(unit); }
    void buffer(GLenum target, GLuint) { save_buffer(target); }
    void indexed_buffer(GLenum target, GLuint index);
    void vertex_array(GLuint) { save_vertex_array(); }
    template <class... A>
    void attrib(GLuint index, A...) { save_attrib(index); }
    template <class... A>
    void generic_attrib(GLuint index, A...) { if (first(kGeneric, index)) save_generic_attrib(index); }
    void custom(std::function<void()> piece) { pieces_.push_back(std::move(piece)); }
    void viewport() { if (first(kViewport)) save_viewport(); }
    void scissor() { if (first(kScissor)) save_scissor(); }
    void stencil() { if (first(kStencil)) save_stencil(); }
    void framebuffers();  // both bindings; for the layer's own drawing
    void cap(GLenum capability) { if (first(kCap, capability)) save_cap(capability); }
    void uniform(GLint location, GLsizei count, UniformShape shape);
    void program_uniform(GLuint program, GLint location, GLsizei count, UniformShape shape);

private:
    enum Kind : std::uint64_t {
        kBlend = 1, kColorMask, kDepth, kRaster, kClearValues, kProgram, kActiveTexture, kTexture, kSampler, kBuffer,
        kElementBuffer, kIndexedBuffer, kVertexArray, kAttrib, kGeneric, kCap, kUniform, kViewport,
        kScissor, kStencil
    };
    bool first(Kind kind, std::uint64_t a = 0, std::uint64_t b = 0) {
        return seen_.insert((static_cast<std::uint64_t>(kind) << 58) ^ (a << 26) ^ b);
    }
    void save_blend();
    void save_color_mask();
    void save_depth();
    void save_raster();
    void save_clear_values();
    void save_program();
    void save_active_texture();
    void save_texture(GLenum target);
    void save_sampler(GLuint unit);
    void save_buffer(GLenum target);
    void save_vertex_array();
    void save_attrib(GLuint index);
    void save_generic_attrib(GLuint index);
    void save_viewport();
    void save_scissor();
    void save_stencil();
    void save_cap(GLenum capability);

    KeySet seen_;
    std::vector<std::function<void()>> pieces_;
    bool per_draw_buffer_ = false;
};

// The binding that glGet* answers for a texture or buffer target; 0 for a target that it does not know.
[[nodiscard]] GLenum texture_binding_query(GLenum target) noexcept;
[[nodiscard]] GLenum buffer_binding_query(GLenum target) noexcept;
[[nodiscard]] GLint get_integer(GLenum name) noexcept;
// Takes the driver's errors away. A lost context may answer with one for ever: it gives up then.
void drop_errors() noexcept;

}  // namespace fovea::layer
