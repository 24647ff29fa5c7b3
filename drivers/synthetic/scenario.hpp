// What a synthetic eye and its tracker do: one table of the scenario file per effect; what is absent costs nothing.
//
// Source of each default: docs/synthetic_eye.md. Errors: file:line:column, the key and its legal range.
// Threads: plain data and pure functions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace fovea::drivers::synthetic {

// The numbers choose the random streams: an effect never gets another's, and a new one goes to the end.
enum class Effect : std::uint8_t {
    fixations, saccades, post_saccadic_oscillation, microsaccades, drift, tremor, pursuit, vergence, blinks, head,
    vestibulo_ocular_reflex, slip, miscalibration, noise, quantisation, rate_jitter, latency, drop_outs,
};
inline constexpr std::size_t kEffectCount = 18;

struct Fixations {
    std::string pattern = "search";  // search, reading, targets, hold
    double median_ms = 250, spread = 0.35;
    double width_deg = 30, height_deg = 20;
    double amplitude_deg = 4, amplitude_spread = 0.8;
    double regressions = 0.15;
    int rows = 3, columns = 3;
    double reaction_ms = 200;
};
struct Saccades {
    double duration_slope_ms_per_deg = 2.2, duration_intercept_ms = 21;
    double peak_ratio = 1.65;
    double skew_per_ms = 0.0015;
    double scatter = 0.08;
};
struct PostSaccadicOscillation {
    double share = 0.06, largest_deg = 1.0, frequency_hz = 25, decay_ms = 12;
};
struct Microsaccades {
    double rate_hz = 1.5, amplitude_deg = 0.3, amplitude_spread = 0.5, duration_ms = 25;
};
struct Drift {
    double speed_deg_s = 0.8, steps_per_s = 250;
};
struct Tremor {
    double amplitude_deg = 0.005, lowest_hz = 70, highest_hz = 100;
};
struct Pursuit {
    double speed_deg_s = 12, gain = 0.9, segment_s = 1.5, extent_deg = 15, time_constant_ms = 70;
};
struct Vergence {
    double near_m = 0.4, far_m = 4, hold_s = 2, eyes_apart_mm = 63, time_constant_ms = 160;
};
struct Blinks {
    double rate_per_min = 15, duration_ms = 200, spread = 0.25, artefact_deg = 12, lost_below = 0.35;
    bool openness = true;
};
struct Head {
    double yaw_deg = 20, pitch_deg = 8, turn_ms = 450, interval_s = 1.2;
};
struct VestibuloOcularReflex {
    double gain = 0.97, latency_ms = 10;
};
struct Slip {
    double rate_per_min = 4, step_deg = 0.8, creep_deg_per_min = 0.5;
};
struct Miscalibration {
    double offset_x_deg = 1.5, offset_y_deg = -1, gain_x = 1.06, gain_y = 0.95, shear = 0.03;
};
struct Noise {
    double std_deg = 0.1, colour = 0;
};
struct Quantisation {
    double step_deg = 0.05;
};
struct RateJitter {
    double std_ms = 0.3;
};
struct Latency {
    double least_ms = 6, mean_ms = 8;
};
struct DropOuts {
    double rate_per_min = 6, duration_ms = 60, missing = 0.5;
};

struct Scenario {
    std::string name = "unnamed";
    std::uint64_t seed = 1;
    double duration_s = 30;  // as a device: 0 is without end
    double rate_hz = 1000;
    bool binocular = false;  // the tracker also gives each eye

    std::optional<Fixations> fixations;
    std::optional<Saccades> saccades;
    std::optional<PostSaccadicOscillation> post_saccadic_oscillation;
    std::optional<Microsaccades> microsaccades;
    std::optional<Drift> drift;
    std::optional<Tremor> tremor;
    std::optional<Pursuit> pursuit;
    std::optional<Vergence> vergence;
    std::optional<Blinks> blinks;
    std::optional<Head> head;
    std::optional<VestibuloOcularReflex> vestibulo_ocular_reflex;
    std::optional<Slip> slip;
    std::optional<Miscalibration> miscalibration;
    std::optional<Noise> noise;
    std::optional<Quantisation> quantisation;
    std::optional<RateJitter> rate_jitter;
    std::optional<Latency> latency;
    std::optional<DropOuts> drop_outs;
};

[[nodiscard]] const char* to_string(Effect effect) noexcept;  // the name of its table
[[nodiscard]] bool has(const Scenario& scenario, Effect effect) noexcept;
// Takes one effect, and whatever cannot be without it, out of the scenario; false when there is no effect of that name.
bool remove(Scenario& scenario, std::string_view effect) noexcept;
// Every effect, with its defaults.
[[nodiscard]] Scenario everything();

// `name` stands before line and column in errors.
[[nodiscard]] Result<Scenario> parse_scenario(std::string_view text, const std::string& name);
[[nodiscard]] Result<Scenario> load_scenario(const std::filesystem::path& file);

// Every effect and key with default, legal range and meaning, as a TOML file.
[[nodiscard]] std::string print_keys();

}  // namespace fovea::drivers::synthetic
