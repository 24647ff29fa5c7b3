#include "render/foveation/prepared.hpp"

#include <algorithm>
#include <string>

namespace fovea::foveation {

Result<bool> Prepared::same(std::span<const ViewTarget> targets) {
    seen_.clear();
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const ViewTarget& t = targets[i];
        if (t.width_px < 1 || t.height_px < 1) {
            ready_ = false;
            return fail("a view of " + std::to_string(t.width_px) + "x" + std::to_string(t.height_px) + " pixels", "view " + std::to_string(i),
                        "each edge must be at least 1");
        }
        if (i > 0 && t.framebuffer == targets[i - 1].framebuffer) {
            seen_.push_back(seen_.back());   // double-wide
            continue;
        }
        auto shape = gl::framebuffer_shape(t.framebuffer);
        if (!shape) {
            ready_ = false;
            return std::unexpected(shape.error());
        }
        seen_.push_back(*shape);
    }
    if ((ready_ || failed_) && std::ranges::equal(targets, targets_) && seen_ == shapes_) {
        if (failed_) return std::unexpected(*failed_);
        return true;
    }
    ready_ = false;
    failed_.reset();
    targets_.assign(targets.begin(), targets.end());
    shapes_ = seen_;
    return false;
}

Result<void> Prepared::settle(Result<void> made) {
    ready_ = made.has_value();
    if (!made) failed_ = made.error();
    return made;
}

bool Prepared::ready(std::span<const ViewTarget> targets) const noexcept { return ready_ && std::ranges::equal(targets, targets_); }

const char* Prepared::obstacle(std::span<const ViewTarget> targets, std::size_t view, const gl::Clear& clear) const noexcept {
    if (!ready(targets)) return note();
    if (clear.keep_color || clear.keep_depth) return "a composed picture cannot go on over another";
    const gl::FramebufferShape& s = shapes_[view];
    if (s.colors != 1 || (s.color[0].kind != gl::ColorKind::filtered && s.color[0].kind != gl::ColorKind::unfiltered))
        return "only one colour attachment, not of integers, can be composed";
    return "";
}

}  // namespace fovea::foveation
