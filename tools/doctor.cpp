// `fovea doctor`: is this machine fit to run Fovea, and what to do where it is not.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "daemon/service/admin_client.hpp"
#include "drivers/device.hpp"
#include "protocol/handshake.hpp"
#include "protocol/samples_region.hpp"
#include "render/foveation/driver_traits.hpp"
#include "render/gl/context.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {
namespace {

namespace fs = std::filesystem;

enum class Verdict : std::uint8_t { ok, warn, fail };

struct Check {
    std::string subject;
    Verdict verdict = Verdict::ok;
    std::string finding, way_out;
};
using Checks = std::vector<Check>;

struct Options {
    std::string run_dir;
    bool json = false;
};

const char* to_string(Verdict v) { return v == Verdict::ok ? "ok" : v == Verdict::warn ? "warn" : "fail"; }

std::string first_line(const fs::path& path) {
    std::ifstream in(path);
    std::string line;
    std::getline(in, line);
    return line;
}

void check_graphics(Checks& out) {
    const auto context = gl::Context::create();
    if (!context) {
        out.push_back({"graphics driver", Verdict::fail, context.error().what + (context.error().where.empty() ? "" : " at " + context.error().where), context.error().way_out});
        return;
    }
    const gl::ContextInfo& i = context->info();
    const std::string version = fmt::format("{}, OpenGL ES {}.{}", i.renderer, i.major, i.minor);
    if (i.software) out.push_back({"graphics driver", Verdict::warn, version + ": the processor draws", "fine for tests; for a headset install the driver of your GPU"});
    else out.push_back({"graphics driver", Verdict::ok, version, ""});
    std::string native, emulated;
    const auto sort = [&](const char* name, bool has) { (has ? native : emulated) += (has ? native : emulated).empty() ? name : std::string(", ") + name; };
    sort("GL_QCOM_framebuffer_foveated", i.qcom_framebuffer_foveated);
    sort("GL_QCOM_texture_foveated", i.qcom_texture_foveated);
    sort("GL_OVR_multiview2", i.multiview2);
    sort("GL_EXT_fragment_shading_rate", i.fragment_shading_rate);
    out.push_back({"foveation extensions", Verdict::ok, fmt::format("native: {}; done without: {}; {} samples at most", native.empty() ? "none" : native, emulated.empty() ? "none" : emulated, i.max_samples), ""});
    const foveation::DriverTraits& t = foveation::driver_traits();
    const std::string probe = fmt::format("a masked pixel costs {:.0f} % of a shaded one by stencil, {:.0f} % by depth; masks by {}, resolve on the {} ({})", 100 * t.stencil_cost, 100 * t.depth_cost,
                                          t.depth_mask ? "depth" : "stencil", t.processor_resolve ? "processor" : "GPU", t.origin);
    if (t.early_stencil || t.early_depth) out.push_back({"foveation probe", Verdict::ok, probe, ""});
    else out.push_back({"foveation probe", Verdict::warn, probe, "this driver shades what a mask hides: use the methods auto or inset_outset"});
}

// Nodes that are there and may not be opened.
void check_nodes(Checks& out, const char* subject, const char* pattern, const char* way_out) {
    std::size_t count = 0;
    std::string closed;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator("/dev", ignored)) {
        const std::string name = entry.path().filename().string();
        if (!name.starts_with(pattern)) continue;
        ++count;
        if (::access(entry.path().c_str(), R_OK | W_OK) != 0) closed += (closed.empty() ? "" : ", ") + entry.path().string();
    }
    if (count == 0) out.push_back({subject, Verdict::ok, fmt::format("no /dev/{}* here", pattern), ""});
    else if (closed.empty()) out.push_back({subject, Verdict::ok, fmt::format("{} may be opened", count), ""});
    else out.push_back({subject, Verdict::warn, "may not be opened: " + closed, way_out});
}

