// Draws with the setting that the governor has chosen (or the picked one, where no budget is held).
//
// Input: a ladder. prepare() makes the methods and targets of every setting beforehand, so that a change costs nothing in
// the frame that is timed: settings that differ by their gain alone share one method, the others keep targets of their own
// (a scaled_bins of three levels: 5/16 of the views' pixels, colour and depth).
// warm_up() draws once with each setting, so that the driver has compiled what it compiles at first use.
// Threads: the context's. Errors: those of the methods; a setting whose targets cannot be had is left out and counted,
// unless it is the only one.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/foveation/method.hpp"
#include "render/quality/governor.hpp"
#include "render/quality/ladder.hpp"

namespace fovea::quality {

class Control {
public:
    // governor: nothing: the ladder's pick is drawn for ever.
    [[nodiscard]] static Result<Control> create(Ladder ladder, const std::optional<GovernorSettings>& governor);
    [[nodiscard]] Result<void> prepare(std::span<const foveation::ViewTarget> targets);
    void warm_up(const gl::CommandList& draws, std::span<const foveation::ViewTarget> targets) noexcept;

    // For the next frame. noexcept, no allocation.
    [[nodiscard]] const Setting& setting() const noexcept { return ladder_.settings[index()]; }
    [[nodiscard]] foveation::Method& method() const noexcept { return *methods_[method_of_[index()]]; }
    // A frame drawn with method() took `cost`, record to GPU done. noexcept, no allocation.
    void observe(Instant now, Duration cost) noexcept;
    // Changes since the last call, oldest first; allocates, for outside the timed frame.
    [[nodiscard]] std::optional<std::string> take_log_line();

    [[nodiscard]] const Ladder& ladder() const noexcept { return ladder_; }
    [[nodiscard]] std::uint64_t changes() const noexcept { return governor_ ? governor_->changes() : 0; }
    [[nodiscard]] std::size_t left_out() const noexcept { return left_out_; }

private:
    Control() = default;
    [[nodiscard]] std::size_t index() const noexcept { return governor_ ? governor_->setting() : ladder_.pick; }

    Ladder ladder_;
    std::optional<GovernorSettings> governor_settings_;
    std::optional<Governor> governor_;
    std::vector<std::unique_ptr<foveation::Method>> methods_;
    std::vector<std::size_t> method_of_;   // of each setting
    std::size_t left_out_ = 0;
};

}  // namespace fovea::quality
