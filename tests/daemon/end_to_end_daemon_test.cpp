// A real fovead from its start to its end: options, bad input, signals, reload, status, and exactness.
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "daemon/pipeline/pipeline.hpp"
#include "daemon/service/admin_client.hpp"
#include "protocol/handshake.hpp"
#include "replay/session_file.hpp"
#include "tests/daemon/daemon_process.hpp"

namespace fovea {
namespace {

using test::DaemonProcess;
using test::eventually;
using test::Finished;
using test::run_program;
using test::shipped_recording;
using test::TemporaryFolder;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr unsigned kNobody = 65534;
const std::string kFovead = FOVEA_BIN_DIR "/fovead";

Finished fovead(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), kFovead);
    return run_program(arguments);
}

std::string read_file(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

TEST(Fovead, PrintsTheConfigThatShipsWithIt) {
    const Finished f = fovead({"--print-config"});
    EXPECT_EQ(f.code, 0);
    EXPECT_EQ(f.out, read_file(FOVEA_SOURCE_DIR "/configs/fovead.toml"))
        << "after a change of keys: fovead --print-config > configs/fovead.toml";
}

TEST(Fovead, HelpNamesEveryExitCode) {
    const Finished f = fovead({"--help"});
    EXPECT_EQ(f.code, 0);
    EXPECT_THAT(f.out, HasSubstr("Exit codes: 0 ended as asked, 1 failed while starting or running, 2 wrong options or config"));
    EXPECT_EQ(fovead({"--no-such-option"}).code, 2);
}

TEST(Fovead, ExplainsAWrongConfigWithLineAndWayOut) {
    const TemporaryFolder folder;
    std::ofstream(folder / "c.toml") << "[loss]\nhold_mss = 3\n";
    const Finished f = fovead({"--config", folder / "c.toml", "--run-dir", folder / "run"});
    EXPECT_EQ(f.code, 2);
    EXPECT_EQ(f.error.substr(0, f.error.find("legal keys")),
              "fovead: " + (folder / "c.toml") + ":2:1: unknown key 'hold_mss' in [loss] (did you mean 'hold_ms'? ");
    EXPECT_THAT(folder.names(), ElementsAre("c.toml")) << "nothing may be made before the config is right";
    EXPECT_EQ(fovead({"--config", folder / "none.toml"}).code, 2);
    const Finished unset = fovead({"--run-dir", folder / "run"});
    EXPECT_EQ(unset.code, 2);
    EXPECT_THAT(unset.error, HasSubstr("needs a path"));
}

TEST(Fovead, ExplainsARecordingThatCannotBePlayed) {
    const TemporaryFolder folder;
    std::ofstream(folder / "foreign.csv") << "name,colour\nfrog,green\n";
    const std::string good = read_file(shipped_recording());
    std::ofstream(folder / "torn.csv") << good.substr(0, good.find('\n', good.size() / 2) - 5);
    std::ofstream(folder / "empty.csv") << "";
    for (const char* name : {"foreign.csv", "torn.csv", "empty.csv", "missing.csv"}) {
        const Finished f = fovead({"--set", "source.path=" + (folder / name), "--run-dir", folder / "run", "--record", folder / "s.fovea"});
        EXPECT_EQ(f.code, 3) << name << ": " << f.error;
        EXPECT_THAT(f.error, HasSubstr(folder / name)) << name;
        EXPECT_THAT(folder.names(), testing::Not(Contains("s.fovea"))) << name << " left an empty session";
        EXPECT_THAT(std::filesystem::is_empty(folder / "run"), true) << name << " left sockets";
    }
}

TEST(Fovead, RefusesToBeTheSecondOnItsSockets) {
    const TemporaryFolder folder;
    DaemonProcess first(folder);
    ASSERT_TRUE(first.ready()) << first.log();
    const Finished second = fovead({"--set", "source.path=" + shipped_recording(), "--run-dir", folder.path().string()});
    EXPECT_EQ(second.code, 4);
    EXPECT_THAT(second.error, HasSubstr("another fovead already serves this socket"));
    EXPECT_THAT(second.error, HasSubstr("--run-dir"));
    EXPECT_GE(first.number("published"), 0) << "the first one must go on";
    EXPECT_TRUE(connect_to_daemon(first.focus_socket(), {}, std::chrono::seconds(20)));
}

TEST(Fovead, ExplainsAFolderThatItMayNotWrite) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can become a user without rights";
    const TemporaryFolder folder;
    ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
    const std::string program = test::copy_for_others(kFovead, folder);
    const Finished sockets = run_program({program, "--set", "source.path=" + shipped_recording(), "--run-dir", folder / "run"}, kNobody);
    EXPECT_EQ(sockets.code, 1) << sockets.error;
    EXPECT_THAT(sockets.error, HasSubstr(folder / "run"));
    EXPECT_THAT(sockets.error, HasSubstr("Permission denied"));
    EXPECT_THAT(sockets.error, HasSubstr("--run-dir"));

    ASSERT_EQ(::mkdir((folder / "mine").c_str(), 0700), 0);
    ASSERT_EQ(::chown((folder / "mine").c_str(), kNobody, kNobody), 0);
    std::filesystem::copy_file(shipped_recording(), folder / "mine/r.csv");
    ASSERT_EQ(::chown((folder / "mine/r.csv").c_str(), kNobody, kNobody), 0);
    const Finished session = run_program({program, "--set", "source.path=" + (folder / "mine/r.csv"), "--run-dir", folder / "mine",
                                     "--record", folder / "s.fovea"}, kNobody);
    EXPECT_EQ(session.code, 1) << session.error;
    EXPECT_THAT(session.error, HasSubstr(folder / "s.fovea"));
    std::vector<std::string> left;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "mine")) left.push_back(entry.path().filename());
    EXPECT_THAT(left, ElementsAre("r.csv"));
}

