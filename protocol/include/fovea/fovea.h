/* libfovea: focal points for a VR app, C99.
 *
 * A client connects to fovead, latches the focal points of its views for its own photon time right before it flushes
 * a frame, and reports the frame's instants afterwards. Without a daemon, or after the daemon has died, every call
 * still works: the focal points follow the signal-loss policy (hold, ease to the static focal point) and the library
 * reconnects by itself.
 *
 * Times    int64_t nanoseconds of CLOCK_MONOTONIC.
 * Frames   right-handed, +x right, +y up, -z forward; radians; NDC is [-1, 1] per view, +y up.
 * Threads  fovea_connect and fovea_disconnect may run on any thread. fovea_latch and fovea_submit_frame belong to one
 *          thread at a time per client (usually the render thread). fovea_get_status and fovea_last_error: any thread.
 * Errors   functions return FOVEA_OK (0) or a negative fovea_result; fovea_result_text() says what it means, and
 *          fovea_last_error() what happened, where, and what to do.
 *
 * Structs begin with struct_size: set it to sizeof the struct (FOVEA_INIT does), so that later versions can append
 * members without breaking programs built today.
 */
#ifndef FOVEA_FOVEA_H
#define FOVEA_FOVEA_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FOVEA_API_VERSION 1u
#define FOVEA_MAX_VIEWS 4u

#if defined(__GNUC__)
#define FOVEA_API __attribute__((visibility("default")))
#else
#define FOVEA_API
#endif

typedef struct fovea_client fovea_client;

typedef enum fovea_result {
    FOVEA_OK = 0,
    FOVEA_ERROR_ARGUMENT = -1,      /* a null pointer, a count, a size or a view that cannot be */
    FOVEA_ERROR_NO_DAEMON = -2,     /* nobody listens on the socket */
    FOVEA_ERROR_PERMISSION = -3,    /* the daemon's config does not admit this user or this request */
    FOVEA_ERROR_VERSION = -4,       /* daemon and library speak different ABI versions */
    FOVEA_ERROR_PROTOCOL = -5,      /* the other side is no fovead, or it broke the handshake */
    FOVEA_ERROR_SYSTEM = -6         /* out of memory, descriptors or mappings */
} fovea_result;

enum fovea_eye { FOVEA_EYE_COMBINED = 0, FOVEA_EYE_LEFT = 1, FOVEA_EYE_RIGHT = 2 };

enum fovea_event {
    FOVEA_EVENT_LOST = 0,
    FOVEA_EVENT_BLINK = 1,
    FOVEA_EVENT_FIXATION = 2,
    FOVEA_EVENT_PURSUIT = 3,
    FOVEA_EVENT_SACCADE = 4
};

/* fovea_connect_info.flags */
enum {
    FOVEA_CONNECT_WAIT = 1 /* succeed without a daemon and keep trying in the background */
};

typedef struct fovea_connect_info {
    uint32_t struct_size;
    uint32_t flags;
    const char *socket_path; /* NULL: $FOVEA_SOCKET, else $XDG_RUNTIME_DIR/fovea/focus.sock, else /run/fovea/focus.sock */
    const char *client_name; /* shown by `fovea status`; NULL: the program's name; at most 63 bytes are kept */
} fovea_connect_info;

/* One rendered view. */
typedef struct fovea_view {
    uint32_t struct_size;
    uint32_t eye;              /* enum fovea_eye: whose gaze this view follows */
    float tan_left, tan_right; /* signed tangents of the frustum, left < right */
    float tan_up, tan_down;    /* down < up */
    float head_from_view[4];   /* unit quaternion w, x, y, z: rotation of the view in the head; {1,0,0,0} if parallel */
} fovea_view;

/* fovea_focal.flags */
enum {
    FOVEA_FOCAL_OUTSIDE = 1, /* the gaze is behind or outside the view; x_ndc and y_ndc are the nearest point of its edge */
    FOVEA_FOCAL_STATIC = 2,  /* no live gaze: this is the static focal point */
    FOVEA_FOCAL_EASING = 4   /* between the two (held, easing out or easing back) */
};

/* Where to put the fovea of one view. */
typedef struct fovea_focal {
    uint32_t struct_size;
    uint32_t flags;
    uint32_t event;                         /* enum fovea_event */
    float x_ndc, y_ndc;                     /* in [-1, 1] */
    float radius68_rad, radius95_rad;       /* the eye is this close to the point with probability 0.68, 0.95; >= 0 */
    float ndc_per_rad_x, ndc_per_rad_y;     /* local scale at the point, to turn those radii into NDC; > 0 */
    float gaze_dir_view[3];                 /* unit vector in the view's frame */
} fovea_focal;

/* fovea_latch_info.flags */
enum {
    FOVEA_LATCH_LIVE = 1,              /* a connected daemon with a beating heart supplied the model */
    FOVEA_LATCH_EXPOSED_ESTIMATED = 2  /* the tracker gave no exposure time; `exposed_ns` is an estimate */
};

