// The draws of a Model: its geometry, textures and programs on the GPU, its objects placed for a time.
//
// A program variant is built only where a material asks for it; a texture only where one is used; an object's data is
// written again only if a track moves something.
// Cost: create() uploads everything; move_to() is a loop over the nodes and one buffer update, nothing in a still model.
// Threads: the context's. move_to() is noexcept and does not allocate.
// Errors: create() names the shader that does not compile, or the picture that is too large for the driver.
#pragma once

#include <span>

#include "protocol/error.hpp"
#include "render/gl/command_list.hpp"
#include "render/scene/model.hpp"
#include "render/scene/shaders.hpp"

namespace fovea::scene {

// An object that moves on its own: where it is in the frame last recorded, and where it was in the one before.
struct ObjectMotion {
    Mat4 world_from_object{}, previous_world_from_object{};
    Aabb bounds;   // in its own space
};

class ModelDraws {
public:
    // Keeps nodes, tracks and parts of the model; its vertices and pictures go to the GPU.
    [[nodiscard]] static Result<ModelDraws> create(Model model, bool count_fragments, int extra_lights);
    // As Scene::draw_at_once().
    [[nodiscard]] Result<void> draw_at_once(const gl::ViewsAtOnce& how);
    // Places the objects. The first call after create(): nothing has moved.
    void move_to(double time_s) noexcept;

    [[nodiscard]] std::size_t size() const noexcept { return draws_.size(); }
    [[nodiscard]] const Aabb& bounds(std::size_t i) const noexcept { return draws_[i].world; }
    [[nodiscard]] const gl::Draw& draw(std::size_t i) const noexcept { return draws_[i].draw; }
    [[nodiscard]] const gl::Buffer& objects() const noexcept { return objects_; }
    [[nodiscard]] std::span<const ObjectMotion> motion() const noexcept { return motion_; }
    [[nodiscard]] const Model& model() const noexcept { return model_; }

private:
    struct Item {
        gl::Draw draw;
        std::uint32_t node = 0, part = 0;
        Aabb world;
        int motion = -1;   // in motion_
    };
    struct Variant {
        ShaderOptions options;
        gl::Program program;
    };
    [[nodiscard]] Result<gl::Name> program(const ShaderOptions& options);
    [[nodiscard]] Result<gl::Name> texture(int image, bool srgb, bool repeat);
    [[nodiscard]] ShaderOptions options_of(const Part& part) const noexcept;
    [[nodiscard]] Result<void> add_items();
    void write(std::size_t i) noexcept;

    Model model_;
    bool count_fragments_ = false;
    int extra_lights_ = 0;
    std::vector<Variant> programs_;
    struct Upload {
        int image = -1;
        bool srgb = false, repeat = false;
        gl::Texture texture;
    };
    std::vector<Upload> textures_;
    gl::VertexArray arrays_;
    gl::Buffer vertices_, indices_, objects_;
    std::vector<Item> draws_;
    std::vector<Mat4> world_;
    std::vector<ObjectMotion> motion_;
    std::vector<std::byte> staging_;
    std::uint32_t stride_ = 0;
    bool placed_ = false;
};

}  // namespace fovea::scene
