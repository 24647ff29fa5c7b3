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

class MotionSearch {
public:
    void resize(int width_px, int height_px, int cell_px, int threads);

    [[nodiscard]] int levels() const noexcept { return static_cast<int>(near_.size()); }
    [[nodiscard]] int cell_px() const noexcept { return cell_px_; }
    [[nodiscard]] Plane& near_luma(int level = 0) noexcept { return near_[static_cast<std::size_t>(level)]; }
    [[nodiscard]] Plane& far_luma(int level = 0) noexcept { return far_[static_cast<std::size_t>(level)]; }

    // What may move, by the comparison: call first. Returns what has to be filled of the lumas of level 0, with a gaze of level 1, in
    // tiles; what lies outside of it is not read.
    [[nodiscard]] Box begin(const TileMap& tiles, bool foveated) noexcept;
    // From the two lumas of level 0 (already filled, with padding).
    void run(const Tuning& tuning, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept;
    [[nodiscard]] const Field& field() const noexcept { return forward_[0]; }
    // Per cell of field(): 1, or less where the way back contradicts it. Of the last run with a way back.
    [[nodiscard]] const std::vector<float>& trust() const noexcept { return trust_; }
    // Everything outside of it stands still.
    [[nodiscard]] const Box& active() const noexcept { return active_; }
    // Of the textured blocks, how many nothing explains; above kCutFraction the two sources do not belong together.
    [[nodiscard]] float unexplained_fraction() const noexcept { return unexplained_; }

    // With a gaze the finest level exists only around it, and all else goes on in the cells of level 1: searched there inside the
    // coarse radius, and beyond it as level 2 found.
    struct Fovea {
        Box box;         // cells of level 0, whole blocks of kFoveaBlock: what moves there is searched to the finest level
        Box searched;    // cells of level 1: searched to that level
    };
    static constexpr int kFoveaBlock = 16;
    // False: there is too little outside of the gaze to save anything, or the gaze is no number.
    [[nodiscard]] bool fovea(const Gaze& gaze, Fovea& out) const noexcept;
    // First from the two lumas of level 1: all but the finest level. Returns what has to be filled of the lumas of level 0, in tiles.
    [[nodiscard]] Box run_coarse(const Fovea& fovea, const Tuning& tuning, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept;
    // Then the finest. `step`: how far the motion will be carried on, frame times; what may come into the fovea from outside then
    // has a motion in cells of level 0 too.
    void run_fine(const Fovea& fovea, float step, const Tuning& tuning, const TileMap& tiles, const Kernels& kernels, ThreadPool& pool) noexcept;
    [[nodiscard]] const Field& coarse_field() const noexcept { return forward_[forward_.size() > 1 ? 1 : 0]; }
    [[nodiscard]] Box coarse_active() const noexcept;
    // Cells of level 0 that have a motion.
    [[nodiscard]] const Box& fine() const noexcept { return fine_; }

private:
    void levels_below(std::vector<Plane>& planes, std::size_t first, const Kernels& kernels, ThreadPool& pool) noexcept;
    static void extend(Plane& p, const Box& part) noexcept;
    [[nodiscard]] Box part_at(int level) const noexcept;
    void find_active(const TileMap& tiles) noexcept;
    [[nodiscard]] int backward_from(const Tuning& tuning) const noexcept;
    [[nodiscard]] Box active_at(int level) const noexcept;
    [[nodiscard]] Box moving(const Box& part, const TileMap& tiles) const noexcept;
    void go_on(const Box& around, const Box& searched, int level, bool backward) noexcept;
    [[nodiscard]] Box patches_of(const Box& box, int level) const noexcept;
    void choose_tasks(const Box& searched, const TileMap& tiles, int level) noexcept;
    void spread_coarse(std::vector<Field>& fields, const Box& may, const Box& searched, int level) noexcept;
    void search_level(const Box& box, const Box& around, int level, bool backward, const Tuning& tuning, const Kernels& kernels, ThreadPool& pool) noexcept;
    void check_backward(const Box& box, const Box& read, int level) noexcept;
    void smooth(const Box& box, const TileMap& tiles, int passes, const Kernels& kernels, ThreadPool& pool) noexcept;
    void validate(const TileMap& tiles, const Box* fovea) noexcept;
    static void clear(Field& f, const Box& box) noexcept;
    static void stand_still(Field& f, const Box& box, int cell_px, const TileMap& tiles) noexcept;

    int width_px_ = 0, height_px_ = 0, cell_px_ = 0;
    std::vector<Plane> near_, far_;
    std::vector<Field> forward_, backward_;
    std::vector<PatchMotion> patches_;
    std::vector<std::uint8_t> tasks_;
    std::vector<float> trust_, spread_scratch_;
    int threads_ = 1;
    Field smoothed_;
    float unexplained_ = 0;
    std::vector<Box> written_[2];   // of each level, forward and backward: everything outside of it is 0
    // Luma is made of the part only up to cells of this size; a patch of smaller cells, and what may pull at it, reaches 13 cells beyond
    // what moves, which is less than kAroundTiles.
    static constexpr int kPartPx = 8;
    static_assert(13 * kPartPx / 2 <= kAroundTiles * kTilePx);
    Box part_;     // tiles
    Box filled_;   // of the finest luma
    float most_ = 0;   // of level 1, with a gaze: its largest motion
    Box box_, fine_;   // cells of level 0, with a gaze: searched there; what has a motion
    Box active_;   // cells of the finest level, whole tiles
};

inline constexpr float kCutFraction = 0.6f;

}  // namespace fovea::render::extrapolation
