// Filters and classifiers: `fovea tradeoff filter` and `fovea tradeoff classify`.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "tools/tradeoff_gaze.hpp"

namespace fovea::tools {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr std::int64_t kMs = 1'000'000;

struct Mean {
    double sum = 0, n = 0;
    void add(double v) { sum += v, n += 1; }
    [[nodiscard]] double value() const { return n > 0 ? sum / n : kNan; }
};

// Mean over groups of the group means.
double over_groups(const std::map<std::string, Mean>& groups) {
    Mean m;
    for (const auto& [name, g] : groups)
        if (g.n >= Judgement::kLeast) m.add(g.value());
    return m.value();
}

// The gaze at t as one who knows the future sees it: the mean of the raw gaze 10 ms either way, where no saccade runs.
std::optional<Direction<HeadFrame>> smooth_truth(const GazeTrack& track, std::int64_t t) {
    const auto here = track.truth(t);
    if (!here) return std::nullopt;
    Tangent mean;
    constexpr int kHalf = 5;
    for (int k = -kHalf; k <= kHalf; ++k) {
        const auto d = track.truth(t + 2 * k * kMs);
        if (!d) return std::nullopt;
        mean = mean + (1.0 / (2 * kHalf + 1)) * log_map(*here, *d);
    }
    return exp_map(*here, mean);
}

struct FilterScore {
    std::map<std::string, Mean> jitter2, fixation, saccade, all;
    double ns = 0, samples = 0;
};

void score_filter(const Method& m, const replay::Recording& recording, FilterScore& score) {
    score.ns += timed_run(m.settings, recording);
    score.samples += static_cast<double>(recording.samples.size());
    auto p = pipeline::Pipeline::create(m.settings);
    if (!p) return;
    GazeTrack track(recording);
    struct Before {
        Direction<HeadFrame> gaze;
        std::int64_t t;
    };
    std::optional<Before> before;
    // From one judged sample to the next, and not over one that is missing; fast trackers are judged every 4 ms.
    const double longest_step_ns = std::max(2.0 * 4 * kMs, 1.75e9 / std::max(track.rate_hz(), 1.0));
    for (const auto& r : recording.samples) {
        const EyeMotion& motion = p->update(r.sample).eyes[0];
        const std::int64_t t = to_ns(r.sample.exposed);
        if (!track.judged(t) || motion.reference != r.sample.exposed) continue;
        const unsigned c = track.classes(t, 0);
        const bool saccade = c & (kInSaccade | kOnsetSeen);
        const auto truth = saccade ? track.truth(t) : smooth_truth(track, t);
        if (truth) {
            const double e = angle_between(motion.gaze_dir_head, *truth) * kDegreesPerRadian;
            score.all[track.group()].add(e);
            (saccade ? score.saccade : score.fixation)[track.group()].add(e);
        }
        if (before && !saccade && static_cast<double>(t - before->t) <= longest_step_ns)
            score.jitter2[track.group()].add(std::pow(angle_between(before->gaze, motion.gaze_dir_head) * kDegreesPerRadian, 2));
        before = saccade ? std::nullopt : std::optional<Before>({motion.gaze_dir_head, t});
    }
}

struct Confusion {
    double n = 0, both = 0, ours = 0, theirs = 0;
    void add(bool o, bool t) { n += 1, both += o && t, ours += o, theirs += t; }
    // Cohen's kappa.
    [[nodiscard]] double kappa() const {
        if (n < 1 || theirs < 1) return kNan;
        const double agree = (both + (n - ours - theirs + both)) / n;
        const double chance = (ours * theirs + (n - ours) * (n - theirs)) / (n * n);
        return chance < 1 ? (agree - chance) / (1 - chance) : kNan;
    }
};

struct ClassifierScore {
    std::map<std::string, std::map<GazeEvent, Confusion>> groups;
    Mean delay_samples, delay_ms;
    double seen = 0, labelled = 0, invented = 0;
    double ns = 0, samples = 0;
};

std::optional<GazeEvent> event_of(replay::Label label) {
    switch (label) {
        case replay::Label::fixation: return GazeEvent::fixation;
        case replay::Label::saccade: return GazeEvent::saccade;
        case replay::Label::pursuit: return GazeEvent::pursuit;
        case replay::Label::blink: return GazeEvent::blink;
        default: return std::nullopt;
    }
}

void score_classifier(const Method& m, const replay::Recording& recording, ClassifierScore& score) {
    score.ns += timed_run(m.settings, recording);
    score.samples += static_cast<double>(recording.samples.size());
    auto p = pipeline::Pipeline::create(m.settings);
    if (!p) return;
    const std::string group = GazeTrack(recording).group();
    replay::Label label_before = replay::Label::none;
    std::int64_t labelled_ns = 0, end_ns = 0;
    int since = 0;
    bool open = false;  // a labelled saccade that has not been seen yet
    GazeEvent before = GazeEvent::fixation;
    for (const auto& r : recording.samples) {
        const GazeEvent event = p->update(r.sample).eyes[0].event;
        const std::int64_t t = to_ns(r.sample.exposed);
        ++since;
        if (r.label == replay::Label::saccade && label_before != replay::Label::saccade) {
            open = true;
            since = 0;
            labelled_ns = t;
            score.labelled += 1;
        }
        if (r.label == replay::Label::saccade) end_ns = t;
        if (event == GazeEvent::saccade && before != GazeEvent::saccade) {
            if (open && t <= end_ns + 20 * kMs) {
                open = false;
                score.seen += 1;
                score.delay_samples.add(since);
                score.delay_ms.add(static_cast<double>(t - labelled_ns) * 1e-6);
            } else if (t > end_ns + 20 * kMs) {
                score.invented += 1;
            }
        }
        before = event;
        label_before = r.label;
        // Judged where the recording has a label and the gaze is valid, or the label is a blink.
        if (r.label == replay::Label::none || (!r.sample.eye(Eye::combined).valid && r.label != replay::Label::blink)) continue;
        const auto truth = event_of(r.label);
        const GazeEvent ours = event == GazeEvent::lost ? GazeEvent::blink : event;
        for (const GazeEvent e : {GazeEvent::fixation, GazeEvent::saccade, GazeEvent::pursuit, GazeEvent::blink})
            score.groups[group][e].add(ours == e, truth == e);
    }
}

}  // namespace

