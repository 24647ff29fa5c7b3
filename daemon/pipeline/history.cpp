#include "daemon/pipeline/history.hpp"

#include <cmath>

namespace fovea::pipeline {

Tangent nearby(const TangentBasis<HeadFrame>& basis, Direction<HeadFrame> at, Direction<HeadFrame> d) noexcept {
    const Tangent chord{dot(basis.u, d.vec()), dot(basis.v, d.vec())};
    const double s2 = chord.u * chord.u + chord.v * chord.v;  // sin^2 of the angle
    if (dot(at.vec(), d.vec()) > 0) {
        // asin(s)/s as a series; at 40 degrees (s2 = 0.41) the next term is 2e-4 of the angle.
        const double k = 1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456 + s2 * 0.0224))));
        return k * chord;
    }
    const double s = std::sqrt(s2);
    const double k = s > 1e-12 ? 1.5707963267948966 / s : 0;
    return k * chord;
}

void History::push(std::int64_t t_ns, Direction<HeadFrame> d) noexcept {
    ring_[next_] = {t_ns, d};
    next_ = (next_ + 1) % kCapacity;
    if (size_ < kCapacity) ++size_;
}

Slope History::slope(std::int64_t window_ns, int at_least, std::size_t skip) const noexcept {
    Slope result;
    if (size_ < skip + 2) return result;
    const std::int64_t t0 = time_ns(skip);
    const Direction<HeadFrame> at = direction(skip);
    const TangentBasis<HeadFrame> basis(at);
    double n = 0, st = 0, stt = 0;
    Tangent sp, stp;
    double spp = 0;
    for (std::size_t i = skip; i < size_; ++i) {
        const std::int64_t age_ns = t0 - time_ns(i);
        if (age_ns > window_ns && static_cast<int>(n) >= at_least) break;
        const double t = -static_cast<double>(age_ns) * 1e-9;
        const Tangent p = nearby(basis, at, direction(i));
        n += 1;
        st += t;
        stt += t * t;
        sp = sp + p;
        stp = stp + t * p;
        spp += p.u * p.u + p.v * p.v;
        result.span_s = -t;
    }
    result.samples = static_cast<int>(n);
    const double sxx = stt - st * st / n;
    if (n < 2 || !(sxx > 1e-18)) {  // two stamps a nanosecond apart carry no velocity
        result.samples = 1;
        return result;
    }
    const Tangent sxy = stp - (st / n) * sp;
    result.velocity_rad_s = (1 / sxx) * sxy;
    if (n >= 3) {
        const double syy = spp - (sp.u * sp.u + sp.v * sp.v) / n;
        const double rest = syy - (sxy.u * sxy.u + sxy.v * sxy.v) / sxx;
        result.residual_rad = rest > 0 ? std::sqrt(rest / (2 * (n - 2))) : 0;
    }
    return result;
}

void Trail::push(std::int64_t t_ns, Direction<HeadFrame> d) noexcept {
    if (size_ > 0 && t_ns - time_ns(0) < spacing_ns_) return;
    ring_[next_] = {t_ns, d};
    next_ = (next_ + 1) % kCapacity;
    if (size_ < kCapacity) ++size_;
}

Direction<HeadFrame> Trail::at_or_before(std::int64_t t_ns, Direction<HeadFrame> otherwise) const noexcept {
    for (std::size_t i = 0; i < size_; ++i)
        if (time_ns(i) <= t_ns) return direction(i);
    return size_ > 0 ? direction(size_ - 1) : otherwise;
}

}  // namespace fovea::pipeline
