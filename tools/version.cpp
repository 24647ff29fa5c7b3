#include <fmt/core.h>

#include "tools/commands.hpp"

namespace fovea::tools {

void add_version(CLI::App& app, int* exit_code) {
    app.add_subcommand("version", "Print the version")->callback([exit_code] {
        fmt::print("fovea {}\n", FOVEA_VERSION);
        *exit_code = kSuccess;
    });
}

}  // namespace fovea::tools
