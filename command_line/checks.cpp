#include "command_line/checks.hpp"

#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace fovea::command_line {

CLI::Validator within(double low, double high) {
    return CLI::Validator(
        [low, high](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
            return fmt::format("Value {} not in range {:g} to {:g}", text, low, high);
        },
        fmt::format("FLOAT in [{:g} - {:g}]", low, high));
}

CLI::Validator file_name() {
    return CLI::Validator([](std::string& text) { return text.empty() ? std::string("the file's name is empty") : std::string(); }, "FILE");
}

}  // namespace fovea::command_line
