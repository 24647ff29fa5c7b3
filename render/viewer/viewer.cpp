#include "render/viewer/viewer.hpp"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <memory>

#include <unistd.h>

#include "protocol/clock.hpp"
#include "render/foveation/driver_traits.hpp"
#include "render/foveation/method.hpp"
#include "render/quality/ladder.hpp"
#include "render/scene/source.hpp"
#include "render/viewer/controls.hpp"
#include "render/viewer/eyes.hpp"
#include "render/viewer/finish.hpp"
#include "render/viewer/gaze.hpp"
#include "render/viewer/in_between.hpp"
#include "render/viewer/motion_pass.hpp"
#include "render/viewer/layout.hpp"
#include "render/viewer/measured_gaze.hpp"
#include "render/viewer/mouse.hpp"
#include "render/viewer/pictures.hpp"
#include "render/viewer/record.hpp"
#include "render/viewer/screen.hpp"

namespace fovea::viewer {
namespace {

constexpr Duration kFirstGuess = std::chrono::milliseconds(40);   // of a frame's cost, before there is one
constexpr Duration kPatience = std::chrono::milliseconds(20);     // at most so long is an interrupt not heard
constexpr Duration kTextEvery = std::chrono::milliseconds(250);
constexpr double kWithoutWindow_s = 10;
constexpr std::uint64_t kMostResets = 3;                          // a driver that loses more contexts is given up
constexpr std::size_t kMostAwaited = 64;                          // frames whose photon is not known yet

// What outlives a context that the driver lost; all else is on the GPU, or follows from it.
struct Life {
    Life(const Options& o, Gaze connected, Instant now) : gaze(std::move(connected)), begin(now) {
        controls.method = o.method;
        controls.mouse = o.mouse;
        controls.latch_early = o.latch_early;
        controls.levels = o.levels;
    }
    Gaze gaze;
    Record record;
    Controls controls;
    Instant begin;
    std::uint64_t presented = 0;
    Duration scene_time{0};   // stands still while paused
    gl::Reset lost = gl::Reset::none;   // why the run ended: to be made anew
};

class Viewer {
public:
    Viewer(const Options& options, const std::atomic<bool>& stop, const TimeSource& time, std::unique_ptr<present::Presenter> presenter, Life& life, Eyes eyes)
        : o_(options), stop_(stop), time_(time), life_(life), presenter_(std::move(presenter)), gaze_(life.gaze), eyes_(std::move(eyes)),
          in_between_(options.extrapolate, options.extrapolation_preset), record_(life.record), presented_(life.presented), begin_(life.begin),
          scene_time_(life.scene_time), controls_(life.controls) {
        chosen_ = o_.method;
        for (const auto& m : foveation::methods()) methods_.emplace_back(m.name);
        duration_s_ = o_.duration_s >= 0 ? o_.duration_s : presenter_->surface().shown() ? 0 : kWithoutWindow_s;
    }

    std::expected<Summary, Failure> run() {
        scene_clock_ = time_.now();
        while (!finished()) {
            const auto begin = presenter_->begin_frame(frame_cost_.median(), kPatience);
            if (!begin) return failed(begin.error());
            for (const present::Event& event : presenter_->events()) controls_.handle(event, methods_);
            if (auto r = look_back(); !r) return failed(r.error());
            if (!*begin) continue;
            if (auto r = follow_window(); !r) return failed(r.error());
            Frame frame;
            const bool done = render(frame);
            if (life_.lost != gl::Reset::none) return failed({std::string("the driver lost the context, ") + gl::reset_name(life_.lost), presenter_->context().info().renderer, "start again"});
            if (!done) return failed({"the GPU did not finish a frame in 10 seconds", presenter_->context().info().renderer, "use a smaller --size"});
            const Instant photon = presenter_->photon_of(frame.gpu_done);
            if (auto r = show(frame, frame.gpu_done); !r) return failed(r.error());
            if (auto r = look_back(); !r) return failed(r.error());
            if (in_between_.enabled()) {
                if (auto r = fill_in(frame, photon); !r) return failed(r.error());
                if (auto r = look_back(); !r) return failed(r.error());
            }
            if (snapshot_due()) take_snapshot();
            mark_actual_gaze();
            log_quality();
        log_executor();
            progress(false);
        }
        progress(true);
        return finish();
    }

private:
    [[nodiscard]] bool finished() const noexcept {
        if (stop_.load(std::memory_order_relaxed) || controls_.quit) return true;
        if (o_.frames > 0) return record_.frames() >= static_cast<std::uint64_t>(o_.frames);
        return duration_s_ > 0 && to_seconds(time_.now() - begin_) >= duration_s_;
    }

