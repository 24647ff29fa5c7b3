#include "render/scene/model_draws.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

namespace fovea::scene {
namespace {

// Columns of the inverse transpose, up to a positive factor: normals are normalised in the shader.
std::array<std::array<float, 4>, 3> normal_columns(const Mat4& m) noexcept {
    const auto column = [&](std::size_t c) { return std::array<double, 3>{m[c * 4], m[c * 4 + 1], m[c * 4 + 2]}; };
    const auto cross = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
        return std::array<double, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const auto x = column(0), y = column(1), z = column(2);
    const std::array<std::array<double, 3>, 3> cofactors{cross(y, z), cross(z, x), cross(x, y)};
    const double sign = x[0] * cofactors[0][0] + x[1] * cofactors[0][1] + x[2] * cofactors[0][2] < 0 ? -1 : 1;
    double largest = 1e-300;
    for (const auto& c : cofactors)
        for (const double v : c) largest = std::max(largest, std::abs(v));
    std::array<std::array<float, 4>, 3> r{};
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < 3; ++i) r[c][i] = static_cast<float>(sign * cofactors[c][i] / largest);
    return r;
}

bool mirrors(const Mat4& m) noexcept {
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) + m[8] * (m[1] * m[6] - m[2] * m[5]) < 0;
}

}  // namespace

Result<gl::Name> ModelDraws::program(const ShaderOptions& options) {
    for (const Variant& v : programs_)
        if (v.options == options) return v.program.name();
    auto built = gl::build_program("scene model", vertex_shader(Family::model, options.at_once), fragment_shader(options));
    if (!built) return std::unexpected(built.error());
    programs_.push_back({options, *std::move(built)});
    return programs_.back().program.name();
}

Result<gl::Name> ModelDraws::texture(int image, bool srgb, bool repeat) {
    for (const Upload& u : textures_)
        if (u.image == image && u.srgb == srgb && u.repeat == repeat) return u.texture.name();
    const Image& from = model_.images[static_cast<std::size_t>(image)];
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
    if (from.width > most || from.height > most)
        return fail("a picture of " + std::to_string(from.width) + "x" + std::to_string(from.height) + " pixels", "picture " + std::to_string(image), "this driver takes " + std::to_string(most));
    GLuint name = 0;
    glGenTextures(1, &name);
    gl::Texture texture(name);
    glActiveTexture(GL_TEXTURE0 + gl::kTextureUnit);
    glBindTexture(GL_TEXTURE_2D, name);
    int levels = 1;
    while ((std::max(from.width, from.height) >> levels) > 0) ++levels;
    glTexStorage2D(GL_TEXTURE_2D, levels, srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, from.width, from.height);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, from.width, from.height, GL_RGBA, GL_UNSIGNED_BYTE, from.rgba.data());
    glGenerateMipmap(GL_TEXTURE_2D);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, repeat ? GL_REPEAT : GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, repeat ? GL_REPEAT : GL_CLAMP_TO_EDGE);
    glActiveTexture(GL_TEXTURE0);
    textures_.push_back({image, srgb, repeat, std::move(texture)});
    return textures_.back().texture.name();
}

ShaderOptions ModelDraws::options_of(const Part& part) const noexcept {
    const ModelMaterial& m = model_.materials[part.material];
    return {.family = Family::model, .extra_lights = extra_lights_, .color_image = m.color_image >= 0, .surface_image = m.surface_image >= 0, .cut_out = m.alpha_cutoff > 0};
}

Result<void> ModelDraws::draw_at_once(const gl::ViewsAtOnce& how) {
    std::vector<std::array<gl::Name, 2>> made(draws_.size());
    for (std::size_t i = 0; i < draws_.size() && how.drawing != gl::ViewDrawing::repeated; ++i)
        for (const bool count : {false, true}) {
            if (count && !count_fragments_) continue;
            ShaderOptions o = options_of(model_.parts[draws_[i].part]);
            o.at_once = how;
            o.count_fragments = count;
            const auto p = program(o);
            if (!p) return std::unexpected(p.error());
            made[i][count] = *p;
        }
    for (std::size_t i = 0; i < draws_.size(); ++i) {
        draws_[i].draw.views_program = made[i][0];
        draws_[i].draw.views_counting_program = made[i][1];
    }
    std::erase_if(programs_, [&](const Variant& v) { return v.options.at_once != gl::ViewsAtOnce{} && v.options.at_once != how; });
    return {};
}

