#include "daemon/service/daemon.hpp"

#include <csignal>
#include <unistd.h>

#include <algorithm>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <spdlog/spdlog.h>

#include "daemon/service/admin_request.hpp"
#include "daemon/service/admin_server.hpp"
#include "daemon/service/calibration_file.hpp"
#include "daemon/service/config_keys.hpp"
#include "daemon/service/endpoint.hpp"

namespace fovea::service {
namespace {

namespace asio = boost::asio;

constexpr Duration kRateWindow = std::chrono::seconds(1);

AccessRules rules_of(const ServerSettings& s) {
    return {.uids = s.uids, .gids = s.gids, .sample_uids = s.sample_uids, .max_clients = static_cast<std::size_t>(s.max_clients)};
}

// The socket is for the daemon's own user unless the config admits others; who they are is checked at the handshake.
mode_t socket_mode(const ServerSettings& s) { return s.uids.empty() && s.gids.empty() ? 0600 : 0666; }

std::vector<std::string> changed_keys(const Config& a, const Config& b) {
    std::vector<std::string> changed;
    for (const ConfigKey& key : config_keys())
        if (key.get(a) != key.get(b)) changed.push_back(key.section + "." + key.name);
    if (a.source.device.values != b.source.device.values) changed.emplace_back("source");
    return changed;
}

}  // namespace

struct Daemon::State {
    State(DaemonParts p, const TimeSource& t, FocusPublisher f, SamplesPublisher s, FocusReader own, Endpoint focus_end,
          Endpoint admin_end)
        : parts{std::move(p)},
          time{t},
          focus{std::move(f)},
          samples{std::move(s)},
          reader{std::move(own)},
          focus_endpoint{std::move(focus_end)},
          admin_endpoint{std::move(admin_end)},
          clients{std::in_place, io, focus_endpoint, ClientServer::Regions{focus.fd(), samples}, rules_of(parts.config.server),
                  time, [this] { clients_changed(); }},
          admin{std::in_place, io, admin_endpoint, [this](const std::string& line) { return answer(line); }},
          signals{io, SIGINT, SIGTERM},
          reload_signal{io, SIGHUP},
          tick_timer{io},
          linger_timer{io},
          started{time.now()} {}

    Result<void> make_loop() {
        Result<DaemonParts::Source> source = parts.make_source(parts.config);
        if (!source) return std::unexpected(source.error());
        Result<pipeline::Pipeline> pipe = create_pipeline(parts.config.pipeline, parts.config.calibration);
        if (!pipe) return std::unexpected(pipe.error());
        loop.emplace(std::move(source->device), source->may_come_later, std::move(*pipe),
                     SourceLoop::Outputs{focus, samples}, time,
                     [this, number = ++loop_number] {
                         asio::post(io, [this, number] {
                             if (number == loop_number) source_changed();  // not of a loop that was replaced
                         });
                     },
                     published_before,
                     SourceCare{.realtime_priority = static_cast<int>(parts.config.source.realtime_priority),
                                .rehearse = parts.config.source.rehearse});
        return {};
    }

    Daemon::End run() {
        wait_for_signals();
        tick();
        if (parts.config.source.wait_for_client) {
            spdlog::info("waiting for the first client before the source is opened");
            tell_ready();
        } else {
            begin_source();
        }
        io.run();
        loop->stop();
        clients.reset();  // drains what was reported last
        admin.reset();
        return end;
    }

    void stop(Daemon::End how) {
        end = how;
        io.stop();
    }

    void wait_for_signals() {
        signals.async_wait([this](auto error, int number) {
            if (error) return;
            spdlog::info("{}: stopping", number == SIGINT ? "SIGINT" : "SIGTERM");
            stop(End::stopped);
        });
        wait_for_reload();
    }

    void wait_for_reload() {
        reload_signal.async_wait([this](auto error, int) {
            if (error) return;
            static_cast<void>(reload());
            wait_for_reload();
        });
    }

    // The heartbeat, and a look at what the clients report. Without clients only the heartbeat remains, at its slowest.
    void tick() {
        const Instant now = time.now();
        focus.beat(now);
        if (sleep_watch.slept()) {
            spdlog::warn("the machine has slept");
            if (begun) loop->look();   // it may be waiting for a device that says nothing
        }
        clients->drain();
        if (now - rate_from >= kRateWindow) {
            const std::uint64_t count = loop->status().published;
            if (rate_from != Instant{}) rate_hz = static_cast<double>(count - rate_count) / to_seconds(now - rate_from);
            rate_from = now;
            rate_count = count;
            tell_recording_fault();
        }
        tick_timer.expires_after(clients->size() == 0 ? kHeartbeatPeriod : std::min(parts.config.server.heartbeat, kHeartbeatPeriod));
        tick_timer.async_wait([this](auto error) {
            if (!error) tick();
        });
    }

