// What a scene's author says himself, in a scene file or in a glTF's extras; and scenes by name, file or scene file.
//
//   # room.toml: `fovea-view --scene room.toml`
//   scene = "room.glb"        # beside this file, or a built-in name
//   [effects]                 # true, false, or "auto" (as if it were not there); names: fovea scene explain
//   msaa = false
//   [needs]                   # numbers instead of the measured ones
//   lens_radius = 1.1
//   [lens]                    # what the headset's lens does: render/effects/lens.hpp
//   k1 = 0.22
//
// The same in a glTF file: "extras": {"fovea": {"effects": {...}, "needs": {...}, "lens": {...}}} of its scene or its asset. A scene file
// wins over extras, a declaration over the measurement.
// Threads: any. Errors: file and line; an unknown key lists the legal ones; a number out of its range says the range.
#pragma once

#include <string>

#include "protocol/error.hpp"
#include "render/effects/effects.hpp"
#include "render/scene/source.hpp"

namespace fovea::effects {

struct Opened {
    scene::Source source;
    Declared declared;
};
// A built-in name, a .gltf or .glb file, or a .toml scene file.
[[nodiscard]] Result<Opened> open_scene(const std::string& scene);

// text: the JSON object of a glTF's `fovea` extras. origin: for errors and reasons.
[[nodiscard]] Result<Declared> declared_in_json(const std::string& text, const std::string& origin);

struct SceneFile {
    std::string scene;
    Declared declared;
};
[[nodiscard]] Result<SceneFile> read_scene_file(const std::string& text, const std::string& path);

}  // namespace fovea::effects
