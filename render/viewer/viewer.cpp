#include "render/viewer/viewer.hpp"

#include <fovea/fovea.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <span>
#include <vector>

#include <ctime>

#include "protocol/clock.hpp"
#include "render/foveation/method.hpp"
#include "render/gl/context.hpp"
#include "render/scene/scene.hpp"
#include "render/viewer/pictures.hpp"

namespace fovea::viewer {
namespace {

constexpr std::size_t kEyes = 2;
constexpr Duration kFirstGuess = std::chrono::milliseconds(40);   // of a frame's cost, before there is one
constexpr std::size_t kKeptFrames = 4096;                         // for the medians of the summary

struct Disconnect {
    void operator()(fovea_client* c) const noexcept { fovea_disconnect(c); }
};
using Client = std::unique_ptr<fovea_client, Disconnect>;

std::unexpected<Failure> failed(const Error& error, ExitCode code = kFailed) { return std::unexpected(Failure{error, code}); }

std::expected<Client, Failure> connect(const Options& o) {
    fovea_connect_info info{};
    FOVEA_INIT(&info);
    info.flags = o.wait ? FOVEA_CONNECT_WAIT : 0;
    info.socket_path = o.socket.empty() ? nullptr : o.socket.c_str();
    info.client_name = "fovea-view";
    fovea_client* client = nullptr;
    const fovea_result result = fovea_connect(&info, &client);
    if (result == FOVEA_OK) return Client(client);
    const bool absent = result == FOVEA_ERROR_NO_DAEMON;
    return failed({fovea_last_error(nullptr), {}, absent ? "--socket names another one; --wait starts without it" : ""},
                  absent ? kNoDaemon : kFailed);
}

// Sleeps in short steps, so that an interrupt is heard.
void sleep_until(Instant until, const TimeSource& time, const std::atomic<bool>& stop) {
    for (Instant now = time.now(); now < until && !stop.load(std::memory_order_relaxed); now = time.now()) {
        const auto ns = std::min((until - now).count(), std::int64_t{20'000'000});
        const timespec pause{0, static_cast<long>(ns)};
        nanosleep(&pause, nullptr);
    }
}

double milliseconds(Duration d) noexcept { return to_seconds(d) * 1e3; }

double median(std::vector<double> v) {
    if (v.empty()) return 0;
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
}

// Ring of the last frames' values, bounded however long the viewer runs.
struct Kept {
    std::vector<double> values;
    std::size_t next = 0;
    void add(double v) {
        if (values.size() < kKeptFrames) values.push_back(v);
        else values[next++ % kKeptFrames] = v;
    }
};

class Viewer {
public:
    Viewer(const Options& options, const std::atomic<bool>& stop, Client client) : o_(options), stop_(stop), client_(std::move(client)) {}

