#include "drivers/synthetic/synthetic_eye.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocol/sphere.hpp"

namespace fovea::drivers::synthetic {
namespace {

constexpr double kRadians = std::numbers::pi / 180;

Direction<HeadFrame> direction(Offset o) noexcept { return from_azimuth_elevation<HeadFrame>({o.x_deg * kRadians, o.y_deg * kRadians}); }

Offset degrees(Direction<HeadFrame> d) noexcept {
    const AzimuthElevation a = to_azimuth_elevation(d);
    return {a.azimuth_rad / kRadians, a.elevation_rad / kRadians};
}

// The rotation that takes straight ahead to azimuth and elevation without rolling: about the vertical, then the pitch.
Rotation<WorldFrame, HeadFrame> turned(Offset o) noexcept {
    const double yaw = -0.5 * o.x_deg * kRadians, pitch = 0.5 * o.y_deg * kRadians;  // half angles; + yaw turns left
    const double cy = std::cos(yaw), sy = std::sin(yaw), cp = std::cos(pitch), sp = std::sin(pitch);
    return {cy * cp, cy * sp, sy * cp, -sy * sp};
}

// The gaze that stays where it was while the head has turned by `turn`.
Direction<HeadFrame> against(const Rotation<WorldFrame, HeadFrame>& turn, Direction<HeadFrame> gaze) noexcept {
    const Vec3<HeadFrame> v = turn.inverse() * Vec3<WorldFrame>{gaze.x, gaze.y, gaze.z};
    return Direction<HeadFrame>::from(v).value_or(gaze);
}

}  // namespace

struct SyntheticEye::State {
    explicit State(const Scenario& scenario) : s{scenario}, interval_ns{1e9 / scenario.rate_hz} {
        if (s.fixations) fixations.emplace(*s.fixations, stream(Effect::fixations));
        if (s.saccades) saccades.emplace(*s.saccades, stream(Effect::saccades));
        if (s.microsaccades) microsaccades.emplace(*s.microsaccades, stream(Effect::microsaccades));
        if (s.drift) drift.emplace(*s.drift, stream(Effect::drift));
        if (s.tremor) tremor.emplace(*s.tremor, stream(Effect::tremor));
        if (s.pursuit) pursuit.emplace(*s.pursuit, stream(Effect::pursuit));
        if (s.vergence) vergence.emplace(*s.vergence, stream(Effect::vergence));
        if (s.blinks) blinks.emplace(*s.blinks, stream(Effect::blinks));
        if (s.head) head.emplace(*s.head, stream(Effect::head));
        if (s.slip) slip.emplace(*s.slip, stream(Effect::slip));
        if (s.noise)
            for (std::uint32_t eye = 0; eye < (s.binocular ? 2u : 1u); ++eye) noise[eye].emplace(*s.noise, stream(Effect::noise), eye);
        if (s.drop_outs) drop_outs.emplace(*s.drop_outs, stream(Effect::drop_outs));
    }

    [[nodiscard]] RandomStream stream(Effect effect) const noexcept { return {s.seed, static_cast<std::uint32_t>(effect)}; }
    [[nodiscard]] static Offset& part(SyntheticSample& out, Effect effect) noexcept { return out.parts[static_cast<std::size_t>(effect)]; }

    // Where the gaze goes in space, by the eyes' own movements; sets out.movement.
    Offset wander(std::int64_t t, SyntheticSample& out) noexcept {
        Offset sum;
        const auto add = [&](Effect effect, Offset o) {
            part(out, effect) = o;
            sum = sum + o;
        };
        if (microsaccades) add(Effect::microsaccades, microsaccades->at(t));
        if (drift) add(Effect::drift, drift->at(t));
        if (tremor) add(Effect::tremor, tremor->at(t));
        if (pursuit) {
            add(Effect::pursuit, pursuit->at(t));
            out.movement = Movement::pursuit;
        }
        if (fixations) {
            const GazeShift& shift = fixations->at(t);
            add(Effect::fixations, shift.to);
            if (saccades) {
                add(Effect::saccades, saccades->at(shift, t));
                if (shift.index > 0 && t <= saccades->end_ns() && shift.from != shift.to) out.movement = Movement::saccade;
            }
            if (s.post_saccadic_oscillation) {
                const Offset swing = post_saccadic_swing(*s.post_saccadic_oscillation, shift, saccades->end_ns(), t);
                part(out, Effect::post_saccadic_oscillation) = swing;
                if (length(swing) > 0.02 && out.movement != Movement::saccade) out.movement = Movement::post_saccadic;
            }
        }
        return sum;
    }

