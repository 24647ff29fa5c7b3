#include "render/extrapolation/gl_extrapolator.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <vector>

#include "render/extrapolation/gl_float_reader.hpp"
#include "render/extrapolation/gl_passes.hpp"
#include "render/extrapolation/gl_state.hpp"
#include "render/extrapolation/gl_texture_info.hpp"
#include "render/extrapolation/sources.hpp"

namespace fovea::render::extrapolation {

namespace {

// What the processor's backend holds a picture as: four bytes or four floats per pixel, as read back.
Format held_as(Format f) noexcept { return is_float(f) ? Format::rgba32f : Format::rgba8; }

}  // namespace

struct GlExtrapolator::State {
    GlFunctions gl;
    GlSettings settings;
    Backend backend = Backend::processor;
    std::string reason;
    Extrapolator engine;
    std::unique_ptr<GlPasses> passes;
    std::unique_ptr<GlFloatReader> reader;   // in place of a pass below OpenGL ES 3.1
    GLuint framebuffer = 0;
    GlWork on_processor_work;       // of the last call, unless that was
    bool last_in_driver = false;
    bool undecided = false;         // no choice could be made yet
    std::vector<std::byte> pixels[3], packed;

    explicit State(Extrapolator e) : engine(std::move(e)) {}
    ~State() {
        if (framebuffer != 0) gl.DeleteFramebuffers(1, &framebuffer);
    }

    [[nodiscard]] bool may_draw() const noexcept;
    [[nodiscard]] bool read(GLuint texture, const TextureInfo& info, std::byte* to) noexcept;
    [[nodiscard]] GLenum on_processor(const GLuint (&names)[3], const TextureInfo (&infos)[3], float factor, const Hints& hints) noexcept;
    [[nodiscard]] GLenum run(const GLuint (&names)[3], const TextureInfo (&infos)[3], float factor, Backend backend, const Hints& hints = {}) noexcept;
    class ProbePair;
    [[nodiscard]] bool passes_work();
    void probe();
    [[nodiscard]] Result<void> choose();
};

const char* backend_name(Backend b) noexcept {
    return b == Backend::processor ? "processor" : b == Backend::compute ? "compute" : "fragment";
}

bool GlExtrapolator::State::read(GLuint texture, const TextureInfo& info, std::byte* to) noexcept {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    gl.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, info.base_level);
    const bool ok = gl.CheckFramebufferStatus(GL_READ_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    if (ok) gl.ReadPixels(0, 0, info.width, info.height, GL_RGBA, is_float(*info.format) ? GL_FLOAT : GL_UNSIGNED_BYTE, to);
    gl.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, 0, 0);
    if (ok) return gl.GetError() == GL_NO_ERROR;
    // Three floats: no driver has to attach them, any can sample them. Below 3.1 that holds for four floats too.
    if (gl.version < 31) {
        GlStateGuard guard(gl, true);
        if (reader == nullptr) reader = GlFloatReader::create(gl);
        return reader != nullptr && reader->read(texture, info.width, info.height, to);
    }
    if (passes == nullptr) {
        auto made = GlPasses::create(gl, settings.preset, false);
        if (!made) return false;
        passes = std::move(*made);
    }
    GlStateGuard guard(gl, true);
    return passes->read_floats(texture, info.width, info.height, to);
}

