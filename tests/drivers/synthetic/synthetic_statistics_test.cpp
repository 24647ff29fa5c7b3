// What the synthetic eye does, against published figures; sources in docs/synthetic_eye.md.
#include <algorithm>

#include <gtest/gtest.h>

#include "tests/drivers/synthetic/collect.hpp"

namespace fovea::drivers::synthetic {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

Scenario bare(double duration_s, double rate_hz = 1000) {
    Scenario s;
    s.duration_s = duration_s;
    s.rate_hz = rate_hz;
    return s;
}

struct MeasuredSaccade {
    double amplitude_deg = 0, duration_ms = 0, peak_deg_s = 0, peak_at = 0;
};

std::vector<MeasuredSaccade> saccades(const std::vector<SyntheticSample>& all) {
    std::vector<MeasuredSaccade> found;
    for (std::size_t i = 1; i < all.size(); ++i) {
        if (all[i].movement != Movement::saccade || all[i - 1].movement == Movement::saccade) continue;
        std::size_t j = i;
        MeasuredSaccade m;
        std::size_t peak = i;
        for (; j < all.size() && all[j].movement == Movement::saccade; ++j) {
            const double v = angle_between(all[j - 1].truth_dir_head, all[j].truth_dir_head) / kDegree /
                             to_seconds(all[j].sample.exposed - all[j - 1].sample.exposed);
            if (v > m.peak_deg_s) m.peak_deg_s = v, peak = j;
        }
        if (j == all.size()) break;
        m.amplitude_deg = angle_between(all[i - 1].truth_dir_head, all[j].truth_dir_head) / kDegree;
        m.duration_ms = to_seconds(all[j].sample.exposed - all[i - 1].sample.exposed) * 1e3 - 1;  // one interval is between
        m.peak_at = (static_cast<double>(peak - i) + 0.5) / static_cast<double>(j - i);
        if (m.amplitude_deg > 0.3) found.push_back(m);
    }
    return found;
}

// Carpenter 1988: 2.2 ms per degree and 21 ms; peak over mean speed 1.65: Harwood et al. 1999.
TEST(SyntheticStatistics, SaccadesFollowTheMainSequence) {
    Scenario s = bare(240);
    s.fixations = Fixations{.amplitude_deg = 7};
    s.saccades = Saccades{.scatter = 0};
    std::vector<double> amplitude, duration, ratio, early, late, peak10;
    for (const auto& m : saccades(collect(s))) {
        amplitude.push_back(m.amplitude_deg);
        duration.push_back(m.duration_ms);
        if (m.amplitude_deg > 2) ratio.push_back(m.peak_deg_s * m.duration_ms * 1e-3 / m.amplitude_deg);
        (m.amplitude_deg > 15 ? late : early).push_back(m.peak_at);
        if (m.amplitude_deg > 9 && m.amplitude_deg < 11) peak10.push_back(m.peak_deg_s);
    }
    ASSERT_GT(amplitude.size(), 500u);
    const Line d = line(amplitude, duration);
    EXPECT_NEAR(d.slope, 2.2, 0.1);
    EXPECT_NEAR(d.intercept, 21, 1.5);
    EXPECT_NEAR(mean(ratio), 1.65, 0.05);
    EXPECT_GT(mean(peak10), 281) << "Baloh 1975 (EOG): 281 deg/s at 10 degrees";
    EXPECT_LT(mean(peak10), 441) << "video tracker at 1000 Hz, hand labels: 441";
    EXPECT_LT(mean(late), mean(early) - 0.02) << "long saccades are skewed (Van Opstal and Van Gisbergen 1987)";
}

TEST(SyntheticStatistics, SaccadesArriveAndScatterInSpeed) {
    Scenario s = bare(120);
    s.fixations.emplace();
    s.saccades = Saccades{.scatter = 0.1};
    std::vector<double> off;
    for (const auto& m : saccades(collect(s))) off.push_back(m.duration_ms / (21 + 2.2 * m.amplitude_deg) - 1);
    EXPECT_NEAR(deviation(off), 0.1, 0.03);
    for (const auto& x : collect(s))
        if (x.movement == Movement::fixation && part(x, Effect::saccades) == Offset{}) {
            ASSERT_LT(std::fabs(degrees(x.truth_dir_head).x_deg), 15.001) << "stays in its field";
        }
}

// 1 to 2 per second, below one degree: Martinez-Conde, Macknik and Hubel 2004; Engbert 2006.
TEST(SyntheticStatistics, MicrosaccadesComeOnceOrTwiceASecond) {
    Scenario s = bare(300, 250);
    s.microsaccades.emplace();
    std::vector<double> sizes, sideways;
    Offset before, last;
    bool moving = false;
    for (const auto& x : collect(s)) {
        const Offset now = part(x, Effect::microsaccades);
        if (now != last && !moving) before = last, moving = true;
        else if (now == last && moving) {
            sizes.push_back(length(now - before));
            sideways.push_back(std::fabs((now - before).x_deg) > std::fabs((now - before).y_deg));
            moving = false;
        }
        last = now;
        ASSERT_LT(length(now), 3) << "they come back";
    }
    const double rate = static_cast<double>(sizes.size()) / 300;
    EXPECT_GT(rate, 1);
    EXPECT_LT(rate, 2);
    std::ranges::sort(sizes);
    EXPECT_NEAR(sizes[sizes.size() / 2], 0.3, 0.03);
    EXPECT_LE(sizes.back(), 1 + 1e-9);
    EXPECT_GT(mean(sideways), 0.8) << "mostly horizontal (Engbert 2006)";
}

// Engbert and Kliegl 2004: goes on for some 20 ms, comes back over 100 to 400 ms.
TEST(SyntheticStatistics, DriftIsPersistentAtShortTimesAndReturnsAtLongOnes) {
    Scenario s = bare(400, 250);
    s.drift.emplace();
    const auto all = collect(s);
    const auto spread = [&](std::size_t lag) {
        double sum = 0;
        for (std::size_t i = lag; i < all.size(); ++i) sum += std::pow(length(part(all[i], Effect::drift) - part(all[i - lag], Effect::drift)), 2);
        return sum / static_cast<double>(all.size() - lag);
    };
    const double soon = std::log(spread(5) / spread(1)) / std::log(5.0), later = std::log(spread(100) / spread(25)) / std::log(4.0);
    EXPECT_GT(soon, 1.05) << "exponent of the mean square way from 4 to 20 ms";
    EXPECT_LT(later, 0.95) << "and from 100 to 400 ms";
    double path = 0;
    for (std::size_t i = 1; i < all.size(); ++i) path += length(part(all[i], Effect::drift) - part(all[i - 1], Effect::drift));
    EXPECT_NEAR(path / 400, 0.8, 0.05) << "degrees per second along the path";
}

// 70 to 100 Hz, a few thousandths of a degree: Martinez-Conde et al. 2004.
TEST(SyntheticStatistics, TremorHasItsSizeAndBand) {
    Scenario s = bare(10, 2000);
    s.tremor.emplace();
    std::vector<double> x;
    std::size_t crossings = 0;
    for (const auto& v : collect(s)) {
        x.push_back(part(v, Effect::tremor).x_deg);
        crossings += x.size() > 1 && (x.back() > 0) != (x[x.size() - 2] > 0);
    }
    EXPECT_NEAR(deviation(x), 0.005, 0.0005);
    EXPECT_GT(static_cast<double>(crossings) / 20, 70);
    EXPECT_LT(static_cast<double>(crossings) / 20, 100);
}

TEST(SyntheticStatistics, PursuitHasItsGainAndIsSmooth) {
    Scenario s = bare(120);
    s.pursuit.emplace();
    const auto all = collect(s);
    std::vector<double> speed;
    for (std::size_t i = 2; i < all.size(); ++i) {
        const Offset v = 1000 * (part(all[i], Effect::pursuit) - part(all[i - 1], Effect::pursuit));
        const Offset w = 1000 * (part(all[i - 1], Effect::pursuit) - part(all[i - 2], Effect::pursuit));
        speed.push_back(length(v));
        ASSERT_LT(length(v - w), 1.2) << "deg/s in a millisecond: no jump of the speed";
        ASSERT_EQ(all[i].movement, Movement::pursuit);
    }
    EXPECT_NEAR(mean(speed), 0.9 * 12, 1.5);
}

TEST(SyntheticStatistics, EyesConvergeOnWhatIsNear) {
    Scenario s = bare(60, 100);
    s.binocular = true;
    s.vergence.emplace();
    double least = 1e9, most = 0;
    for (const auto& x : collect(s)) {
        const double angle = degrees(x.sample.eye(Eye::left).gaze_dir_head).x_deg - degrees(x.sample.eye(Eye::right).gaze_dir_head).x_deg;
        least = std::min(least, angle), most = std::max(most, angle);
        ASSERT_NEAR(degrees(x.sample.eye(Eye::combined).gaze_dir_head).x_deg, 0, 1e-9);
    }
    EXPECT_GE(least, 2 * std::atan(0.0315 / 4) / kDegree - 1e-9);
    EXPECT_LE(most, 2 * std::atan(0.0315 / 0.4) / kDegree + 1e-9);
    EXPECT_GT(most - least, 4);
}

// 10 to 20 a minute, 100 to 400 ms: Doughty 2001; the lid falls faster than it rises: Evinger et al. 1991.
TEST(SyntheticStatistics, BlinksComeAtTheirRateAndDragTheGazeDown) {
    Scenario s = bare(600, 250);
    s.blinks.emplace();
    std::size_t blinks = 0, shut = 0, falling = 0, rising = 0;
    double lowest = 0, before = 1;
    const auto all = collect(s);
    for (std::size_t i = 1; i < all.size(); ++i) {
        const EyeState& e = all[i].sample.eye(Eye::combined);
        blinks += all[i].movement == Movement::blink && all[i - 1].movement != Movement::blink;
        shut += all[i].movement == Movement::blink;
        falling += e.openness < before, rising += e.openness > before;
        before = e.openness;
        ASSERT_EQ(e.valid, e.openness >= 0.35);
        if (e.valid) lowest = std::min(lowest, degrees(e.gaze_dir_head).y_deg);
    }
    EXPECT_NEAR(static_cast<double>(blinks) / 10, 15, 3);
    EXPECT_NEAR(static_cast<double>(shut) * 4 / static_cast<double>(blinks), 206, 25) << "mean of a log-normal about 200 ms";
    EXPECT_LT(lowest, -4) << "the artefact";
    EXPECT_GT(lowest, -12 * 0.65 * 0.65 - 0.1) << "but only while the tracker gives gaze";
    EXPECT_GT(rising, falling + falling / 2);
}

// Collewijn and Smeets 2000: gain near 1, latency about 10 ms.
TEST(SyntheticStatistics, TheReflexHoldsTheGazeInSpace) {
    Scenario s = bare(120, 500);
    s.head.emplace();
    s.vestibulo_ocular_reflex.emplace();
    const auto all = collect(s);
    std::vector<double> head, eye;
    for (std::size_t i = 6; i < all.size(); ++i) {
        const auto azimuth = [&](std::size_t k) { return part(all[k], Effect::head).x_deg; };
        if (std::fabs(azimuth(i - 5) - azimuth(i - 6)) < 0.02) continue;  // 10 deg/s
        head.push_back(azimuth(i - 5) - azimuth(i - 6));                  // 10 ms ago
        eye.push_back(part(all[i], Effect::vestibulo_ocular_reflex).x_deg - part(all[i - 1], Effect::vestibulo_ocular_reflex).x_deg);
    }
    ASSERT_GT(head.size(), 1000u);
    EXPECT_NEAR(line(head, eye).slope, -0.97, 1e-6);
    // Where the person looks in space moves far less than the head does.
    double worst_head = 0, worst_gaze = 0;
    for (const auto& x : all) {
        const Vec3<WorldFrame> g = x.sample.head.world_from_head * x.truth_dir_head.vec();
        worst_gaze = std::max(worst_gaze, std::acos(std::clamp(-g.z, -1.0, 1.0)) / kDegree);
        worst_head = std::max(worst_head, length(part(x, Effect::head)));
    }
    EXPECT_GT(worst_head, 20);
    EXPECT_LT(worst_gaze, 0.1 * worst_head);
}

TEST(SyntheticStatistics, SlipGrowsFromSlipToSlip) {
    Scenario s = bare(300, 50);
    s.slip = Slip{.rate_per_min = 20, .step_deg = 1, .creep_deg_per_min = 0};
    const auto all = collect(s);
    std::size_t slips = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
        const bool moves = part(all[i], Effect::slip) != part(all[i - 1], Effect::slip);
        const bool moved = i > 1 && part(all[i - 1], Effect::slip) != part(all[i - 2], Effect::slip);
        slips += moves && !moved;
        ASSERT_EQ(all[i].truth_dir_head, (Direction<HeadFrame>{})) << "the eye does not follow";
    }
    EXPECT_NEAR(static_cast<double>(slips), 100, 30);
}

