// The executor that draws the fovea last: levels 1.. before the gaze is latched, level 0 after it.
//
//   before the latch   levels 1.., each in a box that leaves room for the gaze to move, and their resolve
//   after it           level 0 over the finished picture, in a mask that clears only what it draws; then, where it is wanted,
//                      the depth of what is left of the early levels
//
// Bins that need more than what lies under them become level 0, so the density is never below the equation's.
// Threads: the context's. Errors: targets or shaders that could not be had. early() and late() are noexcept, no allocation.
#pragma once

#include <array>
#include <vector>

#include "render/foveation/bins_planner.hpp"
#include "render/foveation/level_masks.hpp"
#include "render/foveation/level_resolve.hpp"

namespace fovea::foveation {

class LateFovea {
public:
    // What it draws with; belongs to the method.
    struct Tools {
        const MethodSettings& settings;
        const BinsPlanner& planner;
        LevelMasks& masks;
        LevelResolve& resolve;
        bool count_fragments = false;
    };
    void clear() noexcept;
    // One more view: `view` is the method's, without levels, and gets what late() needs.
    [[nodiscard]] Result<void> add(const Tools& tools, BinsView& view, const ViewTarget& target);
    void early(const Tools& tools, std::span<BinsView> views, const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept;
    [[nodiscard]] bool early_done() const noexcept { return done_; }
    void forget_early() noexcept { done_ = false; }
    // The cost is that of both halves.
    void late(const Tools& tools, std::span<BinsView> views, const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus,
              FrameCost& cost) noexcept;

private:
    using Boxes = std::array<density::BinRect, density::kMaxLevels>;
    void late_depth(const Tools& tools, const BinsView& view, std::size_t v, const ViewTarget& target) noexcept;

    std::vector<BinsView> early_;
    std::vector<Boxes> boxes_;              // in which the early levels are, by view
    // With resolve_depth: what of the early levels is left to be seen once level 0 is drawn; one view each, without levels.
    std::vector<BinsView> rest_;
    std::vector<std::uint8_t> rest_levels_;
    FrameCost cost_;
    bool done_ = false;
};

}  // namespace fovea::foveation