TEST(Fovead, WorksWithoutRoot) {
    if (::geteuid() != 0) GTEST_SKIP() << "it does, by being run";
    const TemporaryFolder folder;
    std::filesystem::copy_file(shipped_recording(), folder / "r.csv");
    ASSERT_EQ(::chown(folder.path().c_str(), kNobody, kNobody), 0);
    ASSERT_EQ(::chmod((folder / "r.csv").c_str(), 0644), 0);
    DaemonProcess daemon(folder, {.recording = folder / "r.csv", .arguments = {"--record", folder / "s.fovea"}, .uid = kNobody});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    EXPECT_EQ(daemon.stop(SIGTERM), 0) << daemon.log();
}

TEST(Fovead, LeavesNothingBehindWhenItIsToldToEnd) {
    for (const int signal : {SIGTERM, SIGINT}) {
        const TemporaryFolder folder;
        DaemonProcess daemon(folder, {.arguments = {"--record", folder / "s.fovea"}});
        ASSERT_TRUE(daemon.ready()) << daemon.log();
        ASSERT_TRUE(eventually([&] { return daemon.number("published") > 10; }));
        EXPECT_EQ(daemon.stop(signal), 0) << daemon.log();
        EXPECT_THAT(folder.names(), ElementsAre("log", "s.fovea"));   // no sockets, locks, or SQLite side files
        const auto session = replay::SessionReader::open(folder / "s.fovea");
        ASSERT_TRUE(session) << session.error().message();
        EXPECT_TRUE(session->finished());
    }
}

TEST(Fovead, EndsWithItsRecordingWhenAsked) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--exit-at-end", "--set", "source.duration_s=0.2", "--record", folder / "s.fovea"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    EXPECT_EQ(daemon.wait(), 0) << daemon.log();
    std::size_t samples = 0;
    const auto session = replay::SessionReader::open(folder / "s.fovea");
    ASSERT_TRUE(session);
    ASSERT_TRUE(session->samples([&](const replay::RecordedSample&) { return ++samples, true; }));
    EXPECT_EQ(samples, 200u);
}