    std::expected<Summary, Failure> run() {
        if (auto r = prepare(); !r) return std::unexpected(r.error());
        begin_ = time_.now();
        auto clock = present::SimulatedScanout::create(o_.scanout, begin_);
        if (!clock) return failed(clock.error(), kUsage);
        while (!finished()) {
            sleep_until(clock->begin_no_sooner(frame_cost_.median()), time_, stop_);
            if (stop_.load(std::memory_order_relaxed)) break;
            if (!frame(*clock)) return failed({"the GPU did not finish a frame in 10 seconds", context_->info().renderer, "use a smaller --size"});
            progress(false);
        }
        progress(true);
        return finish();
    }

private:
    std::expected<void, Failure> prepare() {
        auto context = gl::Context::create();
        if (!context) return failed(context.error());
        context_.emplace(*std::move(context));
        auto scene = scene::Scene::create({.name = o_.scene});
        if (!scene) return failed(scene.error(), kUsage);
        scene_.emplace(*std::move(scene));
        auto method = foveation::create_method(o_.method, {});
        if (!method) return failed(method.error(), kUsage);
        method_ = *std::move(method);
        for (std::size_t i = 0; i < kEyes; ++i) {
            auto target = gl::RenderTarget::create({.width_px = o_.width_px, .height_px = o_.height_px});
            if (!target) return failed(target.error());
            owned_[i] = *std::move(target);
            targets_[i] = {owned_[i].framebuffer(), 0, 0, o_.width_px, o_.height_px};
            FOVEA_INIT(&views_[i]);
            views_[i].eye = i == 0 ? FOVEA_EYE_LEFT : FOVEA_EYE_RIGHT;
            views_[i].tan_left = static_cast<float>(eyes_[i].fov.tan_left);
            views_[i].tan_right = static_cast<float>(eyes_[i].fov.tan_right);
            views_[i].tan_up = static_cast<float>(eyes_[i].fov.tan_up);
            views_[i].tan_down = static_cast<float>(eyes_[i].fov.tan_down);
            views_[i].head_from_view[0] = 1;
            FOVEA_INIT(&focals_[i]);
        }
        FOVEA_INIT(&latch_);
        if (auto r = method_->prepare(targets_); !r) return failed(r.error());
        return warm_up();
    }

    // The driver compiles shaders at their first use: not in the first frame that counts. An off-centre fovea of each
    // size uses every level.
    std::expected<void, Failure> warm_up() {
        scene_->record(0, eyes_, draws_);
        for (const float gain : {3.0f, 12.0f}) {
            for (auto& f : focus_) {
                f.points[0] = {0.3f, 0.2f, gain, gain, 0};
                f.count = 1;
            }
            method_->submit(draws_, targets_, focus_);
            if (!gl::Fence::insert().wait(time_)) return failed({"the GPU did not finish the first frame in 10 seconds", context_->info().renderer, "use a smaller --size"});
        }
        return {};
    }

    [[nodiscard]] bool finished() const noexcept {
        if (stop_.load(std::memory_order_relaxed)) return true;
        if (o_.frames > 0) return summary_.frames >= static_cast<std::uint64_t>(o_.frames);
        return o_.duration_s > 0 && to_seconds(time_.now() - begin_) >= o_.duration_s;
    }

    bool frame(present::SimulatedScanout& clock) {
        const Instant start = time_.now();
        scene_->record(to_seconds(start - begin_), eyes_, draws_);

        if (method_->late_fovea()) {   // the periphery does not need the newest gaze
            latch(clock.predict(time_.now() + frame_cost_.median()).photon);
            method_->submit_early(draws_, targets_, focus_);
            if (!gl::Fence::insert().wait(time_)) return false;
        }
        // Everything is recorded: now, and not earlier, ask where the eye will be.
        const Instant asked = clock.predict(time_.now() + latched_cost_.median()).photon;
        latch(asked);
        const foveation::FrameCost cost = method_->submit(draws_, targets_, focus_);
        gl::Fence fence = gl::Fence::insert();
        const Instant submitted = time_.now();
        const auto done = fence.wait(time_);
        if (!done) return false;
        const present::SimulatedScanout::Shown shown = clock.present(*done);

        ++summary_.frames;
        report(cost, submitted, *done, shown.photon);
        const Instant latched = instant_from_ns(latch_.latched_ns);
        frame_cost_.add(*done - start);
        latched_cost_.add(*done - latched);
        method_->observe(*done - start);
        frame_ms_.add(milliseconds(*done - start));
        submit_ms_.add(milliseconds(submitted - latched));
        done_ms_.add(milliseconds(*done - latched));
        error_ms_.add(std::abs(milliseconds(shown.photon - asked)));
        shaded_sum_ += static_cast<double>(cost.pixels_shaded) / static_cast<double>(std::max<std::uint64_t>(cost.pixels_full, 1));
        last_shaded_ = cost.pixels_full != 0 ? static_cast<double>(cost.pixels_shaded) / static_cast<double>(cost.pixels_full) : 1;
        if (live()) ++summary_.live_frames;
        if (snapshot_due()) take_snapshot();
        return true;
    }

