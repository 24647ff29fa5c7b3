#include "render/present/surfaceless.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>

namespace fovea::present {
namespace {

class Surfaceless final : public Presenter {
public:
    Surfaceless(const ScanoutSettings& settings, SimulatedScanout display, gl::Context context, const TimeSource& time) noexcept
        : settings_(settings), display_(display), context_(std::move(context)), time_(time) {}

    [[nodiscard]] std::string_view name() const noexcept override { return "surfaceless"; }
    [[nodiscard]] std::string description() const override {
        std::array<char, 64> text{};
        std::snprintf(text.data(), text.size(), "simulated, %.4g Hz, scan-out %.4g ms", settings_.refresh_hz, settings_.scanout_ms);
        return text.data();
    }
    [[nodiscard]] const gl::Context& context() const noexcept override { return context_; }
    [[nodiscard]] Duration refresh_period() const noexcept override { return display_.period(); }

    [[nodiscard]] Result<bool> begin_frame(Duration cost, Duration patience) override {
        const Instant now = time_.now(), begin = display_.begin_no_sooner(cost);
        if (begin <= now) return true;
        const Duration wait = std::clamp(begin - now, Duration{0}, std::min(patience, Duration{999'999'999}));
        const timespec pause{0, static_cast<long>(wait.count())};
        nanosleep(&pause, nullptr);
        return wait == begin - now;
    }
    [[nodiscard]] Instant photon_of(Instant gpu_done) const noexcept override { return display_.predict(gpu_done).photon; }
    [[nodiscard]] bool holds_back() const noexcept override { return true; }
    [[nodiscard]] Result<void> present(std::uint64_t frame, Instant gpu_done) override {
        feedback_ = {frame, true, display_.present(gpu_done).photon, PhotonSource::simulated};
        known_ = true;
        return {};
    }
    [[nodiscard]] Result<std::span<const Feedback>> collect() override {
        return std::span<const Feedback>(&feedback_, std::exchange(known_, false) ? 1 : 0);
    }

private:
    ScanoutSettings settings_;
    SimulatedScanout display_;
    gl::Context context_;
    const TimeSource& time_;
    Feedback feedback_;
    bool known_ = false;
};

}  // namespace

Result<std::unique_ptr<Presenter>> create_surfaceless(const PresenterSettings& settings, const TimeSource& time) {
    auto display = SimulatedScanout::create(settings.scanout, time.now());
    if (!display) return std::unexpected(display.error());
    auto context = gl::Context::create();
    if (!context) return std::unexpected(context.error());
    return std::make_unique<Surfaceless>(settings.scanout, *display, *std::move(context), time);
}

}  // namespace fovea::present
