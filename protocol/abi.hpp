// The version and the magic numbers of everything that crosses the process boundary.
//
// ABI rules (docs/protocol.md): any change to the layout of a region or to the meaning of a word raises kAbiVersion;
// a daemon and a client of different versions refuse each other in words. The first 16 bytes of every message and the
// whole refusal message never change, so that a refusal can be read across versions.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fovea {

inline constexpr std::uint32_t kAbiVersion = 2;   // 2: a frame report says whether the frame was rendered or extrapolated

// First word of each region, and first half word of each message: what is this?
inline constexpr std::uint64_t kFocusMagic = 0x5355434f'46564f46;    // "FOVFOCUS", little-endian
inline constexpr std::uint64_t kSamplesMagic = 0x4c504d53'46564f46;  // "FOVFSMPL"
inline constexpr std::uint64_t kFramesMagic = 0x454d5246'46564f46;   // "FOVFFRME"
inline constexpr std::uint32_t kMessageMagic = 0x41564f46;           // "FOVA"

inline constexpr std::size_t kCacheLine = 64;  // x86-64 and most ARM cores; a wrong value costs speed only

}  // namespace fovea
