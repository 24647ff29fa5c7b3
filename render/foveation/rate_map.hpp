// Shading-rate maps made on the GPU: a compute shader reads the gaze from a buffer when it runs, not when it is issued.
//
// The result equals density::fill_rate_map bit for bit. Four rates are packed into a word (ES 3.1 has no R8UI images), the
// first in the lowest byte.
// Threads: the context's. set_input(): any one thread, also after dispatch() and before the GPU runs it, where the driver
// maps buffers persistently (GL_EXT_buffer_storage); elsewhere before dispatch().
#pragma once

#include <cstdint>
#include <span>

#include "protocol/error.hpp"
#include "render/density/shading_rate.hpp"
#include "render/gl/objects.hpp"

namespace fovea::foveation {

class RateMap {
public:
    // For maps of at most this many tiles.
    [[nodiscard]] static Result<RateMap> create(std::size_t tiles);
    RateMap(RateMap&& other) noexcept;
    RateMap& operator=(RateMap&&) = delete;   // the mapping belongs to one buffer
    ~RateMap();

    [[nodiscard]] bool persistent() const noexcept { return mapped_ != nullptr; }
    void set_input(const density::RateInput& input) noexcept;
    void dispatch(int columns, int rows) noexcept;
    // The map as the source of a texture upload, after dispatch(): columns bytes a row, no padding. Unbind it afterwards.
    void bind_for_unpacking() const noexcept;
    // Waits for the GPU. rates: at least columns * rows.
    void read(int columns, int rows, std::span<std::uint8_t> rates) noexcept;

private:
    RateMap() = default;
    gl::Program program_;
    gl::Buffer input_, map_;
    density::RateInput* mapped_ = nullptr;
    std::size_t words_ = 0;
};

}  // namespace fovea::foveation
