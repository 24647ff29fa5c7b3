// Programs of their own process, started as a user starts them.
#pragma once

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace fovea::layer_test {

struct Ran {
    int exit_code = -1;
    std::string out;
};

// Standard output of a shell command; standard error goes to `errors` if given, else to nowhere.
inline Ran shell(const std::string& command, const std::string& errors = "/dev/null") {
    Ran ran;
    // This process may have told its own libEGL to load the layer: the programs start without that.
    std::FILE* pipe = popen(("env -u __EGL_VENDOR_LIBRARY_FILENAMES -u FOVEA_LAYER_STATS -u FOVEA_LAYER_AUTO " + command + " 2>" + errors).c_str(), "r");
    if (!pipe) return ran;
    char buffer[4096];
    std::size_t n;
    while ((n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0) ran.out.append(buffer, n);
    const int status = pclose(pipe);
    ran.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return ran;
}

// That it ends well and prints this.
inline void expect_output(const std::string& command, const std::string& out) {
    SCOPED_TRACE(command);
    const Ran ran = shell(command);
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out, out);
}

inline const std::string kBin = FOVEA_BIN_DIR;
inline const std::string kLayer = kBin + "/fovea layer run --library " FOVEA_LAYER_LIBRARY " ";

inline std::string file_text(const std::string& path) {
    std::ifstream in(path);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

inline std::string temporary(const char* name) {
    return testing::TempDir() + "fovea_layer_" + std::to_string(getpid()) + "_" + name;
}

}  // namespace fovea::layer_test
