// `fovea admin`: what an administrator asks of a running fovead.
#include <cstdio>
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/ask_admin.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {
namespace {

using nlohmann::json;
using service::AdminCommand;
using service::AdminRequest;

struct Options {
    WhichDaemon which;
    AdminRequest request;
};

std::string names(const json& list) {
    std::string text;
    for (const json& key : list)
        if (key.is_string()) text += (text.empty() ? "" : ", ") + key.get<std::string>();
    return text.empty() ? "nothing" : text;
}

void print_changes(const json& answer) {
    fmt::print("changed: {}\n", names(answer.value("applied", json::array())));
    const json later = answer.value("needs_restart", json::array());
    if (!later.empty()) fmt::print("after a restart only: {}\n", names(later));
}

void print_recorder(const char* what, const json& answer) {
    const json r = answer.value("recorder", json::object());
    fmt::print("{} {}: {} samples, {} frames\n", what, r.value("path", ""), r.value("samples", 0u), r.value("frames", 0u));
    const unsigned lost = r.value("lost_samples", 0u) + r.value("lost_frames", 0u);
    if (lost != 0) fmt::print("lost, because they came too fast: {} samples, {} frames\n", r.value("lost_samples", 0u), r.value("lost_frames", 0u));
    if (const unsigned dropped = r.value("dropped_rows", 0u); dropped != 0) fmt::print("not written, because the disk is too slow or full: {} rows\n", dropped);
}

int run(Options options, AdminCommand command) {
    options.request.command = command;
    if (command == AdminCommand::record) options.request.path = std::filesystem::absolute(options.request.path).lexically_normal().string();
    json answer;
    if (const int code = ask_admin("admin", options.which, options.request, &answer); code != kSuccess) return code;
    switch (command) {
        case AdminCommand::record: print_recorder("recording to", answer); break;
        case AdminCommand::end_recording: print_recorder("recorded", answer); break;
        case AdminCommand::reload:
        case AdminCommand::switch_source: print_changes(answer); break;
        case AdminCommand::stop: fmt::print("it ends\n"); break;
        case AdminCommand::status: fmt::print("{}\n", answer.value("status", json::object()).dump(2)); break;
    }
    return kSuccess;
}

}  // namespace

void add_admin(CLI::App& app, int* exit_code) {
    auto options = std::make_shared<Options>();
    CLI::App* admin = app.add_subcommand("admin", "Ask something of a running fovead: reload, record, switch the source, stop");
    add_which_daemon(*admin, options->which);
    admin->require_subcommand(1);
    admin->fallthrough();
    const auto add = [&](const char* name, const char* summary, AdminCommand command) {
        CLI::App* sub = admin->add_subcommand(name, summary);
        sub->callback([options, exit_code, command] { *exit_code = run(*options, command); });
        return sub;
    };
    add("reload", "Read the config file again, as SIGHUP does", AdminCommand::reload);
    add("record", "Record everything from now on into a session file; a number is added if it exists", AdminCommand::record)
        ->add_option("FILE", options->request.path, "The session file, written by the daemon's user")->required();
    add("end-recording", "Finish the session file that is being recorded", AdminCommand::end_recording);
    add("switch", "Take gaze from another source until the next reload", AdminCommand::switch_source)
        ->add_option("SETTING", options->request.set, "e.g. source.driver=hid, or source.path=/absolute/gaze.csv")->required()->type_name("source.KEY=VALUE");
    add("stop", "End it cleanly", AdminCommand::stop);
    admin->footer("Only root and the user who runs fovead may ask. Paths in SETTING are the daemon's: give absolute ones.\n"
                  "Exit codes: 0 done, 1 refused or failed (the message says why), 4 no fovead is running there.");
}

}  // namespace fovea::tools
