#include "render/viewer/pictures.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "render/gl/png.hpp"

namespace fovea::viewer {
namespace {

using Color = std::array<std::uint8_t, 3>;
// The colours of Varjo's pictures: blue 1x1, green 2x2, red 4x4; orange for an eighth.
constexpr std::array<Color, 4> kLevelColors{{{70, 120, 255}, {60, 210, 90}, {235, 70, 60}, {255, 170, 40}}};
constexpr std::array kLevelNames{"1", "1/2", "1/4", "1/8"};
constexpr std::array kRateNames{"1X1", "2X2", "4X4", "8X8"};
constexpr double kTint = 0.20;

// 3x5 characters, five rows of three from the top.
struct Glyph {
    char c;
    const char* rows;
};
constexpr Glyph kGlyphs[] = {
    {'0', "####.##.##.####"}, {'1', ".#.##..#..#.###"}, {'2', "###..#####..###"}, {'3', "###..####..####"},
    {'4', "#.##.####..#..#"}, {'5', "####..###..####"}, {'6', "####..####.####"}, {'7', "###..#..#.#..#."},
    {'8', "####.#####.####"}, {'9', "####.####..####"}, {'A', ".#.#.#####.##.#"}, {'B', "##.#.###.#.###."},
    {'C', "####..#..#..###"}, {'D', "##.#.##.##.###."}, {'E', "####..##.#..###"}, {'F', "####..##.#..#.."},
    {'G', "####..#.##.####"}, {'H', "#.##.#####.##.#"}, {'I', "###.#..#..#.###"}, {'J', "..#..#..##.####"},
    {'K', "#.##.###.#.##.#"}, {'L', "#..#..#..#..###"}, {'M', "#.########.##.#"}, {'N', "##.#.##.##.##.#"},
    {'O', "####.##.##.####"}, {'P', "####.#####..#.."}, {'Q', "####.##.####..#"}, {'R', "##.#.###.#.##.#"},
    {'S', "####..###..####"}, {'T', "###.#..#..#..#."}, {'U', "#.##.##.##.####"}, {'V', "#.##.##.##.#.#."},
    {'W', "#.##.########.#"}, {'X', "#.##.#.#.#.##.#"}, {'Y', "#.##.#.#..#..#."}, {'Z', "###..#.#.#..###"},
    {'.', ".............#."}, {',', "..........#.#.."}, {':', "....#.....#...."}, {'/', "..#..#.#.#..#.."},
    {'%', "#.#..#.#.#..#.#"}, {'+', "....#.###.#...."}, {'-', "......###......"}, {'(', ".#.#..#..#...#."}, {')', ".#...#..#..#.#."},
};

static_assert(std::ranges::all_of(kGlyphs, [](const Glyph& g) { return std::string_view(g.rows).size() == 15; }));

class Canvas {
public:
    Canvas(int width, int height) : width_(width), height_(height), rgb_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3) {}
    [[nodiscard]] int width() const noexcept { return width_; }
    [[nodiscard]] int height() const noexcept { return height_; }
    [[nodiscard]] gl::PngImage image() const noexcept { return {width_, height_, rgb_}; }
    void blend(int x, int y, const Color& c, double alpha) noexcept {
        if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
        std::uint8_t* p = &rgb_[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)) * 3];
        for (std::size_t i = 0; i < 3; ++i) p[i] = static_cast<std::uint8_t>(std::lround(p[i] + (c[i] - p[i]) * alpha));
    }
    void fill(int x0, int y0, int x1, int y1, const Color& c, double alpha) noexcept {
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) blend(x, y, c, alpha);
    }
    void text(int x, int y, int scale, std::string_view s, const Color& color) noexcept {
        for (const char c : s) {
            for (const Glyph& g : kGlyphs)
                if (g.c == c)
                    for (int i = 0; i < 15; ++i)
                        if (g.rows[i] == '#') fill(x + i % 3 * scale, y + i / 3 * scale, x + (i % 3 + 1) * scale, y + (i / 3 + 1) * scale, color, 1);
            x += 4 * scale;
        }
    }
    void disc(double cx, double cy, double r, const Color& c) noexcept {
        for (int y = static_cast<int>(cy - r); y <= static_cast<int>(cy + r) + 1; ++y)
            for (int x = static_cast<int>(cx - r); x <= static_cast<int>(cx + r) + 1; ++x)
                if (std::hypot(x + 0.5 - cx, y + 0.5 - cy) <= r) blend(x, y, c, 1);
    }
    void ellipse(double cx, double cy, double rx, double ry, const Color& c, int thickness) noexcept {
        if (!(rx > 1 && ry > 1 && rx < 1e5 && ry < 1e5)) return;
        const int steps = static_cast<int>(8 * std::max(rx, ry)) + 16;
        for (int i = 0; i < steps; ++i) {
            if (i * 48 / steps % 2 != 0) continue;   // dashed
            const double a = 6.283185307179586 * i / steps;
            const int x = static_cast<int>(cx + rx * std::cos(a)), y = static_cast<int>(cy + ry * std::sin(a));
            fill(x, y, x + thickness, y + thickness, c, 1);
        }
    }
    void put(int x, int y, const std::uint8_t* rgb) noexcept {
        std::memcpy(&rgb_[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)) * 3], rgb, 3);
    }

