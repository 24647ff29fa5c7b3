// The viewer as a user meets it: the program, its messages, its exit codes and what it leaves behind; and its display.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <nlohmann/json.hpp>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "render/present/scanout.hpp"

using namespace fovea;
namespace fs = std::filesystem;

namespace {

// ---- the simulated display ----

constexpr Instant at(std::int64_t us) { return instant_from_ns(us * 1000); }

present::SimulatedScanout display(double hz, double scanout_ms) { return *present::SimulatedScanout::create({hz, scanout_ms}, at(0)); }

TEST(SimulatedScanout, ShowsAFrameInTheMiddleOfTheNextScanOut) {
    auto d = display(100, 8);
    const auto shown = d.predict(at(12'000));
    EXPECT_EQ(shown.start, at(20'000));
    EXPECT_EQ(shown.photon, at(24'000));
    EXPECT_EQ(d.predict(at(20'000)).start, at(30'000)) << "a frame done at the start has missed it";
    EXPECT_EQ(d.predict(at(-500)).start, at(0)) << "before the epoch";
}

TEST(SimulatedScanout, ShowsOneFramePerScanOut) {
    auto d = display(100, 8);
    EXPECT_EQ(d.present(at(1'000)).start, at(10'000));
    EXPECT_EQ(d.present(at(2'000)).start, at(20'000));
    EXPECT_EQ(d.present(at(2'500)).start, at(30'000));
    EXPECT_EQ(d.present(at(71'000)).start, at(80'000));
}

TEST(SimulatedScanout, PredictingChangesNothing) {
    auto d = display(90, 8);
    const auto first = d.predict(at(5'000));
    for (int i = 0; i < 5; ++i) EXPECT_EQ(d.predict(at(5'000)).start, first.start);
    EXPECT_EQ(d.present(at(5'000)).start, first.start);
}

TEST(SimulatedScanout, LetsAFastFrameBeginJustInTime) {
    auto d = display(100, 8);
    d.present(at(5'000));   // shown at 10 ms; the next free scan-out is at 20 ms
    EXPECT_EQ(d.begin_no_sooner(std::chrono::milliseconds(4)), at(15'000));   // with 1 ms to spare
    EXPECT_LT(d.begin_no_sooner(std::chrono::milliseconds(50)), at(0)) << "a slow frame begins at once";
}

TEST(SimulatedScanout, RejectsWhatNoDisplayDoes) {
    EXPECT_FALSE(present::SimulatedScanout::create({0, 8}, at(0)));
    EXPECT_FALSE(present::SimulatedScanout::create({90, 0}, at(0)));
    EXPECT_FALSE(present::SimulatedScanout::create({90, 12}, at(0))) << "longer than the refresh period";
    EXPECT_FALSE(present::SimulatedScanout::create({std::nan(""), 1}, at(0)));
    for (const double scanout_ms : {-1.0, std::nan(""), 1e300, static_cast<double>(INFINITY)}) EXPECT_FALSE(present::SimulatedScanout::create({90, scanout_ms}, at(0))) << scanout_ms;
}

TEST(RecentCost, IsNotMovedByOneSlowFrame) {
    present::RecentCost cost{std::chrono::milliseconds(40)};
    EXPECT_EQ(cost.median(), Duration{std::chrono::milliseconds(40)});
    for (int i = 0; i < 9; ++i) cost.add(std::chrono::milliseconds(10));
    cost.add(std::chrono::milliseconds(500));
    EXPECT_EQ(cost.median(), Duration{std::chrono::milliseconds(10)});
}

// ---- the program ----

struct Outcome {
    int exit_code = -1;
    std::string out, err;
};

std::string quoted(const fs::path& path) {
    std::string q = "'";
    return q.append(path.string()).append("'");
}

class Viewer : public ::testing::Test {
protected:
    void SetUp() override {
        dir_ = fs::path(testing::TempDir()) / (std::string("fovea_viewer_") + std::to_string(::getpid()));
        fs::create_directories(dir_);
    }
    void TearDown() override { fs::remove_all(dir_); }

    pid_t start(const std::string& arguments, const std::string& environment = "") {
        std::string command = environment;
        command.append(" exec env -u DISPLAY -u WAYLAND_DISPLAY '").append(FOVEA_BIN_DIR).append("/fovea-view' --socket ").append(quoted(dir_ / "none.sock"));
        command.append(" ").append(arguments).append(" >").append(quoted(dir_ / "out")).append(" 2>").append(quoted(dir_ / "err"));
        fs::remove(dir_ / "err");
        const pid_t pid = fork();
        if (pid == 0) {
            execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
            _exit(127);
        }
        return pid;
    }
    Outcome wait(pid_t pid) {
        int status = 0;
        waitpid(pid, &status, 0);
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text("out"), text("err")};
    }
    Outcome run(const std::string& arguments, const std::string& environment = "") { return wait(start(arguments, environment)); }
    [[nodiscard]] std::string text(const char* name) const {
        std::ifstream in(dir_ / name);
        std::stringstream s;
        s << in.rdbuf();
        return s.str();
    }
    fs::path dir_;
};

constexpr const char* kQuick = "--wait --frames 3 --size 64 ";

TEST_F(Viewer, HelpTellsANewcomerHowToStart) {
    const Outcome r = run("--help");
    EXPECT_EQ(r.exit_code, 0);
    for (const char* word : {"fovead", "--duration", "--method", "scaled_bins", "simulated", "Exit codes"}) EXPECT_NE(r.out.find(word), std::string::npos) << word;
}

TEST_F(Viewer, WithoutADaemonSaysSoAndExits4) {
    const Outcome r = run("--frames 1 --size 64");
    EXPECT_EQ(r.exit_code, 4);
    EXPECT_NE(r.err.find("none.sock"), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("--wait"), std::string::npos) << r.err;
}

TEST_F(Viewer, WithoutADriverSaysWhatToInstall) {
    const Outcome r = run(kQuick, "__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent");
    EXPECT_EQ(r.exit_code, 1);
    EXPECT_NE(r.err.find("libegl-mesa0"), std::string::npos) << r.err;
}

TEST_F(Viewer, WrongArgumentsExit2AndNameTheLegalOnes) {
    EXPECT_EQ(run("--size banana --wait").exit_code, 2);
    EXPECT_EQ(run("--nonsense").exit_code, 2);
    for (const char* option : {"--gain nan", "--speed nan", "--fovea-deg -nan", "--duration NaN", "--quality auto --budget-ms nan"}) EXPECT_EQ(run(kQuick + std::string(option)).exit_code, 2) << option;
    const Outcome r = run(std::string(kQuick) + "--method magic");
    EXPECT_EQ(r.exit_code, 2);
    EXPECT_NE(r.err.find("scaled_bins"), std::string::npos) << r.err;
    EXPECT_EQ(run(std::string(kQuick) + "--scanout-ms 50").exit_code, 2);
    // A wrong name needs no daemon to be told.
    for (const char* wrong : {"--method magic", "--scene nowhere"}) {
        const Outcome alone = run(wrong);
        EXPECT_EQ(alone.exit_code, 2) << wrong;
        EXPECT_NE(alone.err.find("known "), std::string::npos) << alone.err;
    }
    EXPECT_EQ(run("--quality " + (dir_ / "none.toml").string()).exit_code, 3);
    const Outcome display = run(std::string(kQuick) + "--present hologram");
    EXPECT_EQ(display.exit_code, 2);
    EXPECT_NE(display.err.find("surfaceless"), std::string::npos) << display.err;
}

TEST_F(Viewer, LeavesBothPicturesAndASummary) {
    const fs::path out = dir_ / "pictures";
    const Outcome r = run(std::string(kQuick) + "--json --out " + quoted(out));
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(fs::exists(out / "frame.png"));
    EXPECT_TRUE(fs::exists(out / "frame_levels.png"));
    EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 2) << "temporary files were left";
    EXPECT_NE(r.out.find("\"frames\": 3"), std::string::npos) << r.out;
    EXPECT_NE(r.out.find("\"simulated\": true"), std::string::npos);
    EXPECT_TRUE(r.err.empty()) << r.err;
}

TEST_F(Viewer, MeasuresTheLateLatchAndTheSecondBestInTheSameFrames) {
    for (const std::string used : {"late", "early"}) {
        const Outcome r = run(std::string(kQuick) + "--json --latch " + used);
        ASSERT_EQ(r.exit_code, 0) << r.err;
        const auto latch = nlohmann::json::parse(r.out)["latch"];
        EXPECT_EQ(latch["used"], used);
        // Before recording is earlier than after it: in every frame, so in the medians.
        for (const char* until : {"to_submit_ms", "to_gpu_done_ms", "to_photon_ms"}) EXPECT_GT(latch["early"][until], latch["late"][until]) << until;
        EXPECT_GT(latch["late"]["to_submit_ms"], 0);
        EXPECT_EQ(nlohmann::json::parse(r.out)["latch_to_gpu_done_ms"], latch[used]["to_gpu_done_ms"]);
    }
}

// The colours of Varjo's page, in the legend of the picture: blue 1x1, green 2x2, red 4x4; also of methods without bins.
TEST_F(Viewer, TheLevelsPictureHasTheColoursOfTheMethodsRates) {
    constexpr std::array<std::uint8_t, 3> kBlue{70, 120, 255}, kGreen{60, 210, 90}, kRed{235, 70, 60};
    struct Row {
        const char* method;
        bool blue, green, red;
    };
    for (const Row row : {Row{"full", true, false, false}, Row{"scaled_bins --fovea-deg 5 --fovea-max-deg 5 --gain 9", true, true, true}, Row{"shading_rate", true, true, true},
                          Row{"inset_outset", true, true, false}}) {
        const fs::path out = dir_ / "pictures";
        const Outcome r = run("--wait --frames 2 --size 256 --out " + quoted(out) + " --method " + row.method);
        ASSERT_EQ(r.exit_code, 0) << r.err;
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        ASSERT_NE(png_image_begin_read_from_file(&image, (out / "frame_levels.png").c_str()), 0);
        image.format = PNG_FORMAT_RGB;
        std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
        ASSERT_NE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr), 0);
        const auto has = [&](const std::array<std::uint8_t, 3>& colour) {
            for (std::size_t i = 256 * image.width * 3; i + 2 < pixels.size(); i += 3)   // the legend, below the pictures
                if (std::equal(colour.begin(), colour.end(), pixels.begin() + static_cast<std::ptrdiff_t>(i))) return true;
            return false;
        };
        EXPECT_EQ(has(kBlue), row.blue) << row.method;
        EXPECT_EQ(has(kGreen), row.green) << row.method;
        EXPECT_EQ(has(kRed), row.red) << row.method;
    }
}

TEST_F(Viewer, SaysWhenPicturesCannotBeWritten) {
    std::ofstream(dir_ / "file") << "in the way";
    const Outcome r = run(std::string(kQuick) + "--out " + quoted(dir_ / "file" / "out"));
    EXPECT_EQ(r.exit_code, 1);
    EXPECT_NE(r.err.find("--out"), std::string::npos) << r.err;
}

TEST_F(Viewer, AnInterruptEndsItCleanly) {
    for (const int signal : {SIGINT, SIGTERM}) {
        const fs::path out = dir_ / "pictures";
        const pid_t pid = start(std::string("--wait --duration 0 --size 64 --progress --out ") + quoted(out));
        while (text("err").find("frames") == std::string::npos) {   // it renders
            usleep(20'000);
            ASSERT_EQ(waitpid(pid, nullptr, WNOHANG), 0) << text("err");
        }
        kill(pid, signal);
        const Outcome r = wait(pid);
        EXPECT_EQ(r.exit_code, 0) << r.err;
        EXPECT_NE(r.out.find("interrupted"), std::string::npos) << r.out;
        EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 2);
        fs::remove_all(out);
    }
}

// A budget that nothing holds: down to the cheapest setting, with a line for each change, and a picture of what was drawn.
TEST_F(Viewer, QualityAutoHoldsABudgetAndLogsEveryChange) {
    const fs::path out = dir_ / "pictures";
    const Outcome r = run("--wait --frames 40 --size 64 --json --quality auto --budget-ms 0.1 --out " + quoted(out));
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_NE(r.err.find("quality: scaled_bins, gain 4 -> scaled_bins, gain 10: over the budget ("), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("gain 10 stays: over the budget at the cheapest setting"), std::string::npos) << r.err;
    EXPECT_NE(r.out.find("\"setting\": \"scaled_bins, gain 10\""), std::string::npos) << r.out;
    EXPECT_TRUE(fs::exists(out / "frame_levels.png"));
}

TEST_F(Viewer, QualityAutoClimbsWhereThereIsTime) {
    const Outcome r = run("--wait --frames 170 --refresh-hz 100 --size 16 --scene fragbox --json --quality auto --budget-ms 100000");
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_NE(r.err.find("gain 4 -> scaled_bins, gain 3: a better one fits"), std::string::npos) << r.err;
}

// What the scene calls for is drawn, whatever the ladder names.
TEST_F(Viewer, QualityDrawsWithTheEffectsThatTheSceneCallsFor) {
    std::ofstream(dir_ / "ladder.toml") << "[quality]\npick = \"arm\"\n[[quality.setting]]\nlabel = \"arm\"\nmethod = \"inset_outset\"\nratio = 0.4\ncost = 0.5\nerror = 3\n";
    std::array<std::string, 2> pictures;
    for (const bool contrast : {false, true}) {
        std::ofstream(dir_ / "room.toml") << "scene = \"text\"\n[effects]\nhidden_area = true\ncontrast = " << (contrast ? "true" : "false") << "\n[needs]\nlens_radius = 0.8\n";
        const fs::path out = dir_ / (contrast ? "with" : "without");
        const Outcome r = run("--wait --frames 1 --size 96 --speed 0 --json --scene " + quoted(dir_ / "room.toml") + " --quality " + quoted(dir_ / "ladder.toml") + " --out " + quoted(out));
        ASSERT_EQ(r.exit_code, 0) << r.err;
        const auto effects = nlohmann::json::parse(r.out)["effects"].get<std::vector<std::string>>();
        EXPECT_EQ(std::ranges::count(effects, "contrast"), contrast);
        EXPECT_EQ(std::ranges::count(effects, "hidden_area"), 1);
        std::ifstream in(out / "frame.png", std::ios::binary);
        pictures[contrast] = {std::istreambuf_iterator<char>(in), {}};
        ASSERT_FALSE(pictures[contrast].empty());
    }
    EXPECT_NE(pictures[0], pictures[1]) << "contrast reaches the pixels";
}

TEST_F(Viewer, SaysWhichExecutorDrewTheFramesAndWhy) {
    const Outcome r = run(std::string(kQuick) + "--json --method scaled_bins");
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto executors = nlohmann::json::parse(r.out)["executors"];
    ASSERT_EQ(executors.size(), 1u) << r.out;
    EXPECT_EQ(executors[0]["frames"], 3);
    EXPECT_EQ(executors[0]["name"], "level masks");
    EXPECT_EQ(executors[0]["why"], "the setting");
    const Outcome text = run(std::string(kQuick) + "--method auto --scene fragbox");
    EXPECT_NE(text.out.find("drawn by "), std::string::npos) << text.out;
}

TEST_F(Viewer, QualityReadsTheFileThatTheTradeoffWrites) {
    const std::string ladder = quoted(dir_ / "quality.toml");
    std::string command = std::string("'") + FOVEA_BIN_DIR;
    command.append("/fovea' tradeoff foveation --scenes fragbox --methods inset_outset --size 64 --frames 1 --budget-ms 100000 --toml ").append(ladder);
    command.append(" >").append(quoted(dir_ / "out")).append(" 2>").append(quoted(dir_ / "err"));
    ASSERT_EQ(std::system(command.c_str()), 0) << text("err");
    const Outcome fixed = run(kQuick + ("--json --quality " + ladder));
    EXPECT_EQ(fixed.exit_code, 0) << fixed.err;
    EXPECT_NE(fixed.out.find("\"setting\": \"full\""), std::string::npos) << fixed.out;
    EXPECT_TRUE(fixed.err.empty()) << fixed.err;
    std::ofstream(dir_ / "quality.toml", std::ios::app) << "[[quality.setting]]\nmethod = \"magic\"\n";
    const Outcome wrong = run(kQuick + ("--quality " + ladder));
    EXPECT_EQ(wrong.exit_code, 3);
    EXPECT_NE(wrong.err.find("unknown method 'magic'"), std::string::npos) << wrong.err;
    EXPECT_EQ(run(kQuick + std::string("--budget-ms 5")).exit_code, 2) << "a budget without --quality";
}

}  // namespace
