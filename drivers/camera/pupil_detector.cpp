#include "drivers/camera/pupil_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "drivers/camera/edge_model.hpp"
#include "drivers/camera/ellipse_fit.hpp"
#include "drivers/camera/glint_finder.hpp"
#include "drivers/camera/ray_geometry.hpp"

namespace fovea::drivers::camera {

namespace {

constexpr int kCoarseSide = 96;            // the reduced picture's longer side
constexpr double kMinContrast = 12;        // grey levels between pupil and surround; below it there is no pupil
constexpr double kMinAxisRatio = 0.42;     // 65 degrees off the camera's axis
constexpr double kMinQuality = 0.24;       // share of rays that agree times share of the inside that is dark
constexpr int kTrialRays = 24;             // for choosing between the coarse candidates
constexpr std::size_t kMaxCandidates = 12;

struct Preset {
    int rays;
    double step_px;
    int samples;      // random ellipses tried; 0: a trimmed fit of all points
    int rounds;       // of rays from the found ellipse
    int finalists;    // candidates that are worked out in full
    double blur_px;
    double core;      // least share of what lies below the seen edge that is as dark as a pupil
    bool pixels;      // the winner's ellipse is fitted to the pixels along its edge
};

constexpr Preset preset_of(PupilPreset p) noexcept {
    switch (p) {
        case PupilPreset::draft: return {0, 1, 0, 0, 1, 0, 0.85, false};
        case PupilPreset::fast: return {32, 1, 0, 0, 1, 1.0, 0.85, false};
        case PupilPreset::balanced: return {64, 1, 40, 1, 1, 1.0, 0.85, false};
        case PupilPreset::best: return {64, 1, 40, 1, 3, 1.0, 0.9, true};
    }
    return {64, 1, 40, 1, 1, 1.0, 0.85, false};
}

struct Coarse {
    double x = 0, y = 0, radius = 0, inner = 0, outer = 0;
};

// A candidate whose rays agree on an ellipse.
struct Finalist {
    Coarse coarse;
    PupilEllipse rough;
    double score = 0;
};
constexpr std::size_t kMaxFinalists = 3;

const std::vector<Turn> kTrialTurns = turns_of(kTrialRays);
constexpr int kFillSectors = 24;
const std::vector<Turn> kSectorMiddles = turns_of(kFillSectors, 0.5);
// Places inside a unit circle, on four rings.
const std::vector<Turn> kInside = [] {
    std::vector<Turn> all;
    for (int ring = 1; ring <= 4; ++ring)
        for (const Turn& t : turns_of(6 * ring, 0.5 * ring)) all.push_back({0.22 * ring * t.cosine, 0.22 * ring * t.sine});
    return all;
}();

// A small generator of our own: the same picture must give the same answer everywhere.
class Lcg {
public:
    std::uint32_t below(std::uint32_t n) noexcept {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<std::uint32_t>((state_ >> 33) % n);
    }

private:
    std::uint64_t state_ = 0x5eed;
};

}  // namespace

PupilPreset preset_from(const std::string& name) noexcept {
    for (const PupilPreset p : {PupilPreset::draft, PupilPreset::fast, PupilPreset::balanced, PupilPreset::best})
        if (name == to_string(p)) return p;
    return PupilPreset::balanced;
}

const char* to_string(PupilPreset preset) noexcept {
    switch (preset) {
        case PupilPreset::draft: return "draft";
        case PupilPreset::fast: return "fast";
        case PupilPreset::balanced: return "balanced";
        case PupilPreset::best: return "best";
    }
    return "balanced";
}

struct PupilDetector::State {
    PupilSettings settings;
    Preset preset;
    cv::Mat small, sums, blurred, region, smooth;
    std::vector<int> inner_sum, all_sum;            // of one row of the reduced picture
    std::vector<float> outer_scale, response;
    std::vector<EdgePoint> points, inliers, trial;
    EdgeModel edge_model;
    GlintFinder glint_finder;
    std::vector<EdgePoint> winner_edge;   // the rays that agree with it
    std::vector<double> outside, sorted;   // brightness just beyond each point
    cv::Rect roi;          // where `smooth` lies in the picture
    double glint_level = 255;
    std::array<Coarse, kMaxCandidates> candidates;
    std::size_t candidate_count = 0;
    std::vector<Turn> turns;   // of the preset's rays
    std::array<Finalist, kMaxFinalists> finalists;   // best first

