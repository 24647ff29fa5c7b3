#include "render/layer/trace.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "render/layer/context.hpp"

namespace fovea::layer {
namespace {

std::atomic<bool> frames_over{false};

std::string number(double v) {
    if (!std::isfinite(v)) return v != v ? "\"NaN\"" : v > 0 ? "\"inf\"" : "\"-inf\"";
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", v);
    return text;
}

}  // namespace

Trace* trace_instance() {
    static Trace* instance = []() -> Trace* {
        const char* folder = std::getenv("FOVEA_LAYER_TRACE");
        if (!folder || !*folder) return nullptr;
        const char* frames = std::getenv("FOVEA_LAYER_TRACE_FRAMES");
        auto* trace = new Trace(folder, frames ? std::max(1, std::atoi(frames)) : 3);  // the program's exit handlers may still draw
        if (trace->file_) return trace;
        std::fprintf(stderr, "fovea layer: cannot write %s/trace.jsonl (FOVEA_LAYER_TRACE)\n", folder);
        delete trace;
        return nullptr;
    }();
    return instance;
}

Trace* Trace::calls() { return trace_instance(); }
Trace* Trace::submissions() { return frames_over.load(std::memory_order_relaxed) ? nullptr : trace_instance(); }

Trace::Trace(std::string folder, int frames) : folder_(std::move(folder)), frames_left_(frames) {
    file_ = std::fopen((folder_ + "/trace.jsonl").c_str(), "w");
}

void Trace::line(const std::string& json) {
    std::fwrite(json.data(), 1, json.size(), file_);
    std::fputc('\n', file_);
    std::fflush(file_);  // the program may end by a signal
}

void Trace::call(const char* name, const std::string& arguments) {
    const std::lock_guard lock(mutex_);
    if (++calls_ > kMostCalls) return;
    line("{\"frame\": " + std::to_string(frame_) + ", \"call\": \"" + name + "\", \"arguments\": [" + arguments + "]}");
}

void trace_call(const char* name, std::initializer_list<double> arguments) {
    Trace* t = Trace::calls();
    if (!t) return;
    std::string text;
    for (const double a : arguments) text += (text.empty() ? "" : ", ") + number(a);
    t->call(name, text);
}

int Trace::submission(const Submission& s) {
    const std::lock_guard lock(mutex_);
    this_frame_ = true;
    const int number_of_it = ++submissions_;
    if (submissions_ >= kMostSubmissions) frames_over.store(true, std::memory_order_relaxed);
    std::string json = "{\"frame\": " + std::to_string(frame_) + ", \"submission\": " + std::to_string(number_of_it) +
                       ", \"framebuffer\": " + std::to_string(s.framebuffer) + ", \"view\": " + std::to_string(s.view) +
                       ", \"width\": " + std::to_string(s.width) + ", \"height\": " + std::to_string(s.height) +
                       ", \"cause\": \"" + s.cause + "\", \"full_density\": \"" + s.full_density + "\"";
    if (s.latched && s.plan) {
        json += std::string(", \"live\": ") + (s.live ? "true" : "false") + ", \"min_density\": " + number(static_cast<double>(s.latched->min_density)) + ", \"points\": [";
        for (GLuint i = 0; i < s.latched->count; ++i) {
            const FocalPoint& p = s.latched->points[i];
            json += std::string(i ? ", " : "") + "[" + number(static_cast<double>(p.x_ndc)) + ", " + number(static_cast<double>(p.y_ndc)) + ", " +
                    number(static_cast<double>(p.gain_x)) + ", " + number(static_cast<double>(p.gain_y)) + ", " +
                    number(static_cast<double>(p.fovea_area)) + "]";
        }
        json += "], \"bin_px\": " + std::to_string(s.plan->bin_px()) + ", \"texels\": [";
        for (int i = 0; i < s.plan->settings().level_count; ++i) json += (i ? ", " : "") + std::to_string(s.plan->texels(i) + s.plan->guard_texels(i));
        json += "], \"levels\": [";  // one string per row of bins, the lowest first
        for (int row = 0; row < s.plan->rows(); ++row) {
            json += row ? ", \"" : "\"";
            for (int column = 0; column < s.plan->columns(); ++column) json += static_cast<char>('0' + s.plan->level_at(column, row));
            json += "\"";
        }
        json += "]";
    }
    line(json + "}");
    return number_of_it;
}

void Trace::picture(int submission, const char* which, int width, int height, const std::vector<std::uint8_t>& rgba) {
    if (rgba.empty()) return;
    const std::lock_guard lock(mutex_);
    const std::string name = std::to_string(submission) + "_" + which + ".rgba";
    std::FILE* file = std::fopen((folder_ + "/" + name).c_str(), "wb");
    if (!file) return;
    const bool good = std::fwrite(rgba.data(), 1, rgba.size(), file) == rgba.size();
    if (std::fclose(file) == 0 && good)
        line("{\"frame\": " + std::to_string(frame_) + ", \"picture\": \"" + name + "\", \"of\": " + std::to_string(submission) +
             ", \"which\": \"" + which + "\", \"width\": " + std::to_string(width) + ", \"height\": " + std::to_string(height) + "}");
}

void Trace::frame_ended() {
    const std::lock_guard lock(mutex_);
    ++frame_;
    if (!this_frame_) return;
    this_frame_ = false;
    if (--frames_left_ == 0) frames_over.store(true, std::memory_order_relaxed);
}

std::vector<std::uint8_t> read_colors(GLenum buffer, int width, int height) {
    drop_errors();
    const GLint pack_buffer = get_integer(GL_PIXEL_PACK_BUFFER_BINDING), read_buffer = get_integer(GL_READ_BUFFER);
    constexpr GLenum kStores[] = {GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS, GL_PACK_SKIP_PIXELS};
    GLint stores[4];
    for (int i = 0; i < 4; ++i) {
        stores[i] = get_integer(kStores[i]);
        gl.PixelStorei(kStores[i], i == 0 ? 1 : 0);
    }
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    gl.ReadBuffer(buffer);
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
    gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    if (gl.GetError() != GL_NO_ERROR) {
        std::vector<GLfloat> values(rgba.size());  // a float image
        gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, values.data());
        if (gl.GetError() != GL_NO_ERROR)
            rgba.clear();
        else
            std::transform(values.begin(), values.end(), rgba.begin(), [](GLfloat v) {
                return static_cast<std::uint8_t>(std::lround((v > 0 ? std::min(v, 1.0f) : 0.0f) * 255.0f));
            });
    }
    for (int i = 0; i < 4; ++i) gl.PixelStorei(kStores[i], stores[i]);
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(pack_buffer));
    gl.ReadBuffer(static_cast<GLenum>(read_buffer));
    drop_errors();
    return rgba;
}

