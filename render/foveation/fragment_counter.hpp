// Counts shaded fragments with an atomic counter: a debug aid, because writing one costs early depth tests unless the
// shader asks for them (the counting variants of the scene's shaders do).
//
// Threads: the context's.
#pragma once

#include <cstdint>

#include "render/gl/objects.hpp"

namespace fovea::foveation {

class FragmentCounter {
public:
    // enabled false: every call is a branch.
    explicit FragmentCounter(bool enabled);
    [[nodiscard]] bool enabled() const noexcept { return static_cast<bool>(buffer_); }
    void begin() noexcept;                      // zeroes and binds
    [[nodiscard]] std::uint64_t read() const;   // waits for the GPU

private:
    gl::Buffer buffer_;
};

}  // namespace fovea::foveation
