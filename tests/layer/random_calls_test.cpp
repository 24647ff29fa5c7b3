// Random sequences of legal and illegal calls: with every gain 0 the errors, the state and the pixels are those of the
// plain driver; with foveation on, errors and state still are, and so is every pixel of the region of full density.
//
// A failure names its seed: FOVEA_LAYER_SEED=n runs that one alone. FOVEA_LAYER_SEEDS sets how many are run,
// FOVEA_LAYER_FIRST_SEED from which on.
#include <cstdlib>
#include <cstring>
#include <optional>
#include <random>

#include "tests/layer/layer_test.hpp"
#include "tests/layer/random_objects.hpp"

namespace fovea::layer_test {
namespace {

constexpr int kSize = 96;
int calls() {
    const char* fewer = std::getenv("FOVEA_LAYER_CALLS");  // to find the call that a failing seed needs
    return fewer ? std::atoi(fewer) : 160;
}

struct Outcome {
    std::vector<GLenum> errors;
    std::vector<std::string> steps;
    std::vector<GLint> state;
    std::vector<std::uint32_t> answers;
    Picture picture;
};

class RandomProgram {
public:
    // wide: calls of more kinds as well.
    RandomProgram(unsigned seed, bool stencil, bool wide, GLuint program, GLuint counting_program)
        : random_(seed), stencil_(stencil), wide_(wide), programs_{program, counting_program} {}

    void set_up(const Surface& target, const Surface& other) {
        target_ = target;
        other_ = other;
        glGenBuffers(2, buffers_);
        glGenVertexArrays(2, arrays_);
        glGenTextures(2, textures_);
        glGenBuffers(1, &indices_);
        glGenBuffers(1, &indirect_);
        glGenQueries(1, &query_);
        glGenSamplers(1, &sampler_);
        float vertices[64];
        for (float& v : vertices) v = real(-1.3f, 1.3f);
        for (const GLuint b : buffers_) {
            glBindBuffer(GL_ARRAY_BUFFER, b);
            glBufferData(GL_ARRAY_BUFFER, sizeof vertices, vertices, GL_DYNAMIC_DRAW);
        }
        GLubyte pixels[64];
        for (const GLuint t : textures_) {
            for (GLubyte& p : pixels) p = static_cast<GLubyte>(pick(256));
            glBindTexture(GL_TEXTURE_2D, t);
            glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 4, 4, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        }
        glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
        glViewport(0, 0, kSize, kSize);
        glUseProgram(programs_[0]);
        for (float& v : client_) v = real(-1.2f, 1.2f);
    }

    [[nodiscard]] std::mt19937& random() { return random_; }
    [[nodiscard]] const std::string& last() const { return last_; }  // the kind of the last step
    void add_objects(RandomObjects& objects) { objects_ = &objects; }

