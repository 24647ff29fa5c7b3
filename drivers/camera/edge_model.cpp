#include "drivers/camera/edge_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fovea::drivers::camera {

namespace {

constexpr std::size_t kSectors = 32;
constexpr std::size_t kMostPixels = 2000;   // of a longer edge every second or third does: the time stays in bounds
constexpr int kRounds = 10;
constexpr double kTukeyReach = 4;           // in spreads; about 91 % efficient where the noise is normal
constexpr double kSpreadOfMad = 1.4826;     // a normal distribution's standard deviation over its median deviation
constexpr double kLeastSpread = 1.0;        // grey levels: rounding, and the model's own roughness
constexpr double kLeastRise = 4;            // grey levels across the edge
constexpr double kStillPx = 0.002;          // a step below this ends the fit
constexpr double kLeastEdgePx = 0.3;        // a pixel's own width: 1/sqrt(12)
constexpr double kMostEdgePx = 6;

// Unknowns, lengths in units of the starting ellipse's mean radius.
enum Unknown { kX, kY, kXX, kXY, kYY, kEdge, kInside, kOutside, kSlopeX, kSlopeY, kUnknowns };
using Vector = std::array<double, kUnknowns>;
using Matrix = std::array<Vector, kUnknowns>;

// Solves the symmetric system in place (Cholesky); false if it has no single answer. Only j <= i of `m` is read.
bool solve(Matrix& m, Vector& v) {
    for (std::size_t i = 0; i < kUnknowns; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = m[i][j];
            for (std::size_t k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
            if (i != j) m[i][j] = sum / m[j][j];
            else if (!(sum > 1e-12)) return false;
            else m[i][i] = std::sqrt(sum);
        }
        for (std::size_t k = 0; k < i; ++k) v[i] -= m[i][k] * v[k];
        v[i] /= m[i][i];
    }
    for (std::size_t i = kUnknowns; i-- > 0;) {
        for (std::size_t k = i + 1; k < kUnknowns; ++k) v[i] -= m[k][i] * v[k];
        v[i] /= m[i][i];
    }
    return true;
}

// Which part of the way round a direction lies in. The parts are about alike in size: |x| + |y| = 1 in equal lengths.
std::size_t sector(double dx, double dy) {
    const double sum = std::abs(dx) + std::abs(dy), along = sum > 0 ? dx / sum : 0;
    const double turn = dy >= 0 ? 1 - along : 3 + along;   // 0 to 4
    return std::min(kSectors - 1, static_cast<std::size_t>(turn / 4 * static_cast<double>(kSectors)));
}

// The normal distribution's share below z, from its density there; to 1e-5 (Abramowitz and Stegun, 26.2.16).
double below(double z, double density) {
    const double t = 1 / (1 + 0.33267 * std::abs(z)), beyond = density * t * (0.4361836 + t * (-0.1201676 + t * 0.9372980));
    return z > 0 ? 1 - beyond : beyond;
}

struct Model {
    Vector p{};
    double cx, cy, unit;   // origin of the coordinates in the picture; pixels

