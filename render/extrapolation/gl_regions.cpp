#include "render/extrapolation/gl_regions.hpp"

#include <algorithm>

namespace fovea::render::extrapolation {

namespace {

constexpr int kComparedPx = 16;   // the edge of what is compared as one
constexpr int kPartPx = 4;        // of it by one fragment: a whole one would read 512 pixels in a row
constexpr int kLargePx = 8192;    // above it tiles are twice as large: no more blocks than a dispatch can have
constexpr int kListRow = 256;     // entries of a list per row of its image
constexpr int kPatchCells = 4;    // from one patch to the next
constexpr int kBlockTiles = 4;    // a work group of patches

int list_width(int entries) noexcept { return std::min(entries, kListRow); }
int list_height(int entries) noexcept { return (entries + kListRow - 1) / kListRow; }
int per(int edge, int part) noexcept { return (edge + part - 1) / part; }

}  // namespace

GlRegions::~GlRegions() { release(); }

void GlRegions::release() noexcept {
    const GlFunctions& gl = runner_.gl();
    const auto drop = [&](GLuint& t) {
        if (t != 0) gl.DeleteTextures(1, &t);
        t = 0;
    };
    for (GLuint* t : {&same_, &still_, &args_, &later_args_}) drop(*t);
    const auto drop_all = [&](Lister& l) {
        for (GLuint* t : {&l.map, &l.runs, &l.rectangles, &l.row_count, &l.prefix, &l.list}) drop(*t);
    };
    for (Lister& l : listers_) drop_all(l);
    drop_all(blocks_);
    if (args_buffer_ != 0) gl.DeleteBuffers(1, &args_buffer_);
    args_buffer_ = 0;
}

void GlRegions::make(Lister& l, int columns, int rows, bool blocks) noexcept {
    l.columns = columns;
    l.rows = rows;
    l.map = runner_.make_image(columns, rows);
    if (!blocks)
        for (GLuint* t : {&l.runs, &l.rectangles}) *t = runner_.make_image(columns, rows);
    l.row_count = runner_.make_image(1, rows, GL_RGBA32UI);
    l.prefix = runner_.make_image(1, rows + 1, GL_RGBA32UI);
    l.list = runner_.make_image(list_width(columns * rows), list_height(columns * rows), GL_RGBA32UI);
}

void GlRegions::resize(int width_px, int height_px, int finest_width, int finest_height, int levels, bool compute) noexcept {
    release();
    const GlFunctions& gl = runner_.gl();
    width_px_ = width_px;
    height_px_ = height_px;
    finest_width_ = finest_width;
    finest_height_ = finest_height;
    compute_ = compute;
    tile_px_ = std::max(width_px, height_px) > kLargePx ? 2 * kComparedPx : kComparedPx;
    cell_px_ = per(width_px, finest_width);
    // The patches go one beyond the picture.
    const auto tiles = [&](int cells) { return per((per(cells, kPatchCells) + 1) * kPatchCells * cell_px_, tile_px_); };
    const int columns = tiles(finest_width), rows = tiles(finest_height);
    entries_ = Args::kLevel + levels - Args::of(List::moving);
    same_ = runner_.make_image(per(width_px, kPartPx), per(height_px, kPartPx), GL_R16UI);
    still_ = runner_.make_image(per(width_px, kComparedPx), per(height_px, kComparedPx));
    for (Lister& l : listers_) make(l, columns, rows, false);
    if (compute) make(blocks_, per(columns, kBlockTiles), per(rows, kBlockTiles), true);
    args_ = runner_.make_image(entries_, 1, GL_RGBA32UI);
    later_args_ = runner_.make_image(2, 1, GL_RGBA32UI);
    gl.GenBuffers(1, &args_buffer_);
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, args_buffer_);
    gl.BufferData(GL_PIXEL_PACK_BUFFER, (Args::of(List::moving) + entries_) * Args::kBytes, nullptr, GL_DYNAMIC_COPY);
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

void GlRegions::list(const Lister& l, GLuint rectangles, const Over& where) noexcept {
    GlRunner& r = runner_;
    r.use(Kernel::row_count);
    r.bind(0, rectangles);
    r.set_size(l.columns, l.rows);
    r.draw(l.row_count, 0, 1, l.rows, where);
    r.use(Kernel::prefix);
    r.bind(4, l.row_count);
    r.draw(l.prefix, 0, 1, l.rows + 1, where);
    r.use(Kernel::list);
    r.bind(0, rectangles);
    r.bind(4, l.prefix);
    r.set_size(l.columns, l.rows);
    r.draw(l.list, 0, list_width(l.columns * l.rows), list_height(l.columns * l.rows), where);
}

void GlRegions::list_rectangles(const Lister& l, const Over& where) noexcept {
    GlRunner& r = runner_;
    r.use(Kernel::runs);
    r.bind(0, l.map);
    r.set_size(l.columns, l.rows);
    r.draw(l.runs, 0, l.columns, l.rows, where);
    r.use(Kernel::rectangles);
    r.bind(0, l.runs);
    r.set_size(l.columns, l.rows);
    r.draw(l.rectangles, 0, l.columns, l.rows, where);
    list(l, l.rectangles, where);
}

// Packed into a buffer, where indirect draws and dispatches find it: the processor never waits.
void GlRegions::write_args(GLuint args, int entries, List first) noexcept {
    const GlFunctions& gl = runner_.gl();
    runner_.attach(args);
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, runner_.framebuffer());
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, args_buffer_);
    gl.ReadPixels(0, 0, entries, 1, GL_RGBA_INTEGER, GL_UNSIGNED_INT, reinterpret_cast<void*>(static_cast<std::uintptr_t>(Args::of(first)) * Args::kBytes));
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