    void step() {
        const auto f = [this] { return real(0, 1); };
        static constexpr GLenum kCaps[] = {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_SCISSOR_TEST, GL_DITHER, GL_POLYGON_OFFSET_FILL,
                                           GL_STENCIL_TEST, 0x1234};
        static constexpr GLenum kFactors[] = {GL_ZERO, GL_ONE, GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_DST_COLOR, GL_CONSTANT_ALPHA, 0x1234};
        static constexpr GLenum kFuncs[] = {GL_NEVER, GL_LESS, GL_EQUAL, GL_LEQUAL, GL_GREATER, GL_NOTEQUAL, GL_GEQUAL, GL_ALWAYS, 0x1234};
        static constexpr GLenum kModes[] = {GL_TRIANGLES, GL_TRIANGLE_STRIP, GL_TRIANGLE_FAN, GL_TRIANGLES, GL_TRIANGLES, 0x4321};
        const GLenum mode = one_of(kModes);
        if (wide_ && pick(3) == 0) return wide_step(mode);
        if (objects_ && pick(2) == 0) return last_ = objects_->step(mode), void();
        const int kind = pick(34);
        last_ = "common " + std::to_string(kind);
        switch (kind) {
            case 0: {
                const GLenum cap = one_of(kCaps);
                if (cap == GL_STENCIL_TEST && !stencil_) break;
                if (cap == GL_DEPTH_TEST && !depth_) break;
                pick(2) ? glEnable(cap) : glDisable(cap);
                break;
            }
            case 1: glBlendFunc(one_of(kFactors), one_of(kFactors)); break;
            case 2: glBlendFuncSeparate(one_of(kFactors), one_of(kFactors), one_of(kFactors), one_of(kFactors)); break;
            case 3: glDepthFunc(one_of(kFuncs)); break;
            case 4: glDepthMask(pick(2) == 1); break;
            case 5: glColorMask(pick(4) > 0, pick(4) > 0, pick(4) > 0, pick(4) > 0); break;
            case 6: glScissor(pick(kSize) - 10, pick(kSize) - 10, pick(kSize + 40) - 3, pick(kSize + 40)); break;
            case 7: glViewport(pick(20) - 10, pick(20) - 10, kSize + pick(20) - 12, kSize + pick(20) - 12); break;
            case 8: glClearColor(f(), f(), f(), f()); break;
            case 9: {
                static constexpr GLbitfield kMasks[] = {GL_COLOR_BUFFER_BIT, GL_DEPTH_BUFFER_BIT, GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT,
                                                        GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT, 0, 0x8};
                glClear(one_of(kMasks));
                break;
            }
            case 10: {
                const GLfloat v[4] = {f(), f(), f(), f()};
                glClearBufferfv(pick(3) ? GL_COLOR : GL_DEPTH, pick(8) ? 0 : 3, v);
                break;
            }
            case 11: case 12: case 13: {
                pointer(true);
                glDrawArrays(mode, pick(4), pick(10) ? pick(10) : -1);
                break;
            }
            case 14: case 15: {
                pointer(false);
                glDrawArrays(mode, pick(4), pick(12));
                break;
            }
            case 16: {
                pointer(pick(2) == 0);
                GLushort indices[8];
                for (GLushort& i : indices) i = static_cast<GLushort>(pick(12));
                glBindVertexArray(0);
                glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, 0);
                glDrawElements(mode, pick(9), pick(9) ? GL_UNSIGNED_SHORT : GL_FLOAT, indices);
                std::memset(indices, 0, sizeof indices);
                break;
            }
            case 17: pointer(pick(2) == 0); glDrawArraysInstanced(mode, 0, pick(9), pick(4) - (pick(5) ? 0 : 2)); break;
            case 18: glUniform4f(uniform("tint"), f(), f(), f(), f()); break;
            case 19: {
                const GLfloat v[4] = {f(), f(), f(), f()};
                glUniform2fv(uniform("shift[0]") + pick(3), pick(3), v);
                break;
            }
            case 20: glUniform1f(pick(10) ? uniform("depth") : 4711, f() * 2 - 1); break;
            case 21: glUniform1i(uniform("image"), pick(3)); break;
            case 22: glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(pick(3))); break;
            case 23: glBindTexture(pick(9) ? GL_TEXTURE_2D : 0x1234, textures_[pick(2)]); break;
            case 24: {
                GLubyte pixels[16];
                for (GLubyte& p : pixels) p = static_cast<GLubyte>(pick(256));
                glBindTexture(GL_TEXTURE_2D, textures_[pick(2)]);
                glTexSubImage2D(GL_TEXTURE_2D, 0, pick(3), pick(3), 2, 2, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
                break;
            }
            case 25: {
                float v[4] = {real(-1, 1), real(-1, 1), real(-1, 1), real(-1, 1)};
                glBindBuffer(GL_ARRAY_BUFFER, buffers_[pick(2)]);
                glBufferSubData(GL_ARRAY_BUFFER, 4 * pick(64), sizeof v, v);
                break;
            }
            case 26: client_[static_cast<std::size_t>(pick(64))] = real(-1.2f, 1.2f); break;
            case 27: pick(2) ? glFlush() : glFinish(); break;
            case 28: {
                glBindFramebuffer(GL_FRAMEBUFFER, other_.framebuffer);
                glClear(GL_COLOR_BUFFER_BIT);
                glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer);
                break;
            }
            case 29: glVertexAttrib4f(1, f(), f(), f(), f()); break;
            case 30: {
                glStencilFunc(one_of(kFuncs), pick(256), static_cast<GLuint>(pick(256)));
                static constexpr GLenum kOps[] = {GL_KEEP, GL_ZERO, GL_REPLACE, GL_INCR, GL_DECR_WRAP, GL_INVERT};
                glStencilOp(one_of(kOps), one_of(kOps), one_of(kOps));
                glStencilMask(static_cast<GLuint>(pick(256)));
                break;
            }
            case 31: glBindVertexArray(pick(2) ? 0 : arrays_[pick(2)]); break;
            case 32: glUseProgram(pick(9) ? programs_[pick(4) == 0] : 4711); break;
            case 33: {
                std::uint32_t pixel = 0;
                glReadPixels(pick(kSize), pick(kSize), 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, &pixel);
                break;
            }
        }
    }

