#include "protocol/samples_region.hpp"

#include <bit>
#include <new>
#include <string>

#include "protocol/model_words.hpp"

namespace fovea {
namespace {

struct SamplesHeader {
    alignas(kCacheLine) Word magic;
    Word abi, total_bytes, epoch, sample_capacity, frame_capacity;
};
static_assert(sizeof(SamplesHeader) == kCacheLine);

using SampleRing = BroadcastRing<kSampleRecordWords>;
using FrameRing = BroadcastRing<kFrameRecordWords>;

constexpr std::size_t kMinCapacity = 8, kMaxCapacity = std::size_t{1} << 20;

bool legal(std::uint64_t capacity) noexcept {
    return std::has_single_bit(capacity) && capacity >= kMinCapacity && capacity <= kMaxCapacity;
}
std::size_t aligned(std::size_t bytes) noexcept { return (bytes + kCacheLine - 1) / kCacheLine * kCacheLine; }

struct Layout {
    std::size_t samples, frames, total;
    explicit Layout(const SamplesCapacity& c) noexcept
        : samples{sizeof(SamplesHeader)},
          frames{samples + aligned(SampleRing::bytes(c.samples))},
          total{frames + FrameRing::bytes(c.frames)} {}
};

Word* words_at(const SharedMemory& memory, std::size_t offset) noexcept {
    return reinterpret_cast<Word*>(memory.data() + offset);
}

}  // namespace

Result<SamplesPublisher> SamplesPublisher::create(const SamplesCapacity& capacity, std::uint64_t epoch) {
    if (!legal(capacity.samples) || !legal(capacity.frames))
        return fail("a ring of " + std::to_string(capacity.samples) + " samples and " + std::to_string(capacity.frames) +
                        " frames is not possible",
                    {}, "use powers of two from 8 to 1048576");
    const Layout layout(capacity);
    auto memory = SharedMemory::create("fovea-samples", layout.total, Access::daemon_writes);
    if (!memory) return std::unexpected(memory.error());
    SamplesPublisher publisher;
    publisher.memory_ = std::move(*memory);
    publisher.samples_ = BroadcastWriter(SampleRing(words_at(publisher.memory_, layout.samples), capacity.samples));
    publisher.frames_ = BroadcastWriter(FrameRing(words_at(publisher.memory_, layout.frames), capacity.frames));
    SamplesHeader& header = *new (publisher.memory_.data()) SamplesHeader{};
    // relaxed: the release store of `abi` publishes them
    header.magic.store(kSamplesMagic, std::memory_order_relaxed);
    header.total_bytes.store(layout.total, std::memory_order_relaxed);
    header.epoch.store(epoch, std::memory_order_relaxed);
    header.sample_capacity.store(capacity.samples, std::memory_order_relaxed);
    header.frame_capacity.store(capacity.frames, std::memory_order_relaxed);
    header.abi.store(kAbiVersion, std::memory_order_release);
    return publisher;
}

void SamplesPublisher::publish_sample(const GazeSample& raw, const MotionModel& model) noexcept {
    samples_.write([&](SeqlockWriter& w) {
        put(w, raw);
        put(w, model);
    });
}

void SamplesPublisher::publish_frame(std::uint64_t client_id, const FrameTiming& timing) noexcept {
    frames_.write([&](SeqlockWriter& w) {
        w.put(client_id);
        for (const std::uint64_t word : to_words(timing)) w.put(word);
    });
}

Result<SamplesReader> SamplesReader::map(int fd) {
    const Layout smallest({kMinCapacity, kMinCapacity}), largest({kMaxCapacity, kMaxCapacity});
    auto memory = SharedMemory::map(fd, Access::daemon_writes, smallest.total, largest.total);
    if (!memory) return std::unexpected(memory.error());
    SamplesReader reader;
    reader.memory_ = std::move(*memory);
    const auto& header = *reinterpret_cast<const SamplesHeader*>(reader.memory_.data());
    const std::uint64_t abi = header.abi.load(std::memory_order_acquire);   // acquire: the header is whole
    if (abi != kAbiVersion)
        return fail("the samples region has ABI version " + std::to_string(abi) + ", this program has " +
                        std::to_string(kAbiVersion),
                    {}, "install fovead and its clients of the same release");
    const SamplesCapacity capacity{header.sample_capacity.load(std::memory_order_relaxed),
                                   header.frame_capacity.load(std::memory_order_relaxed)};
    if (header.magic.load(std::memory_order_relaxed) != kSamplesMagic || !legal(capacity.samples) ||
        !legal(capacity.frames) || Layout(capacity).total != reader.memory_.size())
        return fail("the memory handed over is no samples region", {}, "the daemon is no fovead of this version");
    const Layout layout(capacity);
    reader.samples_ = BroadcastReader(SampleRing(words_at(reader.memory_, layout.samples), capacity.samples));
    reader.frames_ = BroadcastReader(FrameRing(words_at(reader.memory_, layout.frames), capacity.frames));
    return reader;
}

bool SamplesReader::next_sample(SampleRecord& out) noexcept {
    return samples_.read([&](SeqlockReader& r) {
        get(r, out.raw);
        get(r, out.model, kAllEyes);
    });
}

bool SamplesReader::next_frame(FrameRecord& out) noexcept {
    FrameWords words;
    const bool any = frames_.read([&](SeqlockReader& r) {
        out.client_id = r.get();
        for (std::uint64_t& word : words) word = r.get();
    });
    if (any) out.timing = frame_from_words(words);
    return any;
}

void SamplesReader::skip_to_newest() noexcept {
    samples_.skip_to_newest();
    frames_.skip_to_newest();
}

}  // namespace fovea
