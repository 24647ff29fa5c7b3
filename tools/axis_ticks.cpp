#include "tools/axis_ticks.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::tools {
namespace {

constexpr double kParts = 5;      // of a linear axis
constexpr std::size_t kMost = 9;  // marks of a logarithmic one

}  // namespace

double round_step(double range, double parts) {
    const double raw = std::max(range, 1e-9) / parts;
    const double power = std::pow(10, std::floor(std::log10(raw)));
    for (double m : {1.0, 2.0, 2.5, 5.0})
        if (m * power >= raw * 0.999) return m * power;
    return 10 * power;
}

std::vector<double> axis_ticks(double low, double high, bool log) {
    std::vector<double> ticks;
    if (!(std::isfinite(low) && std::isfinite(high) && low < high)) return ticks;
    if (log && low > 0) {
        std::vector<double> decades;
        for (double power = std::floor(std::log10(low)); power <= std::log10(high); ++power)
            for (const double m : {1.0, 2.0, 5.0}) {
                const double v = m * std::pow(10, power);
                if (v < low || v > high) continue;
                ticks.push_back(v);
                if (m == 1) decades.push_back(v);
            }
        if (ticks.size() > kMost) return decades;
        if (ticks.size() >= 3) return ticks;
        ticks.clear();
    }
    const double step = round_step(high - low, kParts);
    // By counting: adding up would drift, and 0 would come out as 1e-17.
    for (double n = std::ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n) ticks.push_back(n * step + 0.0);   // + 0: no "-0"
    return ticks;
}

}  // namespace fovea::tools
