#include "render/extrapolation/extrapolation.hpp"

#include <cmath>
#include <cstring>
#include <new>

#include "render/extrapolation/edges.hpp"
#include "render/extrapolation/gather.hpp"
#include "render/extrapolation/judgement.hpp"
#include "render/extrapolation/luma.hpp"
#include "render/extrapolation/motion.hpp"
#include "render/extrapolation/projection.hpp"
#include "render/extrapolation/standing.hpp"

namespace fovea::render::extrapolation {

struct Extrapolator::State {
    explicit State(const Settings& s) : settings(s), kernels(&choose_kernels(s.vector_code)), pool(s.threads) {}

    Settings settings;
    const Kernels* kernels;
    ThreadPool pool;
    Report report;

    int width_px = 0, height_px = 0;   // what the buffers below are for
    Format format = Format::rgba8;
    Tuning tuning;
    TileMap tiles;
    LumaScratch luma_scratch;
    MotionSearch motion;
    Projection projection;       // of the search's cells
    Projection coarse_projection;   // with a gaze: of cells twice as large
    Projection known_projection; // of the renderer's motion; sized on first use
    Gatherable source, far_source;
    MotionEdges edges, known_edges;   // of the search's cells, and of the renderer's without depth
    bool known_with_depth = false;
    Gather gather;
    ChangingLight light;
    Judgement judgement;
    StandingRims rims;
};

namespace {

void copy_picture(const ConstImage& from, const Image& to) noexcept {
    const auto bytes = static_cast<std::size_t>(from.width_px) * static_cast<std::size_t>(bytes_per_pixel(from.format));
    for (int y = 0; y < from.height_px; ++y) std::memcpy(to.row(y), from.row(y), bytes);
}

bool usable(const ConstImage& i) noexcept {
    return i.pixels != nullptr && i.width_px >= 1 && i.height_px >= 1 && i.width_px <= kMaxEdgePx && i.height_px <= kMaxEdgePx &&
           i.row_bytes >= static_cast<std::ptrdiff_t>(i.width_px) * bytes_per_pixel(i.format);
}

// The k for which the buffer is ceil(picture / k); 0: none.
int cell_of(const KnownMotion& m, int width_px, int height_px) noexcept {
    for (const int k : {1, 2, 4, 8})
        if ((m.motion_px != nullptr || m.ahead_px != nullptr) && m.width == (width_px + k - 1) / k && m.height == (height_px + k - 1) / k) return k;
    return 0;
}

// Whether src1 shows, where the known motion says that src2's points were, about what src2 does. A renderer that cuts to
// another place still delivers a motion; then src1 has nothing to add.
bool sources_agree(const ConstImage& src1, const ConstImage& src2, const KnownMotion& m, int cell_px) noexcept {
    constexpr int kSamples = 48;   // along each axis
    int compared = 0, alike = 0;
    for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) {
            const int x = (2 * i + 1) * src2.width_px / (2 * kSamples), y = (2 * j + 1) * src2.height_px / (2 * kSamples);
            const std::size_t cell = static_cast<std::size_t>(y / cell_px) * static_cast<std::size_t>(m.width) + static_cast<std::size_t>(x / cell_px);
            const float px = static_cast<float>(x) - m.motion_px[2 * cell] + 0.5f, py = static_cast<float>(y) - m.motion_px[2 * cell + 1] + 0.5f;
            if (!(px >= 0 && py >= 0 && px < static_cast<float>(src1.width_px) && py < static_cast<float>(src1.height_px))) continue;
            ++compared;
            float most = 0;
            if (is_float(src1.format)) {
                float a[4], b[4];
                unpack_row(src1.row(static_cast<int>(py)), src1.format, static_cast<int>(px), 1, a);
                unpack_row(src2.row(y), src2.format, x, 1, b);
                for (int c = 0; c < 4; ++c) most = std::max(most, std::fabs(a[c] - b[c]) / std::max(std::max(std::fabs(a[c]), std::fabs(b[c])), 1e-3f) * 240.0f);
            } else {
                std::uint8_t a[4], b[4];
                unpack_row(src1.row(static_cast<int>(py)), src1.format, static_cast<int>(px), 1, a);
                unpack_row(src2.row(y), src2.format, x, 1, b);
                for (int c = 0; c < 4; ++c) most = std::max(most, std::fabs(static_cast<float>(a[c]) - static_cast<float>(b[c])));
            }
            alike += most < static_cast<float>(kSecondOnly) ? 1 : 0;
        }
    constexpr float kMustAgree = 0.75f;
    return compared > 0 && static_cast<float>(alike) >= kMustAgree * static_cast<float>(compared);
}

}  // namespace

