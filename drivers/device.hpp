// The device interface: bytes, pixels or a recording in, GazeSample out.
//
// A device is opened, polled by one thread, and closed. Losing it is a state that poll() reports, not an exit.
// A new tracker is one folder, one row in device_table.cpp, one CMake line and one test (docs/writing_a_driver.md).
//
// Threads: all calls from the thread that polls, except wake(), which may come from any thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"
#include "protocol/gaze_sample.hpp"

namespace fovea::drivers {

struct DeviceInfo {
    std::string driver;       // the row in the table, e.g. "replay"
    std::string name;         // for people, e.g. "EyeLink 1000, lookAtPoint S1"
    std::string location;     // path, device node or bus address
    double nominal_rate_hz = 0;   // 0: unknown or irregular
    bool exact_exposure = false;  // exposure times come from the device itself, already on our clock (a recording)
};

enum class PollStatus : std::uint8_t {
    sample,   // `out` holds a sample
    nothing,  // the deadline passed, or wake() was called
    lost,     // the device is gone or silent for good; open() may be tried again
    ended,    // there will never be another sample (a recording has ended)
};

// Raised in the steady loop, read by `fovea status`; since the device was created.
struct DeviceCounters {
    std::uint64_t samples = 0;
    std::uint64_t malformed = 0;       // reports, packets or frames that break the device's own format
    std::uint64_t dropped = 0;         // gaps in the device's own sequence numbers, where it has them
    std::uint64_t losses = 0;          // times that poll() said `lost`
    std::uint64_t switches = 0;        // changes between devices, for a driver that has several
    const char* last_loss = "";        // in words, e.g. "unplugged"; static text
};

class Device {
public:
    virtual ~Device() = default;
    [[nodiscard]] virtual DeviceInfo info() const = 0;
    [[nodiscard]] virtual Result<void> open() = 0;
    // Waits for the next sample until `deadline`. Steady loop: no allocation, no lock, no log.
    [[nodiscard]] virtual PollStatus poll(GazeSample& out, Instant deadline) noexcept = 0;
    // Makes a poll() that waits on another thread return `nothing` soon.
    virtual void wake() noexcept = 0;
    virtual void close() noexcept = 0;
    // Shortly before a sample is due: may go through what poll() will do with it, so that this meets warm caches.
    // Changes nothing that poll() gives. Steady loop, as poll().
    virtual void rehearse() noexcept {}
    [[nodiscard]] virtual DeviceCounters counters() const noexcept { return {}; }
};

// What the config file says under [source]; keys other than `driver` are the driver's own. The config reader knows their
// names from the driver's row (an unknown key never gets here); their values are checked by the driver.
struct DeviceSettings {
    std::map<std::string, std::string> values;  // as text, e.g. {"path", "x.csv"}, {"speed", "1"}, {"loop", "true"}
    std::string where;                          // file:line of [source], for errors
    std::map<std::string, std::string> where_of;  // file:line:column of each key's value

    // Where the value of `key` stands, for an error about it.
    [[nodiscard]] const std::string& where_is(const std::string& key) const {
        const auto it = where_of.find(key);
        return it == where_of.end() ? where : it->second;
    }
};

// One key of a driver's own, as configs/fovead.toml and `fovead --print-config` show it.
struct DeviceKey {
    const char* name;           // with its unit at the end, e.g. "start_s"
    const char* default_toml;   // as it would stand in the file, e.g. "0.0", "false", "\"\""
    const char* doc;            // one line: what it is, unit and legal range, e.g. "where to begin; seconds, >= 0"
};

// One device that is plugged in, for `fovea devices`.
struct FoundDevice {
    std::string location;              // device node or bus address, as the driver's own key takes it
    std::string name;
    std::vector<std::string> facts;    // one line each: capabilities in words
    std::string problem;               // why it cannot be used and the way out; empty when it can
    std::string details;               // for --dump: descriptor, formats or endpoints in words; lines
};

// One row of the visible table.
struct DeviceRow {
    const char* driver;        // name in the config
    const char* one_line;      // for `fovead --help` and `fovea devices`
    std::function<Result<std::unique_ptr<Device>>(const DeviceSettings&, const TimeSource&)> create;
    std::vector<DeviceKey> keys = {};  // every key that the driver takes under [source]
    std::function<std::vector<FoundDevice>(bool with_details)> list = {};   // empty: nothing can be plugged in
    bool may_come_later = true;        // hardware: a failed open() is tried again; false, a file: it is the user's error
};

// The drivers that are built in. The recording player's row (replay/player_device.hpp) is added by the programs.
[[nodiscard]] const std::vector<DeviceRow>& device_table();

}  // namespace fovea::drivers
