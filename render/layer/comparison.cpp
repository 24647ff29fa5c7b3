#include "render/layer/comparison.hpp"

#include <algorithm>
#include <cstdio>
#include <deque>

namespace fovea::layer {
namespace {

template <class Range, class Value>
double quantile(const Range& range, double part, Value value) {
    std::vector<double> values;
    values.reserve(range.size());
    for (const auto& r : range) values.push_back(static_cast<double>(value(r)));
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

}  // namespace

void Comparison::frame_ended(std::int64_t now_ns, std::int64_t processor_ns) {
    const std::lock_guard lock(mutex_);
    constexpr float kMs = 1e-6f;
    const Times times{static_cast<float>(processor_ns - last_processor_ns_) * kMs, static_cast<float>(now_ns - last_ns_) * kMs};
    last_ns_ = now_ns;
    last_processor_ns_ = processor_ns;
    if (frame_ > 0) block_[static_cast<std::size_t>(frame_ - 1)] = times;
    if (++frame_ <= kMeasured) return;
    frame_ = 0;
    cycle_[static_cast<std::size_t>(way_)] = {static_cast<float>(quantile(block_, 0.5, [](const Times& t) { return t.processor_ms; })),
                                              static_cast<float>(quantile(block_, 0.5, [](const Times& t) { return t.time_ms; }))};
    if (++block_of_cycle_ == 3) {
        block_of_cycle_ = 0;
        backwards_ = !backwards_;
        if (warm_ < kWarmCycles)
            ++warm_;
        else if (cycles_.size() < kMostCycles)
            cycles_.push_back(cycle_);
    }
    way_ = static_cast<Way>(backwards_ ? 2 - block_of_cycle_ : block_of_cycle_);
}

std::optional<Comparison::Result> Comparison::result() const {
    const std::lock_guard lock(mutex_);
    if (cycles_.empty()) return std::nullopt;
    const auto ratio = [this](Way way, float Times::* of) {
        const auto value = [way, of](const Cycle& c) {
            const float whole = c[static_cast<std::size_t>(Way::straight)].*of;
            return whole > 0 ? c[static_cast<std::size_t>(way)].*of / whole : 1.0f;
        };
        return Ratio{quantile(cycles_, 0.5, value), quantile(cycles_, 0.25, value), quantile(cycles_, 0.75, value)};
    };
    const auto straight = [this](float Times::* of) {
        return quantile(cycles_, 0.5, [of](const Cycle& c) { return c[static_cast<std::size_t>(Way::straight)].*of; });
    };
    return Result{.pairs = cycles_.size(),
                  .processor_ms = straight(&Times::processor_ms),
                  .time_ms = straight(&Times::time_ms),
                  .recorded_processor = ratio(Way::recorded, &Times::processor_ms),
                  .recorded_time = ratio(Way::recorded, &Times::time_ms),
                  .levels_processor = ratio(Way::levels, &Times::processor_ms),
                  .levels_time = ratio(Way::levels, &Times::time_ms)};
}

namespace {
struct Comparisons {
    std::mutex mutex;
    std::deque<Comparison> all;
};
Comparisons& comparisons() {
    static auto* instance = new Comparisons;
    return *instance;
}
}  // namespace

Comparison* new_comparison() {
    const std::lock_guard lock(comparisons().mutex);
    return &comparisons().all.emplace_back();
}

std::string comparison_json() {
    std::optional<Comparison::Result> most;
    {
        const std::lock_guard lock(comparisons().mutex);
        for (const Comparison& c : comparisons().all)
            if (auto r = c.result(); r && (!most || r->pairs > most->pairs)) most = r;
    }
    if (!most) return "null";
    std::string out = "{\"pairs\": " + std::to_string(most->pairs);
    const auto number = [](double value) {
        char text[32];
        std::snprintf(text, sizeof text, "%.4f", value);
        return std::string(text);
    };
    out += ", \"processor_ms\": " + number(most->processor_ms) + ", \"time_ms\": " + number(most->time_ms);
    const auto ratio = [&](const char* name, const Comparison::Ratio& r) {
        out += std::string(", \"") + name + "\": [" + number(r.low) + ", " + number(r.median) + ", " + number(r.high) + "]";
    };
    ratio("recorded_processor", most->recorded_processor);
    ratio("recorded_time", most->recorded_time);
    ratio("levels_processor", most->levels_processor);
    ratio("levels_time", most->levels_time);
    return out + "}";
}

}  // namespace fovea::layer
