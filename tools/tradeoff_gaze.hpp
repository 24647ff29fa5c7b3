// The judgements behind `fovea tradeoff`: each runs methods over recordings and returns tables and plots.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/judge_predictions.hpp"
#include "tools/tradeoff_report.hpp"

namespace fovea::tools {

struct TradeoffRequest {
    const std::vector<LoadedRecording>& recordings;
    std::vector<std::int64_t> horizons_ns;
    bool groups = false;
    std::function<void(const std::string& what, std::size_t done, std::size_t of)> progress;
};

struct TradeoffResult {
    std::vector<TradeoffTable> tables;  // empty: nothing to judge by, and `missing` says what it needs
    std::vector<TradeoffPlot> plots;
    std::string missing;
};

[[nodiscard]] TradeoffResult judge_predictors(const TradeoffRequest& request);
[[nodiscard]] TradeoffResult judge_filters(const TradeoffRequest& request);
[[nodiscard]] TradeoffResult judge_classifiers(const TradeoffRequest& request);
[[nodiscard]] TradeoffResult judge_foveas(const TradeoffRequest& request);

}  // namespace fovea::tools
