// The visible table of a scenario's keys: name, legal range and meaning of every one. Reading, printing and checking all
// go through it.
//
// Threads: pure functions.
#pragma once

#include "drivers/synthetic/scenario.hpp"

namespace fovea::drivers::synthetic {

// V has number(name, double&, least, most, doc), whole(name, int&, least, most, doc),
// choice(name, std::string&, words, doc) and flag(name, bool&, doc).
template <class V>
void keys(Fixations& e, V&& v) {
    v.choice("pattern", e.pattern, "search reading targets hold", "where the person looks next");
    v.number("median_ms", e.median_ms, 150, 60000, "median time from one saccade to the next");
    v.number("spread", e.spread, 0, 1.5, "deviation of its logarithm");
    v.number("width_deg", e.width_deg, 0, 120, "where the gaze stays: the whole width");
    v.number("height_deg", e.height_deg, 0, 90, "and height");
    v.number("amplitude_deg", e.amplitude_deg, 0.1, 60, "search, reading: median saccade");
    v.number("amplitude_spread", e.amplitude_spread, 0, 2, "deviation of its logarithm");
    v.number("regressions", e.regressions, 0, 0.5, "reading: share of saccades that go back");
    v.whole("rows", e.rows, 1, 20, "targets: grid of targets that are shown one after another");
    v.whole("columns", e.columns, 1, 20, "targets: its columns");
    v.number("reaction_ms", e.reaction_ms, 0, 2000, "targets: from the target's appearance to the saccade");
}
template <class V>
void keys(Saccades& e, V&& v) {
    v.number("duration_slope_ms_per_deg", e.duration_slope_ms_per_deg, 0, 10, "main sequence: duration per degree");
    v.number("duration_intercept_ms", e.duration_intercept_ms, 1, 100, "and of the smallest saccade");
    v.number("peak_ratio", e.peak_ratio, 1.2, 3, "peak over mean speed");
    v.number("skew_per_ms", e.skew_per_ms, 0, 0.005, "how much earlier the peak comes, of the duration, per ms beyond 30 ms");
    v.number("scatter", e.scatter, 0, 0.5, "deviation of the speed from one saccade to the next");
}
template <class V>
void keys(PostSaccadicOscillation& e, V&& v) {
    v.number("share", e.share, 0, 0.5, "first swing over the saccade's amplitude");
    v.number("largest_deg", e.largest_deg, 0, 5, "but no more than this");
    v.number("frequency_hz", e.frequency_hz, 5, 100, "of the swing");
    v.number("decay_ms", e.decay_ms, 1, 200, "time constant");
}
template <class V>
void keys(Microsaccades& e, V&& v) {
    v.number("rate_hz", e.rate_hz, 0.05, 4, "how many per second");
    v.number("amplitude_deg", e.amplitude_deg, 0.01, 1, "median amplitude; none is above 1");
    v.number("amplitude_spread", e.amplitude_spread, 0, 1.5, "deviation of its logarithm");
    v.number("duration_ms", e.duration_ms, 5, 60, "of each");
}
template <class V>
void keys(Drift& e, V&& v) {
    v.number("speed_deg_s", e.speed_deg_s, 0.01, 10, "along its path");
    v.number("steps_per_s", e.steps_per_s, 10, 2000, "of the self-avoiding walk");
}
template <class V>
void keys(Tremor& e, V&& v) {
    v.number("amplitude_deg", e.amplitude_deg, 0, 0.1, "deviation, each axis");
    v.number("lowest_hz", e.lowest_hz, 10, 200, "band");
    v.number("highest_hz", e.highest_hz, 10, 200, "band; not below lowest_hz");
}
template <class V>
void keys(Pursuit& e, V&& v) {
    v.number("speed_deg_s", e.speed_deg_s, 0.5, 90, "of the target, mean");
    v.number("gain", e.gain, 0, 1.2, "eye's speed over the target's");
    v.number("segment_s", e.segment_s, 0.2, 60, "how long the target keeps its way");
    v.number("extent_deg", e.extent_deg, 1, 40, "beyond this it turns back");
    v.number("time_constant_ms", e.time_constant_ms, 5, 500, "of the eye's speed");
}
template <class V>
void keys(Vergence& e, V&& v) {
    v.number("near_m", e.near_m, 0.1, 100, "nearest depth");
    v.number("far_m", e.far_m, 0.1, 100, "farthest depth; not below near_m");
    v.number("hold_s", e.hold_s, 0.3, 60, "mean time at one depth");
    v.number("eyes_apart_mm", e.eyes_apart_mm, 40, 80, "between the eyes");
    v.number("time_constant_ms", e.time_constant_ms, 20, 1000, "of the change");
}
template <class V>
void keys(Blinks& e, V&& v) {
    v.number("rate_per_min", e.rate_per_min, 0.1, 60, "how many a minute");
    v.number("duration_ms", e.duration_ms, 80, 1000, "median, from the lid's first movement to its last");
    v.number("spread", e.spread, 0, 1, "deviation of its logarithm");
    v.number("artefact_deg", e.artefact_deg, 0, 60, "how far the falling lid drags the measured gaze down");
    v.number("lost_below", e.lost_below, 0, 1, "openness below which the tracker gives no gaze");
    v.flag("openness", e.openness, "the tracker reports openness");
}
template <class V>
void keys(Head& e, V&& v) {
    v.number("yaw_deg", e.yaw_deg, 0, 60, "how far the head turns to either side, deviation");
    v.number("pitch_deg", e.pitch_deg, 0, 45, "up and down, deviation");
    v.number("turn_ms", e.turn_ms, 100, 5000, "how long one turn takes");
    v.number("interval_s", e.interval_s, 0.1, 60, "mean rest between turns");
}
template <class V>
void keys(VestibuloOcularReflex& e, V&& v) {
    v.number("gain", e.gain, 0, 1.2, "eye's turn against the head's");
    v.number("latency_ms", e.latency_ms, 0, 100, "how much later");
}
template <class V>
void keys(Slip& e, V&& v) {
    v.number("rate_per_min", e.rate_per_min, 0.1, 120, "how often the headset slips");
    v.number("step_deg", e.step_deg, 0, 20, "what one slip shifts the measured gaze by, deviation, each axis");
    v.number("creep_deg_per_min", e.creep_deg_per_min, 0, 20, "slow creep in one direction");
}
template <class V>
void keys(Miscalibration& e, V&& v) {
    v.number("offset_x_deg", e.offset_x_deg, -20, 20, "what the tracker shows straight ahead, + right");
    v.number("offset_y_deg", e.offset_y_deg, -20, 20, "and + up");
    v.number("gain_x", e.gain_x, 0.3, 3, "measured over true, horizontal");
    v.number("gain_y", e.gain_y, 0.3, 3, "and vertical");
    v.number("shear", e.shear, -0.5, 0.5, "measured horizontal per true vertical");
}
template <class V>
void keys(Noise& e, V&& v) {
    v.number("std_deg", e.std_deg, 0, 20, "deviation, each eye and axis");
    v.number("colour", e.colour, 0, 2, "exponent of 1/f: 0 white, 1 pink, 2 brown");
}
template <class V>
void keys(Quantisation& e, V&& v) {
    v.number("step_deg", e.step_deg, 1e-6, 5, "measured gaze comes in multiples of this");
}
template <class V>
void keys(RateJitter& e, V&& v) {
    v.number("std_ms", e.std_ms, 0, 1000, "of the exposure time; at most 0.45 of the interval is used");
}
template <class V>
void keys(Latency& e, V&& v) {
    v.number("least_ms", e.least_ms, 0, 1000, "from exposure to arrival, at best");
    v.number("mean_ms", e.mean_ms, 0, 1000, "and on average; not below least_ms");
}
template <class V>
void keys(DropOuts& e, V&& v) {
    v.number("rate_per_min", e.rate_per_min, 0.1, 600, "how many a minute");
    v.number("duration_ms", e.duration_ms, 1, 60000, "mean");
    v.number("missing", e.missing, 0, 1, "share in which nothing comes; in the others invalid samples come");
}

// V is called with (Effect, name, the optional table, doc).
template <class S, class V>
void effects(S& s, V&& v) {
    v(Effect::fixations, "fixations", s.fixations, "where the person looks, and for how long; absent: straight ahead");
    v(Effect::saccades, "saccades", s.saccades, "how the eye goes from one fixation to the next; absent: it jumps; needs [fixations]");
    v(Effect::post_saccadic_oscillation, "post_saccadic_oscillation", s.post_saccadic_oscillation, "the pupil swings on behind a saccade (the tracker sees it, the eyeball does not turn); needs [saccades]");
    v(Effect::microsaccades, "microsaccades", s.microsaccades, "small saccades within a fixation");
    v(Effect::drift, "drift", s.drift, "slow drift within a fixation: a self-avoiding walk");
    v(Effect::tremor, "tremor", s.tremor, "fast tremor");
    v(Effect::pursuit, "pursuit", s.pursuit, "smooth pursuit of a moving target");
    v(Effect::vergence, "vergence", s.vergence, "the eyes turn to near and far; seen by a binocular tracker");
    v(Effect::blinks, "blinks", s.blinks, "blinks, with what trackers make of them");
    v(Effect::head, "head", s.head, "the head turns; the tracker reports its pose");
    v(Effect::vestibulo_ocular_reflex, "vestibulo_ocular_reflex", s.vestibulo_ocular_reflex, "the eyes turn against the head; needs [head]");
    v(Effect::slip, "slip", s.slip, "the headset slips on the face");
    v(Effect::miscalibration, "miscalibration", s.miscalibration, "the tracker is calibrated for somebody else");
    v(Effect::noise, "noise", s.noise, "the tracker's noise");
    v(Effect::quantisation, "quantisation", s.quantisation, "the tracker's coarse steps");
    v(Effect::rate_jitter, "rate_jitter", s.rate_jitter, "exposures that are not evenly spaced");
    v(Effect::latency, "latency", s.latency, "samples arrive late");
    v(Effect::drop_outs, "drop_outs", s.drop_outs, "samples that are invalid or do not come");
}

}  // namespace fovea::drivers::synthetic