TEST(Fovead, RunsOnASyntheticEye) {
    const TemporaryFolder folder;
    std::ofstream(folder / "eye.toml") << "name = \"e\"\nduration_s = 2\nrate_hz = 250\n[fixations]\n[saccades]\n[noise]\n";
    const Finished f = fovead({"--set", "source.driver=synthetic", "--set", "source.path=" + (folder / "eye.toml"), "--set", "source.endless=false",
                               "--set", "source.speed=max", "--exit-at-end", "--linger", "0", "--run-dir", folder / "run", "--record", folder / "s.fovea"});
    ASSERT_EQ(f.code, 0) << f.error;
    std::size_t models = 0, saccades = 0;
    const auto session = replay::SessionReader::open(folder / "s.fovea");
    ASSERT_TRUE(session);
    EXPECT_EQ(session->info().device, "synthetic eye: e");
    ASSERT_TRUE(session->models([&](const MotionModel& m) { return ++models, saccades += m.eyes[0].event == GazeEvent::saccade, true; }));
    EXPECT_EQ(models, 500u);
    EXPECT_GT(saccades, 10u);
    std::ofstream(folder / "bad.toml") << "[noise]\nstd_deg = -1\n";
    const Finished bad = fovead({"--set", "source.driver=synthetic", "--set", "source.path=" + (folder / "bad.toml"), "--run-dir", folder / "run"});
    EXPECT_EQ(bad.code, 2);
    EXPECT_THAT(bad.error, HasSubstr("bad.toml:2:11"));
}

TEST(Fovead, AppliesAPersonsCalibration) {
    const TemporaryFolder folder;
    // A tracker that shows 4 degrees too far right; the calibration takes 4 degrees (in tangents) off again.
    std::ofstream(folder / "eye.toml") << "duration_s = 1\nrate_hz = 250\n[miscalibration]\noffset_x_deg = 4\noffset_y_deg = 0\ngain_x = 1\ngain_y = 1\nshear = 0\n[noise]\nstd_deg = 0.01\n";
    std::ofstream(folder / "me.toml") << "[calibration.combined]\nmodel = \"affine\"\ncoefficients = [-0.069926812, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]\n";
    const auto shown_deg = [&](const std::vector<std::string>& more, const char* session) {
        std::vector<std::string> arguments = {"--set", "source.driver=synthetic", "--set", "source.path=" + (folder / "eye.toml"), "--set", "source.endless=false", "--set", "source.speed=max",
                                              "--exit-at-end", "--linger", "0", "--run-dir", folder / "run", "--record", folder / session};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Finished f = fovead(arguments);
        EXPECT_EQ(f.code, 0) << f.error;
        double last = 1e9;
        const auto read = replay::SessionReader::open(folder / session);
        EXPECT_TRUE(read && read->models([&](const MotionModel& m) { return last = to_azimuth_elevation(m.eyes[0].gaze_dir_head).azimuth_rad * 180 / M_PI, true; }));
        return last;
    };
    EXPECT_NEAR(shown_deg({}, "a.fovea"), 4, 0.1);
    EXPECT_NEAR(shown_deg({"--set", "pipeline.calibration=" + (folder / "me.toml")}, "b.fovea"), 0, 0.1);

    std::ofstream(folder / "bad.toml") << "[calibration.combined]\nmodel = \"affine\"\n";
    const Finished bad = fovead({"--set", "source.path=" + shipped_recording(), "--set", "pipeline.calibration=" + (folder / "bad.toml"), "--run-dir", folder / "run"});
    EXPECT_EQ(bad.code, 2);
    EXPECT_THAT(bad.error, HasSubstr("bad.toml: there is no complete [calibration.combined]"));
}

