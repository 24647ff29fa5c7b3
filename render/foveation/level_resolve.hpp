// Fills the bins outside level 0 from their levels: on the processor where that is cheaper and possible (cpu_resolve.hpp),
// else by textured rectangles (bin_resolve.hpp).
//
// Threads: the context's. Errors: a shader that does not build. run() is noexcept and does not allocate.
#pragma once

#include "render/foveation/bin_resolve.hpp"
#include "render/foveation/bins_view.hpp"
#include "render/foveation/cpu_resolve.hpp"

namespace fovea::foveation {

class LevelResolve {
public:
    // The usual programs, so that a driver which cannot build them says so now.
    [[nodiscard]] static Result<LevelResolve> create(const MethodSettings& settings);
    // Which way a view is resolved, and what that needs. separate_depth: depth is put back by a pass of its own.
    [[nodiscard]] Result<void> prepare(BinsView& view, const ViewTarget& target, bool separate_depth);
    // The bins of `view` outside level 0, from the levels of `from`. Leaves the scissor off and the framebuffer changed.
    void run(const BinsView& view, const BinsView& from, const ViewTarget& target, bool color, bool depth) noexcept;

private:
    LevelResolve() = default;
    static void on_gpu(const BinsView& view, const BinsView& from, const ViewTarget& target, gl::Name program, bool color, bool depth) noexcept;

    gl::Filter filter_ = gl::Filter::linear;
    Resolver resolver_ = Resolver::automatic;
    bool with_depth_ = false;
    int threads_ = 0;
    BinResolve programs_;
    CpuResolve processor_;
};

}  // namespace fovea::foveation
