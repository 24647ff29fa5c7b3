// A GL context for the tests of this binary (a hard requirement: without one they fail), and small pictures to draw.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "render/foveation/method.hpp"
#include "render/gl/command_list.hpp"
#include "render/gl/context.hpp"
#include "render/gl/objects.hpp"

namespace fovea::test {

using Pixels = std::vector<std::uint8_t>;   // RGBA, bottom row first

[[nodiscard]] const gl::Context& context();   // created on first use; aborts the test binary with the error otherwise
[[nodiscard]] Pixels read(const foveation::ViewTarget& target);
[[nodiscard]] std::uint64_t hash(const Pixels& pixels) noexcept;   // FNV-1a
[[nodiscard]] double psnr(const Pixels& a, const Pixels& b);

// Some views of one size with a framebuffer each.
struct Views {
    explicit Views(int width_px, int height_px, std::size_t count = 1);
    std::vector<gl::RenderTarget> owned;
    std::vector<foveation::ViewTarget> targets;
    std::vector<foveation::ViewFocus> focus;
    void look(std::size_t view, const density::FocalPoint& point);
};

struct QuadOptions {
    gl::Box where{};                  // of the view
    float depth = 0.5f;               // of the window, at its left edge
    float depth_right = 0.5f;         // and at its right edge
    int outputs = 1;                  // color, color1, color2 ...
    std::string more_outputs{};       // declarations instead, from location 1 on
};

// One quad over the whole view (or a part of it) with the given fragment body, which sets `color` (vec4) from `ndc` (vec2).
class QuadDraw {
public:
    explicit QuadDraw(const std::string& fragment_body, const QuadOptions& options = {});
    [[nodiscard]] const gl::CommandList& list() const noexcept { return list_; }
    // The same draw after another clear.
    [[nodiscard]] gl::CommandList after(const gl::Clear& clear) const;

private:
    gl::Program program_, counting_;
    gl::Buffer vertices_, indices_;
    gl::VertexArray arrays_;
    gl::CommandList list_;
};

// Colour: a fine pattern, so that a lower resolution shows.
inline constexpr const char* kPattern =
    "float s = sin(ndc.x * 190.0) * cos(ndc.y * 170.0 + ndc.x * 31.0); color = vec4(0.5 + 0.5 * s, fract(ndc * 9.0), 1.0);";
// The same, but smooth enough for a quarter of the resolution to look alike.
inline constexpr const char* kSmooth =
    "color = vec4(0.5 + 0.5 * sin(ndc.x * 14.0) * cos(ndc.y * 11.0), 0.5 + 0.5 * sin(ndc.y * 17.0 + ndc.x), 0.5 + 0.4 * ndc.x, 1.0);";
// Red and green: how many pixels of a `width` x `height` image one fragment covers along x and y, times 16.
[[nodiscard]] std::string footprint_shader(int width_px, int height_px);

class GlTest : public ::testing::Test {
protected:
    void SetUp() override {
        static_cast<void>(context().make_current());
        static_cast<void>(gl::pending_error());
    }
    void TearDown() override { EXPECT_EQ(gl::pending_error(), ""); }
};

}  // namespace fovea::test
