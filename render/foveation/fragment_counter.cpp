#include "render/foveation/fragment_counter.hpp"

#include <epoxy/gl.h>

namespace fovea::foveation {

FragmentCounter::FragmentCounter(bool enabled) {
    if (enabled) buffer_ = gl::create_dynamic_buffer(sizeof(std::uint32_t));
}

void FragmentCounter::begin() noexcept {
    if (!enabled()) return;
    const std::uint32_t zero = 0;
    gl::update_buffer(buffer_, 0, std::as_bytes(std::span(&zero, 1)));
    glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, buffer_.name());
}

std::uint64_t FragmentCounter::read() const {
    if (!enabled()) return 0;
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_ATOMIC_COUNTER_BARRIER_BIT);
    glFinish();
    glBindBuffer(GL_ATOMIC_COUNTER_BUFFER, buffer_.name());
    const void* p = glMapBufferRange(GL_ATOMIC_COUNTER_BUFFER, 0, sizeof(std::uint32_t), GL_MAP_READ_BIT);
    const std::uint64_t n = p != nullptr ? *static_cast<const std::uint32_t*>(p) : 0;
    glUnmapBuffer(GL_ATOMIC_COUNTER_BUFFER);
    return n;
}

}  // namespace fovea::foveation
