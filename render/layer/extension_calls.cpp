// The entry points, tokens and strings of the three extensions, with every error of their "Errors" sections.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <mutex>
#include <set>
#include <string>

#include "render/layer/context.hpp"
#include "render/layer/multiview_source.hpp"
#include "render/layer/trace.hpp"

namespace fovea::layer {
namespace {

struct Added {
    std::array<const char*, 6> names{};
    GLuint count = 0;
};

Added added_extensions(const Context& c) {
    Added added;
    if (c.extrapolates()) added.names[added.count++] = "GL_QCOM_frame_extrapolation";
    if (!c.active()) return added;
    if (!c.native().framebuffer_foveated) added.names[added.count++] = "GL_QCOM_framebuffer_foveated";
    if (!c.native().texture_foveated) added.names[added.count++] = "GL_QCOM_texture_foveated";
    if (!c.native().multiview)
        for (const char* name : {"GL_OVR_multiview", "GL_OVR_multiview2", "GL_OVR_multiview_multisampled_render_to_texture"}) added.names[added.count++] = name;
    return added;
}

double real(GLfloat v) { return static_cast<double>(v); }

Context* current() {
    Context* c = t_context;
    return c && c->active() ? c : nullptr;
}

// That of which extensions are added, maybe this one alone.
Context* listed() {
    Context* c = t_context;
    return c && (c->active() || c->extrapolates()) ? c : nullptr;
}

// Strings handed out live as long as the process: programs keep the pointers.
const GLubyte* keep(const std::string& text) {
    static std::mutex mutex;
    static std::set<std::string> kept;
    const std::lock_guard lock(mutex);
    return reinterpret_cast<const GLubyte*>(kept.insert(text).first->c_str());
}

bool is_foveation_parameter(GLenum name) {
    return name == GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM || name == GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM ||
           name == GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM || name == GL_TEXTURE_FOVEATED_NUM_FOCAL_POINTS_QUERY_QCOM;
}

// Targets whose images the layer can draw at several levels.
bool supports_target(GLenum target) {
    return target == GL_TEXTURE_2D || target == GL_TEXTURE_2D_ARRAY || target == GL_TEXTURE_2D_MULTISAMPLE ||
           target == GL_TEXTURE_2D_MULTISAMPLE_ARRAY;
}

// The layer's context if it answers for this parameter of this target; else the driver does.
Context* answers(GLenum target, GLenum name) {
    Context* c = current();
    if (!c || !is_foveation_parameter(name) || c->native().texture_foveated) return nullptr;
    return texture_binding_query(target) != 0 && target != GL_TEXTURE_BUFFER ? c : nullptr;
}

GLuint bound_texture(GLenum target) { return static_cast<GLuint>(get_integer(texture_binding_query(target))); }

void set_parameter(Context& c, GLenum target, GLenum name, double value) {
    const GLuint texture = bound_texture(target);
    trace_call("glTexParameter", {static_cast<double>(target), static_cast<double>(name), value});
    if (name == GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM) {
        if (!(value >= 0.0 && value <= 1.0)) return c.raise(GL_INVALID_OPERATION);
        return c.textures().set_min_density(texture, static_cast<float>(value));
    }
    if (name != GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM) return c.raise(GL_INVALID_ENUM);  // queries cannot be set
    constexpr GLuint kEnable = GL_FOVEATION_ENABLE_BIT_QCOM;
    if (value != 0 && value != kEnable && value != kFeatures) return c.raise(GL_INVALID_ENUM);
    const auto features = static_cast<GLuint>(value);
    if (!(features & kEnable) && c.textures().is_foveated(texture)) return c.raise(GL_INVALID_OPERATION);
    if ((features & kEnable) && !supports_target(target)) return c.raise(GL_INVALID_OPERATION);
    c.before_submit(Call::TexParameteri);
    if (texture != 0) c.textures().set_features(texture, features);
}

double get_parameter(Context& c, GLenum target, GLenum name) {
    const TextureFoveation state = c.textures().get(bound_texture(target));
    switch (name) {
        case GL_TEXTURE_FOVEATED_FEATURE_BITS_QCOM: return state.features;
        case GL_TEXTURE_FOVEATED_MIN_PIXEL_DENSITY_QCOM: return static_cast<double>(state.min_density);
        case GL_TEXTURE_FOVEATED_FEATURE_QUERY_QCOM: return supports_target(target) ? kFeatures : 0;
        default: return kFocalPoints;
    }
}

template <class Parameters, class DriverCall>
void tex_parameter(GLenum target, GLenum name, Parameters value, Call call, DriverCall driver) {
    if (Context* c = answers(target, name)) return set_parameter(*c, target, name, static_cast<double>(value()));
    if (Context* c = recording()) c->before_submit(call);
    driver();
}

template <class Value>
bool get_tex_parameter(GLenum target, GLenum name, Value* values) {
    Context* c = answers(target, name);
    if (!c || !values) return false;
    const double value = get_parameter(*c, target, name);
    if constexpr (std::is_floating_point_v<Value>)
        *values = static_cast<Value>(value);
    else
        *values = static_cast<Value>(std::llround(value));  // 0.5 becomes 1, as GL rounds floats to integers
    return true;
}

}  // namespace

const GLubyte* GL_APIENTRY layer_glGetString(GLenum name) {
    const GLubyte* text = gl.GetString(name);
    const Context* c = listed();
    if (!c || name != GL_EXTENSIONS || !text) return text;
    std::string all = reinterpret_cast<const char*>(text);
    const Added added = added_extensions(*c);
    for (GLuint i = 0; i < added.count; ++i) {
        if (!all.empty() && all.back() != ' ') all += ' ';
        all += added.names[i];
    }
    return keep(all);
}

const GLubyte* GL_APIENTRY layer_glGetStringi(GLenum name, GLuint index) {
    const Context* c = listed();
    if (c && name == GL_EXTENSIONS) {
        const auto own = static_cast<GLuint>(get_integer(GL_NUM_EXTENSIONS));
        const Added added = added_extensions(*c);
        if (index >= own && index - own < added.count) return reinterpret_cast<const GLubyte*>(added.names[index - own]);
    }
    return gl.GetStringi(name, index);
}

template <class Value, class DriverCall>
static void get(GLenum name, Value* values, DriverCall driver) {
    const Context* c = listed();
    if (c && c->active() && name == GL_MAX_VIEWS_OVR && !c->native().multiview && values) {
        *values = static_cast<Value>(std::is_same_v<Value, GLboolean> ? GL_TRUE : kMaxViews);
        return;
    }
    driver(name, values);
    if (!c || name != GL_NUM_EXTENSIONS || !values) return;
    if constexpr (!std::is_same_v<Value, GLboolean>) *values += static_cast<Value>(added_extensions(*c).count);
}

void GL_APIENTRY layer_glGetIntegerv(GLenum name, GLint* data) { get(name, data, gl.GetIntegerv); }
void GL_APIENTRY layer_glGetInteger64v(GLenum name, GLint64* data) { get(name, data, gl.GetInteger64v); }
void GL_APIENTRY layer_glGetFloatv(GLenum name, GLfloat* data) { get(name, data, gl.GetFloatv); }
void GL_APIENTRY layer_glGetBooleanv(GLenum name, GLboolean* data) { get(name, data, gl.GetBooleanv); }

void GL_APIENTRY layer_glTexParameteri(GLenum target, GLenum name, GLint value) {
    tex_parameter(target, name, [=] { return value; }, Call::TexParameteri, [=] { gl.TexParameteri(target, name, value); });
}
void GL_APIENTRY layer_glTexParameterf(GLenum target, GLenum name, GLfloat value) {
    tex_parameter(target, name, [=] { return value; }, Call::TexParameterf, [=] { gl.TexParameterf(target, name, value); });
}
void GL_APIENTRY layer_glTexParameteriv(GLenum target, GLenum name, const GLint* values) {
    tex_parameter(target, name, [=] { return *values; }, Call::TexParameteriv, [=] { gl.TexParameteriv(target, name, values); });
}
void GL_APIENTRY layer_glTexParameterfv(GLenum target, GLenum name, const GLfloat* values) {
    tex_parameter(target, name, [=] { return *values; }, Call::TexParameterfv, [=] { gl.TexParameterfv(target, name, values); });
}
void GL_APIENTRY layer_glTexParameterIiv(GLenum target, GLenum name, const GLint* values) {
    tex_parameter(target, name, [=] { return *values; }, Call::TexParameterIiv, [=] { gl.TexParameterIiv(target, name, values); });
}
void GL_APIENTRY layer_glTexParameterIuiv(GLenum target, GLenum name, const GLuint* values) {
    tex_parameter(target, name, [=] { return *values; }, Call::TexParameterIuiv, [=] { gl.TexParameterIuiv(target, name, values); });
}

void GL_APIENTRY layer_glGetTexParameteriv(GLenum target, GLenum name, GLint* values) {
    if (!get_tex_parameter(target, name, values)) gl.GetTexParameteriv(target, name, values);
}
void GL_APIENTRY layer_glGetTexParameterfv(GLenum target, GLenum name, GLfloat* values) {
    if (!get_tex_parameter(target, name, values)) gl.GetTexParameterfv(target, name, values);
}
void GL_APIENTRY layer_glGetTexParameterIiv(GLenum target, GLenum name, GLint* values) {
    if (!get_tex_parameter(target, name, values)) gl.GetTexParameterIiv(target, name, values);
}
void GL_APIENTRY layer_glGetTexParameterIuiv(GLenum target, GLenum name, GLuint* values) {
    if (!get_tex_parameter(target, name, values)) gl.GetTexParameterIuiv(target, name, values);
}

void GL_APIENTRY layer_glFramebufferFoveationConfigQCOM(GLuint framebuffer, GLuint layers, GLuint points_per_layer,
                                                        GLuint requested, GLuint* provided) {
    Context* c = current();
    if (!c) return;
    if (c->native().framebuffer_foveated)
        return gl.FramebufferFoveationConfigQCOM(framebuffer, layers, points_per_layer, requested, provided);
    trace_call("glFramebufferFoveationConfigQCOM", {static_cast<double>(framebuffer), static_cast<double>(layers), static_cast<double>(points_per_layer), static_cast<double>(requested)});
    if (framebuffer == 0 || !gl.IsFramebuffer(framebuffer)) return c->raise(GL_INVALID_VALUE);
    if (layers > static_cast<GLuint>(get_integer(GL_MAX_ARRAY_TEXTURE_LAYERS)) - 1) return c->raise(GL_INVALID_VALUE);
    if (points_per_layer > kFocalPoints) return c->raise(GL_INVALID_VALUE);
    if (const Framebuffer* f = c->find_framebuffer(framebuffer); f && f->config) return c->raise(GL_INVALID_OPERATION);
    if (requested == 0) {  // a question, which configures nothing
        if (provided) *provided = GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM;
        return;
    }
    if (framebuffer == c->draw_framebuffer()) c->before_finish(Call::FramebufferFoveationConfigQCOM);
    const auto reserved = requested & GL_FOVEATION_ENABLE_BIT_QCOM ? c->reserve(framebuffer) : Context::Reserved::never;
    if (reserved == Context::Reserved::no_memory) return c->raise(GL_OUT_OF_MEMORY);
    FramebufferFoveation config;
    config.layers = layers;
    config.points_per_layer = points_per_layer;
    config.features = (reserved == Context::Reserved::yes ? GL_FOVEATION_ENABLE_BIT_QCOM : 0) | GL_FOVEATION_SCALED_BIN_METHOD_BIT_QCOM;
    const GLuint read = c->read_framebuffer();
    if (read != framebuffer) gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    config.attachments = c->program_attachments(GL_READ_FRAMEBUFFER, framebuffer);
    if (read != framebuffer) gl.BindFramebuffer(GL_READ_FRAMEBUFFER, read);
    if (provided) *provided = config.features;
    c->framebuffer(framebuffer).config = std::move(config);
    c->attachments_may_have_changed();
}

void GL_APIENTRY layer_glFramebufferFoveationParametersQCOM(GLuint framebuffer, GLuint layer, GLuint point, GLfloat x,
                                                            GLfloat y, GLfloat gain_x, GLfloat gain_y, GLfloat area) {
    Context* c = current();
    if (!c) return;
    if (c->native().framebuffer_foveated)
        return gl.FramebufferFoveationParametersQCOM(framebuffer, layer, point, x, y, gain_x, gain_y, area);
    trace_call("glFramebufferFoveationParametersQCOM", {static_cast<double>(framebuffer), static_cast<double>(layer), static_cast<double>(point), real(x), real(y), real(gain_x), real(gain_y), real(area)});
    if (framebuffer == 0 || !gl.IsFramebuffer(framebuffer)) return c->raise(GL_INVALID_VALUE);
    Framebuffer* f = c->find_framebuffer(framebuffer);
    if (!f || !f->config) return c->raise(GL_INVALID_OPERATION);
    if (layer >= f->config->layers || point >= f->config->points_per_layer) return c->raise(GL_INVALID_VALUE);
    f->config->points[layer].points[point] = {x, y, gain_x, gain_y, area};
}

void GL_APIENTRY layer_glTextureFoveationParametersQCOM(GLuint texture, GLuint layer, GLuint point, GLfloat x, GLfloat y,
                                                        GLfloat gain_x, GLfloat gain_y, GLfloat area) {
    Context* c = current();
    if (!c) return;
    if (c->native().texture_foveated)
        return gl.TextureFoveationParametersQCOM(texture, layer, point, x, y, gain_x, gain_y, area);
    trace_call("glTextureFoveationParametersQCOM", {static_cast<double>(texture), static_cast<double>(layer), static_cast<double>(point), real(x), real(y), real(gain_x), real(gain_y), real(area)});
    if (texture == 0 || !gl.IsTexture(texture)) return c->raise(GL_INVALID_VALUE);
    if (!c->textures().is_foveated(texture)) return c->raise(GL_INVALID_OPERATION);
    if (point >= kFocalPoints) return c->raise(GL_INVALID_VALUE);
    // A layer that no texture can have is no error by the specification; there is nothing to keep for it.
    if (layer >= static_cast<GLuint>(get_integer(GL_MAX_ARRAY_TEXTURE_LAYERS))) return;
    c->textures().set_point(texture, layer, point, {x, y, gain_x, gain_y, area});
}

}  // namespace fovea::layer
