#include "daemon/pipeline/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/QR>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace fovea::pipeline {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kRankTolerance = 1e-3;  // of the largest pivot, columns scaled to unit length: below it, noise decides
constexpr double kLeastRoundness = 0.1;   // narrower sets of targets say too little about the short direction
constexpr double kTukey = 4.685;         // 95 % efficient for normal errors
constexpr double kLeastScale = 0.0017;   // 0.1 degrees: below it all trackers are alike
constexpr double kReach = 5.671;         // tan 80 degrees

struct Plane {
    double x, y;
};
std::optional<Plane> project(Direction<HeadFrame> d) noexcept {
    if (!(d.z < -0.1)) return std::nullopt;
    return Plane{d.x / -d.z, d.y / -d.z};
}
Direction<HeadFrame> unproject(Plane p) noexcept { return Direction<HeadFrame>::from({p.x, p.y, -1}).value_or(Direction<HeadFrame>{}); }

std::array<double, 6> terms(Plane p) noexcept { return {1, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y}; }

using Coefficients = std::array<double, 12>;

std::optional<Plane> map(CalibrationModel model, const Coefficients& c, Plane p) noexcept {
    switch (model) {
        case CalibrationModel::identity: return p;
        case CalibrationModel::homography: {
            const double w = c[6] * p.x + c[7] * p.y + 1;
            if (!(w > 0.05)) return std::nullopt;  // towards the horizon of the map
            return Plane{(c[0] + c[1] * p.x + c[2] * p.y) / w, (c[3] + c[4] * p.x + c[5] * p.y) / w};
        }
        case CalibrationModel::affine:
        case CalibrationModel::quadratic: {
            const auto t = terms(p);
            Plane q{0, 0};
            for (std::size_t i = 0; i < 6; ++i) q.x += c[i] * t[i], q.y += c[6 + i] * t[i];
            return q;
        }
    }
    return std::nullopt;
}

struct Pair {
    Plane from, to;
};

// Weighted least squares; nothing when the columns are not independent.
std::optional<Eigen::MatrixXd> solve(Eigen::MatrixXd a, const Eigen::MatrixXd& b) {
    if (a.rows() < a.cols()) return std::nullopt;
    Eigen::VectorXd scale(a.cols());
    for (Eigen::Index i = 0; i < a.cols(); ++i) {
        scale[i] = a.col(i).norm();
        if (!(scale[i] > 1e-12)) return std::nullopt;
        a.col(i) /= scale[i];
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
    qr.setThreshold(kRankTolerance);
    if (qr.rank() < a.cols()) return std::nullopt;
    Eigen::MatrixXd x = qr.solve(b);
    for (Eigen::Index i = 0; i < a.cols(); ++i) x.row(i) /= scale[i];
    if (!x.allFinite()) return std::nullopt;
    return x;
}

std::optional<Coefficients> solve_model(CalibrationModel model, const std::vector<Pair>& pairs, const std::vector<double>& weight) {
    const auto n = static_cast<Eigen::Index>(pairs.size());
    Coefficients c{};
    if (model == CalibrationModel::homography) {
        Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * n, 8), b(2 * n, 1);
        for (Eigen::Index i = 0; i < n; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const auto [f, t] = pairs[k];
            const double w = std::sqrt(weight[k]);
            a.row(2 * i) << w, w * f.x, w * f.y, 0, 0, 0, -w * f.x * t.x, -w * f.y * t.x;
            a.row(2 * i + 1) << 0, 0, 0, w, w * f.x, w * f.y, -w * f.x * t.y, -w * f.y * t.y;
            b(2 * i) = w * t.x;
            b(2 * i + 1) = w * t.y;
        }
        const auto x = solve(std::move(a), b);
        if (!x) return std::nullopt;
        for (std::size_t i = 0; i < 8; ++i) c[i] = (*x)(static_cast<Eigen::Index>(i), 0);
        return c;
    }
    const Eigen::Index columns = model == CalibrationModel::affine ? 3 : 6;
    Eigen::MatrixXd a(n, columns), b(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const double w = std::sqrt(weight[k]);
        const auto t = terms(pairs[k].from);
        for (Eigen::Index j = 0; j < columns; ++j) a(i, j) = w * t[static_cast<std::size_t>(j)];
        b(i, 0) = w * pairs[k].to.x;
        b(i, 1) = w * pairs[k].to.y;
    }
    const auto x = solve(std::move(a), b);
    if (!x) return std::nullopt;
    for (Eigen::Index j = 0; j < columns; ++j) {
        c[static_cast<std::size_t>(j)] = (*x)(j, 0);
        c[static_cast<std::size_t>(6 + j)] = (*x)(j, 1);
    }
    return c;
}

