// glExtrapolateTex2DQCOM: the checks and errors of GL_QCOM_frame_extrapolation; the pictures come from
// render/extrapolation.
#pragma once

namespace fovea::layer {

// Whether this build has an engine; the extension is listed only then.
[[nodiscard]] bool can_extrapolate() noexcept;

}  // namespace fovea::layer
