// `auto`: foveated where it pays, in full where it does not, by what the frames really cost; of the executors that give the
// same foveated picture the cheapest. `auto_late` may also draw the fovea after the latch, where that costs little more.
//
//   masks <----> full          every `interval` frames one frame is drawn another way, each of the others in turn; two trials
//     ^   \    /  ^             in a row that are cheaper by the hysteresis switch. The interval doubles while nothing
//     v    \  /   v             changes, so that trying costs next to nothing (2.2 times the cost in 1 of 512 frames: 0.2 %).
//   late <----> rectangles
//
// The cost of a late frame counts 1 / (1 + allowance): its gain, a shorter way from latch to photon, is not in it.
// Threads: the context's. noexcept, no allocation per frame.
#pragma once

#include <array>
#include <cstddef>

#include "render/foveation/method.hpp"
#include "render/foveation/scaled_bins.hpp"

namespace fovea::foveation {

// The decision alone: which way the next frame is drawn, given what the last ones cost.
class ExecutorChoice {
public:
    enum Way : std::uint8_t { masks = 0, full = 1, late = 2, rectangles = 3 };
    static constexpr std::size_t kWays = 4;
    struct Settings {
        double late_allowance = 0;   // how much more than the others a late frame may cost, 0 to 10; 0: late is no choice
        bool rectangles = true;      // are a choice
    };
    ExecutorChoice() noexcept : ExecutorChoice(Settings{}) {}
    explicit ExecutorChoice(const Settings& settings) noexcept;
    [[nodiscard]] Way next() const noexcept { return trial_ ? candidate_ : settled_; }
    [[nodiscard]] Way settled() const noexcept { return settled_; }
    [[nodiscard]] bool trying() const noexcept { return trial_; }
    [[nodiscard]] const char* why() const noexcept;   // next() is drawn; lives for ever
    // The cost of the frame drawn as next() said. Zero and negative costs are ignored.
    void observe(Duration cost) noexcept;
    struct Switch {
        Way from = masks, to = masks;
        Duration from_cost{0}, to_cost{0};   // as measured: without the allowance
    };
    // The last one, once.
    [[nodiscard]] std::optional<Switch> take_switch() noexcept;
    [[nodiscard]] static const char* name(Way way) noexcept;

    static constexpr double kHysteresis = 0.05;     // the other way must save this much
    static constexpr int kFirstInterval = 16, kLastInterval = 512;   // frames between trials
    static constexpr int kConfirmations = 2;
    static constexpr double kOtherLoad = 1.5;       // the settled way's cost has changed by this factor: trials come often again

private:
    void choose_candidate() noexcept;
    [[nodiscard]] double median() const noexcept;
    [[nodiscard]] double weight(Way way) const noexcept { return way == late ? late_weight_ : 1; }
    std::array<bool, kWays> possible_{};
    double late_weight_ = 1;
    Way settled_ = masks, candidate_ = masks;
    bool trial_ = false;
    std::array<bool, kWays> warm_{};         // a way's first frame compiles shaders: it does not count
    std::array<bool, kWays> measured_{};     // by a trial
    std::array<double, 5> recent_{};         // weighted costs of the settled way, seconds; their median is compared
    std::size_t count_ = 0;
    double at_trial_ = 0;                    // that median at the last trial
    int since_trial_ = 0, interval_ = kFirstInterval, wins_ = 0;
    std::optional<Switch> switch_;
};

class Auto final : public Method {
public:
    [[nodiscard]] static Result<std::unique_ptr<Method>> create(const MethodSettings& settings);
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_late(const MethodSettings& settings);
    [[nodiscard]] std::string_view name() const noexcept override { return late_ ? "auto_late" : "auto"; }
    // Of the next frame: it changes only in observe() and prepare().
    [[nodiscard]] bool late_fovea() const noexcept override { return chosen().late_fovea(); }
    void submit_early(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept override {
        chosen().submit_early(draws, targets, focus);
    }
    [[nodiscard]] std::string_view executor() const noexcept override;
    [[nodiscard]] std::string_view native_extension() const noexcept override { return chosen().native_extension(); }
    [[nodiscard]] bool exact_fovea() const noexcept override { return bins_->exact_fovea(); }
    [[nodiscard]] Result<void> prepare(std::span<const ViewTarget> targets) override;
    FrameCost submit(const gl::CommandList& draws, std::span<const ViewTarget> targets,
                     std::span<const ViewFocus> focus) noexcept override;
    void observe(Duration cost) noexcept override;
    [[nodiscard]] std::optional<ExecutorSwitch> take_switch() noexcept override;
    [[nodiscard]] const density::Plan* plan(std::size_t view) const noexcept override { return drawn_->plan(view); }
    [[nodiscard]] Region full_region(std::size_t view) const noexcept override { return drawn_->full_region(view); }
    [[nodiscard]] std::uint64_t counted_fragments() override { return drawn_->counted_fragments(); }

private:
    Auto() = default;
    [[nodiscard]] static Result<std::unique_ptr<Method>> create_with(const MethodSettings& settings, double late_allowance);
    [[nodiscard]] ExecutorChoice::Way way() const noexcept { return foveation_possible_ ? choice_.next() : ExecutorChoice::full; }
    [[nodiscard]] Method& chosen() const noexcept;
    std::unique_ptr<Method> bins_, full_, late_;   // late_ is empty for `auto`
    ScaledBins* own_bins_ = nullptr;               // bins_, where the driver does not foveate by itself
    ExecutorChoice choice_;
    Method* drawn_ = nullptr;           // what the last frame was drawn with
    bool foveation_possible_ = true;    // its targets could be had
};

}  // namespace fovea::foveation