double miss(CalibrationModel model, const Coefficients& c, const Pair& p) {
    const auto q = map(model, c, p.from);
    if (!q) return std::numbers::pi;
    return angle_between(unproject(*q), unproject(p.to));
}

double median(std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

struct Fit {
    Coefficients coefficients{};
    std::vector<double> weight;
};
std::optional<Fit> robust_fit(CalibrationModel model, const std::vector<Pair>& pairs) {
    Fit fit;
    fit.weight.assign(pairs.size(), 1);
    for (int round = 0; round < 15; ++round) {
        const auto c = solve_model(model, pairs, fit.weight);
        if (!c) return std::nullopt;
        fit.coefficients = *c;
        std::vector<double> off;
        for (const Pair& p : pairs) off.push_back(miss(model, *c, p));
        const double scale = std::max(1.4826 * median(off), kLeastScale);
        for (std::size_t i = 0; i < off.size(); ++i) {
            const double u = off[i] / (kTukey * scale);
            // The first rounds with Huber-like weights, which cannot throw away what a bad start misjudges.
            fit.weight[i] = round < 5 ? 1 / std::max(1.0, off[i] / (1.5 * scale)) : u < 1 ? (1 - u * u) * (1 - u * u) : 0;
        }
    }
    return fit;
}

// As TOML writes a float, and in the shortest form that reads back as the same.
std::string decimal(double v) {
    const std::string text = fmt::format("{}", v);
    return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

// How wide a set of points is across its longest direction, relative to along it: 0 for a line.
double roundness(const std::vector<Pair>& pairs, Plane Pair::* which) {
    double mx = 0, my = 0, xx = 0, xy = 0, yy = 0;
    const auto n = static_cast<double>(pairs.size());
    for (const Pair& p : pairs) mx += (p.*which).x / n, my += (p.*which).y / n;
    for (const Pair& p : pairs) {
        const double x = (p.*which).x - mx, y = (p.*which).y - my;
        xx += x * x / n, xy += x * y / n, yy += y * y / n;
    }
    const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
    if (!(mean + apart > 1e-6)) return 0;  // within 0.06 degrees of each other: a heap
    return std::sqrt(std::max(mean - apart, 0.0) / (mean + apart));
}

std::size_t least_targets(CalibrationModel model) {
    return model == CalibrationModel::affine ? 4 : model == CalibrationModel::homography ? 6 : 9;
}

}  // namespace

const char* to_string(CalibrationModel model) noexcept {
    switch (model) {
        case CalibrationModel::identity: return "identity";
        case CalibrationModel::affine: return "affine";
        case CalibrationModel::homography: return "homography";
        case CalibrationModel::quadratic: return "quadratic";
    }
    return "";
}

Direction<HeadFrame> Calibration::apply(Direction<HeadFrame> measured) const noexcept {
    if (model_ == CalibrationModel::identity) return measured;
    const auto p = project(measured);
    if (!p || std::hypot(p->x, p->y) > kReach) return measured;
    const auto q = map(model_, coefficients_, *p);
    if (!q || !(std::hypot(q->x, q->y) < 2 * kReach)) return measured;
    return unproject(*q);
}

Result<Calibration> fit_calibration(std::span<const CalibrationPoint> points, double largest_error_deg) {
    std::vector<Pair> pairs;
    for (const CalibrationPoint& p : points) {
        const auto from = project(p.measured), to = project(p.target);
        if (from && to && std::isfinite(from->x + from->y + to->x + to->y)) pairs.push_back({*from, *to});
    }
    if (pairs.size() < least_targets(CalibrationModel::affine))
        return fail(fmt::format("{} usable targets are too few to calibrate by", pairs.size()), {}, "look at 4 targets or more, best 9 in a 3 by 3 grid");

    Calibration best;
    bool any = false, conditioned = false;
    const bool spread = roundness(pairs, &Pair::from) > kLeastRoundness && roundness(pairs, &Pair::to) > kLeastRoundness;
    for (const CalibrationModel model : {CalibrationModel::affine, CalibrationModel::homography, CalibrationModel::quadratic}) {
        if (!spread || pairs.size() < least_targets(model)) continue;
        const auto fit = robust_fit(model, pairs);
        if (!fit) continue;
        // Leave each target out in turn. One without which the others no longer determine the map does not count as
        // well-conditioned.
        double sum = 0;
        int kept = 0;
        bool determined = true;
        for (std::size_t i = 0; i < pairs.size() && determined; ++i) {
            if (fit->weight[i] < 0.05) continue;
            std::vector<Pair> rest;
            for (std::size_t j = 0; j < pairs.size(); ++j)
                if (j != i && fit->weight[j] >= 0.05) rest.push_back(pairs[j]);
            const auto without = solve_model(model, rest, std::vector<double>(rest.size(), 1));
            determined = without.has_value();
            if (determined) sum += miss(model, *without, pairs[i]), ++kept;
        }
        if (!determined || kept == 0) continue;
        conditioned = true;
        const double error = sum / kept * kDegreesPerRadian;
        if (any && error >= best.leave_one_out_deg_) continue;
        any = true;
        best.model_ = model;
        best.coefficients_ = fit->coefficients;
        best.leave_one_out_deg_ = error;
        best.outliers_ = static_cast<int>(std::count_if(fit->weight.begin(), fit->weight.end(), [](double w) { return w < 0.05; }));
    }
    if (!conditioned)
        return fail("the targets lie on a line or on top of each other, so they do not determine a calibration", {}, "spread the targets over the view, best 9 in a 3 by 3 grid");
    if (!(best.leave_one_out_deg_ <= largest_error_deg))
        return fail(fmt::format("the calibration is off by {:.1f} degrees on targets it was not fitted to; {:g} are allowed", best.leave_one_out_deg_, largest_error_deg), {}, "calibrate again, looking at each target until it disappears");
    if (best.outliers_ * 3 > static_cast<int>(pairs.size()))
        return fail(fmt::format("{} of {} targets were not looked at", best.outliers_, pairs.size()), {}, "calibrate again, looking at each target until it disappears");
    return best;
}

std::string Calibration::to_toml(const std::string& name) const {
    std::string s = fmt::format("[calibration.{}]\nmodel = \"{}\"\nleave_one_out_deg = {}\noutliers = {}\ncoefficients = [", name, to_string(model_), decimal(leave_one_out_deg_), outliers_);
    for (std::size_t i = 0; i < coefficients_.size(); ++i) s += (i ? ", " : "") + decimal(coefficients_[i]);
    return s + "]\n";
}

Result<Calibration> Calibration::from_toml(const std::string& text, const std::string& name, const std::string& where) {
    toml::table root;
    try {
        root = toml::parse(text);
    } catch (const toml::parse_error& e) {
        return fail(std::string(e.description()), fmt::format("{}:{}", where, e.source().begin.line), "calibrate again with fovea calibrate");
    }
    const auto table = root["calibration"][name];
    const auto model = table["model"].value<std::string>();
    const auto* list = table["coefficients"].as_array();
    if (!model || !list || list->size() != 12) return fail("there is no complete [calibration." + name + "]", where, "calibrate again with fovea calibrate");
    Calibration c;
    bool known = false;
    for (const CalibrationModel m : {CalibrationModel::identity, CalibrationModel::affine, CalibrationModel::homography, CalibrationModel::quadratic})
        if (*model == to_string(m)) c.model_ = m, known = true;
    if (!known) return fail("there is no calibration model '" + *model + "'", where, "legal: identity, affine, homography, quadratic");
    for (std::size_t i = 0; i < 12; ++i) {
        const auto v = (*list)[i].value<double>();
        if (!v || !std::isfinite(*v)) return fail("a calibration coefficient is not a number", where, "calibrate again with fovea calibrate");
        c.coefficients_[i] = *v;
    }
    c.leave_one_out_deg_ = table["leave_one_out_deg"].value_or(0.0);
    c.outliers_ = static_cast<int>(table["outliers"].value_or(std::int64_t{0}));
    return c;
}

}  // namespace fovea::pipeline