    double min_radius(const GreyImage& g) const {
        return settings.min_radius_px > 0 ? settings.min_radius_px : std::min(g.width, g.height) / 24.0;
    }
    double max_radius(const GreyImage& g) const {
        return settings.max_radius_px > 0 ? settings.max_radius_px : std::min(g.width, g.height) / 5.0;
    }

    // For each size, the place where a square is darkest against the frame around it. Which size is the pupil's is
    // settled by their edges: an iris in a white eye is darker against its surround than a pupil in an iris.
    void find_candidates(const cv::Mat& image, double r_min, double r_max) {
        // By a whole number: means of whole squares are quick; what is left over at the far sides is no pupil's place.
        const int by = std::clamp((std::max(image.cols, image.rows) + kCoarseSide - 1) / kCoarseSide, 1, std::min(image.cols, image.rows) / 8);
        const cv::Size size(image.cols / by, image.rows / by);
        cv::resize(image(cv::Rect(0, 0, size.width * by, size.height * by)), small, size, 0, 0, cv::INTER_AREA);
        const double sx = by, sy = by;
        cv::integral(small, sums, CV_32S);
        candidate_count = 0;
        int last_half = 0;
        for (double r = r_min / sx; r <= 1.01 * r_max / sx && candidate_count < kMaxCandidates; r *= 1.3) {
            const int half = std::max(1, static_cast<int>(std::lround(0.8 * r)));   // the square of a disc's area, about
            if (half == last_half) continue;
            if (2 * half + 3 > std::min(small.cols, small.rows)) break;   // nothing of the picture is left around it
            last_half = half;
            const Coarse found = darkest_square(half, std::max(half + 1, static_cast<int>(std::lround(1.6 * r))), sx, sy);
            if (found.radius == 0) continue;
            if (found.outer - found.inner >= kMinContrast) candidates[candidate_count++] = {found.x, found.y, r * sx, found.inner, found.outer};
        }
    }

    // Of all squares of 2 half + 1 pixels the one with the greatest mean outside, in the frame, less 1.5 times the mean
    // inside: dark in itself counts too, a shadow beside a highlight is no pupil. Row by row, without a division or a branch.
    Coarse darkest_square(int half, int frame, double sx, double sy) {
        const int cols = small.cols, rows = small.rows, inner_n = (2 * half + 1) * (2 * half + 1);
        const float inner_scale = 1.5f / static_cast<float>(inner_n);
        const auto n = static_cast<std::size_t>(cols);
        inner_sum.resize(n + 1);
        all_sum.resize(n + 1 + 2 * static_cast<std::size_t>(frame));
        outer_scale.resize(n);
        response.resize(n);
        float best = -1e9f;
        int best_x = 0, best_y = 0, last_height = 0;
        const auto row = [&](int y) {
            if (y < half || y >= rows - half) return;
            const int y0 = std::max(y - frame, 0), y1 = std::min(y + frame + 1, rows), height = y1 - y0;
            const int *low = sums.ptr<int>(y - half), *high = sums.ptr<int>(y + half + 1), *top = sums.ptr<int>(y0), *end = sums.ptr<int>(y1);
            for (int x = 0; x <= cols; ++x) inner_sum[static_cast<std::size_t>(x)] = high[x] - low[x];
            int* all = all_sum.data() + frame;   // beyond the picture's sides nothing is added
            for (int x = 0; x <= cols; ++x) all[x] = end[x] - top[x];
            std::fill(all - frame, all, 0);
            std::fill(all + cols + 1, all + cols + 1 + frame, all[cols]);
            if (height != last_height)
                for (int x = half; x < cols - half; ++x)
                    outer_scale[static_cast<std::size_t>(x)] = 1 / static_cast<float>((std::min(x + frame + 1, cols) - std::max(x - frame, 0)) * height - inner_n);
            last_height = height;
            const int* in = inner_sum.data();
            const float* scale = outer_scale.data();
            float* out = response.data();
            float most = best;
            for (int x = half; x < cols - half; ++x) {
                const int inner = in[x + half + 1] - in[x - half];
                out[x] = static_cast<float>(all[x + frame + 1] - all[x - frame] - inner) * scale[x] - static_cast<float>(inner) * inner_scale;
            }
            for (int x = half; x < cols - half; ++x) most = most > out[x] ? most : out[x];
            if (most <= best) return;
            best = most;
            best_x = static_cast<int>(std::find(out + half, out + cols - half, most) - out);
            best_y = y;
        };
        // The mean over a large square changes slowly: every second to fourth row, then those beside the best one.
        const int stride = std::clamp(half / 2, 1, 4);
        for (int y = half; y < rows - half; y += stride) row(y);
        for (int d = 1 - stride, middle = best_y; d < stride; ++d)
            if (d != 0) row(middle + d);
        if (best == -1e9f) return {};
        const int x0 = std::max(best_x - frame, 0), x1 = std::min(best_x + frame + 1, cols), y0 = std::max(best_y - frame, 0), y1 = std::min(best_y + frame + 1, rows);
        const double inner = box(best_x - half, best_y - half, best_x + half + 1, best_y + half + 1), all = box(x0, y0, x1, y1);
        return {(best_x + 0.5) * sx - 0.5, (best_y + 0.5) * sy - 0.5, 1, inner / inner_n, (all - inner) / ((x1 - x0) * (y1 - y0) - inner_n)};
    }

