// The importers on whole public recordings, where they are at hand: FOVEA_CORPUS, or ../shared/data/gaze beside the source.
#include <gtest/gtest.h>

#include <cstdlib>

#include "protocol/sphere.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;

namespace {

std::optional<std::filesystem::path> corpus() {
    const char* given = std::getenv("FOVEA_CORPUS");
    const std::filesystem::path path = given ? given : source_path("../shared/data/gaze");
    return std::filesystem::is_directory(path) ? std::optional(path) : std::nullopt;
}

struct Expected {
    const char* path;
    const char* format;
    std::size_t samples, valid;
    double rate_hz;
    bool labels, head;
};

// The counts are the files' own where a file states them (Glasses 2: rec_et_samples 1424, rec_et_valid_samples 1331);
// the others are line counts, and valid lines counted by a script of a few lines in another language.
constexpr Expected kFiles[] = {
    {"irf_lookAtPoint_EL/lookAtPoint_EL_S1.npy", "numpy", 81'003, 79'141, 1000, true, false},
    {"irf_lookAtPoint_EL/lookAtPoint_EL_S2.npy", "numpy", 81'002, 80'837, 1000, true, false},
    {"irf_lookAtPoint_EL/lookAtPoint_EL_S3.npy", "numpy", 81'003, 66'585, 1000, true, false},
    {"glassesviewer_tobii_g2/livedata.json.gz", "tobii_glasses2", 1424, 1331, 50, false, false},
    {"eyedentify3d/tobii_glasses_3/gazedata.gz", "tobii_glasses3", 6547, 6135, 100, false, false},
    {"eyedentify3d/pupil_invisible/trampoline_01/gaze.csv", "pupil_cloud", 8567, 8567, 200, true, false},
    {"eyedentify3d/htc_vive_pro/TESTNA01_2D_Fist3.csv", "vive_sranipal", 1518, 1308, 120, false, true},
    {"fdbeye_eyelink_asc/1950168.asc.gz", "eyelink_asc", 43'699, 42'968, 250, true, false},
    {"i2mc_tobii_tx300/participant1_3.tsv", "tobii_tx300", 1207, 761, 300, false, false},
    {"jov2023_vr/sub06_cube_T005_gaze.csv", "jov2023", 1370, 1274, 90, false, true},
    {"jov2023_vr/sub08_cube_T005_gaze.csv", "jov2023", 1839, 0, 90, false, true},
    {"etdqualitizer/EyeLink_1000+_binocular_1000Hz.tsv", "etdqualitizer", 20'916, 20'916, 1000, false, false},
    {"oemc_hmr/user_1_eye_0.csv", "oemc_hmr", 58'255, 57'805, 200, true, false},
};

}  // namespace

TEST(Corpus, EveryFormatIsReadInFull) {
    const auto root = corpus();
    if (!root) GTEST_SKIP() << "no recordings: set FOVEA_CORPUS to a directory that holds them";
    for (const Expected& e : kFiles) {
        const auto r = load_recording(*root / e.path);
        ASSERT_TRUE(r) << r.error().message();
        EXPECT_EQ(r->info.format, e.format) << e.path;
        EXPECT_EQ(r->samples.size(), e.samples) << e.path;
        EXPECT_EQ(r->info.nominal_rate_hz, e.rate_hz) << e.path;
        EXPECT_EQ(r->info.has_labels, e.labels) << e.path;
        EXPECT_EQ(r->info.has_head_pose, e.head) << e.path;
        std::size_t valid = 0;
        for (const auto& s : r->samples) valid += s.sample.eye(Eye::combined).valid;
        EXPECT_EQ(valid, e.valid) << e.path;
    }
}

TEST(Corpus, GazeLiesWithinWhatEyesCanDo) {
    const auto root = corpus();
    if (!root) GTEST_SKIP() << "no recordings: set FOVEA_CORPUS to a directory that holds them";
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*root)) {
        if (!entry.is_regular_file()) continue;
        const auto r = load_recording(entry.path());
        if (!r) continue;
        ++files;
        std::size_t wild = 0, valid = 0;
        for (const auto& s : r->samples)
            if (s.sample.eye(Eye::combined).valid) {
                ++valid;
                wild += angle_between(s.sample.eye(Eye::combined).gaze_dir_head, {}) > 1.1;  // 63 degrees
            }
        EXPECT_LE(wild * 100, valid) << entry.path() << ": more than 1 % beyond 63 degrees";
    }
    EXPECT_GE(files, 40u);
}
