// What every command does with the files that it writes: whole or not there, and nothing replaced that is no file.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <thread>

#include "tests/tools/command_runner.hpp"

namespace fovea {
namespace {

using testing::HasSubstr;
using Output = test::CommandTest;
const std::string kVive = FOVEA_SOURCE_DIR "/tests/data/recordings/vive_pro_eye_360vr.csv";
const std::string kScenario = FOVEA_SOURCE_DIR "/configs/scenarios/still.toml";

bool is_fifo(const std::string& path) {
    struct stat s {};
    return ::lstat(path.c_str(), &s) == 0 && S_ISFIFO(s.st_mode);
}

TEST_F(Output, WritesIntoWhatIsNoFileInsteadOfReplacingIt) {
    ASSERT_EQ(::mkfifo(file("pipe").c_str(), 0600), 0);
    ASSERT_EQ(std::system(("timeout 30 cat " + file("pipe") + " >" + file("got") + " &").c_str()), 0);
    EXPECT_EQ(fovea("predict " + kVive + " --csv " + file("pipe")).exit_code, 0);
    EXPECT_TRUE(is_fifo(file("pipe")));
}

TEST_F(Output, RefusesToPutASessionWhereAPipeIs) {
    ASSERT_EQ(::mkfifo(file("pipe.fovea").c_str(), 0600), 0);
    for (const std::string& command : {"convert " + kVive, "synth --duration-s 1 " + kScenario}) {
        const auto r = fovea(command + " " + file("pipe.fovea") + " --force");
        EXPECT_EQ(r.exit_code, 1);
        EXPECT_THAT(r.err, HasSubstr("is not a regular file"));
        EXPECT_TRUE(is_fifo(file("pipe.fovea"))) << command;
    }
}

TEST_F(Output, FollowsASymbolicLink) {
    std::ofstream(file("real.csv")) << "old";
    std::filesystem::create_symlink("real.csv", file("link.csv"));
    ASSERT_EQ(fovea("predict " + kVive + " --csv " + file("link.csv")).exit_code, 0);
    EXPECT_TRUE(std::filesystem::is_symlink(file("link.csv")));
    EXPECT_THAT(bytes(file("real.csv")), HasSubstr("t_ns,valid"));
}

TEST_F(Output, AFullDiskUnderStandardOutputIsAFailure) {
    for (const char* command : {"convert --list", "predict --help"}) {
        const int status = std::system((std::string(FOVEA_BIN_DIR "/fovea ") + command + " >/dev/full 2>" + file("err")).c_str());
        EXPECT_EQ(WEXITSTATUS(status), 1) << command;
        EXPECT_THAT(bytes(file("err")), HasSubstr("No space left"));
    }
}

TEST_F(Output, WhatCannotBeWrittenIsSaidBeforeTheWork) {
    const auto r = fovea("tradeoff classify " + file("no-such-recording.csv") + " --html " + file("no/such/folder/r.html"));
    EXPECT_EQ(r.exit_code, 1) << "and not 3: nothing was read yet";
    EXPECT_THAT(r.err, HasSubstr("no/such/folder"));
    for (const std::string command : {"extrapolation --scene rotation --size 32 --repeat 1 --html ", "foveation --scene fragbox --method scaled_bins --size 64 --frames 1 --html ",
                                      "pupil --side 64 --count 1 --csv "}) {
        const auto early = fovea("tradeoff " + command + file("no/such/folder/r"));
        EXPECT_EQ(early.exit_code, 1) << command;
        EXPECT_THAT(early.err, HasSubstr("no/such/folder"));
        EXPECT_EQ(early.out, "") << "nothing was judged yet";
    }
    const std::string one = file("one.html");
    EXPECT_THAT(fovea("tradeoff extrapolation --scene rotation --size 32 --repeat 1 --html " + one + " --csv " + one).err, HasSubstr("two outputs would be one file"));
    const auto aimless = fovea("tradeoff predict " + kVive + " --toml " + file("picked.toml"));
    EXPECT_EQ(aimless.exit_code, 2);
    EXPECT_THAT(aimless.err, HasSubstr("--budget-us"));
}

TEST_F(Output, NoCommandWritesOverWhatItReads) {
    ASSERT_EQ(fovea("convert " + kVive + " " + file("r.fovea") + " --duration 1").exit_code, 0);
    std::filesystem::create_hard_link(file("r.fovea"), file("other_name.fovea"));
    std::filesystem::copy_file(kScenario, file("s.toml"));
    const std::string r = file("r.fovea"), before = bytes(r);
    for (const std::string& out : {r, file("other_name.fovea"), file(".") + "/r.fovea"})
        for (const std::string& command : {"replay " + r + " --csv ", "predict " + r + " --csv ", "latency " + r + " --html ", "latency " + r + " --csv ", "convert --force " + r + " ",
                                           "calibrate --from " + r + " --out ", "tradeoff filter " + r + " --csv ", "tradeoff fovea " + r + " --html "}) {
            const auto refused = fovea(command + out);
            EXPECT_EQ(refused.exit_code, 2) << command;
            EXPECT_THAT(refused.err, HasSubstr("input and output are the same file")) << command;
            ASSERT_EQ(bytes(r), before) << command;
        }
    EXPECT_EQ(fovea("synth --force --duration-s 1 " + file("s.toml") + " " + file("s.toml")).exit_code, 2);
    EXPECT_EQ(bytes(file("s.toml")), bytes(kScenario));
}

TEST_F(Output, AFileWithoutANameIsNoFile) {
    for (const std::string& command : {"replay " + kVive + " --csv ''", "predict " + kVive + " --csv ''", "tradeoff filter " + kVive + " --csv ''", std::string("latency x --html ''"),
                                       std::string("tradeoff pupil --count 1 --csv ''"), std::string("tradeoff extrapolation --html ''"), std::string("layer trace -o '' true"), std::string("record ''")}) {
        const auto refused = fovea(command);
        EXPECT_EQ(refused.exit_code, 2) << command;
        EXPECT_THAT(refused.err, HasSubstr("name is empty")) << command;
    }
}

TEST_F(Output, AFolderThatIsMissingIsToldOfTheFileThatWasAskedFor) {
    for (const std::string& command : {"convert " + kVive, "synth --duration-s 1 " + kScenario}) {
        const auto refused = fovea(command + " " + file("no/such.fovea"));
        EXPECT_EQ(refused.exit_code, 1);
        EXPECT_THAT(refused.err, HasSubstr("no/such.fovea: cannot create")) << "and not of the unfinished file beside it";
    }
}

TEST_F(Output, AWrongCommandLineIsToldOfItsCommand) {
    EXPECT_THAT(fovea("nosuch").err, HasSubstr("fovea: there is no command 'nosuch'; `fovea --help`"));
    EXPECT_THAT(fovea("tradeoff nosuch x").err, HasSubstr("fovea tradeoff: there is no command 'nosuch'"));
    EXPECT_THAT(fovea("layer run --library " + file("no-such-layer.so") + " -- true").err, HasSubstr("name it with --library"));
    EXPECT_THAT(fovea("tradeoff filter").err, HasSubstr("fovea tradeoff filter: recordings is required"));
    EXPECT_THAT(fovea("latency x --client 0").err, HasSubstr("not in range 1 to 4294967295"));
    EXPECT_THAT(fovea("devices nosuch").err, HasSubstr("no driver is called 'nosuch'"));
    EXPECT_THAT(fovea("devices --watch").err, HasSubstr("name it"));
    EXPECT_THAT(fovea("devices hid --count 3").err, HasSubstr("--watch"));
    for (const char* command : {"nosuch", "tradeoff nosuch x", "devices nosuch", "devices --watch", "devices hid --count 3"}) EXPECT_EQ(fovea(command).exit_code, 2) << command;
    EXPECT_THAT(fovea("--version").out, testing::StartsWith("fovea "));
}

TEST_F(Output, NotANumberIsInNoRange) {
    for (const std::string& command : {"predict " + kVive + " --csv - --horizon-ms nan", "convert " + kVive + " " + file("a.csv") + " --start nan",
                                       "synth " + kScenario + " " + file("s.fovea") + " --duration-s nan", std::string("record x --duration nan"),
                                       std::string("top --interval -nan"), std::string("tradeoff extrapolation --speed nan"), std::string("tradeoff foveation --budget-ms nan"),
                                       std::string("tradeoff pupil --budget-us nan"), std::string("scene explain circuit --budget-ms nan"),
                                       std::string("layer run --auto --fov nan -- true")})
        EXPECT_EQ(fovea(command).exit_code, 2) << command;
}

TEST_F(Output, ASignalLeavesNoHalfFileBehind) {
    const std::string out = file("models.csv");
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        // Slow enough not to end by itself before the signal.
        ::execl(FOVEA_BIN_DIR "/fovea", "fovea", "replay", kVive.c_str(), "--speed", "0.01", "--csv", out.c_str(), nullptr);
        ::_exit(127);
    }
    const auto there = [&] { return std::filesystem::exists(out + ".part") || std::filesystem::exists(out + ".partial"); };
    for (int i = 0; i < 3000 && !there(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(there());
    ::kill(child, SIGINT);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT);   // as a shell expects it of Ctrl-C
    EXPECT_FALSE(there() || std::filesystem::exists(out));
}

}  // namespace
}  // namespace fovea
