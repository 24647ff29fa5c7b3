// What a framebuffer of the app consists of: formats, samples, depth. A method's own targets are made to match it.
//
// Input: the name of a complete framebuffer, 0 for the surface. Output: everything but the names of the attached objects,
// so that two shapes are equal when targets made for one fit the other.
// Source: OpenGL ES 3.1, 9.2.3 (framebuffer queries); a texture's target cannot be asked for, it is found by binding.
// Cost: some 20 queries, a few microseconds. Restores every binding except that of the framebuffer.
// Threads: the context's.
// Errors: an incomplete framebuffer, a colour format outside the table below.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/error.hpp"
#include "render/gl/objects.hpp"

namespace fovea::gl {

inline constexpr int kMaxColors = 8;

enum class ColorKind : std::uint8_t {
    none,          // nothing is drawn there
    filtered,      // normalised or floating point, can be interpolated
    unfiltered,    // floating point that this driver cannot interpolate
    whole,         // signed integers
    natural,       // unsigned integers
};

struct ColorShape {
    ColorKind kind = ColorKind::none;
    std::uint32_t format = 0;          // sized internal format
    // Of the attached image: GL_TEXTURE_2D, GL_TEXTURE_2D_ARRAY, a cube face ...; 0 for renderbuffers and surfaces.
    std::uint32_t texture_target = 0;
    int level = 0, layer = 0;
    bool operator==(const ColorShape&) const = default;
};

struct FramebufferShape {
    std::array<ColorShape, kMaxColors> color;   // by draw buffer
    int width_px = 0, height_px = 0;            // of draw buffer 0's image; 0 for surfaces
    int colors = 0;                             // draw buffers up to the last that is not none
    int samples = 0;                            // 0: not multisampled
    std::uint32_t depth_format = 0;             // sized; 0: no depth
    bool stencil = false;                       // at least 8 bits
    bool operator==(const FramebufferShape&) const = default;
};

[[nodiscard]] Result<FramebufferShape> framebuffer_shape(Name framebuffer);

// The object behind draw buffer i of the framebuffer that is bound (to GL_FRAMEBUFFER); 0 if there is none.
[[nodiscard]] Name attached_object(int draw_buffer) noexcept;

}  // namespace fovea::gl
