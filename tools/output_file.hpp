// A text file that is either complete or not there: written beside its name, renamed into place at the end.
//
// Threads: one at a time. Errors: no permission, no space; the message names the path.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace fovea::tools {

class OutputFile {
public:
    // `path` "-" is standard output.
    [[nodiscard]] static Result<OutputFile> create(const std::string& path);
    OutputFile(OutputFile&&) noexcept = default;
    OutputFile& operator=(OutputFile&&) = delete;
    // Without commit() the unfinished file is removed.
    ~OutputFile();

    [[nodiscard]] Result<void> write(std::string_view text);
    [[nodiscard]] Result<void> commit();

private:
    struct Close {
        void operator()(std::FILE* f) const noexcept { std::fclose(f); }
    };
    OutputFile(std::string path, std::string partial, std::FILE* file) noexcept
        : path_{std::move(path)}, partial_{std::move(partial)}, file_{file} {}

    std::string path_, partial_;              // partial_ is empty for standard output
    std::unique_ptr<std::FILE, Close> file_;  // null for standard output, and after commit()
};

// The whole text at once.
[[nodiscard]] Result<void> write_file(const std::string& path, std::string_view text);

}  // namespace fovea::tools