GLenum GlExtrapolator::State::on_processor(const GLuint (&names)[3], const TextureInfo (&infos)[3], float factor, const Hints& hints) noexcept {
    const Format format = *infos[0].format, held = held_as(format);
    const int w = infos[0].width, h = infos[0].height;
    const auto row_bytes = static_cast<std::ptrdiff_t>(w) * bytes_per_pixel(held);
    const auto bytes = static_cast<std::size_t>(row_bytes) * static_cast<std::size_t>(h);
    try {
        for (auto& p : pixels) p.resize(bytes);
        packed.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * static_cast<std::size_t>(bytes_per_pixel(format)));
    } catch (const std::bad_alloc&) {
        return GL_OUT_OF_MEMORY;
    }
    for (int i = 0; i < 2; ++i)
        if (!read(names[i], infos[i], pixels[i].data())) return GL_OUT_OF_MEMORY;
    if (format == Format::r8)   // read back as red; as grey its luma is its value
        for (int i = 0; i < 2; ++i)
            for (std::size_t k = 0; k < bytes; k += 4) pixels[i][k + 1] = pixels[i][k + 2] = pixels[i][k];
    const ConstImage src1{pixels[0].data(), w, h, row_bytes, held}, src2{pixels[1].data(), w, h, row_bytes, held};
    const Outcome outcome = engine.extrapolate(src1, src2, {pixels[2].data(), w, h, row_bytes, held}, factor, hints);
    const Report& report = engine.report();
    const int tiles = ((w + kTilePx - 1) / kTilePx) * ((h + kTilePx - 1) / kTilePx), moving = tiles - static_cast<int>(std::lround(report.static_fraction * static_cast<float>(tiles)));
    on_processor_work = {tiles, report.repeated && report.levels == 0 ? 0 : moving, report.repeated ? 0 : moving};
    if (outcome != Outcome::ok) return outcome == Outcome::unusable_motion ? GL_INVALID_VALUE : GL_OUT_OF_MEMORY;
    const GLenum layout = channel_count(format) == 4 ? GL_RGBA : channel_count(format) == 3 ? GL_RGB : GL_RED;
    const std::byte* upload = pixels[2].data();
    const bool packs = format != held;
    if (packs) {
        const std::ptrdiff_t packed_row = static_cast<std::ptrdiff_t>(w) * bytes_per_pixel(format);
        for (int y = 0; y < h; ++y) pack_row(upload + y * row_bytes, format, w, packed.data() + y * packed_row);
        upload = packed.data();
    }
    const GLenum type = bytes_per_channel(format) == 1 ? GL_UNSIGNED_BYTE : bytes_per_channel(format) == 2 ? GL_HALF_FLOAT : GL_FLOAT;
    gl.BindTexture(GL_TEXTURE_2D, names[2]);
    gl.TexSubImage2D(GL_TEXTURE_2D, infos[2].base_level, 0, 0, w, h, layout, type, upload);
    return gl.GetError() == GL_NO_ERROR ? static_cast<GLenum>(GL_NO_ERROR) : static_cast<GLenum>(GL_OUT_OF_MEMORY);
}

// Draws would count in the program's queries, and using another program would be the end of one that is deleted already.
bool GlExtrapolator::State::may_draw() const noexcept {
    constexpr GLenum kCounting[] = {GL_ANY_SAMPLES_PASSED, GL_ANY_SAMPLES_PASSED_CONSERVATIVE, GL_PRIMITIVES_GENERATED};
    for (const GLenum target : kCounting) {
        if (target == GL_PRIMITIVES_GENERATED && !gl.counts_primitives) continue;
        GLint query = 0;
        gl.GetQueryiv(target, GL_CURRENT_QUERY, &query);
        if (query != 0) return false;
    }
    GLint program = 0, deleted = GL_FALSE;
    gl.GetIntegerv(GL_CURRENT_PROGRAM, &program);
    if (program != 0) gl.GetProgramiv(static_cast<GLuint>(program), GL_DELETE_STATUS, &deleted);
    return deleted == GL_FALSE;
}

GLenum GlExtrapolator::State::run(const GLuint (&names)[3], const TextureInfo (&infos)[3], float factor, Backend on, const Hints& hints) noexcept {
    const bool aliased = names[2] == names[0] || names[2] == names[1];
    const bool swizzled = infos[0].swizzled || infos[1].swizzled;
    const bool in_driver = on != Backend::processor && passes != nullptr && passes->writes(*infos[0].format) && !aliased && !swizzled && std::isfinite(factor) && hints.motion == nullptr && may_draw();
    last_in_driver = in_driver;
    if (!in_driver) {
        GlStateGuard guard(gl, false);
        return on_processor(names, infos, factor, hints);
    }
    GlStateGuard guard(gl, true);
    const bool from_first = factor < -0.5f;
    const float step = from_first ? -1 - factor : factor;
    const bool ok = passes->run(names[from_first ? 0 : 1], infos[from_first ? 0 : 1].base_level, names[from_first ? 1 : 0], names[2], infos[2].base_level, infos[0].width, infos[0].height, *infos[0].format, step);
    return ok && gl.GetError() == GL_NO_ERROR ? static_cast<GLenum>(GL_NO_ERROR) : static_cast<GLenum>(GL_OUT_OF_MEMORY);
}

