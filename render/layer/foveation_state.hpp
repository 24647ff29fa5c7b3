// What a program has asked of foveation: the state that the two extensions add to textures and framebuffer objects.
//
// Source: GL_QCOM_texture_foveated (state per texture, shared between contexts), GL_QCOM_framebuffer_foveated (state
// per framebuffer object, which contexts do not share). docs/conformance.md holds every clause beside its test.
// Threads: TextureFoveations locks itself; FramebufferFoveation belongs to one context.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "layer_gl.hpp"
#include "render/density/density.hpp"

namespace fovea::layer {

using density::FocalPoint;

inline constexpr GLuint kFocalPoints = 8;  // per layer; what the layer supports
inline constexpr GLuint kFeatures = GL_FOVEATION_ENABLE_BIT_QCOM | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM;

// The focal points of one layer and the least density; what a submission latches.
struct Latched {
    std::array<FocalPoint, kFocalPoints> points{};
    GLuint count = 0;  // 0: full density everywhere
    float min_density = 0;
    bool operator==(const Latched&) const = default;
};

struct LayerPoints {
    std::array<FocalPoint, kFocalPoints> points{};
    std::uint32_t set = 0;  // bit i: point i has been given by the program
};

struct TextureFoveation {
    GLuint features = 0;
    float min_density = 0;
    std::map<GLuint, LayerPoints> layers;  // a layer without entry has the defaults
};

// The textures of one share group. A texture without entry has the defaults.
class TextureFoveations {
public:
    [[nodiscard]] TextureFoveation get(GLuint texture) const;
    [[nodiscard]] bool is_foveated(GLuint texture) const;
    void set_features(GLuint texture, GLuint features);
    void set_min_density(GLuint texture, float density);
    void set_point(GLuint texture, GLuint layer, GLuint index, const FocalPoint& point);
    void forget(GLuint texture);
    [[nodiscard]] Latched latch(GLuint texture, GLuint layer) const;

    // Changes whenever a texture starts or stops to be foveated; 0: no texture has ever been.
    [[nodiscard]] std::uint32_t epoch() const noexcept { return epoch_.load(std::memory_order_acquire); }

private:
    mutable std::mutex mutex_;
    std::map<GLuint, TextureFoveation> textures_;
    std::atomic<std::uint32_t> epoch_{0};
};

// One image attached to a framebuffer object.
struct Attachment {
    GLenum point = 0;        // GL_COLOR_ATTACHMENTi, GL_DEPTH_ATTACHMENT or GL_STENCIL_ATTACHMENT
    GLint type = GL_NONE;    // GL_TEXTURE, GL_RENDERBUFFER
    GLuint name = 0;
    GLint level = 0, face = 0, layer = 0;
    GLint layered = 0;
    GLenum target = 0;  // of a texture: GL_TEXTURE_2D ...; found by find_target (targets.hpp), 0 before
    int width = 0, height = 0;  // the same
    [[nodiscard]] bool same_image(const Attachment& o) const noexcept {
        return point == o.point && type == o.type && name == o.name && level == o.level && face == o.face &&
               layer == o.layer && layered == o.layered;
    }
};

struct FramebufferFoveation {
    GLuint layers = 0, points_per_layer = 0, features = 0;
    std::map<GLuint, LayerPoints> points;  // by layer; without entry: the defaults
    std::vector<Attachment> attachments;  // when it was configured, and those attached to empty points since
    bool attachments_changed = false;     // stays, as the framebuffer stays foveated

    [[nodiscard]] bool enabled() const noexcept { return (features & GL_FOVEATION_ENABLE_BIT_QCOM) != 0; }
    [[nodiscard]] Latched latch(GLuint layer) const;
    // Compares with what is attached now; an image attached where none was is no change.
    void compare(const std::vector<Attachment>& now);
};

}  // namespace fovea::layer
