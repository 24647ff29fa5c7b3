#include "render/present/wayland.hpp"

#include <poll.h>
#include <presentation-time-client-protocol.h>
#include <wayland-client.h>
#include <wayland-egl.h>
#include <xdg-shell-client-protocol.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "render/present/vblank_clock.hpp"
#include "render/present/wayland_input.hpp"

namespace fovea::present {
namespace {

constexpr Duration kUsualPeriod = std::chrono::nanoseconds(16'666'667);   // until the compositor tells it
constexpr std::size_t kSlots = 64;                                        // frames whose feedback is awaited
constexpr const char* kWhere = "Wayland";

std::int64_t read_clock(clockid_t id) noexcept {
    timespec t{};
    clock_gettime(id, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

class Wayland final : public Presenter {
public:
    Wayland(const PresenterSettings& settings, const TimeSource& time) : settings_(settings), time_(time) {
        for (auto& slot : slots_) slot.owner = this;
        known_.reserve(kSlots), handed_.reserve(kSlots);
    }
    ~Wayland() override {
        surface_gl_ = {};
        context_.reset();
        if (egl_window_ != nullptr) wl_egl_window_destroy(egl_window_);
        input_.reset();
        for (auto& slot : slots_)
            if (slot.feedback != nullptr) wp_presentation_feedback_destroy(slot.feedback);
        if (callback_ != nullptr) wl_callback_destroy(callback_);
        if (toplevel_ != nullptr) xdg_toplevel_destroy(toplevel_);
        if (xdg_surface_ != nullptr) xdg_surface_destroy(xdg_surface_);
        if (surface_ != nullptr) wl_surface_destroy(surface_);
        for (Output& o : outputs_) wl_output_destroy(o.proxy);
        if (presentation_ != nullptr) wp_presentation_destroy(presentation_);
        if (wm_base_ != nullptr) xdg_wm_base_destroy(wm_base_);
        if (compositor_ != nullptr) wl_compositor_destroy(compositor_);
        if (registry_ != nullptr) wl_registry_destroy(registry_);
        if (display_ != nullptr) wl_display_disconnect(display_);
    }
    Wayland(const Wayland&) = delete;
    Wayland& operator=(const Wayland&) = delete;

    Result<void> open() {
        display_ = wl_display_connect(nullptr);
        if (display_ == nullptr) {
            const char* name = std::getenv("WAYLAND_DISPLAY");
            return fail_errno("no Wayland compositor answers", errno, name != nullptr ? name : "wayland-0",
                              "check $WAYLAND_DISPLAY and $XDG_RUNTIME_DIR, or choose another display with --present");
        }
        input_ = std::make_unique<WaylandInput>(time_);
        registry_ = wl_display_get_registry(display_);
        wl_registry_add_listener(registry_, &kRegistry, this);
        for (int i = 0; i < 2; ++i)   // the globals; then what they say of themselves
            if (wl_display_roundtrip(display_) < 0) return gone();
        if (compositor_ == nullptr || wm_base_ == nullptr)
            return fail("the compositor offers no xdg-shell windows", kWhere, "use another compositor, or choose another display with --present");
        auto context = gl::Context::create({gl::Platform::wayland, display_});
        if (!context) return std::unexpected(context.error());
        context_.emplace(*std::move(context));

        surface_ = wl_compositor_create_surface(compositor_);
        wl_surface_add_listener(surface_, &kSurface, this);
        xdg_surface_ = xdg_wm_base_get_xdg_surface(wm_base_, surface_);
        xdg_surface_add_listener(xdg_surface_, &kXdgSurface, this);
        toplevel_ = xdg_surface_get_toplevel(xdg_surface_);
        xdg_toplevel_add_listener(toplevel_, &kToplevel, this);
        xdg_toplevel_set_title(toplevel_, settings_.title.c_str());
        xdg_toplevel_set_app_id(toplevel_, "fovea-view");
        for (const Output& o : outputs_) wanted_.scale = std::max(wanted_.scale, o.scale);   // until it is known where the window is
        wanted_.width = std::max(settings_.width_px / wanted_.scale, 1);
        wanted_.height = std::max(settings_.height_px / wanted_.scale, 1);
        wl_surface_commit(surface_);
        while (!configured_)
            if (wl_display_roundtrip(display_) < 0) return gone();
        size_ = wanted_;
        wl_surface_set_buffer_scale(surface_, size_.scale);
        egl_window_ = wl_egl_window_create(surface_, size_.width * size_.scale, size_.height * size_.scale);
        auto surface = gl::WindowSurface::create(*context_, egl_window_);
        if (!surface) return std::unexpected(surface.error());
        surface_gl_ = *std::move(surface);
        return {};
    }

    [[nodiscard]] std::string_view name() const noexcept override { return "wayland"; }
    [[nodiscard]] std::string description() const override {
        std::array<char, 128> text{};
        std::snprintf(text.data(), text.size(), "window of %d x %d pixels, scale %d, %.4g Hz, %s", surface().width_px, surface().height_px, size_.scale, 1 / to_seconds(clock_.period()),
                      presentation_ != nullptr ? "presentation feedback" : "no presentation feedback");
        return text.data();
    }
    [[nodiscard]] const gl::Context& context() const noexcept override { return *context_; }
    [[nodiscard]] Duration refresh_period() const noexcept override { return clock_.period(); }
    [[nodiscard]] Surface surface() const noexcept override { return {0, size_.width * size_.scale, size_.height * size_.scale, static_cast<double>(size_.scale)}; }

    [[nodiscard]] Result<bool> begin_frame(Duration cost, Duration patience) override {
        const Instant until = time_.now() + patience;
        for (;;) {
            if (auto r = pump(Duration{0}); !r) return std::unexpected(r.error());
            const Instant now = time_.now(), begin = clock_.begin_no_sooner(cost);
            if (callback_ == nullptr && begin <= now) {
                apply_size();
                return true;
            }
            if (now >= until) return false;
            if (auto r = pump((callback_ == nullptr ? std::min(begin, until) : until) - now); !r) return std::unexpected(r.error());
        }
    }

    [[nodiscard]] Instant photon_of(Instant gpu_done) const noexcept override { return clock_.predict(gpu_done) + clock_.period() / 2; }

    [[nodiscard]] Result<void> present(std::uint64_t frame, Instant gpu_done) override {
        callback_ = wl_surface_frame(surface_);
        wl_callback_add_listener(callback_, &kFrame, this);
        Slot& slot = slots_[next_slot_++ % kSlots];
        if (slot.feedback != nullptr) {   // a compositor that tells nothing for so long will not
            wp_presentation_feedback_destroy(slot.feedback);
            slot.feedback = nullptr;
        }
        slot.frame = frame;
        slot.done = gpu_done;
        if (presentation_ != nullptr) {
            slot.feedback = wp_presentation_feedback(presentation_, surface_);
            wp_presentation_feedback_add_listener(slot.feedback, &kFeedback, &slot);
        } else {
            known_.push_back({frame, true, photon_of(gpu_done), PhotonSource::estimated});
        }
        if (!surface_gl_.swap()) return gone();
        return {};
    }

    [[nodiscard]] Result<std::span<const Feedback>> collect() override {
        if (auto r = pump(Duration{0}); !r) return std::unexpected(r.error());
        handed_.swap(known_);
        known_.clear();
        return std::span<const Feedback>(handed_);
    }

    [[nodiscard]] std::span<const Event> events() noexcept override {
        handed_events_.swap(input_->events());
        input_->events().clear();
        return handed_events_;
    }
    [[nodiscard]] std::optional<Pointer> pointer() noexcept override {
        static_cast<void>(pump(Duration{0}));   // a lost connection is found again by the next call that can tell
        auto p = input_->pointer();
        if (p) p->x_px *= size_.scale, p->y_px *= size_.scale;
        return p;
    }

private:
    struct Slot {
        Wayland* owner = nullptr;
        struct wp_presentation_feedback* feedback = nullptr;
        std::uint64_t frame = 0;
        Instant done;
    };
    struct Output {
        wl_output* proxy = nullptr;
        int scale = 1;
        bool entered = false;
    };
    static Wayland& self(void* data) noexcept { return *static_cast<Wayland*>(data); }

    // Sends what is queued and handles what has come, waiting at most so long for something to come.
    [[nodiscard]] Result<void> pump(Duration wait) {
        while (wl_display_prepare_read(display_) != 0)
            if (wl_display_dispatch_pending(display_) < 0) return gone();
        if (wl_display_flush(display_) < 0 && errno != EAGAIN) {
            wl_display_cancel_read(display_);
            return gone();
        }
        pollfd fd{wl_display_get_fd(display_), POLLIN, 0};
        const timespec timeout{wait.count() / 1'000'000'000, static_cast<long>(wait.count() % 1'000'000'000)};
        const int ready = ppoll(&fd, 1, wait.count() > 0 ? &timeout : &kNow, nullptr);
        if (ready > 0) {
            if (wl_display_read_events(display_) < 0) return gone();
        } else {
            wl_display_cancel_read(display_);
        }
        if (wl_display_dispatch_pending(display_) < 0) return gone();
        return {};
    }

    [[nodiscard]] std::unexpected<Error> gone() const {
        const int code = wl_display_get_error(display_);
        if (code == EPROTO) {
            const wl_interface* interface = nullptr;
            std::uint32_t id = 0;
            const auto number = wl_display_get_protocol_error(display_, &interface, &id);
            return fail("the compositor refused a request (error " + std::to_string(number) + " of " + (interface != nullptr ? interface->name : "the display") + ")", kWhere,
                        "choose another display with --present");
        }
        return fail_errno("the compositor has gone away", code != 0 ? code : EPIPE, kWhere, "start it again, or choose another display with --present");
    }

    void told(Slot& slot, bool shown, Instant start, std::uint32_t flags) {
        wp_presentation_feedback_destroy(slot.feedback);
        slot.feedback = nullptr;
        if (!shown) {
            known_.push_back({slot.frame, false, {}, PhotonSource::estimated});
            return;
        }
        const bool measured = (flags & (WP_PRESENTATION_FEEDBACK_KIND_HW_CLOCK | WP_PRESENTATION_FEEDBACK_KIND_HW_COMPLETION)) != 0;
        clock_.observe(slot.done, start, measured);
        // A compositor that only guesses may name an instant before the frame was handed over.
        known_.push_back({slot.frame, true, std::max(start, slot.done) + clock_.period() / 2, measured ? PhotonSource::measured : PhotonSource::estimated});
    }

    void rescale() {
        int scale = 0;
        for (const Output& o : outputs_)
            if (o.entered) scale = std::max(scale, o.scale);
        if (scale > 0) wanted_.scale = scale;
    }
    // Between two frames only: what is drawn has one size.
    void apply_size() {
        if (wanted_ == size_) return;
        if (wanted_.scale != size_.scale) wl_surface_set_buffer_scale(surface_, wanted_.scale);
        size_ = wanted_;
        wl_egl_window_resize(egl_window_, size_.width * size_.scale, size_.height * size_.scale, 0, 0);
    }

    static void global(void* data, wl_registry* registry, std::uint32_t id, const char* interface, std::uint32_t version) {
        Wayland& w = self(data);
        const std::string_view name = interface;
        const auto bind = [&](const wl_interface& i, std::uint32_t most) { return wl_registry_bind(registry, id, &i, std::min(version, most)); };
        if (name == wl_compositor_interface.name) {
            w.compositor_ = static_cast<wl_compositor*>(bind(wl_compositor_interface, 4));
        } else if (name == xdg_wm_base_interface.name) {
            w.wm_base_ = static_cast<xdg_wm_base*>(bind(xdg_wm_base_interface, 1));
            xdg_wm_base_add_listener(w.wm_base_, &kWmBase, data);
        } else if (name == wp_presentation_interface.name) {
            w.presentation_ = static_cast<wp_presentation*>(bind(wp_presentation_interface, 1));
            wp_presentation_add_listener(w.presentation_, &kPresentation, data);
        } else if (name == wl_output_interface.name) {
            auto* proxy = static_cast<wl_output*>(bind(wl_output_interface, 2));
            wl_output_add_listener(proxy, &kOutput, data);
            w.outputs_.push_back({proxy, 1, false});
        } else if (name == wl_seat_interface.name) {
            w.input_->bind(registry, id, version);
        }
    }
    static void global_gone(void*, wl_registry*, std::uint32_t) {}
    static void ping(void*, xdg_wm_base* base, std::uint32_t serial) { xdg_wm_base_pong(base, serial); }
    static void clock_id(void* data, wp_presentation*, std::uint32_t id) { self(data).clock_id_ = static_cast<clockid_t>(id); }

    static void geometry(void*, wl_output*, std::int32_t, std::int32_t, std::int32_t, std::int32_t, std::int32_t, const char*, const char*, std::int32_t) {}
    static void mode(void* data, wl_output*, std::uint32_t flags, std::int32_t, std::int32_t, std::int32_t refresh_mhz) {
        if ((flags & WL_OUTPUT_MODE_CURRENT) != 0 && refresh_mhz > 0) self(data).clock_.set_period(seconds(1e3 / refresh_mhz));
    }
    static void output_done(void* data, wl_output*) { self(data).rescale(); }
    static void output_scale(void* data, wl_output* proxy, std::int32_t scale) { self(data).output(proxy).scale = std::max(scale, 1); }
    Output& output(wl_output* proxy) {
        static Output none;
        const auto o = std::ranges::find(outputs_, proxy, &Output::proxy);
        return o != outputs_.end() ? *o : none;
    }
    static void entered(void* data, wl_surface*, wl_output* proxy) {
        self(data).output(proxy).entered = true;
        self(data).rescale();
    }
    static void left(void* data, wl_surface*, wl_output* proxy) {
        self(data).output(proxy).entered = false;
        self(data).rescale();
    }

    static void configure_toplevel(void* data, xdg_toplevel*, std::int32_t width, std::int32_t height, wl_array*) {
        if (width > 0 && height > 0) self(data).wanted_.width = width, self(data).wanted_.height = height;
    }
    static void close(void* data, xdg_toplevel*) { self(data).input_->events().push_back({EventKind::close, 0}); }
    static void configure(void* data, xdg_surface* surface, std::uint32_t serial) {
        xdg_surface_ack_configure(surface, serial);
        self(data).configured_ = true;
    }
    static void frame_due(void* data, wl_callback* callback, std::uint32_t) {
        wl_callback_destroy(callback);
        self(data).callback_ = nullptr;
    }

    static void sync_output(void*, struct wp_presentation_feedback*, wl_output*) {}
    static void presented(void* data, struct wp_presentation_feedback*, std::uint32_t s_high, std::uint32_t s_low, std::uint32_t ns, std::uint32_t refresh_ns, std::uint32_t,
                          std::uint32_t, std::uint32_t flags) {
        Slot& slot = *static_cast<Slot*>(data);
        Wayland& w = *slot.owner;
        w.clock_.set_period(Duration{refresh_ns});
        std::int64_t t = static_cast<std::int64_t>((std::uint64_t{s_high} << 32) | s_low) * 1'000'000'000 + ns;
        if (w.clock_id_ != CLOCK_MONOTONIC) t += read_clock(CLOCK_MONOTONIC) - read_clock(w.clock_id_);   // e.g. MONOTONIC_RAW
        w.told(slot, true, instant_from_ns(t), flags);
    }
    static void discarded(void* data, struct wp_presentation_feedback*) {
        Slot& slot = *static_cast<Slot*>(data);
        slot.owner->told(slot, false, {}, 0);
    }

    static constexpr timespec kNow{0, 0};
    static constexpr wl_registry_listener kRegistry{global, global_gone};
    static constexpr xdg_wm_base_listener kWmBase{ping};
    static constexpr wp_presentation_listener kPresentation{clock_id};
    static constexpr wl_output_listener kOutput{geometry, mode, output_done, output_scale, {}, {}};
    static constexpr wl_surface_listener kSurface{entered, left};
    static constexpr xdg_surface_listener kXdgSurface{configure};
    static constexpr xdg_toplevel_listener kToplevel{configure_toplevel, close, {}, {}};
    static constexpr wl_callback_listener kFrame{frame_due};
    static constexpr wp_presentation_feedback_listener kFeedback{sync_output, presented, discarded};

    PresenterSettings settings_;
    const TimeSource& time_;
    wl_display* display_ = nullptr;
    wl_registry* registry_ = nullptr;
    wl_compositor* compositor_ = nullptr;
    xdg_wm_base* wm_base_ = nullptr;
    wp_presentation* presentation_ = nullptr;
    clockid_t clock_id_ = CLOCK_MONOTONIC;
    std::vector<Output> outputs_;
    std::unique_ptr<WaylandInput> input_;
    wl_surface* surface_ = nullptr;
    xdg_surface* xdg_surface_ = nullptr;
    xdg_toplevel* toplevel_ = nullptr;
    wl_egl_window* egl_window_ = nullptr;
    wl_callback* callback_ = nullptr;   // there is one: the compositor does not want the next frame yet
    bool configured_ = false;
    struct Size {
        int width = 0, height = 0, scale = 1;   // of the surface's units; pixels per unit
        bool operator==(const Size&) const = default;
    };
    Size size_, wanted_;
    std::optional<gl::Context> context_;
    gl::WindowSurface surface_gl_;
    VblankClock clock_{kUsualPeriod};
    std::array<Slot, kSlots> slots_;
    std::size_t next_slot_ = 0;
    std::vector<Feedback> known_, handed_;
    std::vector<Event> handed_events_;
};

}  // namespace

bool wayland_offered() {
    const char* name = std::getenv("WAYLAND_DISPLAY");
    return name != nullptr && *name != 0;
}

Result<std::unique_ptr<Presenter>> create_wayland(const PresenterSettings& settings, const TimeSource& time) {
    auto made = std::make_unique<Wayland>(settings, time);
    if (auto r = made->open(); !r) return std::unexpected(r.error());
    return made;
}

}  // namespace fovea::present
