// Keyboard and pointer of a Wayland seat, as a presenter hands them on.
//
// Source: wl_seat, wl_keyboard, wl_pointer; key maps by libxkbcommon.
// Threads: that of the display's queue. Errors: none; a seat without a device gives nothing.
#pragma once

#include <wayland-client.h>

#include <optional>
#include <vector>

#include "render/present/presenter.hpp"

struct xkb_context;
struct xkb_keymap;
struct xkb_state;

namespace fovea::present {

class WaylandInput {
public:
    explicit WaylandInput(const TimeSource& time);
    ~WaylandInput();
    WaylandInput(const WaylandInput&) = delete;
    WaylandInput& operator=(const WaylandInput&) = delete;

    void bind(wl_registry* registry, std::uint32_t name, std::uint32_t version);
    // In units of the surface; nothing while it is elsewhere.
    [[nodiscard]] std::optional<Pointer> pointer() const noexcept { return over_ ? std::optional(pointer_) : std::nullopt; }
    [[nodiscard]] std::vector<Event>& events() noexcept { return events_; }

private:
    struct Listeners;
    void keymap(int fd, std::uint32_t size);
    void key(std::uint32_t code);

    const TimeSource& time_;
    wl_seat* seat_ = nullptr;
    wl_keyboard* keyboard_ = nullptr;
    wl_pointer* wl_pointer_ = nullptr;
    xkb_context* xkb_ = nullptr;
    xkb_keymap* keymap_ = nullptr;
    xkb_state* state_ = nullptr;
    Pointer pointer_;
    bool over_ = false;
    std::vector<Event> events_;
};

}  // namespace fovea::present
