// `auto`: foveated where it pays, in full where it does not, by what the frames really cost; `auto_late` may also draw the
// fovea after the latch, where that costs little more.
//
//   foveated <----> full       every `interval` frames one frame is drawn another way; two trials in a row that are
//       ^            ^         cheaper by the hysteresis switch. The interval doubles while nothing changes, so that
//       +--> late <--+         trying costs next to nothing (2.2 times the cost in 1 of 512 frames: 0.2 %).
//
// The cost of a late frame counts 1 / (1 + allowance): its gain, a shorter way from latch to photon, is not in it.
// Threads: the context's. noexcept, no allocation per frame.
#pragma once

#include <array>

#include "render/foveation/method.hpp"

namespace fovea::foveation {

// The decision alone: which way the next frame is drawn, given what the last ones cost.
class ExecutorChoice {
public:
    enum Way : std::uint8_t { foveated = 0, full = 1, late = 2 };
    // late_allowance: how much more than the others a late frame may cost, 0 to 10; 0: late is no choice.
    explicit ExecutorChoice(double late_allowance = 0) noexcept : ways_(late_allowance > 0 ? 3 : 2), late_weight_(1 / (1 + late_allowance)) {}
    [[nodiscard]] Way next() const noexcept { return trial_ ? candidate_ : settled_; }
    [[nodiscard]] Way settled() const noexcept { return settled_; }
    // The cost of the frame drawn as next() said. Zero and negative costs are ignored.
    void observe(Duration cost) noexcept;

    static constexpr double kHysteresis = 0.05;     // the other way must save this much
    static constexpr int kFirstInterval = 16, kLastInterval = 512;   // frames between trials
    static constexpr int kConfirmations = 2;

private:
    void choose_candidate() noexcept;
    int ways_;
    double late_weight_;
    Way settled_ = foveated, candidate_ = full;
    bool trial_ = false;
    std::array<bool, 3> warm_{};             // a way's first frame compiles shaders: it does not count
    std::array<double, 5> recent_{};         // weighted costs of the settled way, seconds; their median is compared
    std::size_t count_ = 0;
    int since_trial_ = 0, interval_ = kFirstInterval, wins_ = 0;
};

class Auto final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_late(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return methods_[ExecutorChoice::late] ? "auto_late" : "auto"; }
    // Of the next frame: it changes only in observe() and prepare().
    [[nodiscard]] bool late_fovea() const noexcept override { return chosen().late_fovea(); }
    void submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept override {
        chosen().submit_early(draws, targets, focus);
    }
    [[nodiscard]] std::string_view executor() const noexcept override { return chosen().name(); }
    [[nodiscard]] std::string_view native_extension() const noexcept override { return chosen().native_extension(); }
    [[nodiscard]] bool exact_fovea() const noexcept override { return methods_[ExecutorChoice::foveated]->exact_fovea(); }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    void observe(Duration cost) noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t view) const noexcept override { return drawn_->plan(view); }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return drawn_->full_region(view); }
    [[nodiscard]] std::uint64_t counted_fragments() override { return drawn_->counted_fragments(); }

private:
    Auto(std::array<std::unique_ptr<Method>, 3> methods, double late_allowance) noexcept
        : methods_(std::move(methods)), choice_(late_allowance), drawn_(methods_[0].get()) {}
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_with(const MethodSettings& settings, double late_allowance);
    [[nodiscard]] Method& chosen() const noexcept { return *methods_[foveation_possible_ ? choice_.next() : ExecutorChoice::full]; }
    std::array<std::unique_ptr<Method>, 3> methods_;   // by ExecutorChoice::Way; late is empty for `auto`
    ExecutorChoice choice_;
    Method* drawn_;                     // what the last frame was drawn with
    bool foveation_possible_ = true;    // its targets could be had
};

}  // namespace fovea::foveation