TEST(Fovead, WaitsForItsFirstClientWhenAsked) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--exit-at-end", "--set", "source.duration_s=0.1", "--set", "source.wait_for_client=true"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    EXPECT_THAT(daemon.ask("status"), HasSubstr("\"state\":\"waiting\""));
    auto client = connect_to_daemon(daemon.focus_socket(), {}, std::chrono::seconds(20));
    ASSERT_TRUE(client);
    ASSERT_TRUE(eventually([&] { return daemon.log().find("source ended: 100 models") != std::string::npos; })) << daemon.log();
    client->socket.reset();   // the last one leaves: that is the end
    EXPECT_EQ(daemon.wait(), 0);
}

TEST(Fovead, TakesNewSettingsWhileItRuns) {
    const TemporaryFolder folder;
    const std::string config = "[source]\nloop = true\n[filter]\nname = \"one_euro\"\n";
    DaemonProcess daemon(folder, {.config = config});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    std::ofstream(folder / "fovead.toml") << "[source]\nloop = true\n[filter]\nname = \"none\"\n[record]\npath = \"x\"\n";
    EXPECT_EQ(daemon.ask("reload"), R"({"applied":["filter.name"],"needs_restart":["record.path"],"ok":true})");
    EXPECT_EQ(daemon.ask("reload"), R"({"applied":[],"needs_restart":["record.path"],"ok":true})") << "it still does";
    std::ofstream(folder / "fovead.toml") << "[filter]\nname = 3\n";
    EXPECT_THAT(daemon.ask("reload"), HasSubstr("'filter.name' must be"));
    // By signal, as init systems do it.
    std::ofstream(folder / "fovead.toml") << config;
    daemon.send(SIGHUP);
    EXPECT_TRUE(eventually([&] { return daemon.log().find("1 keys changed, 0 need") != std::string::npos; }))
        << daemon.log();
    EXPECT_EQ(daemon.stop(SIGTERM), 0);
}

TEST(Fovead, OpensItsSocketToWhomAReloadAdmits) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.config = "[source]\nloop = true\n"});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const auto mode = [&] {
        struct stat s {};
        return ::stat(daemon.focus_socket().c_str(), &s) == 0 ? s.st_mode & 0777 : 0;
    };
    EXPECT_EQ(mode(), 0600u);
    std::ofstream(folder / "fovead.toml") << "[source]\nloop = true\n[server]\nuids = [65534]\n";
    EXPECT_THAT(daemon.ask("reload"), HasSubstr(R"("applied":["server.uids"])"));
    EXPECT_EQ(mode(), 0666u);
    std::ofstream(folder / "fovead.toml") << "[source]\nloop = true\n";
    EXPECT_THAT(daemon.ask("reload"), HasSubstr(R"("applied":["server.uids"])"));
    EXPECT_EQ(mode(), 0600u);
}

TEST(Fovead, RecordsIntoNoFolderAndIntoNoDevice) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "sessions");
    for (const std::string& path : {folder / "sessions", folder / "sessions/", std::string("/dev/null")}) {
        const Finished f = fovead({"--set", "source.path=" + shipped_recording(), "--set", "source.duration_s=0.01", "--exit-at-end",
                                   "--run-dir", folder / "run", "--record", path});
        EXPECT_EQ(f.code, 1) << path;
        EXPECT_THAT(f.error, HasSubstr("no session file"));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "sessions-2"));
}

