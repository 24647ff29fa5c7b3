// What moves, stands, fades, flickers, comes or goes, against showing the last frame again.
//
// Two frames do not decide everything: what comes from beyond the reach of the search, or has no counterpart, may look like
// something else that moved. So two things are held: few runs lose at all, and none loses much.
// FOVEA_EXTRAPOLATION_SEEDS=N looks at N pictures of each kind, from FOVEA_EXTRAPOLATION_FIRST_SEED on;
// FOVEA_EXTRAPOLATION_KIND names one kind; FOVEA_EXTRAPOLATION_LIST=1 prints every loss and a line per kind.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/render/extrapolation_cases.hpp"
#include "tests/render/extrapolation_engine.hpp"

using namespace fovea::render::extrapolation;
using fovea::test::case_kinds;
using fovea::test::moving_case;
using fovea::test::MovingCase;
using fovea::test::Picture;
using fovea::test::psnr;

namespace {

int number(const char* name, int otherwise) {
    const char* given = std::getenv(name);
    return given != nullptr ? std::atoi(given) : otherwise;
}

constexpr double kSeen_db = 50;        // less than a level of difference: what is beyond does not count
constexpr double kLost_db = 0.1;       // so much less than repeating is a loss
constexpr double kMostLost_db = 1.5;   // no run of the seeds that are always asked loses more
constexpr int kMostOf = 50;            // of so many runs at most one is lost

struct Tally {
    int runs = 0, lost = 0, lost_clearly = 0;
    double worst = 0, gain = 0;
    std::string worst_name;
};

TEST(ExtrapolationNever, LosesMuchOrOftenToTheLastFrameShownAgain) {
    const int seeds = number("FOVEA_EXTRAPOLATION_SEEDS", 3), first = number("FOVEA_EXTRAPOLATION_FIRST_SEED", 4);
    const char* only = std::getenv("FOVEA_EXTRAPOLATION_KIND");
    const bool list = std::getenv("FOVEA_EXTRAPOLATION_LIST") != nullptr;
    const auto kinds = case_kinds();
    Tally all;
    for (int kind = 0; kind < static_cast<int>(kinds.size()); ++kind) {
        if (only != nullptr && std::string(only) != kinds[static_cast<std::size_t>(kind)]) continue;
        Tally tally;
        for (int seed = first; seed < first + seeds; ++seed) {
            const MovingCase c = moving_case(kind, static_cast<std::uint32_t>(seed));
            const Picture a = c.at(0), b = c.at(1);
            Picture out(c.width, c.height, Format::rgba8);
            for (const float factor : {0.5f, 0.25f, 1.0f}) {
                const Picture truth = c.at(1 + factor);
                const double repeated = psnr(b, truth);
                for (const Preset preset : kPresets)
                    for (const bool gazed : {false, true}) {
                        const Gaze gaze{0.6f * static_cast<float>(c.width), 0.4f * static_cast<float>(c.height), 20, 48};
                        Hints hints;
                        if (gazed) hints.gaze = &gaze;
                        auto e = fovea::test::engine(preset);
                        ASSERT_EQ(fovea::test::run(e, a, b, out, factor, hints), Outcome::ok);
                        const double made = psnr(out, truth), lead = std::min(made, kSeen_db) - std::min(repeated, kSeen_db);
                        ++tally.runs;
                        tally.lost += lead < -0.02;
                        tally.lost_clearly += lead < -kLost_db;
                        tally.gain += std::min(lead, 20.0);
                        const std::string name = c.name + ", factor " + std::to_string(factor) + ", " + preset_name(preset) + (gazed ? ", gaze" : "");
                        if (lead < tally.worst) {
                            tally.worst = lead;
                            tally.worst_name = name;
                        }
                        if (list && lead < -kLost_db) std::printf("%s: %.2f dB against %.2f\n", name.c_str(), made, repeated);
                    }
            }
        }
        if (list) std::printf("%-20s runs %5d  lost %5d  more than %.1f dB %5d  worst %6.2f dB  gain %5.2f dB   %s\n", kinds[static_cast<std::size_t>(kind)], tally.runs, tally.lost, kLost_db,
                              tally.lost_clearly, tally.worst, tally.gain / std::max(tally.runs, 1), tally.worst_name.c_str());
        all.runs += tally.runs;
        all.lost_clearly += tally.lost_clearly;
        if (tally.worst < all.worst) {
            all.worst = tally.worst;
            all.worst_name = tally.worst_name;
        }
        all.gain += tally.gain;
    }
    if (list) std::printf("%d runs, %d lost by more than %.1f dB, worst %.2f dB (%s), mean gain %.2f dB\n", all.runs, all.lost_clearly, kLost_db, all.worst, all.worst_name.c_str(), all.gain / std::max(all.runs, 1));
    EXPECT_LE(kMostOf * all.lost_clearly, all.runs);
    EXPECT_GE(all.gain, 2.0 * all.runs);   // who always repeats loses nothing
    if (std::getenv("FOVEA_EXTRAPOLATION_SEEDS") == nullptr) { EXPECT_GE(all.worst, -kMostLost_db) << all.worst_name; }
}

// The same content at the other end of the picture.
Picture turned(const Picture& p) {
    Picture out = p;
    constexpr std::size_t kPixel = 4;
    for (std::size_t i = 0; i < p.bytes.size(); i += kPixel) std::copy_n(p.bytes.end() - static_cast<std::ptrdiff_t>(i + kPixel), kPixel, out.bytes.begin() + static_cast<std::ptrdiff_t>(i));
    return out;
}

TEST(ExtrapolationNever, DependsOnNothingThatCameBefore) {
    for (int kind = 0; kind < static_cast<int>(case_kinds().size()); ++kind)
        for (const std::uint32_t seed : {5u, 29u, 57u}) {
            const MovingCase c = moving_case(kind, seed);
            const Picture a = c.at(0), b = c.at(1);
            Picture first(c.width, c.height, Format::rgba8), again = first;
            const Gaze gaze{0.6f * static_cast<float>(c.width), 0.4f * static_cast<float>(c.height), 20, 48};
            for (const Gaze* gazed : {static_cast<const Gaze*>(nullptr), &gaze}) {
                auto fresh = fovea::test::engine(Preset::balanced), used = fovea::test::engine(Preset::balanced, 3);
                ASSERT_EQ(fovea::test::run(fresh, a, b, first, 0.5f, {.gaze = gazed}), Outcome::ok);
                ASSERT_EQ(fovea::test::run(used, turned(a), turned(b), again, 0.5f, {.gaze = gazed}), Outcome::ok);
                ASSERT_EQ(fovea::test::run(used, a, b, again, 0.5f, {.gaze = gazed}), Outcome::ok);
                EXPECT_TRUE(first == again) << c.name << (gazed != nullptr ? ", gaze" : "");
            }
        }
}

}  // namespace
