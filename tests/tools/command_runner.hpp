// Runs the built `fovea` in a folder of its own, for tests of its subcommands.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace fovea::test {

struct CommandResult {
    int exit_code = -1;   // -1: ended by a signal
    std::string out, err;
};

class CommandTest : public testing::Test {
protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "fovea_command_XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        dir_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(dir_); }

    [[nodiscard]] std::string file(const std::string& name) const { return (dir_ / name).string(); }

    [[nodiscard]] static std::string bytes(const std::string& path) {
        std::ifstream in(path, std::ios::binary);
        std::stringstream s;
        s << in.rdbuf();
        return s.str();
    }

    // `arguments` as a shell reads them.
    [[nodiscard]] CommandResult fovea(const std::string& arguments) const {
        const std::string out = file(".stdout"), err = file(".stderr");
        std::string line = FOVEA_BIN_DIR "/fovea ";
        line += arguments;
        line += " >" + out + " 2>" + err;
        const int status = std::system(line.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytes(out), bytes(err)};
    }

    std::filesystem::path dir_;
};

}  // namespace fovea::test