TradeoffResult judge_filters(const TradeoffRequest& request) {
    std::vector<Method> methods;
    const auto add = [&](std::string name, auto&& change) {
        Method m{std::move(name), {}};
        m.settings.predictor.name = "hold";
        change(m.settings);
        methods.push_back(std::move(m));
    };
    add("none", [](auto& s) { s.filter = "none"; });
    for (const double cutoff : {1.0, 3.0, 5.0, 10.0})
        add(fmt::format("one_euro {:g} Hz", cutoff), [&](auto& s) { s.filter = "one_euro", s.one_euro.min_cutoff_hz = cutoff; });
    for (const double psd : {1e3, 1e5, 1e7})
        add(fmt::format("kalman {:g}", psd), [&](auto& s) { s.filter = "kalman", s.kalman.acceleration_psd = psd; });
    for (const double ms : {6.0, 12.0, 25.0, 50.0})
        add(fmt::format("saccade_aware {:g} ms", ms), [&](auto& s) { s.filter = "saccade_aware", s.saccade_aware.fixation_ms = ms; });
    TradeoffTable t;
    t.title = "Filters";
    t.note = "jitter: RMS step from one judged sample (at 250 Hz and more: every 4 ms) to the next outside saccades; errors against the mean of the raw gaze 10 ms either way (in saccades: against the raw gaze), degrees.";
    t.error_name = "mean error outside saccades, degrees";
    t.columns = {"jitter", "error_fixation", "error_saccade", "error_all"};
    std::size_t done = 0;
    for (const Method& m : methods) {
        FilterScore score;
        for (const auto& r : request.recordings) {
            score_filter(m, r.recording, score);
            request.progress(m.name, ++done, methods.size() * request.recordings.size());
        }
        const auto& s = m.settings;
        TradeoffRow row{m.name, score.ns / std::max(score.samples, 1.0), over_groups(score.fixation), {}, false,
                        fmt::format("[filter]\nname = \"{}\"\none_euro.min_cutoff_hz = {}\nkalman.acceleration_psd = {}\nsaccade_aware.fixation_ms = {}\n", s.filter, s.one_euro.min_cutoff_hz, s.kalman.acceleration_psd, s.saccade_aware.fixation_ms)};
        row.values = {std::sqrt(over_groups(score.jitter2)), over_groups(score.fixation), over_groups(score.saccade), over_groups(score.all)};
        t.rows.push_back(std::move(row));
    }
    TradeoffResult result;
    result.missing = "they need at least 50 samples with 100 ms of valid gaze around them";
    if (std::none_of(t.rows.begin(), t.rows.end(), [](const auto& r) { return std::isfinite(r.error); })) return result;
    mark_frontier(t);
    result.plots.push_back(plot_of(t));
    result.tables.push_back(std::move(t));
    return result;
}

