// `fovea devices`: what is plugged in, what it can do, and what stands in the way of using it.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>

#include <fmt/core.h>

#include "command_line/checks.hpp"
#include "drivers/device.hpp"
#include "protocol/sphere.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {

namespace {

using namespace fovea::drivers;

volatile std::sig_atomic_t interrupted = 0;

int no_such_driver(const std::string& driver) {
    fmt::print(stderr, "fovea devices: no driver is called '{}'; there are:\n", driver);
    for (const DeviceRow& row : device_table()) fmt::print(stderr, "  {:8}  {}\n", row.driver, row.one_line);
    return kUsage;
}

int list_devices(const std::string& driver, bool dump) {
    const auto called = [&](const DeviceRow& row) { return driver == row.driver; };
    if (!driver.empty() && std::ranges::none_of(device_table(), called)) return no_such_driver(driver);
    bool any = false, usable = false;
    for (const DeviceRow& row : device_table()) {
        if (!row.list || (!driver.empty() && driver != row.driver)) continue;
        for (const FoundDevice& d : row.list(dump)) {
            any = true;
            usable = usable || d.problem.empty();
            fmt::print("{}  {}  {}\n", row.driver, d.location, d.name);
            for (const std::string& fact : d.facts) fmt::print("    {}\n", fact);
            if (!d.problem.empty()) fmt::print("    CANNOT BE USED: {}\n", d.problem);
            if (dump) fmt::print("\n{}\n", d.details);
        }
    }
    if (!any) {
        fmt::print("No eye tracker is plugged in. Drivers that were asked:\n");
        for (const DeviceRow& row : device_table())
            if (row.list) fmt::print("  {:8}  {}\n", row.driver, row.one_line);
    }
    return usable ? kSuccess : kFailed;
}

// One line per sample: what the device says, before any filter.
int watch(const std::string& driver, const std::map<std::string, std::string>& values, long count, double patience_s) {
    for (const DeviceRow& row : device_table()) {
        if (driver != row.driver) continue;
        for (const auto& [key, value] : values) {
            bool known = false;
            for (const DeviceKey& k : row.keys) known = known || key == k.name;
            if (!known) {
                fmt::print(stderr, "fovea devices: the driver {} has no key '{}'; its keys:\n", driver, key);
                for (const DeviceKey& k : row.keys)
                    fmt::print(stderr, "  {} (default {}): {}\n", k.name, k.default_toml, k.doc);
                return kUsage;
            }
        }
        const SystemTime time;
        auto device = row.create(DeviceSettings{values, "--set", {}}, time);
        if (!device) {
            fmt::print(stderr, "fovea devices: {}\n", device.error().message());
            return kUsage;
        }
        if (auto opened = (*device)->open(); !opened) {
            fmt::print(stderr, "fovea devices: {}\n", opened.error().message());
            return kFailed;
        }
        const DeviceInfo info = (*device)->info();
        fmt::print("# {} at {}, {:g} Hz\n# id,device_time_ns,exposed_ns,received_ns,estimated", info.name, info.location,
                   info.nominal_rate_hz);
        for (const char* eye : {"combined", "left", "right"})
            fmt::print(",{0}_azimuth_deg,{0}_elevation_deg", eye);
        fmt::print("\n");
        std::signal(SIGINT, [](int) { interrupted = 1; });
        std::signal(SIGTERM, [](int) { interrupted = 1; });
        PollStatus status = PollStatus::nothing;
        Instant last = time.now();
        for (long n = 0; n < count && interrupted == 0;) {
            GazeSample s;
            status = (*device)->poll(s, time.now() + std::chrono::milliseconds(200));
            if (status == PollStatus::lost || status == PollStatus::ended) break;
            if (status == PollStatus::nothing) {
                if (patience_s > 0 && time.now() - last > seconds(patience_s)) break;
                continue;
            }
            last = time.now();
            ++n;
            fmt::print("{},{},{},{},{}", s.id, s.device_time.ns, to_ns(s.exposed), to_ns(s.received),
                       s.exposed_estimated ? 1 : 0);
            for (const EyeState& e : s.eyes) {
                const auto a = to_azimuth_elevation(e.gaze_dir_head);
                if (e.valid) fmt::print(",{:.5f},{:.5f}", a.azimuth_rad * 57.29577951308232, a.elevation_rad * 57.29577951308232);
                else fmt::print(",,");
            }
            fmt::print("\n");
            std::fflush(stdout);
        }
        const DeviceCounters c = (*device)->counters();
        fmt::print("# {} samples, {} malformed, {} dropped, {} losses{}{}\n", c.samples, c.malformed, c.dropped, c.losses,
                   c.losses > 0 ? ", the last: " : "", c.last_loss);
        return status == PollStatus::lost || (status == PollStatus::nothing && interrupted == 0) ? kFailed : kSuccess;
    }
    return no_such_driver(driver);
}

struct Options {
    std::string driver;
    bool dump = false, watch = false;
    long count = 1'000'000'000;
    double patience_s = 0;
    std::map<std::string, std::string> values;
    std::vector<std::string> settings;
};

}  // namespace

void add_devices(CLI::App& app, int* exit_code) {
    auto* command = app.add_subcommand("devices", "List the eye trackers that are plugged in");
    auto options = std::make_shared<Options>();
    command->add_option("driver", options->driver, "Only this driver's devices, e.g. hid");
    command->add_flag("--dump", options->dump, "Also print report descriptors, endpoints or formats in words");
    auto* watching = command->add_flag("--watch", options->watch, "Open DRIVER's device and print its samples, one line each");
    command->add_option("--count", options->count, "With --watch: stop after so many samples")->needs(watching)->check(CLI::Range(1L, 1'000'000'000L));
    command->add_option("--patience", options->patience_s,
                        "With --watch: give up after so many seconds without a sample (0: never)")
        ->needs(watching)->check(command_line::within(0.0, 3600.0));
    command->add_option("--set", options->settings, "With --watch: KEY=VALUE of the driver, as under [source]")->needs(watching);
    command->footer("Exit codes: 0 when a usable device was found (or watched to the end), 1 when not, 2 wrong usage.");
    command->callback([options, exit_code] {
        if (!options->watch) {
            *exit_code = list_devices(options->driver, options->dump);
            return;
        }
        if (options->driver.empty()) {
            fmt::print(stderr, "fovea devices: --watch opens the device of one driver: name it, e.g. `fovea devices hid --watch`\n");
            *exit_code = kUsage;
            return;
        }
        for (const std::string& s : options->settings) {
            const auto equals = s.find('=');
            if (equals == std::string::npos) {
                fmt::print(stderr, "fovea devices: --set wants KEY=VALUE, not '{}'\n", s);
                *exit_code = kUsage;
                return;
            }
            options->values[s.substr(0, equals)] = s.substr(equals + 1);
        }
        *exit_code = watch(options->driver, options->values, options->count, options->patience_s);
    });
}

}  // namespace fovea::tools
