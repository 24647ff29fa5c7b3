#include "tests/render/gl_fixture.hpp"

#include <epoxy/gl.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace fovea::test {

const gl::Context& context() {
    static const gl::Context c = [] {
        auto r = gl::Context::create();
        if (!r) {
            std::fprintf(stderr, "no GL context: %s\n", r.error().message().c_str());
            std::abort();
        }
        return *std::move(r);
    }();
    return c;
}

Pixels read(const foveation::ViewTarget& t) {
    Pixels p(static_cast<std::size_t>(t.width_px) * static_cast<std::size_t>(t.height_px) * 4);
    gl::read_pixels(t.framebuffer, t.x_px, t.y_px, t.width_px, t.height_px, p);
    return p;
}

std::uint64_t hash(const Pixels& pixels) noexcept {
    std::uint64_t h = 0xcbf29ce484222325u;
    for (const std::uint8_t b : pixels) h = (h ^ b) * 0x100000001b3u;
    return h;
}

double psnr(const Pixels& a, const Pixels& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        sum += d * d;
    }
    return sum == 0 ? 200 : 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.size()) / sum);
}

Views::Views(int width, int height, std::size_t count) : focus(count) {
    for (std::size_t i = 0; i < count; ++i) {
        auto t = gl::RenderTarget::create({.width_px = width, .height_px = height});
        EXPECT_TRUE(t.has_value()) << t.error().message();
        owned.push_back(*std::move(t));
        targets.push_back({owned.back().framebuffer(), 0, 0, width, height});
        look(i, {});
    }
}

void Views::look(std::size_t view, const density::FocalPoint& point) {
    focus[view].points[0] = point;
    focus[view].count = 1;
}

QuadDraw::QuadDraw(const std::string& body, const QuadOptions& o) {
    const std::string vertex =
        "#version 310 es\nlayout(location = 0) uniform vec4 crop;\nlayout(location = 0) in vec3 p;\nout highp vec2 ndc;\n"
        "void main() { ndc = p.xy; gl_Position = vec4(p.xy * crop.xy + crop.zw, p.z * 2.0 - 1.0, 1.0); }\n";
    std::string outputs = o.more_outputs;
    for (int i = 1; i < o.outputs; ++i) outputs += "layout(location = " + std::to_string(i) + ") out vec4 color" + std::to_string(i) + ";\n";
    const auto fragment = [&](bool count) {
        return std::string("#version 310 es\nprecision highp float;\nprecision highp int;\n") +
               (count ? "layout(early_fragment_tests) in;\nlayout(binding = 0, offset = 0) uniform highp atomic_uint n;\n" : "") +
               "in highp vec2 ndc;\nlayout(location = 0) out vec4 color;\n" + outputs + "void main() {\n" +
               (count ? "atomicCounterIncrement(n);\n" : "") + body + "\n}\n";
    };
    auto program = gl::build_program("quad", vertex, fragment(false)), counting = gl::build_program("quad", vertex, fragment(true));
    EXPECT_TRUE(program.has_value()) << program.error().message();
    EXPECT_TRUE(counting.has_value()) << counting.error().message();
    program_ = *std::move(program);
    counting_ = *std::move(counting);
    const gl::Box& w = o.where;
    const float corners[] = {w.x0, w.y0, o.depth, w.x1, w.y0, o.depth_right, w.x1, w.y1, o.depth_right, w.x0, w.y1, o.depth};
    constexpr std::uint32_t kIndices[] = {0, 1, 2, 0, 2, 3};
    vertices_ = gl::create_vertex_buffer(std::as_bytes(std::span(corners)));
    indices_ = gl::create_vertex_buffer(std::as_bytes(std::span(kIndices)));
    arrays_ = gl::create_vertex_array();
    glBindVertexArray(arrays_.name());
    glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
    glBindVertexArray(0);
    list_.begin({}, {});
    gl::Draw d;
    d.program = program_.name();
    d.counting_program = counting_.name();
    d.vertex_array = arrays_.name();
    d.index_count = 6;
    d.bounds.fill(w);
    list_.add(d);
}

gl::CommandList QuadDraw::after(const gl::Clear& clear) const {
    gl::CommandList list;
    list.begin(clear, {});
    list.add(list_.draws()[0]);
    return list;
}

std::string footprint_shader(int width, int height) {
    return "vec2 px = vec2(dFdx(ndc.x), dFdy(ndc.y)) * vec2(" + std::to_string(width) + ".0, " + std::to_string(height) +
           ".0) * 0.5; color = vec4(px * 16.0 / 255.0, 0.0, 1.0);";
}

}  // namespace fovea::test
