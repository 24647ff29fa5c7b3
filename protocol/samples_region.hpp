// The samples region: every raw sample with the model made from it, and every frame report, for recorders and
// profilers. Gaze is biometric: the daemon hands this descriptor only to those whom the config grants raw samples.
//
//   word 0 magic kSamplesMagic | 1 abi (stored last) | 2 total size | 3 epoch | 4 sample capacity | 5 frame capacity
//   64 bytes: header, then the ring of samples, then (cache-line aligned) the ring of frames (broadcast_ring.hpp)
//
//   sample record   27 words of GazeSample, 145 words of MotionModel     model_words.hpp
//   frame record    client id, 66 words of FrameTiming
//
// Only the daemon writes; readers map it read-only, never hold anything up, and count what they lost.
//
// Threads: publish_sample() from one thread (the pipeline's), publish_frame() from one thread (the service's); a reader
// object belongs to one thread. Steady calls are noexcept and neither allocate nor lock.
#pragma once

#include "protocol/broadcast_ring.hpp"
#include "protocol/focus_region.hpp"
#include "protocol/frame_timing.hpp"

namespace fovea {

inline constexpr std::size_t kGazeSampleWords = 27;
inline constexpr std::size_t kFrameTimingWords = 14 + kMaxViews * 13;
inline constexpr std::size_t kSampleRecordWords = kGazeSampleWords + kModelWords;
inline constexpr std::size_t kFrameRecordWords = 1 + kFrameTimingWords;

struct SampleRecord {
    GazeSample raw;
    MotionModel model;   // as published for this sample
};

struct FrameRecord {
    std::uint64_t client_id = 0;   // Welcome::client_id of the client that reported it
    FrameTiming timing;            // validated
};

// Records kept; powers of two. The defaults let a recorder lag 8 s at 1000 Hz (11 MiB) and 20 s at 100 frames/s.
struct SamplesCapacity {
    std::size_t samples = 8192;   // 8 to 2^20
    std::size_t frames = 2048;    // 8 to 2^20
};

class SamplesPublisher {
public:
    // Errors: a capacity that is no power of two or out of range; no memory.
    [[nodiscard]] static Result<SamplesPublisher> create(const SamplesCapacity& capacity, std::uint64_t epoch);
    void publish_sample(const GazeSample& raw, const MotionModel& model) noexcept;
    void publish_frame(std::uint64_t client_id, const FrameTiming& timing) noexcept;
    [[nodiscard]] int fd() const noexcept { return memory_.fd(); }

private:
    SharedMemory memory_;
    BroadcastWriter<kSampleRecordWords> samples_;
    BroadcastWriter<kFrameRecordWords> frames_;
};

class SamplesReader {
public:
    // Starts with the oldest records that are still there; call skip_to_newest() to start with the next ones.
    // Errors: not a samples region, another ABI version, too small, or not sealed.
    [[nodiscard]] static Result<SamplesReader> map(int fd);

    [[nodiscard]] bool next_sample(SampleRecord& out) noexcept;   // false: nothing new
    [[nodiscard]] bool next_frame(FrameRecord& out) noexcept;
    void skip_to_newest() noexcept;
    [[nodiscard]] std::uint64_t lost_samples() const noexcept { return samples_.lost(); }
    [[nodiscard]] std::uint64_t lost_frames() const noexcept { return frames_.lost(); }

private:
    SharedMemory memory_;
    BroadcastReader<kSampleRecordWords> samples_;
    BroadcastReader<kFrameRecordWords> frames_;
};

}  // namespace fovea
