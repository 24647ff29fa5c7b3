// glExtrapolateTex2DQCOM, whose pictures, checks and errors come from render/extrapolation.
#pragma once

namespace fovea::layer {

// The driver's function of that name, past the layer; nullptr: it has none.
[[nodiscard]] void (*driver_function(const char* name))();

}  // namespace fovea::layer