const char* outcome_text(Outcome o) noexcept {
    switch (o) {
        case Outcome::ok: return "ok";
        case Outcome::factor_is_zero: return "the factor is 0";
        case Outcome::formats_differ: return "the formats differ";
        case Outcome::sizes_differ: return "the sizes differ";
        case Outcome::unusable_picture: return "a picture has no pixels, or an edge outside 1 to 16384";
        case Outcome::unusable_motion: return "the known motion covers the picture with no cell of 1, 2, 4 or 8 pixels";
        case Outcome::out_of_memory: return "out of memory";
    }
    return "?";
}

Extrapolator::Extrapolator(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Extrapolator::Extrapolator(Extrapolator&&) noexcept = default;
Extrapolator& Extrapolator::operator=(Extrapolator&&) noexcept = default;
Extrapolator::~Extrapolator() = default;

Result<Extrapolator> Extrapolator::create(const Settings& settings) {
    if (settings.threads < 1 || settings.threads > 16) return fail("extrapolation threads outside 1 to 16", "extrapolation.threads", "1 is right beside a software rasteriser");
    try {
        return Extrapolator(std::make_unique<State>(settings));
    } catch (const std::exception& e) {
        return fail(std::string("cannot start the extrapolation's threads: ") + e.what(), "extrapolation.threads", "use fewer");
    }
}

const Report& Extrapolator::report() const noexcept { return state_->report; }
const Settings& Extrapolator::settings() const noexcept { return state_->settings; }
const char* Extrapolator::code_path() const noexcept { return state_->kernels->name; }

bool Extrapolator::prepare(int width_px, int height_px, Format format) noexcept {
    State& s = *state_;
    if (s.width_px == width_px && s.height_px == height_px && s.format == format) return true;
    s.width_px = 0;
    try {
        s.tuning = tuning_of(s.settings.preset);
        // A small picture has no motion to spare for coarse cells.
        if (std::min(width_px, height_px) < 256) s.tuning.cell_px = 2;
        s.tiles.resize(width_px, height_px);
        s.luma_scratch.resize(width_px, height_px, s.settings.threads);
        s.motion.resize(width_px, height_px, s.tuning.cell_px, s.settings.threads);
        s.projection.resize(s.motion.field().width, s.motion.field().height);
        s.coarse_projection.resize(s.motion.coarse_field().width, s.motion.coarse_field().height);
        s.known_projection = {};
        s.source.resize(width_px, height_px, format);
        s.far_source.resize(width_px, height_px, format);
        s.edges.resize(s.motion.field().width, s.motion.field().height, width_px, format, s.settings.threads);
        s.gather.resize(width_px, height_px, format, s.settings.threads);
        s.judgement.resize(width_px, height_px, format, s.settings.threads);
        s.rims.resize(s.tiles.columns, s.tiles.rows);
    } catch (const std::bad_alloc&) {
        return false;
    }
    s.width_px = width_px;
    s.height_px = height_px;
    s.format = format;
    return true;
}

Outcome Extrapolator::extrapolate(const ConstImage& src1, const ConstImage& src2, const Image& output, float factor, const Hints& hints) noexcept {
    State& s = *state_;
    s.report = {};
    if (factor == 0) return Outcome::factor_is_zero;
    if (src1.format != src2.format || src1.format != output.format) return Outcome::formats_differ;
    if (src1.width_px != src2.width_px || src1.width_px != output.width_px || src1.height_px != src2.height_px || src1.height_px != output.height_px) return Outcome::sizes_differ;
    if (!usable(src1) || !usable(src2) || !usable(output)) return Outcome::unusable_picture;
    int known_cell = 0;
    if (hints.motion != nullptr) {
        known_cell = cell_of(*hints.motion, src1.width_px, src1.height_px);
        if (known_cell == 0) return Outcome::unusable_motion;
    }
    if (!prepare(src1.width_px, src1.height_px, src1.format)) return Outcome::out_of_memory;
    const bool with_depth = known_cell != 0 && hints.motion->depth != nullptr;
    if (known_cell != 0) {
        const Field& sized = s.known_projection.displacement();
        if (sized.width != hints.motion->width || sized.height != hints.motion->height || (with_depth && !s.known_with_depth)) try {
                if (with_depth) {
                    if (!is_float(src1.format)) s.light.resize(src1.width_px, src1.height_px);
                    s.known_projection.resize_known(hints.motion->width, hints.motion->height, src1.width_px, src1.height_px);
                } else {
                    s.known_projection.resize(hints.motion->width, hints.motion->height);
                }
                // In both cases: the next call may come without depth.
                s.known_edges.resize(hints.motion->width, hints.motion->height, src1.width_px, src1.format, s.settings.threads);
                s.known_with_depth = with_depth;
            } catch (const std::bad_alloc&) {
                s.known_projection = {};
                return Outcome::out_of_memory;
            }
    }

    const auto repeat = [&](const ConstImage& source, Report::Reason reason) {
        s.report.repeated = true;
        s.report.reason = reason;
        copy_picture(source, output);
        return Outcome::ok;
    };
    if (!std::isfinite(factor)) return repeat(factor < 0 ? src1 : src2, Report::Reason::factor_without_meaning);
    if (factor == -1) return repeat(src1, Report::Reason::at_a_source);

    // Known motion belongs to src2; else the nearer source is moved, and time runs backwards from src1.
    const bool from_first = known_cell == 0 && factor < -0.5f;
    const ConstImage &near = from_first ? src1 : src2, &far = from_first ? src2 : src1;
    const float step = from_first ? -1 - factor : factor;   // in frame times, away from the farther source
    MotionSearch& m = s.motion;
    MotionSearch::Fovea fovea;
    const bool foveated = known_cell == 0 && hints.gaze != nullptr && m.fovea(*hints.gaze, fovea);
    const Gaze* gaze = foveated ? hints.gaze : nullptr;   // a gaze that leaves nothing to save is full effort
    const int first_level = foveated ? 1 : 0;
    LumaPair luma{&near, &far, s.tuning.cell_px << first_level, 1, &m.near_luma(first_level), &m.far_luma(first_level), &s.luma_scratch};
    // Only light of any range needs a key, which takes as long as a still pair's comparison.
    const bool at_once = known_cell == 0 && !is_float(near.format);

    compare_tiles(src1, src2, output, s.tiles, *s.kernels, s.pool, at_once ? &luma : nullptr);
    s.report.static_fraction = static_cast<float>(s.tiles.still_count) / static_cast<float>(s.tiles.columns * s.tiles.rows);
    if (s.tiles.all_still()) {   // the comparison has copied it
        s.report.repeated = true;
        s.report.reason = Report::Reason::static_pair;
        return Outcome::ok;
    }
    const auto longer = static_cast<float>(std::max(near.width_px, near.height_px));
    const float reach_px = std::max(1.0f, kMaxReach * longer);

    bool moves = false;
    Projection* projection = &s.projection;
    int cell_px = s.tuning.cell_px;
    if (known_cell != 0) {
        projection = &s.known_projection;
        cell_px = known_cell;
        if (with_depth) {
            make_gatherable(near, s.source, s.pool);
            projection->run_known(*hints.motion, step, cell_px, reach_px, s.source, is_float(near.format), *s.kernels);
        } else {
            const float* given = hints.motion->ahead_px != nullptr ? hints.motion->ahead_px : hints.motion->motion_px;
            projection->run({given, given + 1, 2, hints.motion->ahead_px != nullptr ? 1.0f : step}, cell_px, reach_px);
        }
    } else {
        luma.key = luma_key(src2);
        fill_luma(luma, s.tiles, m.begin(s.tiles, foveated), at_once, *s.kernels, s.pool);
        if (foveated) {
            const Box finest = m.run_coarse(fovea, s.tuning, s.tiles, *s.kernels, s.pool);
            fill_luma({&near, &far, cell_px, luma.key, &m.near_luma(), &m.far_luma(), &s.luma_scratch}, s.tiles, finest, false, *s.kernels, s.pool);
            m.run_fine(fovea, step, s.tuning, s.tiles, *s.kernels, s.pool);
        } else {
            m.run(s.tuning, s.tiles, *s.kernels, s.pool);
        }
        s.report.levels = m.levels();
        s.report.unexplained_fraction = m.unexplained_fraction();
        if (s.report.unexplained_fraction > kCutFraction) return repeat(near, Report::Reason::scene_cut);
        // The field points to the farther source: carried on, it points away from it.
        const float scale = -step * static_cast<float>(cell_px);
        if (foveated) {
            const Field &f = m.field(), &c = m.coarse_field();
            const Box active = m.coarse_active();
            s.coarse_projection.run({c.u.data(), c.v.data(), 1, 2 * scale}, 2 * cell_px, reach_px, &active);
            moves = s.coarse_projection.moves();
            if (m.fine().x1 > 0) {
                constexpr int kRim = 4;   // cells that the gather mixes with, and those beyond the edges of motion
                projection->run_part({f.u.data(), f.v.data(), 1, scale}, cell_px, reach_px, m.fine(), fovea.box.grown(kRim, f.width, f.height), s.coarse_projection);
            } else {
                fovea.box = {};
            }
        } else {
            const Field& f = m.field();
            projection->run({f.u.data(), f.v.data(), 1, scale}, cell_px, reach_px, &m.active());
        }
    }
    const bool fine = !foveated || fovea.box.x1 > 0;   // the finest cells say something
    moves = moves || (fine && projection->moves());
    s.report.filled_fraction = foveated ? s.coarse_projection.filled_fraction() : projection->filled_fraction();
    if (!moves) return repeat(near, Report::Reason::none);
    if (!with_depth) make_gatherable(near, s.source, s.pool);
    const Gather::Layer finest{&projection->displacement(), projection->touched(), cell_px};
    Gather::Job job{&near, &s.source, &output, finest, &s.tiles, s.tuning.cubic, gaze, finest, {}};
    if (foveated) {
        job.all = {&s.coarse_projection.displacement(), s.coarse_projection.touched(), 2 * cell_px};
        const int per_tile = kTilePx / cell_px;
        job.fovea_tiles = {fovea.box.x0 / per_tile, fovea.box.y0 / per_tile, (fovea.box.x1 + per_tile - 1) / per_tile, (fovea.box.y1 + per_tile - 1) / per_tile};
    }
    if (with_depth && projection->far_displacement() != nullptr && sources_agree(src1, src2, *hints.motion, cell_px)) {
        make_gatherable(far, s.far_source, s.pool);
        job.far_source = &s.far_source;
        job.far_displacement = projection->far_displacement();
        job.sources = &projection->sources();
        s.report.used_both = true;
        if (!is_float(near.format)) {
            s.light.clear();
            job.light = &s.light;
        }
    }
    s.gather.run(job, *s.kernels, s.pool);
    if (job.light != nullptr && s.light.find(step)) s.light.apply(output, s.pool);
    const Gathered gathered{&near, &far, &s.source, &s.far_source, &output, &s.tiles, s.gather.stays().data(), job.all, job.fovea, job.fovea_tiles, step};
    bool doubted = false;
    if (known_cell == 0) {
        make_gatherable(far, s.far_source, s.pool);
        doubted = s.judgement.weigh(gathered, *s.kernels, s.pool);
    }
    // With depth the projection knows the edges already.
    MotionEdges& edges = known_cell == 0 ? s.edges : s.known_edges;
    if (fine && !with_depth && edges.find(projection->displacement(), foveated ? fovea.box : projection->touched(), gaze, cell_px)) {
        if (known_cell != 0) make_gatherable(far, s.far_source, s.pool);
        edges.run({&near, &s.source, &s.far_source, &output, &projection->displacement(), projection->front(), cell_px, step, gaze, s.tuning.cubic}, *s.kernels, s.pool);
    }
    if (known_cell != 0) return Outcome::ok;
    if (doubted) s.judgement.keep(gathered, s.pool);
    if (s.rims.find(gathered)) s.rims.run(gathered);
    return Outcome::ok;
}

}  // namespace fovea::render::extrapolation
