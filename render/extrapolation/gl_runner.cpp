#include "render/extrapolation/gl_runner.hpp"

#include "render/extrapolation/gl_state.hpp"

namespace fovea::render::extrapolation {

namespace {

constexpr int kListUnit = 5;   // the texture unit of the lists
static_assert(kListUnit < GlStateGuard::kUnits);

const void* buffer_offset(int entry) noexcept { return reinterpret_cast<const void*>(static_cast<std::uintptr_t>(entry) * Args::kBytes); }

}  // namespace

Result<void> GlRunner::build(bool compute, int cell_px, bool cubic) {
    if (auto built = programs_.build(compute, cell_px, cubic); !built) return built;
    gl_.GenVertexArrays(1, &array_);
    GLuint names[2];
    gl_.GenFramebuffers(2, names);
    framebuffer_ = names[0];
    several_ = names[1];
    gl_.GenSamplers(2, names);
    linear_ = names[0];
    nearest_ = names[1];
    for (const GLuint s : names) {
        const GLint filter = s == linear_ ? GL_LINEAR : GL_NEAREST;
        gl_.SamplerParameteri(s, GL_TEXTURE_MIN_FILTER, filter);
        gl_.SamplerParameteri(s, GL_TEXTURE_MAG_FILTER, filter);
        gl_.SamplerParameteri(s, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl_.SamplerParameteri(s, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    GLint before = 0;
    gl_.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &before);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, several_);
    constexpr GLenum kAttachments[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl_.DrawBuffers(2, kAttachments);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(before));
    return {};
}

GlRunner::~GlRunner() {
    const GLuint samplers[] = {linear_, nearest_}, framebuffers[] = {framebuffer_, several_};
    gl_.DeleteSamplers(2, samplers);
    gl_.DeleteVertexArrays(1, &array_);
    gl_.DeleteFramebuffers(2, framebuffers);
}

GLuint GlRunner::make_image(int width, int height, GLenum format) noexcept {
    GLuint t = 0;
    gl_.GenTextures(1, &t);
    gl_.BindTexture(GL_TEXTURE_2D, t);
    gl_.TexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    return t;
}

void GlRunner::begin() noexcept {
    gl_.BindVertexArray(array_);
    for (GLuint unit = 0; unit < static_cast<GLuint>(GlStateGuard::kUnits); ++unit) gl_.BindSampler(unit, nearest_);
}

void GlRunner::set_lists(GLuint args_buffer, const std::array<GLuint, kLists>& lists, int tile_px, GLuint moving_blocks, int block_px) noexcept {
    gl_.BindBuffer(GL_DRAW_INDIRECT_BUFFER, args_buffer);
    gl_.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, args_buffer);
    lists_ = lists;
    tile_px_ = tile_px;
    blocks_ = moving_blocks;
    block_px_ = block_px;
}

void GlRunner::use(const GlProgram& program) noexcept {
    current_ = program;
    gl_.UseProgram(program.name);
}
void GlRunner::bind(int unit, GLuint texture) noexcept {
    gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    gl_.BindTexture(GL_TEXTURE_2D, texture);
}

void GlRunner::run_draw(int width, int height, const Over& where) noexcept {
    const GLfloat box[] = {0, 0, static_cast<GLfloat>(width), static_cast<GLfloat>(height)};
    if (gl_.ViewportIndexedfv != nullptr)
        gl_.ViewportIndexedfv(0, box);   // the others are the program's
    else
        gl_.Viewport(0, 0, width, height);
    if (where.what == Over::What::list) {
        bind(kListUnit, lists_[static_cast<std::size_t>(where.list)]);
        gl_.Uniform4i(current_.place, tile_px_ / where.texel_px, 0, width, height);
        return gl_.DrawArraysIndirect(GL_TRIANGLES, buffer_offset(Args::of(where.list)));
    }
    gl_.Uniform4i(current_.place, 0, 0, width, height);
    if (where.what == Over::What::everything) return gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    gl_.DrawArraysIndirect(GL_TRIANGLES, buffer_offset(Args::kDrawAny));
}

void GlRunner::attach(GLuint texture, int level) noexcept {
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer_);
    gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, level);
}

void GlRunner::draw(GLuint texture, int level, int width, int height, const Over& where) noexcept {
    attach(texture, level);
    run_draw(width, height, where);
}

void GlRunner::draw_several(std::span<const GLuint> textures, int width, int height, const Over& where) noexcept {
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, several_);
    for (GLenum i = 0; i < textures.size(); ++i) gl_.FramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0 + i, GL_TEXTURE_2D, textures[i], 0);
    run_draw(width, height, where);
}

void GlRunner::pass(Kernel kernel, GLuint target, int width, int height, const Over& where, GLenum format) noexcept {
    if (!programs_.computes(kernel)) return draw(target, 0, width, height, where);
    gl_.BindImageTexture(0, target, 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
    const bool listed = where.what == Over::What::list;
    if (listed) bind(kListUnit, blocks_);
    gl_.Uniform4i(current_.place, listed ? block_px_ / where.texel_px : 0, 0, width, height);
    if (where.what == Over::What::everything)
        gl_.DispatchCompute(static_cast<GLuint>((width + 7) / 8), static_cast<GLuint>((height + 7) / 8), 1);
    else
        gl_.DispatchComputeIndirect(static_cast<GLintptr>(where.dispatch) * Args::kBytes);
    gl_.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
}

void GlRunner::copy(GLuint from, int from_level, GLuint to, int to_level, int width, int height) noexcept {
    attach(to, to_level);
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, several_);
    gl_.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, from, from_level);
    gl_.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, 0, 0);
    gl_.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl_.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
}

void GlRunner::clear(GLuint texture, const float (&value)[4]) noexcept {
    attach(texture);
    gl_.ClearBufferfv(GL_COLOR, 0, value);
}

void GlRunner::clear_words(GLuint texture, const GLuint (&value)[4]) noexcept {
    attach(texture);
    gl_.ClearBufferuiv(GL_COLOR, 0, value);
}

void GlRunner::end() noexcept {
    attach(0);
}

}  // namespace fovea::render::extrapolation
