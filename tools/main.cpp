// `fovea`: the command line.
#include <cstdio>

#include "tools/commands.hpp"

int main(int argc, char** argv) {
    using namespace fovea::tools;
    CLI::App app{"Fovea: the eye-tracking-driven foveation runtime"};
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 success, 1 failed while running, 2 wrong usage, 3 unusable input, 4 no daemon.\n"
        "`fovea COMMAND --help` explains one command.");
    int exit_code = kSuccess;
    for (unsigned i = 0; i < kCommandCount; ++i) kCommands[i].add(app, &exit_code);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        const int code = app.exit(e);
        return code == 0 ? kSuccess : kUsage;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "fovea: %s\n", e.what());
        return kFailed;
    }
    return exit_code;
}
