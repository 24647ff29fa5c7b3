#include "render/layer/extrapolate.hpp"

#include <cstdio>

#include "render/layer/context.hpp"

namespace fovea::layer {

void GL_APIENTRY layer_glExtrapolateTex2DQCOM(GLuint src1, GLuint src2, GLuint output, GLfloat scale) {
    Context* c = t_context;
    if (!c || !c->active()) return;
    if (c->native().frame_extrapolation) return gl.ExtrapolateTex2DQCOM(src1, src2, output, scale);
    if (scale == 0.0f) return c->raise(GL_INVALID_VALUE);
    if (c->is_engaged()) c->before_finish(Call::ExtrapolateTex2DQCOM);
    c->keep_driver_error();
    auto& engine = c->extrapolator();
    if (!engine) {
        auto made = render::extrapolation::GlExtrapolator::create(&driver_function);
        if (!made) {
            std::fprintf(stderr, "fovea layer: %s\n", made.error().message().c_str());
            return c->raise(GL_OUT_OF_MEMORY);
        }
        engine = std::make_unique<render::extrapolation::GlExtrapolator>(std::move(*made));
    }
    const GLenum error = engine->extrapolate(src1, src2, output, scale);
    drop_errors();
    if (error != GL_NO_ERROR) return c->raise(error);
    count(stats.extrapolations);
    c->image_written(output);
}

}  // namespace fovea::layer