/* What the focal points are made from: stamp the frame with it. */
typedef struct fovea_latch_info {
    uint32_t struct_size;
    uint32_t flags;
    uint64_t model_sequence; /* 0: no model has ever been received */
    uint64_t sample_id;
    int64_t exposed_ns, received_ns, filtered_ns, published_ns; /* of that sample */
    int64_t latched_ns;      /* when this call ran */
    int64_t photon_ns;       /* what was asked for */
} fovea_latch_info;

/* The full-resolution region as it was put into one view: an axis-aligned ellipse. */
typedef struct fovea_view_fovea {
    float x_ndc, y_ndc;
    float half_width_ndc, half_height_ndc; /* > 0; a region that covers the view may exceed 1 */
} fovea_view_fovea;

/* fovea_frame.flags */
enum {
    FOVEA_FRAME_PHOTON_SIMULATED = 1, /* photon_ns comes from a simulated scan-out clock, not from a display */
    FOVEA_FRAME_EXTRAPOLATED = 2,     /* made from earlier frames: `latch` is that of the frame it continues */
    FOVEA_FRAME_PHOTON_ESTIMATED = 4  /* photon_ns is a guess at what a display did: it did not tell */
};

/* One frame's report. */
typedef struct fovea_frame {
    uint32_t struct_size;
    uint32_t flags;
    uint64_t frame;                 /* the app's own count, from 1 */
    int64_t submitted_ns, gpu_done_ns, photon_ns;
    uint64_t pixels_shaded, pixels_full;
    uint32_t view_count;            /* 1 to FOVEA_MAX_VIEWS */
    fovea_view views[FOVEA_MAX_VIEWS];
    fovea_view_fovea foveas[FOVEA_MAX_VIEWS];
    fovea_latch_info latch;         /* as returned by fovea_latch for this frame */
} fovea_frame;

typedef struct fovea_status {
    uint32_t struct_size;
    uint32_t connected;             /* 1: a daemon's regions are mapped and its socket is open */
    uint64_t connects;              /* how often the library has connected, this process */
    uint64_t latches, stale_latches; /* stale: answered without a live daemon */
    uint64_t frames_submitted, frames_dropped; /* dropped: the daemon did not drain in time */
    int64_t heartbeat_age_ns;       /* since the daemon's last heartbeat; -1 when not connected */
} fovea_status;

/* Zeroes a struct and sets its struct_size: FOVEA_INIT(&view); for arrays, each element. */
#define FOVEA_INIT(pointer) fovea_init_struct((pointer), (uint32_t)sizeof *(pointer))
FOVEA_API void fovea_init_struct(void *object, uint32_t size);

/* FOVEA_API_VERSION of the library that is loaded. */
FOVEA_API uint32_t fovea_api_version(void);

/* Now, on the clock of all times here, nanoseconds. */
FOVEA_API int64_t fovea_now_ns(void);

/* Connects to the daemon; blocks at most about one second. `info` may be NULL (all defaults). On success *client is
 * to be given to fovea_disconnect. Errors: NO_DAEMON (unless FOVEA_CONNECT_WAIT), PERMISSION, VERSION, PROTOCOL,
 * SYSTEM, ARGUMENT; then *client is NULL and fovea_last_error(NULL) says more. */
FOVEA_API fovea_result fovea_connect(const fovea_connect_info *info, fovea_client **client);

/* Ends the connection and frees everything. NULL is allowed. */
FOVEA_API void fovea_disconnect(fovea_client *client);

/* The focal points of `view_count` views (1 to FOVEA_MAX_VIEWS) at `photon_time_ns`: when the light of this frame will
 * reach the eye. Call it as late as possible: after the draws are recorded, before the flush. Never blocks, locks or
 * allocates; about 100 ns for two views. `info` may be NULL. Errors: ARGUMENT (nothing is written). */
FOVEA_API fovea_result fovea_latch(fovea_client *client, int64_t photon_time_ns, const fovea_view *views,
                                   uint32_t view_count, fovea_focal *focals, fovea_latch_info *info);

/* Reports a finished frame to the daemon, which logs motion-to-photon latency. Never blocks: if the daemon is absent or
 * behind, the frame is counted as dropped. Errors: ARGUMENT. */
FOVEA_API fovea_result fovea_submit_frame(fovea_client *client, const fovea_frame *frame);

/* Counters and connection state. Errors: ARGUMENT. */
FOVEA_API fovea_result fovea_get_status(fovea_client *client, fovea_status *status);

/* The newest error of a client, or of the calling thread's last fovea_connect when client is NULL: one line that names
 * what, where and the way out. Valid until the next call on the same thread. Never NULL. */
FOVEA_API const char *fovea_last_error(fovea_client *client);

/* What a fovea_result means, in a few words. Never NULL. */
FOVEA_API const char *fovea_result_text(fovea_result result);

#ifdef __cplusplus
}
#endif
#endif