    [[nodiscard]] std::vector<GLint> state() const {
        std::vector<GLint> all;
        for (const GLenum name : {GL_VIEWPORT, GL_SCISSOR_BOX, GL_COLOR_WRITEMASK, GL_BLEND_SRC_RGB, GL_BLEND_DST_ALPHA, GL_STENCIL_FUNC,
                                  GL_STENCIL_REF, GL_STENCIL_WRITEMASK, GL_STENCIL_FAIL, GL_DEPTH_FUNC, GL_DEPTH_WRITEMASK, GL_ACTIVE_TEXTURE,
                                  GL_TEXTURE_BINDING_2D, GL_VERTEX_ARRAY_BINDING, GL_ARRAY_BUFFER_BINDING, GL_CURRENT_PROGRAM,
                                  GL_DRAW_FRAMEBUFFER_BINDING, GL_READ_FRAMEBUFFER_BINDING}) {
            GLint v[4] = {};
            glGetIntegerv(static_cast<GLenum>(name), v);
            // Names that were given anew depend on what else the driver has: which of the program's it is.
            const GLuint* own = name == GL_TEXTURE_BINDING_2D ? textures_ : name == GL_ARRAY_BUFFER_BINDING ? buffers_ : nullptr;
            for (int i = 0; own && i < 2; ++i)
                if (v[0] == static_cast<GLint>(own[i])) v[0] = -1 - i;
            all.insert(all.end(), v, v + 4);
        }
        for (const GLenum cap : {GL_SCISSOR_TEST, GL_BLEND, GL_STENCIL_TEST, GL_DEPTH_TEST, GL_CULL_FACE, GL_DITHER})
            all.push_back(glIsEnabled(cap));
        return all;
    }
    // llvmpipe 22.3 writes to a query that a context was destroyed with while it was active.
    void end() {
        if (query_on_) glEndQuery(GL_ANY_SAMPLES_PASSED);
    }
    void no_depth() { depth_ = false; }

private:
    void wide_step(GLenum mode) {
        const auto f = [this] { return real(0, 1); };
        const auto offset = [](int bytes) { return reinterpret_cast<const void*>(static_cast<std::uintptr_t>(bytes)); };
        const int kind = pick(26);
        last_ = "wide " + std::to_string(kind);
        switch (kind) {
            case 0: glBlendColor(f(), f(), f(), f()); break;
            case 1: {
                static constexpr GLenum kEquations[] = {GL_FUNC_ADD, GL_FUNC_SUBTRACT, GL_FUNC_REVERSE_SUBTRACT, GL_MIN, GL_MAX, 0x1234};
                pick(2) ? glBlendEquation(one_of(kEquations)) : glBlendEquationSeparate(one_of(kEquations), one_of(kEquations));
                break;
            }
            case 2: pick(2) ? glCullFace(pick(5) ? GL_BACK : 0x77) : glFrontFace(pick(2) ? GL_CW : GL_CCW); break;
            case 3: glPolygonOffset(real(-1, 1), real(-1, 1)); break;
            case 4: glDepthRangef(f() * 0.3f, 1 - f() * 0.3f); break;
            case 5: glClearDepthf(f()), glClearStencil(pick(256)); break;
            case 6: {
                const GLint v[4] = {pick(256), 0, 0, 0};
                if (depth_) glClearBufferiv(pick(4) ? GL_STENCIL : GL_COLOR, pick(6) ? 0 : 9, v);
                break;
            }
            case 7: if (depth_) glClearBufferfi(pick(4) ? GL_DEPTH_STENCIL : GL_DEPTH, 0, f(), pick(256)); break;
            case 8: glProgramUniform4f(programs_[pick(2)], pick(9) ? glGetUniformLocation(programs_[0], "tint") : 4711, f(), f(), f(), f()); break;
            case 9: {  // indices in a buffer of an array object, with a base vertex
                static constexpr GLushort kIndices[8] = {3, 1, 4, 1, 5, 9, 2, 6};
                glBindVertexArray(arrays_[pick(2)]);
                glBindBuffer(GL_ARRAY_BUFFER, buffers_[pick(2)]);
                glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 8, nullptr);
                glEnableVertexAttribArray(0);
                glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
                if (pick(2)) glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof kIndices, kIndices, GL_STATIC_DRAW);
                pick(2) ? glDrawElementsBaseVertex(mode, pick(8), GL_UNSIGNED_SHORT, offset(0), pick(5))
                        : glDrawRangeElements(mode, 0, 9, pick(8), GL_UNSIGNED_SHORT, offset(2 * pick(2)));
                break;
            }
            case 10: {
                const GLuint command[4] = {static_cast<GLuint>(pick(9)), 1, static_cast<GLuint>(pick(4)), 0};
                glBindVertexArray(arrays_[pick(2)]);
                glBindBuffer(GL_DRAW_INDIRECT_BUFFER, pick(9) ? indirect_ : 0);
                glBufferData(GL_DRAW_INDIRECT_BUFFER, sizeof command, command, GL_STREAM_DRAW);
                glDrawArraysIndirect(mode, offset(pick(9) ? 0 : 2));
                break;
            }
            case 11: if (!query_on_) glBeginQuery(GL_ANY_SAMPLES_PASSED, query_), query_on_ = true; break;
            case 12: glEndQuery(GL_ANY_SAMPLES_PASSED), query_on_ = false; break;
            case 13: glBlitFramebuffer(0, 0, 32, 32, 0, 0, 32, 32, GL_COLOR_BUFFER_BIT, pick(8) ? GL_NEAREST : 0x1234); break;  // onto itself: an error
            case 14: {  // from the other framebuffer into this one
                glBindFramebuffer(GL_READ_FRAMEBUFFER, other_.framebuffer);
                glBlitFramebuffer(0, 0, 32, 32, pick(60), pick(60), pick(90), pick(90), GL_COLOR_BUFFER_BIT, GL_NEAREST);
                glBindFramebuffer(GL_READ_FRAMEBUFFER, target_.framebuffer);
                break;
            }
            case 15: glActiveTexture(GL_TEXTURE0), glBindTexture(GL_TEXTURE_2D, textures_[0]), glCopyTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, pick(90), pick(90), 4, 4); break;
            case 16: {
                glBindBuffer(GL_ARRAY_BUFFER, buffers_[pick(2)]);
                if (auto* mapped = static_cast<float*>(glMapBufferRange(GL_ARRAY_BUFFER, 0, 64, GL_MAP_WRITE_BIT | (pick(2) ? GL_MAP_READ_BIT : 0))))
                    mapped[pick(16)] = real(-1, 1);
                glUnmapBuffer(GL_ARRAY_BUFFER);
                break;
            }
            case 17: {  // a texture object goes while it is bound, and another comes
                GLubyte pixels[64];
                for (GLubyte& v : pixels) v = static_cast<GLubyte>(pick(256));
                const int i = pick(2);
                glDeleteTextures(1, &textures_[i]);
                glGenTextures(1, &textures_[i]);
                glBindTexture(GL_TEXTURE_2D, textures_[i]);
                glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 4, 4, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
                glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
                break;
            }
            case 18: glBindSampler(static_cast<GLuint>(pick(3)), pick(3) ? sampler_ : 0); break;
            case 19: glSamplerParameteri(sampler_, GL_TEXTURE_MIN_FILTER, pick(2) ? GL_NEAREST : GL_LINEAR), glSamplerParameteri(sampler_, GL_TEXTURE_WRAP_S, pick(2) ? GL_CLAMP_TO_EDGE : GL_REPEAT); break;
            case 20: glDeleteSync(glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0)); break;
            case 21: {
                const GLenum none = GL_NONE, first = GL_COLOR_ATTACHMENT0, wrong = GL_BACK;
                glDrawBuffers(1, pick(8) == 0 ? &wrong : pick(3) == 0 ? &none : &first);
                break;
            }
            case 22: pick(2) ? glEnable(GL_RASTERIZER_DISCARD) : glDisable(GL_RASTERIZER_DISCARD); break;
            case 23: glDisable(GL_RASTERIZER_DISCARD); break;
            case 24: {  // an object of a name in use
                const int i = pick(2);
                glDeleteBuffers(1, &buffers_[i]);
                glGenBuffers(1, &buffers_[i]);
                float v[64];
                for (float& x : v) x = real(-1.3f, 1.3f);
                glBindBuffer(GL_ARRAY_BUFFER, buffers_[i]);
                glBufferData(GL_ARRAY_BUFFER, sizeof v, v, GL_STATIC_DRAW);
                // No other vertex array object goes on with the deleted buffer: docs/layer.md, Limits.
                for (const GLuint a : {arrays_[0], arrays_[1], 0u}) glBindVertexArray(a), glBindBuffer(GL_ARRAY_BUFFER, buffers_[i]), glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
                break;
            }
            case 25: pointer(true); glVertexAttribDivisor(0, static_cast<GLuint>(pick(3))); glDrawArraysInstanced(mode, 0, pick(5), pick(4)); glVertexAttribDivisor(0, 0); break;
        }
    }
    int pick(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
    float real(float low, float high) { return low + (high - low) * static_cast<float>(random_() % 10007) / 10007.0f; }
    template <std::size_t N>
    GLenum one_of(const GLenum (&values)[N]) { return values[pick(static_cast<int>(N))]; }
    GLint uniform(const char* name) const {
        GLint used = 0;
        glGetIntegerv(GL_CURRENT_PROGRAM, &used);
        return glGetUniformLocation(static_cast<GLuint>(used), name);
    }
    // Vertices from the program's memory (default vertex array), or from a buffer.
    void pointer(bool client) {
        if (client) glBindVertexArray(0);
        glBindBuffer(GL_ARRAY_BUFFER, client ? 0 : buffers_[pick(2)]);
        glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, pick(2) ? 0 : 12, client ? client_ : nullptr);
        glEnableVertexAttribArray(0);
    }

    std::mt19937 random_;
    bool stencil_, wide_, depth_ = true, query_on_ = false;
    RandomObjects* objects_ = nullptr;
    std::string last_;
    GLuint programs_[2];
    Surface target_, other_;
    GLuint buffers_[2] = {}, arrays_[2] = {}, textures_[2] = {}, indices_ = 0, indirect_ = 0, query_ = 0, sampler_ = 0;
    float client_[64] = {};
};

