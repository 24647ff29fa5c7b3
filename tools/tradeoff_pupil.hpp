// `fovea tradeoff pupil`: pixel error and detection rate of each pupil detector against its time per frame.
#pragma once

#include "tools/commands.hpp"

namespace fovea::tools {

// Adds the subject `pupil` to `fovea tradeoff`.
void add_tradeoff_pupil(CLI::App& tradeoff, int* exit_code);

}  // namespace fovea::tools
