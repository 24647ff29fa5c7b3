#include "tests/daemon/daemon_process.hpp"

#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "daemon/service/admin_client.hpp"
#include "protocol/unique_fd.hpp"

namespace fovea::test {
namespace {

std::string read_file(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

// In the child: becomes `uid` for good, without any groups.
void become(unsigned uid) {
    if (uid == 0) return;
    if (::setgroups(0, nullptr) != 0 || ::setgid(uid) != 0 || ::setuid(uid) != 0) ::_exit(126);
}

pid_t spawn(const std::vector<std::string>& arguments, const std::string& out, const std::string& error, unsigned uid) {
    std::vector<char*> argv;
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    const int out_fd = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    const int error_fd = ::open(error.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::dup2(out_fd, 1);
    ::dup2(error_fd, 2);
    become(uid);
    ::execv(argv[0], argv.data());
    ::_exit(127);
}

int wait_for(pid_t pid, Duration at_most) {
    int status = 0;
    if (!eventually([&] { return ::waitpid(pid, &status, WNOHANG) == pid; }, at_most)) {
        ADD_FAILURE() << "process " << pid << " does not end";
        ::kill(pid, SIGKILL);
        ::waitpid(pid, &status, 0);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace

bool eventually(const std::function<bool()>& condition, Duration at_most) {
    const Instant deadline = MonotonicClock::now() + at_most;
    while (!condition()) {
        if (MonotonicClock::now() > deadline) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));  // between two looks; nothing depends on its length
    }
    return true;
}

TemporaryFolder::TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "fovea-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
}
TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}
std::vector<std::string> TemporaryFolder::names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
}

std::string copy_for_others(const std::string& program, const TemporaryFolder& folder) {
    const std::string copy = folder / std::filesystem::path(program).filename().c_str();
    std::filesystem::copy_file(program, copy, std::filesystem::copy_options::skip_existing);
    return copy;
}

Finished run_program(const std::vector<std::string>& arguments, unsigned uid) {
    const TemporaryFolder folder;
    const pid_t pid = spawn(arguments, folder / "out", folder / "error", uid);
    Finished f;
    f.code = wait_for(pid, std::chrono::seconds(60));
    f.out = read_file(folder / "out");
    f.error = read_file(folder / "error");
    return f;
}

std::string shipped_recording() { return FOVEA_SOURCE_DIR "/tests/data/recordings/eyelink_lookatpoint_s1.csv"; }

DaemonProcess::DaemonProcess(const TemporaryFolder& folder, const DaemonOptions& options)
    : folder_{folder.path().string()}, log_path_{folder / "log"} {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) std::abort();
    UniqueFd read_end(ends[0]), write_end(ends[1]);
    // The child gets the write end as a descriptor that survives exec, and writes to it by its name in /dev/fd.
    UniqueFd inherited(::dup(write_end.get()));
    write_end.reset();
    // Opening it by name asks for the right to write, which is the pipe's owner's.
    if (options.uid != 0 && ::fchown(inherited.get(), options.uid, options.uid) != 0) std::abort();

    const std::string program = FOVEA_BIN_DIR "/fovead";
    std::vector<std::string> arguments = {options.uid != 0 ? copy_for_others(program, folder) : program, "--run-dir", folder_, "--ready-file",
                                          "/dev/fd/" + std::to_string(inherited.get())};
    if (!options.config.empty()) {
        std::ofstream(folder / "fovead.toml") << options.config;
        arguments.insert(arguments.end(), {"--config", folder / "fovead.toml"});
    }
    const std::string recording = options.recording.empty() ? shipped_recording() : options.recording;
    arguments.insert(arguments.end(), {"--set", "source.path=" + recording});
    arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
    pid_ = spawn(arguments, "/dev/null", log_path_, options.uid);
    inherited.reset();  // from here on the end of the pipe is the end of the daemon

    std::string said;
    eventually([&] {
        pollfd p{read_end.get(), POLLIN, 0};
        if (::poll(&p, 1, 0) <= 0) return false;
        char text[16];
        const ssize_t n = ::read(read_end.get(), text, sizeof text);
        if (n > 0) said.append(text, static_cast<std::size_t>(n));
        return n <= 0 || said.ends_with('\n');
    });
    ready_ = said == "ready\n";
}

DaemonProcess::~DaemonProcess() {
    if (pid_ < 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
}

void DaemonProcess::send(int signal) const { ::kill(pid_, signal); }
int DaemonProcess::wait() {
    const int code = wait_for(pid_, std::chrono::seconds(30));
    pid_ = -1;
    return code;
}
std::string DaemonProcess::log() const { return read_file(log_path_); }

std::string DaemonProcess::ask(const std::string& command) const {
    const auto answer = service::ask_daemon(admin_socket(), R"({"command":")" + command + "\"}", std::chrono::seconds(20));
    return answer ? *answer : std::string{};
}

double DaemonProcess::number(const std::string& member) const {
    const std::string status = ask("status"), name = "\"" + member + "\":";
    const std::size_t at = status.find(name);
    return at == std::string::npos ? -1 : std::atof(status.c_str() + at + name.size());
}

}  // namespace fovea::test
