// Runs kernels: which program, which images, over which part of an image.
//
// A pass goes over everything, over everything if anything moves, or over a list of tiles. How long a list is only the driver
// knows: draws and dispatches take their counts from a buffer that it has filled, and nothing is read back.
//
//   args buffer, 16 bytes each:   draw and tiles of each list; draw everything; dispatch `moving`, a level x n
//
// Threads: the context's thread.
#pragma once

#include <array>
#include <span>

#include "render/extrapolation/gl_functions.hpp"
#include "render/extrapolation/gl_programs.hpp"

namespace fovea::render::extrapolation {

// Tiles of which patches do not agree; those that anything may land in that moves alike, and that does not; the calm ones
// beside torn ones; those near edges of motion; at the rim of what stands still; those where anything differs and those beside them.
enum class List : std::uint8_t { rough, calm, torn, hem, edges, rims, moving };
inline constexpr int kLists = 7;

// Where in the args buffer, in units of 16 bytes.
struct Args {
    static constexpr int of(List list) noexcept { return 2 * static_cast<int>(list); }   // to draw it; then how many tiles it has
    static constexpr int kDrawAny = 2 * kLists;       // one triangle, or none
    static constexpr int kPatches = kDrawAny + 1;     // the work groups of the patches of `moving`
    static constexpr int kLevel = kPatches + 1;       // the work groups of the patches of each level
    static constexpr int kBytes = 16;
};

// Where a pass goes.
struct Over {
    enum class What : std::uint8_t { everything, everything_if_any, list } what = What::everything;
    List list = List::moving;
    int texel_px = 1;    // pixels of the picture per texel of the target
    int dispatch = 0;    // Args entry of a computed pass that is not over everything
};
[[nodiscard]] constexpr Over over_all() noexcept { return {}; }
[[nodiscard]] constexpr Over over_all_if_any(int dispatch = Args::kLevel) noexcept { return {Over::What::everything_if_any, List::moving, 1, dispatch}; }
[[nodiscard]] constexpr Over over(List list, int texel_px) noexcept { return {Over::What::list, list, texel_px, Args::kPatches}; }

enum class Filter : std::uint8_t { nearest, linear };

class GlRunner {
public:
    explicit GlRunner(const GlFunctions& gl) noexcept : gl_(gl), programs_(gl) {}
    ~GlRunner();
    GlRunner(const GlRunner&) = delete;
    GlRunner& operator=(const GlRunner&) = delete;
    [[nodiscard]] Result<void> build(bool compute, int cell_px, bool cubic);

    // A GlStateGuard with passes is alive, here and below.
    void begin() noexcept;
    // See gl_regions.hpp.
    void set_lists(GLuint args_buffer, const std::array<GLuint, kLists>& lists, int tile_px, GLuint moving_blocks, int block_px) noexcept;

    void use(const GlProgram& program) noexcept;
    void use(Kernel kernel) noexcept { use(programs_.of(kernel)); }
    void bind(int unit, GLuint texture) noexcept;
    void sample(int unit, Filter how) noexcept { gl_.BindSampler(static_cast<GLuint>(unit), how == Filter::linear ? linear_ : nearest_); }
    void set_size(int x, int y) noexcept { gl_.Uniform2i(current_.size, x, y); }
    void set_cell(int px) noexcept { gl_.Uniform1i(current_.cell, px); }
    void set_rounds(int n) noexcept { gl_.Uniform1i(current_.rounds, n); }
    void set_reach(float v) noexcept { gl_.Uniform1f(current_.reach, v); }
    void set_step(float px) noexcept { gl_.Uniform1f(current_.step_px, px); }

    // Runs the kernel in use over an image in between.
    void pass(Kernel kernel, GLuint target, int width, int height, const Over& where, GLenum format = GL_RGBA16F) noexcept;
    void draw(GLuint texture, int level, int width, int height, const Over& where) noexcept;
    void draw_several(std::span<const GLuint> textures, int width, int height, const Over& where) noexcept;
    void copy(GLuint from, int from_level, GLuint to, int to_level, int width, int height) noexcept;
    void clear(GLuint texture, const float (&value)[4]) noexcept;
    void clear_words(GLuint texture, const GLuint (&value)[4]) noexcept;
    void attach(GLuint texture, int level = 0) noexcept;   // to be drawn to, or read from
    void end() noexcept;   // nothing of the program's stays attached

    [[nodiscard]] const GlFunctions& gl() const noexcept { return gl_; }
    [[nodiscard]] const GlPrograms& programs() const noexcept { return programs_; }
    [[nodiscard]] GLuint framebuffer() const noexcept { return framebuffer_; }
    [[nodiscard]] GLuint make_image(int width, int height, GLenum format = GL_RGBA16F) noexcept;

private:
    void run_draw(int width, int height, const Over& where) noexcept;

    const GlFunctions& gl_;
    GlPrograms programs_;
    GlProgram current_;
    GLuint array_ = 0, framebuffer_ = 0, several_ = 0, linear_ = 0, nearest_ = 0;
    std::array<GLuint, kLists> lists_{};
    GLuint blocks_ = 0;
    int tile_px_ = 0, block_px_ = 0;
};

}  // namespace fovea::render::extrapolation