void GlRegions::find_moving(GLuint near, GLuint far) noexcept {
    GlRunner& r = runner_;
    const int compared_wide = per(width_px_, kComparedPx), compared_high = per(height_px_, kComparedPx);
    r.use(Kernel::compare);
    r.bind(0, near);
    r.bind(1, far);
    r.set_size(width_px_, height_px_);
    r.draw(same_, 0, per(width_px_, kPartPx), per(height_px_, kPartPx), over_all());
    r.use(Kernel::still);
    r.bind(4, same_);
    r.set_size(per(width_px_, kPartPx), per(height_px_, kPartPx));
    r.draw(still_, 0, compared_wide, compared_high, over_all());
    r.use(Kernel::moving);
    r.bind(0, still_);
    r.set_size(compared_wide, compared_high);
    r.set_cell(tile_px_ / kComparedPx);
    const Lister& moving = lister(List::moving);
    r.draw(moving.map, 0, moving.columns, moving.rows, over_all());
    list_rectangles(moving, over_all());
    if (compute_) {
        r.use(Kernel::blocks);
        r.bind(0, moving.map);
        r.set_size(moving.columns, moving.rows);
        r.draw(blocks_.map, 0, blocks_.columns, blocks_.rows, over_all());
        list(blocks_, blocks_.map, over_all());
    }
    r.use(Kernel::args);
    r.bind(4, moving.prefix);
    r.bind(5, compute_ ? blocks_.prefix : moving.prefix);
    r.set_size(finest_width_, finest_height_);
    r.set_cell(std::max(kBlockTiles * tile_px_ / (kPatchCells * cell_px_) / 8, 1));
    r.draw(args_, 0, entries_, 1, over_all());
    write_args(args_, entries_, List::moving);
    std::array<GLuint, kLists> lists;
    for (std::size_t i = 0; i < listers_.size(); ++i) lists[i] = listers_[i].list;
    r.set_lists(args_buffer_, lists, tile_px_, blocks_.list, kBlockTiles * tile_px_);
}

// Where nothing moves only the empty count is written.
void GlRegions::find(List which) noexcept {
    GlRunner& r = runner_;
    const Lister& l = lister(which);
    r.draw(l.map, 0, l.columns, l.rows, over_all_if_any());
    list_rectangles(l, over_all_if_any());
    r.clear_words(later_args_, {0, 0, 0, 0});
    r.use(Kernel::args);
    r.bind(4, l.prefix);
    r.bind(5, l.prefix);
    r.draw(later_args_, 0, 2, 1, over_all_if_any());
    write_args(later_args_, 2, which);
}

GlRegions::Counts GlRegions::counts() noexcept {
    const GlFunctions& gl = runner_.gl();
    Counts result;
    if (args_buffer_ == 0) return result;
    GLint bound = 0;
    gl.GetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &bound);
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, args_buffer_);
    if (const auto* words = static_cast<const GLuint*>(gl.MapBufferRange(GL_PIXEL_PACK_BUFFER, 0, Args::kDrawAny * Args::kBytes, GL_MAP_READ_BIT)); words != nullptr) {
        constexpr int kWords = Args::kBytes / 4;
        const auto tiles = [&](List list) { return static_cast<int>(words[kWords * (Args::of(list) + 1)]); };
        result = {tiles(List::moving), tiles(List::calm) + tiles(List::torn), tiles(List::edges), lister(List::moving).columns * lister(List::moving).rows};
        gl.UnmapBuffer(GL_PIXEL_PACK_BUFFER);
    }
    gl.BindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(bound));
    return result;
}

}  // namespace fovea::render::extrapolation