TEST(Fovead, SaysAtOnceThatARecordingCanNoLongerBeWritten) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--set", "source.loop=true", "--record", folder / "s.fovea"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const auto samples = [&] {
        std::size_t n = 0;
        if (const auto session = replay::SessionReader::open(folder / "s.fovea"))
            static_cast<void>(session->samples([&](const auto&) { return ++n, true; }));
        return n;
    };
    ASSERT_TRUE(eventually([&] { return samples() > 0; })) << daemon.log();
    rlimit limit{};
    ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_FSIZE, nullptr, &limit), 0);
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 512u << 10);   // no file grows any further: as good as a full disk
    ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
    EXPECT_TRUE(eventually([&] { return daemon.log().find("error: recording: ") != std::string::npos; })) << daemon.log();
    EXPECT_THAT(daemon.ask("status"), HasSubstr("\"state\":\"running\"")) << "gaze goes on";
    EXPECT_TRUE(eventually([&] { return daemon.number("dropped_rows") > 0; })) << daemon.ask("status");
    EXPECT_EQ(daemon.number("lost_samples"), 0) << "the recorder kept up; it was the disk";
    if (std::filesystem::exists(FOVEA_BIN_DIR "/fovea")) {   // the thread sanitizer's build has no command line
        const auto status = test::run_program({FOVEA_BIN_DIR "/fovea", "status", "--run-dir", folder.path().string()});
        EXPECT_THAT(status.out, ::testing::ContainsRegex("not written [0-9]+ rows"));
    }
    EXPECT_EQ(daemon.stop(SIGTERM), 1);
    EXPECT_GT(samples(), 0u) << "what was written before is kept";
}

TEST(Fovead, RecordsTheConfigOfItsBeginningAndEachLaterOne) {
    const TemporaryFolder folder;
    const auto config = [](const char* filter) { return std::string("[source]\nloop = true\n[filter]\nname = \"") + filter + "\"\n"; };
    const std::string file = folder / "session.fovea";
    DaemonProcess daemon(folder, {.arguments = {"--record", file}, .config = config("one_euro")});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    for (const char* filter : {"kalman", "none"}) {
        std::ofstream(folder / "fovead.toml") << config(filter);
        EXPECT_THAT(daemon.ask("reload"), HasSubstr("filter.name"));
    }
    EXPECT_EQ(daemon.stop(SIGTERM), 0);
    auto session = replay::SessionReader::open(file);
    ASSERT_TRUE(session) << session.error().message();
    EXPECT_THAT(session->meta().at("config"), HasSubstr("\"one_euro\""));
    std::vector<std::string> later;
    const auto events = session->events().value();
    for (const auto& e : events)
        if (e.kind == "config") later.push_back(e.text);
    ASSERT_EQ(later.size(), 2u);
    EXPECT_THAT(later[0], HasSubstr("\"kalman\""));
    EXPECT_THAT(later[1], HasSubstr("name = \"none\""));
}

TEST(Fovead, ChangesItsSourceOnReloadAndGoesOnCounting) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.config = "[source]\nstart_s = 0.0\nduration_s = 0.1\n"});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    ASSERT_TRUE(eventually([&] { return daemon.ask("status").find("\"state\":\"ended\"") != std::string::npos; }));
    EXPECT_EQ(daemon.number("published"), 100);
    std::ofstream(folder / "fovead.toml") << "[source]\nstart_s = 5.0\nduration_s = 0.1\n";
    EXPECT_THAT(daemon.ask("reload"), HasSubstr("\"applied\":[\"source\"]"));
    EXPECT_TRUE(eventually([&] { return daemon.number("published") == 200; })) << daemon.ask("status");
    EXPECT_EQ(daemon.number("sample_id"), 200);
}

