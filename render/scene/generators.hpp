// The meshes of the procedural scenes.
#pragma once

#include "render/scene/mesh.hpp"

namespace fovea::scene {

[[nodiscard]] Mesh circuit_mesh();   // a circuit board as a landscape: 55,000 triangles in 170 chunks
[[nodiscard]] Mesh box_mesh();       // a marble hall with boxes: 108 triangles
[[nodiscard]] Mesh hall_mesh();      // the hall with columns and spheres: about 9,000 triangles
[[nodiscard]] Mesh dunes_mesh();     // a height field: 2 million triangles in 100 chunks

}  // namespace fovea::scene
