// The files that a command writes when its work is done, opened before it begins: what cannot be written is said at once,
// not after minutes.
//
// Each file is complete or not there (replay/output_file.hpp). A path "" is no file.
// Errors: those of OutputFile; one path for two files.
#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "replay/output_file.hpp"

namespace fovea::tools {

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
