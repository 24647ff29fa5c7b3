// `fovead`: the daemon's wiring. Reads options and config, puts devices, service and recorder together, runs.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <CLI/CLI.hpp>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "command_line/checks.hpp"
#include "daemon/recording.hpp"
#include "daemon/service/calibration_file.hpp"
#include "daemon/service/daemon.hpp"
#include "daemon/service/endpoint.hpp"
#include "protocol/handshake.hpp"
#include "replay/player_device.hpp"

namespace {

using namespace fovea;

// Listed by --help; scripts rely on them.
enum ExitCode : int {
    kSuccess = 0,
    kFailed = 1,
    kUsage = 2,
    kBadInput = 3,
    kInUse = 4,
};

constexpr const char* kFooter =
    "Exit codes: 0 ended as asked, 1 failed while starting or running, 2 wrong options or config,\n"
    "3 unusable recording, 4 another fovead serves the same sockets.\n"
    "Signals: SIGINT and SIGTERM end it cleanly, SIGHUP reads the config again.\n"
    "Try: fovead --set source.path=RECORDING --run-dir /tmp/fovea, then fovea status --run-dir /tmp/fovea";

struct Options {
    std::string config;
    std::vector<std::string> set;
    std::string run_dir, record, ready_file;
    bool exit_at_end = false, print_config = false;
    double linger_s = 2;
};

std::vector<drivers::DeviceRow> all_devices() {
    std::vector<drivers::DeviceRow> rows = {replay::player_row()};
    rows.insert(rows.end(), drivers::device_table().begin(), drivers::device_table().end());
    return rows;
}

int complain(const Error& error, int code) {
    std::fprintf(stderr, "fovead: %s\n", error.message().c_str());
    return code;
}

Result<service::Config> read_config(const Options& options, const std::vector<drivers::DeviceRow>& devices) {
    service::Config config;
    if (!options.config.empty()) {
        Result<service::Config> loaded = service::load_config(options.config, devices);
        if (!loaded) return loaded;
        config = std::move(*loaded);
    }
    for (const std::string& assignment : options.set)
        if (auto ok = service::set_key(config, assignment, devices); !ok) return std::unexpected(ok.error());
    if (!options.record.empty()) config.record.path = options.record;
    return config;
}

Result<service::DaemonParts::Source> make_source(const service::Config& config,
                                                 const std::vector<drivers::DeviceRow>& devices, const TimeSource& time) {
    for (const drivers::DeviceRow& row : devices) {
        if (config.source.driver != row.driver) continue;
        Result<std::unique_ptr<drivers::Device>> device = row.create(config.source.device, time);
        if (!device) return std::unexpected(device.error());
        return service::DaemonParts::Source{std::move(*device), row.may_come_later};
    }
    return fail("unknown driver '" + config.source.driver + "'");
}

// A FIFO is held open to the end, so that whoever waits may open it before or after this.
void say_ready(const std::string& file, UniqueFd& held) {
    if (!file.empty()) {
        struct stat s {};
        const bool fifo = ::stat(file.c_str(), &s) == 0 && S_ISFIFO(s.st_mode);
        UniqueFd fd(::open(file.c_str(), (fifo ? O_RDWR | O_NONBLOCK : O_WRONLY | O_CREAT | O_TRUNC) | O_CLOEXEC, 0644));
        if (!fd || ::write(fd.get(), "ready\n", 6) != 6)
            spdlog::error("cannot write the ready file {}: {}", file, std::strerror(errno));
        if (fifo) held = std::move(fd);
    }
    // systemd's readiness protocol (sd_notify(3)): a datagram to the socket that it names.
    const char* name = std::getenv("NOTIFY_SOCKET");
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (name == nullptr || std::strlen(name) >= sizeof address.sun_path || (name[0] != '/' && name[0] != '@')) return;
    const std::size_t length = std::strlen(name);
    std::memcpy(address.sun_path, name, length);
    if (name[0] == '@') address.sun_path[0] = '\0';
    UniqueFd fd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length + (name[0] == '/' ? 1 : 0));
    if (fd) static_cast<void>(::sendto(fd.get(), "READY=1", 7, MSG_NOSIGNAL, reinterpret_cast<sockaddr*>(&address), size));
}

void set_log_level(const std::string& level) {
    spdlog::set_level(level == "error" ? spdlog::level::err : spdlog::level::from_str(level));
}

void set_up_log(const std::string& level) {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("fovead", std::make_shared<spdlog::sinks::stderr_sink_mt>()));
    spdlog::set_pattern("fovead: %H:%M:%S.%e %l: %v");
    spdlog::flush_on(spdlog::level::debug);
    set_log_level(level);
}

