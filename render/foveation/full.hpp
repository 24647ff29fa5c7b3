// `full`: every view at full resolution, one submission each. What the others are compared with.
#pragma once

#include "render/foveation/fragment_counter.hpp"
#include "render/foveation/method.hpp"
#include "render/foveation/prepared.hpp"

namespace fovea::foveation {

class Full final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return "full"; }
    [[nodiscard]] bool exact_fovea() const noexcept override { return true; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t) const noexcept override { return nullptr; }
    [[nodiscard]] std::uint64_t counted_fragments() override { return counter_.read(); }

private:
    explicit Full(const MethodSettings& settings) : counter_(settings.count_fragments) {}
    FragmentCounter counter_;
    Prepared prepared_;
};

// One view, whole, into its target: the building block of Full and of every fallback to it. shape: of the target, where it is
// known; only needed for integer attachments.
void submit_full_view(const gl::CommandList& draws, std::uint32_t view, const ViewTarget& target, bool count, FrameCost& cost,
                      const gl::FramebufferShape* shape = nullptr) noexcept;
// Only the clear of the view.
void clear_view(const gl::Clear& clear, const ViewTarget& target, const gl::FramebufferShape* shape = nullptr) noexcept;
// What is asked for of the framebuffer that is bound, inside the scissor; stencil: also that, to 0.
void clear_bound(const gl::Clear& clear, const gl::FramebufferShape* shape, bool color, bool stencil) noexcept;

}  // namespace fovea::foveation
