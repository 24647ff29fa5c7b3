// Random calls about objects, for the random sequences of random_calls_test.cpp: several colour images, transform
// feedback, queries with their results, mapped buffers, indirect and instanced draws, primitive restart, pixel buffers,
// uniform and storage buffers, compute, renderbuffers, mipmaps, copies between images and buffers, invalidation, fences,
// a second context of the share group, program pipelines, state per draw buffer, buffers deleted while an array holds them.
//
// What the program reads back (results of queries, contents of buffers, pixels) is kept in `answers`. Everything is made
// in set_up(): names given later depend on what the layer has.
#pragma once

#include <functional>
#include <random>
#include <string>

#include "tests/layer/layer_test.hpp"

namespace fovea::layer_test {

class RandomObjects {
public:
    struct Programs {
        GLuint plain = 0, capturing = 0, storing = 0, computing = 0, vertex_stage = 0, fragment_stage = 0;
    };
    // pixels: answers may hold what was drawn; false where that is foveated.
    RandomObjects(std::mt19937& random, const Programs& programs, bool pixels) : random_(random), programs_(programs), pixels_(pixels) {}

    // in_other_context: runs its argument with another context of the share group current.
    void set_up(const Surface& target, GLuint second_color, std::function<void(const std::function<void()>&)> in_other_context);
    std::string step(GLenum mode);  // the kind of calls, for messages
    // After the last step: what the objects hold.
    void end();

    std::vector<std::uint32_t> answers;

private:
    void draw_something(GLenum mode);
    void draws(GLenum mode, int kind);
    void buffers(GLenum mode, int kind);
    void images(GLenum mode, int kind);
    void others(GLenum mode, int kind);
    void deleted_buffers(GLenum mode, int kind);
    void vertices();
    void answer_buffer(GLuint buffer, GLsizeiptr bytes);
    void answer_pixels(GLuint framebuffer, int x, int y, int w, int h);
    int pick(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
    float real(float low, float high) { return low + (high - low) * static_cast<float>(random_() % 10007) / 10007.0f; }

    std::mt19937& random_;
    Programs programs_;
    bool pixels_;
    Surface target_;
    GLuint second_color_ = 0;
    std::function<void(const std::function<void()>&)> in_other_context_;
    GLuint array_ = 0, vertex_ = 0, indices_ = 0, uniforms_ = 0, storage_ = 0, captured_ = 0, pack_ = 0, unpack_ = 0, commands_ = 0;
    GLuint query_ = 0, mipmapped_ = 0, layers_ = 0, renderbuffer_ = 0, renderbuffer_framebuffer_ = 0, second_framebuffer_ = 0, pipeline_ = 0;
    GLuint holding_array_ = 0, doomed_ = 0;  // an array object, and the name of the buffer that it was set up with
    GLint uniform_step_ = 256;
};

}  // namespace fovea::layer_test
