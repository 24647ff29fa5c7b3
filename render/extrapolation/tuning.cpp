#include "render/extrapolation/tuning.hpp"

#include <cstring>

namespace fovea::render::extrapolation {

namespace {

constexpr const char* kNames[] = {"draft", "fast", "balanced", "best"};

}  // namespace

const char* preset_name(Preset p) noexcept { return kNames[static_cast<int>(p)]; }

std::optional<Preset> preset_from_name(const char* name) noexcept {
    for (const Preset p : kPresets)
        if (std::strcmp(name, preset_name(p)) == 0) return p;
    return std::nullopt;
}

Tuning tuning_of(Preset preset) noexcept {
    switch (preset) {
        case Preset::draft: return {.cell_px = 2, .iterations = 1, .passes = 3, .balance_rounds = 4, .stiffness = 120, .backward_level = -1, .smoothing_passes = 0, .cubic = true};
        case Preset::fast: return {.cell_px = 2, .iterations = 1, .passes = 3, .balance_rounds = 10, .stiffness = 120, .backward_level = -1, .smoothing_passes = 1, .cubic = true};
        case Preset::balanced: return {.cell_px = 2, .iterations = 1, .passes = 3, .balance_rounds = 14, .stiffness = 120, .backward_level = 1, .smoothing_passes = 1, .cubic = true};
        case Preset::best: return {.cell_px = 2, .iterations = 2, .passes = 3, .balance_rounds = 20, .stiffness = 110, .backward_level = 0, .smoothing_passes = 1, .cubic = true};
    }
    return {};
}

}  // namespace fovea::render::extrapolation
