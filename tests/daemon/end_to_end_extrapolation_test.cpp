// fovead and fovea-view with frames between the rendered ones: what reaches the session, and what the latency report makes of it.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>

#include <nlohmann/json.hpp>

#include "replay/session_file.hpp"
#include "tests/daemon/daemon_process.hpp"

namespace fovea {
namespace {

using test::DaemonProcess;
using test::run_program;
using test::TemporaryFolder;

std::vector<std::string> viewer(const DaemonProcess& daemon, const std::vector<std::string>& more, const char* size = "160") {
    std::vector<std::string> command{FOVEA_BIN_DIR "/fovea-view", "--socket", daemon.focus_socket(), "--present", "surfaceless", "--size", size, "--scene", "fragbox", "--json"};
    command.insert(command.end(), more.begin(), more.end());
    return command;
}

TEST(Extrapolated, FramesAlternateWithRenderedOnesInSessionAndReport) {
    const TemporaryFolder folder;
    const std::string session_path = folder / "run.fovea", page = folder / "page.html", pictures = folder / "pictures";
    DaemonProcess daemon(folder, {.arguments = {"--record", session_path}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    const auto view = run_program(viewer(daemon, {"--frames", "12", "--speed", "8", "--extrapolate", "on", "--out", pictures}));
    if (view.code == 1 && view.error.find("libegl") != std::string::npos) GTEST_SKIP() << "no OpenGL ES driver: " << view.error;
    ASSERT_EQ(view.code, 0) << view.error;
    const auto summary = nlohmann::json::parse(view.out);
    EXPECT_EQ(summary["frames"], 12);
    EXPECT_EQ(summary["extrapolation"]["frames"], 11) << "all but the first, which continues nothing";
    EXPECT_FALSE(summary["extrapolation"]["backend"].get<std::string>().empty());
    EXPECT_EQ(summary["extrapolation"]["motion"], "known");
    // How much better than repeating depends on how far the last two frames lay apart, here on the machine's load.
    EXPECT_GT(summary["extrapolation"]["psnr_db"].get<double>(), summary["extrapolation"]["held_psnr_db"].get<double>() - 1) << "worse than showing the last frame again";
    EXPECT_TRUE(std::filesystem::exists(pictures + "/frame_extrapolated.png"));

    EXPECT_EQ(daemon.stop(SIGTERM), 0) << daemon.log();
    const auto session = replay::SessionReader::open(session_path);
    ASSERT_TRUE(session) << session.error().message();
    std::vector<FrameTiming> frames;
    ASSERT_TRUE(session->frames([&](const replay::SessionFrame& f) {
        frames.push_back(f.timing);
        return true;
    }));
    ASSERT_EQ(frames.size(), 23u);
    for (std::size_t i = 1; i < frames.size(); ++i) {
        const FrameTiming &before = frames[i - 1], &f = frames[i];
        EXPECT_EQ(f.frame, before.frame + 1);
        EXPECT_GT(f.photon, before.photon) << "frame " << f.frame;
        const bool extrapolated = i >= 2 && i % 2 == 0;   // 1 rendered, 2 rendered, 2.5, 3, 3.5 ...
        EXPECT_EQ(f.kind, extrapolated ? FrameKind::extrapolated : FrameKind::rendered) << "frame " << f.frame;
        if (!extrapolated) continue;
        // It carries the focus of the frame that it continues, and its own submission.
        EXPECT_EQ(f.latched, before.latched);
        EXPECT_EQ(f.sample_id, before.sample_id);
        EXPECT_EQ(f.views[0].center_ndc, before.views[0].center_ndc);
        EXPECT_GE(f.submitted, before.gpu_done);
        EXPECT_EQ(f.pixels_shaded, 0u);
    }

    const auto latency = run_program({FOVEA_BIN_DIR "/fovea", "latency", session_path, "--json"});
    ASSERT_EQ(latency.code, 0) << latency.error;
    const auto kinds = nlohmann::json::parse(latency.out)["kinds"];
    EXPECT_EQ(kinds["rendered"]["motion_to_photon_ms"]["count"].get<int>() + kinds["extrapolated"]["motion_to_photon_ms"]["count"].get<int>(),
              kinds["rendered"]["frames"].get<int>() + kinds["extrapolated"]["frames"].get<int>());
    EXPECT_EQ(kinds["extrapolated"]["frames"], 11);
    EXPECT_GT(kinds["extrapolated"]["judged"], 0) << "foveal misses are counted for extrapolated frames too";
    EXPECT_GT(kinds["extrapolated"]["motion_to_photon_ms"]["p50"].get<double>(), kinds["rendered"]["motion_to_photon_ms"]["p50"].get<double>());
}

TEST(Extrapolated, FramesAreShownHalfWayToTheNextRenderedOne) {
    const TemporaryFolder folder;
    const std::string session_path = folder / "run.fovea";
    DaemonProcess daemon(folder, {.arguments = {"--record", session_path}});
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    // Frames of many refreshes each, on a display that could show the next one at once.
    const auto view = run_program(viewer(daemon, {"--method", "full", "--frames", "9", "--speed", "8", "--extrapolate", "on", "--refresh-hz", "1000", "--scanout-ms", "1"}, "512"));
    if (view.code == 1 && view.error.find("libegl") != std::string::npos) GTEST_SKIP() << "no OpenGL ES driver: " << view.error;
    ASSERT_EQ(view.code, 0) << view.error;
    EXPECT_EQ(daemon.stop(SIGTERM), 0) << daemon.log();
    const auto session = replay::SessionReader::open(session_path);
    ASSERT_TRUE(session) << session.error().message();
    std::vector<FrameTiming> frames;
    ASSERT_TRUE(session->frames([&](const replay::SessionFrame& f) {
        frames.push_back(f.timing);
        return true;
    }));
    // What lies between a rendered photon and the extrapolated one after it, in parts of what lay between the last two
    // rendered frames. A busy machine only makes it more.
    std::vector<double> parts;
    for (std::size_t i = 2; i < frames.size(); i += 2) {
        ASSERT_EQ(frames[i].kind, FrameKind::extrapolated);
        const FrameTiming &now = frames[i - 1], &before = frames[i == 2 ? 0 : i - 3];
        parts.push_back(to_seconds(frames[i].photon - now.photon) / to_seconds(now.latched - before.latched));
    }
    ASSERT_EQ(parts.size(), 8u);
    std::ranges::nth_element(parts, parts.begin() + 4);
    EXPECT_GT(parts[4], 0.4) << "half, less a refresh";
}

TEST(Extrapolated, FramesComeOnlyWhereThePictureMovesAndMissesItsBudget) {
    const TemporaryFolder folder;
    DaemonProcess daemon(folder);
    ASSERT_TRUE(daemon.ready()) << daemon.log();
    double frame_ms = 0;   // of the last run: what the budget was held against, whatever the machine
    const auto extrapolated = [&](const std::vector<std::string>& more, const char* size = "160", const std::string& scene = "fragbox") {
        auto arguments = viewer(daemon, more, size);
        std::ranges::replace(arguments, "fragbox", scene);
        const auto view = run_program(arguments);
        EXPECT_EQ(view.code, 0) << view.error;
        const auto summary = nlohmann::json::parse(view.out, nullptr, false);
        frame_ms = summary.value("frame_ms", 0.0);
        return summary.contains("extrapolation") ? summary["extrapolation"]["frames"].get<int>() : 0;
    };
    auto command = viewer(daemon, {"--frames", "1", "--extrapolate", "auto"});
    std::erase(command, "--json");
    const auto first = run_program(command);
    if (first.code == 1 && first.error.find("libegl") != std::string::npos) GTEST_SKIP() << "no OpenGL ES driver: " << first.error;
    EXPECT_THAT(first.out, testing::HasSubstr("extrapolated no frame: nothing moved, no frame took longer than a refresh, or the scene declares none"));
    // 1000 Hz: no frame of a software rasteriser is that quick. The camera turns; at 100 times its speed also visibly.
    const int missed = extrapolated({"--method", "full", "--frames", "6", "--extrapolate", "auto", "--speed", "100", "--refresh-hz", "1000", "--scanout-ms", "1"}, "512");
    constexpr double kClearly = 2;
    if (frame_ms > kClearly) {
        EXPECT_GT(missed, 0) << "frames of " << frame_ms << " ms in a budget of one";
    } else {
        GTEST_LOG_(INFO) << "frames of " << frame_ms << " ms: too quick to miss a budget";
    }
    EXPECT_EQ(extrapolated({"--frames", "6", "--extrapolate", "auto", "--speed", "0", "--refresh-hz", "1000", "--scanout-ms", "1"}), 0) << "nothing moves";
    const std::string declared = folder / "declared.toml";
    std::ofstream(declared) << "scene = \"fragbox\"\n[effects]\nextrapolation = true\n";
    EXPECT_EQ(extrapolated({"--frames", "4", "--extrapolate", "auto", "--speed", "0", "--refresh-hz", "1000", "--scanout-ms", "1"}, "160", declared), 3) << "its author wants it: all but the first";
    const int within = extrapolated({"--frames", "2", "--extrapolate", "auto", "--speed", "100", "--refresh-hz", "1"});
    if (frame_ms < 1000 / kClearly) {
        EXPECT_EQ(within, 0) << "a second is budget enough for frames of " << frame_ms << " ms";
    } else {
        GTEST_LOG_(INFO) << "frames of " << frame_ms << " ms: this machine is too busy for a budget of a second";
    }
    EXPECT_EQ(extrapolated({"--frames", "6", "--speed", "100", "--refresh-hz", "1000", "--scanout-ms", "1"}), 0) << "not asked for";
}

}  // namespace
}  // namespace fovea
