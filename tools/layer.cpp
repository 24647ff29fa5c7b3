// `fovea layer`: starts a program whose GLES driver has the foveation extensions.
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <iostream>

#include <fmt/core.h>

#include "command_line/checks.hpp"
#include "tools/commands.hpp"
#include "tools/layer_auto.hpp"
#include "tools/layer_trace.hpp"
#include "replay/output_file.hpp"

namespace fovea::tools {
namespace {

namespace fs = std::filesystem;

struct LayerOptions {
    std::string library, vendor, reading = "area";
    std::optional<unsigned> memory_mib;
    bool stats = false, report = false;
    AutoOptions automatic;
    std::string trace_page;  // empty: no trace
    int trace_frames = 3;
    std::vector<std::string> program;
};

// Beside this program as it was built (../lib), or as it was installed.
std::string find_library() {
    std::error_code ignored;
    const fs::path bin = fs::read_symlink("/proc/self/exe", ignored).parent_path();
    for (const fs::path& candidate : {bin / "../lib/libfovea_layer.so", bin / "../lib/fovea/libfovea_layer.so",
                                      bin / "../lib/x86_64-linux-gnu/libfovea_layer.so", bin / "libfovea_layer.so"})
        if (fs::exists(candidate, ignored)) return fs::canonical(candidate, ignored).string();
    return {};
}

volatile std::sig_atomic_t child_pid = 0;

void forward(int signal) {
    if (child_pid > 0) kill(static_cast<pid_t>(child_pid), signal);
}

// A folder that is gone when this ends.
struct RunFolder {
    fs::path path;
    ~RunFolder() {
        std::error_code ignored;
        if (!path.empty()) fs::remove_all(path, ignored);
    }
};

int fail_with(const std::string& text, int code) {
    fmt::print(stderr, "fovea layer: {}\n", text);
    return code;
}

int run(const LayerOptions& options) {
    const std::string library = options.library.empty() ? find_library() : options.library;
    if (library.empty()) return fail_with("libfovea_layer.so is not beside this program (build it: ./check --build, or the target fovea_layer alone; or name it with --library)", kBadInput);
    if (access(library.c_str(), R_OK) != 0) return fail_with(fmt::format("{}: cannot read the layer: {} (name it with --library)", library, std::strerror(errno)), kBadInput);

    std::string automatic;
    if (options.automatic.on) {
        auto text = auto_environment(options.automatic, options.program[0]);
        if (!text) return fail_with(text.error().message(), kBadInput);
        automatic = *text;
    }
    const char* base = std::getenv("XDG_RUNTIME_DIR");
    std::string name = std::string(base && *base && access(base, W_OK) == 0 ? base : "/tmp") + "/fovea-layer.XXXXXX";
    if (!mkdtemp(name.data())) return fail_with(fmt::format("cannot make {}: {}", name, std::strerror(errno)), kFailed);
    const RunFolder folder{name};
    const fs::path vendor_json = folder.path / "vendor.json", stats_json = folder.path / "stats.json";
    {
        std::string escaped;
        for (const char c : fs::absolute(library).string()) {
            if (c == '"' || c == '\\') escaped += '\\';
            escaped += c;
        }
        std::ofstream out(vendor_json);
        out << R"({"file_format_version": "1.0.0", "ICD": {"library_path": ")" << escaped << "\"}}\n";
        if (!out.flush()) return fail_with(fmt::format("cannot write {}", vendor_json.string()), kFailed);
    }