int run(const Options& options) {
    const SystemTime time;
    const std::vector<drivers::DeviceRow> devices = all_devices();
    if (options.print_config) {
        std::fputs(service::print_default_config(devices).c_str(), stdout);
        return kSuccess;
    }
    Result<service::Config> config = read_config(options, devices);
    if (!config) return complain(config.error(), kUsage);
    set_up_log(config->log.level);
    // Before anything is made: keys that the driver does not accept are config errors too.
    if (auto source = make_source(*config, devices, time); !source) return complain(source.error(), kUsage);
    if (auto pipe = service::create_pipeline(config->pipeline, config->calibration); !pipe) return complain(pipe.error(), kUsage);

    const std::filesystem::path run_dir =
        options.run_dir.empty() ? std::filesystem::path(default_socket_path()).parent_path() : std::filesystem::path(options.run_dir);
    const auto socket_path = [&](const std::string& set, const char* name) { return set.empty() ? (run_dir / name).string() : set; };

    Recording recording(config->record.path);
    UniqueFd ready_fifo;
    int samples_fd = -1;
    service::DaemonParts parts{
        .config = *config,
        .focus_path = socket_path(config->server.focus_socket, "focus.sock"),
        .admin_path = socket_path(config->server.admin_socket, "admin.sock"),
        .make_source = [&](const service::Config& c) { return make_source(c, devices, time); },
        .read_config = [&] { return read_config(options, devices); },
        .set_log_level = set_log_level,
        .source_changed = [&](const service::SourceStatus& s) { return recording.source_changed(s, *config, samples_fd); },
        .config_changed = [&](const service::Config& c) {
            *config = c;   // what a session that begins later is made with
            recording.config_changed(c);
        },
        .with_settings = [&](service::Config c, const std::vector<std::string>& set) -> Result<service::Config> {
            // A driver's keys mean nothing to another one.
            if (std::ranges::any_of(set, [](const std::string& s) { return s.starts_with("source.driver="); })) c.source.device = {};
            for (const std::string& assignment : set)
                if (auto ok = service::set_key(c, assignment, devices); !ok) return std::unexpected(ok.error());
            return c;
        },
        .begin_recording = [&](const std::string& path, const service::SourceStatus& s, const service::Config& c) {
            return recording.begin(path, s, c, samples_fd);
        },
        .end_recording = [&] { return recording.end(); },
        .recorder_status = [&] { return recording.status(); },
        .ready = [&] {
            spdlog::info("ready");
            say_ready(options.ready_file, ready_fifo);
        },
        .exit_at_end = options.exit_at_end,
        .linger = seconds(options.linger_s),
    };
    Result<std::unique_ptr<service::Daemon>> daemon = service::Daemon::create(std::move(parts), time);
    if (!daemon) return complain(daemon.error(), daemon.error().what.starts_with(service::Endpoint::kInUse) ? kInUse : kFailed);
    samples_fd = (*daemon)->samples_fd();
    if (config->server.lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
        spdlog::warn("cannot lock memory: {} (raise the memlock limit or set lock_memory = false)", std::strerror(errno));

    const service::Daemon::End end = (*daemon)->run();
    int code = kSuccess;
    if (end == service::Daemon::End::source_failed) code = complain((*daemon)->error(), kBadInput);
    if (end == service::Daemon::End::failed) code = complain((*daemon)->error(), kFailed);
    if (auto finished = recording.finish(); !finished && code == kSuccess) code = complain(finished.error(), kFailed);
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"fovead: gaze from an eye tracker or a recording in, focal points for VR apps out", "fovead"};
    Options options;
    app.add_option("-c,--config", options.config, "TOML file with the settings; all of them have defaults")->check(CLI::ExistingFile);
    app.add_option("--set", options.set, "Override one setting, e.g. --set source.path=gaze.csv; may be repeated")->type_name("KEY=VALUE");
    app.add_option("--run-dir", options.run_dir, "Folder for both sockets (default: $XDG_RUNTIME_DIR/fovea, else /run/fovea)");
    app.add_option("--record", options.record, "Session file to write; a number is added if it exists")->check(command_line::file_name());
    app.add_option("--ready-file", options.ready_file, "File or FIFO that receives the line \"ready\" once clients can connect");
    auto* exits = app.add_flag("--exit-at-end", options.exit_at_end, "End when a recording has been played");
    app.add_option("--linger", options.linger_s, "With --exit-at-end: seconds to wait for clients to leave")->needs(exits)
        ->check(command_line::within(0, 3600))->capture_default_str();
    app.add_flag("--print-config", options.print_config, "Print the default settings with their docs as TOML, and end");
    app.failure_message([](const CLI::App*, const CLI::Error& e) { return std::string("fovead: ") + e.what() + "; `fovead --help` explains\n"; });
    app.set_version_flag("--version", "fovead " FOVEA_VERSION);
    app.footer(kFooter);
    try {
        app.parse(argc, argv);
        ::signal(SIGPIPE, SIG_IGN);
        ::signal(SIGXFSZ, SIG_IGN);   // a session that reaches LimitFSIZE= is a full disk, not the end
        return run(options);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? kSuccess : kUsage;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "fovead: %s\n", e.what());
        return kFailed;
    }
}
