#include "tools/extrapolation_targets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

namespace fovea::tools {

namespace {

struct Judge {
    const std::vector<MethodScores>& methods;
    const std::vector<ExtrapolationCase>& cases;
    std::vector<TargetLine> lines;

    [[nodiscard]] const std::vector<ExtrapolationScore>* find(const char* name) const {
        for (const MethodScores& m : methods)
            if (m.method == name) return m.scores;
        return nullptr;
    }
    // `value` of the cases for which `counts` holds; a unit of dB wants it large, x small.
    void line(std::string target, const char* unit, double limit, const std::function<bool(const ExtrapolationCase&)>& counts,
              const std::function<double(std::size_t)>& value) {
        const bool large = std::string_view(unit) == "dB";
        TargetLine l{std::move(target), unit, limit, 0, 0, {}, 0, 0};
        std::vector<double> values;
        for (std::size_t i = 0; i < cases.size(); ++i) {
            if (!counts(cases[i])) continue;
            const double v = value(i);
            if (values.empty() || (large ? v < l.worst : v > l.worst)) {
                l.worst = v;
                l.worst_case = case_name(cases[i]);
            }
            l.missed += (large ? v < limit : v > limit) ? 1 : 0;
            values.push_back(v);
        }
        if (values.empty()) return;
        std::sort(values.begin(), values.end());
        const std::size_t half = values.size() / 2;
        l.median = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
        l.cases = static_cast<int>(values.size());
        lines.push_back(std::move(l));
    }
    // The mean over the scenes, one value for each speed of each seed.
    void means(std::string target, const char* unit, double limit, const std::function<double(const std::vector<std::size_t>&)>& value) {
        std::vector<ExtrapolationCase> groups;
        std::vector<std::vector<std::size_t>> members;
        for (std::size_t i = 0; i < cases.size(); ++i) {
            if (cases[i].scene == "cut") continue;
            const auto same = std::find_if(groups.begin(), groups.end(), [&](const ExtrapolationCase& g) { return g.speed == cases[i].speed && g.seed == cases[i].seed; });
            const auto at = static_cast<std::size_t>(same - groups.begin());
            if (same == groups.end()) {
                groups.push_back({"mean", cases[i].speed, cases[i].seed});
                members.emplace_back();
            }
            members[at].push_back(i);
        }
        Judge of_groups{methods, groups, {}};
        of_groups.line(std::move(target), unit, limit, [](const ExtrapolationCase&) { return true; }, [&](std::size_t g) { return value(members[g]); });
        lines.insert(lines.end(), of_groups.lines.begin(), of_groups.lines.end());
    }
};

}  // namespace

std::string case_name(const ExtrapolationCase& c) { return c.seed == 0 ? fmt::format("{}/{:g}", c.scene, c.speed) : fmt::format("{}/{:g}#{}", c.scene, c.speed, c.seed); }

std::vector<TargetLine> extrapolation_targets(const std::vector<MethodScores>& methods, const std::vector<ExtrapolationCase>& cases) {
    using Scores = std::vector<ExtrapolationScore>;
    Judge j{methods, cases, {}};
    const auto db = [](const Scores& a, const Scores& b) { return [&a, &b](std::size_t i) { return a[i].psnr_db - b[i].psnr_db; }; };
    const auto ratio = [](const Scores& a, const Scores& b) {
        return [&a, &b](const std::vector<std::size_t>& of) {
            double x = 0, y = 0;
            for (const std::size_t i : of) {
                x += a[i].ms;
                y += b[i].ms;
            }
            return x / std::max(y, 1e-9);
        };
    };
    const auto mean_db = [](const Scores& a, const Scores& b) {
        return [&a, &b](const std::vector<std::size_t>& of) {
            double sum = 0;
            for (const std::size_t i : of) sum += a[i].psnr_db - b[i].psnr_db;
            return sum / static_cast<double>(of.size());
        };
    };
    const auto moves = [](const ExtrapolationCase& c) { return c.scene != "cut" && c.speed > 0; };
    const auto* hold = j.find("hold");
    for (const char* preset : {"draft", "fast", "balanced", "best"})
        if (const auto* p = j.find(preset); p != nullptr && hold != nullptr) {
            // Up to speed 1; beyond, it must only never lose.
            j.line(fmt::format("{} above hold, speeds to 1", preset), "dB", 7, [&](const auto& c) { return moves(c) && c.speed <= 1; }, db(*p, *hold));
            j.line(fmt::format("{} above hold, always", preset), "dB", 0, [](const auto&) { return true; }, db(*p, *hold));
        }
    const auto *fast = j.find("fast"), *balanced = j.find("balanced"), *known = j.find("known-motion"), *ahead = j.find("known-ahead"), *gaze = j.find("balanced+gaze");
    const auto *ultrafast = j.find("dis-ultrafast"), *dis_fast = j.find("dis-fast"), *medium = j.find("dis-medium");
    if (fast != nullptr && ultrafast != nullptr) {
        j.line("fast above dis-ultrafast", "dB", -0.5, moves, db(*fast, *ultrafast));
        j.means("fast, time of dis-ultrafast", "x", 1.2, ratio(*fast, *ultrafast));
    }
    if (balanced != nullptr && dis_fast != nullptr) {
        j.line("balanced above dis-fast", "dB", 0, moves, db(*balanced, *dis_fast));
        j.means("balanced, time of dis-fast", "x", 1, ratio(*balanced, *dis_fast));
    }
    for (const auto& [name, scores] : {std::pair{"known-motion", known}, std::pair{"known-ahead", ahead}}) {
        if (scores == nullptr) continue;
        if (medium != nullptr) {
            j.means(fmt::format("{} above dis-medium, mean", name), "dB", 3, mean_db(*scores, *medium));
            j.line(fmt::format("{} above dis-medium", name), "dB", 3, moves, db(*scores, *medium));
        }
        if (ultrafast != nullptr) j.means(fmt::format("{}, time of dis-ultrafast", name), "x", 1, ratio(*scores, *ultrafast));
    }
    if (gaze != nullptr && balanced != nullptr)
        j.line("balanced+gaze, time of balanced, same frame", "x", 1.0 / 3, [](const auto& c) { return c.scene == "object"; }, [&](std::size_t i) { return (*gaze)[i].ms / std::max((*balanced)[i].ms, 1e-9); });
    return std::move(j.lines);
}

}  // namespace fovea::tools
