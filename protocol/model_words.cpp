#include "protocol/model_words.hpp"

namespace fovea {

void put(SeqlockWriter& w, const GazeSample& s) noexcept {
    w.put(s.id), w.put(static_cast<std::uint64_t>(s.device_time.ns));
    w.put(word_of(s.exposed)), w.put(word_of(s.received));
    std::uint64_t flags = std::uint64_t{s.exposed_estimated} | std::uint64_t{s.head.valid} << 4;
    for (std::size_t e = 0; e < kEyeCount; ++e) flags |= std::uint64_t{s.eyes[e].valid} << (1 + e);
    w.put(flags);
    for (const EyeState& eye : s.eyes) {
        put(w, eye.gaze_dir_head);
        w.put(word_of(eye.openness)), w.put(word_of(eye.pupil_mm)), w.put(word_of(eye.confidence));
    }
    const auto& q = s.head.world_from_head;
    w.put(word_of(q.w)), w.put(word_of(q.x)), w.put(word_of(q.y)), w.put(word_of(q.z));
}

void get(SeqlockReader& r, GazeSample& s) noexcept {
    s.id = r.get(), s.device_time.ns = static_cast<std::int64_t>(r.get());
    s.exposed = instant_of(r.get()), s.received = instant_of(r.get());
    const std::uint64_t flags = r.get();
    s.exposed_estimated = (flags & 1) != 0;
    s.head.valid = (flags >> 4 & 1) != 0;
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        EyeState& eye = s.eyes[e];
        eye.valid = (flags >> (1 + e) & 1) != 0;
        get(r, eye.gaze_dir_head);
        eye.openness = double_of(r.get()), eye.pupil_mm = double_of(r.get()), eye.confidence = double_of(r.get());
    }
    auto& q = s.head.world_from_head;
    q.w = double_of(r.get()), q.x = double_of(r.get()), q.y = double_of(r.get()), q.z = double_of(r.get());
}

FrameWords to_words(const FrameTiming& t) noexcept {
    FrameWords words{};
    std::size_t i = 0;
    const auto put = [&](std::uint64_t v) { words[i++] = v; };
    put(t.frame), put(t.model_sequence), put(t.sample_id);
    for (const Instant instant : {t.exposed, t.received, t.filtered, t.published, t.latched, t.submitted, t.gpu_done,
                                  t.photon, t.predicted_photon})
        put(word_of(instant));
    put(t.pixels_shaded), put(t.pixels_full);
    for (std::size_t v = 0; v < kMaxViews; ++v) {
        const ViewFovea& view = t.views[v];
        std::uint64_t flags = static_cast<std::uint64_t>(view.eye);
        if (v == 0)
            flags |= static_cast<std::uint64_t>(t.view_count & 0xff) << 8 | std::uint64_t{t.exposed_estimated} << 16 |
                     std::uint64_t{t.photon_simulated} << 17 | std::uint64_t{t.kind == FrameKind::extrapolated} << 18 | std::uint64_t{t.photon_estimated} << 19;
        put(flags);
        const auto& q = view.head_from_view;
        for (const double d : {view.fov.tan_left, view.fov.tan_right, view.fov.tan_up, view.fov.tan_down, q.w, q.x, q.y,
                               q.z, view.center_ndc.x, view.center_ndc.y, view.half_width_ndc, view.half_height_ndc})
            put(word_of(d));
    }
    return words;
}

FrameTiming frame_from_words(const FrameWords& words) noexcept {
    FrameTiming t;
    std::size_t i = 0;
    const auto get = [&] { return words[i++]; };
    t.frame = get(), t.model_sequence = get(), t.sample_id = get();
    for (Instant* instant : {&t.exposed, &t.received, &t.filtered, &t.published, &t.latched, &t.submitted, &t.gpu_done,
                             &t.photon, &t.predicted_photon})
        *instant = instant_of(get());
    t.pixels_shaded = get(), t.pixels_full = get();
    for (std::size_t v = 0; v < kMaxViews; ++v) {
        ViewFovea& view = t.views[v];
        const std::uint64_t flags = get();
        view.eye = static_cast<Eye>(flags & 0xff);
        if (v == 0) {
            t.view_count = static_cast<std::uint32_t>(flags >> 8 & 0xff);
            t.exposed_estimated = (flags >> 16 & 1) != 0;
            t.photon_simulated = (flags >> 17 & 1) != 0;
            t.photon_estimated = (flags >> 19 & 1) != 0;
            t.kind = (flags >> 18 & 1) != 0 ? FrameKind::extrapolated : FrameKind::rendered;
        }
        auto& q = view.head_from_view;
        for (double* d : {&view.fov.tan_left, &view.fov.tan_right, &view.fov.tan_up, &view.fov.tan_down, &q.w, &q.x,
                          &q.y, &q.z, &view.center_ndc.x, &view.center_ndc.y, &view.half_width_ndc,
                          &view.half_height_ndc})
            *d = double_of(get());
    }
    return t;
}

}  // namespace fovea