    // The eyes' pictures take the size that the window has for them, and the method that a key has chosen.
    Result<void> follow_window() {
        surface_ = presenter_->surface();
        if (controls_.method != chosen_) {
            if (auto r = eyes_.choose_method(controls_.method); !r) return r;   // ends what holds a budget
            chosen_ = controls_.method;
        }
        if (!surface_.shown()) return finish_.prepare(eyes_);
        if (!screen_) {
            auto screen = Screen::create();
            if (!screen) return std::unexpected(screen.error());
            screen_.emplace(*std::move(screen));
        }
        places_ = layout(surface_.width_px, surface_.height_px, static_cast<double>(o_.width_px) / o_.height_px);
        if (auto r = eyes_.resize(places_[0].width_px, places_[0].height_px); !r) return r;
        if (auto r = finish_.prepare(eyes_); !r) return r;
        const Instant now = time_.now();
        if (now - text_made_ < kTextEvery && !controls_changed()) return {};
        const double s = to_seconds(now - text_made_);
        ReadOut readout{.executor = std::string(eyes_.method().executor()), .scene = o_.scene, .quality = {},
                        .frames_per_second = static_cast<double>(record_.frames() - frames_at_text_) / std::max(s, 1e-3),
                        .width_px = eyes_.width(), .height_px = eyes_.height(), .summary = record_.summary(), .newest = newest_};
        if (const quality::Control* control = eyes_.quality()) readout.quality = control->setting().label;
        text_made_ = now;
        frames_at_text_ = record_.frames();
        shown_controls_ = {controls_.help, controls_.readout};
        screen_->set_text(text_lines(controls_, readout, methods_), surface_.scale);
        return {};
    }
    [[nodiscard]] bool controls_changed() const noexcept { return shown_controls_ != std::array{controls_.help, controls_.readout}; }

    // The tracker's gaze; without a live one, or if a key says so, the pointer's where it is at this very moment.
    Latched latch(Instant photon) {
        Latched latched = gaze_.latch(photon);
        if (surface_.shown() && (controls_.mouse || !latched.live()))
            if (const auto pointer = presenter_->pointer()) {
                PointedAt at = pointed_at(places_, surface_.height_px, pointer->x_px, pointer->y_px);
                if (lens_shown()) {   // the pointer is over what the panel shows; the gaze is a direction in the rendered view
                    const NdcPoint seen = effects::rendered_of(finish_.lens()->lens(at.eye), {at.x_ndc, at.y_ndc}, finish_.lens()->aspect());
                    at.x_ndc = std::clamp(seen.x, -1.0, 1.0);
                    at.y_ndc = std::clamp(seen.y, -1.0, 1.0);
                }
                return latch_pointer(*pointer, at, eyes_.views(), time_.now(), photon);
            }
        return latched;
    }

    // The gaze as the newest sample saw it, at the instant of its exposure: nothing is predicted. A pointer's is where it is.
    Latched measured() {
        const Latched newest = latch(time_.now());
        if (newest.source == GazeSource::mouse || !newest.live()) return newest;
        return gaze_.latch(instant_from_ns(newest.info.exposed_ns));
    }

