#include "render/gl/objects.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>

#include "render/gl/context.hpp"

namespace fovea::gl {
namespace {

// The source with line numbers: the driver's messages refer to them.
std::string numbered(std::string_view source) {
    std::string out;
    int line = 1;
    while (!source.empty()) {
        const auto end = source.find('\n');
        out += std::to_string(line++) + ": " + std::string(source.substr(0, end)) + "\n";
        if (end == std::string_view::npos) break;
        source.remove_prefix(end + 1);
    }
    return out;
}

Result<Name> compile(std::string_view name, GLenum stage, const char* stage_name, std::string_view source) {
    const Name shader = glCreateShader(stage);
    if (shader == 0) return fail("no shader object (is a context current?)", std::string(name));
    const char* text = source.data();
    const auto length = static_cast<GLint>(source.size());
    glShaderSource(shader, 1, &text, &length);
    glCompileShader(shader);
    GLint ok = GL_FALSE;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok == GL_TRUE) return shader;
    std::array<char, 4096> log{};
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glDeleteShader(shader);
    return fail("the " + std::string(stage_name) + " shader does not compile: " + log.data() + "\n" + numbered(source),
                "shader '" + std::string(name) + "'", "the line numbers refer to the listing");
}

Result<Program> link(std::string_view name, std::span<const Name> shaders) {
    Program program(glCreateProgram());
    for (const Name s : shaders) glAttachShader(program.name(), s);
    glLinkProgram(program.name());
    for (const Name s : shaders) {
        glDetachShader(program.name(), s);
        glDeleteShader(s);
    }
    GLint ok = GL_FALSE;
    glGetProgramiv(program.name(), GL_LINK_STATUS, &ok);
    if (ok == GL_TRUE) return program;
    std::array<char, 4096> log{};
    glGetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), nullptr, log.data());
    return fail("the shaders do not link: " + std::string(log.data()), "shader '" + std::string(name) + "'");
}

}  // namespace

std::uint32_t internal_format(ColorFormat f) noexcept {
    switch (f) {
        case ColorFormat::rgba8: return GL_RGBA8;
        case ColorFormat::srgb8_alpha8: return GL_SRGB8_ALPHA8;
        case ColorFormat::rgba16f: return GL_RGBA16F;
    }
    return GL_RGBA8;
}

int samples_for(ColorFormat format, int wanted) noexcept {
    if (wanted < 2) return 0;
    std::array<std::array<GLint, 16>, 2> have{};
    const std::array<GLenum, 2> formats{internal_format(format), GL_DEPTH24_STENCIL8};
    for (std::size_t i = 0; i < 2; ++i) glGetInternalformativ(GL_RENDERBUFFER, formats[i], GL_SAMPLES, static_cast<GLsizei>(have[i].size()), have[i].data());
    int enough = 0, most = 0;
    for (const GLint n : have[0]) {
        if (n < 2 || std::ranges::find(have[1], n) == have[1].end()) continue;
        most = std::max(most, int{n});
        if (n >= wanted && (enough == 0 || n < enough)) enough = n;
    }
    return enough != 0 ? enough : most;
}

void destroy(ObjectKind kind, Name name) noexcept {
    if (eglGetCurrentContext() == EGL_NO_CONTEXT) return;   // it was lost or destroyed first: its objects went with it
    switch (kind) {
        case ObjectKind::program: glDeleteProgram(name); break;
        case ObjectKind::buffer: glDeleteBuffers(1, &name); break;
        case ObjectKind::vertex_array: glDeleteVertexArrays(1, &name); break;
        case ObjectKind::texture: glDeleteTextures(1, &name); break;
        case ObjectKind::renderbuffer: glDeleteRenderbuffers(1, &name); break;
        case ObjectKind::framebuffer: glDeleteFramebuffers(1, &name); break;
    }
}

Result<Program> build_program(std::string_view name, std::string_view vertex, std::string_view fragment) {
    const auto v = compile(name, GL_VERTEX_SHADER, "vertex", vertex);
    if (!v) return std::unexpected(v.error());
    const auto f = compile(name, GL_FRAGMENT_SHADER, "fragment", fragment);
    if (!f) {
        glDeleteShader(*v);
        return std::unexpected(f.error());
    }
    const std::array shaders{*v, *f};
    return link(name, shaders);
}

Result<Program> build_compute_program(std::string_view name, std::string_view compute) {
    const auto c = compile(name, GL_COMPUTE_SHADER, "compute", compute);
    if (!c) return std::unexpected(c.error());
    return link(name, std::span(&*c, 1));
}

Buffer create_vertex_buffer(std::span<const std::byte> bytes) noexcept {
    Name name = 0;
    glGenBuffers(1, &name);
    glBindBuffer(GL_COPY_WRITE_BUFFER, name);
    glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(bytes.size()), bytes.data(), GL_STATIC_DRAW);
    return Buffer(name);
}

