// `fovea`: the command line.
#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "render/foveation/driver_traits.hpp"
#include "replay/output_file.hpp"
#include "tools/commands.hpp"

namespace {

// Half a file is not left behind; then the signal does what it does to any program. Commands with work of their own to
// finish take the signals over.
void clean_up_and_end(int signal) {
    fovea::replay::remove_unfinished();
    ::signal(signal, SIG_DFL);
    ::raise(signal);
}

void clean_up_at_signals() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (::signal(signal, clean_up_and_end) == SIG_IGN) ::signal(signal, SIG_IGN);   // nohup
}

// A full disk under standard output shows only now.
int flushed(int code) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    std::fprintf(stderr, "fovea: cannot write to standard output: %s\n", std::strerror(errno));
    return code == fovea::tools::kSuccess ? int{fovea::tools::kFailed} : code;
}

// What of the command line names a command that does not exist: "" where nothing does.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
    const CLI::App* at = &app;
    std::string path = "fovea";
    for (int i = 1; i < argc; ++i) {
        const auto commands = at->get_subcommands([](const CLI::App*) { return true; });
        if (commands.empty() || argv[i][0] == '-') return {};
        const auto named = std::find_if(commands.begin(), commands.end(), [&](const CLI::App* c) { return c->check_name(argv[i]); });
        if (named == commands.end()) return path + ": there is no command '" + argv[i] + "'; `" + path + " --help` lists them";
        at = *named;
        path += std::string(" ") + argv[i];
    }
    return {};
}

// "fovea COMMAND: what is wrong", as every other message begins.
std::string complaint(const CLI::App* app, const CLI::Error& error) {
    std::string path = "fovea";
    for (auto parsed = app->get_subcommands(); !parsed.empty(); parsed = parsed.front()->get_subcommands()) path += " " + parsed.front()->get_name();
    return path + ": " + error.what() + "; `" + path + " --help` explains\n";
}

}  // namespace

int main(int argc, char** argv) {
    using namespace fovea::tools;
    CLI::App app{"Fovea: the eye-tracking-driven foveation runtime"};
    app.require_subcommand(1);
    app.set_version_flag("--version", "fovea " FOVEA_VERSION);
    app.failure_message(complaint);
    app.footer(
        "Exit codes: 0 success, 1 failed while running, 2 wrong usage, 3 unusable input, 4 no daemon.\n"
        "`fovea COMMAND --help` explains one command.");
    int exit_code = kSuccess;
    for (unsigned i = 0; i < kCommandCount; ++i) kCommands[i].add(app, &exit_code);
    clean_up_at_signals();
    fovea::foveation::keep_driver_traits_in(fovea::foveation::traits_folder());
    if (const std::string complaint = unknown_command(app, argc, argv); !complaint.empty()) {
        std::fprintf(stderr, "%s\n", complaint.c_str());
        return kUsage;
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        const int code = app.exit(e);
        return code == 0 ? flushed(kSuccess) : kUsage;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "fovea: %s\n", e.what());
        return kFailed;
    }
    return flushed(exit_code);
}
