#include "render/present/x11.hpp"

#include <poll.h>
#include <xcb/present.h>
#include <xcb/randr.h>
#include <xcb/xcb.h>
#include <xcb/xcb_keysyms.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <vector>

#include "render/present/vblank_clock.hpp"

namespace fovea::present {
namespace {

constexpr Duration kUsualPeriod = std::chrono::nanoseconds(16'666'667);   // where RandR knows none
constexpr std::size_t kSlots = 64;                                        // frames whose vblank is awaited
constexpr const char* kWhere = "X11";
constexpr double kUsualDpi = 96;

struct Free {
    void operator()(void* p) const noexcept { std::free(p); }
};
template <class T>
using Reply = std::unique_ptr<T, Free>;

class X11 final : public Presenter {
public:
    X11(const PresenterSettings& settings, const TimeSource& time) : settings_(settings), time_(time) {
        known_.reserve(kSlots), handed_.reserve(kSlots);
    }
    ~X11() override {
        surface_gl_ = {};
        context_.reset();
        if (keys_ != nullptr) xcb_key_symbols_free(keys_);
        if (connection_ == nullptr) return;
        if (window_ != 0) xcb_destroy_window(connection_, window_);
        xcb_disconnect(connection_);
    }
    X11(const X11&) = delete;
    X11& operator=(const X11&) = delete;

    Result<void> open() {
        int number = 0;
        connection_ = xcb_connect(nullptr, &number);
        if (xcb_connection_has_error(connection_) != 0) {
            const char* name = std::getenv("DISPLAY");
            return fail("no X server answers", name != nullptr ? name : "$DISPLAY", "check $DISPLAY and $XAUTHORITY, or choose another display with --present");
        }
        auto screens = xcb_setup_roots_iterator(xcb_get_setup(connection_));
        for (; number > 0 && screens.rem > 1; --number) xcb_screen_next(&screens);
        screen_ = screens.data;
        auto context = gl::Context::create({gl::Platform::xcb, connection_});
        if (!context) return std::unexpected(context.error());
        context_.emplace(*std::move(context));
        auto visual = gl::WindowSurface::visual(*context_, screen_->root_visual);   // else a colour map would be needed
        if (!visual) return std::unexpected(visual.error());

        scale_ = desktop_scale();
        width_ = wanted_width_ = static_cast<int>(settings_.width_px);
        height_ = wanted_height_ = static_cast<int>(settings_.height_px);
        window_ = xcb_generate_id(connection_);
        const std::array<std::uint32_t, 2> values{screen_->black_pixel, XCB_EVENT_MASK_KEY_PRESS | XCB_EVENT_MASK_POINTER_MOTION | XCB_EVENT_MASK_ENTER_WINDOW |
                                                                            XCB_EVENT_MASK_LEAVE_WINDOW | XCB_EVENT_MASK_STRUCTURE_NOTIFY | XCB_EVENT_MASK_VISIBILITY_CHANGE};
        xcb_create_window(connection_, screen_->root_depth, window_, screen_->root, 0, 0, static_cast<std::uint16_t>(width_), static_cast<std::uint16_t>(height_), 0,
                          XCB_WINDOW_CLASS_INPUT_OUTPUT, screen_->root_visual, XCB_CW_BACK_PIXEL | XCB_CW_EVENT_MASK, values.data());
        name_window();
        ask_for_vblanks();
        learn_refresh();
        keys_ = xcb_key_symbols_alloc(connection_);
        xcb_map_window(connection_, window_);
        xcb_flush(connection_);
        auto surface = gl::WindowSurface::create(*context_, &window_, screen_->root_visual);
        if (!surface) return std::unexpected(surface.error());
        surface_gl_ = *std::move(surface);
        return pump();
    }

    [[nodiscard]] std::string_view name() const noexcept override { return "x11"; }
    [[nodiscard]] std::string description() const override {
        std::array<char, 128> text{};
        std::snprintf(text.data(), text.size(), "window of %d x %d pixels, %.4g Hz, %s", width_, height_, 1 / to_seconds(clock_.period()),
                      present_ != 0 ? "the server's vblank clock" : "no vblank clock");
        return text.data();
    }
    [[nodiscard]] const gl::Context& context() const noexcept override { return *context_; }
    [[nodiscard]] Duration refresh_period() const noexcept override { return clock_.period(); }
    [[nodiscard]] Surface surface() const noexcept override { return {0, width_, height_, scale_}; }