Buffer create_dynamic_buffer(std::size_t size) noexcept {
    Name name = 0;
    glGenBuffers(1, &name);
    glBindBuffer(GL_COPY_WRITE_BUFFER, name);
    glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(size), nullptr, GL_DYNAMIC_DRAW);
    return Buffer(name);
}

void update_buffer(const Buffer& buffer, std::size_t offset, std::span<const std::byte> bytes) noexcept {
    glBindBuffer(GL_COPY_WRITE_BUFFER, buffer.name());
    glBufferSubData(GL_COPY_WRITE_BUFFER, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes.size()), bytes.data());
}

VertexArray create_vertex_array() noexcept {
    Name name = 0;
    glGenVertexArrays(1, &name);
    return VertexArray(name);
}

Result<RenderTarget> RenderTarget::create(const TargetSettings& s) {
    RenderTarget t;
    t.settings_ = s;
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    const std::string size = std::to_string(s.width_px) + "x" + std::to_string(s.height_px);
    if (s.width_px < 1 || s.height_px < 1 || s.width_px > limit || s.height_px > limit)
        return fail("a render target of " + size + " pixels is not possible", "OpenGL ES",
                    "each edge must be 1 to " + std::to_string(limit));
    static_cast<void>(pending_error());
    Name name = 0;
    glGenFramebuffers(1, &name);
    t.framebuffer_ = Framebuffer(name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    const GLenum format = internal_format(s.format);
    if (s.samples > 1) {
        glGenRenderbuffers(1, &name);
        t.color_samples_ = Renderbuffer(name);
        glBindRenderbuffer(GL_RENDERBUFFER, name);
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, s.samples, format, s.width_px, s.height_px);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, name);
    } else {
        glGenTextures(1, &name);
        t.color_ = Texture(name);
        glBindTexture(GL_TEXTURE_2D, name);
        glTexStorage2D(GL_TEXTURE_2D, 1, format, s.width_px, s.height_px);
        const GLint filter = s.filter == Filter::nearest ? GL_NEAREST : GL_LINEAR;
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, name, 0);
    }
    if (s.depth_stencil) {
        glGenRenderbuffers(1, &name);
        t.depth_stencil_ = Renderbuffer(name);
        glBindRenderbuffer(GL_RENDERBUFFER, name);
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, s.samples > 1 ? s.samples : 0, GL_DEPTH24_STENCIL8, s.width_px, s.height_px);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, name);
    }
    const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
    const std::string error = pending_error();
    if (!error.empty() || status != GL_FRAMEBUFFER_COMPLETE)
        return fail("a render target of " + size + " pixels and " + std::to_string(s.samples) + " samples cannot be created" +
                        (error.empty() ? "" : " (" + error + ")"),
                    "OpenGL ES", "use a smaller size or fewer samples");
    return t;
}

void copy_color(const RenderTarget& from, const RenderTarget& to) noexcept {
    FOVEA_REQUIRE(from.width() == to.width() && from.height() == to.height());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.framebuffer());
    glDisable(GL_SCISSOR_TEST);
    glBlitFramebuffer(0, 0, from.width(), from.height(), 0, 0, to.width(), to.height(), GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void read_pixels(Name framebuffer, int x, int y, int width, int height, std::span<std::uint8_t> rgba) noexcept {
    FOVEA_REQUIRE(rgba.size() >= static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
    // llvmpipe (Mesa 22.3) stops looking once it finds that queued work samples the image, and then lets the processor read it
    // although later queued work draws to it: one would get the picture before that.
    glFinish();
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(x, y, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
}

Fence& Fence::operator=(Fence&& other) noexcept {
    std::swap(sync_, other.sync_);
    return *this;
}

Fence::~Fence() {
    if (sync_ != nullptr && eglGetCurrentContext() != EGL_NO_CONTEXT) glDeleteSync(static_cast<GLsync>(sync_));
}

Fence Fence::insert() noexcept {
    Fence f;
    f.sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();
    return f;
}

std::optional<Instant> Fence::wait(const TimeSource& time, Duration timeout) noexcept {
    if (sync_ == nullptr || eglGetCurrentContext() == EGL_NO_CONTEXT) return std::nullopt;
    const GLenum r = glClientWaitSync(static_cast<GLsync>(sync_), GL_SYNC_FLUSH_COMMANDS_BIT, static_cast<GLuint64>(timeout.count()));
    if (r == GL_ALREADY_SIGNALED || r == GL_CONDITION_SATISFIED) return time.now();
    return std::nullopt;
}

void flush() noexcept { glFlush(); }
void finish() noexcept { glFinish(); }

}  // namespace fovea::gl
