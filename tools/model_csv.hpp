// Motion models as CSV rows, every bit of them: two runs that publish the same models write the same bytes.
//
// Times in ns, directions as unit vectors in HeadFrame, angles in radians; numbers in the shortest form that reads
// back as the same value. Threads: pure functions.
#pragma once

#include <string>

#include "protocol/motion_model.hpp"

namespace fovea::tools {

[[nodiscard]] std::string model_csv_header();
// Appends one row, with its line end.
void append_model_csv(std::string& out, const MotionModel& model);

}  // namespace fovea::tools
