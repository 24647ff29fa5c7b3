// Where finished frames go, and when their light leaves: a window, a screen, or nowhere (simulated).
//
//   begin_frame -> record -> photon_of(done) -> latch -> submit, compose into surface() -> GPU done -> present
//       ^                                                                                                 |
//       +------------------- collect: the photon instants of earlier frames, as they become known <-------+
//
// A photon instant is the middle of the scan-out that shows the frame. It is *measured* where the display's own clock
// told when that scan-out began, *estimated* where there is a display that does not tell, *simulated* where there is
// none. It carries that mark for ever.
// Threads: one thread at a time, the one on which context() is current.
// Errors: a connection that breaks, a display that refuses a frame: begin_frame, present and collect return them; the
// presenter is of no use afterwards. A window that is closed or hidden is no error.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"
#include "render/gl/context.hpp"
#include "render/gl/objects.hpp"
#include "render/present/scanout.hpp"

namespace fovea::present {

enum class PhotonSource : std::uint8_t { measured, estimated, simulated };
[[nodiscard]] std::string_view text_of(PhotonSource source) noexcept;

struct PresenterSettings {
    ScanoutSettings scanout;                 // of the simulated display
    int width_px = 1536, height_px = 768;    // wished for; a screen has its own
    std::string title = "fovea-view";        // of the window
};

// What the next frame is to be drawn into.
struct Surface {
    gl::Name framebuffer = 0;
    int width_px = 0, height_px = 0;   // 0 x 0: nothing is shown, nothing needs to be composed
    double scale = 1;                  // pixels per unit of the desktop's layout (HiDPI): text is to be so much larger
    [[nodiscard]] bool shown() const noexcept { return width_px > 0 && height_px > 0; }
    bool operator==(const Surface&) const = default;
};

// What became of a frame.
struct Feedback {
    std::uint64_t frame = 0;
    bool shown = true;             // false: a newer one took its place, it was never seen; photon is meaningless
    Instant photon;                // the middle of the scan-out
    PhotonSource source = PhotonSource::simulated;
};

// The pointer over the surface, in pixels from its top left corner.
struct Pointer {
    double x_px = 0, y_px = 0;
    Instant moved;                 // when we got to know of it
    std::uint64_t count = 0;       // of the movements so far
};

enum class EventKind : std::uint8_t { key, close };
struct Event {
    EventKind kind = EventKind::key;
    char32_t key = 0;              // the character of a key pressed; 27: Escape
};

class Presenter {
public:
    virtual ~Presenter() = default;
    [[nodiscard]] virtual std::string_view name() const noexcept = 0;
    // For people, e.g. "window of weston-1, 60 Hz".
    [[nodiscard]] virtual std::string description() const = 0;
    // In which frames are drawn; current on the creating thread.
    [[nodiscard]] virtual const gl::Context& context() const noexcept = 0;
    // Between two scan-outs, by the newest knowledge; > 0.
    [[nodiscard]] virtual Duration refresh_period() const noexcept = 0;

    // Handles what has happened, and waits until a frame of this cost should begin to be shown with the least latency.
    // False: not yet (hidden, or the wait was longer than `patience`): look after other things and call again.
    [[nodiscard]] virtual Result<bool> begin_frame(Duration cost, Duration patience) = 0;
    // Of this frame; may change with every begin_frame().
    [[nodiscard]] virtual Surface surface() const noexcept { return {}; }
    // The photon instant of a frame that is done at this instant.
    [[nodiscard]] virtual Instant photon_of(Instant gpu_done) const noexcept = 0;
    // Whether present() may be given an instant still to come: the frame is then shown no sooner. Else it goes out at once.
    [[nodiscard]] virtual bool holds_back() const noexcept { return false; }
    // Shows what is in surface(), done at gpu_done. frame: given back by collect().
    [[nodiscard]] virtual Result<void> present(std::uint64_t frame, Instant gpu_done) = 0;
    // What has become known since the last call, oldest first; empty once there is no more. Never blocks.
    [[nodiscard]] virtual Result<std::span<const Feedback>> collect() = 0;

    // Key presses and a closed window since the last call. Valid until the next call of any member.
    [[nodiscard]] virtual std::span<const Event> events() noexcept { return {}; }
    // Where the pointer is at this instant: reads what has arrived, never blocks. Nothing: there is none over the surface.
    [[nodiscard]] virtual std::optional<Pointer> pointer() noexcept { return std::nullopt; }
};

// One row of the table of presenters.
struct PresenterEntry {
    const char* name;
    const char* summary;
    bool (*offered)();   // the environment speaks for it (cheap; says nothing about whether create() works)
    Result<std::unique_ptr<Presenter>> (*create)(const PresenterSettings& settings, const TimeSource& time);
};
// In the order in which `auto` tries them.
[[nodiscard]] std::span<const PresenterEntry> presenters() noexcept;

// Errors: an unknown name lists the known ones. "auto" is known.
[[nodiscard]] Result<void> check_presenter(std::string_view name);
// The row of a known name, or the one that "auto" stands for at present.
[[nodiscard]] const PresenterEntry& presenter_for(std::string_view name) noexcept;
// name: one of the table, or "auto": the first that the environment offers. `time` must outlive it.
// Errors: those of check_presenter; a display that cannot be opened; no GL driver for it.
[[nodiscard]] Result<std::unique_ptr<Presenter>> create_presenter(std::string_view name, const PresenterSettings& settings,
                                                                  const TimeSource& time);

}  // namespace fovea::present