    void look(std::int64_t t, SyntheticSample& out) noexcept {
        Direction<HeadFrame> gaze = direction(wander(t, out));
        if (head) {
            const Offset now = head->at(t);
            part(out, Effect::head) = now;
            out.sample.head.valid = true;
            out.sample.head.world_from_head = turned(now);
            if (s.vestibulo_ocular_reflex) {
                const Offset sensed = head->at(t - seconds(s.vestibulo_ocular_reflex->latency_ms * 1e-3).count());
                const Offset turn = s.vestibulo_ocular_reflex->gain * sensed;
                part(out, Effect::vestibulo_ocular_reflex) = -1.0 * turn;
                gaze = against(turned(turn), gaze);
            }
        }
        out.truth_dir_head = gaze;
    }

    // What one eye's camera makes of `true_deg`.
    [[nodiscard]] Offset measured(Offset true_deg, Offset common, Offset noise_deg) const noexcept {
        Offset m = true_deg + common + noise_deg;
        if (s.miscalibration) m = miscalibrated(*s.miscalibration, m);
        if (s.quantisation) m = quantised(*s.quantisation, m);
        return m;
    }

    void measure(std::uint64_t number, std::int64_t t, SyntheticSample& out) noexcept {
        double openness = 1;
        Offset common = part(out, Effect::post_saccadic_oscillation);
        if (slip) common = common + (part(out, Effect::slip) = slip->at(t));
        if (blinks) {
            openness = blinks->openness(t);
            if (blinks->running(t)) out.movement = Movement::blink;
            const Offset drag{0, -s.blinks->artefact_deg * (1 - openness) * (1 - openness)};
            part(out, Effect::blinks) = {openness, drag.y_deg};
            common = common + drag;
        }
        bool valid = !blinks || openness >= s.blinks->lost_below;
        if (drop_outs) {
            const auto state = drop_outs->at(t);
            part(out, Effect::drop_outs).x_deg = static_cast<double>(state);
            out.missing = state == DropOutTrain::State::missing;
            valid = valid && state == DropOutTrain::State::none;
        }
        const Offset truth = degrees(out.truth_dir_head);
        double half = 0;
        if (vergence) half = part(out, Effect::vergence).x_deg = vergence->half_angle_deg(t);
        std::array<Offset, 2> noises{};
        for (std::size_t eye = 0; eye < (s.binocular ? 2u : 1u); ++eye)
            if (noise[eye]) noises[eye] = noise[eye]->at(number);
        const auto put = [&](Eye which, Offset o) {
            EyeState& eye = out.sample.eye(which);
            eye.valid = valid;
            if (valid) eye.gaze_dir_head = direction(o);
            if (blinks && s.blinks->openness) eye.openness = openness;
        };
        if (s.binocular) {
            const Offset left = measured(truth + Offset{half, 0}, common, noises[0]);
            const Offset right = measured(truth - Offset{half, 0}, common, noises[1]);
            put(Eye::left, left);
            put(Eye::right, right);
            put(Eye::combined, 0.5 * (left + right));
            if (s.noise) part(out, Effect::noise) = 0.5 * (noises[0] + noises[1]);
        } else {
            put(Eye::combined, measured(truth, common, noises[0]));
            if (s.noise) part(out, Effect::noise) = noises[0];
        }
        if (s.quantisation || s.miscalibration) note_distortions(truth + common + part(out, Effect::noise), out);
    }

    // The deterministic last stages, as parts: what they added to the combined gaze.
    void note_distortions(Offset before, SyntheticSample& out) const noexcept {
        if (s.miscalibration) {
            const Offset after = miscalibrated(*s.miscalibration, before);
            part(out, Effect::miscalibration) = after - before;
            before = after;
        }
        if (s.quantisation) part(out, Effect::quantisation) = quantised(*s.quantisation, before) - before;
    }

