#include "tools/pupil_baselines.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace fovea::tools {

namespace {

using drivers::camera::GreyImage;
using drivers::camera::PupilResult;

cv::Mat as_mat(const GreyImage& g) {
    return {g.height, g.width, CV_8UC1, const_cast<std::uint8_t*>(g.pixels), static_cast<std::size_t>(g.stride)};
}

PupilResult circle(double x, double y, double r) {
    PupilResult out;
    out.found = true;
    out.ellipse = {x, y, r, r, 0};
    out.confidence = 1;
    return out;
}

PupilResult threshold_centroid(const GreyImage& g) {
    const cv::Mat image = as_mat(g);
    // Otsu between skin and eye first, then again within the darker part: what is left is the pupil.
    cv::Mat mask, labels, stats, centres;
    const double first = cv::threshold(image, mask, 0, 255, cv::THRESH_BINARY_INV | cv::THRESH_OTSU);
    std::vector<std::uint8_t> dark;
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            if (image.at<std::uint8_t>(y, x) <= first) dark.push_back(image.at<std::uint8_t>(y, x));
    if (dark.size() < 16) return {};
    cv::Mat rest(1, static_cast<int>(dark.size()), CV_8UC1, dark.data()), unused;
    const double second = cv::threshold(rest, unused, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
    cv::threshold(image, mask, second, 255, cv::THRESH_BINARY_INV);
    const int n = cv::connectedComponentsWithStats(mask, labels, stats, centres);
    int best = 0, most = 20;
    for (int i = 1; i < n; ++i)
        if (stats.at<int>(i, cv::CC_STAT_AREA) > most) {
            most = stats.at<int>(i, cv::CC_STAT_AREA);
            best = i;
        }
    if (best == 0) return {};
    return circle(centres.at<double>(best, 0), centres.at<double>(best, 1), std::sqrt(most / std::numbers::pi));
}

PupilResult hough(const GreyImage& g) {
    cv::Mat smooth;
    cv::GaussianBlur(as_mat(g), smooth, {}, 1.5);
    std::vector<cv::Vec3f> circles;
    const int side = std::min(g.width, g.height);
    cv::HoughCircles(smooth, circles, cv::HOUGH_GRADIENT, 1, side, 60, 12, side / 24, side / 5);
    if (circles.empty()) return {};
    return circle(circles[0][0], circles[0][1], circles[0][2]);
}

PupilResult swirski_like(const GreyImage& g) {
    const cv::Mat image = as_mat(g);
    cv::Mat sums;
    cv::integral(image, sums, CV_32S);
    const int side = std::min(g.width, g.height);
    const auto box = [&](int x0, int y0, int x1, int y1) {
        return static_cast<double>(sums.at<int>(y1, x1) - sums.at<int>(y0, x1) - sums.at<int>(y1, x0) + sums.at<int>(y0, x0));
    };
    double best = -1e9, inner_mean = 0;
    int bx = 0, by = 0, br = 0;
    for (int r = side / 24; r <= side / 5; r = std::max(r + 1, r * 5 / 4))
        for (int y = 3 * r; y < g.height - 3 * r; y += 2)
            for (int x = 3 * r; x < g.width - 3 * r; x += 2) {
                const double in = box(x - r, y - r, x + r, y + r) / (4.0 * r * r);
                const double out = (box(x - 3 * r, y - 3 * r, x + 3 * r, y + 3 * r) - in * 4 * r * r) / (32.0 * r * r);
                if (out - in > best) { best = out - in; bx = x; by = y; br = r; inner_mean = in; }
            }
    if (br == 0) return {};
    const cv::Rect roi = cv::Rect(bx - 2 * br, by - 2 * br, 4 * br, 4 * br) & cv::Rect(0, 0, g.width, g.height);
    cv::Mat region;
    cv::GaussianBlur(image(roi), region, {}, 1.0);
    // Two means of the region's levels.
    double dark = inner_mean, light = 255;
    for (int pass = 0; pass < 10; ++pass) {
        double nd = 0, sd = 0, nl = 0, sl = 0;
        for (int y = 0; y < region.rows; ++y)
            for (int x = 0; x < region.cols; ++x) {
                const double v = region.at<std::uint8_t>(y, x);
                if (std::abs(v - dark) < std::abs(v - light)) { ++nd; sd += v; } else { ++nl; sl += v; }
            }
        if (nd < 1 || nl < 1) return {};
        dark = sd / nd;
        light = sl / nl;
    }
    cv::Mat mask, labels, stats, centres;
    cv::threshold(region, mask, (dark + light) / 2, 255, cv::THRESH_BINARY_INV);
    const int n = cv::connectedComponentsWithStats(mask, labels, stats, centres);
    int chosen = 0, most = 20;
    for (int i = 1; i < n; ++i)
        if (stats.at<int>(i, cv::CC_STAT_AREA) > most) { most = stats.at<int>(i, cv::CC_STAT_AREA); chosen = i; }
    if (chosen == 0) return {};
    mask = labels == chosen;
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    if (contours.empty() || contours[0].size() < 12) return {};
    const auto& edge = contours[0];
    std::mt19937 rng(1);
    std::vector<cv::Point2f> trial, inliers, kept;
    for (int i = 0; i < 50; ++i) {
        trial.clear();
        for (int k = 0; k < 6; ++k) trial.emplace_back(edge[rng() % edge.size()]);
        const cv::RotatedRect e = cv::fitEllipseDirect(trial);
        const double a = e.size.width / 2, b = e.size.height / 2;
        if (!(a > 2) || !(b > 2) || a > side || b > side) continue;
        const double c = std::cos(e.angle * std::numbers::pi / 180), s = std::sin(e.angle * std::numbers::pi / 180);
        inliers.clear();
        for (const auto& p : edge) {
            const double dx = p.x - double{e.center.x}, dy = p.y - double{e.center.y};
            const double u = (dx * c + dy * s) / a, v = (-dx * s + dy * c) / b;
            if (std::abs(std::hypot(u, v) - 1) * std::min(a, b) < 1.5) inliers.emplace_back(p);
        }
        if (inliers.size() > kept.size()) kept = inliers;
    }
    if (kept.size() < 6) return {};
    const cv::RotatedRect e = cv::fitEllipseDirect(kept);
    PupilResult out = circle(double{e.center.x} + roi.x, double{e.center.y} + roi.y, std::max(e.size.width, e.size.height) / 2);
    out.ellipse.b = std::min(e.size.width, e.size.height) / 2;
    return out;
}

}  // namespace

const PupilBaseline kPupilBaselines[kPupilBaselineCount] = {
    {"threshold", threshold_centroid}, {"hough", hough}, {"swirski_like", swirski_like}};

}  // namespace fovea::tools
