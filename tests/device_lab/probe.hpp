// The commands of lab_probe that stand in files of their own; usage: the first lines of probe.cpp.
// Each: argc and argv from its last positional argument on; returns the program's exit status.
#pragma once

#include <string>
#include <vector>

namespace fovea::lab {

// The p50, p90, p99 and maximum of so many microseconds, as one line; nothing for none.
void print_latencies(const char* what, std::vector<double> us);

int print_tsc_khz();                                                                   // probe_sleep.cpp
int sleep_machine(int argc, char** argv);
int watch_focus(int argc, char** argv);
int after_sleep(const std::string& session_file, int argc, char** argv);
int dma_frames(const std::string& node, int argc, char** argv);                        // probe_frames.cpp

int floor_camera(const std::string& node, int argc, char** argv);                      // probe_latency.cpp
int published(const std::string& session_file, int argc, char** argv);

}  // namespace fovea::lab
