#include "daemon/pipeline/motion_net.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::pipeline {
namespace {

// Linear near zero, a square root far out: degrees of very different size on one scale.
float compress(double x) noexcept { return static_cast<float>(x / std::sqrt(1 + std::fabs(x))); }
Four squash(Four x) noexcept { return x / (1.0f + magnitude(x)); }

// bias + x * weights. Row by row, so that each sum is made in one fixed order; the sums stay in registers.
template <std::size_t Inputs, std::size_t Outputs>
void layer(const float (&weights)[Inputs][Outputs], const float (&bias)[Outputs], const float* x, Four (&sum)[Outputs / 4]) noexcept {
    constexpr std::size_t kFours = Outputs / 4;
    static_assert(Outputs % 4 == 0 && kFours <= 6);
#pragma GCC unroll 6
    for (std::size_t k = 0; k < kFours; ++k) sum[k] = load_four(bias + 4 * k);
    for (std::size_t i = 0; i < Inputs; ++i) {
#pragma GCC unroll 6
        for (std::size_t k = 0; k < kFours; ++k) sum[k] += load_four(weights[i] + 4 * k) * x[i];
    }
}

template <std::size_t Outputs>
void run(const float (&in)[kNetInputs][kNetHidden], const float (&in_bias)[kNetHidden], const float (&out)[kNetHidden][Outputs],
         const float (&out_bias)[Outputs], const NetInput& x, Four (&y)[Outputs / 4]) noexcept {
    Four sum[kNetHidden / 4];
    layer(in, in_bias, x.data(), sum);
    float hidden[kNetHidden];
    for (std::size_t k = 0; k < kNetHidden / 4; ++k) store_four(hidden + 4 * k, squash(sum[k]));
    layer(out, out_bias, hidden, y);
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

PerHorizon net_advance(const NetInput& in, double speed_deg_s) noexcept {
    const AdvanceWeights& w = kAdvanceWeights;
    Four y[kHorizonLanes / 4];
    run(w.in, w.in_bias, w.out, w.out_bias, in, y);
    const float scale = static_cast<float>(speed_deg_s * 0.02);
    PerHorizon advance;
    for (std::size_t k = 0; k < kHorizonLanes; k += 4) store_four(&advance[k], y[k / 4] * scale);
    return advance;
}

NetRadii net_radii(const NetInput& in) noexcept {
    const RadiusWeights& w = kRadiusWeights;
    Four y[2 * kHorizonLanes / 4];
    run(w.in, w.in_bias, w.out, w.out_bias, in, y);
    NetRadii r;
    for (std::size_t k = 0; k < kHorizonLanes; k += 4) {
        const Four r68 = exp2_four(at_most(at_least(y[k / 4], -8), 6));
        store_four(&r.r68_deg[k], r68);
        store_four(&r.r95_deg[k], r68 * exp2_four(at_most(at_least(y[(kHorizonLanes + k) / 4], 0), 6)));
    }
    return r;
}

}  // namespace fovea::pipeline
