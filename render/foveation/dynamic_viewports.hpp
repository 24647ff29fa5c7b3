// `dynamic_viewports`: one atlas for normal and for foveated rendering; with a gaze, a coarse view of everything and a sharp
// one around it; without, the normal viewports from that frame on (Varjo).
//
//   no gaze: normal viewports             gaze: foveated viewports of the same atlas
//   +-----------+-----------+             +----+----+--------------+
//   |   left    |   right   |             | cL | cR |   context    |
//   |           |           |             +----+----+              |
//   |           |           |             | fL | fR |   focus      |
//   +-----------+-----------+             +----+----+--------------+
//
// Gaze lost or not calibrated is ViewFocus::count == 0 (or a focal point that is no number): the status event of the API.
// The focus view's pixels are the picture's, up to the rounding of interpolation: exact_fovea() is false.
// Source: Varjo foveated rendering API, dynamic viewports.
#pragma once

#include <vector>

#include "render/density/dynamic_viewports.hpp"
#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/prepared.hpp"

namespace fovea::foveation {

class DynamicViewports final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return "dynamic_viewports"; }
    [[nodiscard]] bool exact_fovea() const noexcept override { return false; }
    [[nodiscard]] bool wants_gaze_status() const noexcept override { return true; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t) const noexcept override { return nullptr; }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return view < regions_.size() ? regions_[view] : Region{}; }
    [[nodiscard]] double outside_scale() const noexcept override { return settings_.dynamic_viewports.context_scale; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    [[nodiscard]] Result<void> make_places(std::span<const ViewTarget> targets);
    // Where one view is drawn: a viewport of the atlas, or a target of its own.
    struct Place {
        const gl::RenderTarget* target = nullptr;
        density::Viewport viewport;
    };
    explicit DynamicViewports(const MethodSettings& settings) : settings_(settings), counter_(settings.count_fragments) {}
    void draw(const Place& place, const gl::CommandList& draws, std::uint32_t view, const std::array<float, 4>& crop, const gl::Box& box,
              FrameCost& cost) noexcept;
    void compose(const Place& context, const Place& focus, const ViewTarget& target, int focus_x, int focus_y) noexcept;

    MethodSettings settings_;
    FragmentCounter counter_;
    gl::Program compose_;
    gl::VertexArray arrays_;
    Prepared prepared_;
    gl::RenderTarget atlas_;
    std::vector<gl::RenderTarget> own_;                    // separate targets instead: contexts, then focuses, then normal ones
    std::vector<Place> normal_, context_, focus_;          // by view
    std::vector<Region> regions_;
};

}  // namespace fovea::foveation