    // The candidates whose rays agree on an ellipse, the darkest inside of those first. How many there are.
    std::size_t choose(const cv::Mat& image, double r_min, double r_max) {
        const auto wanted = static_cast<std::size_t>(preset.finalists);
        std::size_t count = 0;
        for (std::size_t i = 0; i < candidate_count; ++i) {
            Coarse c = candidates[i];
            prepare_region(image, c);
            if (roi.width < 16 || roi.height < 16 || !centroid(c)) continue;
            PupilEllipse e;
            cast_rays(c.x, c.y, c, nullptr, kTrialRays, 1.0);
            if (!fit_trimmed(e) || !plausible(e, r_min, r_max)) continue;
            const double support = static_cast<double>(select(e, 2.0)) / kTrialRays, dark = fill(e, c);
            // Darkness decides between a pupil and the iris around it, quality between a pupil and a few lashes.
            const double score = std::min(0.6, support * dark) * (255 - c.inner) * (255 - c.inner);
            if (!(score > 0)) continue;
            std::size_t at = count;
            while (at > 0 && finalists[at - 1].score < score) --at;
            if (at >= wanted) continue;
            count = std::min(count + 1, wanted);
            for (std::size_t k = count - 1; k > at; --k) finalists[k] = finalists[k - 1];
            finalists[at] = {c, e, score};
        }
        return count;
    }

    // Share of the ellipse's inside that is as dark as a pupil; glints do not count.
    double fill(const PupilEllipse& e, const Coarse& c) const {
        const double t = c.inner + std::max(0.3 * (c.outer - c.inner), 10.0);
        const double ca = std::cos(e.angle_rad), sa = std::sin(e.angle_rad);
        int dark = 0, n = 0;
        for (const Turn& place : kInside) {
            const double u = e.a * place.cosine, v = e.b * place.sine, value = level(e.x + u * ca - v * sa, e.y + u * sa + v * ca);
            if (value < 0 || value >= glint_level) continue;
            ++n;
            dark += value < t ? 1 : 0;
        }
        return n > 0 ? static_cast<double>(dark) / n : 0;
    }

