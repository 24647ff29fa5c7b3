#include "daemon/pipeline/filter.hpp"

namespace fovea::pipeline {

Result<Filter> Filter::create(const PipelineSettings& s) {
    Filter f;
    if (s.filter == "one_euro")
        f.filter_.emplace<OneEuro>(s.one_euro);
    else if (s.filter != "none")
        return fail("there is no filter '" + s.filter + "'");
    return f;
}

Direction<HeadFrame> Filter::update(std::int64_t t_ns, Direction<HeadFrame> gaze_dir_head, const Classified&) noexcept {
    if (auto* f = std::get_if<OneEuro>(&filter_)) return f->update(t_ns, gaze_dir_head);
    return gaze_dir_head;
}

void Filter::reset() noexcept {
    if (auto* f = std::get_if<OneEuro>(&filter_)) f->reset();
}

}  // namespace fovea::pipeline
