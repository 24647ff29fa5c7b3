// A recording as a device: any file that load_recording reads, played in real time or as fast as it is polled.
//
// Exposure times are moved onto CLOCK_MONOTONIC by ONE constant integer offset, so every difference is that of the
// recording to the nanosecond (speed 1 and max; another speed stretches time). The first poll() after open() is the
// start: its sample is due at once. A sample is delivered when it is due by its own arrival time (exposure + the transport
// delay that the recording knows). Ids are 1, 2, 3 ... as for any source.
// A recording whose times lie more than 10 years from its start, as recorded or as played, is refused by open(); a loop ends
// when it has gone round for 100 years of either.
// Settings ([source] of the config): the keys of player_row().
// Cost: poll() allocates nothing, takes no lock, waits in ppoll (and asks for 1 us of timer slack on its thread).
// Threads: as drivers::Device.
// Errors: those of load_recording; an unknown key or a value out of range.
#pragma once

#include <memory>

#include "drivers/device.hpp"
#include "replay/recording.hpp"

namespace fovea::replay {

struct PlayerSettings {
    double speed = 1;        // (0, 1000], or 0 for "max": a sample whenever poll() is called
    bool loop = false;       // after the end from the start again; exposure times go on rising
    double start_s = 0;      // [0, 1e6]: leave out the beginning
    double duration_s = 0;   // [0, 1e6]: play no more than this; 0: to the end
};

// A player of a recording that is already in memory. `time` must outlive it. The deadline of poll() and `time` are on
// one clock; with ManualTime and speed 1 poll() returns at once whatever is due (it never waits on a clock that
// stands still).
[[nodiscard]] Result<std::unique_ptr<drivers::Device>> make_player(Recording recording, const PlayerSettings& settings,
                                                                   std::string location, const TimeSource& time);

// The row "replay" for the device table.
[[nodiscard]] drivers::DeviceRow player_row();

}  // namespace fovea::replay
