// `auto`: foveated where it pays, in full where it does not, by what the frames really cost.
//
//   foveated <----> full       every `interval` frames one frame is drawn the other way; two trials in a row that are
//                              cheaper by the hysteresis switch. The interval doubles while nothing changes, so that
//                              trying costs next to nothing (2.2 times the cost in 1 of 512 frames: 0.2 %).
//
// Threads: the context's. noexcept, no allocation per frame.
#pragma once

#include <array>

#include "render/foveation/method.hpp"

namespace fovea::foveation {

// The decision alone: which of two ways the next frame is drawn, given what the last ones cost.
class ExecutorChoice {
public:
    enum Way : std::uint8_t { foveated = 0, full = 1 };
    [[nodiscard]] Way next() const noexcept { return trial_ ? other(settled_) : settled_; }
    [[nodiscard]] Way settled() const noexcept { return settled_; }
    // The cost of the frame drawn as next() said. Zero and negative costs are ignored.
    void observe(Duration cost) noexcept;

    static constexpr double kHysteresis = 0.05;     // the other way must save this much
    static constexpr int kFirstInterval = 16, kLastInterval = 512;   // frames between trials
    static constexpr int kConfirmations = 2;

private:
    [[nodiscard]] static Way other(Way w) noexcept { return w == foveated ? full : foveated; }
    Way settled_ = foveated;
    bool trial_ = false;
    std::array<bool, 2> warm_{};             // a way's first frame compiles shaders: it does not count
    std::array<double, 5> recent_{};         // costs of the settled way, seconds; their median is compared
    std::size_t count_ = 0;
    int since_trial_ = 0, interval_ = kFirstInterval, wins_ = 0;
};

class Auto final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return "auto"; }
    [[nodiscard]] std::string_view executor() const noexcept override { return chosen().name(); }
    [[nodiscard]] bool exact_fovea() const noexcept override { return true; }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    void observe(Duration cost) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t view) const noexcept override { return drawn_->plan(view); }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return drawn_->full_region(view); }
    [[nodiscard]] std::uint64_t counted_fragments() override { return drawn_->counted_fragments(); }

private:
    Auto(std::unique_ptr<Method> foveated, std::unique_ptr<Method> full) noexcept
        : methods_{std::move(foveated), std::move(full)}, drawn_(methods_[0].get()) {}
    [[nodiscard]] Method& chosen() const noexcept { return *methods_[foveation_possible_ ? choice_.next() : ExecutorChoice::full]; }
    std::array<std::unique_ptr<Method>, 2> methods_;   // by ExecutorChoice::Way
    ExecutorChoice choice_;
    Method* drawn_;                     // what the last frame was drawn with
    bool foveation_possible_ = true;    // its targets could be had
};

}  // namespace fovea::foveation