    // One frame per vblank: the next begins once that of the last is known.
    [[nodiscard]] Result<bool> begin_frame(Duration cost, Duration patience) override {
        const Instant until = time_.now() + patience;
        for (;;) {
            if (auto r = pump(); !r) return std::unexpected(r.error());
            const Instant now = time_.now();
            const bool stuck = awaiting_ && now - handed_over_ > kLongestWait;   // a server that answers no longer
            const Instant begin = awaiting_ && !stuck ? until : std::max(clock_.begin_no_sooner(cost), present_ == 0 ? handed_over_ + clock_.period() - cost : Instant{});
            if (visible_ && !(awaiting_ && !stuck) && begin <= now) {
                awaiting_ = false;
                width_ = wanted_width_;
                height_ = wanted_height_;
                return true;
            }
            if (now >= until) return false;
            pollfd fd{xcb_get_file_descriptor(connection_), POLLIN, 0};
            const Duration wait = (visible_ ? std::min(begin, until) : until) - now;
            const timespec timeout{wait.count() / 1'000'000'000, static_cast<long>(wait.count() % 1'000'000'000)};
            ppoll(&fd, 1, &timeout, nullptr);
        }
    }

    [[nodiscard]] Instant photon_of(Instant gpu_done) const noexcept override { return clock_.predict(gpu_done) + clock_.period() / 2; }

    [[nodiscard]] Result<void> present(std::uint64_t frame, Instant gpu_done) override {
        if (!surface_gl_.swap()) return gone();
        handed_over_ = time_.now();
        if (present_ == 0) {
            known_.push_back({frame, true, clock_.predict(handed_over_) + clock_.period() / 2, PhotonSource::estimated});
        } else {
            slots_[next_slot_ % kSlots] = {frame, gpu_done};
            // Divisor 1: the next vblank after this request, which the server handles after the picture's.
            xcb_present_notify_msc(connection_, window_, next_slot_++, 0, 1, 0);
            awaiting_ = true;
        }
        xcb_flush(connection_);
        return pump();
    }

    [[nodiscard]] Result<std::span<const Feedback>> collect() override {
        if (auto r = pump(); !r) return std::unexpected(r.error());
        handed_.swap(known_);
        known_.clear();
        return std::span<const Feedback>(handed_);
    }

    [[nodiscard]] std::span<const Event> events() noexcept override {
        handed_events_.swap(events_);
        events_.clear();
        return handed_events_;
    }
    [[nodiscard]] std::optional<Pointer> pointer() noexcept override {
        static_cast<void>(pump());   // a lost connection is found again by the next call that can tell
        return over_ ? std::optional(pointer_) : std::nullopt;
    }

private:
    static constexpr Duration kLongestWait = std::chrono::milliseconds(250);
    struct Slot {
        std::uint64_t frame = 0;
        Instant done;
    };

    [[nodiscard]] static std::unexpected<Error> gone() { return fail("the X server has gone away, or has closed the window", kWhere, "start it again, or choose another display with --present"); }

    Reply<xcb_intern_atom_reply_t> atom_reply(std::string_view name) {
        return Reply<xcb_intern_atom_reply_t>(xcb_intern_atom_reply(connection_, xcb_intern_atom(connection_, 0, static_cast<std::uint16_t>(name.size()), name.data()), nullptr));
    }
    xcb_atom_t atom(std::string_view name) {
        const auto reply = atom_reply(name);
        return reply ? reply->atom : static_cast<xcb_atom_t>(XCB_ATOM_NONE);
    }

