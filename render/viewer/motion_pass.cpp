#include "render/viewer/motion_pass.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

namespace fovea::viewer {

namespace {

using scene::Mat4;
using Point = std::array<double, 3>;

constexpr int kCell_px = 2;
constexpr float kSky_m = 1000;   // further than any scene: only turns move it

// The contract of command_list.hpp and the View and Object blocks of the scenes, as far as they are needed.
constexpr const char* kVertex = R"(precision highp float;
layout(std140, binding = 0) uniform View { mat4 clip_from_world; };
layout(location = 0) uniform vec4 crop;
layout(location = 0) in vec3 position;
out highp float away;
void main() {
    vec4 p = clip_from_world * PLACED;
    away = p.w;
    gl_Position = vec4(p.xy * crop.xy + p.w * crop.zw, p.zw);
}
)";
constexpr const char* kFragment = R"(#version 310 es
precision highp float;
in highp float away;
layout(location = 0) out highp vec4 color;
void main() { color = vec4(away); }
)";

Result<gl::Program> build(bool placed) {
    std::string text = std::string("#version 310 es\n") + (placed ? "layout(std140, binding = 1) uniform Object { highp mat4 world_from_object; };\n" : "") + kVertex;
    const std::string mark = "PLACED";
    text.replace(text.find(mark), mark.size(), placed ? "(world_from_object * vec4(position, 1.0))" : "vec4(position, 1.0)");
    return gl::build_program(placed ? "motion of objects" : "motion", text, kFragment);
}

Point moved_by(const Mat4& m, const Point& p) noexcept {
    Point r{};
    for (std::size_t i = 0; i < 3; ++i) r[i] = m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i];
    return r;
}

// Of an affine transform; all zero where it has none.
Mat4 inverse_of(const Mat4& m) noexcept {
    const auto at = [&](std::size_t row, std::size_t column) { return m[4 * column + row]; };
    Mat4 r{};
    double det = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3;
            r[4 * i + c] = at(i1, c1) * at(i2, c2) - at(i1, c2) * at(i2, c1);
        }
        det += at(0, c) * r[c];
    }
    if (!(std::abs(det) > 1e-12)) return Mat4{};
    for (double& v : r) v /= det;
    r[15] = 1;
    for (std::size_t i = 0; i < 3; ++i) r[12 + i] = -(r[i] * m[12] + r[4 + i] * m[13] + r[8 + i] * m[14]);
    return r;
}

bool inside(const scene::Aabb& box, const Point& p) noexcept {
    constexpr double kSlack_m = 0.02;   // the depth is rounded to 11 bits
    for (std::size_t i = 0; i < 3; ++i)
        if (p[i] < static_cast<double>(box.low[i]) - kSlack_m || p[i] > static_cast<double>(box.high[i]) + kSlack_m) return false;
    return true;
}

}  // namespace

double object_motion_px(std::span<const scene::ObjectMotion> objects, const scene::Pose& camera, const FieldOfView& fov, int width_px) noexcept {
    const double px_per_tan = width_px / (fov.tan_right - fov.tan_left);
    double most = 0;
    for (const scene::ObjectMotion& o : objects) {
        Point middle{};
        for (std::size_t i = 0; i < 3; ++i) middle[i] = 0.5 * (static_cast<double>(o.bounds.low[i]) + static_cast<double>(o.bounds.high[i]));
        const Point is = moved_by(o.world_from_object, middle), was = moved_by(o.previous_world_from_object, middle);
        const double moved = std::hypot(is[0] - was[0], is[1] - was[1], is[2] - was[2]);
        const double away = std::hypot(is[0] - camera.x_m, is[1] - camera.y_m, is[2] - camera.z_m);
        most = std::max(most, moved / std::max(away, 0.1) * px_per_tan);
    }
    return most;
}

