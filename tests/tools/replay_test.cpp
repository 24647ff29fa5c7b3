// `fovea replay` on the recordings that ship with the project.
#include <thread>
#include <vector>

#include "tests/tools/command_runner.hpp"

namespace {

const std::string kRecordings = std::string(FOVEA_SOURCE_DIR) + "/tests/data/recordings/";

class ReplayCommand : public fovea::test::CommandTest {
protected:
    int run(const std::string& arguments) const { return fovea(arguments).exit_code; }
};

TEST_F(ReplayCommand, WritesTheSameBytesOnEveryRunEvenUnderLoad) {
    for (const std::string name : {"eyelink_lookatpoint_s1.csv", "vive_pro_eye_360vr.csv"}) {
        ASSERT_EQ(run("replay " + kRecordings + name + " --speed max --csv " + file("1.csv")), 0);
        ASSERT_EQ(run("replay " + kRecordings + name + " --speed max --csv " + file("2.csv")), 0);
        {
            std::vector<std::jthread> load;
            for (int i = 0; i < 4; ++i)
                load.emplace_back([](std::stop_token stop) {
                    volatile double x = 1;
                    while (!stop.stop_requested()) x = x * 1.0000001;
                });
            ASSERT_EQ(run("replay " + kRecordings + name + " --speed max --csv " + file("3.csv")), 0);
        }
        const std::string first = bytes(file("1.csv"));
        EXPECT_GT(first.size(), 100'000u);
        EXPECT_TRUE(first == bytes(file("2.csv"))) << name;
        EXPECT_TRUE(first == bytes(file("3.csv"))) << name;
    }
}

TEST_F(ReplayCommand, HasOneRowPerSampleAndSeesSaccades) {
    ASSERT_EQ(run("replay " + kRecordings + "eyelink_lookatpoint_s1.csv --csv " + file("out.csv")), 0);
    std::ifstream out(file("out.csv")), in(kRecordings + "eyelink_lookatpoint_s1.csv");
    std::size_t rows = 0, saccade = 0, fixation = 0, recorded = 0;
    for (std::string line; std::getline(out, line); ++rows) {
        saccade += line.find(",saccade,") != std::string::npos;
        fixation += line.find(",fixation,") != std::string::npos;
    }
    for (std::string line; std::getline(in, line);) recorded += !line.empty() && (std::isdigit(line[0]) || line[0] == '-');
    EXPECT_EQ(rows - 1, recorded);
    EXPECT_GT(saccade, rows / 50);
    EXPECT_GT(fixation, rows / 2);
}

TEST_F(ReplayCommand, SaysWhatIsWrongByItsExitCodeAndLeavesNoHalfFile) {
    EXPECT_EQ(run("replay " + file("absent.csv") + " --csv " + file("out.csv")), 3);
    std::ofstream(file("foreign.csv")) << "a,b\n1,2\n";
    EXPECT_EQ(run("replay " + file("foreign.csv") + " --csv " + file("out.csv")), 3);
    EXPECT_EQ(run("replay " + kRecordings + "vive_pro_eye_360vr.csv --speed backwards --csv " + file("out.csv")), 2);
    EXPECT_EQ(run("replay " + kRecordings + "vive_pro_eye_360vr.csv --predictor oracle --csv " + file("out.csv")), 2);
    EXPECT_EQ(run("replay " + kRecordings + "vive_pro_eye_360vr.csv --csv " + file("no/such/dir/out.csv")), 1);
    EXPECT_FALSE(std::filesystem::exists(file("out.csv")));
    EXPECT_FALSE(std::filesystem::exists(file("out.csv.partial")));
}

}  // namespace
