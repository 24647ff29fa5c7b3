// What the three programs check of their command lines alike.
//
// Threads: pure functions. Errors: a validator answers in words, which CLI11 puts behind the option's name.
#pragma once

namespace CLI {
class Validator;
}

namespace fovea::command_line {

// A number within [low, high], which NaN is not. (CLI::Range lets NaN through: it is neither below nor above anything.)
[[nodiscard]] CLI::Validator within(double low, double high);

// The name of a file, which "" (a variable that a script forgot) is not.
[[nodiscard]] CLI::Validator file_name();

}  // namespace fovea::command_line