    // Once per recording, when it begins to fail: a disk that is full should be known before the end.
    void tell_recording_fault() {
        if (!parts.recorder_status) return;
        const RecorderStatus r = parts.recorder_status();
        if (r.error.empty()) recording_fault_told = false;
        else if (!std::exchange(recording_fault_told, true)) spdlog::error("recording: {}; what cannot be written is counted as lost", r.error);
    }

    void clients_changed() {
        if (clients->size() > 0) begin_source();  // the first client, where it was waited for
        if (clients->size() == 1) tick();  // from the slow beat to the configured one; replaces the wait that is under way
        if (loop->status().state == SourceState::ended) leave_when_alone();
    }

    // Once; whether it has begun is known here, not from the loop's own state, which its thread has yet to set.
    void begin_source() {
        if (!std::exchange(begun, true)) loop->begin();
    }

    void source_changed() {
        const SourceStatus s = loop->status();
        if (s.state == said) return;
        said = s.state;
        const std::string name = s.device.name.empty() ? s.device.driver : s.device.name;
        switch (s.state) {
            case SourceState::waiting:
            case SourceState::opening: return;
            case SourceState::running: spdlog::info("source running: {} ({})", name, s.device.location); break;
            case SourceState::lost: spdlog::warn("source lost: {}; trying again", s.error.message()); break;
            case SourceState::ended: spdlog::info("source ended: {} models published", s.published); break;
            case SourceState::failed:
                // From its start that is the end; later there are clients, and an administrator who can choose another.
                failure = s.error;
                if (!was_ready || parts.exit_at_end) return stop(End::source_failed);
                spdlog::error("source failed: {}; waiting for another (fovea admin switch, or reload)", s.error.message());
                break;
        }
        if (parts.source_changed) {
            if (Result<void> ok = parts.source_changed(s); !ok) {
                failure = ok.error();
                return stop(End::failed);
            }
        }
        tell_ready();
        if (s.state == SourceState::ended) leave_when_alone();
    }

    void tell_ready() {
        if (!std::exchange(was_ready, true) && parts.ready) parts.ready();
    }

    // With exit_at_end: clients may still be finishing the frames that used the last models.
    void leave_when_alone() {
        if (!parts.exit_at_end) return;
        if (clients->size() == 0) return stop(End::source_ended);
        if (std::exchange(lingering, true)) return;
        linger_timer.expires_after(parts.linger);
        linger_timer.async_wait([this](auto error) {
            if (!error) stop(End::source_ended);
        });
    }

    AdminServer::Reply answer(const std::string& line) {
        const Result<AdminRequest> request = parse_admin_request(line);
        if (!request) return {error_json(request.error())};
        switch (request->command) {
            case AdminCommand::status: return {to_json(status())};
            case AdminCommand::reload: return {reload()};
            case AdminCommand::switch_source: return {take_over(parts.with_settings(parts.config, request->set))};
            case AdminCommand::record: return {record(request->path)};
            case AdminCommand::end_recording: {
                const Result<RecorderStatus> ended = parts.end_recording();
                return {ended ? recorded_json(*ended) : error_json(ended.error())};
            }
            case AdminCommand::stop: break;
        }
        spdlog::info("an administrator asked for the end");
        return {done_json({"stop"}, {}), [this] { stop(End::stopped); }};
    }

    std::string record(const std::string& path) {
        const Result<std::string> begun_file = parts.begin_recording(path, loop->status(), parts.config);
        if (!begun_file) return error_json(begun_file.error());
        return recorded_json(parts.recorder_status());
    }

    std::string reload() { return take_over(parts.read_config()); }

    // Makes `fresh` the config, as far as it can be taken over while running. A config with an error changes nothing.
    std::string take_over(Result<Config> fresh) {
        if (!fresh) {
            spdlog::error("config not reloaded: {}", fresh.error().message());
            return error_json(fresh.error());
        }
        std::vector<std::string> applied, needs_restart;
        bool new_pipeline = false, new_source = false;
        for (const std::string& key : changed_keys(parts.config, *fresh)) {
            const bool fixed = key.starts_with("record.") || key.ends_with("_socket") || key == "server.lock_memory";
            const bool source = key.starts_with("source");
            new_source |= source;
            new_pipeline |= !fixed && !source && !key.starts_with("server.") && !key.starts_with("log.");
            (fixed ? needs_restart : applied).push_back(key);
        }
        // What cannot be taken over stays as it is in effect, and so is named by every reload until the restart.
        for (const ConfigKey& key : config_keys())
            if (std::ranges::find(needs_restart, key.section + "." + key.name) != needs_restart.end()) key.set(*fresh, key.get(parts.config));
        new_pipeline |= !fresh->calibration.empty();  // the person may have calibrated anew, into the same file
        Config before = std::exchange(parts.config, std::move(*fresh));
        if (Result<void> ok = apply(new_pipeline, new_source); !ok) {
            parts.config = std::move(before);
            spdlog::error("config not reloaded: {}", ok.error().message());
            return error_json(ok.error());
        }
        clients->set_rules(rules_of(parts.config.server));
        if (auto ok = focus_endpoint.set_mode(socket_mode(parts.config.server)); !ok) spdlog::error("{}", ok.error().message());
        if (parts.set_log_level) parts.set_log_level(parts.config.log.level);
        if (parts.config_changed) parts.config_changed(parts.config);
        spdlog::info("config reloaded: {} keys changed, {} need a restart", applied.size(), needs_restart.size());
        return done_json(applied, needs_restart);
    }

