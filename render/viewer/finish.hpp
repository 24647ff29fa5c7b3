// What is done to the pictures between the method and the display: smoothing over time and the lens, where they are called for.
//
//   method -> (temporal smoothing) -> (lens distortion) -> pictures
//
// What is not called for makes no object and issues no call.
// Threads: the context's. Errors: what the driver refuses; draw() cannot fail.
#pragma once

#include <array>
#include <optional>

#include "render/effects/effects.hpp"
#include "render/effects/lens_pass.hpp"
#include "render/effects/smoothing.hpp"
#include "render/viewer/eyes.hpp"

namespace fovea::viewer {

class Finish {
public:
    // For the eyes as they are now: size, method and its effects. Cheap when nothing changes.
    [[nodiscard]] Result<void> prepare(const Eyes& eyes);
    // The pictures of a frame that the eyes have drawn. fell_back: in full, whatever the method's plan says.
    void draw(Eyes& eyes, const Frame& frame) noexcept;
    // Through the lens again: what a snapshot of the last rendered frame shows, whatever was drawn since.
    void show_rendered() noexcept { if (rendered_[0] != nullptr) draw(rendered_); }
    // Any other pictures (extrapolated ones): through the lens only.
    void draw(const std::array<const gl::RenderTarget*, kEyes>& pictures) noexcept;
    // Of the last draw(). with_lens false: as rendered, for an overlay that is laid over the rendered picture.
    [[nodiscard]] const gl::RenderTarget& picture(std::size_t eye, bool with_lens = true) const noexcept { return *(with_lens && lens_ ? warped_ : flat_)[eye]; }
    // The lens in front of an eye; null: none.
    [[nodiscard]] const effects::LensPass* lens() const noexcept { return lens_ ? &*lens_ : nullptr; }
    [[nodiscard]] bool smooths() const noexcept { return smoothing_.has_value(); }

private:
    std::optional<effects::Smoothing> smoothing_;
    std::optional<effects::LensPass> lens_;
    std::array<const gl::RenderTarget*, kEyes> rendered_{}, flat_{}, warped_{};
};

}  // namespace fovea::viewer
