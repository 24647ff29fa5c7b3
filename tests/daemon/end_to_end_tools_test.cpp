// `fovea record`, `fovea top` and `fovea doctor` beside a real fovead.
#include <gmock/gmock.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <thread>

#include <nlohmann/json.hpp>
#include <pty.h>
#include <sys/wait.h>

#include "replay/session_file.hpp"
#include "tests/daemon/daemon_process.hpp"

namespace fovea {
namespace {

using test::DaemonProcess;
using test::eventually;
using test::Finished;
using test::run_program;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr unsigned kNobody = 65534;
const std::string kFovea = FOVEA_BIN_DIR "/fovea";

Finished fovea(std::vector<std::string> arguments, unsigned uid = 0) {
    arguments.insert(arguments.begin(), kFovea);
    return run_program(arguments, uid);
}

DaemonProcess looping(const TemporaryFolder& folder) { return {folder, {.arguments = {"--set", "source.loop=true"}}}; }

TEST(FoveaRecord, WritesWhatTheDaemonPublishesUntilTheTimeIsOver) {
    const TemporaryFolder folder;
    DaemonProcess daemon = looping(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const std::string file = folder / "mine.fovea";
    const Finished f = fovea({"record", file, "--run-dir", folder.path().string(), "--duration", "0.5", "--quiet"});
    ASSERT_EQ(f.code, 0) << f.error;
    EXPECT_THAT(f.out, HasSubstr("mine.fovea: "));
    const auto reader = replay::SessionReader::open(file);
    ASSERT_TRUE(reader.has_value()) << reader.error().message();
    const auto recording = replay::load_recording(file);
    ASSERT_TRUE(recording.has_value()) << recording.error().message();
    EXPECT_GT(recording->samples.size(), 100u);
    EXPECT_THAT(recording->info.device, HasSubstr("EyeLink"));
    const Finished again = fovea({"record", file, "--run-dir", folder.path().string(), "--duration", "0.1"});
    EXPECT_EQ(again.code, 1) << "an existing file is not overwritten";
    EXPECT_EQ(fovea({"record", file, "--run-dir", folder.path().string(), "--duration", "0.1", "--force"}).code, 0);
}

TEST(FoveaRecord, EndsWithTheDaemonAndKeepsWhatItHas) {
    const TemporaryFolder folder;
    DaemonProcess daemon = looping(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    Finished f;
    std::thread recorder([&] { f = fovea({"record", folder / "mine.fovea", "--run-dir", folder.path().string()}); });
    EXPECT_TRUE(eventually([&] { return daemon.log().find("fovea record") != std::string::npos; }));
    daemon.stop(SIGTERM);
    recorder.join();
    EXPECT_EQ(f.code, 0) << f.error;
    EXPECT_THAT(f.error, HasSubstr("fovead has ended"));
    EXPECT_TRUE(replay::SessionReader::open(folder / "mine.fovea").has_value());
}

TEST(FoveaRecord, NeedsADaemonAndItsGrant) {
    const TemporaryFolder folder;
    const Finished f = fovea({"record", folder / "mine.fovea", "--run-dir", folder.path().string()});
    EXPECT_EQ(f.code, 4);
    EXPECT_THAT(f.error, HasSubstr("focus.sock"));
    if (::geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
    DaemonProcess daemon(folder, {.arguments = {"--set", "source.loop=true", "--set", "server.uids=[65534]"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
    const std::string program = test::copy_for_others(kFovea, folder);
    const Finished refused = run_program({program, "record", folder / "never.fovea", "--run-dir", folder.path().string()}, kNobody);
    EXPECT_EQ(refused.code, 1) << refused.error;
    EXPECT_THAT(refused.error, HasSubstr("sample_uids"));
}

TEST(FoveaTop, WritesALinePerLookIntoAPipe) {
    const TemporaryFolder folder;
    DaemonProcess daemon = looping(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    ASSERT_TRUE(eventually([&] { return daemon.number("published") > 100; }));
    const Finished f = fovea({"top", "--run-dir", folder.path().string(), "--count", "3", "--interval", "0.1"});
    EXPECT_EQ(f.code, 0) << f.error;
    EXPECT_EQ(std::ranges::count(f.out, '\n'), 3);
    EXPECT_THAT(f.out, HasSubstr(" deg  latency -  misses 0/0  clients 0\n"));
    EXPECT_THAT(f.out, testing::Not(HasSubstr("clients 1"))) << "it does not count itself";
    EXPECT_EQ(f.out.find('\033'), std::string::npos) << "no terminal codes in a pipe";
    const Finished j = fovea({"top", "--run-dir", folder.path().string(), "--count", "1", "--json"});
    const auto look = nlohmann::json::parse(j.out, nullptr, false);
    EXPECT_EQ(look["source_state"], "running") << j.out;
    EXPECT_TRUE(look["event"].is_string());
}

TEST(FoveaTop, SaysThatNoDaemonAnswers) {
    const TemporaryFolder folder;
    const Finished f = fovea({"top", "--run-dir", folder.path().string()});
    EXPECT_EQ(f.code, 4);
    EXPECT_THAT(f.error, HasSubstr("admin.sock"));
    const Finished waiting = fovea({"top", "--run-dir", folder.path().string(), "--wait", "--count", "2", "--interval", "0.05"});
    EXPECT_EQ(waiting.code, 0) << waiting.error;
    EXPECT_THAT(waiting.out, HasSubstr("no fovead: "));
}

// In a terminal of its own: it redraws there, and a Ctrl-C leaves the terminal as it was.
TEST(FoveaTop, RestoresTheTerminalAfterCtrlC) {
    const TemporaryFolder folder;
    DaemonProcess daemon = looping(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    int terminal = -1;
    winsize size{.ws_row = 30, .ws_col = 100, .ws_xpixel = 0, .ws_ypixel = 0};
    const pid_t pid = ::forkpty(&terminal, nullptr, nullptr, &size);
    ASSERT_GE(pid, 0);
    if (pid == 0) {
        ::execl(kFovea.c_str(), "fovea", "top", "--run-dir", folder.path().c_str(), "--interval", "0.1", nullptr);
        ::_exit(127);
    }
    termios before{};
    ::tcgetattr(terminal, &before);
    std::string seen;
    const auto read_until = [&](const char* text) {
        char buffer[4096];
        while (seen.find(text) == std::string::npos) {
            const ssize_t n = ::read(terminal, buffer, sizeof buffer);   // EIO when it has ended
            if (n <= 0) return false;
            seen.append(buffer, static_cast<std::size_t>(n));
        }
        return true;
    };
    EXPECT_TRUE(read_until("clients "));
    EXPECT_THAT(seen, HasSubstr("\033[?1049h"));
    termios during{};
    ::tcgetattr(terminal, &during);
    EXPECT_EQ(during.c_lflag & (ICANON | ECHO), 0u);
    EXPECT_EQ(::write(terminal, "\x03", 1), 1);   // Ctrl-C
    EXPECT_TRUE(read_until("\033[?1049l"));
    EXPECT_THAT(seen, HasSubstr("\033[?25h"));
    int status = 0;
    ::waitpid(pid, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    termios after{};
    ::tcgetattr(terminal, &after);
    EXPECT_NE(after.c_lflag & ICANON, 0u);
    EXPECT_NE(after.c_lflag & ECHO, 0u);
    ::close(terminal);
}

TEST(FoveaDoctor, FindsTheDaemonAndCountsWhatItFound) {
    const TemporaryFolder folder;
    DaemonProcess daemon = looping(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const Finished f = fovea({"doctor", "--json", "--run-dir", folder.path().string()});
    const auto report = nlohmann::json::parse(f.out, nullptr, false);
    ASSERT_TRUE(report.is_object()) << f.out;
    int warnings = 0, failures = 0;
    std::map<std::string, std::string> verdicts;
    for (const auto& c : report["checks"]) {
        verdicts[c["subject"]] = c["verdict"];
        warnings += c["verdict"] == "warn";
        failures += c["verdict"] == "fail";
        EXPECT_TRUE(c["verdict"] == "ok" || !c["way_out"].get<std::string>().empty()) << c;
    }
    EXPECT_EQ(report["warnings"], warnings);
    EXPECT_EQ(report["failures"], failures);
    EXPECT_EQ(f.code, failures == 0 ? 0 : 1);
    EXPECT_EQ(verdicts["daemon"], "ok");
    EXPECT_EQ(verdicts["administration"], "ok");
    EXPECT_EQ(verdicts["shared memory"], "ok");
    EXPECT_TRUE(verdicts.contains("foveation probe")) << f.out;
}

TEST(FoveaDoctor, FailsWithAWayOutWhereThereIsNoDriver) {
    const TemporaryFolder folder;
    ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent", 1);
    const Finished f = fovea({"doctor", "--run-dir", folder.path().string()});
    ::unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
    EXPECT_EQ(f.code, 1);
    EXPECT_THAT(f.out, HasSubstr("fail  graphics driver"));
    EXPECT_THAT(f.out, HasSubstr("libegl-mesa0"));
    EXPECT_THAT(f.out, HasSubstr("warn  daemon"));
}

}  // namespace
}  // namespace fovea
