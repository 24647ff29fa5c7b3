#include "tools/commands.hpp"

namespace fovea::tools {

void add_admin(CLI::App& app, int* exit_code);
void add_calibrate(CLI::App& app, int* exit_code);
void add_convert(CLI::App& app, int* exit_code);
void add_devices(CLI::App& app, int* exit_code);
void add_doctor(CLI::App& app, int* exit_code);
void add_latency(CLI::App& app, int* exit_code);
void add_layer(CLI::App& app, int* exit_code);
void add_predict(CLI::App& app, int* exit_code);
void add_record(CLI::App& app, int* exit_code);
void add_replay(CLI::App& app, int* exit_code);
void add_scene(CLI::App& app, int* exit_code);
void add_status(CLI::App& app, int* exit_code);
void add_synth(CLI::App& app, int* exit_code);
void add_top(CLI::App& app, int* exit_code);
void add_tradeoff(CLI::App& app, int* exit_code);
void add_version(CLI::App& app, int* exit_code);

const CommandRow kCommands[] = {
    {"admin", add_admin},
    {"calibrate", add_calibrate},
    {"convert", add_convert},
    {"devices", add_devices},
    {"doctor", add_doctor},
    {"latency", add_latency},
    {"layer", add_layer},
    {"predict", add_predict},
    {"record", add_record},
    {"replay", add_replay},
    {"scene", add_scene},
    {"status", add_status},
    {"synth", add_synth},
    {"top", add_top},
    {"tradeoff", add_tradeoff},
    {"version", add_version},
};
const unsigned kCommandCount = sizeof kCommands / sizeof kCommands[0];

}  // namespace fovea::tools
