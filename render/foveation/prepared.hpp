// Which targets a method is prepared for, and what they are made of: names alone do not tell, since GL gives a deleted
// framebuffer's name to the next one and an app may attach other images.
//
// Threads: the context's. Errors: those of framebuffer_shape(); a preparation that failed fails again, at once, until the
// targets change.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "render/foveation/method.hpp"
#include "render/gl/framebuffer_shape.hpp"

namespace fovea::foveation {

class Prepared {
public:
    // True: prepared for exactly these. False: make everything anew, then settle(). Allocates only when the count grows.
    [[nodiscard]] Result<bool> same(std::span<const ViewTarget> targets);
    Result<void> settle(Result<void> made);
    // Names and rectangles are those prepared; noexcept and cheap, for submit().
    [[nodiscard]] bool ready(std::span<const ViewTarget> targets) const noexcept;
    [[nodiscard]] const gl::FramebufferShape& shape(std::size_t view) const noexcept { return shapes_[view]; }
    // Why not, for FrameCost::note.
    [[nodiscard]] const char* note() const noexcept { return failed_ ? "the targets could not be had" : "not prepared for these targets"; }

    // For methods that compose one picture from others: why view i of these cannot be drawn so; empty: it can.
    [[nodiscard]] const char* obstacle(std::span<const ViewTarget> targets, std::size_t view, const gl::Clear& clear) const noexcept;

private:
    std::vector<ViewTarget> targets_;
    std::vector<gl::FramebufferShape> shapes_, seen_;
    bool ready_ = false;
    std::optional<Error> failed_;
};

}  // namespace fovea::foveation
