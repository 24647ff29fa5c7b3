// The check of an option that takes a number: within [low, high], which NaN is not. (CLI::Range lets NaN through: it is
// neither below nor above anything.)
#pragma once

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace fovea::tools {

inline CLI::Validator within(double low, double high) {
    return CLI::Validator(
        [low, high](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
            return fmt::format("Value {} not in range {:g} to {:g}", text, low, high);
        },
        fmt::format("FLOAT in [{:g} - {:g}]", low, high));
}

}  // namespace fovea::tools
