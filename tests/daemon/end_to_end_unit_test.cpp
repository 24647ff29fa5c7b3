// The system service that ships: systemd itself says whether the unit is right.
#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "tests/daemon/daemon_process.hpp"

namespace fovea {
namespace {

TEST(SystemdUnit, IsAcceptedBySystemdWithoutAWord) {
    constexpr const char* kAnalyze = "/usr/bin/systemd-analyze";
    if (!std::filesystem::exists(kAnalyze)) GTEST_SKIP() << "no systemd-analyze here";
    std::ostringstream unit;
    unit << std::ifstream(FOVEA_SOURCE_DIR "/configs/systemd/fovead.service").rdbuf();
    std::string text = unit.str();
    const std::string installed = "/usr/bin/fovead";
    const std::size_t at = text.find("ExecStart=" + installed);
    ASSERT_NE(at, std::string::npos);
    text.replace(text.find(installed, at), installed.size(), FOVEA_BIN_DIR "/fovead");   // verify wants it to exist
    const test::TemporaryFolder folder;
    std::ofstream(folder / "fovead.service") << text;
    const test::Finished f = test::run_program({kAnalyze, "verify", "--man=no", folder / "fovead.service"});
    EXPECT_EQ(f.code, 0) << f.error;
    EXPECT_EQ(f.error.find("fovead.service"), std::string::npos) << f.error;
}

}  // namespace
}  // namespace fovea