    void name_window() {
        xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, XCB_ATOM_WM_NAME, XCB_ATOM_STRING, 8, static_cast<std::uint32_t>(settings_.title.size()), settings_.title.data());
        static constexpr char kClass[] = "fovea-view\0Fovea";
        xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, XCB_ATOM_WM_CLASS, XCB_ATOM_STRING, 8, sizeof kClass, kClass);
        delete_window_ = atom("WM_DELETE_WINDOW");
        xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, atom("WM_PROTOCOLS"), XCB_ATOM_ATOM, 32, 1, &delete_window_);
    }

    // Xft.dpi of the resource manager, which desktops set for HiDPI screens.
    double desktop_scale() {
        const Reply<xcb_get_property_reply_t> reply(
            xcb_get_property_reply(connection_, xcb_get_property(connection_, 0, screen_->root, XCB_ATOM_RESOURCE_MANAGER, XCB_ATOM_STRING, 0, 65536), nullptr));
        if (!reply) return 1;
        const std::string_view all(static_cast<const char*>(xcb_get_property_value(reply.get())), static_cast<std::size_t>(xcb_get_property_value_length(reply.get())));
        constexpr std::string_view kKey = "Xft.dpi:";
        const auto at = all.find(kKey);
        if (at == std::string_view::npos) return 1;
        const double dpi = std::strtod(std::string(all.substr(at + kKey.size(), 32)).c_str(), nullptr);
        return dpi >= kUsualDpi / 2 && dpi <= kUsualDpi * 8 ? dpi / kUsualDpi : 1;
    }

    void ask_for_vblanks() {
        const auto* extension = xcb_get_extension_data(connection_, &xcb_present_id);
        if (extension == nullptr || extension->present == 0) return;
        const Reply<xcb_present_query_version_reply_t> version(xcb_present_query_version_reply(connection_, xcb_present_query_version(connection_, 1, 0), nullptr));
        if (!version) return;
        present_ = extension->major_opcode;
        xcb_present_select_input(connection_, xcb_generate_id(connection_), window_, XCB_PRESENT_EVENT_MASK_COMPLETE_NOTIFY);
    }

    // Of the first CRTC that shows something.
    void learn_refresh() {
        const auto* extension = xcb_get_extension_data(connection_, &xcb_randr_id);
        if (extension == nullptr || extension->present == 0) return;
        const Reply<xcb_randr_get_screen_resources_current_reply_t> all(
            xcb_randr_get_screen_resources_current_reply(connection_, xcb_randr_get_screen_resources_current(connection_, screen_->root), nullptr));
        if (!all) return;
        const std::span crtcs(xcb_randr_get_screen_resources_current_crtcs(all.get()), static_cast<std::size_t>(xcb_randr_get_screen_resources_current_crtcs_length(all.get())));
        const std::span modes(xcb_randr_get_screen_resources_current_modes(all.get()), static_cast<std::size_t>(xcb_randr_get_screen_resources_current_modes_length(all.get())));
        for (const auto crtc : crtcs) {
            const Reply<xcb_randr_get_crtc_info_reply_t> info(
                xcb_randr_get_crtc_info_reply(connection_, xcb_randr_get_crtc_info(connection_, crtc, all->config_timestamp), nullptr));
            if (!info || info->mode == 0) continue;
            for (const auto& m : modes)
                if (m.id == info->mode && m.dot_clock > 0 && m.htotal > 0 && m.vtotal > 0) {
                    clock_.set_period(seconds(static_cast<double>(m.htotal) * m.vtotal / m.dot_clock));
                    return;
                }
        }
    }

    // Handles what has come; never waits.
    [[nodiscard]] Result<void> pump() {
        while (const Reply<xcb_generic_event_t> event{xcb_poll_for_event(connection_)}) handle(*event);
        if (xcb_connection_has_error(connection_) != 0) return gone();
        return {};
    }

    void handle(const xcb_generic_event_t& event) {
        const auto as = [&]<class T>(const T*) { return reinterpret_cast<const T*>(&event); };
        switch (event.response_type & 0x7f) {
            case XCB_GE_GENERIC: completed(*as(static_cast<const xcb_present_complete_notify_event_t*>(nullptr))); break;
            case XCB_KEY_PRESS: key(*as(static_cast<const xcb_key_press_event_t*>(nullptr))); break;
            case XCB_MAPPING_NOTIFY: {
                auto copy = *as(static_cast<const xcb_mapping_notify_event_t*>(nullptr));
                xcb_refresh_keyboard_mapping(keys_, &copy);
                break;
            }
            case XCB_MOTION_NOTIFY: {
                const auto& e = *as(static_cast<const xcb_motion_notify_event_t*>(nullptr));
                moved(e.event_x, e.event_y);
                break;
            }
            case XCB_ENTER_NOTIFY: {
                const auto& e = *as(static_cast<const xcb_enter_notify_event_t*>(nullptr));
                moved(e.event_x, e.event_y);
                break;
            }
            case XCB_LEAVE_NOTIFY: over_ = false; break;
            case XCB_CONFIGURE_NOTIFY: {
                const auto& e = *as(static_cast<const xcb_configure_notify_event_t*>(nullptr));
                wanted_width_ = std::max<int>(e.width, 1);
                wanted_height_ = std::max<int>(e.height, 1);
                break;
            }
            case XCB_UNMAP_NOTIFY: visible_ = false; break;
            case XCB_MAP_NOTIFY: visible_ = true; break;
            case XCB_VISIBILITY_NOTIFY: visible_ = as(static_cast<const xcb_visibility_notify_event_t*>(nullptr))->state != XCB_VISIBILITY_FULLY_OBSCURED; break;
            case XCB_CLIENT_MESSAGE:
                if (as(static_cast<const xcb_client_message_event_t*>(nullptr))->data.data32[0] == delete_window_) events_.push_back({EventKind::close, 0});
                break;
            case XCB_DESTROY_NOTIFY: events_.push_back({EventKind::close, 0}); break;
            default: break;
        }
    }

    void moved(int x, int y) {
        pointer_ = {static_cast<double>(x), static_cast<double>(y), time_.now(), pointer_.count + 1};
        over_ = true;
    }
    void key(const xcb_key_press_event_t& e) {
        constexpr xcb_keysym_t kEscape = 0xff1b, kKeypad0 = 0xffb0, kKeypad9 = 0xffb9;
        const bool shift = (e.state & XCB_MOD_MASK_SHIFT) != 0;
        xcb_keysym_t symbol = xcb_key_symbols_get_keysym(keys_, e.detail, shift ? 1 : 0);
        if (symbol == 0) symbol = xcb_key_symbols_get_keysym(keys_, e.detail, 0);
        if (symbol == kEscape) symbol = 27;
        if (symbol >= kKeypad0 && symbol <= kKeypad9) symbol = symbol - kKeypad0 + '0';
        if (symbol < 0x100) events_.push_back({EventKind::key, static_cast<char32_t>(symbol)});   // Latin-1: the symbol is the character
    }
    void completed(const xcb_present_complete_notify_event_t& e) {
        if (e.extension != present_ || e.event_type != XCB_PRESENT_COMPLETE_NOTIFY || e.kind != XCB_PRESENT_COMPLETE_KIND_NOTIFY_MSC) return;
        const Slot& slot = slots_[e.serial % kSlots];
        if (e.serial + 1 == next_slot_) awaiting_ = false;
        const Instant start = instant_from_ns(static_cast<std::int64_t>(e.ust) * 1000);   // microseconds of CLOCK_MONOTONIC
        clock_.observe(slot.done, start, true);
        known_.push_back({slot.frame, true, std::max(start, slot.done) + clock_.period() / 2, PhotonSource::estimated});
    }

    PresenterSettings settings_;
    const TimeSource& time_;
    xcb_connection_t* connection_ = nullptr;
    xcb_screen_t* screen_ = nullptr;
    xcb_window_t window_ = 0;
    xcb_atom_t delete_window_ = XCB_ATOM_NONE;
    xcb_key_symbols_t* keys_ = nullptr;
    std::uint8_t present_ = 0;   // major opcode of the extension; 0: there is none
    int width_ = 0, height_ = 0, wanted_width_ = 0, wanted_height_ = 0;
    double scale_ = 1;
    bool visible_ = true, over_ = false;
    Pointer pointer_;
    std::optional<gl::Context> context_;
    gl::WindowSurface surface_gl_;
    VblankClock clock_{kUsualPeriod};
    std::array<Slot, kSlots> slots_;
    std::uint32_t next_slot_ = 0;
    bool awaiting_ = false;      // the vblank of the last frame
    Instant handed_over_{};
    std::vector<Feedback> known_, handed_;
    std::vector<Event> events_, handed_events_;
};

}  // namespace

bool x11_offered() {
    const char* name = std::getenv("DISPLAY");
    return name != nullptr && *name != 0;
}

Result<std::unique_ptr<Presenter>> create_x11(const PresenterSettings& settings, const TimeSource& time) {
    auto made = std::make_unique<X11>(settings, time);
    if (auto r = made->open(); !r) return std::unexpected(r.error());
    return made;
}

}  // namespace fovea::present
