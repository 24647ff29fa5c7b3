// glExtrapolateTex2DQCOM, whose pictures, checks and errors come from render/extrapolation.
#pragma once

#include "render/layer/graveyard.hpp"

namespace fovea::layer {

// The driver's function of that name, past the layer; nullptr: it has none.
[[nodiscard]] void (*driver_function(const char* name))();

// While it lives, what an engine deletes on this thread goes to the graveyard: its context is gone, or another is current.
class DeletionsGoTo {
public:
    explicit DeletionsGoTo(Graveyard& graveyard);
    ~DeletionsGoTo();
    DeletionsGoTo(const DeletionsGoTo&) = delete;
    DeletionsGoTo& operator=(const DeletionsGoTo&) = delete;
};

}  // namespace fovea::layer
