// `cmake --install`: what lands where, and that an app builds and runs against it.
#include <gmock/gmock.h>

#include "tests/tools/command_runner.hpp"

namespace {

using testing::HasSubstr;
class Install : public fovea::test::CommandTest {};

TEST_F(Install, AnAppBuildsAndRunsAgainstWhatWasInstalled) {
    const std::string root = file("usr");
    const auto shell = [&](const std::string& line) { return std::system((line + " >" + file("log") + " 2>&1").c_str()); };
    ASSERT_EQ(shell("cmake --install " FOVEA_BIN_DIR "/.. --prefix " + root), 0) << bytes(file("log"));
    EXPECT_EQ(shell(root + "/bin/fovead --version"), 0) << bytes(file("log"));
    EXPECT_EQ(shell(root + "/bin/fovea version"), 0) << bytes(file("log"));
    EXPECT_EQ(shell(root + "/bin/fovea-view --help"), 0) << bytes(file("log"));   // finds libfovea.so by itself
    EXPECT_THAT(bytes(root + "/lib/systemd/system/fovead.service"), HasSubstr("ExecStart=" + root + "/bin/fovead --config"));
    for (const char* name : {"lib/udev/rules.d/60-fovea.rules", "share/man/man1/fovea.1", "share/man/man8/fovead.8",
                             "share/fovea/fovead.toml", "share/fovea/scenarios/reading.toml"})
        EXPECT_TRUE(std::filesystem::exists(root + "/" + name)) << name;
    std::ofstream(file("app.c")) << "#include <fovea/fovea.h>\nint main(void) { return fovea_api_version() == FOVEA_API_VERSION ? 0 : 1; }\n";
    const std::string pc = "PKG_CONFIG_PATH=$(dirname $(find " + root + " -name fovea.pc)) pkg-config ";
    ASSERT_EQ(shell("cc -std=c99 -o " + file("app") + " " + file("app.c") + " $(" + pc + "--cflags --libs fovea)"), 0) << bytes(file("log"));
    EXPECT_EQ(shell("LD_LIBRARY_PATH=$(dirname $(find " + root + " -name libfovea.so)) " + file("app")), 0) << bytes(file("log"));
}

}  // namespace
