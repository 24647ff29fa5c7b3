// Windows: where pictures lie in them, when their light leaves, and fovea-view in one, on servers started for the test.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "render/present/presenter.hpp"
#include "render/present/vblank_clock.hpp"
#include "render/viewer/controls.hpp"
#include "render/viewer/layout.hpp"
#include "render/viewer/mouse.hpp"
#include "windows.hpp"

using namespace fovea;
namespace fs = std::filesystem;

namespace {

constexpr Instant at_us(std::int64_t us) { return instant_from_ns(us * 1000); }
constexpr Duration us(std::int64_t n) { return std::chrono::microseconds(n); }

// ---- when a frame will be seen ----

TEST(VblankClock, WithoutKnowledgeAFrameTakesOnePeriod) {
    present::VblankClock c{us(10'000)};
    EXPECT_EQ(c.predict(at_us(3'000)), at_us(13'000));
    EXPECT_LE(c.begin_no_sooner(us(1'000)), at_us(0)) << "nothing to wait for";
}

TEST(VblankClock, AFrameIsSeenAtTheFirstScanOutItsWindowSystemCanMake) {
    present::VblankClock c{us(10'000)};
    c.observe(at_us(4'000), at_us(10'000), true);    // 6 ms ahead
    c.observe(at_us(17'500), at_us(20'000), true);   // 2.5 ms ahead: so little is enough
    EXPECT_EQ(c.predict(at_us(27'000)), at_us(30'000));
    EXPECT_EQ(c.predict(at_us(29'000)), at_us(40'000)) << "1 ms ahead has never been enough";
    EXPECT_EQ(c.predict(at_us(127'400)), at_us(130'000)) << "on the grid, however far";
    EXPECT_EQ(c.begin_no_sooner(us(4'000)), at_us(30'000 - 2'500 - 4'000 - 1'000));
}

TEST(VblankClock, NeverPredictsThePast) {
    present::VblankClock c{us(10'000)};
    c.observe(at_us(20'000), at_us(12'000), true);   // clocks apart: shown before it was done
    for (std::int64_t t = 0; t < 50'000; t += 500) EXPECT_GE(c.predict(at_us(t)), at_us(t)) << t;
}

TEST(VblankClock, OffAGridItTakesTheMedianOfTheLastFrames) {
    present::VblankClock c{us(10'000)};
    for (const int ahead : {5'000, 7'000, 300'000}) c.observe(at_us(0), at_us(ahead), false);
    EXPECT_EQ(c.predict(at_us(1'000)), at_us(8'000));
}

TEST(VblankClock, KeepsItsPeriodWhenTheDisplayTellsNonsense) {
    present::VblankClock c{us(10'000)};
    for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{-5}, std::int64_t{2'000'000'000}}) c.set_period(Duration{ns});
    EXPECT_EQ(c.period(), us(10'000));
    c.set_period(us(8'000));
    EXPECT_EQ(c.period(), us(8'000));
}

// ---- where pictures lie ----

TEST(WindowLayout, BothEyesKeepTheirShapeAndLieInTheMiddle) {
    EXPECT_EQ(viewer::layout(1000, 500, 1)[0], (viewer::Place{0, 0, 500, 500}));
    EXPECT_EQ(viewer::layout(1000, 500, 1)[1], (viewer::Place{500, 0, 500, 500}));
    EXPECT_EQ(viewer::layout(1000, 900, 1)[0], (viewer::Place{0, 200, 500, 500}));
    EXPECT_EQ(viewer::layout(1000, 200, 1)[1], (viewer::Place{500, 0, 200, 200}));
    EXPECT_EQ(viewer::layout(1000, 900, 0.5)[0], (viewer::Place{50, 0, 450, 900}));
    EXPECT_GE(viewer::layout(1, 1, 1)[0].width_px, 16);
}

TEST(WindowLayout, APointBelongsToTheEyeItLiesIn) {
    const auto places = viewer::layout(1000, 500, 1);
    const auto left = viewer::pointed_at(places, 500, 250, 250), right = viewer::pointed_at(places, 500, 999, 1);
    EXPECT_EQ(left.eye, 0u);
    EXPECT_NEAR(left.x_ndc, 0, 1e-9);
    EXPECT_NEAR(left.y_ndc, 0, 1e-9);
    EXPECT_EQ(right.eye, 1u);
    EXPECT_NEAR(right.x_ndc, 1, 0.01);
    EXPECT_NEAR(right.y_ndc, 1, 0.01) << "the top of the window is up";
    EXPECT_EQ(viewer::pointed_at(places, 500, -40, 9000).x_ndc, -1) << "the nearest point";
}

TEST(MouseAsGaze, BothEyesLookInTheDirectionPointedAt) {
    const auto views = scene::stereo_views();
    for (const double x : {-0.9, 0.0, 0.4}) {
        const auto l = viewer::latch_pointer({10, 10, at_us(5), 7}, {0, x, -0.3}, views, at_us(90), at_us(100));
        EXPECT_TRUE(l.live());
        EXPECT_EQ(l.source, viewer::GazeSource::mouse);
        EXPECT_EQ(l.info.sample_id, 7u);
        EXPECT_EQ(l.info.latched_ns, 90'000);
        EXPECT_NEAR(l.focals[0].x_ndc, x, 1e-6);
        EXPECT_NEAR(l.focals[0].y_ndc, -0.3, 1e-6);
        for (int k = 0; k < 3; ++k) EXPECT_EQ(l.focals[0].gaze_dir_view[k], l.focals[1].gaze_dir_view[k]);
        // Where the other eye shows that direction.
        const auto& v = views[1].fov;
        const double tan = l.focals[1].gaze_dir_view[0] / -l.focals[1].gaze_dir_view[2];
        EXPECT_NEAR(l.focals[1].x_ndc, std::clamp((tan - v.tan_left) / (v.tan_right - v.tan_left) * 2 - 1, -1.0, 1.0), 1e-5);
    }
}

// ---- keys ----

TEST(Controls, KeysChooseTheMethodAndWhatIsShown) {
    const std::vector<std::string> methods{"a", "b", "c"};
    viewer::Controls c{.method = "a"};
    const auto press = [&](char32_t k) { c.handle({present::EventKind::key, k}, methods); };
    press(U'p');
    EXPECT_EQ(c.method, "c");
    press(U'n'), press(U'n');
    EXPECT_EQ(c.method, "b");
    press(U'3');
    EXPECT_EQ(c.method, "c");
    press(U'9');
    EXPECT_EQ(c.method, "c") << "there is no ninth";
    press(U'l'), press(U'h'), press(U' '), press(U'e'), press(U'g');
    EXPECT_TRUE(c.levels && c.help && c.paused && c.latch_early && !c.gaze && !c.quit);
    press(27);
    EXPECT_TRUE(c.quit);
    EXPECT_GT(viewer::text_lines(c, {}, methods).size(), 8u);
}

// ---- fovea-view in a window ----

class Window : public ::testing::Test {
protected:
    void SetUp() override {
        dir_ = fs::path(testing::TempDir()) / ("fovea_window_" + std::to_string(::getpid()));
        fs::create_directories(dir_);
    }
    void TearDown() override { fs::remove_all(dir_); }
    tests::Child view(const std::string& environment, const std::string& options) {
        return tests::Child("env -u DISPLAY -u WAYLAND_DISPLAY " + environment + " '" FOVEA_BIN_DIR "/fovea-view' --socket '" + (dir_ / "none.sock").string() + "' --size 128 " +
                            options + " >'" + (dir_ / "out").string() + "' 2>'" + (dir_ / "err").string() + "'");
    }
    [[nodiscard]] std::string text(const char* name) const {
        std::ifstream in(dir_ / name);
        std::stringstream s;
        s << in.rdbuf();
        return s.str();
    }
    [[nodiscard]] nlohmann::json summary() const { return nlohmann::json::parse(text("out"), nullptr, false); }
    static int shell(const std::string& command) { return std::system(command.c_str()); }
    // Until it holds, or the program has ended, or about 20 seconds are over.
    static bool eventually(tests::Child& program, const std::function<bool()>& holds) {
        for (int i = 0; i < 200 && program.running(); ++i) {
            if (holds()) return true;
            usleep(100'000);
        }
        return holds();
    }
    fs::path dir_;
};

class X11Window : public Window {
protected:
    void SetUp() override {
        Window::SetUp();
        if (!tests::installed("Xvfb") || !tests::installed("xdotool")) GTEST_SKIP() << "Xvfb or xdotool is not installed (apt-get install xvfb xdotool)";
        server_ = std::make_unique<tests::Xvfb>();
        ASSERT_FALSE(server_->display().empty()) << "Xvfb did not start";
        environment_ = "DISPLAY=" + server_->display();
    }
    void xdotool(const std::string& what) { ASSERT_EQ(shell(environment_ + " xdotool " + what + " >/dev/null"), 0) << what; }
    // The marker's dot, brighter and yellower than anything in the scene.
    bool dot_at(int x, int y) {
        const auto p = tests::screenshot(server_->display());
        if (p.rgb.empty()) return false;
        const unsigned char* c = p.at(x, y);
        return c[0] > 240 && c[1] > 200 && c[1] < 235 && c[2] < 60;
    }
    std::unique_ptr<tests::Xvfb> server_;
    std::string environment_;
};

TEST_F(X11Window, IsChosenWhereThereIsAServerAndEstimatesItsPhotons) {
    auto viewer = view(environment_, "--frames 6 --json");
    EXPECT_EQ(viewer.wait(60), 0) << text("err");
    EXPECT_NE(text("err").find("x11"), std::string::npos) << "it says where it shows: " << text("err");
    const auto s = summary();
    EXPECT_EQ(s["display"]["presenter"], "x11") << text("out");
    EXPECT_EQ(s["display"]["photons_measured"], 0);
    EXPECT_GE(s["display"]["photons_estimated"], 4);
    EXPECT_EQ(s["display"]["simulated"], false);
}

TEST_F(X11Window, TheMouseIsTheGazeAndKeysAreHeard) {
    auto viewer = view(environment_, "--duration 0 --json");
    ASSERT_TRUE(eventually(viewer, [&] { return shell(environment_ + " xdotool search --name fovea-view >/dev/null") == 0; })) << text("err");
    xdotool("mousemove 40 30");
    EXPECT_TRUE(eventually(viewer, [&] { return dot_at(40, 30); })) << "no marker at the pointer";
    xdotool("mousemove 200 90");
    EXPECT_TRUE(eventually(viewer, [&] { return dot_at(200, 90); })) << "the marker did not follow into the other eye";
    xdotool("key g");
    EXPECT_TRUE(eventually(viewer, [&] { return !dot_at(200, 90); })) << "g takes the marker away";
    xdotool("key e key 1 key q");
    EXPECT_EQ(viewer.wait(20), 0) << text("err");
    const auto s = summary();
    EXPECT_GT(s["mouse_frames"], 0);
    EXPECT_EQ(s["interrupted"], false);
}

TEST_F(X11Window, FollowsItsSizeAndEndsWhenItIsClosed) {
    auto viewer = view(environment_, "--duration 0 --json");
    ASSERT_TRUE(eventually(viewer, [&] { return shell(environment_ + " xdotool search --name fovea-view >/dev/null") == 0; })) << text("err");
    xdotool("search --name fovea-view windowsize 400 300");
    EXPECT_TRUE(eventually(viewer, [&] {
        const auto p = tests::screenshot(server_->display());
        return !p.rgb.empty() && p.at(395, 150)[0] + p.at(395, 150)[1] + p.at(395, 150)[2] > 60 && p.at(405, 150)[0] == 0;
    })) << "the picture did not grow";
    tests::close_window(server_->display(), "fovea-view");
    EXPECT_EQ(viewer.wait(20), 0) << text("err");
    EXPECT_EQ(summary()["width_px"], 200);
    EXPECT_EQ(summary()["height_px"], 200);
}

TEST_F(X11Window, AServerThatGoesAwayIsAnErrorThatSaysSo) {
    auto viewer = view(environment_, "--duration 0");
    ASSERT_TRUE(eventually(viewer, [&] { return shell(environment_ + " xdotool search --name fovea-view >/dev/null") == 0; })) << text("err");
    server_->stop();
    EXPECT_EQ(viewer.wait(20), 1);
    EXPECT_NE(text("err").find("gone away"), std::string::npos) << text("err");
}

TEST_F(X11Window, WantsNoFramesWhileItIsHidden) {
    ASSERT_EQ(setenv("DISPLAY", server_->display().c_str(), 1), 0);
    const SystemTime time;
    auto made = present::create_presenter("x11", {.scanout = {}, .width_px = 64, .height_px = 32}, time);
    ASSERT_TRUE(made) << made.error().message();
    auto& window = **made;
    const auto begins = [&] {
        const auto r = window.begin_frame({}, std::chrono::milliseconds(20));
        return r && *r;
    };
    bool began = false;
    for (int i = 0; i < 500 && !began; ++i) began = begins();
    EXPECT_TRUE(began);
    xdotool("search --name fovea-view windowunmap --sync");
    for (int i = 0; i < 3; ++i) EXPECT_FALSE(begins());
    xdotool("search --name fovea-view windowmap --sync");
    began = false;
    for (int i = 0; i < 500 && !began; ++i) began = begins();
    EXPECT_TRUE(began);
    unsetenv("DISPLAY");
}

class WaylandWindow : public Window {
protected:
    void SetUp() override {
        Window::SetUp();
        if (!tests::installed("weston")) GTEST_SKIP() << "weston is not installed (apt-get install weston)";
    }
    void start(const std::string& options = "") {
        server_ = std::make_unique<tests::Weston>(dir_, options);
        ASSERT_FALSE(server_->environment().empty()) << "weston did not start: " << text("weston.log");
    }
    std::unique_ptr<tests::Weston> server_;
};

TEST_F(WaylandWindow, IsChosenWhereThereIsACompositorAndItsFeedbackIsHeard) {
    ASSERT_NO_FATAL_FAILURE(start());
    auto viewer = view(server_->environment(), "--frames 8 --json");
    EXPECT_EQ(viewer.wait(60), 0) << text("err");
    EXPECT_NE(text("err").find("wayland"), std::string::npos) << text("err");
    const auto s = summary();
    EXPECT_EQ(s["display"]["presenter"], "wayland") << text("out");
    EXPECT_NE(s["display"]["description"].get<std::string>().find("presentation feedback"), std::string::npos);
    // This compositor has no display: a timer of its own tells the times, and they are not to pass for measured ones.
    EXPECT_EQ(s["display"]["photons_measured"], 0);
    EXPECT_GE(s["display"]["photons_estimated"].get<int>() + s["display"]["never_shown"].get<int>(), 6);
}

TEST_F(WaylandWindow, FillsThePixelsOfAHiDpiOutput) {
    ASSERT_NO_FATAL_FAILURE(start("--scale=2"));
    auto viewer = view(server_->environment(), "--frames 3 --json");
    EXPECT_EQ(viewer.wait(60), 0) << text("err");
    EXPECT_EQ(summary()["width_px"], 128) << "pixels, not units of the desktop: " << text("out");
    EXPECT_NE(text("err").find("256 x 128 pixels, scale 2"), std::string::npos) << text("err");
}

// The compositor's own window, filled by ours, on an X server that can be typed into.
TEST_F(X11Window, InACompositorKeysAndTheMouseAreHeardAsWell) {
    if (!tests::installed("weston")) GTEST_SKIP() << "weston is not installed (apt-get install weston)";
    // Smaller than the screen: it takes the pointer's place from the server only where the pointer enters, and adds steps to that.
    tests::Weston compositor(dir_, "--width=640 --height=400", server_->display());
    ASSERT_FALSE(compositor.environment().empty()) << text("weston.log");
    auto viewer = view(compositor.environment(), "--duration 0 --json --scene fragbox");
    EXPECT_TRUE(eventually(viewer, [&] {
        xdotool("mousemove 1000 700 mousemove 300 250");
        return dot_at(300, 250);
    })) << "no marker at the pointer: " << text("err");
    xdotool("key 1 key q");
    EXPECT_EQ(viewer.wait(30), 0) << text("err");
    const auto s = summary();
    EXPECT_EQ(s["display"]["presenter"], "wayland") << text("out");
    EXPECT_GT(s["mouse_frames"], 0);
    EXPECT_EQ(s["width_px"], 320) << "it fills what the compositor gave it";
}

TEST_F(WaylandWindow, ACompositorThatGoesAwayIsAnErrorThatSaysSo) {
    ASSERT_NO_FATAL_FAILURE(start());
    auto viewer = view(server_->environment(), "--duration 0 --progress");
    ASSERT_TRUE(eventually(viewer, [&] { return text("err").find("frames") != std::string::npos; })) << text("err");
    server_->stop();
    EXPECT_EQ(viewer.wait(20), 1);
    EXPECT_NE(text("err").find("gone away"), std::string::npos) << text("err");
}

TEST_F(Window, ANamedDisplayThatIsAbsentIsAnErrorThatSaysSo) {
    for (const char* display : {"wayland", "x11", "kms"}) {
        if (fs::exists("/dev/dri") && display == std::string("kms")) continue;   // it might be had
        auto viewer = view("XDG_RUNTIME_DIR='" + dir_.string() + "'", std::string("--frames 1 --present ") + display);
        EXPECT_EQ(viewer.wait(20), 1) << display;
        EXPECT_NE(text("err").find("--present"), std::string::npos) << text("err");
    }
}

}  // namespace
