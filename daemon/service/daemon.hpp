// The daemon: publishers, source loop and servers, run by one io_context on the thread that calls run().
//
//   source thread    device -> pipeline -> focus region, ring of samples             (source_loop.hpp)
//   service thread   sockets, heartbeat, the clients' frame reports -> ring of frames (this, client_server.hpp)
//   recorder thread  both rings -> session file: a subscriber, started by main.cpp    (replay/recorder.hpp)
//
// Threads: create, run and the destructor on one thread; request_stop() from any.
// Errors: create: sockets that cannot be made, settings that the pipeline refuses.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/service/config.hpp"
#include "daemon/service/status.hpp"

namespace fovea::service {

// What the programs' wiring gives: how to make a device, and who records.
struct DaemonParts {
    Config config;
    std::string focus_path, admin_path;                     // resolved
    struct Source {
        std::unique_ptr<drivers::Device> device;
        bool may_come_later = true;                         // DeviceRow::may_come_later
    };
    std::function<Result<Source>(const Config&)> make_source;
    std::function<Result<Config>()> read_config;            // for `reload`
    std::function<void(const std::string& level)> set_log_level;
    // The source's new state, on the service thread; an error ends the daemon. The first call comes before `ready`.
    std::function<Result<void>(const SourceStatus&)> source_changed;
    std::function<void(const Config&)> config_changed;      // after each `reload` or `switch` that was taken over
    // `config` with more keys set ("source.driver=hid"): for `switch`.
    std::function<Result<Config>(Config config, const std::vector<std::string>& set)> with_settings;
    // Sessions that an administrator asks for, on the service thread: the file's real name; what it holds at its end.
    std::function<Result<std::string>(const std::string& path, const SourceStatus&, const Config&)> begin_recording;
    std::function<Result<RecorderStatus>()> end_recording;
    std::function<RecorderStatus()> recorder_status;        // from the service thread
    std::function<void()> ready;                            // sockets listen and the source has been tried; once
    bool exit_at_end = false;                               // a recording's end ends the daemon
    Duration linger = std::chrono::seconds(2);              // ... after waiting this long for clients to leave
};

class Daemon {
public:
    enum class End : std::uint8_t { stopped, source_ended, source_failed, failed };

    [[nodiscard]] static Result<std::unique_ptr<Daemon>> create(DaemonParts parts, const TimeSource& time);
    ~Daemon();   // removes the sockets

    // Until SIGINT, SIGTERM, an administrator's stop, or the end of the source. On return the source is closed and the
    // clients' last reports are in the ring; a recorder can now finish.
    [[nodiscard]] End run();
    void request_stop() noexcept;

    [[nodiscard]] int samples_fd() const noexcept;          // for the recorder, which maps it like any subscriber
    [[nodiscard]] const Error& error() const noexcept;      // after End::source_failed and End::failed

private:
    struct State;
    explicit Daemon(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace fovea::service
