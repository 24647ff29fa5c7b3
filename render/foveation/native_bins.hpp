// `scaled_bins` on a driver that foveates by itself: the focal points are handed to it after the latch, and the draws are
// submitted once.
//
//   view (focal points in its NDC)  ->  framebuffer or texture (focal points in NDC of the whole image)
//
// A texture as colour attachment goes through GL_QCOM_texture_foveated, everything else through GL_QCOM_framebuffer_foveated.
// Two views of one framebuffer share its focal points. A frame that wants more of them than kPointsPerView, or none, is full
// density everywhere: the extensions' own default.
// Threads: the context's. Errors: prepare() says what the driver refuses.
#pragma once

#include <vector>

#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/native_calls.hpp"
#include "render/foveation/prepared.hpp"

namespace fovea::foveation {

class NativeBins final : public Method {
public:
    static constexpr std::uint32_t kPointsPerView = 2;

    // calls: at least one of the two extensions.
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings, const NativeCalls& calls);
    ~NativeBins() override;
    [[nodiscard]] std::string_view name() const noexcept override { return "scaled_bins"; }
    [[nodiscard]] std::string_view native_extension() const noexcept override;
    [[nodiscard]] bool exact_fovea() const noexcept override { return false; }   // the extensions do not promise it
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t) const noexcept override { return nullptr; }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return view < views_.size() ? views_[view].region : Region{}; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    struct View {
        explicit View(density::Plan p) noexcept : plan(std::move(p)) {}
        density::Plan plan;           // what the driver is expected to shade
        bool by_texture = false;
        gl::Name object = 0;          // the texture or the framebuffer
        std::uint32_t layer = 0, first_point = 0;
        float width_px = 0, height_px = 0;   // of the whole image
        Region region;
    };
    NativeBins(const MethodSettings& settings, const NativeCalls& calls) : settings_(settings), calls_(calls), counter_(settings.count_fragments) {}
    [[nodiscard]] Result<void> make_views(std::span<const ViewTarget> targets);
    [[nodiscard]] Result<void> enable_texture(const View& view, const gl::ColorShape& shape, std::uint32_t points);
    [[nodiscard]] Result<void> enable_framebuffer(const View& view, std::uint32_t points);
    void set_point(const View& view, std::uint32_t point, const density::FocalPoint& p) const noexcept;

    MethodSettings settings_;
    NativeCalls calls_;
    FragmentCounter counter_;
    Prepared prepared_;
    std::vector<View> views_;
};

}  // namespace fovea::foveation