    // Draws both eyes, from recording to GPU done.
    bool render(Frame& frame) {
        frame.number = ++presented_;
        frame.started = time_.now();
        frame.uses_early = controls_.latch_early;
        frame.early = latch(presenter_->photon_of(frame.started + frame_cost_.median()));
        if (!controls_.paused) scene_time_ += frame.started - scene_clock_;
        scene_clock_ = frame.started;
        frame.scene_s = to_seconds(scene_time_);
        eyes_.record(frame.scene_s);
        if (eyes_.late_fovea()) {   // the periphery does not need the newest gaze
            eyes_.submit_early(frame.uses_early ? frame.early : latch(presenter_->photon_of(time_.now() + frame_cost_.median())));
            if (!gl::Fence::insert().wait(time_)) {
                life_.lost = gl::poll_reset();
                return false;
            }
        }
        // Everything is recorded: now, and not earlier, ask where the eye will be.
        frame.late = latch(presenter_->photon_of(time_.now() + latched_cost_.median()));
        frame.asked = instant_from_ns(frame.latched().info.photon_ns);
        frame.cost = eyes_.submit(frame.latched());
        for (std::size_t i = 0; i < kEyes; ++i)
            if (!frame.cost.fell_back) frame.regions[i] = eyes_.method().full_region(i);
        finish_.draw(eyes_, frame);
        if (surface_.shown()) compose(frame);
        gl::Fence fence = gl::Fence::insert();
        frame.submitted = time_.now();
        const auto done = fence.wait(time_);
        life_.lost = gl::poll_reset();   // before anything that was drawn is counted or shown
        if (!done || life_.lost != gl::Reset::none) return false;
        frame.gpu_done = *done;
        eyes_.observe(frame.gpu_done, frame.gpu_done - frame.started);
        frame_cost_.add(frame.gpu_done - frame.started);
        latched_cost_.add(frame.gpu_done - frame.late.when());
        record_.rendered(frame);
        if (!o_.out.empty()) measured_.add(measured());
        return true;
    }

    // The levels are laid over the rendered pictures: while they are shown, the lens is left out.
    [[nodiscard]] bool lens_shown() const noexcept { return finish_.lens() != nullptr && !controls_.levels; }

    void compose(const Frame& frame) {
        Overlay overlay;
        if (lens_shown()) overlay.lens = finish_.lens();
        if (controls_.levels)
            for (std::size_t i = 0; i < kEyes; ++i) overlay.levels[i] = eyes_.levels(i);
        Latched seen;
        if (controls_.gaze && frame.latched().live()) {
            seen = measured();
            overlay.predicted = &frame.latched();
            if (seen.live()) overlay.actual = &seen;
        }
        screen_->draw(surface_, places_, {finish_.picture(0, lens_shown()).color_texture(), finish_.picture(1, lens_shown()).color_texture()}, overlay);
    }

    // Where the planner calls for it: what would be seen half-way to the next frame, shown half-way to it by a display
    // that can wait. One that cannot shows it now, and so it is made for now.
    Result<void> fill_in(const Frame& frame, Instant frame_photon) {
        const Frame before = std::exchange(rendered_, frame);
        const Duration interval = frame.started - before.started;
        effects::Needs needs = eyes_.needs();
        needs.camera_px = before.number == 0 ? 0 : camera_motion_px(eyes_.camera(before.scene_s), eyes_.camera(frame.scene_s), Eyes::views()[0].fov, eyes_.width());
        const auto objects = eyes_.scene().motion();
        needs.object_px = object_motion_px(objects, eyes_.camera(frame.scene_s), Eyes::views()[0].fov, eyes_.width());
        needs.moving_share = needs.object_px > 0 ? 1 : 0;
        if (!in_between_.called_for(needs, frame_cost_.median(), presenter_->refresh_period(), eyes_.declared(effects::Effect::extrapolation))) {
            in_between_.forget();
            return {};
        }
        Frame x = frame;
        x.extrapolated = true;
        x.submitted = time_.now();
        x.cost.pixels_shaded = 0;
        float factor = kBetweenFactor;
        if (!presenter_->holds_back() && interval > Duration{0}) {
            const double ahead = to_seconds(presenter_->photon_of(x.submitted + between_cost_.median()) - frame_photon) / to_seconds(interval);
            factor = static_cast<float>(std::clamp(ahead, 0.05, static_cast<double>(kBetweenFactor)));
        }
        x.scene_s = frame.scene_s + static_cast<double>(factor) * (frame.scene_s - before.scene_s);
        bool made = true;
        for (std::size_t i = 0; i < kEyes; ++i) {
            render::extrapolation::KnownMotion motion;
            if (knows_motion()) {
                const MotionPass::Cameras cameras{eyes_.camera(before.scene_s), eyes_.camera(frame.scene_s), eyes_.camera(x.scene_s), static_cast<double>(factor)};
                if (auto r = motion_.draw(eyes_.draws(), static_cast<std::uint32_t>(i), Eyes::views()[i], eyes_.width(), eyes_.height(), cameras, objects); !r)
                    return r;
                motion = {.motion_px = motion_.motion_px().data(), .depth = motion_.depth().data(), .width = motion_.columns(), .height = motion_.rows(), .ahead_px = motion_.ahead_px().data()};
            }
            const auto followed = in_between_.follow(i, eyes_.target(i), frame.regions[i], factor, knows_motion() ? &motion : nullptr);
            if (!followed) return std::unexpected(followed.error());
            made = made && *followed;
        }
        if (!made) return {};   // the first after a gap: nothing to go by yet
        finish_.draw({&in_between_.target(0), &in_between_.target(1)});
        if (surface_.shown()) compose(x);
        const auto done = gl::Fence::insert().wait(time_);
        if (!done) return fail("the GPU did not finish an extrapolated frame in 10 seconds", in_between_.backend(), "use --extrapolate off");
        x.number = ++presented_;
        x.gpu_done = *done;
        between_cost_.add(x.gpu_done - x.submitted);
        record_.extrapolated(x);
        extrapolated_ = x;
        if (surface_.shown())   // a window takes one frame at a time
            if (const auto turn = await_turn(); !turn || !*turn) return turn ? Result<void>{} : std::unexpected(turn.error());
        const Instant due = frame_photon + interval / 2 - presenter_->refresh_period();
        return show(x, presenter_->holds_back() ? std::max(x.gpu_done, due) : x.gpu_done);
    }

