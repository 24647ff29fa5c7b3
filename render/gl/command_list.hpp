// Draws recorded once and submitted as often as a foveation method needs them: once per level and view.
//
// The contract with shaders:
//   uniform block `View`, binding 0   the app's own per-view data; the list binds the part of the view submitted
//   uniform block `Object`, binding 1 the app's own per-draw data
//   samplers, bindings 3 and 4        the draw's own textures, where it has any
//   uniform vec4, location 0 of the vertex stage (`crop`), gl_Position.xy = p.xy * crop.xy + p.w * crop.zw
//                                     chooses a part of the view; {1, 1, 0, 0} is the whole view, bit for bit
// Programs that draw several views at once: render/gl/view_drawing.hpp. They read a `View` block of all views' data.
// Viewport, scissor, stencil and the framebuffer belong to the method and are never touched here.
// Threads: the context's. add() allocates only beyond the capacity of earlier frames; submit() never.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/gl/objects.hpp"
#include "render/gl/view_drawing.hpp"

namespace fovea::gl {

inline constexpr std::size_t kListViews = 4;
inline constexpr std::uint32_t kTextureUnit = 3;   // the methods use those before it

// In NDC of a view.
struct Box {
    float x0 = -1, y0 = -1, x1 = 1, y1 = 1;
    [[nodiscard]] bool overlaps(const Box& o) const noexcept { return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1; }
    [[nodiscard]] bool empty() const noexcept { return !(x0 < x1 && y0 < y1); }
};

struct Draw {
    Name program = 0;
    Name counting_program = 0;    // the same, adding its fragments to atomic counter binding 0; 0: none
    Name views_program = 0, views_counting_program = 0;   // the same, all views at once (Buffers::at_once); 0: none
    Name vertex_array = 0;        // with an index buffer of uint32
    std::uint32_t index_count = 0, first_index = 0;
    std::uint32_t object_offset = 0;   // of this draw's Object block, bytes
    std::uint32_t instances = 1;
    bool cull_back = true;
    bool blend = false;                // over what is there, by alpha; writes no depth
    std::array<Name, 2> textures{};    // 2D, at kTextureUnit and the next; 0: left as it is
    std::array<Box, kListViews> bounds;  // what the draw can touch in each view; empty: nothing there
};

struct Clear {
    std::array<float, 4> color{0, 0, 0, 1};   // of every colour attachment; integer attachments get 0
    float depth = 1;
    // The draws go on over what the framebuffer holds. Depth outside the fovea is only there to go on from if the frame
    // before was drawn with MethodSettings::resolve_depth, or in full.
    bool keep_color = false, keep_depth = false;
};

// One submission.
struct Pass {
    std::uint32_t view = 0;
    std::array<float, 4> crop{1, 1, 0, 0};
    std::span<const Box> only_in{};   // draws that touch none of these boxes are left out; empty span: all are drawn
    bool count_fragments = false;
};

// One submission of several views by one draw each.
struct ViewsPass {
    struct View {
        std::uint32_t view = 0;   // of the list: bounds, and part of the View buffer
        std::array<float, 4> crop{1, 1, 0, 0};
        std::array<float, 4> part{1, 1, 0, 0};   // of the framebuffer, NDC: scale and middle; instanced only
        Box only_in{-4, -4, 4, 4};               // a draw that touches no view's box is left out
    };
    std::span<const View> views;   // as many as the list's programs draw at once
    bool count_fragments = false;
};

class CommandList {
public:
    // The buffers must outlive the submissions. Strides and offsets: multiples of the driver's uniform alignment
    // (uniform_alignment()); object_size 0: no Object block.
    struct Buffers {
        Name view = 0;
        std::uint32_t view_stride = 0, view_size = 0;
        Name object = 0;
        std::uint32_t object_size = 0;
        ViewsAtOnce at_once;   // of the draws' views_program; repeated: they have none
    };
    // Forgets the draws, keeps the memory.
    void begin(const Clear& clear, const Buffers& buffers) noexcept;
    void add(const Draw& draw) { draws_.push_back(draw); }

    [[nodiscard]] bool empty() const noexcept { return draws_.empty(); }
    [[nodiscard]] std::size_t size() const noexcept { return draws_.size(); }
    [[nodiscard]] const Clear& clear() const noexcept { return clear_; }
    [[nodiscard]] std::span<const Draw> draws() const noexcept { return draws_; }
    [[nodiscard]] const Buffers& buffers() const noexcept { return buffers_; }
    [[nodiscard]] std::uint64_t triangles() const noexcept;

    // Issues the draws with depth test on. Returns how many were issued.
    std::size_t submit(const Pass& pass) const noexcept;
    // True if every draw can be drawn so.
    [[nodiscard]] bool draws_at_once(const ViewsAtOnce& at_once, bool count_fragments) const noexcept;
    // The same for several views, only if draws_at_once().
    std::size_t submit_views(const ViewsPass& pass) const noexcept;

private:
    template <class Wanted, class Use>
    std::size_t issue(std::uint32_t views, Wanted&& wanted, Use&& use) const noexcept;

    Clear clear_;
    Buffers buffers_;
    std::vector<Draw> draws_;
};

[[nodiscard]] std::uint32_t uniform_alignment() noexcept;

}  // namespace fovea::gl
