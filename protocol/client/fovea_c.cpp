// The C face of libfovea: checks arguments, translates types, lets no exception out.
#include <errno.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "protocol/client/client.hpp"
#include "protocol/model_words.hpp"

using fovea::client::Client;
using fovea::client::View;

struct fovea_client {
    std::unique_ptr<Client> impl;
};

static_assert(FOVEA_MAX_VIEWS == fovea::kMaxViews);
static_assert(static_cast<int>(fovea::GazeEvent::saccade) == FOVEA_EVENT_SACCADE);
static_assert(static_cast<int>(fovea::Eye::right) == FOVEA_EYE_RIGHT);

namespace {

constexpr std::uint32_t kLargestStruct = 4096;   // of any later version

// The texts behind fovea_last_error(); each lives until the next call on its thread.
thread_local std::string connect_error, client_error;

// A struct of this version or a later one, whose members begin like ours.
template <class T>
bool sized(const T& object) noexcept {
    return object.struct_size >= sizeof(T) && object.struct_size <= kLargestStruct && object.struct_size % alignof(T) == 0;
}

// Element i of the caller's array, whose elements may be larger than ours.
template <class T>
T& element(T* array, std::uint32_t stride, std::uint32_t i) noexcept {
    using Byte = std::conditional_t<std::is_const_v<T>, const char, char>;
    return *reinterpret_cast<T*>(reinterpret_cast<Byte*>(array) + std::size_t{stride} * i);
}

fovea_result argument(fovea_client* client, const char* literal) noexcept {
    client->impl->note_argument_error(literal);
    return FOVEA_ERROR_ARGUMENT;
}

fovea_result result_of(fovea::ConnectFault fault) noexcept {
    switch (fault) {
        case fovea::ConnectFault::no_daemon: return FOVEA_ERROR_NO_DAEMON;
        case fovea::ConnectFault::permission: return FOVEA_ERROR_PERMISSION;
        case fovea::ConnectFault::version: return FOVEA_ERROR_VERSION;
        case fovea::ConnectFault::protocol: return FOVEA_ERROR_PROTOCOL;
        case fovea::ConnectFault::system:
        case fovea::ConnectFault::cancelled: break;
    }
    return FOVEA_ERROR_SYSTEM;
}

std::uint32_t flags_of(const fovea::GazeEstimate& e) noexcept {
    if (e.tracked <= 0) return FOVEA_FOCAL_STATIC;
    const bool held = e.event == fovea::GazeEvent::lost || e.event == fovea::GazeEvent::blink;
    if (e.tracked < 1 || held) return FOVEA_FOCAL_EASING;
    return 0;
}

}  // namespace

