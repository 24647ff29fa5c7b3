#include "drivers/synthetic/eye_image.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace fovea::drivers::synthetic {

namespace {

// About the signed distance in pixels from the ellipse, negative inside.
double ellipse_distance(double x, double y, double cx, double cy, double a, double b, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    const double u = ((x - cx) * c + (y - cy) * s) / a, v = (-(x - cx) * s + (y - cy) * c) / b;
    const double r = std::hypot(u, v);
    if (r < 1e-9) return -std::min(a, b);
    const double slope = std::hypot(u / a, v / b) / r;
    return (r - 1) / slope;
}

double coverage(double distance) { return std::clamp(0.5 - distance, 0.0, 1.0); }

void mix(double& level, double with, double share) { level += (with - level) * share; }

void blur(std::vector<double>& image, int w, int h, double sigma) {
    const int radius = static_cast<int>(std::ceil(3 * sigma));
    std::vector<double> kernel(static_cast<std::size_t>(2 * radius + 1));
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += kernel[static_cast<std::size_t>(i + radius)] = std::exp(-0.5 * i * i / (sigma * sigma));
    std::vector<double> out(image.size());
    for (int pass = 0; pass < 2; ++pass) {
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                double v = 0;
                for (int i = -radius; i <= radius; ++i) {
                    const int xx = pass == 0 ? std::clamp(x + i, 0, w - 1) : x, yy = pass == 0 ? y : std::clamp(y + i, 0, h - 1);
                    v += kernel[static_cast<std::size_t>(i + radius)] * image[static_cast<std::size_t>(yy * w + xx)];
                }
                out[static_cast<std::size_t>(y * w + x)] = v / sum;
            }
        image.swap(out);
    }
}

}  // namespace

std::vector<std::uint8_t> render_eye(const EyeImageScene& s) {
    const int w = s.width, h = s.height;
    std::vector<double> image(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
    const double iris_a = s.pupil_a * s.iris_scale, iris_b = s.pupil_b * s.iris_scale;
    const double eye_rx = iris_a * 2.2, eye_ry = iris_a * 1.25;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            double level = s.skin_level;
            mix(level, s.sclera_level, coverage(ellipse_distance(x, y, w / 2.0, h / 2.0, eye_rx, eye_ry, 0)));
            mix(level, s.iris_level, coverage(ellipse_distance(x, y, s.pupil_x, s.pupil_y, iris_a, iris_b, s.pupil_angle_rad)));
            mix(level, s.pupil_level, coverage(ellipse_distance(x, y, s.pupil_x, s.pupil_y, s.pupil_a, s.pupil_b, s.pupil_angle_rad)));
            image[static_cast<std::size_t>(y * w + x)] = level;
        }
    const double glint_r = std::max(1.5, 0.13 * s.pupil_a);
    for (int g = 0; g < std::min(s.glints, 2); ++g) {
        const double gx = s.pupil_x + (g == 0 ? 1 : -1) * s.glint_offset * s.pupil_a, gy = s.pupil_y - 0.3 * s.pupil_b;
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x)
                mix(image[static_cast<std::size_t>(y * w + x)], 255, coverage(std::hypot(x - gx, y - gy) - glint_r));
    }
    // A lid's edge is an arc that sags by a tenth of the eye's width towards the corners.
    const auto arc = [&](double x) { return 0.1 * eye_rx * std::pow((x - w / 2.0) / eye_rx, 2); };
    const double upper_y = s.pupil_y - iris_b + 2 * iris_b * s.upper_lid, lower_y = s.pupil_y + iris_b - 2 * iris_b * s.lower_lid;
    for (int y = 0; y < h && (s.upper_lid > 0 || s.lower_lid > 0); ++y)
        for (int x = 0; x < w; ++x) {
            double& level = image[static_cast<std::size_t>(y * w + x)];
            if (s.upper_lid > 0) mix(level, s.skin_level, coverage(y - (upper_y + arc(x))));
            if (s.lower_lid > 0) mix(level, s.skin_level, coverage((lower_y - arc(x)) - y));
        }
    if (s.lashes > 0) {
        std::mt19937_64 rng(s.seed * 2 + 1);
        std::uniform_real_distribution<double> unit(0, 1);
        for (int i = 0; i < s.lashes; ++i) {
            const double x0 = w / 2.0 + (unit(rng) - 0.5) * 2 * iris_a * 1.3, y0 = upper_y + arc(x0);
            const double length = iris_b * (0.5 + 0.6 * unit(rng)), lean = (unit(rng) - 0.5) * 1.2, thick = 0.6 + 0.02 * s.pupil_a;
            for (double t = 0; t < 1; t += 0.5 / length) {
                const double px = x0 + lean * length * t * t, py = y0 + length * t, radius = thick * (1.2 - t);
                for (int y = static_cast<int>(py) - 3; y <= static_cast<int>(py) + 3; ++y)
                    for (int x = static_cast<int>(px) - 3; x <= static_cast<int>(px) + 3; ++x)
                        if (x >= 0 && y >= 0 && x < w && y < h)
                            mix(image[static_cast<std::size_t>(y * w + x)], 45, 0.8 * coverage(std::hypot(x - px, y - py) - radius));
            }
        }
    }
    if (s.shade != 0)
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) image[static_cast<std::size_t>(y * w + x)] *= 1 + s.shade * (static_cast<double>(x) / w - 0.5);
    if (s.blur_px > 0) blur(image, w, h, s.blur_px);
    if (s.noise > 0) {
        std::mt19937_64 rng(s.seed * 2);
        std::normal_distribution<double> n(0, s.noise);
        for (double& v : image) v += n(rng);
    }
    std::vector<std::uint8_t> out(image.size());
    for (std::size_t i = 0; i < image.size(); ++i) out[i] = static_cast<std::uint8_t>(std::clamp(std::lround(image[i]), 0L, 255L));
    return out;
}

}  // namespace fovea::drivers::synthetic
