#include "render/extrapolation/path_bend.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace fovea::render::extrapolation {

namespace {

constexpr int kTerms = 6;   // 1, x, y, xx, xy, yy

// Solves m * r = rhs for two right-hand sides; m is symmetric, and made positive by its ridge. False: it says nothing.
bool solve(double (&m)[kTerms][kTerms], double (&rhs)[2][kTerms]) noexcept {
    for (int i = 0; i < kTerms; ++i) {
        if (!(m[i][i] > 1e-12)) return false;
        for (int j = i + 1; j < kTerms; ++j) {
            const double f = m[j][i] / m[i][i];
            for (int k = i; k < kTerms; ++k) m[j][k] -= f * m[i][k];
            for (auto& r : rhs) r[j] -= f * r[i];
        }
    }
    for (auto& r : rhs)
        for (int i = kTerms - 1; i >= 0; --i) {
            for (int k = i + 1; k < kTerms; ++k) r[i] -= m[i][k] * r[k];
            r[i] /= m[i][i];
        }
    return true;
}

}  // namespace

PathBend fit_path_bend(const float* motion_px, int width, int height, float reach_px) noexcept {
    constexpr int kSamples = 32, kRounds = 5;
    constexpr double kScale_px = 0.5;   // deviations of this size count half
    const double size = 0.5 * std::max(width, height), mid_x = 0.5 * width, mid_y = 0.5 * height;   // -1 to 1 over the longer edge
    double best[2][kTerms] = {};
    for (int round = 0; round < kRounds; ++round) {
        double m[kTerms][kTerms] = {}, rhs[2][kTerms] = {};
        for (int j = 0; j < kSamples; ++j)
            for (int i = 0; i < kSamples; ++i) {
                const int cx = (2 * i + 1) * width / (2 * kSamples), cy = (2 * j + 1) * height / (2 * kSamples);
                const float* at = motion_px + 2 * (static_cast<std::ptrdiff_t>(cy) * width + cx);
                if (!(std::fabs(at[0]) <= reach_px && std::fabs(at[1]) <= reach_px)) continue;
                const double x = (cx - mid_x) / size, y = (cy - mid_y) / size;
                const double e[kTerms] = {1, x, y, x * x, x * y, y * y}, is[2] = {static_cast<double>(at[0]), static_cast<double>(at[1])};
                double weight = 1;
                if (round > 0) {
                    double off[2] = {is[0], is[1]};
                    for (int k = 0; k < kTerms; ++k)
                        for (int c = 0; c < 2; ++c) off[c] -= best[c][k] * e[k];
                    weight = 1 / (1 + (off[0] * off[0] + off[1] * off[1]) / (kScale_px * kScale_px));
                }
                for (int r = 0; r < kTerms; ++r) {
                    for (int c = 0; c < kTerms; ++c) m[r][c] += weight * e[r] * e[c];
                    for (int c = 0; c < 2; ++c) rhs[c][r] += weight * e[r] * is[c];
                }
            }
        // A ridge keeps a picture of one row or column solvable, and bends nothing there.
        double trace = 0;
        for (int r = 0; r < kTerms; ++r) trace += m[r][r];
        for (int r = 0; r < kTerms; ++r) m[r][r] += 1e-6 * trace;
        if (!solve(m, rhs)) return {};
        for (int c = 0; c < 2; ++c) std::copy_n(rhs[c], kTerms, best[c]);
    }
    PathBend bend;
    for (int c = 0; c < 2; ++c) {
        const double* p = best[c];
        const double second[3] = {p[3] / (size * size), p[4] / (size * size), p[5] / (size * size)};
        const double gradient[2][3] = {{p[1] / size - 2 * second[0] * mid_x - second[1] * mid_y, 2 * second[0], second[1]},
                                       {p[2] / size - second[1] * mid_x - 2 * second[2] * mid_y, second[1], 2 * second[2]}};
        for (int axis = 0; axis < 2; ++axis)
            for (int k = 0; k < 3; ++k) (c == 0 ? bend.u : bend.v)[axis][k] = static_cast<float>(gradient[axis][k]);
    }
    return bend;
}

}  // namespace fovea::render::extrapolation
