#include "daemon/pipeline/motion_net.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fovea::pipeline {
namespace {

// Linear near zero, a square root far out: degrees of very different size on one scale.
float compress(double x) noexcept { return static_cast<float>(x / std::sqrt(1 + std::fabs(x))); }
float squash(float x) noexcept { return x / (1 + std::fabs(x)); }

using Four [[gnu::vector_size(16)]] = float;   // what every x86-64 and aarch64 has

Four load(const float* from) noexcept {
    Four v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

// bias + x * weights. Row by row, so that each sum is made in one fixed order; the sums stay in registers.
template <std::size_t Inputs, std::size_t Outputs>
void layer(const float (&weights)[Inputs][Outputs], const float (&bias)[Outputs], const float* x, float* y) noexcept {
    constexpr std::size_t kFours = Outputs / 4;
    static_assert(Outputs % 4 == 0 && kFours <= 6);
    Four sum[kFours];
#pragma GCC unroll 6
    for (std::size_t k = 0; k < kFours; ++k) sum[k] = load(bias + 4 * k);
    for (std::size_t i = 0; i < Inputs; ++i) {
#pragma GCC unroll 6
        for (std::size_t k = 0; k < kFours; ++k) sum[k] += load(weights[i] + 4 * k) * x[i];
    }
    std::memcpy(y, sum, sizeof sum);
}

template <std::size_t Outputs>
std::array<float, Outputs> run(const float (&in)[kNetInputs][kNetHidden], const float (&in_bias)[kNetHidden],
                               const float (&out)[kNetHidden][Outputs], const float (&out_bias)[Outputs],
                               const NetInput& x) noexcept {
    float hidden[kNetHidden];
    layer(in, in_bias, x.data(), hidden);
    for (float& h : hidden) h = squash(h);
    std::array<float, Outputs> y;
    layer(out, out_bias, hidden, y.data());
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
    const auto y = run(w.in, w.in_bias, w.out, w.out_bias, in);
    const float scale = static_cast<float>(speed_deg_s * 0.02);
    std::array<float, kNetHorizons> advance;
    for (std::size_t k = 0; k < kNetHorizons; ++k) advance[k] = y[k] * scale;
    return advance;
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
