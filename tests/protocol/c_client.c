/* A complete client in C99: connects, latches 100 frames of two views, reports each, prints what it got.
 * Usage: fovea_c_client [SOCKET]. Exit code: 0 if at least one latch was live and no call failed, else 1. */
#include <fovea/fovea.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

int main(int argc, char **argv) {
    fovea_connect_info connect_info;
    fovea_client *client = NULL;
    fovea_status status;
    fovea_result result;
    unsigned live = 0;
    unsigned frame_number;

    FOVEA_INIT(&connect_info);
    connect_info.socket_path = argc > 1 ? argv[1] : NULL;
    connect_info.client_name = "fovea_c_client";
    result = fovea_connect(&connect_info, &client);
    if (result != FOVEA_OK) {
        fprintf(stderr, "fovea_c_client: %s: %s\n", fovea_result_text(result), fovea_last_error(NULL));
        return 1;
    }

    for (frame_number = 1; frame_number <= 100; ++frame_number) {
        const struct timespec frame_time = {0, 5000000}; /* stands in for drawing: 5 ms */
        fovea_view views[2];
        fovea_focal focals[2];
        fovea_latch_info info;
        fovea_frame frame;
        unsigned v;
        for (v = 0; v < 2; ++v) {
            FOVEA_INIT(&views[v]);
            FOVEA_INIT(&focals[v]);
            views[v].eye = v == 0 ? FOVEA_EYE_LEFT : FOVEA_EYE_RIGHT;
            views[v].tan_left = -1.0f;
            views[v].tan_right = 1.0f;
            views[v].tan_up = 1.0f;
            views[v].tan_down = -1.0f;
            views[v].head_from_view[0] = 1.0f;
        }
        FOVEA_INIT(&info);
        nanosleep(&frame_time, NULL);
        result = fovea_latch(client, fovea_now_ns() + 20000000, views, 2, focals, &info);
        if (result != FOVEA_OK) {
            fprintf(stderr, "fovea_c_client: latch: %s: %s\n", fovea_result_text(result), fovea_last_error(client));
            fovea_disconnect(client);
            return 1;
        }
        if ((info.flags & FOVEA_LATCH_LIVE) != 0) ++live;
        if (frame_number % 20 == 0)
            printf("frame %3u  model %llu  sample %llu  left %+.3f %+.3f  right %+.3f %+.3f  %s%s\n", frame_number,
                   (unsigned long long)info.model_sequence, (unsigned long long)info.sample_id, (double)focals[0].x_ndc,
                   (double)focals[0].y_ndc, (double)focals[1].x_ndc, (double)focals[1].y_ndc,
                   (info.flags & FOVEA_LATCH_LIVE) != 0 ? "live" : "not live",
                   (focals[0].flags & FOVEA_FOCAL_STATIC) != 0 ? ", static" : "");

        FOVEA_INIT(&frame);
        frame.flags = FOVEA_FRAME_PHOTON_SIMULATED;
        frame.frame = frame_number;
        frame.submitted_ns = fovea_now_ns();
        frame.gpu_done_ns = frame.submitted_ns;
        frame.photon_ns = info.photon_ns;
        frame.pixels_full = 1000;
        frame.pixels_shaded = 400;
        frame.view_count = 2;
        memcpy(frame.views, views, sizeof views);
        for (v = 0; v < 2; ++v) {
            frame.foveas[v].x_ndc = focals[v].x_ndc;
            frame.foveas[v].y_ndc = focals[v].y_ndc;
            frame.foveas[v].half_width_ndc = 0.3f;
            frame.foveas[v].half_height_ndc = 0.3f;
        }
        frame.latch = info;
        result = fovea_submit_frame(client, &frame);
        if (result != FOVEA_OK) {
            fprintf(stderr, "fovea_c_client: submit: %s: %s\n", fovea_result_text(result), fovea_last_error(client));
            fovea_disconnect(client);
            return 1;
        }
    }

    FOVEA_INIT(&status);
    if (fovea_get_status(client, &status) == FOVEA_OK)
        printf("latches %llu (stale %llu), frames submitted %llu, dropped %llu, live %u\n",
               (unsigned long long)status.latches, (unsigned long long)status.stale_latches,
               (unsigned long long)status.frames_submitted, (unsigned long long)status.frames_dropped, live);
    fovea_disconnect(client);
    return live > 0 ? 0 : 1;
}
