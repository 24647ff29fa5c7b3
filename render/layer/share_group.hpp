// What the contexts of one share group have in common for the layer: foveated textures, and what the sources of their
// programs say.
// Threads: every member locks itself. Errors: none.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "render/layer/auto_mode.hpp"
#include "render/layer/entry_points.hpp"
#include "render/layer/foveation_state.hpp"
#include "render/layer/graveyard.hpp"

namespace fovea::layer {

class ProgramSources {
public:
    struct Entry {
        SourceFacts facts;
        ProgramReport* report = nullptr;
        int num_views = 0;  // declared by its vertex shader; 0: not, which counts as 1
    };
    void linked(GLuint program, SourceFacts facts, int num_views = 0) {
        Entry entry{std::move(facts), nullptr, num_views};
        if (num_views > 0) engage(), any_multiview_.store(true, std::memory_order_relaxed);  // the lock below orders it for who looks a program up
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

    // Shaders whose source was rewritten for the driver (multiview_source.hpp).
    struct Shader {
        std::string original;
        int num_views = 0;
    };
    void set_shader(GLuint shader, std::string original, int num_views);
    void forget_shader(GLuint shader);
    [[nodiscard]] std::optional<Shader> shader(GLuint name) const;
    [[nodiscard]] bool any_multiview_shader() const {
        const std::lock_guard lock(mutex_);
        return !shaders_.empty();
    }
    [[nodiscard]] bool any_multiview() const noexcept { return any_multiview_.load(std::memory_order_relaxed); }

private:
    mutable std::mutex mutex_;
    std::unordered_map<GLuint, Shader> shaders_;
    std::atomic<bool> any_multiview_{false};
    std::unordered_map<GLuint, Entry> programs_;
};

// Names of deleted buffers whose objects a vertex array may still hold (vertex_arrays.cpp).
class DeletedBuffers {
public:
    enum class Held { nowhere, perhaps_elsewhere, perhaps };  // elsewhere: by an array of another context than the one that deletes
    void note(GLuint name, Held held, const void* context) {
        const std::lock_guard lock(mutex_);
        if (held == Held::nowhere)
            names_.erase(name);
        else
            names_[name] = held == Held::perhaps_elsewhere ? context : nullptr;
        any_.store(!names_.empty(), std::memory_order_relaxed);  // the lock orders it for who looks a name up
    }
    [[nodiscard]] bool any() const noexcept { return any_.load(std::memory_order_relaxed); }
    [[nodiscard]] bool has(GLuint name, const void* context) const {
        if (name == 0) return false;
        const std::lock_guard lock(mutex_);
        const auto it = names_.find(name);
        return it != names_.end() && it->second != context;
    }

private:
    mutable std::mutex mutex_;
    std::unordered_map<GLuint, const void*> names_;  // the context whose arrays do not hold it, if that is known
    std::atomic<bool> any_{false};
};

struct ShareGroup {
    TextureFoveations textures;
    DeletedBuffers deleted_buffers;
    ProgramSources sources;
    Graveyard dead;
};

}  // namespace fovea::layer
