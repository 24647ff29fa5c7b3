// How the protocol's types are laid into 64-bit words, field by field: no padding, no compiler's choice, no bool or enum
// whose bits could be illegal. A double, a Duration or an Instant is one word (its bits); two floats share one.
//
//   model     0 sequence | 1 sample id | 2 exposed | 3 received | 4 filtered | 5 published | 6 flags | eyes 3 x 46
//             flags: bit 0 exposed_estimated, bits 8-15 eyes_present
//   eye       0 reference | 1-3 gaze_dir_head | 4 flags | 5 valid_since | 6 lost_since | 7-9 held_dir_head
//             10-33 twelve horizons x {du, dv | radius68, radius95}   - a latch reads 0-6 and the two that it needs;
//             34-35 velocity | 36 saccade onset | 37 duration | 38-40 start | 41-43 landing | 44-45 reserved
//             flags: bits 0-7 event, bit 8 ever_valid, bit 9 lost_before
//   sample    0 id | 1 device time | 2 exposed | 3 received | 4 flags | 5-22 eyes x {dir 3, openness, pupil, confidence}
//             23-26 world_from_head w, x, y, z
//             flags: bit 0 exposed_estimated, bits 1-3 eye valid, bit 4 head valid
//   frame     0 frame | 1 model sequence | 2 sample id | 3-6 exposed, received, filtered, published
//             7-10 latched, submitted, gpu_done, photon | 11 predicted photon | 12 pixels shaded | 13 pixels full
//             14 + 13v: view v: flags | fov left, right, up, down | head_from_view w, x, y, z | center x, y | half w, h
//             view flags: bits 0-7 eye; of view 0 also bits 8-15 view_count, 16 exposed_estimated, 17 photon_simulated,
//             18 extrapolated, 19 photon_estimated
//
// Any words decode into some value; whether it makes sense is the caller's to check. Two daemons of one version write
// the same words for the same values.
//
// Threads: pure functions on the writer and the reader that the caller owns.
#pragma once

#include <bit>

#include "protocol/focus_region.hpp"
#include "protocol/frame_timing.hpp"
#include "protocol/samples_region.hpp"

