// Nothing that moves, stands, fades or flickers may come out worse than if the last frame had been shown again.
//
// FOVEA_EXTRAPOLATION_SEEDS=N looks at N pictures of each kind, from FOVEA_EXTRAPOLATION_FIRST_SEED on;
// FOVEA_EXTRAPOLATION_KIND names one kind; FOVEA_EXTRAPOLATION_LIST=1 prints every loss.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>

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

constexpr double kSeen_db = 50;   // less than a level of difference: nobody sees what is beyond

struct Tally {
    int runs = 0, lost = 0, lost_clearly = 0;
    double worst = 0, gain = 0;
    std::string worst_name;
};

TEST(ExtrapolationNever, LosesToRepeatingTheLastFrame) {
    constexpr double kMostLost_db = 0.1;
    const int seeds = number("FOVEA_EXTRAPOLATION_SEEDS", 2), first = number("FOVEA_EXTRAPOLATION_FIRST_SEED", 1);
    const char* only = std::getenv("FOVEA_EXTRAPOLATION_KIND");
    const bool list = std::getenv("FOVEA_EXTRAPOLATION_LIST") != nullptr;
    const auto kinds = case_kinds();
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
                        tally.lost_clearly += lead < -kMostLost_db;
                        tally.gain += std::min(lead, 20.0);
                        const std::string name = c.name + ", factor " + std::to_string(factor) + ", " + preset_name(preset) + (gazed ? ", gaze" : "");
                        if (lead < tally.worst) {
                            tally.worst = lead;
                            tally.worst_name = name;
                        }
                        if (list && lead < -kMostLost_db) std::printf("%s: %.2f dB against %.2f\n", name.c_str(), made, repeated);
                        if (!list) { EXPECT_GE(lead, -kMostLost_db) << name << ": " << made << " dB against " << repeated; }
                    }
            }
        }
        if (list) std::printf("%-20s runs %5d  lost %5d  more than %.1f dB %5d  worst %6.2f dB  gain %5.2f dB   %s\n", kinds[static_cast<std::size_t>(kind)], tally.runs, tally.lost, kMostLost_db,
                              tally.lost_clearly, tally.worst, tally.gain / std::max(tally.runs, 1), tally.worst_name.c_str());
    }
}

}  // namespace
