// The man page is written by hand; this holds it against the commands that there are.
#include <gmock/gmock.h>

#include "tests/tools/command_runner.hpp"

namespace {

class ManPage : public fovea::test::CommandTest {};

TEST_F(ManPage, DescribesEveryCommand) {
    const std::string page = bytes(FOVEA_SOURCE_DIR "/docs/fovea.1");
    std::istringstream help(fovea("--help").out);
    std::string line;
    while (std::getline(help, line) && line != "Subcommands:") {}
    int commands = 0;
    for (; std::getline(help, line) && line.starts_with("  "); ++commands) {
        const std::string name = line.substr(2, line.find(' ', 2) - 2);
        EXPECT_THAT(page, testing::HasSubstr("\n.B " + name + "\n"));
    }
    EXPECT_GE(commands, 10);
}

}  // namespace