// Which step gave another error.
std::string first_difference(const Outcome& a, const Outcome& b) {
    for (std::size_t i = 0; i < a.steps.size(); ++i)
        if (a.errors[i] != b.errors[i])
            return ", step " + std::to_string(i) + " (" + a.steps[i] + "): " + std::to_string(a.errors[i]) + ", " + std::to_string(b.errors[i]);
    return ", at the end";
}

}  // namespace

class RandomCalls : public LayerTest {
protected:
    enum class Kinds { common, wide, objects };
    enum class Target { plain, rebound, gain_zero, foveated };  // rebound: plain, with the program bound again before each call
    Outcome run(unsigned seed, Target kind, bool stencil, bool depth, Kinds kinds = Kinds::common) {
        const EGLContext own = make_context(), second = kinds == Kinds::objects ? make_context(own) : EGL_NO_CONTEXT;
        use(own);
        const bool wide = kinds != Kinds::common;
        const char* vertex = "#version 310 es\nlayout(location = 0) in vec2 p; layout(location = 1) in vec4 c; uniform float depth; uniform vec2 shift[3];\n"
                             "out vec4 v; out vec2 at; void main() { v = c; at = p; gl_Position = vec4(p + shift[0] * 0.2 - shift[2] * 0.2, depth, 1); }";
        const Programs with_objects = second == EGL_NO_CONTEXT ? Programs{} : object_programs();
        const GLuint plain_program = second != EGL_NO_CONTEXT ? with_objects.plain : program(vertex, "#version 310 es\nprecision highp float; in vec4 v; in vec2 at; uniform vec4 tint; uniform sampler2D image;\n"
                                                     "out vec4 c; void main() { c = fract(v * 0.3 + tint + texture(image, at)); }");
        const GLuint counting = program(vertex, "#version 310 es\nprecision highp float; in vec4 v; uniform vec4 tint; layout(binding = 0) uniform atomic_uint n;\n"
                                                "out vec4 c; void main() { atomicCounterIncrement(n); c = tint; }");
        GLuint counter = 0;
        glGenBuffers(1, &counter);
        glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, 0, counter);
        const GLuint zero = 0;
        glBufferData(GL_ATOMIC_COUNTER_BUFFER, 4, &zero, GL_DYNAMIC_COPY);
        const Surface other = surface(32, 32), s = surface(kSize, kSize, depth);
        RandomProgram random(seed, stencil, wide, plain_program, stencil || !depth ? (second != EGL_NO_CONTEXT ? with_objects.storing : counting) : plain_program);
        std::optional<RandomObjects> objects;
        if (!depth) random.no_depth();
        if (second != EGL_NO_CONTEXT) {
            const GLuint second_color = texture(kSize, kSize);
            glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffer);
            glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, second_color, 0);
            objects.emplace(random.random(), with_objects, kind != Target::foveated);
            objects->set_up(s, second_color, [&](const std::function<void()>& what) {
                use(second);
                what();
                use(own);
            });
            random.add_objects(*objects);
        }
        random.set_up(s, other);  // before the layer has names of its own: the program's are the same then
        if (kind == Target::gain_zero || kind == Target::foveated) foveate(s);
        if (kind == Target::foveated) focus(s, 0.1f, -0.2f, 5);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
        Outcome outcome;
        for (int i = 0; i < calls(); ++i) {
            if (kind == Target::rebound) bind_again();
            random.step();
            outcome.errors.push_back(glGetError());
            outcome.steps.push_back(random.last());
        }
        random.end();
        outcome.errors.push_back(glGetError());
        outcome.state = random.state();
        outcome.picture = read(s);
        if (objects) objects->end(), outcome.answers = std::move(objects->answers);
        outcome.errors.push_back(glGetError());
        use(context);
        for (const EGLContext c : {second, own})
            if (c != EGL_NO_CONTEXT) eglDestroyContext(display, c), contexts.pop_back();
        return outcome;
    }
    using Programs = RandomObjects::Programs;
    // All but the computing one write two colours.
    Programs object_programs() {
        const char* vertex = "#version 310 es\nlayout(location = 0) in vec2 p; layout(location = 1) in vec4 c; uniform float depth; uniform vec2 shift[3];\n"
                             "layout(std140, binding = 1) uniform Block { vec4 place; }; out vec4 v; out vec2 at;\n"
                             "void main() { v = c; at = p; gl_Position = vec4(p + shift[0] * 0.2 - shift[2] * 0.2 + place.xy * 0.1, depth, 1); }";
        const char* fragment = "#version 310 es\nprecision highp float; in vec4 v; in vec2 at; uniform vec4 tint; uniform sampler2D image;\n"
                               "layout(location = 0) out vec4 c; layout(location = 1) out vec4 d;\n"
                               "void main() { c = fract(v * 0.3 + tint + texture(image, at)); d = fract(tint + c.yzwx); }";
        const char* storing = "#version 310 es\nprecision highp float; in vec4 v; in vec2 at; uniform vec4 tint; layout(std430, binding = 0) buffer Store { uint n[4]; };\n"
                              "layout(location = 0) out vec4 c; layout(location = 1) out vec4 d; void main() { atomicAdd(n[0], 1u); c = tint; d = v; }";
        const char* computing = "#version 310 es\nlayout(local_size_x = 4) in; layout(std430, binding = 0) buffer Store { uint n[]; };\n"
                                "void main() { n[gl_LocalInvocationIndex] ^= 0x00400000u; }";
        return {.plain = program(vertex, fragment),
                .capturing = link({{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}, "at"),
                .storing = program(vertex, storing),
                .computing = link({{GL_COMPUTE_SHADER, computing}}),
                .vertex_stage = glCreateShaderProgramv(GL_VERTEX_SHADER, 1, &vertex),
                .fragment_stage = glCreateShaderProgramv(GL_FRAGMENT_SHADER, 1, &fragment)};
    }
    static void bind_again() {
        GLint used = 0;
        glGetIntegerv(GL_CURRENT_PROGRAM, &used);
        glUseProgram(0);
        glUseProgram(static_cast<GLuint>(used));
    }
    template <class Test>
    static void for_seeds(unsigned standard, Test test) {
        if (const char* one = std::getenv("FOVEA_LAYER_SEED")) return test(static_cast<unsigned>(std::atoi(one)));
        const char* many = std::getenv("FOVEA_LAYER_SEEDS");
        const unsigned count = many ? static_cast<unsigned>(std::atoi(many)) : standard;
        const char* from = std::getenv("FOVEA_LAYER_FIRST_SEED");
        const unsigned first = from ? static_cast<unsigned>(std::atoi(from)) : 2;
        for (const unsigned found : {94u, 276u, 1u}) test(found);  // failed once
        for (unsigned seed = first; seed < first + count && !HasFatalFailure(); ++seed) test(seed);
    }
};