Result<void> MotionPass::draw(const gl::CommandList& draws, std::uint32_t eye, const scene::SceneView& view, int width_px, int height_px, const Cameras& cameras,
                              std::span<const scene::ObjectMotion> objects) {
    const int columns = (width_px + kCell_px - 1) / kCell_px, rows = (height_px + kCell_px - 1) / kCell_px;
    if (target_.width() != columns || target_.height() != rows) {
        auto target = gl::RenderTarget::create({.width_px = columns, .height_px = rows, .format = gl::ColorFormat::rgba16f});
        if (!target) return std::unexpected(target.error());
        target_ = *std::move(target);
        const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
        read_.resize(4 * cells);
        motion_.resize(2 * cells);
        ahead_.resize(2 * cells);
        depth_.resize(cells);
    }
    const bool placed = draws.buffers().object_size != 0;
    gl::Program& program = placed ? placed_ : plain_;
    if (!program) {
        auto built = build(placed);
        if (!built) return std::unexpected(built.error());
        program = *std::move(built);
    }
    list_.begin({}, draws.buffers());
    for (gl::Draw d : draws.draws()) {
        if (d.blend) continue;
        d.program = program.name();
        d.counting_program = 0;
        d.textures = {};
        list_.add(d);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer());
    glViewport(0, 0, columns, rows);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    const std::array sky{kSky_m, kSky_m, kSky_m, kSky_m};
    const float far = 1;
    glClearBufferfv(GL_COLOR, 0, sky.data());
    glClearBufferfv(GL_DEPTH, 0, &far);
    list_.submit({.view = eye});
    glReadPixels(0, 0, columns, rows, GL_RGBA, GL_FLOAT, read_.data());
    glBindFramebuffer(GL_FRAMEBUFFER, 0);

    const Mat4 from_world = scene::view_from_world(cameras.now, view.offset_m), world_from = inverse_of(from_world);
    const Mat4 to_view = scene::view_from_world(cameras.then, view.offset_m), from_view = scene::view_from_world(cameras.before, view.offset_m);
    struct Mover {
        Mat4 object_from_world;
        const scene::ObjectMotion* motion;
    };
    std::vector<Mover> movers;
    for (const scene::ObjectMotion& o : objects)
        if (o.world_from_object != o.previous_world_from_object) movers.push_back({inverse_of(o.world_from_object), &o});
    const FieldOfView& f = view.fov;
    const double wide = f.tan_right - f.tan_left, high = f.tan_up - f.tan_down;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
            const double away = std::clamp(static_cast<double>(read_[4 * at]), 1e-3, static_cast<double>(kSky_m));
            const double tx = f.tan_left + wide * (x + 0.5) / columns, ty = f.tan_down + high * (y + 0.5) / rows;
            Point world = moved_by(world_from, {tx * away, ty * away, -away}), was = world;
            for (const Mover& m : movers) {
                const Point p = moved_by(m.object_from_world, world);
                if (!inside(m.motion->bounds, p)) continue;
                was = moved_by(m.motion->previous_world_from_object, p);
                for (std::size_t i = 0; i < 3; ++i) world[i] += cameras.factor * (world[i] - was[i]);
                break;
            }
            depth_[at] = static_cast<float>(away);
            const Point seen = moved_by(to_view, world), before = moved_by(from_view, was);
            const bool ahead = seen[2] < -1e-3, behind = before[2] < -1e-3;
            ahead_[2 * at] = ahead ? static_cast<float>((seen[0] / -seen[2] - tx) / wide * width_px) : 0.0f;
            ahead_[2 * at + 1] = ahead ? static_cast<float>((seen[1] / -seen[2] - ty) / high * height_px) : 0.0f;
            motion_[2 * at] = behind ? static_cast<float>((tx - before[0] / -before[2]) / wide * width_px) : kNoMotion_px;
            motion_[2 * at + 1] = behind ? static_cast<float>((ty - before[1] / -before[2]) / high * height_px) : kNoMotion_px;
        }
    return {};
}

}  // namespace fovea::viewer
