// An ellipse fitted to the pixels themselves: the picture that a dark ellipse with a soft edge would give is compared
// with the one that is there, over a band along the edge, and the ellipse moves until the two agree.
//
// Every pixel of the band takes part, where rays take one point each: with noise this comes near to what the picture can
// tell at all. Unknowns: the ellipse, the level inside, the level outside and its slope across the picture (uneven
// light), the edge's width (the lens's blur). Gauss-Newton with Tukey's weights, whose reach shrinks to the residuals'
// own spread (Huber and Ronchetti, "Robust Statistics", 2009): pixels of a lid, a lash or a glint end without weight.
//
// Units: pixels, grey levels. Threads: one at a time per EdgeModel; allocates when the band is larger than ever before.
// Deterministic.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "drivers/camera/ellipse_fit.hpp"
#include "drivers/camera/image.hpp"

namespace fovea::drivers::camera {

struct EdgeFit {
    PupilEllipse ellipse;
    double inside = 0, outside = 0;   // grey levels at the ellipse's centre
    double edge_px = 0;               // standard deviation of the edge's blur
    double spread = 0;                // of the residuals that count, grey levels
    double explained = 0;             // 0 to 1: mean weight of the band's pixels
};

class EdgeModel {
public:
    // Refines `fit`: its ellipse, inside and outside are where to start. False, and `fit` untouched: nothing that the
    // picture supports within a third of the smaller axis. Left out: pixels of `glint_level` or more, and the parts of the
    // edge near which there is none of the points `seen` (under a lid).
    [[nodiscard]] bool refine(const GreyImage& image, double glint_level, std::span<const EdgePoint> seen, EdgeFit& fit);

private:
    struct Pixel {
        float x, y, value;
    };
    std::vector<Pixel> band_;
};

}  // namespace fovea::drivers::camera