    std::vector<char*> arguments;
    for (const std::string& a : options.program) arguments.push_back(const_cast<char*>(a.c_str()));
    arguments.push_back(nullptr);
    for (const int signal : {SIGTERM, SIGHUP, SIGINT, SIGQUIT}) std::signal(signal, forward);
    const pid_t pid = fork();
    if (pid < 0) return fail_with(fmt::format("cannot start a process: {}", std::strerror(errno)), kFailed);
    if (pid == 0) {
        for (const int signal : {SIGTERM, SIGHUP, SIGINT, SIGQUIT}) std::signal(signal, SIG_DFL);
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", vendor_json.c_str(), 1);
        if (!options.vendor.empty()) setenv("FOVEA_LAYER_VENDOR", options.vendor.c_str(), 1);
        if (options.memory_mib) setenv("FOVEA_LAYER_MEMORY_MIB", std::to_string(*options.memory_mib).c_str(), 1);
        setenv("FOVEA_LAYER_READING", options.reading.c_str(), 1);
        if (!options.trace_page.empty()) {
            setenv("FOVEA_LAYER_TRACE", folder.path.c_str(), 1);
            setenv("FOVEA_LAYER_TRACE_FRAMES", std::to_string(options.trace_frames).c_str(), 1);
        }
        if (options.automatic.on) setenv("FOVEA_LAYER_AUTO", automatic.c_str(), 1);
        if (options.stats || options.report || options.automatic.compare) setenv("FOVEA_LAYER_STATS", stats_json.c_str(), 1);
        execvp(arguments[0], arguments.data());
        const int why = errno;
        fmt::print(stderr, "fovea layer: {}: cannot start the program: {} (check its name, or give its whole path)\n", options.program[0], std::strerror(why));
        _exit(why == ENOENT ? 127 : 126);
    }
    child_pid = static_cast<std::sig_atomic_t>(pid);
    int status = 0;
    while (waitpid(pid, &status, 0) < 0)
        if (errno != EINTR) return fail_with(fmt::format("waiting failed: {}", std::strerror(errno)), kFailed);
    if (options.stats || options.report || options.automatic.compare) {
        std::ifstream in(stats_json);
        const std::string counters{std::istreambuf_iterator<char>(in), {}};
        if (options.report) std::cerr << auto_report(counters);
        if (options.automatic.compare && !options.stats) std::cerr << comparison_report(counters);
        if (options.stats) std::cerr << counters;
        if (counters.empty())
            fmt::print(stderr, "fovea layer: no counters: the program made no EGL display, or ended without exit()\n");
    }
    if (!options.trace_page.empty()) {
        std::string started;
        for (const std::string& word : options.program) started += (started.empty() ? "" : " ") + word;
        const auto page = layer_trace_page(folder.path.string(), started);
        if (!page) return fail_with(page.error().message(), kFailed);
        if (const auto written = replay::write_file(options.trace_page, *page); !written) return fail_with(written.error().message(), kFailed);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

void add_layer(CLI::App& app, int* exit_code) {
    CLI::App* layer = app.add_subcommand("layer", "Foveation extensions for programs on any GLES driver");
    layer->require_subcommand(1);
    static LayerOptions options;
    const auto common = [](CLI::App* command) {
        command->add_option("--library", options.library, "The layer (default: libfovea_layer.so beside this program)");
        command->add_option("--vendor", options.vendor, "The EGL vendor library of the driver (default: libEGL_mesa.so.0)");
        command->add_option("--memory", options.memory_mib, "Most MiB that the images of levels of one context may take (default: what the driver gives)");
        command->add_option("--reading", options.reading, "What half the density means: half the pixels (area), or half along each axis (linear)")
            ->check(CLI::IsMember({"area", "linear"}))->capture_default_str();
        command->add_flag("--stats", options.stats, "Print the layer's counters on stderr when the program has ended");
    };
    const auto auto_options = [](CLI::App* command) {
        command->add_flag("--auto", options.automatic.on, "Foveate a program that does not use the extensions: its window follows fovead's gaze");
        command->add_option("--gain", options.automatic.gain, "Auto: how fast density falls with distance, 1/NDC, one for both axes or x,y (default 4; 0: full density)")
            ->needs("--auto");
        command->add_option("--area", options.automatic.area, "Auto: enlarges the region of full density (radius sqrt(1 + area) / gain; default 0)")
            ->check(command_line::within(0.0, 1e6))->needs("--auto");
        command->add_option("--focus", options.automatic.focus, "Auto: a fixed focal point x,y in NDC instead of fovead's")
            ->needs("--auto");
        command->add_option("--fov", options.automatic.fov_deg, "Auto: horizontal angle that the window fills, degrees (default 40)")
            ->check(command_line::within(1.0, 179.0))->needs("--auto");
        CLI::Option* always = command->add_flag("--always", options.automatic.always, "Auto: foveate also where a trial finds that it takes longer")->needs("--auto");
        command->add_flag("--compare", options.automatic.compare,
                          "Auto: draw blocks of frames straight, recorded at full density and foveated in turns, and print on stderr what they take")
            ->needs("--auto")->excludes(always);
        command->add_option("--rules", options.automatic.rules, "Auto: folder of rules per program (configs/layer/README.md)")->needs("--auto");
        command->add_flag("--report", options.report, "Auto: say on stderr, per GL program, what was drawn at full density and why")->needs("--auto");
    };
    const auto take_program = [exit_code](CLI::App* command) {
        command->add_option("program", options.program, "The program and its arguments, after --")->required();
        command->prefix_command();
        command->callback([exit_code, command] {
            if (options.program.empty()) options.program = command->remaining();
            *exit_code = options.program.empty() ? kUsage : run(options);
        });
    };
    CLI::App* command = layer->add_subcommand("run", "Start a program with the QCOM foveation extensions and multiview on any driver, or foveate it (--auto)");
    common(command);
    command->footer("Example: fovea layer run --stats -- ./my_program --its-own-option\n"
                    "The exit code is the program's; 128 + n when signal n ended it, 127 when it was not found.");
    auto_options(command);
    take_program(command);

    CLI::App* trace = layer->add_subcommand("trace", "Start a program as `run` does, and write its foveation calls, plans and pictures as one HTML page");
    trace->footer("Example: fovea layer trace --auto --focus 0,0 -o frame.html -- ./my_program\n"
                  "The page is written when the program has ended, also by a signal. In auto mode no trial is made: --always is implied.");
    common(trace);
    auto_options(trace);
    trace->add_option("-o,--output", options.trace_page, "The page")->required()->check(command_line::file_name());
    trace->add_option("--frames", options.trace_frames, "How many frames, from the first that is submitted through the layer")
        ->check(CLI::Range(1, 64))->capture_default_str();
    take_program(trace);
    trace->preparse_callback([](std::size_t) { options.automatic.always = true; });
}

}  // namespace fovea::tools