void check_devices(Checks& out) {
    bool any = false;
    for (const drivers::DeviceRow& row : drivers::device_table()) {
        if (!row.list) continue;
        for (const drivers::FoundDevice& d : row.list(false)) {
            any = true;
            const std::string name = fmt::format("{} at {}", d.name, d.location);
            if (d.problem.empty()) out.push_back({std::string("tracker, driver ") + row.driver, Verdict::ok, name, ""});
            else out.push_back({std::string("tracker, driver ") + row.driver, Verdict::fail, name + " cannot be used", d.problem});
        }
    }
    if (!any) out.push_back({"trackers", Verdict::warn, "none is plugged in", "plug one in, or let fovead play a recording or a synthetic eye (source.driver)"});
    check_nodes(out, "HID devices", "hidraw", "install configs/udev/60-fovea.rules, or be in the group plugdev; then plug the tracker in again");
    check_nodes(out, "cameras", "video", "be in the group video, or install configs/udev/60-fovea.rules");
    for (const char* folder : {"/etc/udev/rules.d", "/usr/local/lib/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
        const fs::path rules = fs::path(folder) / "60-fovea.rules";
        std::error_code ignored;
        if (!fs::exists(rules, ignored)) continue;
        out.push_back({"udev rules", Verdict::ok, rules.string(), ""});
        return;
    }
    out.push_back({"udev rules", Verdict::warn, "60-fovea.rules is not installed: only root may open most trackers",
                   "cp configs/udev/60-fovea.rules /etc/udev/rules.d/ && udevadm control --reload"});
}

void check_daemon(Checks& out, const Options& o) {
    const std::string focus = o.run_dir.empty() ? default_socket_path() : (fs::path(o.run_dir) / "focus.sock").string();
    const std::string admin = o.run_dir.empty() ? service::default_admin_path() : (fs::path(o.run_dir) / "admin.sock").string();
    const auto app = connect_to_daemon(focus, {.grants = kGrantFocus, .pid = ::getpid(), .name = "fovea doctor"});
    if (!app && app.error().fault == ConnectFault::no_daemon) {
        out.push_back({"daemon", Verdict::warn, "no fovead answers at " + focus, "start fovead, or name its folder with --run-dir"});
        std::error_code none;   // a folder that may not be looked into is not there for us
        const fs::path folder = fs::path(focus).parent_path(), parent = fs::exists(folder, none) ? folder : folder.parent_path();
        if (::access(parent.c_str(), W_OK) != 0)
            out.push_back({"run directory", Verdict::warn, fmt::format("{}: {}", parent.string(), std::strerror(errno)), "set XDG_RUNTIME_DIR, or start fovead with --run-dir in a folder of yours"});
        return;
    }
    if (!app) {
        out.push_back({"daemon", Verdict::fail, app.error().what, app.error().way_out});
        return;
    }
    out.push_back({"daemon", Verdict::ok, "apps may connect at " + focus, ""});
    const auto recorder = connect_to_daemon(focus, {.grants = kGrantSamples, .pid = ::getpid(), .name = "fovea doctor"});
    if (recorder) out.push_back({"raw gaze", Verdict::ok, "you may read it (fovea record, latencies in fovea top)", ""});
    else out.push_back({"raw gaze", Verdict::warn, "you may not read it", "an administrator can put your user id into server.sample_uids"});
    const auto status = service::ask_daemon(admin, R"({"command":"status"})");
    const auto reply = status ? nlohmann::json::parse(*status, nullptr, false) : nlohmann::json();
    if (!status) out.push_back({"administration", Verdict::warn, status.error().message(), "fovea status, top and admin need it"});
    else if (!reply.is_object() || !reply.contains("status")) out.push_back({"administration", Verdict::fail, "the answer at " + admin + " is not that of a fovead of this version", "install fovead and fovea of one version"});
    else {
        const auto source = reply["status"].value("source", nlohmann::json::object());
        const std::string state = source.value("state", std::string("unknown"));
        const std::string what = fmt::format("source {} is {}", source.value("driver", std::string()), state);
        const bool well = state == "running" || state == "ended" || state == "waiting";
        out.push_back({"administration", well ? Verdict::ok : Verdict::warn, what, well ? "" : "fovea status says why"});
    }
}

void check_clock(Checks& out) {
    const std::string source = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    timespec resolution{};
    ::clock_getres(CLOCK_MONOTONIC, &resolution);
    constexpr int kReads = 10'000;
    const Instant begin = MonotonicClock::now();
    for (int i = 0; i < kReads; ++i) static_cast<void>(MonotonicClock::now());
    const double ns = to_seconds(MonotonicClock::now() - begin) * 1e9 / kReads;
    const std::string text = fmt::format("{}, {:.0f} ns a reading", source.empty() ? "CLOCK_MONOTONIC" : source, ns);
    if (resolution.tv_sec != 0 || resolution.tv_nsec > 1000)
        out.push_back({"clock", Verdict::fail, fmt::format("{}, steps of {} ns", text, resolution.tv_nsec), "boot a kernel with high-resolution timers"});
    else if (source == "hpet" || source == "acpi_pm" || source == "jiffies" || ns > 1000)
        out.push_back({"clock", Verdict::warn, text + ": each reading is a system call", "boot with clocksource=tsc if the processor's is stable"});
    else out.push_back({"clock", Verdict::ok, text, ""});
}

void check_memory(Checks& out) {
    utsname kernel{};
    ::uname(&kernel);
    const auto region = SamplesPublisher::create({}, 1);
    if (region) out.push_back({"shared memory", Verdict::ok, fmt::format("sealed memory of the daemon's size can be made (Linux {})", kernel.release), ""});
    else out.push_back({"shared memory", Verdict::fail, region.error().what, region.error().way_out.empty() ? "Linux 5.1 or newer, and memory to spare, are needed" : region.error().way_out});
    rlimit lock{}, files{};
    ::getrlimit(RLIMIT_MEMLOCK, &lock);
    ::getrlimit(RLIMIT_NOFILE, &files);
    constexpr rlim_t kWanted = 64u << 20;   // the daemon with its regions
    if (lock.rlim_cur == RLIM_INFINITY || lock.rlim_cur >= kWanted || ::geteuid() == 0) out.push_back({"locked memory", Verdict::ok, "the daemon may keep its memory from being swapped out", ""});
    else out.push_back({"locked memory", Verdict::warn, fmt::format("at most {} KiB", lock.rlim_cur >> 10), "only for server.lock_memory = true: raise memlock to 64 MiB (LimitMEMLOCK= in the unit)"});
    constexpr rlim_t kFiles = 256;          // a few per client
    if (files.rlim_cur >= kFiles) out.push_back({"open files", Verdict::ok, fmt::format("{}", files.rlim_cur), ""});
    else out.push_back({"open files", Verdict::warn, fmt::format("at most {}", files.rlim_cur), "ulimit -n 1024"});
}

int run(const Options& o) {
    Checks checks;
    check_graphics(checks);
    check_devices(checks);
    check_daemon(checks, o);
    check_clock(checks);
    check_memory(checks);
    const auto count = [&](Verdict v) { return std::ranges::count(checks, v, &Check::verdict); };
    if (o.json) {
        nlohmann::json list = nlohmann::json::array();
        for (const Check& c : checks) list.push_back({{"subject", c.subject}, {"verdict", to_string(c.verdict)}, {"finding", c.finding}, {"way_out", c.way_out}});
        fmt::print("{}\n", nlohmann::json{{"checks", list}, {"warnings", count(Verdict::warn)}, {"failures", count(Verdict::fail)}}.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
    } else {
        const bool colour = ::isatty(STDOUT_FILENO) != 0;
        for (const Check& c : checks) {
            const char* paint = !colour ? "" : c.verdict == Verdict::ok ? "\033[32m" : c.verdict == Verdict::warn ? "\033[33m" : "\033[31m";
            fmt::print("{}{:<4}{}  {:<22} {}\n", paint, to_string(c.verdict), colour ? "\033[0m" : "", c.subject, c.finding);
            if (!c.way_out.empty()) fmt::print("      {:<22} -> {}\n", "", c.way_out);
        }
        fmt::print("{} checks: {} to look at, {} that must be mended\n", checks.size(), count(Verdict::warn), count(Verdict::fail));
    }
    return count(Verdict::fail) == 0 ? kSuccess : kFailed;
}

}  // namespace

void add_doctor(CLI::App& app, int* exit_code);
void add_doctor(CLI::App& app, int* exit_code) {
    auto o = std::make_shared<Options>();
    auto* c = app.add_subcommand("doctor", "Check this machine: graphics driver, trackers, permissions, daemon, clock, memory");
    c->add_option("--run-dir", o->run_dir, "The daemon's run directory (default: $XDG_RUNTIME_DIR/fovea, else /run/fovea)");
    c->add_flag("--json", o->json, "Print JSON instead of lines");
    c->footer("ok: as it should be; warn: works, but look at it; fail: mend it. An arrow shows the way out.\n"
              "Exit codes: 0 nothing must be mended, 1 something must, 2 wrong usage.");
    c->callback([o, exit_code] { *exit_code = run(*o); });
}

}  // namespace fovea::tools
