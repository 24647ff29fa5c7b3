// The density equation written a second time, straight from the extension's text and in long double: what the tests
// compare against.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "render/density/density.hpp"

namespace fovea::test {

inline long double exact_term(long double distance, long double gain) {
    if (std::isnan(distance) || std::isnan(gain)) return distance + gain;
    return distance == 0 || gain == 0 ? 0.0L : distance * distance * gain * gain;
}

inline long double exact_density(std::span<const density::FocalPoint> points, long double x, long double y,
                                 long double min_density) {
    long double result = min_density;
    for (const auto& p : points) {
        const long double q = exact_term(p.x_ndc - x, p.gain_x) + exact_term(p.y_ndc - y, p.gain_y) - p.fovea_area;
        result = std::max(result, 1.0L / std::fmax(q, 1.0L));   // fmax: NaN counts as 1
    }
    return result;
}

}  // namespace fovea::test
