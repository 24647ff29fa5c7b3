#include "daemon/pipeline/motion_net.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::pipeline {
namespace {

// Linear near zero, a square root far out: degrees of very different size on one scale.
float compress(double x) noexcept { return static_cast<float>(x / std::sqrt(1 + std::fabs(x))); }
float squash(float x) noexcept { return x / (1 + std::fabs(x)); }

// Row by row, so that each output's sum is made in one fixed order whatever the vector width.
template <std::size_t Outputs>
std::array<float, Outputs> run(const float (&in)[kNetInputs][kNetHidden], const float (&in_bias)[kNetHidden],
                               const float (&out)[kNetHidden][Outputs], const float (&out_bias)[Outputs],
                               const NetInput& x) noexcept {
    float hidden[kNetHidden];
    for (std::size_t j = 0; j < kNetHidden; ++j) hidden[j] = in_bias[j];
    for (std::size_t i = 0; i < kNetInputs; ++i)
        for (std::size_t j = 0; j < kNetHidden; ++j) hidden[j] += in[i][j] * x[i];
    for (float& h : hidden) h = squash(h);
    std::array<float, Outputs> y;
    for (std::size_t k = 0; k < Outputs; ++k) y[k] = out_bias[k];
    for (std::size_t j = 0; j < kNetHidden; ++j)
        for (std::size_t k = 0; k < Outputs; ++k) y[k] += out[j][k] * hidden[j];
    return y;
}

}  // namespace

NetInput net_input(const MotionFeatures& f, double noise_deg_s, double since_onset_ms) noexcept {
    NetInput x;
    std::size_t n = 0;
    x[n++] = compress(f.speed_deg_s / 20);
    x[n++] = static_cast<float>(f.interval_ms / (f.interval_ms + 4));
    x[n++] = static_cast<float>(noise_deg_s / (noise_deg_s + 20));
    for (const double d : f.came_deg) x[n++] = compress(d / 0.3);
    for (const std::size_t lag : {std::size_t{4}, std::size_t{7}, std::size_t{9}}) x[n++] = compress(f.across_deg[lag] / 0.3);
    x[n++] = static_cast<float>(std::clamp(since_onset_ms, 0.0, 300.0) / 150 - 1);
    static_assert(kNetInputs == 3 + kLags_ns.size() + 3 + 1);
    return x;
}

std::array<float, kNetHorizons> net_advance(const NetInput& in, double speed_deg_s) noexcept {
    const AdvanceWeights& w = kAdvanceWeights;
    auto y = run(w.in, w.in_bias, w.out, w.out_bias, in);
    const float scale = static_cast<float>(speed_deg_s * 0.02);
    for (float& v : y) v *= scale;
    return y;
}

NetRadii net_radii(const NetInput& in) noexcept {
    const RadiusWeights& w = kRadiusWeights;
    const auto y = run(w.in, w.in_bias, w.out, w.out_bias, in);
    NetRadii r;
    for (std::size_t k = 0; k < kNetHorizons; ++k) {
        const float r68 = std::exp2(std::clamp(y[k], -8.0f, 6.0f));
        r.r68_deg[k] = r68;
        r.r95_deg[k] = r68 * std::exp2(std::clamp(y[kNetHorizons + k], 0.0f, 6.0f));
    }
    return r;
}

}  // namespace fovea::pipeline
