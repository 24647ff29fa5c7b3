// The files that a command writes when its work is done, opened before it begins: what cannot be written is said at once,
// not after minutes.
//
// Each file is complete or not there (replay/output_file.hpp). A path "" is no file.
// Errors: those of OutputFile; one path for two files.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "replay/output_file.hpp"

namespace fovea::tools {

// A file that is read must not be written as well, under whatever name: the recording would be gone. Names "" and "-" are
// no files.
[[nodiscard]] inline Result<void> keep_inputs(std::initializer_list<std::string> inputs, std::initializer_list<std::string> outputs) {
    std::error_code none;
    for (const std::string& in : inputs)
        for (const std::string& out : outputs)
            if (!in.empty() && std::filesystem::equivalent(in, out, none)) return fail("input and output are the same file", out, "choose another name for the output");
    return {};
}

class Outputs {
public:
    [[nodiscard]] static Result<Outputs> open(std::initializer_list<std::string> paths) {
        Outputs all;
        for (const std::string& path : paths) {
            if (path.empty()) continue;
            if (all.files_.contains(path)) return std::unexpected(Error{"two outputs would be one file", path, "give each a name of its own"});
            auto file = replay::OutputFile::create(path);
            if (!file) return std::unexpected(file.error());
            all.files_.emplace(path, std::move(*file));
        }
        return all;
    }

    // The whole text of one of the paths.
    [[nodiscard]] Result<void> put(const std::string& path, std::string_view text) {
        if (path.empty()) return {};
        replay::OutputFile& file = files_.at(path);
        if (auto ok = file.write(text); !ok) return ok;
        return file.commit();
    }

private:
    Outputs() = default;
    std::map<std::string, replay::OutputFile> files_;
};

}  // namespace fovea::tools
