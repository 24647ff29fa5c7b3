// `fovea predict` and `fovea tradeoff` on the recordings that ship with the project.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
const std::string kFovea = std::string(FOVEA_BIN_DIR) + "/fovea";
const std::string kRecordings = std::string(FOVEA_SOURCE_DIR) + "/tests/data/recordings/";

class PredictCommand : public testing::Test {
protected:
    void SetUp() override {
        dir_ = fs::temp_directory_path() / ("fovea_predict_test_" + std::to_string(::getpid()));
        fs::create_directories(dir_);
    }
    void TearDown() override { fs::remove_all(dir_); }
    std::string file(const std::string& name) const { return (dir_ / name).string(); }
    int run(const std::string& arguments) const {
        const int status = std::system((kFovea + " " + arguments + " >" + file("stdout") + " 2>" + file("stderr")).c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    static std::string bytes(const std::string& path) {
        std::stringstream s;
        s << std::ifstream(path).rdbuf();
        return s.str();
    }
    static std::vector<std::string> fields(const std::string& line) {
        std::vector<std::string> out(1);
        for (const char c : line) {
            if (c == ',') out.emplace_back();
            else out.back() += c;
        }
        return out;
    }
    fs::path dir_;
};

TEST_F(PredictCommand, WritesTheColumnsOfItsContractAndTheAskedHorizon) {
    ASSERT_EQ(run("predict " + kRecordings + "eyelink_lookatpoint_s1.csv --horizon-ms 30 --csv " + file("p.csv")), 0) << bytes(file("stderr"));
    std::ifstream in(file("p.csv"));
    std::string line;
    std::getline(in, line);
    EXPECT_EQ(line, "t_ns,valid,event,x_deg,y_deg,pred_t_ns,pred_x_deg,pred_y_deg,sigma_deg,onset_seen");
    std::size_t rows = 0, saccades = 0;
    while (std::getline(in, line)) {
        const auto f = fields(line);
        ASSERT_EQ(f.size(), 10u) << line;
        EXPECT_EQ(std::stoll(f[5]) - std::stoll(f[0]), 30'000'000) << line;
        EXPECT_EQ(f[9], f[2] == "saccade" ? "1" : "0") << line;
        if (!f[8].empty()) {
            EXPECT_GE(std::stod(f[8]), 0);
        }
        ++rows;
        saccades += f[9] == "1";
    }
    EXPECT_GT(rows, 50'000u);
    EXPECT_GT(saccades, rows / 50);
}

TEST_F(PredictCommand, HoldPredictsTheGazeItself) {
    ASSERT_EQ(run("predict " + kRecordings + "vive_pro_eye_360vr.csv --predictor hold --filter none --csv " + file("p.csv")), 0);
    std::ifstream in(file("p.csv"));
    std::string line;
    std::getline(in, line);
    std::size_t same = 0, rows = 0;
    while (std::getline(in, line)) {
        const auto f = fields(line);
        if (f[1] != "1" || f[2] == "blink" || f[2] == "lost") continue;
        ++rows;
        same += f[3] == f[6] && f[4] == f[7];
    }
    EXPECT_GT(rows, 500u);
    EXPECT_GT(same, rows * 9 / 10) << "all but repeats and drop-outs";
}

TEST_F(PredictCommand, RefusesWhatCannotBe) {
    EXPECT_EQ(run("predict " + file("absent.csv") + " --csv -"), 3);
    EXPECT_EQ(run("predict " + kRecordings + "vive_pro_eye_360vr.csv --predictor oracle --csv -"), 2);
    EXPECT_EQ(run("predict " + kRecordings + "vive_pro_eye_360vr.csv --horizon-ms 500 --csv -"), 2);
}

TEST_F(PredictCommand, TradeoffJudgesEachPredictorByErrorAndCost) {
    ASSERT_EQ(run("tradeoff predict " + kRecordings + "vive_pro_eye_360vr.csv --json --horizon 30 --html " + file("t.html") + " --csv " + file("t.csv") +
                  " --budget-us 1000 --toml " + file("best.toml")),
              0)
        << bytes(file("stderr"));
    const auto tables = nlohmann::json::parse(bytes(file("stdout")));
    ASSERT_FALSE(tables.empty());
    double hold = 0, best = 1e9;
    std::size_t frontier = 0;
    for (const auto& row : tables[0]["rows"]) {
        EXPECT_GT(row["cost_ns"].get<double>(), 0) << row;
        if (row["method"] == "hold") hold = row["mean_30ms"];
        best = std::min(best, row["mean_30ms"].get<double>());
        frontier += row["frontier"].get<bool>();
    }
    EXPECT_GT(hold, 0);
    EXPECT_LE(best, hold);
    EXPECT_GE(frontier, 1u);
    EXPECT_NE(bytes(file("t.html")).find("<svg"), std::string::npos);
    EXPECT_NE(bytes(file("t.csv")).find("auto"), std::string::npos);
    EXPECT_NE(bytes(file("best.toml")).find("[predictor]"), std::string::npos);
}

TEST_F(PredictCommand, TradeoffsTextFitsATerminalAndThePageHasAll) {
    ASSERT_EQ(run("tradeoff predict " + kRecordings + "vive_pro_eye_360vr.csv --csv " + file("t.csv")), 0) << bytes(file("stderr"));
    std::istringstream text(bytes(file("stdout")));
    for (std::string line; std::getline(text, line);)
        EXPECT_TRUE(line.size() <= 140 || line.find("Device groups") != std::string::npos) << line;
    EXPECT_NE(text.str().find("mean_70ms"), std::string::npos);
    EXPECT_NE(text.str().find("p95_70ms"), std::string::npos);
    EXPECT_EQ(text.str().find("p99_70ms"), std::string::npos);
    for (const char* column : {"mean_10ms", "median_70ms", "p95_10ms", "p99_70ms", "in95"}) EXPECT_NE(bytes(file("t.csv")).find(column), std::string::npos) << column;
}

TEST_F(PredictCommand, TradeoffMeasuresTheJitterOfAFastTrackerToo) {
    ASSERT_EQ(run("convert " + kRecordings + "eyelink_lookatpoint_s1.csv " + file("fast.csv") + " --duration 5"), 0) << bytes(file("stderr"));
    ASSERT_EQ(run("tradeoff filter " + file("fast.csv") + " --json"), 0) << bytes(file("stderr"));
    const auto tables = nlohmann::json::parse(bytes(file("stdout")));
    double none = 0, smoothest = 1e9;
    for (const auto& row : tables[0]["rows"]) {
        ASSERT_TRUE(row["jitter"].is_number()) << row;
        if (row["method"] == "none") none = row["jitter"];
        smoothest = std::min(smoothest, row["jitter"].get<double>());
    }
    EXPECT_GT(none, 0.001) << "degrees";
    EXPECT_LT(none, 0.2) << "steps of 4 ms, not over a blink";
    EXPECT_LT(smoothest, none) << "some filter smooths";
}

TEST_F(PredictCommand, TradeoffSaysWhatItMisses) {
    EXPECT_EQ(run("tradeoff classify " + kRecordings + "vive_pro_eye_360vr.csv"), 3) << "it has no labels";
    EXPECT_NE(bytes(file("stderr")).find("label"), std::string::npos) << bytes(file("stderr"));
    EXPECT_EQ(run("tradeoff predict " + file("absent")), 3);
    EXPECT_EQ(run("tradeoff predict " + kRecordings + "vive_pro_eye_360vr.csv --budget-ns 0"), 1);
}

}  // namespace
