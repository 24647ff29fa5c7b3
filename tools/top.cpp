// `fovea top`: a running fovead, live: source and rate, gaze event, latency by stage, foveal misses, clients.
//
// Status comes from the administrators' socket; latency and misses are computed here, from the ring of raw samples and
// frame reports, over the last seconds: that needs the raw-samples grant, and says so where it is missing.
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "command_line/checks.hpp"
#include "daemon/service/admin_client.hpp"
#include "protocol/handshake.hpp"
#include "protocol/samples_region.hpp"
#include "tools/commands.hpp"
#include "tools/top_view.hpp"

namespace fovea::tools {
namespace {

struct Options {
    std::string run_dir, socket;
    double interval_s = 1, window_s = 5;
    long count = 0;
    bool json = false, wait = false;
};

volatile std::sig_atomic_t interrupted = 0;

// The terminal as it was is back when this goes, also after a signal: the loop ends, this is destroyed.
class Screen {
public:
    Screen() {
        keys_ = ::isatty(STDIN_FILENO) != 0 && ::tcgetattr(STDIN_FILENO, &before_) == 0;
        if (keys_) {
            termios raw = before_;
            raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);   // Ctrl-C stays a signal
            ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
        }
        write("\033[?1049h\033[?25l");   // the other screen, no cursor
    }
    ~Screen() {
        write("\033[?25h\033[?1049l");
        if (keys_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
    }
    Screen(const Screen&) = delete;
    Screen& operator=(const Screen&) = delete;

    void draw(const TopLook& look) const {
        winsize size{};
        if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) size.ws_col = 80, size.ws_row = 24;
        std::string text = "\033[H";
        bool first = true;
        for (const std::string& line : top_screen(look, size.ws_col, size.ws_row)) {
            text += (first ? "" : "\r\n") + line + "\033[K";
            first = false;
        }
        write(text + "\033[J");
    }
    // Waits; true when q was pressed.
    [[nodiscard]] bool wait(Duration d) const {
        pollfd in{keys_ ? STDIN_FILENO : -1, POLLIN, 0};
        char key = 0;
        if (::poll(&in, 1, std::max(0, static_cast<int>(to_seconds(d) * 1e3))) <= 0) return false;
        return ::read(STDIN_FILENO, &key, 1) != 1 || key == 'q' || key == 'Q';
    }

private:
    static void write(const std::string& text) {
        std::fwrite(text.data(), 1, text.size(), stdout);
        std::fflush(stdout);
    }
    termios before_{};
    bool keys_ = false;
};

// What was published in the last seconds.
class Window {
public:
    void connect(const std::string& focus_socket, std::string* trouble) {
        if (reader_ || refused_) {
            if (refused_) *trouble = *refused_;
            return;
        }
        auto c = connect_to_daemon(focus_socket, {.grants = kGrantSamples, .pid = ::getpid(), .name = "fovea top"});
        if (!c) {
            if (c.error().fault == ConnectFault::permission) refused_ = "needs the raw-samples grant: your user id in server.sample_uids, or run it as the daemon's user";
            *trouble = refused_ ? *refused_ : c.error().message();
            return;
        }
        auto reader = SamplesReader::map(c->samples.get());
        if (!reader) {
            *trouble = reader.error().message();
            return;
        }
        connection_ = *std::move(c);
        reader_.emplace(*std::move(reader));
    }
    void disconnect() {
        reader_.reset();
        connection_ = {};
        refused_.reset();
        lost_before_.reset();
        samples_.clear();
        frames_.clear();
    }
    [[nodiscard]] bool open() const noexcept { return reader_.has_value(); }

    void drain(Instant now, Duration window) {
        SampleRecord s;
        while (reader_->next_sample(s))
            if (samples_.empty() || s.raw.exposed >= samples_.back().exposed) samples_.push_back(s.raw);   // truth is looked up by time
        FrameRecord f;
        while (reader_->next_frame(f)) frames_.push_back(f.timing);
        if (!lost_before_) lost_before_ = reader_->lost_samples() + reader_->lost_frames();   // overwritten long before this command
        // Samples reach a little further back than frames: a photon lies between two of them.
        while (!samples_.empty() && now - samples_.front().received > window + seconds(1)) samples_.pop_front();
        while (!frames_.empty() && now - frames_.front().photon > window) frames_.pop_front();
    }
    // The frames whose photon is past, so that the eye at that moment is known.
    [[nodiscard]] replay::LatencyReport judge() const {
        const std::vector<GazeSample> samples(samples_.begin(), samples_.end());
        std::vector<FrameTiming> shown;
        for (const FrameTiming& f : frames_)
            if (!samples.empty() && f.photon <= samples.back().exposed) shown.push_back(f);
        return replay::analyse_latency(shown, samples);
    }
    [[nodiscard]] std::uint64_t lost() const noexcept { return reader_->lost_samples() + reader_->lost_frames() - lost_before_.value_or(0); }

private:
    Connection connection_;
    std::optional<SamplesReader> reader_;
    std::optional<std::string> refused_;
    std::optional<std::uint64_t> lost_before_;
    std::deque<GazeSample> samples_;
    std::deque<FrameTiming> frames_;
};

class Top {
public:
    explicit Top(const Options& o) : o_(o), begin_(time_.now()) {
        admin_ = o.socket;
        if (admin_.empty()) admin_ = o.run_dir.empty() ? service::default_admin_path() : (std::filesystem::path(o.run_dir) / "admin.sock").string();
    }