    [[nodiscard]] bool knows_motion() const noexcept { return o_.known_motion && eyes_.scene().triangles() <= kMostMotionTriangles; }

    // The window wants the next frame. False: it did not for some refreshes (hidden), or we are to stop.
    Result<bool> await_turn() {
        const Instant until = time_.now() + 4 * presenter_->refresh_period();
        while (!stop_.load(std::memory_order_relaxed) && time_.now() < until) {
            const auto turn = presenter_->begin_frame(Duration{0}, kPatience);
            if (!turn || *turn) return turn;
        }
        return false;
    }

    Result<void> show(const Frame& frame, Instant no_sooner) {
        if (!frame.extrapolated) newest_ = frame;
        if (awaited_.size() == kMostAwaited) awaited_.pop_front();
        awaited_.push_back(frame);
        return presenter_->present(frame.number, no_sooner);
    }

    // Frames whose photon instant has become known are reported.
    Result<void> look_back() {
        for (;;) {
            const auto known = presenter_->collect();
            if (!known) return std::unexpected(known.error());
            if (known->empty()) return {};
            for (const present::Feedback& feedback : *known) {
                const auto frame = std::ranges::find(awaited_, feedback.frame, &Frame::number);
                if (frame == awaited_.end()) continue;
                record_.shown(*frame, feedback);
                if (feedback.shown) gaze_.report(*frame, feedback);
                awaited_.erase(frame);
            }
        }
    }

    [[nodiscard]] bool snapshot_due() const noexcept {
        if (o_.out.empty() || snapshot_.frame != 0) return false;
        if (o_.snapshot_frame > 0) return record_.frames() == static_cast<std::uint64_t>(o_.snapshot_frame);
        const double progress = o_.frames > 0 ? static_cast<double>(record_.frames()) / static_cast<double>(o_.frames)
                                              : duration_s_ > 0 ? to_seconds(time_.now() - begin_) / duration_s_ : 0;
        return progress > 0.5 && newest_.latched().live() && newest_.latched().focals[0].event == FOVEA_EVENT_FIXATION;
    }

    // Where the eye really was when the pictured frame was to be seen, once a later sample tells.
    void mark_actual_gaze() {
        if (snapshot_.frame == 0 || snapshot_.views.empty() || snapshot_.views[0].actual) return;
        const auto points = measured_.at(snapshot_photon_);
        for (std::size_t i = 0; i < snapshot_.views.size() && points; ++i) snapshot_.views[i].actual = (*points)[i];
    }

