// `fovea record`: what a running fovead publishes, into a session file of the caller's own.
//
// It reads the ring of raw samples like any recorder: the daemon waits for nobody, and what came too fast is counted.
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line/checks.hpp"
#include "daemon/service/admin_client.hpp"
#include "protocol/handshake.hpp"
#include "replay/recorder.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {
namespace {

struct Options {
    std::string out, run_dir, socket;
    double duration_s = 0;
    bool overwrite = false, with_past = false, quiet = false;
};

volatile std::sig_atomic_t interrupted = 0;

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea record: {}\n", error.message());
    return code;
}

// What is recorded, as far as the administrators' socket may be asked; a recorder need not be an administrator.
void describe_source(const std::string& admin_socket, replay::RecorderOptions& options) {
    const auto answer = service::ask_daemon(admin_socket, R"({"command":"status"})");
    if (!answer) return;
    const auto reply = nlohmann::json::parse(*answer, nullptr, false);
    if (!reply.is_object() || !reply.contains("status") || !reply["status"].contains("source")) return;
    const auto& source = reply["status"]["source"];
    const auto word = [&](const char* key) { return source.contains(key) && source[key].is_string() ? source[key].get<std::string>() : ""; };
    options.info.device = word("name");
    options.info.source = word("location");
    if (source.contains("nominal_rate_hz") && source["nominal_rate_hz"].is_number()) options.info.nominal_rate_hz = source["nominal_rate_hz"].get<double>();
    options.meta["driver"] = word("driver");
}

int run(const Options& o) {
    std::string focus = o.socket, admin = service::default_admin_path();
    if (focus.empty()) focus = o.run_dir.empty() ? default_socket_path() : (std::filesystem::path(o.run_dir) / "focus.sock").string();
    if (!o.run_dir.empty()) admin = (std::filesystem::path(o.run_dir) / "admin.sock").string();
    else if (!o.socket.empty()) admin = (std::filesystem::path(o.socket).parent_path() / "admin.sock").string();
    auto connection = connect_to_daemon(focus, {.grants = kGrantSamples, .pid = ::getpid(), .name = "fovea record"});
    if (!connection) return report(connection.error(), connection.error().fault == ConnectFault::no_daemon ? kNoDaemon : kFailed);
    auto ring = SamplesReader::map(connection->samples.get());
    if (!ring) return report(ring.error(), kFailed);
    if (!o.with_past) ring->skip_to_newest();
    replay::RecorderOptions options;
    options.overwrite = o.overwrite;
    options.from_oldest = o.with_past;
    options.meta = {{"fovea_version", FOVEA_VERSION}};
    describe_source(admin, options);
    auto recorder = replay::Recorder::start(o.out, *std::move(ring), options);
    if (!recorder) {
        Error error = recorder.error();
        if (error.what == "the file exists") error.way_out = "choose another name, or say --force";
        return report(error, kFailed);
    }

    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = 1; };
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
    const bool terminal = !o.quiet && ::isatty(STDERR_FILENO) != 0;
    if (!o.quiet && !terminal) fmt::print(stderr, "recording to {}\n", o.out);
    const SystemTime time;
    const Instant begin = time.now();
    bool daemon_gone = false;
    std::optional<Error> fault;
    while (interrupted == 0 && !daemon_gone && !fault) {
        const double left_s = o.duration_s > 0 ? o.duration_s - to_seconds(time.now() - begin) : 1e9;
        if (left_s <= 0) break;
        pollfd socket{connection->socket.get(), POLLIN, 0};   // silent until the daemon goes
        daemon_gone = ::poll(&socket, 1, static_cast<int>(std::min(200.0, left_s * 1e3 + 1))) > 0;
        fault = recorder->error();
        const replay::RecorderStatus s = recorder->status();
        if (terminal) {
            fmt::print(stderr, "\r\033[Krecording to {}: {:.1f} s, {} samples, {} frames; Ctrl-C ends", o.out, to_seconds(time.now() - begin), s.samples, s.frames);
            std::fflush(stderr);
        }
    }
    if (terminal) fmt::print(stderr, "\r\033[K");
    const auto end = recorder->stop();
    if (!end) return report(end.error(), kFailed);
    fmt::print("{}: {} samples, {} frames in {:.1f} s", o.out, end->samples, end->frames, to_seconds(time.now() - begin));
    if (end->samples_lost + end->frames_lost + end->rows_dropped != 0)
        fmt::print("; lost, because they came too fast: {} samples, {} frames, {} rows", end->samples_lost, end->frames_lost, end->rows_dropped);
    fmt::print("\n");
    if (daemon_gone) fmt::print(stderr, "fovea record: fovead has ended; what it published until then is in the file\n");
    return kSuccess;
}

}  // namespace

void add_record(CLI::App& app, int* exit_code);
void add_record(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = app.add_subcommand("record", "Record what a running fovead publishes into a session file of your own");
    c->add_option("file", o->out, "The session file, e.g. OUT.fovea")->required()->check(command_line::file_name());
    c->add_option("--duration", o->duration_s, "Seconds; default: until Ctrl-C or the daemon's end")->check(command_line::within(0.0, 1e9));
    c->add_option("--run-dir", o->run_dir, "The daemon's run directory (default: $XDG_RUNTIME_DIR/fovea, else /run/fovea)");
    c->add_option("--socket", o->socket, "The daemon's socket for apps itself (default: $FOVEA_SOCKET)");
    c->add_flag("--from-oldest", o->with_past, "Also what the daemon still holds from before (seconds)");
    c->add_flag("--force", o->overwrite, "Overwrite the file if it exists");
    c->add_flag("--quiet", o->quiet, "No progress on stderr");
    c->footer("Raw gaze is biometric: the daemon gives it to root, to its own user, and to the users in server.sample_uids.\n"
              "`fovea admin record` has the daemon write the file itself. `fovea latency FILE` and `fovea replay FILE` read it.\n"
              "Exit codes: 0 recorded, 1 no grant or cannot write, 2 wrong usage, 4 no fovead is running there.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
