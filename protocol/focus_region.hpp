// The focus region: this header is the memory layout of what every client maps, and who may touch what.
//
//   word  0        magic kFocusMagic                          written once, before abi
//         1        abi kAbiVersion                            stored LAST with release: a region without it is not ready
//         2        total size, bytes                          |
//         3        feature bits (0)                           | written once, before abi
//         4        writer epoch: random, one per daemon start |
//         5        process id of the daemon                   |
//         8        heartbeat, ns of CLOCK_MONOTONIC           by beat(), by its one thread
//        16        latest: number of the newest whole model   by publish(), release, after the slot is whole
//        24        latest policy, the same for the two policy slots
//        32 + 16p  policy slot p = number % 2:   [sequence][hold ns][ease ns][recover ns][x][y][z][radius]
//        64 + 152s model slot s = number % 8:    [sequence][7 words of the model][3 eyes x 46 words][padding]
//
//        writer                                              reader
//        fill slot (n+1) % 8 (seqlock.hpp)                   n = latest (acquire)
//        latest = n+1 (release)                              copy slot n % 8; still whole? done, else again (bounded)
//
// The newest whole slot is never the one being written: a writer that is preempted or killed in mid-write blocks no
// reader. A reader is refused only if the writer laps all 8 slots during one copy.
// Only the daemon writes: the region is sealed and clients cannot map it writable (shared_memory.hpp).
//
// Threads: FocusPublisher: publish() and set_policy() from one thread each, beat() from one thread; FocusReader: one
// thread at a time per object, any number of objects. Steady calls are noexcept and neither allocate nor lock.
#pragma once

#include <cstddef>
#include <optional>

#include "protocol/abi.hpp"
#include "protocol/loss_policy.hpp"
#include "protocol/motion_model.hpp"
#include "protocol/seqlock.hpp"
#include "protocol/shared_memory.hpp"

namespace fovea {

inline constexpr Duration kHeartbeatPeriod = std::chrono::milliseconds(50);   // the daemon beats at least this often
inline constexpr Duration kHeartbeatStale = std::chrono::milliseconds(250);   // five missed beats: the daemon is not live

inline constexpr std::size_t kFocusSlots = 8;
inline constexpr std::size_t kModelHeadWords = 7;
inline constexpr std::size_t kEyeWords = 46;   // layout: model_words.hpp
inline constexpr std::size_t kModelWords = kModelHeadWords + kEyeCount * kEyeWords;
inline constexpr std::size_t kPolicyWords = 7;

struct FocusSlot {
    alignas(kCacheLine) Word sequence;
    Word words[kModelWords];
};
static_assert(sizeof(FocusSlot) == 152 * 8);

struct PolicySlot {
    alignas(2 * kCacheLine) Word sequence;
    Word words[kPolicyWords];
};
static_assert(sizeof(PolicySlot) == 16 * 8);

struct FocusRegion {
    Word magic, abi, total_bytes, features, epoch, daemon_pid;
    alignas(kCacheLine) Word heartbeat_ns;
    alignas(kCacheLine) Word latest;
    alignas(kCacheLine) Word latest_policy;
    alignas(2 * kCacheLine) PolicySlot policies[2];
    alignas(kCacheLine) FocusSlot slots[kFocusSlots];
};
static_assert(offsetof(FocusRegion, heartbeat_ns) == 8 * 8 && offsetof(FocusRegion, latest) == 16 * 8 &&
              offsetof(FocusRegion, latest_policy) == 24 * 8 && offsetof(FocusRegion, policies) == 32 * 8 &&
              offsetof(FocusRegion, slots) == 64 * 8);

// The daemon's side. Owns the only writable mapping.
class FocusPublisher {
public:
    // Errors: no memory, or a kernel without F_SEAL_FUTURE_WRITE (before 5.1).
    [[nodiscard]] static Result<FocusPublisher> create(const LossPolicy& policy, Instant now);

    // Makes `model` the newest, as it stands (sequence and instants are the caller's). Eyes that are not in
    // eyes_present are not copied. Cost: fovea_bench BM_Publish.
    void publish(const MotionModel& model) noexcept;
    // Asks for the memory that the next publish() will write; from publish()'s thread.
    void prefetch() const noexcept;
    void set_policy(const LossPolicy& policy) noexcept;
    void beat(Instant now) noexcept;

    [[nodiscard]] int fd() const noexcept { return memory_.fd(); }   // for SCM_RIGHTS; stays owned here
    [[nodiscard]] std::uint64_t epoch() const noexcept { return epoch_; }

private:
    [[nodiscard]] FocusRegion& region() const noexcept { return *reinterpret_cast<FocusRegion*>(memory_.data()); }
    SharedMemory memory_;
    std::uint64_t published_ = 0, policies_ = 0, epoch_ = 0;
};

constexpr std::uint8_t eye_bit(Eye e) noexcept { return static_cast<std::uint8_t>(1u << static_cast<unsigned>(e)); }
inline constexpr std::uint8_t kAllEyes = 7;

// A client's side, read-only.
class FocusReader {
public:
    // Errors: not a focus region, another ABI version, too small, or not sealed.
    [[nodiscard]] static Result<FocusReader> map(int fd);

    // Copies the newest model. Of the eyes only those of `eyes` (bits, eye_bit()) that the model has; where it has not,
    // the combined one, so that model.eye(e) is right for every e asked for. False: nothing published yet, or the
    // writer lapped every attempt ("no fresh answer"); `model` is then unspecified.
    [[nodiscard]] bool read(MotionModel& model, std::uint8_t eyes = kAllEyes) const noexcept;
    // The same for one latch: of each eye copies only what evaluate() at `t` looks at; the rest of `model` stays.
    [[nodiscard]] bool read_at(MotionModel& model, std::uint8_t eyes, Instant t) const noexcept;
    // The policy, if it is newer than the one this object returned last.
    [[nodiscard]] std::optional<LossPolicy> new_policy() noexcept;
    // Models published so far by this daemon; changes exactly when read() has something new.
    [[nodiscard]] std::uint64_t latest() const noexcept;
    [[nodiscard]] Instant heartbeat() const noexcept;
    [[nodiscard]] std::uint64_t epoch() const noexcept;
    [[nodiscard]] std::int64_t daemon_pid() const noexcept;

private:
    [[nodiscard]] const FocusRegion& region() const noexcept {
        return *reinterpret_cast<const FocusRegion*>(memory_.data());
    }
    SharedMemory memory_;
    std::uint64_t policy_seen_ = 0;
};

}  // namespace fovea
