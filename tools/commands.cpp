#include "tools/commands.hpp"

namespace fovea::tools {

void add_version(CLI::App& app, int* exit_code);

const CommandRow kCommands[] = {
    {"version", add_version},
};
const unsigned kCommandCount = sizeof kCommands / sizeof kCommands[0];

}  // namespace fovea::tools