    void latch(Instant photon) {
        const fovea_result result = fovea_latch(client_.get(), to_ns(photon), views_.data(), kEyes, focals_.data(), &latch_);
        FOVEA_REQUIRE(result == FOVEA_OK);   // our own arguments: an error is a bug
        for (std::size_t i = 0; i < kEyes; ++i) {
            const fovea_focal& f = focals_[i];
            focus_[i].points[0] = density::sized_focal_point(o_.fovea, f.x_ndc, f.y_ndc, f.radius95_rad, f.ndc_per_rad_x, f.ndc_per_rad_y);
            focus_[i].count = method_->wants_gaze_status() && (f.flags & FOVEA_FOCAL_STATIC) != 0 ? 0 : 1;
        }
    }

    void report(const foveation::FrameCost& cost, Instant submitted, Instant done, Instant photon) {
        fovea_frame f{};
        FOVEA_INIT(&f);
        f.flags = FOVEA_FRAME_PHOTON_SIMULATED;
        f.frame = summary_.frames;
        f.submitted_ns = to_ns(submitted);
        f.gpu_done_ns = to_ns(done);
        f.photon_ns = to_ns(photon);
        f.pixels_shaded = cost.pixels_shaded;
        f.pixels_full = cost.pixels_full;
        f.view_count = kEyes;
        for (std::size_t i = 0; i < kEyes; ++i) {
            f.views[i] = views_[i];
            const foveation::Method::Region region = cost.fell_back ? foveation::Method::Region{} : method_->full_region(i);
            f.foveas[i] = {static_cast<float>(region.x_ndc), static_cast<float>(region.y_ndc), static_cast<float>(region.half_width_ndc),
                           static_cast<float>(region.half_height_ndc)};
        }
        f.latch = latch_;
        static_cast<void>(fovea_submit_frame(client_.get(), &f));   // a full or absent queue is counted by the library
    }

    [[nodiscard]] bool live() const noexcept { return (latch_.flags & FOVEA_LATCH_LIVE) != 0 && (focals_[0].flags & FOVEA_FOCAL_STATIC) == 0; }

    [[nodiscard]] bool snapshot_due() const noexcept {
        if (o_.out.empty() || snapshot_.frame != 0) return false;
        if (o_.snapshot_frame > 0) return summary_.frames == static_cast<std::uint64_t>(o_.snapshot_frame);
        const double progress = o_.frames > 0 ? static_cast<double>(summary_.frames) / static_cast<double>(o_.frames)
                                              : o_.duration_s > 0 ? to_seconds(time_.now() - begin_) / o_.duration_s : 0;
        return progress > 0.5 && live() && focals_[0].event == FOVEA_EVENT_FIXATION;
    }

    // Reads the frame back; encoding waits for the end, so that it disturbs no other frame.
    void take_snapshot() {
        snapshot_.frame = summary_.frames;
        snapshot_.width_px = o_.width_px;
        snapshot_.height_px = o_.height_px;
        snapshot_.shaded = last_shaded_;
        snapshot_.title = "METHOD: " + o_.method + "  FRAME " + std::to_string(summary_.frames) + (live() ? "" : "  (NO LIVE GAZE)");
        std::ranges::transform(snapshot_.title, snapshot_.title.begin(), [](char c) { return c == '_' ? ' ' : static_cast<char>(std::toupper(static_cast<unsigned char>(c))); });
        snapshot_.views.resize(kEyes);
        for (std::size_t i = 0; i < kEyes; ++i) {
            SnapshotView& v = snapshot_.views[i];
            v.rgba.resize(static_cast<std::size_t>(o_.width_px) * static_cast<std::size_t>(o_.height_px) * 4);
            gl::read_pixels(targets_[i].framebuffer, 0, 0, o_.width_px, o_.height_px, v.rgba);
            if (const density::Plan* plan = method_->plan(i)) copy_levels(*plan, v);
            const fovea_focal& f = focals_[i];
            v.focal_x_ndc = f.x_ndc;
            v.focal_y_ndc = f.y_ndc;
            v.radius95_x_ndc = f.radius95_rad * f.ndc_per_rad_x;
            v.radius95_y_ndc = f.radius95_rad * f.ndc_per_rad_y;
        }
    }