Result<void> ModelDraws::add_items() {
    const std::vector<bool> moving = moving_nodes(model_);
    for (std::size_t n = 0; n < model_.nodes.size(); ++n) {
        const Node& node = model_.nodes[n];
        if (node.mesh < 0) continue;
        const PartRange range = model_.meshes[static_cast<std::size_t>(node.mesh)];
        for (std::uint32_t p = range.first; p < range.first + range.count; ++p) {
            const Part& part = model_.parts[p];
            const ModelMaterial& m = model_.materials[part.material];
            Item item;
            item.node = static_cast<std::uint32_t>(n);
            item.part = p;
            ShaderOptions o = options_of(part);
            auto plain = program(o);
            if (!plain) return std::unexpected(plain.error());
            item.draw.program = *plain;
            if (count_fragments_) {
                o.count_fragments = true;
                auto counting = program(o);
                if (!counting) return std::unexpected(counting.error());
                item.draw.counting_program = *counting;
            }
            const std::array<std::pair<int, bool>, 2> pictures{{{m.color_image, true}, {m.surface_image, false}}};
            for (std::size_t i = 0; i < 2; ++i) {
                if (pictures[i].first < 0) continue;
                auto t = texture(pictures[i].first, pictures[i].second, m.repeat);
                if (!t) return std::unexpected(t.error());
                item.draw.textures[i] = *t;
            }
            item.draw.first_index = part.first_index;
            item.draw.index_count = part.index_count;
            item.draw.object_offset = static_cast<std::uint32_t>(draws_.size()) * stride_;
            item.draw.cull_back = !m.double_sided;
            item.draw.blend = m.blend;
            if (moving[n]) {
                item.motion = static_cast<int>(motion_.size());
                motion_.push_back({.bounds = part.bounds});
            }
            draws_.push_back(item);
        }
    }
    return {};
}

Result<ModelDraws> ModelDraws::create(Model model, bool count_fragments, int extra_lights) {
    ModelDraws d;
    d.model_ = std::move(model);
    const std::uint32_t alignment = gl::uniform_alignment();
    d.stride_ = (static_cast<std::uint32_t>(sizeof(ObjectBlock)) + alignment - 1) / alignment * alignment;
    d.count_fragments_ = count_fragments;
    d.extra_lights_ = extra_lights;
    if (auto ok = d.add_items(); !ok) return std::unexpected(ok.error());
    d.model_.images = {};
    d.vertices_ = gl::create_vertex_buffer(std::as_bytes(std::span(d.model_.vertices)));
    d.indices_ = gl::create_vertex_buffer(std::as_bytes(std::span(d.model_.indices)));
    d.model_.vertices = {};
    d.model_.indices = {};
    d.arrays_ = gl::create_vertex_array();
    glBindVertexArray(d.arrays_.name());
    glBindBuffer(GL_ARRAY_BUFFER, d.vertices_.name());
    const auto offset = [](std::size_t bytes) { return reinterpret_cast<const void*>(bytes); };
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(ModelVertex), offset(offsetof(ModelVertex, position)));
    glVertexAttribPointer(1, 4, GL_SHORT, GL_TRUE, sizeof(ModelVertex), offset(offsetof(ModelVertex, normal)));
    glVertexAttribPointer(2, 2, GL_FLOAT, GL_FALSE, sizeof(ModelVertex), offset(offsetof(ModelVertex, uv)));
    for (GLuint i = 0; i < 3; ++i) glEnableVertexAttribArray(i);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, d.indices_.name());
    glBindVertexArray(0);
    for (Item& item : d.draws_) item.draw.vertex_array = d.arrays_.name();
    d.objects_ = gl::create_dynamic_buffer(d.draws_.size() * d.stride_);
    d.staging_.resize(d.draws_.size() * d.stride_);
    d.world_.resize(d.model_.nodes.size());
    d.move_to(0);
    d.placed_ = false;
    return d;
}

void ModelDraws::write(std::size_t i) noexcept {
    Item& item = draws_[i];
    const Mat4& world = world_[item.node];
    const Part& part = model_.parts[item.part];
    const ModelMaterial& m = model_.materials[part.material];
    ObjectBlock block{};
    std::transform(world.begin(), world.end(), block.world_from_object.begin(), [](double x) { return static_cast<float>(x); });
    block.normal_columns = normal_columns(world);
    block.base_color = m.base_color;
    block.surface = {m.metallic, m.roughness, m.alpha_cutoff, 0};
    block.emissive = {m.emissive[0], m.emissive[1], m.emissive[2], 0};
    std::memcpy(staging_.data() + i * stride_, &block, sizeof block);
    item.world = transformed(world, part.bounds);
    if (!m.double_sided) item.draw.cull_back = !mirrors(world);   // a mirrored object turns its triangles round
}

void ModelDraws::move_to(double time_s) noexcept {
    const bool first = !placed_;
    if (!first && motion_.empty()) return;
    place_nodes(model_, time_s, world_);
    for (std::size_t i = 0; i < draws_.size(); ++i) {
        if (!first && draws_[i].motion < 0) continue;
        write(i);
        if (draws_[i].motion < 0) continue;
        ObjectMotion& m = motion_[static_cast<std::size_t>(draws_[i].motion)];
        m.previous_world_from_object = first ? world_[draws_[i].node] : m.world_from_object;
        m.world_from_object = world_[draws_[i].node];
    }
    gl::update_buffer(objects_, 0, staging_);
    placed_ = true;
}

}  // namespace fovea::scene