// A pattern that moves three pixels from src1 to src2; dies with its guard still alive.
class GlExtrapolator::State::ProbePair {
public:
    ProbePair(const GlFunctions& gl, int size) noexcept : gl_(gl) {
        constexpr int kMove = 3;
        gl.GenTextures(3, names);
        for (int i = -1; i < 3; ++i) {
            std::vector<std::uint8_t>& picture = pictures[i + 1];
            picture.resize(static_cast<std::size_t>(4 * size * size));
            for (int y = 0; y < size; ++y)
                for (int x = 0; x < size; ++x)
                    for (int c = 0; c < 4; ++c) {
                        const int u = x - kMove * i;
                        picture[static_cast<std::size_t>(4 * (y * size + x) + c)] = static_cast<std::uint8_t>(128 + 60 * std::sin(0.11 * u + 0.05 * y + c) + 60 * std::sin(0.031 * u * (1 + c) - 0.09 * y));
                    }
            if (i < 0) continue;
            gl.BindTexture(GL_TEXTURE_2D, names[i]);
            gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, size, size);
            gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size, size, GL_RGBA, GL_UNSIGNED_BYTE, picture.data());
        }
        TextureInfo info;
        info.format = Format::rgba8;
        info.width = info.height = size;
        for (TextureInfo& i : infos) i = info;
    }
    ~ProbePair() { gl_.DeleteTextures(3, names); }
    ProbePair(const ProbePair&) = delete;
    ProbePair& operator=(const ProbePair&) = delete;

    GLuint names[3] = {};
    TextureInfo infos[3];
    std::vector<std::uint8_t> pictures[4];   // before src1, src1, src2, after src2

private:
    const GlFunctions& gl_;
};

// Whether the passes come closer to the known truth than repeating does, to both sides of it: there are drivers whose compute
// shaders compile, run, and do nothing, or leave parts out where a size is no multiple of a work group's, or whose later passes
// read what was there before they ran.
bool GlExtrapolator::State::passes_work() {
    constexpr int kSize = 133;
    GlStateGuard guard(gl, true);
    const ProbePair pair(gl, kSize);
    std::vector<std::byte> out(static_cast<std::size_t>(4 * kSize * kSize));
    for (const bool back : {false, true, false}) {
        const GLuint names[3] = {pair.names[back ? 1 : 0], pair.names[back ? 0 : 1], pair.names[2]};
        passes->spoil();
        if (run(names, pair.infos, 1.0f, Backend::compute) != GL_NO_ERROR) return false;   // any but the processor: `passes`
        GlStateGuard plain(gl, false);
        if (!read(pair.names[2], pair.infos[2], out.data())) return false;
        const std::vector<std::uint8_t>&truth = pair.pictures[back ? 0 : 3], &repeated = pair.pictures[back ? 1 : 2];
        long off = 0, off_repeated = 0;
        for (std::size_t i = 0; i < out.size(); ++i) {
            off += std::abs(std::to_integer<int>(out[i]) - truth[i]);
            off_repeated += std::abs(repeated[i] - truth[i]);
        }
        if (8 * off >= off_repeated) return false;   // working ones leave a twentieth
    }
    return true;
}

// Times a moving pair on each side, after one to warm up, and keeps the side whose quickest run was the faster: a busy machine only adds.
void GlExtrapolator::State::probe() {
    constexpr int kSize = 256;
    GlStateGuard guard(gl, true);
    const ProbePair pair(gl, kSize);
    const Backend driver = backend;
    double ms[2] = {};
    for (int side = 0; side < 2; ++side)
        for (int repeat = 0; repeat < 6; ++repeat) {
            gl.Finish();
            const auto start = std::chrono::steady_clock::now();
            (void)run(pair.names, pair.infos, 0.5f, side == 0 ? Backend::processor : driver);
            gl.Finish();
            const double took = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
            if (repeat == 1 || (repeat > 1 && took < ms[side])) ms[side] = took;
        }
    if (ms[0] <= ms[1]) backend = Backend::processor;
    char text[128];
    std::snprintf(text, sizeof text, "probe: 256x256 takes %.1f ms on the processor, %.1f ms as %s shaders", ms[0], ms[1], backend_name(driver));
    reason = text;
}