    // Reads the frame back; encoding waits for the end, so that it disturbs no other frame.
    void take_snapshot() {
        finish_.show_rendered();
        snapshot_ = snapshot_of(newest_.number, eyes_.method_name(), newest_.latched().live(), newest_.shaded());
        for (std::size_t i = 0; i < kEyes; ++i) {
            const fovea_focal& f = newest_.latched().focals[i];
            SnapshotView v = read_view(finish_.picture(i, false), eyes_.levels(i));
            if (finish_.lens() != nullptr) v.through_lens = read_view(finish_.picture(i), nullptr).rgba;
            v.focal_x_ndc = f.x_ndc;
            v.focal_y_ndc = f.y_ndc;
            v.radius95_x_ndc = f.radius95_rad * f.ndc_per_rad_x;
            v.radius95_y_ndc = f.radius95_rad * f.ndc_per_rad_y;
            snapshot_.views.push_back(std::move(v));
        }
        snapshot_photon_ = newest_.asked;
        snapshot_.width_px = eyes_.width();
        snapshot_.height_px = eyes_.height();
    }

    // The last extrapolated frame beside what would have been rendered for the same moment, with the same focus.
    Result<void> compare_with_truth(Summary& s) {
        const SnapshotView made = read_view(in_between_.target(0), nullptr), held = read_view(eyes_.target(0), nullptr);
        eyes_.record(extrapolated_.scene_s);
        if (eyes_.late_fovea()) eyes_.submit_early(extrapolated_.latched());
        static_cast<void>(eyes_.submit(extrapolated_.latched()));
        const SnapshotView truth = read_view(eyes_.target(0), nullptr);
        s.extrapolated_psnr_db = psnr_db(made, truth);
        s.held_psnr_db = psnr_db(held, truth);
        return write_comparison(made, truth, eyes_.width(), eyes_.height(), o_.out);
    }

    void log_executor() {
        if (const auto s = eyes_.take_switch())
            std::fprintf(stderr, "%sfovea-view: %8.3f s: executor: %s -> %s (%.1f ms instead of %.1f ms a frame)\n", o_.progress && in_terminal_ ? "\r\033[K" : "", to_seconds(time_.now() - begin_),
                         s->from, s->to, to_seconds(s->to_cost) * 1e3, to_seconds(s->from_cost) * 1e3);
    }

    // After the frame was shown: writing costs the next one at most what waits for a terminal cost.
    void log_quality() {
        quality::Control* const control = eyes_.quality();
        if (control == nullptr) return;
        for (auto line = control->take_log_line(); line; line = control->take_log_line())
            std::fprintf(stderr, "%sfovea-view: %8.3f s: %s\n", o_.progress && in_terminal_ ? "\r\033[K" : "", to_seconds(time_.now() - begin_), line->c_str());
    }

    void progress(bool last) {
        if (!o_.progress) return;
        const Instant now = time_.now();
        // A terminal's line is written over; a log gets a line of its own now and then.
        if (!last && now - last_progress_ < (in_terminal_ ? std::chrono::milliseconds(500) : std::chrono::milliseconds(5000))) return;
        last_progress_ = now;
        const double s = to_seconds(now - begin_);
        std::fprintf(stderr, "%sfovea-view: %5.1f s, %llu frames (%.1f/s), %.1f %% of the pixels shaded, gaze %s%s", in_terminal_ ? "\r" : "", s,
                     static_cast<unsigned long long>(record_.frames()), static_cast<double>(record_.frames()) / std::max(s, 1e-3),
                     100 * newest_.shaded(), newest_.latched().live() ? "live" : "absent", !in_terminal_ ? "\n" : last ? "     \n" : "     ");
        std::fflush(stderr);
    }

    std::expected<Summary, Failure> finish() {
        Summary s = record_.summary();
        s.seconds = to_seconds(time_.now() - begin_);
        s.interrupted = stop_.load(std::memory_order_relaxed);
        s.renderer = presenter_->context().info().renderer;
        s.presenter = presenter_->name();
        s.display = presenter_->description();
        s.extrapolation_backend = in_between_.backend();
        s.extrapolation_knows_motion = s.extrapolated > 0 && knows_motion();
        if (const quality::Control* control = eyes_.quality()) {
            s.quality = control->setting().label;
            s.quality_changes = control->changes();
        }
        s.method = eyes_.method_name();
        s.effects = eyes_.effects();
        s.width_px = eyes_.width();
        s.height_px = eyes_.height();
        const fovea_status status = gaze_.status();
        s.connects = status.connects;
        s.frames_dropped = status.frames_dropped;
        if (!o_.out.empty() && s.frames > 0) {
            if (snapshot_.frame == 0) take_snapshot();   // the last frame is still in the targets
            mark_actual_gaze();
            s.snapshot_frame = snapshot_.frame;
            if (auto r = write_pictures(snapshot_, o_.out); !r) return failed(r.error());
            if (extrapolated_.number > rendered_.number)   // it continues the frame that is still in the targets
                if (auto r = compare_with_truth(s); !r) return failed(r.error());
        }
        return s;
    }

