#include <algorithm>
#include <array>
#include <string>

#include "render/present/kms.hpp"
#include "render/present/presenter.hpp"
#include "render/present/surfaceless.hpp"
#include "render/present/wayland.hpp"
#include "render/present/x11.hpp"

namespace fovea::present {
namespace {

constexpr std::array kPresenters{
    PresenterEntry{"wayland", "a window of a Wayland compositor, photon times by presentation feedback", &wayland_offered, &create_wayland},
    PresenterEntry{"x11", "a window of an X server, photon times estimated from its vblank clock", &x11_offered, &create_x11},
    PresenterEntry{"kms", "a whole screen from a text console, photon times measured by page flips (never chosen by auto)", &kms_offered, &create_kms},
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

const PresenterEntry& presenter_for(std::string_view name) noexcept {
    const auto row = std::ranges::find_if(kPresenters, [&](const PresenterEntry& p) { return name == p.name || (name == "auto" && p.offered()); });
    FOVEA_REQUIRE(row != kPresenters.end());   // the last row is always offered; names have been checked
    return *row;
}

Result<std::unique_ptr<Presenter>> create_presenter(std::string_view name, const PresenterSettings& settings, const TimeSource& time) {
    if (auto r = check_presenter(name); !r) return std::unexpected(r.error());
    return presenter_for(name).create(settings, time);
}

}  // namespace fovea::present