TradeoffResult judge_classifiers(const TradeoffRequest& request) {
    TradeoffResult result;
    result.missing = "classifiers are judged by labels; no recording here has any";
    std::size_t with_labels = 0;
    for (const auto& r : request.recordings) with_labels += r.recording.info.has_labels;
    if (with_labels == 0) return result;
    std::vector<Method> methods;
    methods.push_back({"default", {}});
    for (const double onset : {15.0, 30.0, 45.0})
        methods.push_back({fmt::format("min_onset {:g} deg/s", onset), {}}), methods.back().settings.classifier.min_onset_deg_s = onset;
    for (const double factor : {3.0, 4.0, 7.0, 10.0})
        methods.push_back({fmt::format("noise_factor {:g}", factor), {}}), methods.back().settings.classifier.noise_factor = factor;
    for (const double ratio : {0.4, 0.8, 1.0})
        methods.push_back({fmt::format("end_ratio {:g}", ratio), {}}), methods.back().settings.classifier.end_ratio = ratio;
    TradeoffTable t;
    t.title = "Classifier settings against labels";
    t.note = "kappa: Cohen's, per sample, causal, mean over device groups. delay: from the labelled onset to the sample at which it is seen. invented: saccades that no label is near.";
    t.error_name = "1 - saccade kappa";
    t.columns = {"kappa_saccade", "kappa_fixation", "kappa_pursuit", "kappa_blink", "delay_samples", "delay_ms", "seen", "invented_per_min"};
    std::size_t done = 0;
    for (const Method& m : methods) {
        ClassifierScore score;
        double minutes = 0;
        for (const auto& r : request.recordings) {
            if (!r.recording.info.has_labels) continue;
            score_classifier(m, r.recording, score);
            if (!r.recording.samples.empty())
                minutes += to_seconds(r.recording.samples.back().sample.exposed - r.recording.samples.front().sample.exposed) / 60;
            request.progress(m.name, ++done, methods.size() * with_labels);
        }
        const auto kappa = [&](GazeEvent e) {
            Mean mean;
            for (const auto& [name, g] : score.groups)
                if (const double k = g.at(e).kappa(); std::isfinite(k)) mean.add(k);
            return mean.value();
        };
        const auto& c = m.settings.classifier;
        TradeoffRow row{m.name, score.ns / std::max(score.samples, 1.0), 1 - kappa(GazeEvent::saccade), {}, false,
                        fmt::format("[classifier]\nmin_onset_deg_s = {:.1f}\nnoise_factor = {:.1f}\nend_ratio = {:.2f}\n", c.min_onset_deg_s, c.noise_factor, c.end_ratio)};
        row.values = {kappa(GazeEvent::saccade), kappa(GazeEvent::fixation), kappa(GazeEvent::pursuit), kappa(GazeEvent::blink), score.delay_samples.value(), score.delay_ms.value(), score.labelled > 0 ? score.seen / score.labelled : kNan, score.invented / std::max(minutes, 1e-9)};
        t.rows.push_back(std::move(row));
    }
    mark_frontier(t);
    result.plots.push_back(plot_of(t));
    result.tables.push_back(std::move(t));
    return result;
}

}  // namespace fovea::tools
