// What a start-up probe found out about the driver: which mask rejects fragments before they are shaded, and which resolve
// is cheapest. Drivers do not say, and some say the opposite of what they do.
//
// Source: measured on the current context by drawing, once per process and GL_RENDERER (about 30 ms), then remembered.
// Threads: the context's; the memory is shared and locked.
#pragma once

namespace fovea::foveation {

struct DriverTraits {
    bool early_stencil = true;       // a failing stencil test saves most of the fragment's cost
    bool early_depth = true;
    bool depth_mask = false;         // masks should be depths: the stencil is not early, the depth test is
    bool processor_resolve = false;  // reading back, enlarging and uploading beats drawing textured rectangles
    bool gpu_rate_map = false;       // a compute shader and reading its map back beat filling a shading-rate map on the processor
    double rate_map_ratio = 0;       // the shader's way against the processor's; 0: there is none
    double stencil_cost = 0, depth_cost = 0;   // of a wholly rejected picture against a shaded one
    double resolve_ratio = 0;                  // processor resolve against the GPU's; 0: not comparable
};

[[nodiscard]] const DriverTraits& driver_traits();

}  // namespace fovea::foveation