    Scenario s;
    double interval_ns;
    std::uint64_t index = 0;
    std::int64_t newest_arrival_ns = INT64_MIN;
    std::optional<FixationTrain> fixations;
    std::optional<SaccadeTrain> saccades;
    std::optional<MicrosaccadeTrain> microsaccades;
    std::optional<DriftWalk> drift;
    std::optional<TremorWave> tremor;
    std::optional<PursuitTrain> pursuit;
    std::optional<VergenceTrain> vergence;
    std::optional<BlinkTrain> blinks;
    std::optional<HeadTurns> head;
    std::optional<SlipTrain> slip;
    std::array<std::optional<ColouredNoise>, 2> noise;
    std::optional<DropOutTrain> drop_outs;
};

SyntheticEye::SyntheticEye(const Scenario& scenario) : state_{std::make_unique<State>(scenario)} {}
SyntheticEye::SyntheticEye(SyntheticEye&&) noexcept = default;
SyntheticEye& SyntheticEye::operator=(SyntheticEye&&) noexcept = default;
SyntheticEye::~SyntheticEye() = default;

std::int64_t SyntheticEye::even_exposure_ns(std::uint64_t index) const noexcept {
    // Whole seconds apart, so that a day at 3 Hz is still exact to the nanosecond.
    const double samples = static_cast<double>(index), whole = std::floor(samples / state_->s.rate_hz);
    return static_cast<std::int64_t>(whole) * 1'000'000'000 + std::llround((samples - whole * state_->s.rate_hz) * state_->interval_ns);
}

std::int64_t SyntheticEye::exposure_ns(std::uint64_t index) const noexcept {
    const std::int64_t even = even_exposure_ns(index);
    if (!state_->s.rate_jitter || index == 0) return even;
    return even + jitter_ns(*state_->s.rate_jitter, state_->stream(Effect::rate_jitter), index, state_->interval_ns);
}

void SyntheticEye::sample_at(std::uint64_t index, std::int64_t exposed_ns, SyntheticSample& out) noexcept {
    State& s = *state_;
    out = {};
    out.sample.id = index + 1;
    out.sample.device_time.ns = exposed_ns;
    out.sample.exposed = out.sample.received = instant_from_ns(exposed_ns);
    s.look(exposed_ns, out);
    s.measure(index, exposed_ns, out);
    if (s.s.rate_jitter) State::part(out, Effect::rate_jitter).x_deg = static_cast<double>(exposure_ns(index) - even_exposure_ns(index)) * 1e-6;
    if (s.s.latency) {
        const std::int64_t late = latency_ns(*s.s.latency, s.stream(Effect::latency), index);
        State::part(out, Effect::latency).x_deg = static_cast<double>(late) * 1e-6;
        out.sample.received += Duration{late};
    }
}

bool SyntheticEye::next(SyntheticSample& out) noexcept {
    State& s = *state_;
    for (;;) {
        const std::int64_t exposed = exposure_ns(s.index);
        if (s.s.duration_s > 0 && exposed >= seconds(s.s.duration_s).count()) return false;
        sample_at(s.index++, exposed, out);
        if (out.missing) continue;
        // One cable: nothing overtakes.
        s.newest_arrival_ns = std::max(s.newest_arrival_ns, to_ns(out.sample.received));
        out.sample.received = instant_from_ns(s.newest_arrival_ns);
        return true;
    }
}

std::vector<ShownTarget> shown_targets(const Scenario& scenario) {
    std::vector<ShownTarget> targets;
    if (!scenario.fixations || scenario.fixations->pattern != "targets") return targets;
    FixationTrain train(*scenario.fixations, {scenario.seed, static_cast<std::uint32_t>(Effect::fixations)});
    const std::int64_t end = seconds(scenario.duration_s).count();
    const std::int64_t reaction = seconds(scenario.fixations->reaction_ms * 1e-3).count();
    std::int64_t shown = 0;
    for (std::int64_t t = 0; t < end; t = train.next_ns()) {
        const GazeShift& now = train.at(t);
        const std::int64_t gone = std::clamp(train.next_ns() - reaction, shown, end);
        targets.push_back({shown, gone, direction(now.to)});
        shown = gone;
    }
    return targets;
}

}  // namespace fovea::drivers::synthetic
