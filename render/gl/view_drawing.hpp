// Several views in one draw: three ways, behind one shader source written with gl_ViewID_OVR.
//
//   multiview2   GL_OVR_multiview2: the driver draws into the layers of an array; every view is drawn as if alone
//   instanced    every instance is a view, moved into its part of one image by the vertex stage and cut off at the part's
//                edges by four clip distances (GL_EXT_clip_cull_distance): equal up to the rounding of interpolation
//   repeated     a draw per view: what every driver has
//
// The source of a stage ("complete, but without a #version line") may use, and is given what they stand for:
//   gl_ViewID_OVR         both stages: the view, 0 to VIEWS - 1
//   VIEWS                 views of a draw; 1 when repeated
//   VIEW_DATA             elements that an array of per-view data in a uniform block has
//   VIEW_INDEX            which of those this view reads: several views may share data (Arm's inset and outset of an eye)
//   place_in_view(vec4)   vertex stage: sets gl_Position from clip coordinates of the whole view, the part of the view
//                         chosen by `crop` (render/gl/command_list.hpp) and, where it applies, the part of the image
// Locations 0 to 11 of the uniforms are taken: crops, parts of the image and indices of the views, in this order.
// Source: GL_OVR_multiview2, GL_EXT_clip_cull_distance.
// Threads: the functions that ask the driver: the context's. Errors: none; whoever builds the shaders reports them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace fovea::gl {

inline constexpr int kMostViewsAtOnce = 4;

enum class ViewDrawing : std::uint8_t { repeated, instanced, multiview2 };
[[nodiscard]] const char* view_drawing_name(ViewDrawing drawing) noexcept;

// How the programs of a list draw, or how a method wants them to.
struct ViewsAtOnce {
    ViewDrawing drawing = ViewDrawing::repeated;
    int views = 1;   // in one draw: 1 when repeated, else 2 to kMostViewsAtOnce
    bool operator==(const ViewsAtOnce&) const = default;
};

// Of the current context. repeated is always there.
[[nodiscard]] bool can_draw(ViewDrawing drawing) noexcept;

[[nodiscard]] std::string vertex_for_views(std::string_view source, const ViewsAtOnce& at_once);
[[nodiscard]] std::string fragment_for_views(std::string_view source, const ViewsAtOnce& at_once);

}  // namespace fovea::gl
