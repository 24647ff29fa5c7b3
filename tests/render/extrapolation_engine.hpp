// An engine, and one call of it on pictures that own their pixels: what the tests of searched and of known motion share.
#pragma once

#include <gtest/gtest.h>

#include <limits>

#include "render/extrapolation/extrapolation.hpp"
#include "tests/render/extrapolation_pictures.hpp"

namespace fovea::test {

inline constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

inline render::extrapolation::Extrapolator engine(render::extrapolation::Preset preset = render::extrapolation::Preset::balanced, int threads = 1, bool vector_code = true) {
    auto e = render::extrapolation::Extrapolator::create({.preset = preset, .threads = threads, .vector_code = vector_code});
    EXPECT_TRUE(e.has_value());
    return std::move(*e);
}
inline render::extrapolation::Outcome run(render::extrapolation::Extrapolator& e, const Picture& a, const Picture& b, Picture& out, float factor,
                                          const render::extrapolation::Hints& hints = {}) {
    return e.extrapolate(a.view(), b.view(), out.target(), factor, hints);
}

}  // namespace fovea::test