// Niehorster et al. 2020: root mean square from sample to sample over deviation is the square root of 2 for white noise, lower
// for coloured.
TEST(SyntheticStatistics, NoiseHasItsSizeAndColour) {
    double ratio_before = 10;
    for (const double colour : {0.0, 0.5, 1.0, 1.5, 2.0}) {
        Scenario s = bare(200, 250);
        s.noise = Noise{.std_deg = 0.2, .colour = colour};
        std::vector<double> x, steps;
        for (const auto& v : collect(s)) {
            x.push_back(degrees(v.sample.eye(Eye::combined).gaze_dir_head).x_deg);
            if (x.size() > 1) steps.push_back(x.back() - x[x.size() - 2]);
        }
        EXPECT_NEAR(deviation(x), 0.2, colour > 1 ? 0.03 : 0.01) << colour;
        const double ratio = deviation(steps) / deviation(x);
        const double expected = ColouredNoise(*s.noise, {1, 13}, 0).step_ratio();
        EXPECT_NEAR(ratio, expected, 0.1 * expected) << colour;
        EXPECT_LT(ratio, ratio_before - 0.05) << colour;
        if (colour == 0) {
            EXPECT_NEAR(ratio, std::numbers::sqrt2, 0.02);
        }
        ratio_before = ratio;
    }
    EXPECT_LT(ratio_before, 0.15) << "brown";
}

