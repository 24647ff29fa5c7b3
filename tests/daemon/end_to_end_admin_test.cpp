// What administrators ask of a real fovead with `fovea admin` and `fovea status`.
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "daemon/service/admin_client.hpp"
#include "daemon/service/admin_request.hpp"
#include "protocol/handshake.hpp"
#include "replay/session_file.hpp"
#include "tests/daemon/daemon_process.hpp"

namespace fovea {
namespace {

using service::AdminCommand;
using service::AdminRequest;
using test::DaemonProcess;
using test::eventually;
using test::Finished;
using test::TemporaryFolder;
using testing::HasSubstr;

std::string say(const DaemonProcess& daemon, const AdminRequest& request) {
    const auto answer = service::ask_daemon(daemon.admin_socket(), service::to_line(request), std::chrono::seconds(20));
    return answer ? *answer : answer.error().message();
}

Finished admin(const TemporaryFolder& folder, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {FOVEA_BIN_DIR "/fovea", "admin", "--run-dir", folder.path().string()});
    return test::run_program(arguments);
}

TEST(AdminRequest, ComesBackFromItsLine) {
    for (const AdminCommand command : {AdminCommand::status, AdminCommand::reload, AdminCommand::end_recording, AdminCommand::stop}) {
        const auto back = service::parse_admin_request(service::to_line({.command = command}));
        ASSERT_TRUE(back);
        EXPECT_EQ(back->command, command);
    }
    const auto record = service::parse_admin_request(service::to_line({.command = AdminCommand::record, .path = "/a \"b\"/c.fovea"}));
    ASSERT_TRUE(record);
    EXPECT_EQ(record->path, "/a \"b\"/c.fovea");
    const auto change = service::parse_admin_request(service::to_line({.command = AdminCommand::switch_source, .set = {"source.driver=hid", "source.x=1"}}));
    ASSERT_TRUE(change);
    EXPECT_EQ(change->set.size(), 2u);
}

TEST(AdminRequest, RefusesWhatItCannotDo) {
    const auto error = [](const char* line) {
        const auto r = service::parse_admin_request(line);
        return r ? std::string("accepted") : r.error().message();
    };
    EXPECT_THAT(error(R"({"command":"record"})"), HasSubstr("needs a text \"path\""));
    EXPECT_THAT(error(R"({"command":"record","path":7})"), HasSubstr("needs a text \"path\""));
    EXPECT_THAT(error(R"({"command":"record","path":"here.fovea"})"), HasSubstr("absolute"));
    EXPECT_THAT(error(R"({"command":"record","path":"/a\u0000b"})"), HasSubstr("absolute"));
    EXPECT_THAT(error(R"({"command":"switch"})"), HasSubstr("needs a list"));
    EXPECT_THAT(error(R"({"command":"switch","set":[]})"), HasSubstr("needs a list"));
    EXPECT_THAT(error(R"({"command":"switch","set":[1]})"), HasSubstr("list of texts"));
    EXPECT_THAT(error(R"({"command":"switch","set":["server.uids=[0]"]})"), HasSubstr("keys of [source] only"));
    EXPECT_THAT(error(R"({"command":"dance"})"), HasSubstr("status, reload, record, end_recording, switch, stop"));
}

TEST(FoveadAdmin, RecordsBetweenTwoCommands) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--set", "source.loop=true"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    EXPECT_EQ(admin(folder, {"end-recording"}).code, 1) << "nothing is being recorded yet";
    const Finished begun = admin(folder, {"record", folder / "s.fovea"});
    ASSERT_EQ(begun.code, 0) << begun.error;
    EXPECT_THAT(begun.out, HasSubstr("recording to " + (folder / "s.fovea")));
    EXPECT_THAT(say(daemon, {.command = AdminCommand::record, .path = folder / "t.fovea"}), HasSubstr("a recording is under way"));
    ASSERT_TRUE(eventually([&] {
        const std::string status = daemon.ask("status");
        const std::size_t recorder = status.find("\"recorder\":"), samples = status.find("\"samples\":", recorder);
        return samples != std::string::npos && std::atoi(status.c_str() + samples + 10) > 10;
    })) << daemon.ask("status");
    const Finished ended = admin(folder, {"end-recording"});
    ASSERT_EQ(ended.code, 0) << ended.error;

    std::uint64_t samples = 0, first = 0;
    const auto session = replay::SessionReader::open(folder / "s.fovea");
    ASSERT_TRUE(session) << session.error().message();
    EXPECT_TRUE(session->finished());
    ASSERT_TRUE(session->models([&](const MotionModel& m) {
        if (samples++ == 0) first = m.sample_id;
        return true;
    }));
    EXPECT_GT(samples, 0u);
    EXPECT_GT(first, 1u) << "what was before the command does not belong to the recording";

    // A second one with the same name overwrites nothing, and is finished with the daemon.
    EXPECT_THAT(say(daemon, {.command = AdminCommand::record, .path = folder / "s.fovea"}), HasSubstr("s-2.fovea"));
    EXPECT_EQ(daemon.stop(SIGTERM), 0) << daemon.log();
    const auto second = replay::SessionReader::open(folder / "s-2.fovea");
    ASSERT_TRUE(second) << second.error().message();
    EXPECT_TRUE(second->finished());
}