    const Options& o_;
    const std::atomic<bool>& stop_;
    const TimeSource& time_;
    Life& life_;
    std::unique_ptr<present::Presenter> presenter_;   // owns the context: goes last
    Gaze& gaze_;
    Eyes eyes_;
    Finish finish_;
    InBetween in_between_;
    MotionPass motion_;
    present::RecentCost frame_cost_{kFirstGuess}, latched_cost_{kFirstGuess}, between_cost_{kFirstGuess};
    Record& record_;
    std::deque<Frame> awaited_;   // shown, their photon not known yet
    std::uint64_t& presented_;
    Frame newest_;
    Frame rendered_, extrapolated_;   // the last of each kind; numbered 0 where extrapolation is off
    const Instant begin_;
    Instant last_progress_;
    const bool in_terminal_ = ::isatty(STDERR_FILENO) != 0;
    double duration_s_ = 0;
    Duration& scene_time_;
    Instant scene_clock_;
    // Of a window.
    present::Surface surface_;
    std::array<Place, kEyes> places_{};
    std::optional<Screen> screen_;
    std::vector<std::string> methods_;
    Controls& controls_;
    std::string chosen_;          // the method that the eyes have got
    std::array<bool, 2> shown_controls_{};
    Instant text_made_;
    std::uint64_t frames_at_text_ = 0;
    Snapshot snapshot_;
    Instant snapshot_photon_;
    MeasuredGaze measured_;       // kept where pictures are asked for
};

std::expected<Summary, Failure> run_in_one_context(const Options& options, const present::PresenterSettings& settings, const std::atomic<bool>& stop,
                                                   const TimeSource& time, Life& life, bool windowed) {
    auto presenter = present::create_presenter(options.present, settings, time);
    if (!presenter) return failed(presenter.error());
    if (options.progress || windowed) std::fprintf(stderr, "fovea-view: display: %s, %s\n", std::string((*presenter)->name()).c_str(), (*presenter)->description().c_str());
    if (options.verbose)
        std::fprintf(stderr, "fovea-view: driver: %s; its probe: %s\n", (*presenter)->context().info().renderer.c_str(), foveation::driver_traits().origin.c_str());
    auto eyes = Eyes::create(options, time);
    if (!eyes) return std::unexpected(eyes.error());
    return Viewer(options, stop, time, *std::move(presenter), life, *std::move(eyes)).run();
}

}  // namespace

std::expected<Summary, Failure> run(const Options& options, const std::atomic<bool>& stop) {
    // Cheap checks first: a wrong name should not need a daemon to be told.
    if (auto clock = present::SimulatedScanout::create(options.scanout, {}); !clock) return failed(clock.error(), kUsage);
    if (auto known = present::check_presenter(options.present); !known) return failed(known.error(), kUsage);
    if (auto known = foveation::check_method(options.method); !known) return failed(known.error(), kUsage);
    if (auto known = scene::check_scene(options.scene); !known) return failed(known.error(), kUsage);
    if (options.quality != "off" && options.quality != "auto")
        if (auto ladder = quality::load_ladder(options.quality); !ladder) return failed(ladder.error(), kUnusableInput);
    static const SystemTime time;
    const present::PresenterSettings settings{.scanout = options.scanout, .width_px = 2 * options.width_px, .height_px = options.height_px};
    const bool windowed = present::presenter_for(options.present).name != std::string_view("surfaceless");
    Options connecting = options;
    connecting.wait |= windowed;   // the mouse is there
    auto gaze = Gaze::connect(connecting, Eyes::views());
    if (!gaze) return std::unexpected(gaze.error());
    Life life(options, *std::move(gaze), time.now());
    for (;;) {
        const auto summary = run_in_one_context(options, settings, stop, time, life, windowed);
        if (life.lost == gl::Reset::none || life.record.resets() >= kMostResets) return summary;
        life.record.reset();
        std::fprintf(stderr, "fovea-view: the driver lost the context, %s: everything is made anew\n", gl::reset_name(life.lost));
        life.lost = gl::Reset::none;
    }
}

}  // namespace fovea::viewer