TEST(SyntheticStatistics, MeasuredGazeComesInSteps) {
    Scenario s = bare(2);
    s.noise = Noise{.std_deg = 1};
    s.quantisation = Quantisation{.step_deg = 0.25};
    for (const auto& x : collect(s)) {
        const double steps = degrees(x.sample.eye(Eye::combined).gaze_dir_head).x_deg / 0.25;
        ASSERT_NEAR(steps, std::nearbyint(steps), 1e-9);
    }
}

TEST(SyntheticStatistics, TimesJitterButKeepTheirOrder) {
    Scenario s = bare(60, 250);
    s.rate_jitter = RateJitter{.std_ms = 0.5};
    s.latency = Latency{.least_ms = 5, .mean_ms = 8};
    const auto all = collect(s);
    std::vector<double> off, late;
    for (std::size_t i = 0; i < all.size(); ++i) {
        off.push_back(static_cast<double>(to_ns(all[i].sample.exposed)) * 1e-6 - 4 * static_cast<double>(i));
        late.push_back(part(all[i], Effect::latency).x_deg);
        ASSERT_GE(all[i].sample.received - all[i].sample.exposed, std::chrono::milliseconds(5));
        if (i == 0) continue;
        ASSERT_GT(all[i].sample.exposed, all[i - 1].sample.exposed);
        ASSERT_GE(all[i].sample.received, all[i - 1].sample.received);
    }
    EXPECT_NEAR(deviation(off), 0.5, 0.02);
    EXPECT_NEAR(mean(late), 8, 0.1);
}

