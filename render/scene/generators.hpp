// The meshes of the procedural scenes.
#pragma once

#include "protocol/error.hpp"
#include "render/scene/mesh.hpp"
#include "render/scene/model.hpp"

namespace fovea::scene {

[[nodiscard]] Mesh circuit_mesh();   // a circuit board as a landscape: 55,000 triangles in 170 chunks
[[nodiscard]] Mesh box_mesh();       // a marble hall with boxes: 108 triangles
[[nodiscard]] Mesh hall_mesh();      // the hall with columns and spheres: about 9,000 triangles
[[nodiscard]] Mesh dunes_mesh();     // a height field: 2 million triangles in 100 chunks
[[nodiscard]] Mesh beads_mesh();     // a double helix of balls in 160 chunks, each fragment of which writes its depth
[[nodiscard]] Mesh reading_room_mesh();   // the empty hall
[[nodiscard]] Mesh sky_mesh();            // only what is around everything

// Errors: no font (text_model).
[[nodiscard]] Result<Model> text_model();       // printed pages, 8 triangles: only their pictures are sharp
[[nodiscard]] Result<Model> thin_model();       // wires and railings
[[nodiscard]] Result<Model> specular_model();   // small bright highlights
[[nodiscard]] Result<Model> moving_model();     // objects on tracks

}  // namespace fovea::scene
