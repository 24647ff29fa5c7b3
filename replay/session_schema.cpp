#include "replay/session_schema.hpp"

#include <bit>
#include <cstring>

#include "protocol/error.hpp"

namespace fovea::replay {
namespace {

static_assert(std::endian::native == std::endian::little, "the BLOB is little-endian");
static_assert(kHorizons_ns.size() == 12, "another count of horizons is another session schema");

class Writer {
public:
    explicit Writer(std::string& out) : out_(out) {}
    template <class T>
    void put(T value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        out_.append(bytes, sizeof value);
    }

private:
    std::string& out_;
};

class Reader {
public:
    explicit Reader(const std::byte* in) : in_(in) {}
    template <class T>
    void take(T& value) {
        std::memcpy(&value, in_, sizeof value);
        in_ += sizeof value;
    }
    void take(Instant& value) {
        std::int64_t ns = 0;
        take(ns);
        value = instant_from_ns(ns);
    }

private:
    const std::byte* in_;
};

void encode(const EyeMotion& e, Writer w) {
    const auto direction = [&](const Direction<HeadFrame>& d) { w.put(d.x), w.put(d.y), w.put(d.z); };
    w.put(to_ns(e.reference));
    direction(e.gaze_dir_head);
    w.put(e.velocity_rad_s.u);
    w.put(e.velocity_rad_s.v);
    w.put(to_ns(e.saccade.onset));
    w.put(std::int64_t{e.saccade.duration.count()});
    direction(e.saccade.start_dir_head);
    direction(e.saccade.landing_dir_head);
    w.put(to_ns(e.valid_since));
    w.put(to_ns(e.lost_since));
    direction(e.held_dir_head);
    w.put(static_cast<std::uint32_t>(e.event));
    w.put(static_cast<std::uint32_t>(e.ever_valid));
    w.put(static_cast<std::uint32_t>(e.lost_before));
    w.put(std::uint32_t{0});
    for (const HorizonPoint& h : e.horizons)
        w.put(h.du_rad), w.put(h.dv_rad), w.put(h.radius68_rad), w.put(h.radius95_rad);
}

void decode(EyeMotion& e, Reader r) {
    const auto direction = [&](Direction<HeadFrame>& d) { r.take(d.x), r.take(d.y), r.take(d.z); };
    std::uint32_t word = 0;
    std::int64_t ns = 0;
    r.take(e.reference);
    direction(e.gaze_dir_head);
    r.take(e.velocity_rad_s.u);
    r.take(e.velocity_rad_s.v);
    r.take(e.saccade.onset);
    r.take(ns);
    e.saccade.duration = Duration{ns};
    direction(e.saccade.start_dir_head);
    direction(e.saccade.landing_dir_head);
    r.take(e.valid_since);
    r.take(e.lost_since);
    direction(e.held_dir_head);
    r.take(word);
    e.event = word <= static_cast<std::uint32_t>(GazeEvent::saccade) ? static_cast<GazeEvent>(word) : GazeEvent::lost;
    r.take(word);
    e.ever_valid = word != 0;
    r.take(word);
    e.lost_before = word != 0;
    r.take(word);
    for (HorizonPoint& h : e.horizons)
        r.take(h.du_rad), r.take(h.dv_rad), r.take(h.radius68_rad), r.take(h.radius95_rad);
}

}  // namespace

void encode_eyes(const MotionModel& model, std::string& out) {
    out.clear();
    for (std::size_t i = 0; i < kEyeCount; ++i)
        if ((model.eyes_present >> i) & 1u) {
            encode(model.eyes[i], Writer(out));
            FOVEA_REQUIRE(out.size() % kEyeBlobBytes == 0);
        }
}

bool decode_eyes(std::span<const std::byte> blob, MotionModel& model) {
    const unsigned present = model.eyes_present & 7u;
    if (blob.size() != static_cast<std::size_t>(std::popcount(present)) * kEyeBlobBytes) return false;
    const std::byte* next = blob.data();
    for (std::size_t i = 0; i < kEyeCount; ++i)
        if ((present >> i) & 1u) {
            decode(model.eyes[i], Reader(next));
            next += kEyeBlobBytes;
        }
    return true;
}

}  // namespace fovea::replay
