// `shading_rate` on a driver that shades at several rates by itself.
//
//   GL_EXT_fragment_shading_rate   the map becomes an attachment of the app's framebuffer; the draws are submitted once
//   GL_QCOM_shading_rate           one rate for each draw: the draws are submitted once per rate that the map uses, each time
//                                  in the stencil mask of its tiles, all straight into the app's framebuffer
//
// The map is made after the latch, by the processor or by the compute shader; the shader's goes into the attachment without
// passing through the processor.
// Threads: the context's. Errors: prepare() says what does not fit: views that do not begin on a tile.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/native_calls.hpp"
#include "render/foveation/prepared.hpp"
#include "render/foveation/rate_map.hpp"

namespace fovea::foveation {

class NativeRates final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings, const NativeCalls& calls);
    ~NativeRates() override;
    [[nodiscard]] std::string_view name() const noexcept override { return "shading_rate"; }
    [[nodiscard]] std::string_view native_extension() const noexcept override {
        return calls_.rate_attachment ? "GL_EXT_fragment_shading_rate" : "GL_QCOM_shading_rate";
    }
    [[nodiscard]] bool exact_fovea() const noexcept override { return true; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t) const noexcept override { return nullptr; }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return view < views_.size() ? views_[view].region : Region{}; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    struct View {
        density::RateInput input;            // of the map that is there
        std::vector<std::uint8_t> rates;     // made by the processor; by tile
        std::optional<RateMap> map;          // made by the shader
        std::optional<density::Plan> tiles;  // per draw: the tiles of each rate
        gl::Buffer rectangles;               // per draw: vec4 NDC by level
        gl::VertexArray arrays;
        std::size_t attachment = 0;          // index of attachments_
        std::uint64_t pixels = 0;            // shaded, without overdraw
        Region region;
    };
    struct Attachment {
        gl::Name framebuffer = 0;
        gl::Texture rates;                   // R8UI, one texel a tile
    };
    NativeRates(const MethodSettings& settings, const NativeCalls& calls) : settings_(settings), calls_(calls), counter_(settings.count_fragments) {}
    [[nodiscard]] Result<void> make_views(std::span<const ViewTarget> targets);
    [[nodiscard]] Result<void> make_attachment(View& view, const ViewTarget& target, const gl::FramebufferShape& shape);
    [[nodiscard]] Result<void> make_mask(View& view, const ViewTarget& target, const gl::FramebufferShape& shape);
    void detach() noexcept;
    void make_map(View& view, const ViewTarget& target, const ViewFocus& focus) noexcept;
    void draw_by_attachment(const View& view, std::uint32_t index, const ViewTarget& t, const gl::FramebufferShape& shape, const gl::CommandList& draws, FrameCost& cost) noexcept;
    void draw_by_rates(View& view, std::uint32_t index, const ViewTarget& t, const gl::FramebufferShape& shape, const gl::CommandList& draws, FrameCost& cost) noexcept;

    MethodSettings settings_;
    NativeCalls calls_;
    FragmentCounter counter_;
    gl::Program mask_;
    Prepared prepared_;
    std::vector<Attachment> attachments_;
    std::vector<View> views_;
    std::vector<std::array<float, 4>> staging_;
};

}  // namespace fovea::foveation
