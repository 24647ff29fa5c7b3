#include <algorithm>
#include <array>
#include <string>

#include "render/foveation/auto.hpp"
#include "render/foveation/dynamic_viewports.hpp"
#include "render/foveation/full.hpp"
#include "render/foveation/inset_outset.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/native_bins.hpp"
#include "render/foveation/native_rates.hpp"
#include "render/foveation/scaled_bins.hpp"

namespace fovea::foveation {
namespace {

NativeCalls calls_of(const MethodSettings& s) { return s.emulate ? NativeCalls{} : s.native != nullptr ? *s.native : driver_calls(); }

constexpr std::array kMethods{
    MethodEntry{"full", "every pixel at full resolution", &Full::create},
    MethodEntry{"scaled_bins", "a grid of bins at 1, 1/2, 1/4 of the resolution by distance from the gaze (QCOM)",
                &create_scaled_bins},
    MethodEntry{"scaled_bins_late", "the same, with the periphery drawn before the gaze is latched and only the fovea after it",
                &ScaledBins::create_late},
    MethodEntry{"inset_outset", "two wide and two narrow views, blended; the narrow ones follow the gaze (Arm)", &InsetOutset::create},
    MethodEntry{"dynamic_viewports", "a coarse view of everything and a sharp one around the gaze, in one atlas (Varjo)", &DynamicViewports::create},
    MethodEntry{"shading_rate", "a map of 1x1, 2x2 and 4x4 tiles around the gaze, applied by level passes (Varjo)", &create_shading_rate},
    MethodEntry{"auto", "scaled_bins where it pays, full where it does not, by what the frames cost", &Auto::create},
    MethodEntry{"auto_late", "the same, and scaled_bins_late where that costs little more: a shorter way from latch to photon", &Auto::create_late},
};

}  // namespace

Result<std::unique_ptr<Method>> create_scaled_bins(const MethodSettings& settings) {
    const NativeCalls calls = calls_of(settings);
    return calls.framebuffer_foveated || calls.texture_foveated ? NativeBins::create(settings, calls) : ScaledBins::create(settings);
}

Result<std::unique_ptr<Method>> create_shading_rate(const MethodSettings& settings) {
    if (auto fine = BinsPlanner::check_rates(settings.shading_rate); !fine) return std::unexpected(fine.error());
    const NativeCalls calls = calls_of(settings);
    return calls.rate_attachment || calls.rate_per_draw ? NativeRates::create(settings, calls) : ScaledBins::create_rates(settings);
}

std::span<const MethodEntry> methods() noexcept { return kMethods; }

Result<void> check_method(std::string_view name) {
    std::string known;
    for (const MethodEntry& m : kMethods) {
        if (name == m.name) return {};
        known += (known.empty() ? "" : ", ") + std::string(m.name);
    }
    return fail("unknown foveation method '" + std::string(name) + "'", {}, "known methods: " + known);
}

Result<std::unique_ptr<Method>> create_method(std::string_view name, const MethodSettings& settings) {
    if (auto known = check_method(name); !known) return std::unexpected(known.error());
    return std::ranges::find_if(kMethods, [&](const MethodEntry& m) { return name == m.name; })->create(settings);
}

}  // namespace fovea::foveation
