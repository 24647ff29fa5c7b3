#include "render/layer/foveation_state.hpp"

#include <algorithm>

#include "render/layer/entry_points.hpp"

namespace fovea::layer {

TextureFoveation TextureFoveations::get(GLuint texture) const {
    const std::lock_guard lock(mutex_);
    const auto it = textures_.find(texture);
    return it == textures_.end() ? TextureFoveation{} : it->second;
}

bool TextureFoveations::is_foveated(GLuint texture) const {
    const std::lock_guard lock(mutex_);
    const auto it = textures_.find(texture);
    return it != textures_.end() && (it->second.features & GL_FOVEATION_ENABLE_BIT_QCOM);
}

void TextureFoveations::set_features(GLuint texture, GLuint features) {
    const std::lock_guard lock(mutex_);
    textures_[texture].features = features;
    engage();
    epoch_.fetch_add(1, std::memory_order_release);
}

void TextureFoveations::set_min_density(GLuint texture, float density) {
    const std::lock_guard lock(mutex_);
    textures_[texture].min_density = density;
}

void TextureFoveations::set_point(GLuint texture, GLuint layer, GLuint index, const FocalPoint& point) {
    const std::lock_guard lock(mutex_);
    LayerPoints& l = textures_[texture].layers[layer];
    l.points[index] = point;
    l.set |= 1u << index;
}

void TextureFoveations::forget(GLuint texture) {
    const std::lock_guard lock(mutex_);
    if (textures_.erase(texture) != 0) epoch_.fetch_add(1, std::memory_order_release);
}

Latched TextureFoveations::latch(GLuint texture, GLuint layer) const {
    const std::lock_guard lock(mutex_);
    const auto it = textures_.find(texture);
    Latched latched;
    if (it == textures_.end()) return latched;
    latched.min_density = it->second.min_density;
    if (const auto l = it->second.layers.find(layer); l != it->second.layers.end()) {
        // The equation takes the maximum over all points that the implementation supports, and a point with its
        // defaults asks for full density everywhere: literally, one point set of eight would change nothing. The
        // specification's examples set one and expect foveation, so a point never set takes no part beside one that is.
        latched.count = 0;
        for (GLuint i = 0; i < kFocalPoints; ++i)
            if (l->second.set & 1u << i) latched.points[latched.count++] = l->second.points[i];
    }
    return latched;
}

Latched FramebufferFoveation::latch(GLuint layer) const {
    Latched latched{.points = {}, .count = points_per_layer, .min_density = 0};
    if (const auto l = points.find(layer); l != points.end()) latched.points = l->second.points;
    return latched;
}

void FramebufferFoveation::compare(const std::vector<Attachment>& now) {
    for (const Attachment& was : attachments)
        if (std::none_of(now.begin(), now.end(), [&was](const Attachment& is) { return is.same_image(was); }))
            attachments_changed = true;
    attachments = now;
}

}  // namespace fovea::layer