namespace fovea {

[[nodiscard]] inline std::uint64_t word_of(double v) noexcept { return std::bit_cast<std::uint64_t>(v); }
[[nodiscard]] inline std::uint64_t word_of(Instant t) noexcept { return static_cast<std::uint64_t>(to_ns(t)); }
[[nodiscard]] inline std::uint64_t word_of(Duration d) noexcept { return static_cast<std::uint64_t>(d.count()); }
[[nodiscard]] inline double double_of(std::uint64_t w) noexcept { return std::bit_cast<double>(w); }
[[nodiscard]] inline Instant instant_of(std::uint64_t w) noexcept { return instant_from_ns(static_cast<std::int64_t>(w)); }
[[nodiscard]] inline Duration duration_of(std::uint64_t w) noexcept { return Duration{static_cast<std::int64_t>(w)}; }

// A HorizonPoint is two words as it stands: its four floats in order, little-endian.
inline constexpr std::size_t kEyeHorizonsAt = 10;
static_assert(sizeof(HorizonPoint) == 16 && std::endian::native == std::endian::little);

template <class Frame>
void put(SeqlockWriter& w, Direction<Frame> d) noexcept {
    w.put(word_of(d.x)), w.put(word_of(d.y)), w.put(word_of(d.z));
}
template <class Frame>
void get(SeqlockReader& r, Direction<Frame>& d) noexcept {
    d.x = double_of(r.get()), d.y = double_of(r.get()), d.z = double_of(r.get());
}

inline void put(SeqlockWriter& w, const EyeMotion& m) noexcept {
    w.put(word_of(m.reference));
    put(w, m.gaze_dir_head);
    w.put(static_cast<std::uint64_t>(m.event) | std::uint64_t{m.ever_valid} << 8 | std::uint64_t{m.lost_before} << 9);
    w.put(word_of(m.valid_since)), w.put(word_of(m.lost_since));
    put(w, m.held_dir_head);
    for (const HorizonPoint& h : m.horizons) {
        const auto words = std::bit_cast<std::array<std::uint64_t, 2>>(h);
        w.put(words[0]), w.put(words[1]);
    }
    w.put(word_of(m.velocity_rad_s.u)), w.put(word_of(m.velocity_rad_s.v));
    w.put(word_of(m.saccade.onset)), w.put(word_of(m.saccade.duration));
    put(w, m.saccade.start_dir_head);
    put(w, m.saccade.landing_dir_head);
    w.skip(2);
}

// The words before the horizons: all that does not depend on the time that is asked for.
// The held gaze means nothing without lost_before; `whole` copies it all the same.
inline void get_head(SeqlockReader& r, EyeMotion& m, bool whole) noexcept {
    m.reference = instant_of(r.get());
    get(r, m.gaze_dir_head);
    const std::uint64_t flags = r.get();
    const auto event = static_cast<std::uint8_t>(flags);
    m.event = event <= static_cast<std::uint8_t>(GazeEvent::saccade) ? static_cast<GazeEvent>(event) : GazeEvent::lost;
    m.ever_valid = (flags >> 8 & 1) != 0;
    m.lost_before = (flags >> 9 & 1) != 0;
    m.valid_since = instant_of(r.get()), m.lost_since = instant_of(r.get());
    if (m.lost_before || whole)
        get(r, m.held_dir_head);
    else
        r.skip(3);
}
inline void get(SeqlockReader& r, HorizonPoint& h) noexcept {
    const std::uint64_t displacement = r.get(), radii = r.get();
    h = std::bit_cast<HorizonPoint>(std::array{displacement, radii});
}

struct WholeModel {
    void operator()(SeqlockReader& r, EyeMotion& m) const noexcept {
        get_head(r, m, true);
        for (HorizonPoint& h : m.horizons) get(r, h);
        m.velocity_rad_s.u = double_of(r.get()), m.velocity_rad_s.v = double_of(r.get());
        m.saccade.onset = instant_of(r.get()), m.saccade.duration = duration_of(r.get());
        get(r, m.saccade.start_dir_head);
        get(r, m.saccade.landing_dir_head);
        r.skip(2);
    }
};
// What evaluate() at time t looks at; the other horizons, the velocity and the saccade stay as they are.
struct ModelAt {
    Instant t;
    void operator()(SeqlockReader& r, EyeMotion& m) const noexcept {
        get_head(r, m, false);
        const std::size_t i = horizon_before(m.reference, t);
        r.skip(2 * i);
        get(r, m.horizons[i]);
        get(r, m.horizons[i + 1]);
        r.skip(kEyeWords - kEyeHorizonsAt - 2 * (i + 2));
    }
};

// Of the eyes those in eyes_present, and the combined one always.
inline void put(SeqlockWriter& w, const MotionModel& m) noexcept {
    w.put(m.sequence), w.put(m.sample_id);
    w.put(word_of(m.exposed)), w.put(word_of(m.received)), w.put(word_of(m.filtered)), w.put(word_of(m.published));
    w.put(std::uint64_t{m.exposed_estimated} | static_cast<std::uint64_t>(m.eyes_present) << 8);
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        if (e == 0 || (m.eyes_present >> e & 1) != 0)
            put(w, m.eyes[e]);
        else
            w.skip(kEyeWords);
    }
}

// Of the eyes those in `eyes` (bits); for one that is not there, the combined one.
template <class GetEye = WholeModel>
void get(SeqlockReader& r, MotionModel& m, std::uint8_t eyes, GetEye get_eye = {}) noexcept {
    m.sequence = r.get(), m.sample_id = r.get();
    m.exposed = instant_of(r.get()), m.received = instant_of(r.get());
    m.filtered = instant_of(r.get()), m.published = instant_of(r.get());
    const std::uint64_t flags = r.get();
    m.exposed_estimated = (flags & 1) != 0;
    m.eyes_present = static_cast<std::uint8_t>((flags >> 8 & kAllEyes) | 1);
    unsigned wanted = eyes & m.eyes_present;
    if (wanted != eyes || wanted == 0) wanted |= 1;
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        if ((wanted >> e & 1) != 0)
            get_eye(r, m.eyes[e]);
        else
            r.skip(kEyeWords);
    }
}

// Defined in model_words.cpp: the records that no client waits for.
void put(SeqlockWriter& w, const GazeSample& s) noexcept;
void get(SeqlockReader& r, GazeSample& s) noexcept;

using FrameWords = std::array<std::uint64_t, kFrameTimingWords>;
[[nodiscard]] FrameWords to_words(const FrameTiming& t) noexcept;
// view_count and the eyes come out as they stand, legal or not (a bad eye as 255): check() of frames_region.hpp judges.
[[nodiscard]] FrameTiming frame_from_words(const FrameWords& words) noexcept;

}  // namespace fovea
