#include "render/present/wayland_input.hpp"

#include <sys/mman.h>
#include <unistd.h>
#include <xkbcommon/xkbcommon.h>

#include <algorithm>

namespace fovea::present {

// The compositor's callbacks; `data` is the WaylandInput.
struct WaylandInput::Listeners {
    static WaylandInput& self(void* data) noexcept { return *static_cast<WaylandInput*>(data); }

    static void capabilities(void* data, wl_seat* seat, std::uint32_t capabilities) {
        WaylandInput& in = self(data);
        const bool has_keyboard = (capabilities & WL_SEAT_CAPABILITY_KEYBOARD) != 0, has_pointer = (capabilities & WL_SEAT_CAPABILITY_POINTER) != 0;
        if (has_keyboard && in.keyboard_ == nullptr) {
            in.keyboard_ = wl_seat_get_keyboard(seat);
            wl_keyboard_add_listener(in.keyboard_, &kKeyboard, data);
        } else if (!has_keyboard && in.keyboard_ != nullptr) {
            wl_keyboard_destroy(in.keyboard_);
            in.keyboard_ = nullptr;
        }
        if (has_pointer && in.wl_pointer_ == nullptr) {
            in.wl_pointer_ = wl_seat_get_pointer(seat);
            wl_pointer_add_listener(in.wl_pointer_, &kPointer, data);
        } else if (!has_pointer && in.wl_pointer_ != nullptr) {
            wl_pointer_destroy(in.wl_pointer_);
            in.wl_pointer_ = nullptr;
            in.over_ = false;
        }
    }
    static void seat_name(void*, wl_seat*, const char*) {}

    static void keymap(void* data, wl_keyboard*, std::uint32_t format, std::int32_t fd, std::uint32_t size) {
        if (format == WL_KEYBOARD_KEYMAP_FORMAT_XKB_V1) self(data).keymap(fd, size);
        ::close(fd);
    }
    static void keyboard_enter(void*, wl_keyboard*, std::uint32_t, wl_surface*, wl_array*) {}
    static void keyboard_leave(void*, wl_keyboard*, std::uint32_t, wl_surface*) {}
    static void key(void* data, wl_keyboard*, std::uint32_t, std::uint32_t, std::uint32_t code, std::uint32_t state) {
        if (state == WL_KEYBOARD_KEY_STATE_PRESSED) self(data).key(code);
    }
    static void modifiers(void* data, wl_keyboard*, std::uint32_t, std::uint32_t depressed, std::uint32_t latched, std::uint32_t locked, std::uint32_t group) {
        if (self(data).state_ != nullptr) xkb_state_update_mask(self(data).state_, depressed, latched, locked, 0, 0, group);
    }
    static void repeat(void*, wl_keyboard*, std::int32_t, std::int32_t) {}

    static void moved(WaylandInput& in, wl_fixed_t x, wl_fixed_t y) {
        in.pointer_ = {wl_fixed_to_double(x), wl_fixed_to_double(y), in.time_.now(), in.pointer_.count + 1};
        in.over_ = true;
    }
    static void enter(void* data, wl_pointer* pointer, std::uint32_t serial, wl_surface*, wl_fixed_t x, wl_fixed_t y) {
        wl_pointer_set_cursor(pointer, serial, nullptr, 0, 0);   // the gaze marker takes its place
        moved(self(data), x, y);
    }
    static void leave(void* data, wl_pointer*, std::uint32_t, wl_surface*) { self(data).over_ = false; }
    static void motion(void* data, wl_pointer*, std::uint32_t, wl_fixed_t x, wl_fixed_t y) { moved(self(data), x, y); }
    static void button(void*, wl_pointer*, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t) {}
    static void axis(void*, wl_pointer*, std::uint32_t, std::uint32_t, wl_fixed_t) {}
    static void pointer_frame(void*, wl_pointer*) {}
    static void axis_source(void*, wl_pointer*, std::uint32_t) {}
    static void axis_stop(void*, wl_pointer*, std::uint32_t, std::uint32_t) {}
    static void axis_discrete(void*, wl_pointer*, std::uint32_t, std::int32_t) {}

    static constexpr wl_seat_listener kSeat{capabilities, seat_name};
    static constexpr wl_keyboard_listener kKeyboard{keymap, keyboard_enter, keyboard_leave, key, modifiers, repeat};
    static constexpr wl_pointer_listener kPointer{enter, leave, motion, button, axis, pointer_frame, axis_source, axis_stop, axis_discrete, {}};
};

WaylandInput::WaylandInput(const TimeSource& time) : time_(time), xkb_(xkb_context_new(XKB_CONTEXT_NO_FLAGS)) {}

WaylandInput::~WaylandInput() {
    xkb_state_unref(state_);
    xkb_keymap_unref(keymap_);
    xkb_context_unref(xkb_);
    if (keyboard_ != nullptr) wl_keyboard_destroy(keyboard_);
    if (wl_pointer_ != nullptr) wl_pointer_destroy(wl_pointer_);
    if (seat_ != nullptr) wl_seat_destroy(seat_);
}

void WaylandInput::bind(wl_registry* registry, std::uint32_t name, std::uint32_t version) {
    if (seat_ != nullptr) return;   // one seat is enough to look around
    seat_ = static_cast<wl_seat*>(wl_registry_bind(registry, name, &wl_seat_interface, std::min(version, 5u)));
    wl_seat_add_listener(seat_, &Listeners::kSeat, this);
}

void WaylandInput::keymap(int fd, std::uint32_t size) {
    if (xkb_ == nullptr || size == 0) return;
    void* text = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (text == MAP_FAILED) return;
    xkb_keymap* map = xkb_keymap_new_from_buffer(xkb_, static_cast<const char*>(text), size - 1, XKB_KEYMAP_FORMAT_TEXT_V1, XKB_KEYMAP_COMPILE_NO_FLAGS);
    munmap(text, size);
    if (map == nullptr) return;
    xkb_state_unref(state_);
    xkb_keymap_unref(keymap_);
    keymap_ = map;
    state_ = xkb_state_new(map);
}

void WaylandInput::key(std::uint32_t code) {
    constexpr std::uint32_t kEvdevToXkb = 8;   // XKB counts from 8, as X does
    if (state_ == nullptr) return;
    if (const auto c = xkb_state_key_get_utf32(state_, code + kEvdevToXkb); c != 0) events_.push_back({EventKind::key, static_cast<char32_t>(c)});
}

}  // namespace fovea::present
