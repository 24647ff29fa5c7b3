#include "render/quality/control.hpp"

#include <cstdio>

#include "render/gl/context.hpp"

namespace fovea::quality {

Result<Control> Control::create(Ladder ladder, const std::optional<GovernorSettings>& governor) {
    Control c;
    c.ladder_ = std::move(ladder);
    c.governor_settings_ = governor;
    if (governor) {
        auto g = Governor::create(*governor, c.ladder_.costs(), c.ladder_.pick);
        if (!g) return std::unexpected(g.error());
        c.governor_ = *g;
    } else {   // nothing else is ever drawn: nothing else is prepared
        Setting only = c.ladder_.settings[c.ladder_.pick];
        c.ladder_ = Ladder{{std::move(only)}, 0};
    }
    return c;
}

Result<void> Control::prepare(std::span<const foveation::ViewTarget> targets) {
    if (!methods_.empty()) {   // other sizes
        for (auto& m : methods_)
            if (auto r = m->prepare(targets); !r) return r;
        return {};
    }
    Ladder usable;
    Error last;
    for (std::size_t i = 0; i < ladder_.settings.size(); ++i) {
        const Setting& s = ladder_.settings[i];
        std::size_t k = 0;
        while (k < usable.settings.size() && !usable.settings[k].same_method(s)) ++k;
        if (k < usable.settings.size()) {
            method_of_.push_back(method_of_[k]);
        } else {
            auto m = foveation::create_method(s.method, s.parameters);
            auto ready = m ? (*m)->prepare(targets) : Result<void>(std::unexpected(m.error()));
            if (!ready) {
                last = ready.error();
                ++left_out_;
                continue;
            }
            method_of_.push_back(methods_.size());
            methods_.push_back(*std::move(m));
        }
        if (i <= ladder_.pick) usable.pick = usable.settings.size();
        usable.settings.push_back(s);
    }
    if (usable.settings.empty()) return std::unexpected(last);
    ladder_ = std::move(usable);
    if (governor_) {
        auto g = Governor::create(*governor_settings_, ladder_.costs(), ladder_.pick);
        if (!g) return std::unexpected(g.error());
        governor_ = *g;
    }
    return {};
}

void Control::warm_up(const gl::CommandList& draws, std::span<const foveation::ViewTarget> targets) noexcept {
    std::array<foveation::ViewFocus, gl::kListViews> focus;
    for (const auto& m : methods_)
        for (const float gain : {3.0f, 12.0f}) {   // every level is used
            for (auto& f : focus) {
                f.points[0] = {0.3f, 0.2f, gain, gain, 0};
                f.count = 1;
            }
            m->submit(draws, targets, std::span(focus).first(targets.size()));
        }
    gl::finish();
}

void Control::observe(Instant now, Duration cost) noexcept {
    method().observe(cost);
    if (governor_) governor_->observe(now, cost);
}

std::optional<std::string> Control::take_log_line() {
    if (!governor_) return std::nullopt;
    const auto change = governor_->take_change();
    if (!change) return std::nullopt;
    const auto ms = [](Duration d) { return to_seconds(d) * 1e3; };
    char text[400];
    if (change->from == change->to)
        std::snprintf(text, sizeof text, "quality: %s stays: %s (%.1f ms, budget %.1f ms)", ladder_.settings[change->to].label.c_str(),
                      to_string(change->reason), ms(change->measured), ms(change->budget));
    else
        std::snprintf(text, sizeof text, "quality: %s -> %s: %s (%.1f ms, budget %.1f ms, %.1f ms expected)", ladder_.settings[change->from].label.c_str(),
                      ladder_.settings[change->to].label.c_str(), to_string(change->reason), ms(change->measured), ms(change->budget), ms(change->predicted));
    return text;
}

}  // namespace fovea::quality