TEST(FoveadAdmin, GoesOnWhenAFileCannotBeWritten) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--set", "source.loop=true"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const Finished refused = admin(folder, {"record", folder / "missing/s.fovea"});
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.error, HasSubstr("missing/s.fovea"));
    EXPECT_THAT(daemon.ask("status"), HasSubstr("\"recorder\":null"));
    EXPECT_THAT(daemon.ask("status"), HasSubstr("\"state\":\"running\""));
}

TEST(FoveadAdmin, SwitchesItsSourceAndGoesBackOnReload) {
    const TemporaryFolder folder;
    const std::string begin = test::shipped_recording();
    std::ofstream(folder / "short.csv") << [&] {
        std::ifstream in(begin);
        std::string text, line;
        for (int n = 0; n < 60 && std::getline(in, line); ++n)
            if (!line.starts_with("# samples:")) text += line + "\n";
        return text;
    }();
    DaemonProcess daemon(folder, {.config = "[source]\nduration_s = 0.1\n"});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const auto ended = [&] { return daemon.ask("status").find("\"state\":\"ended\"") != std::string::npos; };
    ASSERT_TRUE(eventually(ended));
    const Finished changed = admin(folder, {"switch", "source.path=" + (folder / "short.csv")});
    ASSERT_EQ(changed.code, 0) << changed.error;
    EXPECT_THAT(changed.out, HasSubstr("changed: source"));
    EXPECT_TRUE(eventually([&] { return ended() && daemon.ask("status").find("short.csv") != std::string::npos; })) << daemon.ask("status");

    const Finished wrong = admin(folder, {"switch", "source.driver=abacus"});
    EXPECT_EQ(wrong.code, 1);
    EXPECT_THAT(wrong.error, HasSubstr("abacus"));
    EXPECT_THAT(daemon.ask("status"), HasSubstr("short.csv")) << "a setting with an error changes nothing";

    // A recording that turns out to be torn: the daemon stays, says why, and takes the next one.
    std::ofstream(folder / "torn.csv") << "nothing of use\n";
    EXPECT_EQ(admin(folder, {"switch", "source.path=" + (folder / "torn.csv")}).code, 0);
    EXPECT_TRUE(eventually([&] { return daemon.ask("status").find("\"state\":\"failed\"") != std::string::npos; })) << daemon.ask("status");
    EXPECT_THAT(daemon.ask("status"), HasSubstr("torn.csv"));

    EXPECT_EQ(admin(folder, {"reload"}).code, 0);
    EXPECT_TRUE(eventually([&] { return ended() && daemon.ask("status").find("short.csv") == std::string::npos; })) << daemon.ask("status");
    EXPECT_EQ(admin(folder, {"stop"}).code, 0);
    EXPECT_EQ(daemon.wait(), 0);
}

TEST(FoveaStatus, ShowsARunningDaemonAsTableAndAsJson) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder, {.arguments = {"--set", "source.loop=true", "--record", folder / "s.fovea"}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    ASSERT_TRUE(eventually([&] { return daemon.number("published") > 10; }));
    const auto client = connect_to_daemon(daemon.focus_socket(), {.abi = kAbiVersion, .grants = kGrantFocus, .pid = 1, .name = "my\x1b[31mapp"},
                                          std::chrono::seconds(20));
    ASSERT_TRUE(client);
    const Finished table = test::run_program({FOVEA_BIN_DIR "/fovea", "status", "--run-dir", folder.path().string()});
    EXPECT_EQ(table.code, 0) << table.error;
    for (const char* expected : {"fovead        0.1.0", "state       running", "clients       1 now", "my?[31mapp", "recorder      ", "models published"})
        EXPECT_THAT(table.out, HasSubstr(expected));
    const Finished json = test::run_program({FOVEA_BIN_DIR "/fovea", "status", "--json", "--run-dir", folder.path().string()});
    EXPECT_EQ(json.code, 0) << json.error;
    EXPECT_THAT(json.out, HasSubstr("\"state\": \"running\""));
}

TEST(FoveaStatus, SaysThatNoDaemonRunsWithCodeFour) {
    const TemporaryFolder folder;
    const Finished f = test::run_program({FOVEA_BIN_DIR "/fovea", "status", "--run-dir", folder.path().string()});
    EXPECT_EQ(f.code, 4);
    EXPECT_THAT(f.error, HasSubstr("no fovead is running here"));
    EXPECT_THAT(f.error, HasSubstr("--run-dir"));
}

TEST(FoveaStatus, IsRefusedToOtherUsers) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can be another user";
    const TemporaryFolder folder;
    DaemonProcess daemon(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
    const std::string fovea = test::copy_for_others(FOVEA_BIN_DIR "/fovea", folder);
    const Finished status = test::run_program({fovea, "status", "--socket", daemon.admin_socket()}, 65534);
    EXPECT_EQ(status.code, 1);
    EXPECT_THAT(status.error, HasSubstr("only root and the user who runs fovead may"));
}

}  // namespace
}  // namespace fovea