private:
    int width_, height_;
    std::vector<std::uint8_t> rgb_;
};

int level_at(const SnapshotView& v, int x, int y_from_bottom) noexcept {
    if (v.level.empty()) return 0;
    const int c = std::min(x / v.bin_px, v.columns - 1), r = std::min(y_from_bottom / v.bin_px, v.rows - 1);
    return v.level[static_cast<std::size_t>(r) * static_cast<std::size_t>(v.columns) + static_cast<std::size_t>(c)];
}

Canvas side_by_side(const Snapshot& s, int margin_bottom) {
    Canvas canvas(s.width_px * static_cast<int>(s.views.size()), s.height_px + margin_bottom);
    for (std::size_t i = 0; i < s.views.size(); ++i)
        for (int y = 0; y < s.height_px; ++y)
            for (int x = 0; x < s.width_px; ++x)
                canvas.put(x + static_cast<int>(i) * s.width_px, s.height_px - 1 - y,
                           &s.views[i].rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width_px) + static_cast<std::size_t>(x)) * 4]);
    return canvas;
}

void draw_levels(Canvas& canvas, const Snapshot& s, const SnapshotView& v, int left) {
    const int w = s.width_px, h = s.height_px, line = std::max(1, w / 512);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const int level = level_at(v, x, y);
            const Color& c = kLevelColors[static_cast<std::size_t>(std::min(level, 3))];
            const bool edge = (x >= line && level_at(v, x - line, y) != level) || (y >= line && level_at(v, x, y - line) != level);
            canvas.blend(left + x, h - 1 - y, c, edge ? 0.9 : level == 0 ? 0.12 : kTint);
        }
    const double cx = left + (v.focal_x_ndc + 1) / 2 * w, cy = (1 - v.focal_y_ndc) / 2 * h;
    const int arm = w / 40, t = std::max(1, w / 400), x = static_cast<int>(cx), y = static_cast<int>(cy);
    const Color white{255, 255, 255}, black{0, 0, 0};
    canvas.fill(x - arm - 1, y - t - 1, x + arm + 2, y + t + 1, black, 0.6);
    canvas.fill(x - t - 1, y - arm - 1, x + t + 1, y + arm + 2, black, 0.6);
    canvas.fill(x - arm, y - t, x + arm + 1, y + t, white, 1);
    canvas.fill(x - t, y - arm, x + t, y + arm + 1, white, 1);
    canvas.ellipse(cx, cy, v.radius95_x_ndc / 2 * w, v.radius95_y_ndc / 2 * h, white, t + 1);
    if (!v.actual) return;
    const double ax = left + (v.actual->x + 1) / 2 * w, ay = (1 - v.actual->y) / 2 * h;
    canvas.disc(ax, ay, 3.5 * t + 2, black);
    canvas.disc(ax, ay, 3.5 * t, {255, 215, 25});
}

void draw_legend(Canvas& canvas, const Snapshot& s, int top) {
    std::array<std::size_t, 4> bins{};
    for (const SnapshotView& v : s.views)
        for (const std::uint8_t level : v.level) ++bins[std::min<std::size_t>(level, 3)];
    const std::size_t all = std::max<std::size_t>(bins[0] + bins[1] + bins[2] + bins[3], 1);
    const int scale = std::max(2, canvas.width() / 512), pad = 3 * scale, mid = top + pad;
    canvas.fill(0, top, canvas.width(), canvas.height(), {18, 20, 26}, 1);
    int x = pad;
    std::array<char, 160> text{};
    for (std::size_t i = 0; i < 4; ++i) {
        if (bins[i] == 0 && !(i == 0 && all == 1)) continue;
        canvas.fill(x, mid, x + 5 * scale, mid + 5 * scale, kLevelColors[i], 1);
        x += 8 * scale;
        std::snprintf(text.data(), text.size(), "%s RES. (%s) %.1f%%", kLevelNames[i], kRateNames[i], 100.0 * static_cast<double>(bins[i]) / static_cast<double>(all));
        canvas.text(x, mid, scale, text.data(), {225, 228, 235});
        x += (static_cast<int>(std::strlen(text.data())) * 4 + 8) * scale;
    }
    std::snprintf(text.data(), text.size(), "CROSS: GAZE PREDICTED FOR THE PHOTON (95%% DASHED).  %sSHADED %.1f%%.  ",
                  !s.views.empty() && s.views[0].actual ? "DOT: WHERE IT WAS.  " : "", 100 * s.shaded);
    canvas.text(pad, mid + 8 * scale, scale, std::string(text.data()) + s.title, {160, 166, 178});
}

}  // namespace