    // Much brighter than what surrounds a pupil, here or close by: a lamp's reflection, however blurred.
    [[nodiscard]] bool beside_glint(double x, double y, const Coarse& c) const {
        const double bright = c.outer + 0.5 * (c.outer - c.inner);
        for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {3.0, 0.0}, {-3.0, 0.0}, {0.0, 3.0}, {0.0, -3.0}})
            if (level(x + dx, y + dy) >= bright) return true;
        return false;
    }

    // The same over the middle of the ellipse, but only below those parts of the edge that were seen (`inliers`): what a
    // lid covers says nothing, and between the lashes of a closed eye there is skin.
    double core_fill(const PupilEllipse& e, const Coarse& c) const {
        std::array<bool, kFillSectors> seen{};
        const double ca = std::cos(e.angle_rad), sa = std::sin(e.angle_rad);
        for (const auto& p : inliers) {
            const double dx = p.x - e.x, dy = p.y - e.y;
            const double turn = std::atan2((-dx * sa + dy * ca) / e.b, (dx * ca + dy * sa) / e.a) / (2 * std::numbers::pi);
            seen[static_cast<std::size_t>((turn + 1) * kFillSectors) % kFillSectors] = true;
        }
        const double t = c.inner + std::max(0.3 * (c.outer - c.inner), 10.0);
        int dark = 0, n = 0;
        for (int ring = 1; ring <= 3; ++ring)
            for (std::size_t k = 0; k < kFillSectors; ++k) {
                if (!seen[k]) continue;
                const double u = 0.24 * ring * e.a * kSectorMiddles[k].cosine, v = 0.24 * ring * e.b * kSectorMiddles[k].sine;
                const double x = e.x + u * ca - v * sa, y = e.y + u * sa + v * ca, value = level(x, y);
                if (value < 0 || beside_glint(x, y, c)) continue;
                ++n;
                dark += value < t ? 1 : 0;
            }
        return n > 0 ? static_cast<double>(dark) / n : 0;
    }

    double box(int x0, int y0, int x1, int y1) const {
        return sums.at<int>(y1, x1) - sums.at<int>(y0, x1) - sums.at<int>(y1, x0) + sums.at<int>(y0, x0);
    }

    void prepare_region(const cv::Mat& image, const Coarse& c) {
        const int half = static_cast<int>(std::ceil(2.6 * c.radius)) + 4;
        roi = cv::Rect(static_cast<int>(c.x) - half, static_cast<int>(c.y) - half, 2 * half + 1, 2 * half + 1) & cv::Rect(0, 0, image.cols, image.rows);
        region = image(roi);
        smooth = preset.blur_px > 0 ? blurred(roi) : region;
        glint_level = std::max(200.0, c.outer + 0.55 * (255 - c.outer));
    }

    // Brightness between pixels, of 256ths of a grey level, at 65536ths of a pixel from the region's corner; negative
    // outside. In whole numbers: the rays read some thousand places of each picture.
    [[nodiscard]] int level_at(int x16, int y16) const {
        const int ix = x16 >> 16, iy = y16 >> 16;
        if (ix < 0 || iy < 0 || ix + 1 >= smooth.cols || iy + 1 >= smooth.rows) return -1;
        const int fx = x16 >> 5 & 2047, fy = y16 >> 5 & 2047;
        const std::uint8_t *p = smooth.data + static_cast<std::size_t>(iy) * smooth.step[0] + ix, *q = p + smooth.step[0];
        return ((p[0] * (2048 - fx) + p[1] * fx) * (2048 - fy) + (q[0] * (2048 - fx) + q[1] * fx) * fy) >> 14;
    }
    static int fixed(double px) { return static_cast<int>((std::clamp(px, -8000.0, 8000.0) + 8192) * 65536 + 0.5) - (8192 << 16); }
    // In coordinates of the whole picture, grey levels.
    [[nodiscard]] double level(double x, double y) const {
        const int v = level_at(fixed(x - roi.x), fixed(y - roi.y));
        return v < 0 ? -1 : v / 256.0;
    }

    // Centre and radius of what is darker than half way; also sharpens the two levels.
    bool centroid(Coarse& c) const {
        const double t = c.inner + 0.45 * (c.outer - c.inner), reach = 1.7 * c.radius;
        const int below = static_cast<int>(std::ceil(t)), glint = static_cast<int>(std::ceil(glint_level));
        const int y0 = std::max(roi.y, static_cast<int>(c.y - reach)), y1 = std::min(roi.y + roi.height, static_cast<int>(c.y + reach) + 1);
        double n = 0, sx = 0, sy = 0, dark = 0, light = 0, light_n = 0;
        for (int y = y0; y < y1; ++y) {
            const double dy = y - c.y, w = std::sqrt(std::max(0.0, reach * reach - dy * dy));
            const int x0 = std::max(roi.x, static_cast<int>(c.x - w) + 1), x1 = std::min(roi.x + roi.width, static_cast<int>(c.x + w) + 1);
            const std::uint8_t* row = smooth.ptr(y - roi.y) - roi.x;
            int row_n = 0, row_x = 0, row_dark = 0, row_light = 0, row_light_n = 0;
            for (int x = x0; x < x1; ++x) {
                const int v = row[x], is_dark = v < below ? 1 : 0, is_light = v >= below && v < glint ? 1 : 0;
                row_n += is_dark;
                row_x += is_dark * x;
                row_dark += is_dark * v;
                row_light_n += is_light;
                row_light += is_light * v;
            }
            n += row_n, sx += row_x, sy += static_cast<double>(row_n) * y, dark += row_dark, light += row_light, light_n += row_light_n;
        }
        if (n < 9 || light_n < 9) return false;
        c = {sx / n, sy / n, std::sqrt(n / std::numbers::pi), dark / n, light / light_n};
        return c.outer - c.inner >= kMinContrast;
    }

    // The steepest rise of brightness on each ray between near and far; `guess` narrows the search to its own edge.
    void cast_rays(double cx, double cy, const Coarse& c, const PupilEllipse* guess, int rays, double step_px) {
        points.clear();
        outside.clear();
        const auto in_256ths = [](double grey) { return static_cast<int>(256 * grey); };
        const double contrast = c.outer - c.inner;
        const int least = in_256ths(0.3 * contrast), cap = in_256ths(c.inner + 1.25 * contrast), glint = in_256ths(glint_level);
        const int still_dark = in_256ths(c.inner + 0.6 * contrast);
        constexpr int kMaxSteps = 1024;
        std::array<int, kMaxSteps> line;
        const std::optional<RadiusOf> guessed = guess != nullptr ? std::optional<RadiusOf>(*guess) : std::nullopt;
        // The difference spans two pixels each way whatever the step.
        const int span = static_cast<int>(std::lround(2 / step_px));
        for (const auto& [ca, sa] : rays == kTrialRays ? kTrialTurns : turns) {
            const double expected = guessed ? guessed->towards(ca, sa) : c.radius;
            const double from = std::max(1.0, (guessed ? 0.7 : 0.35) * expected), to = (guessed ? 1.4 : 2.0) * expected + 2;
            const int steps = std::clamp(static_cast<int>((to - from + 4) / step_px) + 1, 0, kMaxSteps);
            int x16 = fixed(cx + (from - 2) * ca - roi.x), y16 = fixed(cy + (from - 2) * sa - roi.y);
            const int dx16 = fixed(step_px * ca), dy16 = fixed(step_px * sa);
            int n = 0, last = in_256ths(c.inner);
            for (; n < steps; ++n, x16 += dx16, y16 += dy16) {
                int v = level_at(x16, y16);
                if (v < 0) break;
                if (v >= glint) v = last;   // a lamp's reflection says nothing about what lies under it
                last = std::min(v, cap);
                line[static_cast<std::size_t>(n)] = last;
            }
            const auto at = [&](int i) { return line[static_cast<std::size_t>(i)]; };
            int best = -1, steepest = least;
            for (int i = span; i + span < n; ++i) {
                // The level just inside must still be the pupil's: the iris's own edge is a rise too.
                if (at(i - span) > still_dark) continue;
                const int rise = at(i + span) - at(i - span);
                if (rise > steepest) { steepest = rise; best = i; }
            }
            if (best <= span || best + span + 1 >= n) continue;
            const int before = at(best - 1 + span) - at(best - 1 - span), after = at(best + 1 + span) - at(best + 1 - span);
            const int bend = before - 2 * steepest + after;
            const double shift = bend < 0 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : 0;
            const double r = from - 2 + (best + shift) * step_px;
            const double beyond = level(cx + (r + 3) * ca, cy + (r + 3) * sa);
            if (beyond < 0) continue;
            points.push_back({cx + r * ca, cy + r * sa});
            outside.push_back(beyond);
        }
        drop_other_edges(c);
    }

    // Beyond a pupil's edge lies the iris, all round alike. An edge with something else beyond it is a lid's, a lash's
    // or a glint's.
    void drop_other_edges(const Coarse& c) {
        if (points.size() < 8) return;
        sorted = outside;
        const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
        std::nth_element(sorted.begin(), middle, sorted.end());
        const double usual = *middle, tolerance = 0.4 * std::max(0.0, usual - c.inner) + 6;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < points.size(); ++i)
            if (std::abs(outside[i] - usual) <= tolerance) points[kept++] = points[i];
        points.resize(kept);
    }

    static bool fit(const std::vector<EdgePoint>& from, PupilEllipse& e) {
        const auto found = fit_ellipse(from);
        if (found) e = *found;
        return found.has_value();
    }

    static bool plausible(const PupilEllipse& e, double r_min, double r_max) {
        return e.b >= kMinAxisRatio * e.a && e.a <= 1.4 * r_max && std::sqrt(e.a * e.b) >= 0.7 * r_min;
    }

    std::size_t select(const PupilEllipse& e, double within) {
        inliers.clear();
        const EllipseRuler ruler(e);
        for (const auto& p : points)
            if (ruler.distance(p.x, p.y) <= within) inliers.push_back(p);
        return inliers.size();
    }

    bool fit_trimmed(PupilEllipse& e) {
        if (points.size() < 8 || !fit(points, e)) return false;
        for (const double within : {4.0, 2.0})
            if (select(e, within) >= 8) fit(inliers, e);
        return true;
    }

    bool fit_robustly(double r_min, double r_max, int samples, PupilEllipse& best) {
        if (points.size() < 8) return false;
        if (samples == 0) return fit_trimmed(best) && plausible(best, r_min, r_max);
        Lcg random;
        std::size_t most = 0;
        const auto n = static_cast<std::uint32_t>(points.size());
        for (int i = 0; i < samples; ++i) {
            trial.clear();
            // One point from each sixth of the circle: samples crowded on one side fit anything.
            for (std::uint32_t k = 0; k < 6; ++k) {
                const std::uint32_t low = k * n / 6, high = (k + 1) * n / 6;
                trial.push_back(points[low + random.below(high - low)]);
            }
            PupilEllipse e;
            if (!fit(trial, e) || !plausible(e, r_min, r_max)) continue;
            const std::size_t count = select(e, 1.5);
            if (count > most) { most = count; best = e; }
            // Of six points all six lie on it with the sixth power of the share that does: enough tries for 999 of 1000.
            const double share = static_cast<double>(most) / n, all_six = std::pow(share, 6);
            if (all_six > 0.5 && i + 1 >= std::log(1e-3) / std::log(1 - std::min(all_six, 0.999))) break;
        }
        if (most < 6) return false;
        for (int i = 0; i < 2; ++i)
            if (select(best, 1.5) >= 6) {
                PupilEllipse e;
                if (fit(inliers, e) && plausible(e, r_min, r_max)) best = e;
            }
        return true;
    }

    void find_glints(const PupilEllipse& e, PupilResult& out) {
        const GreyImage around{region.data, region.cols, region.rows, static_cast<std::ptrdiff_t>(region.step[0])};
        const double pupil_area = std::numbers::pi * e.a * e.b;
        std::array<double, 2> nearest = {1e9, 1e9};
        for (Glint g : glint_finder.find(around, std::floor(glint_level) + 1)) {   // brighter than the level
            if (g.area_px < 2 || g.area_px > 0.4 * pupil_area) continue;
            g.x += roi.x;
            g.y += roi.y;
            const double d = std::hypot(g.x - e.x, g.y - e.y);
            if (d > 2.2 * e.a) continue;
            const int slot = d < nearest[0] ? 0 : d < nearest[1] ? 1 : 2;
            if (slot == 0) { nearest[1] = nearest[0]; out.glints[1] = out.glints[0]; }
            if (slot < 2) {
                nearest[static_cast<std::size_t>(slot)] = d;
                out.glints[static_cast<std::size_t>(slot)] = g;
                out.glint_count = std::min(2, out.glint_count + 1);
            }
        }
    }

    PupilResult detect(const GreyImage& g) {
        PupilResult out;
        if (g.pixels == nullptr || g.width < 32 || g.height < 32 || g.width > kMaxImageSide || g.height > kMaxImageSide) return out;
        const cv::Mat image(g.height, g.width, CV_8UC1, const_cast<std::uint8_t*>(g.pixels), static_cast<std::size_t>(g.stride));
        const double r_min = min_radius(g), r_max = std::max(max_radius(g), r_min * 1.01);
        find_candidates(image, r_min, r_max);
        // Once, whole: the candidates' regions overlap.
        if (preset.blur_px > 0 && candidate_count > 0) cv::GaussianBlur(image, blurred, {}, preset.blur_px);
        const std::size_t count = choose(image, r_min, r_max);
        double best = 0;
        EdgeFit winner;
        double winner_glint_level = 255;
        for (std::size_t i = 0; i < count; ++i) {
            const Finalist f = finalists[i];
            prepare_region(image, f.coarse);
            PupilEllipse e = f.rough;
            double quality = 0;
            if (!work_out(f.coarse, r_min, r_max, e, quality)) continue;
            // All that come so far look like pupils: the darkest is, unless hardly anything of its edge is seen.
            const double score = std::min(0.35, quality) * (255 - f.coarse.inner) * (255 - f.coarse.inner);
            if (score <= best) continue;
            best = score;
            out.found = true;
            out.ellipse = e;
            winner_edge = inliers;
            winner_glint_level = glint_level;
            winner = {.ellipse = e, .inside = f.coarse.inner, .outside = f.coarse.outer};
            out.confidence = std::min(1.0, quality * 1.1) * std::min(1.0, (f.coarse.outer - f.coarse.inner) / 40);
            out.glint_count = 0;
            find_glints(e, out);
        }
        if (out.found && preset.pixels && edge_model.refine(g, winner_glint_level, winner_edge, winner) && plausible(winner.ellipse, r_min, r_max))
            out.ellipse = winner.ellipse;
        return out;
    }

    // From a rough ellipse to the pupil's, if it is one.
    bool work_out(const Coarse& c, double r_min, double r_max, PupilEllipse& e, double& quality) {
        double support = 0.7;   // draft: the candidate's own ellipse, with few rays
        const PupilEllipse rough = e;
        if (preset.rays == 0) {
            cast_rays(rough.x, rough.y, c, &rough, kTrialRays, 1.0);
            (void)select(e, 2.0);
        } else {
            cast_rays(rough.x, rough.y, c, &rough, preset.rays, preset.step_px);
            if (!fit_robustly(r_min, r_max, preset.samples, e)) return false;
            for (int round = 0; round < preset.rounds; ++round) {
                // Near the edge there is little left to go wrong: a quarter of the samples will do.
                const PupilEllipse before = e;
                cast_rays(e.x, e.y, c, &before, preset.rays, preset.step_px);
                if (!fit_robustly(r_min, r_max, preset.samples / 4, e)) e = before;
            }
            support = static_cast<double>(select(e, 1.5)) / preset.rays;
        }
        quality = support * fill(e, c);
        return quality >= kMinQuality && core_fill(e, c) >= preset.core && plausible(e, r_min, r_max);
    }
};

PupilDetector::PupilDetector(const PupilSettings& settings) : state_{std::make_unique<State>()} {
    state_->settings = settings;
    state_->preset = preset_of(settings.preset);
    state_->turns = turns_of(state_->preset.rays);
    cv::setNumThreads(1);   // a frame is too small to share, and the daemon's other threads need their cores
}
PupilDetector::PupilDetector(PupilDetector&&) noexcept = default;
PupilDetector& PupilDetector::operator=(PupilDetector&&) noexcept = default;
PupilDetector::~PupilDetector() = default;

PupilResult PupilDetector::detect(const GreyImage& image) noexcept {
    try {
        return state_->detect(image);
    } catch (const std::exception&) {   // OpenCV's, for example when memory runs out: no pupil in this frame
        return {};
    }
}

}  // namespace fovea::drivers::camera