extern "C" {

void fovea_init_struct(void* object, uint32_t size) {
    if (object == nullptr || size < sizeof size) return;
    std::memset(object, 0, size);
    std::memcpy(object, &size, sizeof size);
}

uint32_t fovea_api_version(void) { return FOVEA_API_VERSION; }

int64_t fovea_now_ns(void) { return fovea::to_ns(fovea::MonotonicClock::now()); }

fovea_result fovea_connect(const fovea_connect_info* info, fovea_client** client) {
    if (client != nullptr) *client = nullptr;
    try {
        connect_error.clear();
        if (client == nullptr || (info != nullptr && (!sized(*info) || (info->flags & ~unsigned{FOVEA_CONNECT_WAIT}) != 0))) {
            connect_error = client == nullptr          ? "fovea_connect: client is null"
                            : !sized(*info)            ? "fovea_connect: info->struct_size is not set (use FOVEA_INIT)"
                                                       : "fovea_connect: info->flags has unknown bits";
            return FOVEA_ERROR_ARGUMENT;
        }
        std::string path = info != nullptr && info->socket_path != nullptr ? info->socket_path : fovea::default_socket_path();
        std::string name = info != nullptr && info->client_name != nullptr ? info->client_name
                                                                           : program_invocation_short_name;
        const bool wait = info != nullptr && (info->flags & FOVEA_CONNECT_WAIT) != 0;
        auto made = Client::create(std::move(path), std::move(name), wait);
        if (!made) {
            connect_error = made.error().message();
            return result_of(made.error().fault);
        }
        *client = new fovea_client{std::move(*made)};
        return FOVEA_OK;
    } catch (const std::exception&) {   // bad_alloc, and nothing else
        return FOVEA_ERROR_SYSTEM;
    }
}

void fovea_disconnect(fovea_client* client) { delete client; }

fovea_result fovea_latch(fovea_client* client, int64_t photon_time_ns, const fovea_view* views, uint32_t view_count,
                         fovea_focal* focals, fovea_latch_info* info) {
    if (client == nullptr) return FOVEA_ERROR_ARGUMENT;
    if (views == nullptr || focals == nullptr) return argument(client, "fovea_latch: views or focals is null");
    if (view_count < 1 || view_count > FOVEA_MAX_VIEWS) return argument(client, "fovea_latch: view_count is not 1 to 4");
    if (!sized(*views) || !sized(*focals) || (info != nullptr && !sized(*info)))
        return argument(client, "fovea_latch: a struct_size is not set (use FOVEA_INIT)");
    const View* checked[FOVEA_MAX_VIEWS];
    std::uint8_t eyes = 0;
    for (uint32_t i = 0; i < view_count; ++i) {
        const fovea_view& given = element(views, views->struct_size, i);
        if (given.struct_size != views->struct_size ||
            element(focals, focals->struct_size, i).struct_size != focals->struct_size)
            return argument(client, "fovea_latch: the elements of an array differ in struct_size (use FOVEA_INIT on each)");
        const View* const view = client->impl->view(i, given);
        if (view == nullptr)
            return argument(client, "fovea_latch: a view has an unknown eye, an empty or mirrored field of view, or no "
                                    "unit quaternion");
        checked[i] = view;
        eyes |= fovea::eye_bit(view->eye);
    }
    fovea_latch_info unasked;
    Client::Estimates estimates;
    client->impl->latch(fovea::instant_from_ns(photon_time_ns), eyes, estimates, info != nullptr ? *info : unasked);
    for (uint32_t i = 0; i < view_count; ++i) {
        const fovea::GazeEstimate& e = estimates.of_eye[static_cast<std::size_t>(checked[i]->eye)];
        const fovea::client::Focal f = fovea::client::focal_of(*checked[i], e.gaze_dir_head);
        fovea_focal& out = element(focals, focals->struct_size, i);
        out.flags = flags_of(e);
        if (f.outside) out.flags |= FOVEA_FOCAL_OUTSIDE;
        out.event = static_cast<uint32_t>(e.event);
        out.x_ndc = static_cast<float>(f.point.x);
        out.y_ndc = static_cast<float>(f.point.y);
        out.radius68_rad = static_cast<float>(e.radius68_rad);
        out.radius95_rad = static_cast<float>(e.radius95_rad);
        out.ndc_per_rad_x = f.ndc_per_rad_x;
        out.ndc_per_rad_y = f.ndc_per_rad_y;
        out.gaze_dir_view[0] = static_cast<float>(f.gaze_dir_view.x);
        out.gaze_dir_view[1] = static_cast<float>(f.gaze_dir_view.y);
        out.gaze_dir_view[2] = static_cast<float>(f.gaze_dir_view.z);
    }
    return FOVEA_OK;
}

fovea_result fovea_submit_frame(fovea_client* client, const fovea_frame* frame) {
    if (client == nullptr) return FOVEA_ERROR_ARGUMENT;
    if (frame == nullptr) return argument(client, "fovea_submit_frame: frame is null");
    if (!sized(*frame)) return argument(client, "fovea_submit_frame: struct_size is not set (use FOVEA_INIT)");
    if (frame->view_count < 1 || frame->view_count > FOVEA_MAX_VIEWS)
        return argument(client, "fovea_submit_frame: view_count is not 1 to 4");
    using fovea::instant_from_ns;
    fovea::FrameTiming t;
    t.frame = frame->frame;
    t.model_sequence = frame->latch.model_sequence;
    t.sample_id = frame->latch.sample_id;
    t.exposed = instant_from_ns(frame->latch.exposed_ns);
    t.received = instant_from_ns(frame->latch.received_ns);
    t.filtered = instant_from_ns(frame->latch.filtered_ns);
    t.published = instant_from_ns(frame->latch.published_ns);
    t.latched = instant_from_ns(frame->latch.latched_ns);
    t.predicted_photon = instant_from_ns(frame->latch.photon_ns);
    t.submitted = instant_from_ns(frame->submitted_ns);
    t.gpu_done = instant_from_ns(frame->gpu_done_ns);
    t.photon = instant_from_ns(frame->photon_ns);
    t.exposed_estimated = (frame->latch.flags & FOVEA_LATCH_EXPOSED_ESTIMATED) != 0;
    t.photon_simulated = (frame->flags & FOVEA_FRAME_PHOTON_SIMULATED) != 0;
    t.photon_estimated = (frame->flags & FOVEA_FRAME_PHOTON_ESTIMATED) != 0;
    t.kind = (frame->flags & FOVEA_FRAME_EXTRAPOLATED) != 0 ? fovea::FrameKind::extrapolated : fovea::FrameKind::rendered;
    t.pixels_shaded = frame->pixels_shaded;
    t.pixels_full = frame->pixels_full;
    t.view_count = frame->view_count;
    for (uint32_t i = 0; i < frame->view_count; ++i) {
        const auto view = fovea::client::view_of(frame->views[i]);
        if (!view)
            return argument(client, "fovea_submit_frame: a view has an unknown eye, an empty or mirrored field of view, "
                                    "or no unit quaternion");
        const fovea_view_fovea& put = frame->foveas[i];
        t.views[i] = {view->eye, view->fov, view->head_from_view, {put.x_ndc, put.y_ndc}, put.half_width_ndc,
                      put.half_height_ndc};
    }
    switch (client->impl->submit(t)) {
        case fovea::FrameFault::none: break;
        case fovea::FrameFault::values:
            return argument(client, "fovea_submit_frame: frame is 0, pixels are impossible, or a fovea is outside its range");
        case fovea::FrameFault::instants:
            return argument(client, "fovea_submit_frame: the instants are not in order (latched, submitted, gpu_done; "
                                    "submitted, photon) or not near the present");
    }
    return FOVEA_OK;
}

fovea_result fovea_get_status(fovea_client* client, fovea_status* status) {
    if (client == nullptr) return FOVEA_ERROR_ARGUMENT;
    if (status == nullptr || !sized(*status))
        return argument(client, "fovea_get_status: status is null or its struct_size is not set (use FOVEA_INIT)");
    client->impl->status(*status);
    return FOVEA_OK;
}

const char* fovea_last_error(fovea_client* client) {
    if (client == nullptr) return connect_error.c_str();
    try {
        client_error = client->impl->last_error();
    } catch (const std::exception&) {
        return "out of memory";
    }
    return client_error.c_str();
}

const char* fovea_result_text(fovea_result result) {
    switch (result) {
        case FOVEA_OK: return "success";
        case FOVEA_ERROR_ARGUMENT: return "an argument that cannot be";
        case FOVEA_ERROR_NO_DAEMON: return "no fovead answers";
        case FOVEA_ERROR_PERMISSION: return "fovead's config does not admit this";
        case FOVEA_ERROR_VERSION: return "fovead and libfovea are of different versions";
        case FOVEA_ERROR_PROTOCOL: return "the other side is no fovead";
        case FOVEA_ERROR_SYSTEM: return "out of memory, descriptors or mappings";
    }
    return "an unknown result";
}

}  // extern "C"
