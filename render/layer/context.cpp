#include "render/layer/context.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace fovea::layer {

constinit thread_local Context* t_context __attribute__((tls_model("initial-exec"))) = nullptr;
constinit thread_local Context* t_recording __attribute__((tls_model("initial-exec"))) = nullptr;

void Context::made_current(EGLDisplay display, EGLSurface surface) {
    if (version_ == 0) {
        const auto* text = reinterpret_cast<const char*>(gl.GetString(GL_VERSION));
        version_ = -1;
        if (text && std::strncmp(text, "OpenGL ES ", 10) == 0)
            version_ = get_integer(GL_MAJOR_VERSION) * 10 + get_integer(GL_MINOR_VERSION);
        active_ = version_ >= 31;
        extrapolates_ = version_ >= 30;
        if (extrapolates_) {
            for (GLint i = 0; i < get_integer(GL_NUM_EXTENSIONS); ++i) {
                const auto* name = reinterpret_cast<const char*>(gl.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
                if (!name) continue;
                const std::string_view extension = name;
                native_.multiview |= extension == "GL_OVR_multiview2";
                native_.framebuffer_foveated |= extension == "GL_QCOM_framebuffer_foveated";
                native_.texture_foveated |= extension == "GL_QCOM_texture_foveated";
                native_.frame_extrapolation |= extension == "GL_QCOM_frame_extrapolation";
                buffer_storage_ |= extension == "GL_EXT_buffer_storage";
                float_viewport_ |= extension == "GL_OES_viewport_array" && gl.ViewportIndexedfOES;
            }
            extrapolates_ = !native_.frame_extrapolation;
        }
        if (active_) {
            const auto* renderer = reinterpret_cast<const char*>(gl.GetString(GL_RENDERER));
            for (const char* name : {"llvmpipe", "softpipe", "SWR", "SwiftShader", "swrast"})
                if (renderer && std::strstr(renderer, name)) pay_.set_processor_draws(true);
            const char* reading = std::getenv("FOVEA_LAYER_READING");
            if (reading && std::strcmp(reading, "linear") == 0) reading_ = density::Reading::linear;
            if (const char* mib = std::getenv("FOVEA_LAYER_MEMORY_MIB"); mib && *mib) memory_limit_ = std::strtoull(mib, nullptr, 10) << 20;
            count(stats.contexts);
        }
        drop_errors();
    }
    if (active_ || extrapolates_) share_->dead.bury();
    if (!active_) return;
    draw_framebuffer_ = static_cast<GLuint>(get_integer(GL_DRAW_FRAMEBUFFER_BINDING));
    read_framebuffer_ = static_cast<GLuint>(get_integer(GL_READ_FRAMEBUFFER_BINDING));
    target_known_ = false;
    display_ = display;
    surface_ = surface;
    default_frame_ = 0;
    default_known_ = false;
    window_frame_ = 0;
    auto_ = auto_settings().on;
    if (auto_) engage();
    if (auto_settings().compare && !comparison_) comparison_ = new_comparison();
    if (auto_) choose_way();
    if (Framebuffer* f = find_framebuffer(0)) f->pass.mode = Pass::Mode::none;  // of another surface, maybe
}

GLenum Context::driver_error() {
    const GLenum error = gl.GetError();
    if (error == GL_CONTEXT_LOST) lost_ = true;
    return error;
}

void Context::raise(GLenum error) {
    if (error_ != GL_NO_ERROR) return;
    const GLenum earlier = driver_error();
    error_ = earlier != GL_NO_ERROR ? earlier : error;
}

void Context::keep_driver_error() {
    const GLenum error = driver_error();
    if (error_ == GL_NO_ERROR) error_ = error;
}

GLenum Context::take_error() {
    const GLenum driver = driver_error(), error = error_ != GL_NO_ERROR ? error_ : driver;
    error_ = GL_NO_ERROR;
    if (lost_) lose();
    return error;
}

void Context::before_finish(Call call) {
    submit(call);
    if (!active_) return;  // lost
    // The default framebuffer can be read by no draw: its resolve waits until it is shown or read.
    const bool waits = draw_framebuffer_ == 0 && call == Call::BindFramebuffer;
    if (Framebuffer* f = find_framebuffer(draw_framebuffer_); f && !waits) {
        f->each_pass([this](Pass& p) { resolve(p); });
        resolve_samples(*f);
    }
    if (auto_ && draw_framebuffer_ != 0 && call != Call::BindFramebuffer)
        if (Framebuffer* f = find_framebuffer(0)) resolve(f->pass);
    if (!deletions_.empty()) {
        const auto used = static_cast<GLuint>(get_integer(GL_CURRENT_PROGRAM));
        std::erase_if(deletions_, [used](GLuint p) { return p != used && (gl.DeleteProgram(p), true); });
    }
}

void Context::before_upload(Call call, GLenum target) {
    before_submit(call);
    GLint name = 0;
    if (target == GL_RENDERBUFFER) {
        name = get_integer(GL_RENDERBUFFER_BINDING);
    } else {
        if (target >= GL_TEXTURE_CUBE_MAP_POSITIVE_X && target <= GL_TEXTURE_CUBE_MAP_NEGATIVE_Z) target = GL_TEXTURE_CUBE_MAP;
        if (const GLenum query = texture_binding_query(target)) name = get_integer(query);
    }
    if (name == 0) return;
    if (std::any_of(attachments_.begin(), attachments_.end(), [name](const Attachment& a) { return a.name == static_cast<GLuint>(name); }))
        submit(call);  // a pending clear too
    image_written(static_cast<GLuint>(name));
}

void Context::before_indexed(Call call) {
    submit(call);
    per_draw_buffer_ = true;
    undo_.per_draw_buffer();
}

static bool has_pass(Framebuffer& f, const Pass* wanted) {
    bool found = false;
    f.each_pass([&](const Pass& p) { found |= &p == wanted; });
    return found;
}

void Context::image_written(GLuint name, const MipLevels& levels, GLuint by_framebuffer) {
    ++attachments_epoch_;
    samples_overwritten(name, by_framebuffer, levels);
    Framebuffer* by = by_framebuffer != 0 ? find_framebuffer(by_framebuffer) : nullptr;
    for (Kept& kept : kept_) {
        if (!kept.owner || (by && has_pass(*by, kept.owner))) continue;
        for (const Attachment& a : kept.owner->attachments)
            if (a.name == name && levels.has(a.level)) {
                resolve(*kept.owner);
                kept.owner->mode = Pass::Mode::none;
            }
    }
}

void Context::mipmaps_written(GLenum target) {
    const GLenum query = texture_binding_query(target);
    const GLint name = active_ && query != 0 ? get_integer(query) : 0;
    if (name == 0) return;
    GLint base = 0;
    keep_driver_error();
    gl.GetTexParameteriv(target, GL_TEXTURE_BASE_LEVEL, &base);
    drop_errors();
    image_written(static_cast<GLuint>(name), {.first = base + 1});  // what it is made of stays as it is
}

void Context::storing_images(GLuint by_framebuffer) {
    if (!active_ || (kept_.empty() && framebuffers_.empty())) return;
    keep_driver_error();
    for (GLuint unit = 0; unit < static_cast<GLuint>(get_integer(GL_MAX_IMAGE_UNITS)); ++unit) {
        GLint name = 0, access = 0, level = 0;
        gl.GetIntegeri_v(GL_IMAGE_BINDING_NAME, unit, &name);
        if (name == 0) continue;
        gl.GetIntegeri_v(GL_IMAGE_BINDING_ACCESS, unit, &access);
        gl.GetIntegeri_v(GL_IMAGE_BINDING_LEVEL, unit, &level);
        if (access != GL_READ_ONLY) image_written(static_cast<GLuint>(name), {.first = level, .last = level}, by_framebuffer);
    }
    drop_errors();
}

bool Context::keeps_images_beside(GLuint framebuffer) {
    Framebuffer* own = framebuffer != 0 ? find_framebuffer(framebuffer) : nullptr;
    for (const Kept& kept : kept_)
        if (kept.owner && kept.owner->mode == Pass::Mode::levels && kept.owner->frame == frame_ && !kept.owner->attachments.empty() &&
            !(own && has_pass(*own, kept.owner))) return true;
    return made_samples_ && std::any_of(framebuffers_.begin(), framebuffers_.end(), [own](const auto& f) { return &f.second != own && f.second.has_samples(); });
}

// What the framebuffer bound for drawing keeps itself needs nothing: such draws leave its levels.
void Context::before_stores() {
    if (active_ && keeps_images_beside(draw_framebuffer_) && program_facts().side_effects) storing_images(draw_framebuffer_);
}

void Context::invalidate_pass() {
    if (Framebuffer* f = find_framebuffer(draw_framebuffer_)) f->each_pass([](Pass& p) { p.mode = Pass::Mode::none; });
}

const DrawTarget& Context::drawing_target() {
    static const DrawTarget plain;
    if (!active_ || !is_engaged() || (draw_framebuffer_ == 0 && !(auto_ && surface_ != EGL_NO_SURFACE))) return plain;
    if (draw_framebuffer_ == 0 && way_ == Way::straight) {
        if (!straight_frame_) enter_straight_frame();
        return plain;
    }
    const std::uint32_t epoch = share_->textures.epoch();
    if (target_known_ && target_textures_epoch_ == epoch && target_attachments_epoch_ == attachments_epoch_) return target_;
    target_ = {};
    target_known_ = true;
    target_textures_epoch_ = epoch;
    target_attachments_epoch_ = attachments_epoch_;
    const Framebuffer* f = find_framebuffer(draw_framebuffer_);
    const bool configured = f && f->config;
    target_.views = views_of(draw_framebuffer_);
    if (foveation_status(GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE || view_status(GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
        target_.kind = DrawTarget::Kind::incomplete;
    } else if (configured) {
        if (f->config->enabled()) target_.kind = DrawTarget::Kind::framebuffer;
    } else if (epoch != 0 && draw_framebuffer_ != 0) {
        for (const Attachment& a : program_attachments(GL_DRAW_FRAMEBUFFER))
            if (a.type == GL_TEXTURE && share_->textures.is_foveated(a.name)) {
                target_ = {DrawTarget::Kind::texture, a.name, static_cast<GLuint>(a.layer), target_.views};
                break;
            }
    }
    if (target_.kind == DrawTarget::Kind::plain && (target_.views > 1 || (f && f->has_samples()))) target_.kind = DrawTarget::Kind::views;
    if (auto_ && way_ != Way::straight && target_.kind == DrawTarget::Kind::plain && (draw_framebuffer_ == 0 || is_main_offscreen()))
        target_.kind = DrawTarget::Kind::automatic;
    return target_;
}

GLenum Context::foveation_status(GLenum framebuffer_target) {
    const GLuint name = framebuffer_target == GL_READ_FRAMEBUFFER ? read_framebuffer_ : draw_framebuffer_;
    if (name == 0 || share_->textures.epoch() == 0) return GL_FRAMEBUFFER_COMPLETE;
    const Framebuffer* f = find_framebuffer(name);
    const bool configured = f && f->config && f->config->enabled();
    int foveated_colors = 0;
    for (const Attachment& a : program_attachments(framebuffer_target)) {
        if (a.type != GL_TEXTURE || !share_->textures.is_foveated(a.name)) continue;
        if (a.point == GL_DEPTH_ATTACHMENT || a.point == GL_STENCIL_ATTACHMENT || configured || ++foveated_colors > 1)
            return GL_FRAMEBUFFER_INCOMPLETE_FOVEATION_QCOM;
    }
    return GL_FRAMEBUFFER_COMPLETE;
}

GLenum Context::write_error() {
    const DrawTarget& target = drawing_target();
    if (target.kind == DrawTarget::Kind::incomplete) return GL_INVALID_FRAMEBUFFER_OPERATION;
    if (target.kind == DrawTarget::Kind::framebuffer && find_framebuffer(draw_framebuffer_)->config->attachments_changed)
        return GL_INVALID_OPERATION;
    return GL_NO_ERROR;
}

GLenum Context::read_error() {
    return active_ && is_engaged() && (foveation_status(GL_READ_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE ||
                                       views_of(read_framebuffer_) > 1 || view_status(GL_READ_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
               ? GL_INVALID_FRAMEBUFFER_OPERATION
               : GL_NO_ERROR;
}

bool Context::allowed(Op op) {
    GLenum error = write_error();
    if (error == GL_NO_ERROR && op == Op::draw && target_.kind == DrawTarget::Kind::framebuffer &&
        program_facts().geometry_or_tessellation)
        error = GL_INVALID_OPERATION;
    if (error == GL_NO_ERROR && op == Op::draw) error = view_error();
    if (error != GL_NO_ERROR) raise(error);
    return error == GL_NO_ERROR;
}

void Context::open() {
    if (recording_) return;
    attachments_.clear();
    if (draw_framebuffer_ != 0) {
        attachments_ = read_attachments(GL_DRAW_FRAMEBUFFER);
        shape_ = read_shape(attachments_);
    } else {
        if (!default_known_) default_shape_ = read_default_formats();
        default_known_ = true;
        shape_ = default_shape_;  // with the size that was asked last
        if (get_integer(GL_DRAW_BUFFER0) != GL_BACK) shape_.usable = false;
    }
    batch_ = {};
    if (!shape_.usable) batch_.must_be_native = true, batch_.reason = FullRate::cannot_match;
    recording_ = true;
    t_recording = this;
    const Framebuffer* f = target_.kind == DrawTarget::Kind::automatic ? find_framebuffer(draw_framebuffer_) : nullptr;
    if (f && f->pass.only_cleared && f->pass.mode == Pass::Mode::native && f->pass.frame == frame_) {
        batch_.inherits_clear = batch_.color_cleared = batch_.depth_cleared = batch_.stencil_cleared = true;
        cleared_to_ = f->pass.cleared_to;
    }
}

// A window has one size for a frame, and only levels need to know it.
bool Context::size_is_known() {
    if (draw_framebuffer_ != 0 || default_frame_ == frame_) return shape_.usable;
    default_frame_ = frame_;
    default_shape_.usable = default_shape_.color[0] != 0 && read_default_size(display_, surface_, default_shape_);
    shape_.width = default_shape_.width;
    shape_.height = default_shape_.height;
    shape_.usable = shape_.usable && default_shape_.usable;
    return shape_.usable;
}

void Context::note_draw() {
    batch_.drew = true;
    count(stats.draws_recorded);
    before_stores();
    const ProgramFacts& facts = program_facts();
    if (facts.side_effects || facts.geometry_or_tessellation || occlusion_queries_ > 0)
        batch_.must_be_native = true, batch_.reason = FullRate::side_effects;
    if (shape_.has_depth && !batch_.depth_cleared && gl.IsEnabled(GL_DEPTH_TEST)) batch_.needs_depth = true;
    if (shape_.has_stencil && gl.IsEnabled(GL_STENCIL_TEST)) {
        batch_.uses_stencil = true;
        if (!StencilFace::of_driver(false).leaves_top_bit() || !StencilFace::of_driver(true).leaves_top_bit()) batch_.stencil_top_bit = true;
        if (!batch_.stencil_cleared) batch_.needs_depth = true;
    }
}

void Context::note_clear(GLbitfield buffers, GLint color, bool plain) {
    if (!plain) batch_.plain_clears = false;
    if (batch_.drew) batch_.clear_after_draw = true;
    // Of a glClearBuffer* the value is not looked at.
    if (buffers & GL_STENCIL_BUFFER_BIT && shape_.has_stencil && (!plain || get_integer(GL_STENCIL_CLEAR_VALUE) & static_cast<GLint>(kMaskBit))) batch_.stencil_top_bit = true;
    const auto colors = std::count_if(shape_.color.begin(), shape_.color.end(), [](GLenum format) { return format != 0; });
    if (color == 0 && colors == 1 && shape_.color[0] != 0) buffers |= GL_COLOR_BUFFER_BIT;
    if (gl.IsEnabled(GL_RASTERIZER_DISCARD)) return;
    if (gl.IsEnabled(GL_SCISSOR_TEST)) {
        (void)size_is_known();
        GLint s[4];
        gl.GetIntegerv(GL_SCISSOR_BOX, s);
        if (s[0] > 0 || s[1] > 0 || std::int64_t{s[0]} + s[2] < shape_.width || std::int64_t{s[1]} + s[3] < shape_.height) return;
    }
    if (buffers & GL_COLOR_BUFFER_BIT && !batch_.drew && !per_draw_buffer_) {
        GLboolean m[4] = {};
        gl.GetBooleanv(GL_COLOR_WRITEMASK, m);
        if (m[0] && m[1] && m[2] && m[3]) {
            batch_.color_cleared = true;
            gl.GetFloatv(GL_COLOR_CLEAR_VALUE, cleared_to_.color.data());
        }
    }
    if (buffers & GL_DEPTH_BUFFER_BIT) {
        GLboolean on = GL_FALSE;
        gl.GetBooleanv(GL_DEPTH_WRITEMASK, &on);
        if (on) batch_.depth_cleared = true, gl.GetFloatv(GL_DEPTH_CLEAR_VALUE, &cleared_to_.depth);
    }
    if (buffers & GL_STENCIL_BUFFER_BIT && (get_integer(GL_STENCIL_WRITEMASK) & 0xff) == 0xff) {
        batch_.stencil_cleared = true;
        cleared_to_.stencil = get_integer(GL_STENCIL_CLEAR_VALUE);
    }
}

ProgramFacts Context::ask_program(GLuint program, GLint version) {
    ProgramFacts facts;
    if (program == 0) return facts;
    GLint value = 0;
    gl.GetProgramiv(program, GL_ACTIVE_ATOMIC_COUNTER_BUFFERS, &value);
    facts.side_effects = value > 0;
    gl.GetProgramInterfaceiv(program, GL_SHADER_STORAGE_BLOCK, GL_ACTIVE_RESOURCES, &value);
    facts.side_effects |= value > 0;
    GLint inputs = 0;
    facts.attributes.emplace();
    gl.GetProgramInterfaceiv(program, GL_PROGRAM_INPUT, GL_ACTIVE_RESOURCES, &inputs);
    for (GLuint i = 0; i < static_cast<GLuint>(inputs); ++i) {
        constexpr GLenum kAsked[] = {GL_LOCATION, GL_ARRAY_SIZE, GL_TYPE};
        GLint found[3] = {-1, 1, 0};
        gl.GetProgramResourceiv(program, GL_PROGRAM_INPUT, i, 3, kAsked, 3, nullptr, found);
        if (found[0] < 0) continue;  // gl_VertexID
        const auto type = static_cast<GLenum>(found[2]);
        const bool matrix = (type >= GL_FLOAT_MAT2 && type <= GL_FLOAT_MAT4) || (type >= GL_FLOAT_MAT2x3 && type <= GL_FLOAT_MAT4x3);
        for (GLint k = 0; k < found[1] * (matrix ? 4 : 1); ++k)  // a matrix has at most four columns
            facts.attributes->push_back(static_cast<GLuint>(found[0] + k));
    }
    GLint uniforms = 0;
    gl.GetProgramiv(program, GL_ACTIVE_UNIFORMS, &uniforms);
    for (GLuint i = 0; i < static_cast<GLuint>(uniforms); ++i) {
        GLint type = 0;
        gl.GetActiveUniformsiv(program, 1, &i, GL_UNIFORM_TYPE, &type);
        if (type == GL_SAMPLER_2D) {
            GLchar name[128];
            gl.GetActiveUniform(program, i, sizeof name, nullptr, &value, reinterpret_cast<GLenum*>(&type), name);
            facts.samplers_2d.push_back(gl.GetUniformLocation(program, name));
        }
        facts.matrices |= (type >= GL_FLOAT_MAT2 && type <= GL_FLOAT_MAT4) || (type >= GL_FLOAT_MAT2x3 && type <= GL_FLOAT_MAT4x3);
        facts.side_effects |= type >= 0x904C && type <= 0x906C;  // GL_IMAGE_1D to GL_UNSIGNED_INT_IMAGE_2D_MULTISAMPLE_ARRAY
    }
    if (version >= 32) {
        // An error says that the program has no such stage.
        for (const GLenum name : {GL_GEOMETRY_LINKED_VERTICES_OUT_EXT, GL_TESS_CONTROL_OUTPUT_VERTICES, GL_TESS_GEN_MODE}) {
            drop_errors();
            gl.GetProgramiv(program, name, &value);
            if (gl.GetError() == GL_NO_ERROR) facts.geometry_or_tessellation = true;
        }
    }
    drop_errors();
    return facts;
}

const ProgramFacts& Context::program_facts() {
    const auto program = static_cast<GLuint>(get_integer(GL_CURRENT_PROGRAM));
    if (program != 0) {
        const auto known = facts_.find(program);
        if (known != facts_.end()) return known->second;
        keep_driver_error();
        ProgramFacts& facts = facts_[program] = ask_program(program, version_);
        add_source_facts(facts, program);
        return facts;
    }
    const auto pipeline = static_cast<GLuint>(get_integer(GL_PROGRAM_PIPELINE_BINDING));
    pipeline_facts_ = {};
    if (pipeline == 0) return pipeline_facts_;
    keep_driver_error();
    ProgramFacts& all = pipeline_facts_;
    for (const GLenum stage : {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER, GL_GEOMETRY_SHADER, GL_TESS_CONTROL_SHADER, GL_TESS_EVALUATION_SHADER}) {
        GLint stage_program = 0;
        gl.GetProgramPipelineiv(pipeline, stage, &stage_program);
        const ProgramFacts facts = ask_program(static_cast<GLuint>(stage_program), version_);
        all.side_effects |= facts.side_effects;
        all.geometry_or_tessellation |= facts.geometry_or_tessellation;
        if (stage_program == 0) continue;
        ProgramFacts own;
        add_source_facts(own, static_cast<GLuint>(stage_program));
        all.num_views = std::max(all.num_views, own.num_views);
        all.view_uniforms.insert(all.view_uniforms.end(), own.view_uniforms.begin(), own.view_uniforms.end());
        if (stage == GL_FRAGMENT_SHADER) all.frag_coord = own.frag_coord, all.texel_fetch = own.texel_fetch, all.no_source = own.no_source, all.report = own.report;
    }
    return all;
}

void Context::bound_framebuffer(GLenum target, GLuint name) {
    if (target == GL_READ_FRAMEBUFFER) {
        read_framebuffer_ = name;
        return;
    }
    if (target == GL_FRAMEBUFFER) read_framebuffer_ = name;
    draw_framebuffer_ = name;
    target_known_ = false;
    if (auto_) note_drawn_textures();
    if (name == 0) return;
    note_shared_samples();
    if (kept_.empty()) return;
    // Another framebuffer with the image of a pass: what is drawn there is not in the levels of the pass.
    const Framebuffer* f = find_framebuffer(name);
    std::vector<Attachment> now;
    for (Kept& kept : kept_) {
        if (!kept.owner || kept.owner->mode != Pass::Mode::levels || (f && &f->pass == kept.owner)) continue;
        if (now.empty()) now = read_attachments(GL_DRAW_FRAMEBUFFER);
        for (const Attachment& a : kept.owner->attachments)
            for (const Attachment& b : now)
                if (a.type == b.type && a.name == b.name && a.point < GL_DEPTH_ATTACHMENT && b.point < GL_DEPTH_ATTACHMENT)
                    kept.owner->mode = Pass::Mode::none;
    }
}

void Context::removed_framebuffer(GLuint name) {
    if (name == 0) return;
    noted_.erase(name);
    main_offscreen_.erase(name);
    if (const auto it = framebuffers_.find(name); it != framebuffers_.end()) {
        for (auto& [point, a] : it->second.views) drop_samples(a);
        for (Kept& kept : kept_)
            it->second.each_pass([&kept](const Pass& p) {
                if (kept.owner == &p) kept.owner = nullptr;
            });
        framebuffers_.erase(it);
    }
    if (draw_framebuffer_ == name) draw_framebuffer_ = 0, target_known_ = false;
    if (read_framebuffer_ == name) read_framebuffer_ = 0;
}

Framebuffer* Context::find_framebuffer(GLuint name) {
    const auto it = framebuffers_.find(name);
    return it == framebuffers_.end() ? nullptr : &it->second;
}

void Context::check_configured_attachments() {
    ++attachments_epoch_;
    if (auto_) note_drawn_textures();
    note_shared_samples();
    for (const auto& [target, name] : {std::pair{GL_DRAW_FRAMEBUFFER, draw_framebuffer_}, std::pair{GL_READ_FRAMEBUFFER, read_framebuffer_}})
        if (Framebuffer* f = name ? find_framebuffer(name) : nullptr; f && f->config) f->config->compare(program_attachments(target));
}

bool Context::put_off_deletion(GLuint program) {
    if (!is_engaged() || program == 0 || static_cast<GLuint>(get_integer(GL_CURRENT_PROGRAM)) != program) return false;
    deletions_.push_back(program);
    return true;
}

void Context::begin_query(GLenum target, Call call) {
    if (target == GL_TIME_ELAPSED_EXT) return;
    leave_levels(call);
    ++occlusion_queries_;
}

void Context::end_query(GLenum target, Call call) {
    if (target == GL_TIME_ELAPSED_EXT) return before_finish(call);
    before_submit(call);
    if (occlusion_queries_ > 0) --occlusion_queries_;
}

}  // namespace fovea::layer