TEST(SyntheticStatistics, DropOutsTakeTheirShare) {
    Scenario s = bare(600, 250);
    s.drop_outs = DropOuts{.rate_per_min = 60, .duration_ms = 100, .missing = 0.5};
    const auto all = collect(s);
    std::size_t invalid = 0;
    for (const auto& x : all) invalid += !x.sample.eye(Eye::combined).valid;
    const double missing = 1 - static_cast<double>(all.size()) / 150'000;
    EXPECT_NEAR(missing, 0.05, 0.015);
    EXPECT_NEAR(static_cast<double>(invalid) / 150'000, 0.05, 0.015);
    EXPECT_EQ(all.back().sample.id, static_cast<std::uint64_t>(std::llround(to_seconds(all.back().sample.exposed - Instant{}) * 250)) + 1) << "ids count what is missing";
}

TEST(SyntheticStatistics, ThePupilSwingsOnBehindASaccadeButTheEyeDoesNot) {
    Scenario s = bare(60);
    s.fixations.emplace();
    s.saccades.emplace();
    s.post_saccadic_oscillation.emplace();
    double most = 0;
    for (const auto& x : collect(s)) {
        const double swing = length(part(x, Effect::post_saccadic_oscillation));
        most = std::max(most, swing);
        if (swing > 0.02) {
            ASSERT_GT(angle_between(x.truth_dir_head, x.sample.eye(Eye::combined).gaze_dir_head) / kDegree, 0.015);
        }
    }
    EXPECT_GT(most, 0.2);
    EXPECT_LE(most, 1.0) << "10 to 40 ms and up to 1 degree: Nystrom, Hooge and Holmqvist 2013";
}

}  // namespace
}  // namespace fovea::drivers::synthetic