    Result<void> apply(bool new_pipeline, bool new_source) {
        Result<pipeline::Pipeline> pipe = create_pipeline(parts.config.pipeline, parts.config.calibration);
        if (!pipe) return std::unexpected(pipe.error());
        if (new_source) {
            Result<DaemonParts::Source> source = parts.make_source(parts.config);
            if (!source) return std::unexpected(source.error());
            loop->stop();
            published_before = loop->published();
            said = SourceState::waiting;
            if (auto made = make_loop(); !made) return made;
            if (begun || !parts.config.source.wait_for_client) {
                begun = true;
                loop->begin();
            }
        } else if (new_pipeline) {
            loop->set_pipeline(std::move(*pipe));
        }
        focus.set_policy(parts.config.pipeline.loss);
        return {};
    }

    DaemonStatus status() const {
        const Instant now = time.now();
        DaemonStatus s;
        s.pid = ::getpid();
        s.uptime_ns = (now - started).count();
        s.focus_socket = focus_endpoint.path();
        s.admin_socket = admin_endpoint.path();
        s.source = loop->status();
        if (s.source.newest_received_ns != 0) s.newest_age_ns = to_ns(now) - s.source.newest_received_ns;
        s.rate_hz = rate_hz;
        s.clients = clients->clients();
        s.counters = clients->counters();
        MotionModel newest;
        if (reader.read(newest)) {
            s.model_age_ns = to_ns(now) - to_ns(newest.published);
            s.model = newest;
        }
        if (parts.recorder_status) s.recorder = parts.recorder_status();
        return s;
    }

    DaemonParts parts;
    const TimeSource& time;
    asio::io_context io{1};
    FocusPublisher focus;
    SamplesPublisher samples;
    FocusReader reader;                 // the newest model, as any client sees it
    Endpoint focus_endpoint, admin_endpoint;
    std::optional<SourceLoop> loop;
    std::optional<ClientServer> clients;
    std::optional<AdminServer> admin;
    asio::signal_set signals, reload_signal;
    asio::steady_timer tick_timer, linger_timer;
    Instant started;

    SleepWatch sleep_watch{time_asleep};
    Published published_before;
    std::uint64_t loop_number = 0;
    SourceState said = SourceState::waiting;
    bool begun = false, was_ready = false, lingering = false, recording_fault_told = false;
    Daemon::End end = Daemon::End::stopped;
    Error failure;
    Instant rate_from{};
    std::uint64_t rate_count = 0;
    double rate_hz = -1;
};

Result<std::unique_ptr<Daemon>> Daemon::create(DaemonParts parts, const TimeSource& time) {
    // The sockets first: a second daemon is refused before it does anything.
    Result<Endpoint> focus_end = Endpoint::listen(parts.focus_path, SOCK_SEQPACKET, socket_mode(parts.config.server));
    if (!focus_end) return std::unexpected(focus_end.error());
    Result<Endpoint> admin_end = Endpoint::listen(parts.admin_path, SOCK_STREAM, 0600);
    if (!admin_end) return std::unexpected(admin_end.error());
    Result<FocusPublisher> focus = FocusPublisher::create(parts.config.pipeline.loss, time.now());
    if (!focus) return std::unexpected(focus.error());
    Result<SamplesPublisher> samples = SamplesPublisher::create({}, focus->epoch());
    if (!samples) return std::unexpected(samples.error());
    Result<FocusReader> reader = FocusReader::map(focus->fd());
    if (!reader) return std::unexpected(reader.error());
    auto state = std::make_unique<State>(std::move(parts), time, std::move(*focus), std::move(*samples), std::move(*reader),
                                         std::move(*focus_end), std::move(*admin_end));
    if (auto ok = state->make_loop(); !ok) return std::unexpected(ok.error());
    return std::unique_ptr<Daemon>(new Daemon(std::move(state)));
}

Daemon::Daemon(std::unique_ptr<State> state) : state_{std::move(state)} {}
Daemon::~Daemon() = default;
Daemon::End Daemon::run() { return state_->run(); }
void Daemon::request_stop() noexcept {
    asio::post(state_->io, [state = state_.get()] { state->stop(End::stopped); });
}
int Daemon::samples_fd() const noexcept { return state_->samples.fd(); }
const Error& Daemon::error() const noexcept { return state_->failure; }

}  // namespace fovea::service
