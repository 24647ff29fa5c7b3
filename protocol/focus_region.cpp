#include "protocol/focus_region.hpp"

#include <sys/random.h>

#include <new>

#include "protocol/model_words.hpp"

namespace fovea {
namespace {

constexpr int kReadAttempts = 8;   // each is refused only if the writer laps all slots during one copy

template <class GetEye>
bool copy_newest(const FocusRegion& region, MotionModel& model, std::uint8_t eyes, GetEye get_eye) noexcept {
    for (int attempt = 0; attempt < kReadAttempts; ++attempt) {
        const std::uint64_t latest = region.latest.load(std::memory_order_acquire);   // acquire: the slot is whole
        if (latest == 0) return false;
        const FocusSlot& slot = region.slots[latest % kFocusSlots];
        SeqlockReader r(slot.sequence, slot.words, latest);
        if (!r.whole()) continue;
        get(r, model, eyes, get_eye);
        if (r.still_whole()) return true;
    }
    return false;
}

// Tells one start of the daemon from the next; not a secret, so the clock serves where no random bytes are to be had.
std::uint64_t new_epoch(Instant now) noexcept {
    std::uint64_t epoch = 0;
    if (getrandom(&epoch, sizeof epoch, GRND_NONBLOCK) != sizeof epoch) epoch = static_cast<std::uint64_t>(to_ns(now));
    return epoch | 1;   // never 0
}

}  // namespace

Result<FocusPublisher> FocusPublisher::create(const LossPolicy& policy, Instant now) {
    auto memory = SharedMemory::create("fovea-focus", sizeof(FocusRegion), Access::daemon_writes);
    if (!memory) return std::unexpected(memory.error());
    FocusPublisher publisher;
    publisher.memory_ = std::move(*memory);
    publisher.epoch_ = new_epoch(now);
    FocusRegion& region = *new (publisher.memory_.data()) FocusRegion{};
    // relaxed: the release store of `abi` below publishes them
    region.magic.store(kFocusMagic, std::memory_order_relaxed);
    region.total_bytes.store(sizeof(FocusRegion), std::memory_order_relaxed);
    region.features.store(0, std::memory_order_relaxed);
    region.epoch.store(publisher.epoch_, std::memory_order_relaxed);
    region.daemon_pid.store(static_cast<std::uint64_t>(getpid()), std::memory_order_relaxed);
    publisher.set_policy(policy);
    publisher.beat(now);
    region.abi.store(kAbiVersion, std::memory_order_release);   // last: from here on the region may be read
    return publisher;
}

void FocusPublisher::publish(const MotionModel& model) noexcept {
    ++published_;
    FocusSlot& slot = region().slots[published_ % kFocusSlots];
    {
        SeqlockWriter w(slot.sequence, slot.words, published_);
        put(w, model);
    }
    region().latest.store(published_, std::memory_order_release);   // release: the slot is whole before it is named
}

void FocusPublisher::prefetch() const noexcept {
    const auto* const slot = reinterpret_cast<const char*>(&region().slots[(published_ + 1) % kFocusSlots]);
    // One eye's words; the other two are rarely there.
    for (std::size_t b = 0; b < (1 + kModelHeadWords + kEyeWords) * sizeof(Word); b += kCacheLine) __builtin_prefetch(slot + b, 1);
    __builtin_prefetch(&region().latest, 1);
}

void FocusPublisher::set_policy(const LossPolicy& policy) noexcept {
    ++policies_;
    PolicySlot& slot = region().policies[policies_ % 2];
    {
        SeqlockWriter w(slot.sequence, slot.words, policies_);
        w.put(word_of(policy.hold)), w.put(word_of(policy.ease)), w.put(word_of(policy.recover));
        put(w, policy.static_dir_head);
        w.put(word_of(policy.static_radius_rad));
    }
    region().latest_policy.store(policies_, std::memory_order_release);   // release: as in publish()
}

void FocusPublisher::beat(Instant now) noexcept {
    region().heartbeat_ns.store(word_of(now), std::memory_order_relaxed);   // relaxed: nothing hangs on it
}

Result<FocusReader> FocusReader::map(int fd) {
    auto memory = SharedMemory::map(fd, Access::daemon_writes, sizeof(FocusRegion), sizeof(FocusRegion));
    if (!memory) return std::unexpected(memory.error());
    FocusReader reader;
    reader.memory_ = std::move(*memory);
    const FocusRegion& region = reader.region();
    const std::uint64_t abi = region.abi.load(std::memory_order_acquire);   // acquire: the header is whole
    if (abi != kAbiVersion)
        return fail("the focus region has ABI version " + std::to_string(abi) + ", this library has " +
                        std::to_string(kAbiVersion),
                    {}, "install fovead and libfovea of the same release");
    if (region.magic.load(std::memory_order_relaxed) != kFocusMagic ||
        region.total_bytes.load(std::memory_order_relaxed) != sizeof(FocusRegion))
        return fail("the memory handed over is no focus region", {}, "the daemon is no fovead of this version");
    return reader;
}

bool FocusReader::read(MotionModel& model, std::uint8_t eyes) const noexcept {
    return copy_newest(region(), model, eyes, WholeModel{});
}

bool FocusReader::read_at(MotionModel& model, std::uint8_t eyes, Instant t) const noexcept {
    return copy_newest(region(), model, eyes, ModelAt{t});
}

std::optional<LossPolicy> FocusReader::new_policy() noexcept {
    const std::uint64_t latest = region().latest_policy.load(std::memory_order_acquire);   // acquire: as in read()
    if (latest == policy_seen_) return std::nullopt;
    const PolicySlot& slot = region().policies[latest % 2];
    SeqlockReader r(slot.sequence, slot.words, latest);
    if (!r.whole()) return std::nullopt;   // being replaced: the next call gets it
    LossPolicy policy;
    policy.hold = duration_of(r.get()), policy.ease = duration_of(r.get()), policy.recover = duration_of(r.get());
    get(r, policy.static_dir_head);
    policy.static_radius_rad = double_of(r.get());
    if (!r.still_whole()) return std::nullopt;
    policy_seen_ = latest;
    return policy;
}

// relaxed in all four: one word each, nothing hangs on it
std::uint64_t FocusReader::latest() const noexcept { return region().latest.load(std::memory_order_relaxed); }
Instant FocusReader::heartbeat() const noexcept {
    return instant_of(region().heartbeat_ns.load(std::memory_order_relaxed));
}
std::uint64_t FocusReader::epoch() const noexcept { return region().epoch.load(std::memory_order_relaxed); }
std::int64_t FocusReader::daemon_pid() const noexcept {
    return static_cast<std::int64_t>(region().daemon_pid.load(std::memory_order_relaxed));
}

}  // namespace fovea
