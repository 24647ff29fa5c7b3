#include "daemon/pipeline/history.hpp"

#include <cmath>

namespace fovea::pipeline {

std::optional<Direction<HeadFrame>> far::unit(Vec3<HeadFrame> v) noexcept { return Direction<HeadFrame>::from(v); }
Tangent far::way_to(const Plane& from, Direction<HeadFrame> to) noexcept { return log_map(from.at, to); }
Direction<HeadFrame> far::reached(const Plane& from, Tangent t) noexcept { return exp_map(from.at, t); }
Tangent far::nearby(Tangent chord) noexcept {
    const double s = norm(chord);
    return (s > 1e-12 ? 1.5707963267948966 / s : 0) * chord;
}

void History::push(std::int64_t t_ns, Direction<HeadFrame> d) noexcept {
    ring_[next_] = {t_ns, d};
    next_ = (next_ + 1) % kCapacity;
    if (size_ < kCapacity) ++size_;
    plane_ = Plane(d);
}

std::size_t History::within(std::int64_t window_ns, std::size_t at_least) const noexcept {
    if (size_ == 0) return 0;
    const std::int64_t t0 = time_ns(0);
    std::size_t n = 1;
    while (n < size_ && (n < at_least || t0 - time_ns(n) <= window_ns)) ++n;
    return n;
}

Slope History::slope(std::size_t samples) const noexcept {
    Slope result;
    result.samples = samples < 1 ? 0 : 1;
    if (samples < 2) return result;
    const std::int64_t t0 = time_ns(0);
    if (samples == 2) {
        const double t = -static_cast<double>(t0 - time_ns(1)) * 1e-9;
        result.span_s = -t;
        if (!(t * t > 2e-18)) return result;  // two stamps a nanosecond apart carry no velocity
        result.samples = 2;
        result.velocity_rad_s = (1 / t) * nearby(plane_, direction(1));
        return result;
    }
    double st = 0, stt = 0;   // the newest is at 0, in time and place
    Tangent sp, stp;
    for (std::size_t i = 1; i < samples; ++i) {
        const double t = -static_cast<double>(t0 - time_ns(i)) * 1e-9;
        const Tangent p = nearby(plane_, direction(i));
        st += t;
        stt += t * t;
        sp = sp + p;
        stp = stp + t * p;
        result.span_s = -t;
    }
    const double n = static_cast<double>(samples);
    const double sxx = stt - st * st / n;
    if (!(sxx > 1e-18)) return result;
    result.samples = static_cast<int>(samples);
    result.velocity_rad_s = (1 / sxx) * (stp - (st / n) * sp);
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
