#include "replay/output_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <filesystem>

namespace fovea::replay {

struct PartFile::State {
    std::string asked, target;            // as given; with symbolic links followed
    std::array<std::string, 4> names;     // the part, and what SQLite may leave beside it
};

namespace {

// What remove_unfinished() finds; a slot's names do not change while it is in here.
std::array<std::atomic<const std::array<std::string, 4>*>, 8> unfinished{};

void remove(const std::array<std::string, 4>& names) noexcept {
    for (const std::string& name : names) ::unlink(name.c_str());
}

bool is_no_file(const std::string& path) {
    struct stat s {};
    return ::stat(path.c_str(), &s) == 0 && !S_ISREG(s.st_mode) && !S_ISDIR(s.st_mode);
}

constexpr const char* kNoSpace = "free some space, or write to another disk";

}  // namespace

Result<PartFile> PartFile::beside(const std::string& path) {
    std::error_code failed;
    if (std::filesystem::is_directory(path, failed)) return fail("is a directory", path, "choose another name");
    if (is_no_file(path)) return fail("is not a regular file", path, "choose another name");
    auto state = std::make_unique<State>();
    state->asked = state->target = path;
    if (const std::filesystem::path real = std::filesystem::canonical(path, failed); !failed) state->target = real.string();
    const char* const suffixes[] = {"", "-wal", "-shm", "-journal"};
    for (std::size_t i = 0; i < state->names.size(); ++i) state->names[i] = state->target + ".part" + suffixes[i];
    for (auto& slot : unfinished) {
        const std::array<std::string, 4>* empty = nullptr;
        if (slot.compare_exchange_strong(empty, &state->names)) break;
    }
    return PartFile(std::move(state));
}

PartFile::PartFile(std::unique_ptr<State> state) noexcept : state_{std::move(state)} {}
PartFile::PartFile(PartFile&&) noexcept = default;

PartFile::~PartFile() {
    if (!state_) return;
    remove(state_->names);
    for (auto& slot : unfinished) {
        const std::array<std::string, 4>* mine = &state_->names;
        if (slot.compare_exchange_strong(mine, nullptr)) break;
    }
}

const std::string& PartFile::path() const noexcept { return state_->names[0]; }

Result<void> PartFile::put_in_place() {
    if (::rename(path().c_str(), state_->target.c_str()) != 0)
        return fail_errno("cannot put the file in place", errno, state_->asked, "choose another name");
    return {};
}

Error PartFile::told_of_file(Error error) const {
    if (error.where.starts_with(path())) error.where.replace(0, path().size(), state_->asked);
    return error;
}

void remove_unfinished() noexcept {
    for (const auto& slot : unfinished)
        if (const auto* names = slot.load()) remove(*names);
}

Result<OutputFile> OutputFile::create(const std::string& path) {
    OutputFile out(path);
    if (path == "-") return out;
    if (!is_no_file(path)) {
        auto part = PartFile::beside(path);
        if (!part) return std::unexpected(part.error());
        out.part_ = std::make_unique<PartFile>(std::move(*part));
    }
    out.file_.reset(std::fopen(out.part_ ? out.part_->path().c_str() : path.c_str(), "wbe"));
    if (!out.file_) return fail_errno("cannot write", errno, path, "choose a directory that exists and that you may write to");
    return out;
}

Result<void> OutputFile::write(std::string_view text) {
    std::FILE* to = file_ ? file_.get() : stdout;
    if (std::fwrite(text.data(), 1, text.size(), to) != text.size()) return fail_errno("cannot write", errno, path_, kNoSpace);
    return {};
}

Result<void> OutputFile::commit() {
    const bool failed = file_ ? std::fclose(file_.release()) != 0 : std::fflush(stdout) != 0;
    if (failed) return fail_errno("cannot write", errno, path_, kNoSpace);
    if (!part_) return {};
    return part_->put_in_place();
}

Result<void> write_file(const std::string& path, std::string_view text) {
    auto f = OutputFile::create(path);
    if (!f) return std::unexpected(f.error());
    if (auto ok = f->write(text); !ok) return ok;
    return f->commit();
}

}  // namespace fovea::replay
