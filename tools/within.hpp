// The checks of options that more than one command has.
#pragma once

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace fovea::tools {

// A number within [low, high], which NaN is not. (CLI::Range lets NaN through: it is neither below nor above anything.)
inline CLI::Validator within(double low, double high) {
    return CLI::Validator(
        [low, high](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
            return fmt::format("Value {} not in range {:g} to {:g}", text, low, high);
        },
        fmt::format("FLOAT in [{:g} - {:g}]", low, high));
}

// The name of a file, which "" (a variable that a script forgot) is not.
inline CLI::Validator file_name() {
    return CLI::Validator([](std::string& text) { return text.empty() ? std::string("the file's name is empty") : std::string(); }, "FILE");
}

}  // namespace fovea::tools
