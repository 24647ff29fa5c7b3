// Motion between the two sources, per cell: where each cell of the nearer source is in the farther one.
//
//   luma levels, near and far         search + spread, from the coarsest to level 0
//   level 2   level 1   level 0       near -> far always; far -> near down to `backward_level`, to find what was covered
//
// Output: cells of cell_px pixels; u, v in cells, far position - near position.
#pragma once

#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/sources.hpp"
#include "render/extrapolation/tuning.hpp"

namespace fovea::render::extrapolation {

struct MotionSettings {
    Tuning tuning;
    const Gaze* gaze = nullptr;
};

class MotionSearch {
public:
    void resize(int width_px, int height_px, int cell_px, int threads);

    [[nodiscard]] Plane& near_luma() noexcept { return near_[0]; }
    [[nodiscard]] Plane& far_luma() noexcept { return far_[0]; }
    [[nodiscard]] int levels() const noexcept { return static_cast<int>(near_.size()); }
    [[nodiscard]] int cell_px() const noexcept { return cell_px_; }

    // From the two lumas (already filled, with padding).
    void run(const MotionSettings& settings, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept;

    [[nodiscard]] const Field& field() const noexcept { return forward_[0]; }
    // Everything outside of it stands still.
    [[nodiscard]] const Box& active() const noexcept { return active_; }
    // Of the textured blocks, how many nothing explains; above kCutFraction the two sources do not belong together.
    [[nodiscard]] float unexplained_fraction() const noexcept { return unexplained_; }

private:
    void levels_below(std::vector<Plane>& planes, const Kernels& kernels, ThreadPool& pool) noexcept;
    void find_anchors(const TileMap& tiles) noexcept;
    [[nodiscard]] Box effort(const Gaze* gaze, int level) const noexcept;
    [[nodiscard]] Box patches_of(const Box& box, int level) const noexcept;
    void choose_tasks(const Box& searched, const TileMap& tiles, int level) noexcept;
    void spread_coarse(std::vector<Field>& fields, const Box& searched, int level) noexcept;
    void search_level(const Box& box, int level, bool backward, const Tuning& tuning, const Kernels& kernels, ThreadPool& pool) noexcept;
    void check_backward(const Box& box, int level) noexcept;
    void smooth(const Box& box, const TileMap& tiles, int passes, const Kernels& kernels, ThreadPool& pool) noexcept;
    void validate(const TileMap& tiles) noexcept;

    int width_px_ = 0, height_px_ = 0, cell_px_ = 0;
    std::vector<Plane> near_, far_;
    std::vector<Field> forward_, backward_;
    std::vector<PatchMotion> patches_;
    std::vector<std::uint8_t> tasks_;
    std::vector<std::uint8_t> anchors_;   // per tile: still, and textured enough to know it
    std::vector<float> trust_, spread_scratch_;
    int threads_ = 1;
    Field smoothed_;
    float unexplained_ = 0;
    Box written_[2];   // of the finest level, forward and backward: everything outside of it is 0
    Box active_;   // cells of the finest level, whole tiles
};

inline constexpr float kCutFraction = 0.6f;

}  // namespace fovea::render::extrapolation
