// What the contexts of one share group have in common for the layer: foveated textures, and what the sources of their
// programs say.
// Threads: every member locks itself. Errors: none.
#pragma once

#include <mutex>
#include <unordered_map>
#include <utility>

#include "render/layer/auto_mode.hpp"
#include "render/layer/foveation_state.hpp"

namespace fovea::layer {

class ProgramSources {
public:
    struct Entry {
        SourceFacts facts;
        ProgramReport* report = nullptr;
    };
    void linked(GLuint program, SourceFacts facts) {
        Entry entry{std::move(facts), nullptr};
        entry.report = new_program_report(entry.facts.shader.empty() ? "program " + std::to_string(program) : entry.facts.shader);
        const std::lock_guard lock(mutex_);
        programs_[program] = std::move(entry);
    }
    // A program that was never seen linked has facts that are not known, and a report of its own from now on.
    [[nodiscard]] Entry get(GLuint program) {
        {
            const std::lock_guard lock(mutex_);
            if (const auto it = programs_.find(program); it != programs_.end()) return it->second;
        }
        linked(program, {});
        const std::lock_guard lock(mutex_);
        return programs_[program];
    }

private:
    std::mutex mutex_;
    std::unordered_map<GLuint, Entry> programs_;
};

struct ShareGroup {
    TextureFoveations textures;
    ProgramSources sources;
};

}  // namespace fovea::layer
