#include "daemon/pipeline/ballistic.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/pipeline/main_sequence.hpp"

namespace fovea::pipeline {
namespace {

constexpr std::array<double, 12> kProfile = {0, .05, .156, .294, .44, .578, .704, .815, .907, .969, 1, 1};
constexpr std::size_t kAmplitudes = 16, kOnsets = 5, kFits = 6;
constexpr double kOnsetStep_ms = 3;
constexpr double kLogMean = 1.32, kLogSd = 1.32;  // ln degrees

struct Grid {
    std::array<double, kAmplitudes> amplitude_deg, duration_ms, log_prior;
};
const Grid& grid() noexcept {
    static const Grid g = [] {
        Grid x{};
        for (std::size_t i = 0; i < kAmplitudes; ++i) {
            const double ln = std::log(0.4) + static_cast<double>(i) * std::log(MainSequence::kLargest_deg / 0.4) / (kAmplitudes - 1);
            x.amplitude_deg[i] = std::exp(ln);
            x.duration_ms[i] = MainSequence::duration_s(x.amplitude_deg[i]) * 1e3;
            x.log_prior[i] = -0.5 * (ln - kLogMean) * (ln - kLogMean) / (kLogSd * kLogSd);
        }
        return x;
    }();
    return g;
}

}  // namespace

double saccade_profile(double u) noexcept {
    if (!(u > 0)) return 0;
    if (u >= 1) return 1;
    const double x = u * 10;
    const auto i = static_cast<std::size_t>(x);
    return kProfile[i] + (x - static_cast<double>(i)) * (kProfile[i + 1] - kProfile[i]);
}

Landing ballistic(const MotionFeatures& f, const Classified& now, std::int64_t t_ns) noexcept {
    const Grid& g = grid();
    const double since_ms = static_cast<double>(t_ns - now.onset_ns) * 1e-6;
    Landing result{};
    std::array<double, kAmplitudes * kOnsets> weight;
    double best = -1e300;
    for (std::size_t i = 0; i < kAmplitudes; ++i) {
        const double a = g.amplitude_deg[i];
        const double spread = 0.1 + 0.05 * a, inverse = 1 / (2 * spread * spread);
        const double start = g.log_prior[i] - static_cast<double>(kFits) * std::log(spread);
        for (std::size_t j = 0; j < kOnsets; ++j) {
            const double since = since_ms + kOnsetStep_ms * (static_cast<double>(j) - 2);
            const double here = saccade_profile(since / g.duration_ms[i]);
            double fit = start;
            for (std::size_t k = 1; k < 1 + kFits; ++k) {
                const double lag = static_cast<double>(kLags_ns[k]) * 1e-6;
                const double way = a * (here - saccade_profile((since - lag) / g.duration_ms[i]));
                const double off = way - f.came_deg[k];
                fit -= off * off * inverse;
            }
            weight[i * kOnsets + j] = fit;
            best = std::max(best, fit);
        }
    }
    double sum = 0;
    for (std::size_t i = 0; i < kAmplitudes; ++i)
        for (std::size_t j = 0; j < kOnsets; ++j) {
            const double w = std::exp(std::max(weight[i * kOnsets + j] - best, -60.0));
            if (w < 1e-4) continue;
            sum += w;
            result.amplitude_deg += w * g.amplitude_deg[i];
            const double since = since_ms + kOnsetStep_ms * (static_cast<double>(j) - 2);
            const double here = saccade_profile(since / g.duration_ms[i]);
            for (std::size_t h = 0; h < kAhead; ++h) {
                const double later = since + static_cast<double>(kHorizons_ns[h + 1]) * 1e-6;
                result.advance_deg[h] += w * g.amplitude_deg[i] * (saccade_profile(later / g.duration_ms[i]) - here);
            }
        }
    result.amplitude_deg = std::min(result.amplitude_deg / sum, MainSequence::kLargest_deg);  // the best has weight 1
    for (double& x : result.advance_deg) x = std::min(x / sum, MainSequence::kLargest_deg);
    return result;
}

}  // namespace fovea::pipeline