Snapshot snapshot_of(std::uint64_t frame, std::string_view method, bool live, double shaded) {
    Snapshot s;
    s.frame = frame;
    s.shaded = shaded;
    s.title = "METHOD: " + std::string(method) + "  FRAME " + std::to_string(frame) + (live ? "" : "  (NO LIVE GAZE)");
    std::ranges::transform(s.title, s.title.begin(), [](char c) { return c == '_' ? ' ' : static_cast<char>(std::toupper(static_cast<unsigned char>(c))); });
    return s;
}

SnapshotView read_view(const gl::RenderTarget& target, const density::Plan* plan) {
    SnapshotView view;
    view.rgba.resize(static_cast<std::size_t>(target.width()) * static_cast<std::size_t>(target.height()) * 4);
    gl::read_pixels(target.framebuffer(), 0, 0, target.width(), target.height(), view.rgba);
    if (plan == nullptr) return view;
    view.columns = plan->columns();
    view.rows = plan->rows();
    view.bin_px = plan->bin_px();
    for (int r = 0; r < plan->rows(); ++r)
        for (int c = 0; c < plan->columns(); ++c) view.level.push_back(static_cast<std::uint8_t>(plan->level_at(c, r)));
    return view;
}

Result<void> write_comparison(const SnapshotView& extrapolated, const SnapshotView& rendered, int width_px, int height_px, const std::filesystem::path& directory) {
    Snapshot s;
    s.width_px = width_px;
    s.height_px = height_px;
    s.views = {extrapolated, rendered};
    const int scale = std::max(2, width_px / 256);
    Canvas canvas = side_by_side(s, 11 * scale);
    canvas.fill(0, height_px, canvas.width(), canvas.height(), {18, 20, 26}, 1);
    canvas.text(3 * scale, height_px + 3 * scale, scale, "EXTRAPOLATED", {225, 228, 235});
    canvas.text(width_px + 3 * scale, height_px + 3 * scale, scale, "REALLY RENDERED", {225, 228, 235});
    return gl::write_png(directory / "frame_extrapolated.png", canvas.image());
}

double psnr_db(const SnapshotView& a, const SnapshotView& b) noexcept {
    double sum = 0;
    std::size_t n = 0;
    for (std::size_t i = 0; i < std::min(a.rgba.size(), b.rgba.size()); ++i) {
        if (i % 4 == 3) continue;
        const double d = a.rgba[i] - b.rgba[i];
        sum += d * d;
        ++n;
    }
    return n == 0 || sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * static_cast<double>(n) / sum);
}

Result<void> write_pictures(const Snapshot& s, const std::filesystem::path& directory) {
    std::error_code ec;
    std::filesystem::create_directories(directory, ec);
    if (ec) return fail("cannot make the directory: " + ec.message(), directory.string(), "choose another with --out");
    Canvas plain = side_by_side(s, 0);
    if (auto r = gl::write_png(directory / "frame.png", plain.image()); !r) return r;
    if (!s.views.empty() && !s.views[0].through_lens.empty()) {
        Snapshot warped = s;
        for (SnapshotView& v : warped.views) v.rgba = v.through_lens;
        if (auto r = gl::write_png(directory / "frame_lens.png", side_by_side(warped, 0).image()); !r) return r;
    }
    const int scale = std::max(2, plain.width() / 512);
    Canvas marked = side_by_side(s, 19 * scale);
    for (std::size_t i = 0; i < s.views.size(); ++i) draw_levels(marked, s, s.views[i], static_cast<int>(i) * s.width_px);
    draw_legend(marked, s, s.height_px);
    return gl::write_png(directory / "frame_levels.png", marked.image());
}

}  // namespace fovea::viewer
