// GL objects with an owner: programs, buffers, vertex arrays, render targets, fences; and reading images back.
//
// No GL header is needed to use this one: names are std::uint32_t, enums are named by what they are for.
// Threads: the thread on which the context is current. Destructors need it current as well.
// Errors: creation returns what the driver said, with the offending shader lines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"

namespace fovea::gl {

using Name = std::uint32_t;   // of a GL object; 0 is none

enum class ObjectKind : std::uint8_t { program, buffer, vertex_array, texture, renderbuffer, framebuffer };
void destroy(ObjectKind kind, Name name) noexcept;

// Owns one GL object.
template <ObjectKind Kind>
class Object {
public:
    Object() noexcept = default;
    explicit Object(Name name) noexcept : name_{name} {}
    Object(Object&& other) noexcept : name_{std::exchange(other.name_, 0)} {}
    Object& operator=(Object&& other) noexcept {
        if (this != &other) {
            reset();
            name_ = std::exchange(other.name_, 0);
        }
        return *this;
    }
    ~Object() { reset(); }
    void reset() noexcept {
        if (name_ != 0) destroy(Kind, std::exchange(name_, 0));
    }
    [[nodiscard]] Name name() const noexcept { return name_; }
    explicit operator bool() const noexcept { return name_ != 0; }

private:
    Name name_ = 0;
};

using Program = Object<ObjectKind::program>;
using Buffer = Object<ObjectKind::buffer>;
using VertexArray = Object<ObjectKind::vertex_array>;
using Texture = Object<ObjectKind::texture>;
using Renderbuffer = Object<ObjectKind::renderbuffer>;
using Framebuffer = Object<ObjectKind::framebuffer>;

// Compiles and links. `name` appears in errors; the sources are complete shaders ("#version 310 es" first).
[[nodiscard]] Result<Program> build_program(std::string_view name, std::string_view vertex, std::string_view fragment);
[[nodiscard]] Result<Program> build_compute_program(std::string_view name, std::string_view compute);

// Immutable contents.
[[nodiscard]] Buffer create_vertex_buffer(std::span<const std::byte> bytes) noexcept;
// Contents that change often; bytes of `size` are undefined at first.
[[nodiscard]] Buffer create_dynamic_buffer(std::size_t size) noexcept;
void update_buffer(const Buffer& buffer, std::size_t offset, std::span<const std::byte> bytes) noexcept;
[[nodiscard]] VertexArray create_vertex_array() noexcept;

enum class ColorFormat : std::uint8_t { rgba8, srgb8_alpha8, rgba16f };
enum class Filter : std::uint8_t { nearest, linear, cubic };   // cubic: by whoever samples; the texture itself is linear

[[nodiscard]] std::uint32_t internal_format(ColorFormat format) noexcept;
// Samples a pixel that this driver has for colour of this format together with depth and stencil of 24 and 8 bits: the fewest
// that are at least as many as wanted, else the most it has; 0: none. GL_MAX_SAMPLES is only the most for any format.
[[nodiscard]] int samples_for(ColorFormat format, int wanted) noexcept;

struct TargetSettings {
    int width_px = 0, height_px = 0;   // 1 to the driver's limit
    ColorFormat format = ColorFormat::rgba8;
    int samples = 0;                   // 0 or 1: none
    bool depth_stencil = true;         // 24 bits of depth, 8 of stencil
    Filter filter = Filter::linear;    // when its colour is sampled
};

// A framebuffer with one colour image and its depth and stencil.
class RenderTarget {
public:
    RenderTarget() noexcept = default;
    [[nodiscard]] static Result<RenderTarget> create(const TargetSettings& settings);
    [[nodiscard]] Name framebuffer() const noexcept { return framebuffer_.name(); }
    [[nodiscard]] Name color_texture() const noexcept { return color_.name(); }   // 0 when multisampled
    [[nodiscard]] int width() const noexcept { return settings_.width_px; }
    [[nodiscard]] int height() const noexcept { return settings_.height_px; }
    [[nodiscard]] const TargetSettings& settings() const noexcept { return settings_; }

private:
    TargetSettings settings_;
    Framebuffer framebuffer_;
    Texture color_;
    Renderbuffer color_samples_, depth_stencil_;
};

// Colour of a framebuffer, RGBA8, bottom row first. Waits for the GPU.
void read_pixels(Name framebuffer, int x, int y, int width_px, int height_px, std::span<std::uint8_t> rgba) noexcept;

// The whole colour of one target into another of the same size, neither multisampled.
void copy_color(const RenderTarget& from, const RenderTarget& to) noexcept;

// A point in the stream of commands; its time is when the GPU has passed it. Never a timer query: some software drivers
// return garbage there.
class Fence {
public:
    Fence() noexcept = default;
    Fence(Fence&& other) noexcept : sync_{std::exchange(other.sync_, nullptr)} {}
    Fence& operator=(Fence&& other) noexcept;
    ~Fence();
    // Inserted after everything submitted so far, and flushed.
    [[nodiscard]] static Fence insert() noexcept;
    // Blocks until it is passed; the instant after. Nothing when the timeout ran out or the context was lost.
    [[nodiscard]] std::optional<Instant> wait(const TimeSource& time, Duration timeout = seconds(10)) noexcept;

private:
    void* sync_ = nullptr;
};

void flush() noexcept;
void finish() noexcept;

}  // namespace fovea::gl
