// GL objects of the layer whose context is gone while its share group lives on: textures, renderbuffers, programs and
// buffers belong to the group, and stay until a context of the group deletes them.
// Threads: locks itself. Errors: none.
#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "layer_gl.hpp"

namespace fovea::layer {

class Graveyard {
public:
    void texture(GLuint name) { add(textures_, name); }
    void renderbuffer(GLuint name) { add(renderbuffers_, name); }
    void program(GLuint name) { add(programs_, name); }
    void buffer(GLuint name) { add(buffers_, name); }
    void sampler(GLuint name) { add(samplers_, name); }

    // Deletes all of them; a context of the group is current.
    void bury() {
        if (!any_.load(std::memory_order_acquire)) return;  // pairs with add(): the lists are seen when it says so
        const std::lock_guard lock(mutex_);
        gl.DeleteTextures(static_cast<GLsizei>(textures_.size()), textures_.data());
        gl.DeleteRenderbuffers(static_cast<GLsizei>(renderbuffers_.size()), renderbuffers_.data());
        gl.DeleteBuffers(static_cast<GLsizei>(buffers_.size()), buffers_.data());
        gl.DeleteSamplers(static_cast<GLsizei>(samplers_.size()), samplers_.data());
        for (const GLuint p : programs_) gl.DeleteProgram(p);
        empty();
    }
    // The share group is lost: there is nothing to delete any more.
    void forget() {
        const std::lock_guard lock(mutex_);
        empty();
    }

private:
    void empty() {
        textures_.clear(), renderbuffers_.clear(), programs_.clear(), buffers_.clear(), samplers_.clear();
        any_.store(false, std::memory_order_relaxed);
    }
    void add(std::vector<GLuint>& to, GLuint name) {
        if (name == 0) return;
        const std::lock_guard lock(mutex_);
        to.push_back(name);
        any_.store(true, std::memory_order_release);
    }
    std::mutex mutex_;
    std::atomic<bool> any_{false};
    std::vector<GLuint> textures_, renderbuffers_, programs_, buffers_, samplers_;
};

}  // namespace fovea::layer
