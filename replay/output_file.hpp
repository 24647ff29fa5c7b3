// Files that are either complete or not there: written beside their name, renamed into place at the end.
//
// A symbolic link stays, and what it leads to is replaced. What is no file at all (/dev/null, a FIFO) is never replaced:
// text is written straight into it, a session is refused.
//
// Threads: each object one at a time; remove_unfinished() also from a signal handler.
// Errors: no permission, no space, a directory; the message names the path that was asked for.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace fovea::replay {

// The name beside a file under which it is written: PATH.part.
class PartFile {
public:
    [[nodiscard]] static Result<PartFile> beside(const std::string& path);
    PartFile(PartFile&&) noexcept;
    PartFile& operator=(PartFile&&) = delete;
    ~PartFile();   // without put_in_place(): removes what is there, with SQLite's files beside it

    [[nodiscard]] const std::string& path() const noexcept;
    [[nodiscard]] Result<void> put_in_place();
    // What went wrong with the part, told of the file that was asked for.
    [[nodiscard]] Error told_of_file(Error error) const;

private:
    struct State;
    explicit PartFile(std::unique_ptr<State> state) noexcept;
    friend void remove_unfinished() noexcept;
    std::unique_ptr<State> state_;
};

// Removes the unfinished files of this process (the first 8), for a program that is about to be ended by a signal.
void remove_unfinished() noexcept;

class OutputFile {
public:
    // `path` "-" is standard output.
    [[nodiscard]] static Result<OutputFile> create(const std::string& path);
    OutputFile(OutputFile&&) noexcept = default;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile() = default;   // without commit() the unfinished file is removed

    [[nodiscard]] Result<void> write(std::string_view text);
    [[nodiscard]] Result<void> commit();

private:
    struct Close {
        void operator()(std::FILE* f) const noexcept { std::fclose(f); }
    };
    explicit OutputFile(std::string path) noexcept : path_{std::move(path)} {}

    std::string path_;
    std::unique_ptr<PartFile> part_;          // null for standard output, and for what is no file
    std::unique_ptr<std::FILE, Close> file_;  // null for standard output, and after commit()
};

// The whole text at once.
[[nodiscard]] Result<void> write_file(const std::string& path, std::string_view text);

}  // namespace fovea::replay
