#include "render/gl/view_drawing.hpp"

#include <epoxy/gl.h>

#include "protocol/error.hpp"
#include "render/gl/command_list.hpp"

namespace fovea::gl {
namespace {

static_assert(kMostViewsAtOnce == kListViews);

constexpr std::string_view kViewId = "gl_ViewID_OVR";

constexpr const char* kPlaceRepeated = R"(
layout(location = 0) uniform highp vec4 crop;
void place_in_view(highp vec4 p) { gl_Position = vec4(p.xy * crop.xy + p.w * crop.zw, p.zw); }
)";
constexpr const char* kPlaceMultiview = R"(
void place_in_view(highp vec4 p) {
    highp vec4 c = fovea_views[gl_ViewID_OVR];
    gl_Position = vec4(p.xy * c.xy + p.w * c.zw, p.zw);
}
)";
constexpr const char* kPlaceInstanced = R"(
flat out highp uint fovea_view;
out highp float gl_ClipDistance[4];
void place_in_view(highp vec4 p) {
    fovea_view = uint(gl_InstanceID);
    highp vec4 c = fovea_views[gl_InstanceID], at = fovea_views[VIEWS + gl_InstanceID];
    highp vec2 q = p.xy * c.xy + p.w * c.zw;
    gl_ClipDistance[0] = p.w + q.x;
    gl_ClipDistance[1] = p.w - q.x;
    gl_ClipDistance[2] = p.w + q.y;
    gl_ClipDistance[3] = p.w - q.y;
    gl_Position = vec4(q * at.xy + p.w * at.zw, p.zw);
}
)";

std::string replaced(std::string_view source, std::string_view what, std::string_view with) {
    std::string out;
    for (auto at = source.find(what); at != source.npos; at = source.find(what)) {
        out.append(source.substr(0, at)).append(with);
        source.remove_prefix(at + what.size());
    }
    return out.append(source);
}

std::string head(const ViewsAtOnce& a, bool vertex) {
    FOVEA_REQUIRE(a.views >= 1 && a.views <= kMostViewsAtOnce && (a.drawing != ViewDrawing::repeated || a.views == 1));
    std::string h = "#version 310 es\n";
    if (a.drawing == ViewDrawing::multiview2) h += "#extension GL_OVR_multiview2 : require\n";
    if (a.drawing == ViewDrawing::instanced && vertex) h += "#extension GL_EXT_clip_cull_distance : require\n";
    if (a.drawing == ViewDrawing::multiview2 && vertex) h += "layout(num_views = " + std::to_string(a.views) + ") in;\n";
    h += "#define VIEWS " + std::to_string(a.views) + "\n";
    if (a.drawing == ViewDrawing::repeated) return h + "#define VIEW_DATA 1\n#define VIEW_INDEX 0u\n";
    return h + "#define VIEW_DATA " + std::to_string(kMostViewsAtOnce) +
           // Crops, parts of the image, indices: one array, so that none of them is ever unused and without a location.
           "\nlayout(location = 0) uniform highp vec4 fovea_views[3 * VIEWS];\n"
           "#define VIEW_INDEX uint(fovea_views[2 * VIEWS + int(gl_ViewID_OVR)].x)\n";
}

// What the name stands for in a stage.
std::string finished(const std::string& source, const ViewsAtOnce& a, bool vertex) {
    switch (a.drawing) {
        case ViewDrawing::repeated: return replaced(source, kViewId, "0u");
        case ViewDrawing::instanced: return replaced(source, kViewId, vertex ? "uint(gl_InstanceID)" : "fovea_view");
        case ViewDrawing::multiview2: break;
    }
    return source;
}

}  // namespace

const char* view_drawing_name(ViewDrawing drawing) noexcept {
    switch (drawing) {
        case ViewDrawing::instanced: return "instanced";
        case ViewDrawing::multiview2: return "multiview2";
        case ViewDrawing::repeated: break;
    }
    return "repeated";
}

bool can_draw(ViewDrawing drawing) noexcept {
    switch (drawing) {
        case ViewDrawing::repeated: return true;
        case ViewDrawing::instanced: return epoxy_has_gl_extension("GL_EXT_clip_cull_distance");
        case ViewDrawing::multiview2: {
            if (!epoxy_has_gl_extension("GL_OVR_multiview2")) return false;
            GLint most = 0;
            glGetIntegerv(GL_MAX_VIEWS_OVR, &most);
            return most >= kMostViewsAtOnce;   // the specification asks for 2 only: Arm's method has 4
        }
    }
    return false;
}

std::string vertex_for_views(std::string_view source, const ViewsAtOnce& a) {
    const char* place = a.drawing == ViewDrawing::repeated ? kPlaceRepeated : a.drawing == ViewDrawing::instanced ? kPlaceInstanced : kPlaceMultiview;
    return finished(head(a, true) + place + std::string(source), a, true);
}

std::string fragment_for_views(std::string_view source, const ViewsAtOnce& a) {
    std::string h = head(a, false);
    if (a.drawing == ViewDrawing::instanced) h += "flat in highp uint fovea_view;\n";
    return finished(h + std::string(source), a, false);
}

}  // namespace fovea::gl
