#include "daemon/service/cadence.hpp"

namespace fovea::service {

void Cadence::arrived(Instant received) noexcept {
    const Duration came = received - last_;
    const bool first = !any_;
    any_ = true;
    last_ = received;
    if (first || came <= Duration{} || came > kLongest) {
        regular_ = 0;
        gap_ = {};
        on_grid_ = received;
        return;
    }
    const Duration off = received - (on_grid_ + gap_);
    if (gap_ == Duration{} || off > gap_ / 4 || off < -gap_ / 4) {
        regular_ = 0;
        gap_ = came;
        on_grid_ = received;
        return;
    }
    if (regular_ < kRegular) ++regular_;
    gap_ += (came - gap_) / 16;
    on_grid_ = off < Duration{} ? received : received - off + off / 8;
}

std::optional<Instant> Cadence::due() const noexcept {
    if (regular_ < kRegular || gap_ < kShortest) return std::nullopt;
    return on_grid_ + gap_;
}

}  // namespace fovea::service
