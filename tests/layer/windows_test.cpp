// Windows under the layer, on servers of the tests' own: a program of ours, and programs from Debian that know nothing of it.
#include <gtest/gtest.h>

#include <filesystem>

#include <nlohmann/json.hpp>

#include "tests/layer/shell.hpp"
#include "tests/render/windows.hpp"

using namespace fovea::layer_test;

namespace {

const std::string kAuto = kLayer + "--auto --always --focus 0,0 --gain 6 ";
const std::string kWindow = kBin + "/layer_window_program ";

// The lines of the sizes, without the hash.
std::string sizes(const Ran& ran) { return ran.out.substr(0, ran.out.find("hash")); }

// Starts a program that ends by a signal only, until `enough` frames have gone through the layer; its counters.
nlohmann::json frames_of(const std::string& environment, const std::string& options, const std::string& program, int enough) {
    const std::string counters = temporary("window_stats"), command = "env " + environment + " FOVEA_LAYER_STATS=" + counters + " " + options + "-- " + program;
    std::remove(counters.c_str());
    fovea::tests::Child child(command + " >/dev/null 2>&1");
    nlohmann::json last;
    for (int i = 0; i < 6000 && child.running(); ++i) {  // written once a second, and at the end
        const auto now = nlohmann::json::parse(file_text(counters), nullptr, false);
        if (!now.is_discarded() && now.value("frames", 0) >= enough) {
            last = now;
            break;
        }
        usleep(10'000);
    }
    child.signal(SIGTERM);
    child.wait(30);
    std::remove(counters.c_str());
    return last;
}

class LayerWindows : public testing::Test {
protected:
    void SetUp() override {
        directory_ = temporary("windows");
        std::filesystem::create_directories(directory_);
    }
    void TearDown() override {
        x_.reset();
        weston_.reset();
        std::filesystem::remove_all(directory_);
    }
    void start_x() {
        if (!fovea::tests::installed("Xvfb")) GTEST_SKIP() << "Xvfb is not installed (apt-get install xvfb)";
        x_ = std::make_unique<fovea::tests::Xvfb>();
        ASSERT_FALSE(x_->display().empty()) << "Xvfb did not start";
        environment_ = "-u WAYLAND_DISPLAY DISPLAY=" + x_->display() + " ";
    }
    void start_wayland() {
        if (!fovea::tests::installed("weston")) GTEST_SKIP() << "weston is not installed (apt-get install weston)";
        weston_ = std::make_unique<fovea::tests::Weston>(directory_);
        ASSERT_FALSE(weston_->environment().empty()) << "weston did not start: " << file_text(directory_.string() + "/weston.log");
        environment_ = "-u DISPLAY " + weston_->environment() + " ";
    }
    Ran on_server(const std::string& command) { return shell("env " + environment_ + command); }
    // The window program prints the driver's own sizes and densities by itself, those of levels in auto mode, and is itself under the layer.
    void expect_foveated(const std::string& window_system, const char* full, const char* levels) {
        const std::string program = kWindow + window_system;
        const Ran plain = on_server(program);
        ASSERT_EQ(plain.exit_code, 0);
        EXPECT_EQ(sizes(plain), full);
        EXPECT_EQ(sizes(on_server(kAuto + "-- " + program)), levels);
        EXPECT_EQ(on_server(kLayer + "-- " + program).out, plain.out) << "an idle layer";
        EXPECT_EQ(on_server(kLayer + "--auto --always --gain 0 --focus 0,0 -- " + program).out, plain.out) << "recorded and replayed";
    }

    std::filesystem::path directory_;
    std::unique_ptr<fovea::tests::Xvfb> x_;
    std::unique_ptr<fovea::tests::Weston> weston_;
    std::string environment_;
};

constexpr const char* kFullX = "300x200: middle 1 corner 1, shown\n512x320: middle 1 corner 1, shown\n200x300: middle 1 corner 1, shown\n300x200: middle 1 corner 1, shown\n";
constexpr const char* kLevelsX = "300x200: middle 1 corner 4, shown\n512x320: middle 1 corner 4, shown\n200x300: middle 1 corner 4, shown\n300x200: middle 1 corner 4, shown\n";
constexpr const char* kFull = "300x200: middle 1 corner 1\n512x320: middle 1 corner 1\n200x300: middle 1 corner 1\n300x200: middle 1 corner 1\n";
constexpr const char* kLevels = "300x200: middle 1 corner 4\n512x320: middle 1 corner 4\n200x300: middle 1 corner 4\n300x200: middle 1 corner 4\n";

}  // namespace

#define START(server)                                       \
    start_##server();                                       \
    if (IsSkipped() || HasFatalFailure()) return

TEST_F(LayerWindows, AnX11WindowIsFoveatedAtEverySize) {
    START(x);
    expect_foveated("x11", kFullX, kLevelsX);
}

TEST_F(LayerWindows, AWaylandWindowIsFoveatedAtEverySize) {
    START(wayland);
    expect_foveated("wayland", kFull, kLevels);
}

TEST_F(LayerWindows, Es2gearsRunsFoveated) {
    if (!fovea::tests::installed("es2gears_x11")) GTEST_SKIP() << "es2gears_x11 is not installed (apt-get install mesa-utils)";
    START(x);
    const auto counters = frames_of(environment_, kAuto, "es2gears_x11", 20);
    ASSERT_TRUE(counters.is_object()) << "it drew too few frames, or ended";
    EXPECT_GT(counters["submissions_levels"], 10);
    EXPECT_LT(counters["pixels_planned"].get<double>(), 0.8 * counters["pixels_full"].get<double>());
}

TEST_F(LayerWindows, WestonSimpleEglRunsFoveated) {
    START(wayland);
    if (!fovea::tests::installed("weston-simple-egl")) GTEST_SKIP() << "weston-simple-egl is not installed (apt-get install weston)";
    const auto counters = frames_of(environment_, kAuto, "weston-simple-egl", 20);
    ASSERT_TRUE(counters.is_object()) << "it drew too few frames, or ended";
    EXPECT_GT(counters["frames"], 10);
    // It draws one triangle without depth of which the clear is the larger part: drawn in levels, or at full density for a reason.
    EXPECT_GT(counters["submissions_levels"].get<int>() + counters["submissions_native"].get<int>(), 10);
}

// glmark2's own validation reads pixels of its scenes back. `desktop` draws from arrays in its own memory, `build` too.
TEST_F(LayerWindows, GlmarkValidatesItsScenesAtGainZeroAsWithoutTheLayer) {
    if (!fovea::tests::installed("glmark2-es2")) GTEST_SKIP() << "glmark2-es2 is not installed (apt-get install glmark2-es2-x11)";
    START(x);
    const std::string scenes = "glmark2-es2 --size 256x256 --validate -b build:use-vbo=false -b desktop:effect=shadow:windows=4 -b bump:bump-render=normals | grep Validation";
    const Ran plain = on_server(scenes);
    ASSERT_NE(plain.out.find("desktop"), std::string::npos) << plain.out;
    EXPECT_EQ(plain.out.find("Failure"), std::string::npos) << plain.out;
    EXPECT_EQ(on_server(kLayer + "--auto --always --gain 0 --focus 0,0 -- " + scenes).out, plain.out);
}
