#include "protocol/gaze_sample.hpp"

namespace fovea {

const char* to_string(GazeEvent e) noexcept {
    switch (e) {
        case GazeEvent::lost: return "lost";
        case GazeEvent::blink: return "blink";
        case GazeEvent::fixation: return "fixation";
        case GazeEvent::pursuit: return "pursuit";
        case GazeEvent::saccade: return "saccade";
    }
    return "unknown";
}

}  // namespace fovea
