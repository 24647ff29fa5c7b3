// All samples of a scenario, and a little statistics over them.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "drivers/synthetic/synthetic_eye.hpp"
#include "protocol/sphere.hpp"

namespace fovea::drivers::synthetic::test {

inline std::vector<SyntheticSample> collect(const Scenario& s) {
    std::vector<SyntheticSample> all;
    SyntheticEye eye(s);
    for (SyntheticSample x; eye.next(x);) all.push_back(x);
    return all;
}

inline const Offset& part(const SyntheticSample& s, Effect e) { return s.parts[static_cast<std::size_t>(e)]; }

inline Offset degrees(Direction<HeadFrame> d) {
    const AzimuthElevation a = to_azimuth_elevation(d);
    return {a.azimuth_rad * 180 / std::numbers::pi, a.elevation_rad * 180 / std::numbers::pi};
}

inline double mean(const std::vector<double>& v) {
    double sum = 0;
    for (const double x : v) sum += x;
    return sum / static_cast<double>(v.size());
}

inline double deviation(const std::vector<double>& v) {
    const double m = mean(v);
    double sum = 0;
    for (const double x : v) sum += (x - m) * (x - m);
    return std::sqrt(sum / static_cast<double>(v.size()));
}

// y = intercept + slope x by least squares.
struct Line {
    double slope, intercept;
};
inline Line line(const std::vector<double>& x, const std::vector<double>& y) {
    const double mx = mean(x), my = mean(y);
    double xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) xx += (x[i] - mx) * (x[i] - mx), xy += (x[i] - mx) * (y[i] - my);
    return {xy / xx, my - xy / xx * mx};
}

}  // namespace fovea::drivers::synthetic::test
