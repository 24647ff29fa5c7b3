#include "render/viewer/gaze.hpp"

namespace fovea::viewer {

std::expected<Gaze, Failure> Gaze::connect(const Options& o, std::span<const scene::SceneView> eyes) {
    FOVEA_REQUIRE(eyes.size() == kEyes);
    fovea_connect_info info{};
    FOVEA_INIT(&info);
    info.flags = o.wait || o.mouse ? FOVEA_CONNECT_WAIT : 0;
    info.socket_path = o.socket.empty() ? nullptr : o.socket.c_str();
    info.client_name = "fovea-view";
    fovea_client* client = nullptr;
    const fovea_result result = fovea_connect(&info, &client);
    if (result != FOVEA_OK) {
        const bool absent = result == FOVEA_ERROR_NO_DAEMON;
        return std::unexpected(Failure{{fovea_last_error(nullptr), {}, absent ? "--socket names another one; --wait starts without it; in a window, --mouse does" : ""},
                                       absent ? kNoDaemon : kFailed});
    }
    Gaze gaze;
    gaze.client_.reset(client);
    for (std::size_t i = 0; i < kEyes; ++i) {
        fovea_view& v = gaze.views_[i];
        FOVEA_INIT(&v);
        v.eye = i == 0 ? FOVEA_EYE_LEFT : FOVEA_EYE_RIGHT;
        v.tan_left = static_cast<float>(eyes[i].fov.tan_left);
        v.tan_right = static_cast<float>(eyes[i].fov.tan_right);
        v.tan_up = static_cast<float>(eyes[i].fov.tan_up);
        v.tan_down = static_cast<float>(eyes[i].fov.tan_down);
        v.head_from_view[0] = 1;
    }
    return gaze;
}

Latched Gaze::latch(Instant photon) noexcept {
    Latched l;
    for (auto& f : l.focals) FOVEA_INIT(&f);
    FOVEA_INIT(&l.info);
    const fovea_result result = fovea_latch(client_.get(), to_ns(photon), views_.data(), kEyes, l.focals.data(), &l.info);
    FOVEA_REQUIRE(result == FOVEA_OK);   // our own arguments: an error is a bug
    return l;
}

void Gaze::report(const Frame& frame, const present::Feedback& feedback) noexcept {
    if (frame.latched().source != GazeSource::daemon) return;   // a hand's latency is not an eye's
    fovea_frame f{};
    FOVEA_INIT(&f);
    f.flags = feedback.source == present::PhotonSource::simulated   ? FOVEA_FRAME_PHOTON_SIMULATED
              : feedback.source == present::PhotonSource::estimated ? FOVEA_FRAME_PHOTON_ESTIMATED
                                                                    : 0;
    if (frame.extrapolated) f.flags |= FOVEA_FRAME_EXTRAPOLATED;
    f.frame = frame.number;
    f.submitted_ns = to_ns(frame.submitted);
    f.gpu_done_ns = to_ns(frame.gpu_done);
    f.photon_ns = to_ns(feedback.photon);
    f.pixels_shaded = frame.cost.pixels_shaded;
    f.pixels_full = frame.cost.pixels_full;
    f.view_count = kEyes;
    for (std::size_t i = 0; i < kEyes; ++i) {
        f.views[i] = views_[i];
        const foveation::Method::Region& r = frame.regions[i];
        f.foveas[i] = {static_cast<float>(r.x_ndc), static_cast<float>(r.y_ndc), static_cast<float>(r.half_width_ndc), static_cast<float>(r.half_height_ndc)};
    }
    f.latch = frame.latched().info;
    static_cast<void>(fovea_submit_frame(client_.get(), &f));   // a full or absent queue is counted by the library
}

fovea_status Gaze::status() const noexcept {
    fovea_status status{};
    FOVEA_INIT(&status);
    static_cast<void>(fovea_get_status(client_.get(), &status));   // our own arguments; zeroes say the same as an error
    return status;
}

}  // namespace fovea::viewer
