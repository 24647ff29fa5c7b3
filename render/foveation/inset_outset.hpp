// `inset_outset`: two wide and two narrow views, composed into the picture (Arm).
//
//   wide (outset), ratio of the pixels     narrow (inset), 1:1 with the picture      composed
//   +-----------+                            .---.                                    +-----------+
//   |    __     |  hole: what the inset     /     \  circle: what is used of it       |   (##)    |  smoothstep between
//   |   (  )    |  covers is not shaded     \     /  follows the gaze by translation  |           |  them over blend_px
//   +-----------+                            '---'   of the projection                +-----------+
//
// Source: Arm white paper 2017: FOV_inset = 2 atan(tan(FOV / 2) ratio), masks, blending, contrast. Defaults: ratio 0.5 (the
// paper's suggestion for quality), blend 100 px (the paper's).
// The inset is drawn through an offset projection: its pixels equal a full render's up to the rounding of interpolation,
// so exact_fovea() is false.
// All four views are one submission where the driver draws several views at once (view_images.hpp), else two a view.
// Cost: MSAA on all four views; the driver's maximum limits it.
#pragma once

#include <optional>
#include <vector>

#include "render/foveation/cpu_resolve.hpp"
#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/prepared.hpp"
#include "render/foveation/view_images.hpp"

namespace fovea::foveation {

class InsetOutset final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return "inset_outset"; }
    [[nodiscard]] bool exact_fovea() const noexcept override { return false; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t) const noexcept override { return nullptr; }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override;
    [[nodiscard]] gl::ViewsAtOnce views_at_once() const noexcept override { return images_.at_once(); }
    [[nodiscard]] double outside_scale() const noexcept override { return settings_.inset_outset.ratio; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    using Image = ViewImages::Image;
    struct View {
        Image outset, inset;
        double x_px = 0, y_px = 0;       // the inset's middle, whole-picture pixels
        int left_px = 0, bottom_px = 0;  // of the inset's image in the picture; may be negative
        Region region;
        std::optional<density::Plan> enlarging;   // set: the outset is enlarged on the processor, by this plan
    };

    explicit InsetOutset(const MethodSettings& settings) : settings_(settings), counter_(settings.count_fragments) {}
    [[nodiscard]] std::optional<density::Plan> enlarging_plan(const View& view, const ViewTarget& target, const gl::FramebufferShape& shape) const;
    [[nodiscard]] Result<void> make_views(std::span<const ViewTarget> targets);
    void place(View& view, const ViewTarget& target, const ViewFocus& focus) const noexcept;
    void begin_image(const Image& image, const gl::Clear& clear, bool closed) const noexcept;
    void mask_disc(const Image& image, double x_px, double y_px, double rx_px, double ry_px, bool open) const noexcept;
    void end_masks() const noexcept;
    [[nodiscard]] std::uint64_t begin_outset(const View& view, const ViewTarget& target, const gl::Clear& clear) const noexcept;
    [[nodiscard]] std::uint64_t begin_inset(const View& view, const ViewTarget& target, const gl::Clear& clear, ViewImages::View& drawn) const noexcept;
    void compose(const View& view, const ViewTarget& target, const gl::FramebufferShape& shape) noexcept;

    MethodSettings settings_;
    FragmentCounter counter_;
    CpuResolve cpu_resolve_;
    bool depth_mask_ = false;
    gl::Program disc_, far_, near_;
    gl::VertexArray arrays_;
    Prepared prepared_;
    ViewImages::Settings images_wanted_;
    ViewImages images_;                     // all outsets, then all insets
    int samples_ = 0;                       // that they have
    std::vector<ViewImages::View> draw_;    // likewise
    std::vector<View> views_;
};

}  // namespace fovea::foveation