// The batch as it would look at full density, before it is drawn in levels.
void Context::trace_before(int submission) {
    if (!batch_.color_cleared || shape_.samples > 0 || feedback_) return;
    run_native();
    Undo own;
    own.framebuffers();
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, draw_framebuffer_);
    Trace::submissions()->picture(submission, "before", shape_.width, shape_.height,
                                  read_colors(shape_.in_place ? static_cast<GLenum>(GL_BACK) : first_color(), shape_.width, shape_.height));
    own.restore();
    if (!batch_.inherits_clear) return;
    // The clear of before this batch is gone: again.
    Undo state;
    save_for_own_drawing(state);
    set_for_own_drawing();
    gl.ClearColor(cleared_to_.color[0], cleared_to_.color[1], cleared_to_.color[2], cleared_to_.color[3]);
    gl.ClearDepthf(cleared_to_.depth);
    gl.ClearStencil(cleared_to_.stencil);
    gl.DepthMask(GL_TRUE);
    gl.StencilMask(~0u);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
    state.restore();
}

GLenum Context::first_color() const {
    for (std::size_t i = 0; i < kMaxColors; ++i)
        if (shape_.color[i]) return GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
    return GL_NONE;
}

int Context::trace_submission(const Pass& pass, GLuint view, Call call, bool levels) {
    Trace::Submission s{.framebuffer = draw_framebuffer_, .view = view, .width = shape_.width, .height = shape_.height,
                        .cause = call_name(call)};
    if (levels)
        s.latched = &pass.latched, s.plan = &*pass.plan, s.live = target_.kind == DrawTarget::Kind::automatic && focus_.live();
    else
        s.full_density = full_rate_name(native_reason_ == FullRate::none ? FullRate::cannot_match : native_reason_);
    return Trace::submissions()->submission(s);
}

}  // namespace fovea::layer