TEST(Fovead, AnswersAdministratorsInJsonLines) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const auto say = [&](const std::string& line) {
        const auto answer = service::ask_daemon(daemon.admin_socket(), line, std::chrono::seconds(20));
        return answer ? *answer : answer.error().message();
    };
    EXPECT_THAT(say("nonsense"), HasSubstr("no JSON object"));
    EXPECT_THAT(say("{}"), HasSubstr("no text \\\"command\\\""));
    EXPECT_THAT(say(R"({"command":"dance"})"), HasSubstr("unknown command 'dance'"));
    EXPECT_THAT(say(R"({"command":"\u0000\ud800"})"), HasSubstr("\"ok\":false"));
    EXPECT_THAT(say(std::string(100'000, 'x')), HasSubstr("closed the connection"));   // a line without end
    EXPECT_THAT(daemon.ask("stop"), HasSubstr("\"ok\":true"));
    EXPECT_EQ(daemon.wait(), 0);
}

std::uint64_t bits(double v) { return std::bit_cast<std::uint64_t>(v); }

// Every field that does not depend on when the daemon ran; times relative to `origin`.
std::vector<std::uint64_t> words(const MotionModel& m, Instant origin) {
    std::vector<std::uint64_t> w;
    const auto time = [&](Instant t) { w.push_back(static_cast<std::uint64_t>((t - origin).count())); };
    const auto direction = [&](const Direction<HeadFrame>& d) { w.insert(w.end(), {bits(d.x), bits(d.y), bits(d.z)}); };
    w.insert(w.end(), {m.sequence, m.sample_id, m.exposed_estimated, m.eyes_present});
    time(m.exposed);
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        if (((m.eyes_present >> e) & 1) == 0) continue;
        const EyeMotion& eye = m.eyes[e];
        w.insert(w.end(), {eye.ever_valid, eye.lost_before, static_cast<std::uint64_t>(eye.event)});
        if (!eye.ever_valid) continue;
        time(eye.reference);
        time(eye.valid_since);
        direction(eye.gaze_dir_head);
        w.insert(w.end(), {bits(eye.velocity_rad_s.u), bits(eye.velocity_rad_s.v)});
        if (eye.lost_before) {
            time(eye.lost_since);
            direction(eye.held_dir_head);
        }
        if (eye.event == GazeEvent::saccade) {
            time(eye.saccade.onset);
            w.push_back(static_cast<std::uint64_t>(eye.saccade.duration.count()));
            direction(eye.saccade.start_dir_head);
            direction(eye.saccade.landing_dir_head);
        }
        for (const HorizonPoint& h : eye.horizons)
            w.insert(w.end(), {bits(h.du_rad), bits(h.dv_rad), bits(h.radius68_rad), bits(h.radius95_rad)});
    }
    return w;
}

// The design's claim of exactness: what the daemon publishes in real time is, bit for bit, what the pipeline alone makes
// of the recording, once the one constant offset between the recording's clock and ours is taken off.
TEST(Fovead, PublishesTheMotionModelsThatThePipelineAloneMakes) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--exit-at-end", "--set", "source.duration_s=4", "--record", folder / "s.fovea"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    EXPECT_EQ(daemon.wait(), 0) << daemon.log();

    std::vector<MotionModel> published;
    const auto session = replay::SessionReader::open(folder / "s.fovea");
    ASSERT_TRUE(session) << session.error().message();
    ASSERT_TRUE(session->models([&](const MotionModel& m) { return published.push_back(m), true; }));
    const Result<replay::Recording> recording = replay::load_recording(shipped_recording());
    ASSERT_TRUE(recording);
    ASSERT_EQ(published.size(), 4000u);

    Result<pipeline::Pipeline> pipe = pipeline::Pipeline::create({});
    ASSERT_TRUE(pipe);
    const Instant daemon_origin = published.front().exposed, file_origin = recording->samples.front().sample.exposed;
    std::size_t saccades = 0, blinks = 0;
    for (std::size_t i = 0; i < published.size(); ++i) {
        MotionModel alone = pipe->update(recording->samples[i].sample);
        alone.sequence = i + 1;
        ASSERT_EQ(words(published[i], daemon_origin), words(alone, file_origin)) << "sample " << i + 1;
        saccades += alone.eyes[0].event == GazeEvent::saccade;
        blinks += alone.eyes[0].event == GazeEvent::blink;
    }
    EXPECT_GT(saccades, 0u);   // otherwise this would prove little
    EXPECT_GT(blinks, 0u);
}

}  // namespace
}  // namespace fovea
