/*
 * A backend without a camera, for the tests of what is between a program and its helper: built into a helper
 * of its own, which is started as weft-camera-aravis by WEFT_HELPERS.  It draws drawn_camera_sample().
 *
 * Addresses: "N" waits for the exposure; "none" cannot be opened; "other-N" changes its serial number each
 * time it is opened; "stuck" never comes back from an exposure and looks at nothing.
 */
#include "tests/host/drawn_camera.h"

#include "core/progress.h"
#include "host/camera/camera.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

typedef struct drawn_camera {
    char address[64];
    uint64_t sequence;
    weft_camera_settings set;
} drawn_camera;

static weft_err drawn_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    (void)err;
    *n = max < 3 ? max : 3;
    for (int i = 0; i < *n; i++) {
        found[i] = (weft_camera_found){.vendor = "Weft", .model = "Drawn"};
        snprintf(found[i].id, sizeof found[i].id, "aravis:%d", i);
        snprintf(found[i].serial, sizeof found[i].serial, "D%d", i);
    }
    return WEFT_OK;
}

static weft_err drawn_open(void *state, const char *address, weft_camera_state *info, weft_error *err)
{
    drawn_camera *const c = state;
    snprintf(c->address, sizeof c->address, "%s", address);
    if (strcmp(address, "none") == 0)
        return weft_fail(err, WEFT_ERR_DEVICE, "camera none: is not there; plug it in");
    c->set = (weft_camera_settings){.exposure_s = 0.01, .gain = 1};
    *info = (weft_camera_state){.vendor = "Weft",
                                .model = "Drawn",
                                .width = DRAWN_WIDTH,
                                .height = DRAWN_HEIGHT,
                                .bits = 14,
                                .cfa = WEFT_CFA_GRBG,
                                .black = {256, 256, 256, 256},
                                .white = 15871,
                                .exposure_s = 0.01,
                                .gain = 1};
    const bool other = strncmp(address, "other-", 6) == 0;
    snprintf(info->serial, sizeof info->serial, "D%s-%d", address, other ? (int)getpid() : 0);
    return WEFT_OK;
}

static weft_err drawn_configure(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                                weft_error *err)
{
    drawn_camera *const c = state;
    if (wanted->exposure_s > 60)
        return weft_fail(err, WEFT_ERR_RANGE, "camera %s: only to 60 s", c->address);
    c->set = *wanted;
    info->exposure_s = wanted->exposure_s > 0 ? wanted->exposure_s : 0.01;
    info->gain = wanted->gain > 0 ? wanted->gain : 1;
    c->set.exposure_s = info->exposure_s;
    c->set.gain = info->gain;
    return WEFT_OK;
}

static weft_err wait_for_it(const drawn_camera *c, weft_camera_idle_fn *idle, void *context, weft_error *err)
{
    const double end_s = weft_clock_s() + c->set.exposure_s;
    do {
        WEFT_TRY(idle(context, err));
        nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
    } while (weft_clock_s() < end_s);
    return WEFT_OK;
}

static weft_err drawn_expose(void *state, double deadline_s, weft_camera_idle_fn *idle, void *context,
                             weft_captured_frame *frame, weft_error *err)
{
    drawn_camera *const c = state;
    (void)deadline_s;
    if (strcmp(c->address, "stuck") == 0)
        for (;;)
            pause();
    WEFT_TRY(wait_for_it(c, idle, context, err));
    weft_mosaic *const m = &frame->mosaic;
    if (!m->data)
        WEFT_TRY(weft_mosaic_init(m, DRAWN_WIDTH, DRAWN_HEIGHT, WEFT_CFA_GRBG, err));
    m->white = 15871;
    frame->status = WEFT_FRAME_COMPLETE;
    frame->reason[0] = '\0';
    frame->sequence = ++c->sequence;
    frame->exposure_s = c->set.exposure_s;
    frame->gain = c->set.gain;
    for (int i = 0; i < DRAWN_WIDTH * DRAWN_HEIGHT; i++)
        m->data[i] = drawn_camera_sample(i, frame->sequence, frame->exposure_s);
    return WEFT_OK;
}

static void drawn_close(void *state)
{
    (void)state;
}

const weft_camera_backend weft_camera_drawn = {
    .name = "aravis",
    .summary = "pictures drawn for tests",
    .state_size = sizeof(drawn_camera),
    .list = drawn_list,
    .open = drawn_open,
    .configure = drawn_configure,
    .expose = drawn_expose,
    .close = drawn_close,
};
