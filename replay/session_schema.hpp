// The tables of a session file and the code of the models' BLOB; documented in docs/session_file.md.
//
// Threads: pure functions.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "protocol/motion_model.hpp"

namespace fovea::replay {

// Real columns are declared without a type: SQLite turns -0.0 into 0 in a column of type REAL.
inline constexpr const char* kSessionTables = R"sql(
CREATE TABLE meta (
  key   TEXT PRIMARY KEY NOT NULL,
  value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE samples (
  n                   INTEGER PRIMARY KEY,  -- 1, 2, 3 ... in order of recording
  id                  INTEGER NOT NULL,
  device_ns           INTEGER NOT NULL,
  exposed_ns          INTEGER NOT NULL,
  received_ns         INTEGER NOT NULL,
  exposed_estimated   INTEGER NOT NULL,
  combined_valid      INTEGER NOT NULL,
  combined_x, combined_y, combined_z,
  combined_openness, combined_pupil_mm, combined_confidence,
  left_valid          INTEGER NOT NULL,
  left_x, left_y, left_z,
  left_openness, left_pupil_mm, left_confidence,
  right_valid         INTEGER NOT NULL,
  right_x, right_y, right_z,
  right_openness, right_pupil_mm, right_confidence,
  head_valid          INTEGER NOT NULL,
  head_w, head_x, head_y, head_z,
  label               INTEGER NOT NULL);
CREATE TABLE truth (
  n                   INTEGER PRIMARY KEY REFERENCES samples (n),
  x, y, z);
CREATE TABLE targets (
  start_ns            INTEGER NOT NULL,
  end_ns              INTEGER NOT NULL,
  x, y, z);
CREATE TABLE focus (
  sequence            INTEGER NOT NULL,
  sample_id           INTEGER NOT NULL,
  exposed_ns          INTEGER NOT NULL,
  received_ns         INTEGER NOT NULL,
  filtered_ns         INTEGER NOT NULL,
  published_ns        INTEGER NOT NULL,
  exposed_estimated   INTEGER NOT NULL,
  event               INTEGER NOT NULL,
  reference_ns        INTEGER NOT NULL,
  x, y, z,
  u_rad_s, v_rad_s,
  eyes_present        INTEGER NOT NULL,
  eyes                BLOB NOT NULL);
CREATE TABLE frames (
  n                   INTEGER PRIMARY KEY,
  client              INTEGER NOT NULL,
  frame               INTEGER NOT NULL,
  model_sequence      INTEGER NOT NULL,
  sample_id           INTEGER NOT NULL,
  exposed_ns          INTEGER NOT NULL,
  received_ns         INTEGER NOT NULL,
  filtered_ns         INTEGER NOT NULL,
  published_ns        INTEGER NOT NULL,
  latched_ns          INTEGER NOT NULL,
  submitted_ns        INTEGER NOT NULL,
  gpu_done_ns         INTEGER NOT NULL,
  photon_ns           INTEGER NOT NULL,
  predicted_photon_ns INTEGER NOT NULL,
  exposed_estimated   INTEGER NOT NULL,
  photon_simulated    INTEGER NOT NULL,
  pixels_shaded       INTEGER NOT NULL,
  pixels_full         INTEGER NOT NULL,
  view_count          INTEGER NOT NULL,
  extrapolated        INTEGER NOT NULL);    -- since schema 2
CREATE TABLE frame_views (
  frame_n             INTEGER NOT NULL REFERENCES frames (n),
  view                INTEGER NOT NULL,
  eye                 INTEGER NOT NULL,
  tan_left, tan_right, tan_up, tan_down,
  head_from_view_w, head_from_view_x, head_from_view_y, head_from_view_z,
  x_ndc, y_ndc, half_width_ndc, half_height_ndc,
  PRIMARY KEY (frame_n, view)) WITHOUT ROWID;
CREATE TABLE events (
  at_ns INTEGER NOT NULL,
  kind  TEXT NOT NULL,
  text  TEXT NOT NULL);
CREATE TABLE counters (
  at_ns INTEGER NOT NULL,
  name  TEXT NOT NULL,
  value INTEGER NOT NULL);
)sql";

// frames.photon_simulated. A Fovea that knows no 2 takes it for simulated: not for measured.
inline constexpr std::uint32_t kPhotonMeasured = 0, kPhotonSimulated = 1, kPhotonEstimated = 2;

// One eye in the BLOB `eyes`: 360 bytes, little-endian, no padding. An absent eye takes no room.
inline constexpr std::size_t kEyeBlobBytes = 360;

// The eyes of `model` that are present, in the order of Eye.
void encode_eyes(const MotionModel& model, std::string& out);
// Fills model.eyes by model.eyes_present; false when the BLOB is not of the length that follows from it.
[[nodiscard]] bool decode_eyes(std::span<const std::byte> blob, MotionModel& model);

}  // namespace fovea::replay
