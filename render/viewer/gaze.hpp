// Where the viewer's focal points come from, and where its frames are reported: fovead, through libfovea.
//
// Threads: the loop's. Errors: connect() only; a daemon that is lost later is libfovea's to follow and to find again.
#pragma once

#include <memory>
#include <span>

#include "render/scene/scene.hpp"
#include "render/viewer/frame.hpp"
#include "render/viewer/viewer.hpp"

namespace fovea::viewer {

class Gaze {
public:
    [[nodiscard]] static std::expected<Gaze, Failure> connect(const Options& options, std::span<const scene::SceneView> eyes);

    // The focal points for the light of this instant. Call it as late as possible. noexcept, no allocation.
    [[nodiscard]] Latched latch(Instant photon) noexcept;
    // Tells fovead of a frame that was shown.
    void report(const Frame& frame, const present::Feedback& feedback) noexcept;
    [[nodiscard]] fovea_status status() const noexcept;

private:
    struct Disconnect {
        void operator()(fovea_client* c) const noexcept { fovea_disconnect(c); }
    };
    std::unique_ptr<fovea_client, Disconnect> client_;
    std::array<fovea_view, kEyes> views_{};
};

}  // namespace fovea::viewer