TEST_F(RandomCalls, WithGainZeroEverythingIsThePlainDrivers) {
    for_seeds(22, [this](unsigned seed) {
        const bool depth = seed % 4 != 0;
        const Outcome plain = run(seed, Target::plain, depth, depth), layer = run(seed, Target::gain_zero, depth, depth);
        ASSERT_EQ(plain.errors, layer.errors) << "seed " << seed << first_difference(plain, layer);
        ASSERT_EQ(plain.state, layer.state) << "seed " << seed;
        // Mesa 22.3 draws one sequence in some thousand (seed 2507) otherwise when the program in use is bound again in
        // between, as a replay does; without the layer too.
        ASSERT_TRUE(plain.picture == layer.picture || run(seed, Target::rebound, depth, depth).picture == layer.picture) << "seed " << seed;
    });
}

TEST_F(RandomCalls, OfMoreKindsAreThePlainDriversAtGainZero) {
    for_seeds(9, [this](unsigned seed) {
        const bool depth = seed % 4 != 0;
        const Outcome plain = run(seed, Target::plain, depth, depth, Kinds::wide), layer = run(seed, Target::gain_zero, depth, depth, Kinds::wide);
        ASSERT_EQ(plain.errors, layer.errors) << "seed " << seed << first_difference(plain, layer);
        ASSERT_EQ(plain.state, layer.state) << "seed " << seed;
        ASSERT_TRUE(plain.picture == layer.picture || run(seed, Target::rebound, depth, depth, Kinds::wide).picture == layer.picture) << "seed " << seed;
    });
}