// Which backend: as asked, or as the probe finds. Both need draws; while there may be none the processor serves, and the choice
// is made by a later call.
Result<void> GlExtrapolator::State::choose() {
    backend = Backend::processor;
    undecided = false;
    passes.reset();
    if (settings.backend == Backend::processor) {
        reason = "asked for";
        return {};
    }
    if (gl.version < 31) {
        if (settings.backend) return fail("the backend asked for needs OpenGL ES 3.1", "GL", "let the probe choose");
        reason = "the shader backends need OpenGL ES 3.1; this context is of an earlier version";
        return {};
    }
    if (!may_draw()) {
        undecided = true;
        reason = "a query counts what is drawn, or the program in use is deleted: the choice waits";
        return {};
    }
    const auto* renderer = reinterpret_cast<const char*>(gl.GetString(GL_RENDERER));
    const auto is_driver = [&](const char* name) { return renderer != nullptr && std::strstr(renderer, name) != nullptr; };
    std::string why;
    for (const Backend b : {Backend::compute, Backend::fragment}) {
        if (settings.backend && *settings.backend != b) continue;
        if (b == Backend::compute && is_driver("softpipe")) {   // measured on Mesa 22.3; no probe finds it for certain
            why = "softpipe's compute shaders give the same input another result from run to run";
            continue;
        }
        auto made = GlPasses::create(gl, settings.preset, b == Backend::compute);
        if (!made) {
            why = made.error().message();
            continue;
        }
        passes = std::move(*made);
        if (!passes_work()) {
            why = std::string(backend_name(b)) + " shaders compile but do not do their work";
            passes.reset();
            continue;
        }
        backend = b;
        break;
    }
    if (settings.backend) {
        if (passes == nullptr) return fail("the backend asked for does not work: " + why, "GL", "let the probe choose");
        reason = "asked for";
        return {};
    }
    if (passes == nullptr) {
        reason = "no shader backend works here: " + why;
        return {};
    }
    bool software = false;
    for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"}) software |= is_driver(name);
    if (software)
        probe();
    else
        reason = "not a software rasteriser";
    return {};
}

GlExtrapolator::GlExtrapolator(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
GlExtrapolator::GlExtrapolator(GlExtrapolator&&) noexcept = default;
GlExtrapolator& GlExtrapolator::operator=(GlExtrapolator&&) noexcept = default;
GlExtrapolator::~GlExtrapolator() = default;

Result<GlExtrapolator> GlExtrapolator::create(GlLoader loader, const GlSettings& settings) {
    auto engine = Extrapolator::create({.preset = settings.preset, .threads = settings.threads});
    if (!engine) return std::unexpected(engine.error());
    auto state = std::make_unique<State>(std::move(*engine));
    if (const char* missing = load(state->gl, loader); missing != nullptr) return fail(std::string("the driver lacks ") + missing, "GL", "OpenGL ES 3.0 is needed");
    const GlFunctions& gl = state->gl;
    if (gl.version == 0) return fail("no OpenGL ES context is current", "GL");
    if (gl.version < 30) return fail("the context is of OpenGL ES 2.0", "GL", "OpenGL ES 3.0 is needed");
    load_optional(state->gl, loader);
    if (gl.version < 31 && !raises_errors(gl)) return fail("a context of OpenGL ES 3.0 that raises no errors does not tell what its textures are", "GL", "OpenGL ES 3.1 is needed");
    state->settings = settings;
    gl.GenFramebuffers(1, &state->framebuffer);
    if (auto chosen = state->choose(); !chosen) return std::unexpected(chosen.error());
    return GlExtrapolator(std::move(state));
}

GLenum GlExtrapolator::extrapolate(GLuint src1, GLuint src2, GLuint output, float factor, const Hints& hints) noexcept {
    State& s = *state_;
    if (factor == 0) return GL_INVALID_VALUE;
    const GLuint names[3] = {src1, src2, output};
    TextureInfo infos[3];
    if (s.gl.version < 31) {
        GlStateGuard guard(s.gl, false);
        for (int i = 0; i < 3; ++i) infos[i] = inspect_by_trial(s.gl, names[i], s.framebuffer, infos[0]);
    } else {
        GLint bound = 0;
        s.gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
        for (int i = 0; i < 3; ++i) infos[i] = inspect(s.gl, names[i]);
        s.gl.BindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
    }
    for (const TextureInfo& i : infos)
        if (!i.format || *i.format != *infos[0].format || i.width != infos[0].width || i.height != infos[0].height) return GL_INVALID_OPERATION;
    if (s.undecided && s.may_draw()) try {
            static_cast<void>(s.choose());   // where what was asked for does not work, the processor goes on
        } catch (const std::bad_alloc&) {
            return GL_OUT_OF_MEMORY;
        }
    return s.run(names, infos, factor, s.backend, hints);
}

GlWork GlExtrapolator::work() noexcept {
    State& s = *state_;
    if (!s.last_in_driver) return s.on_processor_work;
    const GlRegions::Counts c = s.passes->tile_counts();
    return {c.all, c.moving, c.reached};
}
Backend GlExtrapolator::backend() const noexcept { return state_->backend; }
const std::string& GlExtrapolator::reason() const noexcept { return state_->reason; }

}  // namespace fovea::render::extrapolation
