// Counts the GL calls of this process by name, through libepoxy's function pointers.
//
// Threads: the context's. Counting is on from the first use until the process ends; the calls do what they always do.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fovea::test {

struct GlCalls {
    std::map<std::string, std::uint64_t> by_name;   // those that were called at all
    std::vector<std::string> shaders;               // sources given to glShaderSource
    [[nodiscard]] std::uint64_t of(const std::string& name) const;
    // Of all names that begin so.
    [[nodiscard]] std::uint64_t of_all(const std::string& beginning) const;
    [[nodiscard]] bool any_shader_has(const std::string& text) const;
};

// The calls that are made by `what`.
template <class What>
[[nodiscard]] GlCalls calls_of(What&& what);
// Those since the last call of this.
[[nodiscard]] GlCalls take_gl_calls();
// Every name that is counted.
[[nodiscard]] std::vector<std::string> counted_gl_calls();

template <class What>
GlCalls calls_of(What&& what) {
    static_cast<void>(take_gl_calls());
    what();
    return take_gl_calls();
}

}  // namespace fovea::test
