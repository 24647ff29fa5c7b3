#include "tools/judge_predictions.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>

#include "protocol/motion_model.hpp"
#include "render/density/fovea_size.hpp"

namespace fovea::tools {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

}  // namespace

double sized(const Outcome& o, double x) noexcept {
    // The renderer's own rule, without its floor and ceiling, so that what is measured here is what is drawn. Below 0.1
    // degrees nothing is saved any more.
    density::FoveaSizeSettings s;
    s.min_radius_rad = 0;
    s.max_radius_rad = HUGE_VAL;
    s.reach_rad = x;  // in degrees here, and so is the answer
    return density::fovea_radius_rad(s, std::max(static_cast<double>(o.r95_deg), 0.1) / kDegreesPerRadian);
}

Result<std::vector<LoadedRecording>> load_recordings(const std::vector<std::string>& paths,
                                                     const std::function<void(const Error&)>& skipped) {
    std::vector<LoadedRecording> out;
    std::vector<std::string> found;
    for (const std::string& path : paths) {
        std::error_code code;
        if (!std::filesystem::is_directory(path, code)) {
            auto r = replay::load_recording(path);
            if (!r) return std::unexpected(r.error());
            out.push_back({path, *std::move(r)});
            continue;
        }
        for (std::filesystem::recursive_directory_iterator it(path, code), end; !code && it != end; it.increment(code))
            if (it->is_regular_file(code)) found.push_back(it->path());
        if (code) return fail_errno("cannot read the directory", code.value(), path);
    }
    std::sort(found.begin(), found.end());
    for (const std::string& path : found) {
        auto r = replay::load_recording(path);
        if (r) out.push_back({path, *std::move(r)});
        else skipped(r.error());
    }
    if (out.empty()) return fail("there is no recording to judge by", paths.empty() ? "" : paths.front(), "name recordings, or directories that hold some");
    return out;
}

double timed_run(const pipeline::PipelineSettings& settings, const replay::Recording& recording) {
    // Else the first setting of a table pays for cold caches and a processor that has yet to speed up: twice the time.
    constexpr std::size_t kWarmUp = 20'000;
    auto warm = pipeline::Pipeline::create(settings), p = pipeline::Pipeline::create(settings);
    if (!warm || !p) return 0;
    for (std::size_t i = 0; i < std::min(kWarmUp, recording.samples.size()); ++i) (void)warm->update(recording.samples[i].sample);
    const auto now_ns = [] {
        timespec t{};
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
        return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
    };
    const double before = now_ns();
    for (const auto& r : recording.samples) (void)p->update(r.sample);
    return now_ns() - before;
}

Result<void> Judgement::run(const Method& method, const replay::Recording& recording) {
    auto again = pipeline::Pipeline::create(method.settings);
    if (!again) return std::unexpected(again.error());
    GazeTrack track(recording);
    Cells& cells = groups_[track.group()];
    cells.resize(kClassCount * horizons_ns_.size());

    // The cost first, alone, then the errors with a second pipeline that sees the same.
    ns_ += timed_run(method.settings, recording);
    samples_ += recording.samples.size();

    for (const auto& r : recording.samples) {
        const EyeMotion& m = again->update(r.sample).eyes[0];
        const std::int64_t t = to_ns(r.sample.exposed);
        if (!track.judged(t)) continue;
        for (std::size_t h = 0; h < horizons_ns_.size(); ++h) {
            const auto truth = track.truth(t + horizons_ns_[h]);
            if (!truth) continue;
            const GazeEstimate e = evaluate(m, instant_from_ns(t + horizons_ns_[h]));
            const Outcome o{static_cast<float>(angle_between(e.gaze_dir_head, *truth) * kDegreesPerRadian),
                            static_cast<float>(e.radius68_rad * kDegreesPerRadian),
                            static_cast<float>(e.radius95_rad * kDegreesPerRadian)};
            const unsigned bits = track.classes(t, horizons_ns_[h]);
            for (std::size_t c = 0; c < kClassCount; ++c)
                if (bits & kGazeClasses[c].bit) cells[c * horizons_ns_.size() + h].push_back(o);
        }
    }
    return {};
}

std::vector<std::string> Judgement::groups() const {
    std::vector<std::string> names;
    for (const auto& [name, cells] : groups_) names.push_back(name);
    return names;
}

Statistics Judgement::reduce(std::vector<Outcome> o) {
    Statistics s;
    s.count = o.size();
    if (o.empty()) {
        s.mean = s.median = s.p95 = s.p99 = s.within68 = s.within95 = std::numeric_limits<double>::quiet_NaN();
        return s;
    }
    for (const Outcome& x : o) {
        s.mean += static_cast<double>(x.error_deg);
        s.within68 += x.error_deg <= x.r68_deg;
        s.within95 += x.error_deg <= x.r95_deg;
    }
    const auto n = static_cast<double>(o.size());
    s.mean /= n, s.within68 /= n, s.within95 /= n;
    std::sort(o.begin(), o.end(), [](const Outcome& a, const Outcome& b) { return a.error_deg < b.error_deg; });
    const auto at = [&](double share) {
        return static_cast<double>(o[std::min(o.size() - 1, static_cast<std::size_t>(share * n))].error_deg);
    };
    s.median = at(0.5), s.p95 = at(0.95), s.p99 = at(0.99);
    return s;
}

Statistics Judgement::statistics(const std::string& group, std::size_t gaze_class, std::size_t horizon) const {
    const std::size_t cell = gaze_class * horizons_ns_.size() + horizon;
    if (!group.empty()) return reduce(groups_.at(group)[cell]);
    Statistics sum;
    double n = 0;
    for (const auto& [name, cells] : groups_) {
        if (cells[cell].size() < kLeast) continue;
        const Statistics s = reduce(cells[cell]);
        sum.mean += s.mean, sum.median += s.median, sum.p95 += s.p95, sum.p99 += s.p99;
        sum.within68 += s.within68, sum.within95 += s.within95;
        sum.count += s.count;
        n += 1;
    }
    if (n < 1) return reduce({});
    sum.mean /= n, sum.median /= n, sum.p95 /= n, sum.p99 /= n, sum.within68 /= n, sum.within95 /= n;
    return sum;
}

}  // namespace fovea::tools