    void progress(bool last) {
        if (!o_.progress) return;
        const Instant now = time_.now();
        if (!last && now - last_progress_ < std::chrono::milliseconds(500)) return;
        last_progress_ = now;
        const double s = to_seconds(now - begin_);
        std::fprintf(stderr, "\rfovea-view: %5.1f s, %llu frames (%.1f/s), %.1f %% of the pixels shaded, gaze %s   %s", s,
                     static_cast<unsigned long long>(summary_.frames), static_cast<double>(summary_.frames) / std::max(s, 1e-3),
                     100 * last_shaded_, live() ? "live  " : "absent", last ? "\n" : "");
        std::fflush(stderr);
    }

    std::expected<Summary, Failure> finish() {
        summary_.seconds = to_seconds(time_.now() - begin_);
        summary_.interrupted = stop_.load(std::memory_order_relaxed);
        summary_.renderer = context_->info().renderer;
        summary_.frame_ms = median(frame_ms_.values);
        summary_.latch_to_submit_ms = median(submit_ms_.values);
        summary_.latch_to_done_ms = median(done_ms_.values);
        summary_.photon_error_ms = median(error_ms_.values);
        if (summary_.frames > 0) summary_.shaded = shaded_sum_ / static_cast<double>(summary_.frames);
        fovea_status status{};
        FOVEA_INIT(&status);
        if (fovea_get_status(client_.get(), &status) == FOVEA_OK) {
            summary_.connects = status.connects;
            summary_.frames_dropped = status.frames_dropped;
        }
        if (!o_.out.empty() && summary_.frames > 0) {
            if (snapshot_.frame == 0) take_snapshot();   // the last frame is still in the targets
            summary_.snapshot_frame = snapshot_.frame;
            if (auto r = write_pictures(snapshot_, o_.out); !r) return failed(r.error());
        }
        return summary_;
    }

    const Options& o_;
    const std::atomic<bool>& stop_;
    SystemTime time_;
    Client client_;
    std::optional<gl::Context> context_;
    std::optional<scene::Scene> scene_;
    std::array<scene::SceneView, kEyes> eyes_ = scene::stereo_views();
    std::array<gl::RenderTarget, kEyes> owned_;
    std::array<foveation::ViewTarget, kEyes> targets_;
    std::array<foveation::ViewFocus, kEyes> focus_;
    std::unique_ptr<foveation::Method> method_;
    gl::CommandList draws_;
    std::array<fovea_view, kEyes> views_{};
    std::array<fovea_focal, kEyes> focals_{};
    fovea_latch_info latch_{};
    present::RecentCost frame_cost_{kFirstGuess}, latched_cost_{kFirstGuess};
    Instant begin_{}, last_progress_{};
    Summary summary_;
    Kept frame_ms_, submit_ms_, done_ms_, error_ms_;
    double shaded_sum_ = 0, last_shaded_ = 1;
    Snapshot snapshot_;
};

}  // namespace

std::expected<Summary, Failure> run(const Options& options, const std::atomic<bool>& stop) {
    // Cheap checks first: a wrong name should not need a daemon to be told.
    if (auto clock = present::SimulatedScanout::create(options.scanout, {}); !clock) return failed(clock.error(), kUsage);
    auto client = connect(options);
    if (!client) return std::unexpected(client.error());
    return Viewer(options, stop, *std::move(client)).run();
}

}  // namespace fovea::viewer
