#include "render/layer/entry_points.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "layer_gl.hpp"

namespace fovea::layer {
namespace {

// By row; a stub jumps to what its slot holds. nullptr: not rewritten. libglvnd restores its stubs before it unloads a vendor.
using Slot = std::atomic<void*>;
static_assert(sizeof(Slot) == sizeof(void*) && Slot::is_always_lock_free);
constexpr std::size_t kMostRows = 4096;
Slot* slots() noexcept {
    static constinit Slot all[kMostRows];  // in the library: near the stubs, as libraries are
    return all;
}

// jmp [rip + distance of the slot], or where that is too far: movabs r11, slot; jmp [r11]. r11 is nobody's at a call (System V
// ABI for x86-64, 3.2.3); the stubs of libglvnd use it too, and have no endbr64 either.
constexpr std::uint8_t kNear[] = {0xff, 0x25}, kFar[] = {0x49, 0xbb}, kFarTail[] = {0x41, 0xff, 0x23};
constexpr int kStubBytes = sizeof kFar + sizeof(std::int64_t) + sizeof kFarTail;

void write_stub(void* to, const void* runs_at, const Slot* slot) noexcept {
    auto* at = static_cast<std::uint8_t*>(to);
    constexpr int kBreak = 0xcc;  // int3: nothing runs past a jump, not even speculatively
    std::memset(at, kBreak, kStubBytes);
    const auto address = reinterpret_cast<std::int64_t>(slot);
    const std::int64_t distance = address - (reinterpret_cast<std::int64_t>(runs_at) + static_cast<std::int64_t>(sizeof kNear + sizeof(std::int32_t)));
    if (const auto near = static_cast<std::int32_t>(distance); near == distance) {
        std::memcpy(at, kNear, sizeof kNear);
        std::memcpy(at + sizeof kNear, &near, sizeof near);
        return;
    }
    std::memcpy(at, kFar, sizeof kFar);
    std::memcpy(at + sizeof kFar, &address, sizeof address);
    std::memcpy(at + sizeof kFar + sizeof address, kFarTail, sizeof kFarTail);
}

// Relaxed: whoever draws with what another thread has foveated was told so by it.
void use_wrappers() noexcept {
    Slot* slot = slots();
    for (unsigned i = 0; i < kRowCount && i < kMostRows; ++i)
        if (kRows[i].idle && slot[i].load(std::memory_order_relaxed)) slot[i].store(kRows[i].wrapper, std::memory_order_relaxed);
}

}  // namespace

bool can_rewrite_stubs([[maybe_unused]] int bytes) noexcept {
#if defined(__x86_64__) && !defined(__ILP32__)
    return bytes >= kStubBytes;
#else
    return false;
#endif
}

void rewrite_stubs(LookupStub lookup, void* (*address)(const char*), void* (*driver_address)(const char*)) {
    Slot* slot = slots();
    for (unsigned i = 0; i < kRowCount && i < kMostRows; ++i) {
        const Row& row = kRows[i];
        void* to = nullptr;
        const void* runs_at = nullptr;
        void* found = address(row.name);  // fills the slot of the driver's function that the wrapper calls
        if (!found || !lookup(row.name, &to, &runs_at)) continue;
        slot[i].store(row.idle ? driver_address(row.name) : found, std::memory_order_relaxed);
        write_stub(to, runs_at, &slot[i]);
    }
    if (gl.anything_to_do.load(std::memory_order_relaxed)) use_wrappers();
}

void engage() noexcept {
    if (gl.anything_to_do.exchange(true, std::memory_order_relaxed)) return;
    use_wrappers();
}

}  // namespace fovea::layer
