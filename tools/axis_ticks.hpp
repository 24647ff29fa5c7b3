// Where the axes of the tools' plots are marked: at round values.
//
// Threads: pure.
#pragma once

#include <vector>

namespace fovea::tools {

// The step that divides `range` into about `parts`, and not more: 1, 2, 2.5 or 5 times a power of ten.
[[nodiscard]] double round_step(double range, double parts);

// The marks of an axis from `low` to `high`, five or six of them. A logarithmic one (low > 0) has 1, 2 and 5 of each decade,
// or powers of ten where those are too many; one that spans too little for three such marks is marked like a linear one.
[[nodiscard]] std::vector<double> axis_ticks(double low, double high, bool log);

}  // namespace fovea::tools
