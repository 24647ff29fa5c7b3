// A person's calibration file, as `fovea calibrate` writes it: one table [calibration.EYE] per eye.
//
// Errors: a file that cannot be read, that is no TOML, that has no eye, an unknown eye or a torn table; with the file's name
// and the way out. Threads: pure but for reading the file.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/pipeline/pipeline.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::service {

using EyeCalibrations = std::array<std::optional<pipeline::Calibration>, kEyeCount>;  // by Eye

// `where` stands before what is said in errors.
[[nodiscard]] Result<EyeCalibrations> parse_calibrations(const std::string& text, const std::string& where);
[[nodiscard]] Result<EyeCalibrations> load_calibrations(const std::filesystem::path& file);

// A pipeline with the calibrations of `file` in it; an empty name: with none.
[[nodiscard]] Result<pipeline::Pipeline> create_pipeline(const pipeline::PipelineSettings& settings, const std::string& file);

}  // namespace fovea::service
