// What the layer does, written down for a bug report: the calls of the foveation extensions, each submission with its
// focal points and plan, and pictures of it at full density ("before") and foveated ("after").
//
// Source: asked for by FOVEA_LAYER_TRACE (a folder that exists) and FOVEA_LAYER_TRACE_FRAMES (default 3); `fovea layer
// trace` sets both and makes a page of what it finds. Output: trace.jsonl, one JSON object per line; pictures as
// NUMBER_before.rgba and NUMBER_after.rgba, 8 bits per channel, bottom row first. Calls are written from the start of the
// program, submissions of the first frames that have any.
// Cost: a frame that is traced is drawn twice and read back twice; otherwise one branch per submission.
// Threads: all; locks itself. Errors: what cannot be written is left out, and named on stderr once.
#pragma once

#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <mutex>
#include <string>
#include <vector>

#include "layer_gl.hpp"
#include "render/density/plan.hpp"
#include "render/layer/foveation_state.hpp"

namespace fovea::layer {

class Trace {
public:
    // nullptr: not asked for, or over.
    [[nodiscard]] static Trace* calls();        // takes calls
    [[nodiscard]] static Trace* submissions();  // takes submissions: the frames are not used up

    // `arguments`: JSON values, comma between them.
    void call(const char* name, const std::string& arguments);

    struct Submission {
        GLuint framebuffer = 0, view = 0;
        int width = 0, height = 0;
        const char* cause = "";            // the call that submitted
        const char* full_density = "";     // why it was drawn so; empty: in levels
        const Latched* latched = nullptr;  // in levels only
        const density::Plan* plan = nullptr;
        bool live = false;                 // auto mode: the point came from a living fovead
    };
    // The number by which pictures are known.
    int submission(const Submission& s);
    void picture(int submission, const char* which, int width, int height, const std::vector<std::uint8_t>& rgba);
    void frame_ended();

private:
    explicit Trace(std::string folder, int frames);
    void line(const std::string& json);
    std::mutex mutex_;
    std::string folder_;
    std::FILE* file_ = nullptr;
    int frames_left_, submissions_ = 0, calls_ = 0, frame_ = 1;
    bool this_frame_ = false;  // has a submission
    static constexpr int kMostCalls = 2000, kMostSubmissions = 64;
    friend Trace* trace_instance();
};

// A call with numbers for arguments, if calls are traced.
void trace_call(const char* name, std::initializer_list<double> arguments);

// The colours of the framebuffer bound for reading, attachment `buffer` (GL_BACK or a colour attachment). Empty: not
// readable as 8 bits per channel (integers, multisampled). State is left as it was; errors of the driver are dropped.
[[nodiscard]] std::vector<std::uint8_t> read_colors(GLenum buffer, int width, int height);

}  // namespace fovea::layer