    TopLook look(bool* no_daemon) {
        TopLook look;
        look.at_s = to_seconds(time_.now() - begin_);
        look.window_s = o_.window_s;
        *no_daemon = false;
        const auto answer = service::ask_daemon(admin_, R"({"command":"status"})");
        if (!answer) {
            window_.disconnect();
            look.trouble = answer.error().message();
            *no_daemon = answer.error().no_daemon;
            return look;
        }
        const auto reply = nlohmann::json::parse(*answer, nullptr, false);
        if (!reply.is_object() || !reply.contains("status") || !reply["status"].is_object()) {
            look.trouble = admin_ + ": the answer is not that of a fovead of this version";
            return look;
        }
        look.connected = true;
        look.status = reply["status"];
        // This command reads the samples as a client of its own, which is none of those that are watched.
        if (auto& clients = look.status["clients"]; clients.is_array())
            std::erase_if(clients.get_ref<nlohmann::json::array_t&>(), [](const nlohmann::json& c) { return c.is_object() && c.value("pid", 0L) == ::getpid(); });
        if (pid_ != look.status.value("pid", 0L)) window_.disconnect();   // another daemon: another ring
        pid_ = look.status.value("pid", 0L);
        window_.connect(look.status.value("focus_socket", std::string()), &look.trouble);
        if (!window_.open()) return look;
        look.sees_frames = true;
        window_.drain(time_.now(), seconds(o_.window_s));
        look.latency = window_.judge();
        look.lost = window_.lost();
        return look;
    }

    int run() {
        struct sigaction action {};
        action.sa_handler = [](int) { interrupted = 1; };
        for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
        bool no_daemon = false;
        TopLook first = look(&no_daemon);
        if (!first.connected && !o_.wait) {
            fmt::print(stderr, "fovea top: {}\n", first.trouble);
            return no_daemon ? kNoDaemon : kFailed;
        }
        std::optional<Screen> screen;
        if (::isatty(STDOUT_FILENO) != 0 && !o_.json) screen.emplace();
        for (long shown = 0; interrupted == 0; ++shown) {
            const Instant next = time_.now() + seconds(o_.interval_s);
            const TopLook now = shown == 0 ? first : look(&no_daemon);
            if (screen) screen->draw(now);
            else if (!print(now)) break;   // whoever read the pipe has gone
            if (o_.count != 0 && shown + 1 == o_.count) break;
            if (screen && screen->wait(next - time_.now())) break;
            if (!screen) pause_until(next);
        }
        return kSuccess;
    }

private:
    [[nodiscard]] bool print(const TopLook& look) const {
        const std::string line = (o_.json ? top_json(look) : top_line(look)) + "\n";
        return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() && std::fflush(stdout) == 0;
    }
    void pause_until(Instant until) const {
        while (interrupted == 0 && time_.now() < until) {
            const std::int64_t left = (until - time_.now()).count();
            if (left <= 0) return;
            const timespec pause{left / 1'000'000'000, static_cast<long>(left % 1'000'000'000)};
            ::nanosleep(&pause, nullptr);   // a signal ends it
        }
    }

    const Options& o_;
    SystemTime time_;
    Instant begin_;
    std::string admin_;
    long pid_ = 0;
    Window window_;
};

}  // namespace

void add_top(CLI::App& app, int* exit_code);
void add_top(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = app.add_subcommand("top", "Watch a running fovead: rate, gaze event, latency by stage, foveal misses, clients");
    c->add_option("--run-dir", o->run_dir, "The daemon's run directory (default: $XDG_RUNTIME_DIR/fovea, else /run/fovea)");
    c->add_option("--socket", o->socket, "The administrators' socket itself, where it has another path");
    c->add_option("--interval", o->interval_s, "Seconds between looks (default 1)")->check(command_line::within(0.05, 3600.0));
    c->add_option("--window", o->window_s, "Seconds of frames that the figures cover (default 5)")->check(command_line::within(0.5, 20.0));
    c->add_option("--count", o->count, "End after so many looks; default: until q or Ctrl-C")->check(CLI::Range(1L, 1'000'000'000L));
    c->add_flag("--json", o->json, "One JSON object per look");
    c->add_flag("--wait", o->wait, "Start without a fovead and show it as soon as there is one");
    c->footer("On a terminal it redraws; into a pipe it writes one line per look.\n"
              "Latency and misses need the raw-samples grant (server.sample_uids), which root and the daemon's user have.\n"
              "Exit codes: 0 ended as asked, 1 may not ask, 2 wrong usage, 4 no fovead is running there.");
    c->callback([o, exit_code] { *exit_code = Top(*o).run(); });
}

}  // namespace fovea::tools
