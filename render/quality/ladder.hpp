// A ladder of quality settings: methods with their parameters, from the best and dearest to the cheapest, with the cost
// and error that were measured for them. Written by `fovea tradeoff foveation --toml`, read by `fovea-view --quality`.
//
//   [quality]
//   pick = "scaled_bins, gain 4"       the setting that is drawn where no budget is to be held
//   [[quality.setting]]
//   label = "scaled_bins, gain 4"
//   method = "scaled_bins"             any but auto; the keys below belong to some methods only
//   gain = 4.0                         fall-off outside the fovea, 1/NDC            scaled_bins, scaled_bins_late
//   executor = "masks"                 or "rectangles"                              scaled_bins
//   cost = 0.35                        of a full frame of the same run, > 0
//   error = 1.9                        against a full render, of 255, >= 0
//
// Source of the built-in ladder: `fovea tradeoff foveation --scenes circuit fragbox --methods scaled_bins --frames 9`, means of
// both scenes on llvmpipe, 2 virtual cores (docs/quality.md).
// Errors: load() names file, line and column, and the keys that there are.
// Threads: plain data, pure functions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "render/foveation/method.hpp"
#include "render/quality/governor.hpp"

namespace fovea::quality {

struct Setting {
    std::string label, method = "full";
    double gain = 4;                        // 1/NDC, 0.1 to 1000
    foveation::MethodSettings parameters;   // those that the file can name; the rest are defaults
    double cost = 1, error = 0;

    // True if both are drawn by the same method with the same targets: changing between them prepares nothing.
    [[nodiscard]] bool same_method(const Setting& other) const noexcept;
};

struct Ladder {
    std::vector<Setting> settings;   // costs fall, 1 to kMaxSettings of them
    std::size_t pick = 0;
    [[nodiscard]] std::vector<double> costs() const;
};

[[nodiscard]] Ladder built_in_ladder();
// Orders by cost, leaves out what is no cheaper than a better one, and checks what is left.
[[nodiscard]] Result<Ladder> make_ladder(std::vector<Setting> settings, std::string_view pick);

[[nodiscard]] Result<Ladder> load_ladder(const std::string& path);
// `name` stands for the file in errors.
[[nodiscard]] Result<Ladder> parse_ladder(std::string_view toml, const std::string& name);
// What parse_ladder reads back equal.
[[nodiscard]] std::string to_toml(const Ladder& ladder);

}  // namespace fovea::quality
