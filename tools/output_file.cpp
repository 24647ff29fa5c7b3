#include "tools/output_file.hpp"

#include <cerrno>

#include <unistd.h>

namespace fovea::tools {

Result<OutputFile> OutputFile::create(const std::string& path) {
    if (path == "-") return OutputFile(path, {}, nullptr);
    std::string partial = path + ".partial";
    std::FILE* file = std::fopen(partial.c_str(), "wb");
    if (!file) return fail_errno("cannot write", errno, path, "choose a directory that exists and that you may write to");
    return OutputFile(path, std::move(partial), file);
}

OutputFile::~OutputFile() {
    if (!file_) return;
    file_.reset();
    ::unlink(partial_.c_str());
}

Result<void> OutputFile::write(std::string_view text) {
    std::FILE* to = file_ ? file_.get() : stdout;
    if (std::fwrite(text.data(), 1, text.size(), to) != text.size()) return fail_errno("cannot write", errno, path_, "free some space");
    return {};
}

Result<void> OutputFile::commit() {
    if (!file_) {
        if (std::fflush(stdout) != 0) return fail_errno("cannot write", errno, path_);
        return {};
    }
    if (std::fflush(file_.get()) != 0) return fail_errno("cannot write", errno, path_, "free some space");
    file_.reset();
    if (std::rename(partial_.c_str(), path_.c_str()) != 0) {
        const int code = errno;
        ::unlink(partial_.c_str());
        return fail_errno("cannot write", code, path_, "choose another name");
    }
    return {};
}

Result<void> write_file(const std::string& path, std::string_view text) {
    auto f = OutputFile::create(path);
    if (!f) return std::unexpected(f.error());
    if (auto ok = f->write(text); !ok) return ok;
    return f->commit();
}

}  // namespace fovea::tools
