// What a headset's lens does to a picture, and the distortion that undoes it (Brown and Conrady).
//
//   q = panel - centre, r = |q|        rendered = centre + m (q (1 + k1 r^2 + k2 r^4 + k3 r^6) + tangential(p1, p2))
//
// The panel must show at `panel` what was rendered at `rendered`, so that the lens shows it where it belongs. Colours are
// bent differently: m is 1 for green, `red` and `blue` for the others.
// Units: NDC of the view; x is scaled by the view's width / height meanwhile, so that circles are circles.
// Source: D. C. Brown, "Decentering distortion of lenses", 1966.
// Threads: pure functions.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "protocol/error.hpp"
#include "protocol/frames.hpp"

namespace fovea::effects {

struct Lens {
    double k1 = 0, k2 = 0, k3 = 0;   // [-1, 2]
    double p1 = 0, p2 = 0;           // tangential, [-0.1, 0.1]
    double x = 0, y = 0;             // its middle, NDC of the left eye, [-0.5, 0.5]; x is mirrored for the right eye
    double red = 1, blue = 1;        // [0.9, 1.1]
    [[nodiscard]] bool distorts() const noexcept;
    bool operator==(const Lens&) const = default;
};

struct LensEntry {
    const char* name;   // as in a scene file's [lens]
    const char* summary;
    double Lens::* value;
    double least, most;
};
[[nodiscard]] const std::array<LensEntry, 9>& lens_entries() noexcept;

// Errors: a lens that folds the picture over itself inside the view's corners.
[[nodiscard]] Result<void> check_lens(const Lens& lens, const std::string& where);

// That of the right eye, whose lens is the left one's mirror image.
[[nodiscard]] Lens mirrored(const Lens& lens) noexcept;

enum class Channel : std::uint8_t { red, green, blue };
// Where what the panel shows at this point was rendered. aspect: width / height of the view. A pointer over the panel
// looks at this point of the view.
[[nodiscard]] NdcPoint rendered_of(const Lens& lens, NdcPoint panel, double aspect, Channel channel = Channel::green) noexcept;
// Where on the panel a rendered point is shown: the inverse, to 1e-12. Nothing where the lens shows no such point.
[[nodiscard]] std::optional<NdcPoint> panel_of(const Lens& lens, NdcPoint rendered, double aspect, Channel channel = Channel::green) noexcept;

}  // namespace fovea::effects
