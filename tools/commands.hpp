// The subcommands of `fovea`: a visible table. One file per subcommand; each adds itself to the command line and sets
// its callback. Tools are wiring: what they do lives in the libraries.
#pragma once

#include <CLI/CLI.hpp>

namespace fovea::tools {

// Exit codes, the same for every subcommand; listed by `fovea --help`.
enum ExitCode : int {
    kSuccess = 0,
    kFailed = 1,     // something failed while running: the message says what
    kUsage = 2,      // wrong options
    kBadInput = 3,   // an input file is missing, torn or foreign
    kNoDaemon = 4,   // no fovead answers
};

// Adds one subcommand; when it is chosen, *exit_code receives its result.
using AddCommand = void (*)(CLI::App& app, int* exit_code);

struct CommandRow {
    const char* name;
    AddCommand add;
};

extern const CommandRow kCommands[];
extern const unsigned kCommandCount;

}  // namespace fovea::tools