    [[nodiscard]] double least_eigenvalue() const {
        return (p[kXX] + p[kYY]) / 2 - std::hypot((p[kXX] - p[kYY]) / 2, p[kXY]);
    }
    // What the picture should be at a place, and how that changes with each unknown. `distance`: from the edge, pixels.
    double at(double x, double y, Vector& slope, double& distance) const {
        const double u = (x - cx) / unit, v = (y - cy) / unit, dx = u - p[kX], dy = v - p[kY];
        const double mx = p[kXX] * dx + p[kXY] * dy, my = p[kXY] * dx + p[kYY] * dy;
        const double r = std::sqrt(std::max(1e-12, mx * dx + my * dy)), gradient = std::max(1e-9, std::sqrt(mx * mx + my * my) / r);
        const double d = (r - 1) / gradient, z = d / p[kEdge];
        const double outer = p[kOutside] + p[kSlopeX] * u + p[kSlopeY] * v, rise = outer - p[kInside];
        const double normal = std::exp(-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2, share = below(z, normal);
        const double bell = normal / p[kEdge];
        const double by_r = rise * bell / gradient / r;
        slope = {-by_r * mx, -by_r * my, by_r * dx * dx / 2, by_r * dx * dy, by_r * dy * dy / 2,
                 -rise * bell * z, 1 - share, share, share * u, share * v};
        distance = d * unit;
        return p[kInside] + rise * share;
    }
    [[nodiscard]] PupilEllipse ellipse() const {
        const double mean = (p[kXX] + p[kYY]) / 2, half = std::hypot((p[kXX] - p[kYY]) / 2, p[kXY]);
        // The long axis lies along the eigenvector of the smaller eigenvalue.
        const double turn = half > 1e-12 ? 0.5 * std::atan2(-2 * p[kXY], p[kYY] - p[kXX]) : 0;
        return {cx + p[kX] * unit, cy + p[kY] * unit, unit / std::sqrt(mean - half), unit / std::sqrt(mean + half), turn};
    }
};

Model start_from(const EdgeFit& fit) {
    const PupilEllipse& e = fit.ellipse;
    Model m;
    m.cx = e.x;
    m.cy = e.y;
    m.unit = std::sqrt(e.a * e.b);
    const double c = std::cos(e.angle_rad), s = std::sin(e.angle_rad), a2 = m.unit * m.unit / (e.a * e.a), b2 = m.unit * m.unit / (e.b * e.b);
    m.p[kXX] = c * c * a2 + s * s * b2;
    m.p[kXY] = c * s * (a2 - b2);
    m.p[kYY] = s * s * a2 + c * c * b2;
    m.p[kEdge] = 1.0 / m.unit;
    m.p[kInside] = fit.inside;
    m.p[kOutside] = fit.outside;
    return m;
}

}  // namespace

bool EdgeModel::refine(const GreyImage& image, double glint_level, std::span<const EdgePoint> seen, EdgeFit& fit) {
    const PupilEllipse start = fit.ellipse;
    if (!(start.b > 2) || !(start.a < kMaxImageSide) || !(fit.outside > fit.inside)) return false;
    Model model = start_from(fit);
    const double reach_px = std::clamp(0.18 * model.unit, 4.0, 5.0);
    band_.clear();
    std::array<bool, kSectors> open{};
    for (const EdgePoint& p : seen) open[sector(p.x - start.x, p.y - start.y)] = true;
    const int x0 = std::max(0, static_cast<int>(start.x - start.a - reach_px)), x1 = std::min(image.width - 1, static_cast<int>(start.x + start.a + reach_px) + 1);
    const int y0 = std::max(0, static_cast<int>(start.y - start.a - reach_px)), y1 = std::min(image.height - 1, static_cast<int>(start.y + start.a + reach_px) + 1);
    Vector slope;
    double distance = 0;
    for (int y = y0; y <= y1; ++y) {
        const std::uint8_t* row = image.pixels + y * image.stride;
        for (int x = x0; x <= x1; ++x) {
            const double dx = (x - start.x) / model.unit, dy = (y - start.y) / model.unit;
            const double mx = model.p[kXX] * dx + model.p[kXY] * dy, my = model.p[kXY] * dx + model.p[kYY] * dy, r2 = mx * dx + my * dy;
            // |r - 1| / gradient <= reach, without roots where it is plainly not so
            const double g2 = mx * mx + my * my, reach = reach_px / model.unit;
            if ((r2 - 1) * (r2 - 1) > 9 * reach * reach * g2 || row[x] >= glint_level) continue;
            const double r = std::sqrt(r2);
            if (std::abs(r - 1) * r > reach * std::sqrt(g2) || !open[sector(dx, dy)]) continue;
            band_.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(row[x])});
        }
    }
    if (band_.size() < 40) return false;
    if (const std::size_t each = (band_.size() + kMostPixels - 1) / kMostPixels; each > 1) {
        for (std::size_t i = 0; i * each < band_.size(); ++i) band_[i] = band_[i * each];
        band_.resize((band_.size() + each - 1) / each);
    }

    double tukey = 0.5 * (fit.outside - fit.inside), spread = 0, explained = 0;
    for (int round = 0; round < kRounds; ++round) {
        Matrix normal{};
        Vector right{};
        std::array<int, 256> deviations{};
        double weights = 0;
        int counted = 0;
        for (const Pixel& pixel : band_) {
            const double residual = pixel.value - model.at(pixel.x, pixel.y, slope, distance), size = std::abs(residual);
            if (size >= tukey) continue;
            ++deviations[static_cast<std::size_t>(std::min(255.0, 8 * size))];   // an eighth of a grey level each; the last is all above 31
            ++counted;
            const double t = residual / tukey, weight = (1 - t * t) * (1 - t * t);
            weights += weight;
            for (std::size_t i = 0; i < kUnknowns; ++i) {
                const double w = weight * slope[i];
                right[i] += w * residual;
                for (std::size_t j = 0; j <= i; ++j) normal[i][j] += w * slope[j];
            }
        }
        if (counted < 30) return false;
        explained = weights / static_cast<double>(band_.size());
        int below = 0;
        std::size_t middle = 0;
        while (middle < 255 && (below += deviations[middle]) * 2 < counted) ++middle;
        spread = std::max(kLeastSpread, kSpreadOfMad * (static_cast<double>(middle) + 0.5) / 8);
        for (std::size_t i = 0; i < kUnknowns; ++i) normal[i][i] += 1e-4 * normal[i][i] + 1e-9;
        if (!solve(normal, right)) return false;
        // No unknown may run away in one step.
        const double most = std::max({std::abs(right[kX]), std::abs(right[kY]), std::abs(right[kXX]) / 2, std::abs(right[kYY]) / 2, std::abs(right[kXY]) / 2});
        const double brake = std::min(1.0, 1.5 / model.unit / std::max(most, 1e-12));
        for (std::size_t i = 0; i < kUnknowns; ++i) model.p[i] += brake * right[i];
        model.p[kEdge] = std::clamp(model.p[kEdge], kLeastEdgePx / model.unit, kMostEdgePx / model.unit);
        if (!(model.least_eigenvalue() > 0.05) || !std::isfinite(model.p[kX]) || !std::isfinite(model.p[kY])) return false;
        const double narrower = std::max(kTukeyReach * spread, 0.6 * tukey);
        const bool settled = narrower > 0.98 * tukey;
        tukey = std::min(tukey, narrower);
        if (settled && most * model.unit < kStillPx) break;
    }
    const PupilEllipse e = model.ellipse();
    const bool sane = std::isfinite(e.a) && std::isfinite(e.b) && std::hypot(e.x - start.x, e.y - start.y) <= start.b / 3 && e.a <= 1.3 * start.a &&
                      e.b >= 0.7 * start.b && model.p[kOutside] - model.p[kInside] >= std::max(kLeastRise, 2 * spread);
    if (!sane) return false;
    fit = {e, model.p[kInside], model.p[kOutside], model.p[kEdge] * model.unit, spread, explained};
    return true;
}

}  // namespace fovea::drivers::camera