TEST_F(RandomCalls, AboutObjectsAreThePlainDriversAtGainZero) {
    for_seeds(2, [this](unsigned seed) {
        const bool depth = seed % 4 != 0;
        const auto run_on = [&](Target target) { return run(seed, target, depth, depth, Kinds::objects); };
        const Outcome plain = run_on(Target::plain), layer = run_on(Target::gain_zero);
        ASSERT_EQ(plain.errors, layer.errors) << "seed " << seed << first_difference(plain, layer);
        ASSERT_EQ(plain.state, layer.state) << "seed " << seed;
        const auto difference = [&layer](const Outcome& o) { return o.answers != layer.answers ? "answers" : o.picture != layer.picture ? "pictures" : ""; };
        const std::string differ = difference(plain);
        ASSERT_TRUE(differ.empty() || *difference(run_on(Target::rebound)) == '\0') << "seed " << seed << ": other " << differ;
    });
}

// Errors, state and the contents of buffers that no fragment writes.
TEST_F(RandomCalls, AboutObjectsAreThePlainDriversBesidesPixelsWithFoveation) {
    for_seeds(2, [this](unsigned seed) {
        const bool depth = seed % 2 == 0;
        const Outcome plain = run(seed, Target::plain, depth, depth, Kinds::objects), layer = run(seed, Target::foveated, depth, depth, Kinds::objects);
        ASSERT_EQ(plain.errors, layer.errors) << "seed " << seed << first_difference(plain, layer);
        ASSERT_EQ(plain.state, layer.state) << "seed " << seed;
    });
}

TEST_F(RandomCalls, WithFoveationErrorsStateAndTheFoveaAreThePlainDrivers) {
    for_seeds(22, [this](unsigned seed) {
        const bool depth = seed % 2 == 0, stencil = seed % 6 == 2;
        const Outcome plain = run(seed, Target::plain, stencil, depth), layer = run(seed, Target::foveated, stencil, depth);
        ASSERT_EQ(plain.errors, layer.errors) << "seed " << seed << first_difference(plain, layer);
        ASSERT_EQ(plain.state, layer.state) << "seed " << seed;
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x)
                if (spec_density({{0.1f, -0.2f, 5, 5, 0}}, (x + 0.5) / kSize * 2 - 1, (y + 0.5) / kSize * 2 - 1) >= 1) {
                    ASSERT_EQ(plain.picture.at(x, y), layer.picture.at(x, y)) << "seed " << seed << " at " << x << ' ' << y;
                }
    });
}

}  // namespace fovea::layer_test
