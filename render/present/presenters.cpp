#include <algorithm>
#include <array>
#include <string>

#include "render/present/presenter.hpp"
#include "render/present/surfaceless.hpp"

namespace fovea::present {
namespace {

constexpr std::array kPresenters{
    PresenterEntry{"surfaceless", "no window: the display is simulated and marked so", [] { return true; }, &create_surfaceless},
};

}  // namespace

std::string_view text_of(PhotonSource source) noexcept {
    switch (source) {
        case PhotonSource::measured: return "measured";
        case PhotonSource::estimated: return "estimated";
        case PhotonSource::simulated: return "simulated";
    }
    return "";
}

std::span<const PresenterEntry> presenters() noexcept { return kPresenters; }

Result<void> check_presenter(std::string_view name) {
    std::string known = "auto";
    if (name == known) return {};
    for (const PresenterEntry& p : kPresenters) {
        if (name == p.name) return {};
        known += ", " + std::string(p.name);
    }
    return fail("unknown display '" + std::string(name) + "'", "--present", "known displays: " + known);
}

Result<std::unique_ptr<Presenter>> create_presenter(std::string_view name, const PresenterSettings& settings, const TimeSource& time) {
    if (auto r = check_presenter(name); !r) return std::unexpected(r.error());
    const auto chosen = std::ranges::find_if(kPresenters, [&](const PresenterEntry& p) { return name == p.name || (name == "auto" && p.offered()); });
    return chosen->create(settings, time);   // the last row is always offered
}

}  // namespace fovea::present
