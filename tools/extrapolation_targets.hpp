// What `fovea tradeoff extrapolation` has measured, held against what the extrapolation is to reach: each target as the ratios and
// differences of one run, with its median and its worst case, so that a mean hides nothing.
//
// Input: scores of every method in the same order of cases. Processor time in ms, PSNR in dB.
// Threads: pure.
#pragma once

#include <string>
#include <vector>

namespace fovea::tools {

struct ExtrapolationScore {
    double psnr_db = 0, ssim = 0, ms = 0;
};
struct ExtrapolationCase {
    std::string scene;
    double speed = 1;
    int seed = 0;   // 0: the scenes that everything was tuned on
};
[[nodiscard]] std::string case_name(const ExtrapolationCase& c);   // "rotation/1", of another seed "rotation/1#3"

struct MethodScores {
    std::string method;
    const std::vector<ExtrapolationScore>* scores;   // one per case
};

struct TargetLine {
    std::string target, unit;        // unit: "dB" or "x"
    double limit = 0;                // the worst may reach it; dB: at least, x: at most
    double median = 0, worst = 0;    // over the cases that count
    std::string worst_case;
    int cases = 0, missed = 0;
};
// Of each target the cases that tell something about it: a cut has no motion to find, and "partly static" is the scene of objects
// before a still room. Lines whose methods were not measured, or that no case tells about, are absent.
[[nodiscard]] std::vector<TargetLine> extrapolation_targets(const std::vector<MethodScores>& methods, const std::vector<ExtrapolationCase>& cases);

}  // namespace fovea::tools
