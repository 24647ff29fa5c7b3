// A gaze recording in memory, whatever file it came from.
//
// Times: `exposed` and `received` count from wherever the file's clock starts; nothing here is on this machine's clock.
// Errors: name file, line and column (or byte), and the way out.
// Threads: plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::replay {

// A per-sample label of the recording's own (hand-made or by a vendor's parser). For judging, never for predicting.
// The numbers are part of the session file.
enum class Label : std::uint8_t { none = 0, fixation = 1, saccade = 2, post_saccadic = 3, pursuit = 4, blink = 5 };
inline constexpr std::uint8_t kLabelCount = 6;
[[nodiscard]] const char* to_string(Label label) noexcept;
[[nodiscard]] std::optional<Label> label_from(std::string_view text) noexcept;  // the inverse of to_string

struct RecordedSample {
    GazeSample sample;
    Label label = Label::none;
    std::optional<Direction<HeadFrame>> truth_dir_head = {};  // where the eye really looked; synthetic recordings know it
};

struct RecordingInfo {
    std::string format;          // the importer that read it, e.g. "fovea_csv"
    std::string device;          // e.g. "SR Research EyeLink 1000"
    std::string source;          // where the data come from
    std::string licence;         // e.g. "MIT"
    double nominal_rate_hz = 0;  // 0: unknown or irregular
    bool has_labels = false;
    bool has_head_pose = false;
    bool has_truth = false;
};

// A target of a calibration, on the clock of `exposed`.
struct TargetShown {
    Instant start, end;
    Direction<HeadFrame> dir_head;
    bool operator==(const TargetShown&) const = default;
};

struct Recording {
    RecordingInfo info;
    std::vector<RecordedSample> samples;  // in file order; ids of the file where it has them, else 1, 2, 3 ...
    std::vector<TargetShown> targets = {};  // what the person was asked to look at; empty where the file does not say
};

// Reads a recording, recognising the format from the content (the name plays no part).
[[nodiscard]] Result<Recording> load_recording(const std::filesystem::path& path);
// The same with a format that the caller knows: one of the names in import/importer.hpp.
[[nodiscard]] Result<Recording> load_recording_as(const std::filesystem::path& path, std::string_view importer);

// Which part of a recording to keep, by the exposure since the first sample. duration < 0: to the end.
void trim(Recording& recording, Duration start, Duration duration);

// The mean rate of exposures that differ, gaps left out; a usual rate when within 3 % of one; 0 if unknown.
[[nodiscard]] double measured_rate_hz(const Recording& recording);

}  // namespace fovea::replay
