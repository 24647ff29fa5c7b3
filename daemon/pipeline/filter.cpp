#include "daemon/pipeline/filter.hpp"

namespace fovea::pipeline {

Result<Filter> Filter::create(const PipelineSettings& s) {
    Filter f;
    if (s.filter == "one_euro") f.filter_.emplace<Euro>(OneEuro{s.one_euro});
    else if (s.filter == "kalman") f.filter_.emplace<Kalman>(Kalman{KalmanCv{s.kalman.acceleration_psd}, {}, {}, {}, 0});
    else if (s.filter == "saccade_aware") f.filter_.emplace<SaccadeAware>(s.saccade_aware);
    else if (s.filter != "none") return fail("there is no filter '" + s.filter + "'");
    return f;
}

Direction<HeadFrame> Filter::update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head, const Classified& now) noexcept {
    return std::visit([&](auto& f) { return f.update(t_ns, gaze_dir_head, now); }, filter_);
}

void Filter::reset() noexcept {
    std::visit([](auto& f) { f.reset(); }, filter_);
}

Direction<HeadFrame> Filter::Kalman::update(std::int64_t t, Direction<HeadFrame> d, const Classified&) noexcept {
    if (count >= 2)
        noise.update(d, before[0], before[1], static_cast<double>(t - before_ns[0]) * 1e-9,
                     static_cast<double>(before_ns[0] - before_ns[1]) * 1e-9);
    before = {d, before[0]};
    before_ns = {t, before_ns[0]};
    if (count < 2) ++count;
    return filter.update(t, d, noise.variance_rad2());
}

void Filter::Kalman::reset() noexcept {
    filter.reset();
    count = 0;
}

}  // namespace fovea::pipeline
