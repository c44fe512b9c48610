/* weft live: looks through the camera, to aim, focus and light. */
#include "core/file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/text.h"
#include "host/capture/live_picture.h"
#include "host/cli/command.h"
#include "host/cli/device_open.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define QUALITY    85
#define LIGHT_MS   1000 /* asked for again long before */
#define RENEW_S    0.2
#define DEADLINE_S 6.0
/* Between two pictures of a still camera. */
#define STILL_S 3.0

typedef struct live_args {
    weft_device_options devices;
    const char *lights, *output;
    double exposure_s, gain, rate_hz, seconds;
} live_args;

static const weft_field fields[] = {
    WEFT_DEVICE_FIELDS(live_args, devices),
    {.key = "lights",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(live_args, lights),
     .unit = "LIST",
     .def = "none",
     .help = "which lights are on: none, all, or numbers as 0,3,5"},
    {.key = "exposure",
     .short_opt = 'e',
     .type = WEFT_FIELD_F64,
     .offset = offsetof(live_args, exposure_s),
     .unit = "s",
     .min = 1e-6,
     .max = 2,
     .def = "0.04",
     .help = "of each frame"},
    {.key = "gain",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(live_args, gain),
     .unit = "FACTOR",
     .min = 1,
     .max = 1000,
     .def = "1",
     .help = "analogue gain"},
    {.key = "rate",
     .type = WEFT_FIELD_F64,
     .offset = offsetof(live_args, rate_hz),
     .unit = "1/s",
     .min = 0.1,
     .max = 5,
     .def = "4",
     .help = "frames a second at most"},
    {.key = "seconds",
     .short_opt = 's',
     .type = WEFT_FIELD_F64,
     .offset = offsetof(live_args, seconds),
     .unit = "s",
     .min = 0,
     .max = 86400,
     .def = "0",
     .help = "end after so long; 0: when Ctrl-C is pressed"},
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(live_args, output),
     .unit = "FILE.jpg",
     .help = "keep the latest frame here as a JPEG, for a viewer that reloads"},
    {0},
};

typedef struct live_run {
    const weft_invocation *inv;
    const live_args *args;
    weft_camera_device *camera;
    weft_controller *controller;
    uint32_t lights;
    double asked_s;
    weft_live_stats stats;
    int n;
} live_run;

static weft_err parse_lights(const char *text, int n_lights, uint32_t *mask, weft_error *err)
{
    *mask = 0;
    if (strcmp(text, "all") == 0)
        *mask = n_lights < 32 ? (UINT32_C(1) << n_lights) - 1 : UINT32_MAX;
    if (strcmp(text, "all") == 0 || strcmp(text, "none") == 0)
        return WEFT_OK;
    for (const char *p = text;; p++) {
        double number;
        p = weft_text_scan_double(p, &number);
        if (!p || number < 0 || number >= n_lights || number != (int)number || (*p != ',' && *p != '\0'))
            return weft_fail(err, WEFT_ERR_USAGE,
                             "--lights %s: wanted none, all, or numbers from 0 to %d as 0,3,5", text,
                             n_lights - 1);
        *mask |= UINT32_C(1) << (int)number;
        if (*p == '\0')
            return WEFT_OK;
    }
}

/* Lease and light last a while: asked for again, they do not blink. */
static weft_err keep_lit(void *context, weft_error *err)
{
    live_run *const run = context;
    const double now_s = weft_clock_s();
    if (weft_cancelled())
        return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
    if (now_s - run->asked_s < RENEW_S)
        return WEFT_OK;
    run->asked_s = now_s;
    if (!run->lights)
        return weft_controller_keep_alive(run->controller, err);
    const weft_controller_info *const info = weft_controller_get_info(run->controller);
    const int most_ms = info->max_on_ms < LIGHT_MS ? info->max_on_ms : LIGHT_MS;
    return weft_controller_light(run->controller, run->lights, info->level_max, most_ms, NULL, err);
}

static weft_err save_picture(live_run *run, const weft_mosaic *mosaic, weft_error *err)
{
    uint8_t *rgb = NULL;
    unsigned char *bytes = NULL;
    int width, height;
    size_t n = 0;
    WEFT_TRY(weft_live_picture_make(mosaic, &run->stats, &rgb, &width, &height, err));
    weft_err status = weft_jpeg_encode(rgb, width, height, QUALITY, &bytes, &n, err);
    if (status == WEFT_OK) {
        status = weft_file_write(run->args->output, bytes, n, err);
        weft_jpeg_free(bytes);
    }
    weft_free(rgb);
    return status;
}

static weft_err show(live_run *run, const weft_captured_frame *frame, weft_error *err)
{
    char name[32];
    if (frame->status != WEFT_FRAME_COMPLETE) {
        weft_warn("%s", frame->reason);
        return WEFT_OK;
    }
    WEFT_TRY(weft_live_stats_make(&frame->mosaic, &run->stats, err));
    if (run->args->output)
        WEFT_TRY(save_picture(run, &frame->mosaic, err));
    snprintf(name, sizeof name, "live %d", run->n++);
    weft_live_picture_report(name, &frame->mosaic);
    return WEFT_OK;
}

static weft_err wait_for_turn(live_run *run, double until_s, weft_error *err)
{
    double left_s;
    while ((left_s = until_s - weft_clock_s()) > 0) {
        nanosleep(&(struct timespec){.tv_nsec = (long)(1e9 * fmin(left_s, 0.05))}, NULL);
        WEFT_TRY(keep_lit(run, err));
    }
    return WEFT_OK;
}

/* A still camera's shutter is made for a hundred thousand releases: they are not spent on looking. */
static double seconds_between(const live_run *run)
{
    const bool still = weft_camera_get_state(run->camera)->suffix[0] != '\0';
    const double wanted_s = 1 / run->args->rate_hz;
    if (still && wanted_s < STILL_S)
        weft_warn("each picture releases the still camera's shutter: one every %g s", STILL_S);
    return still ? fmax(wanted_s, STILL_S) : wanted_s;
}

static weft_err look(live_run *run, weft_error *err)
{
    weft_captured_frame frame = {0};
    const double period_s = seconds_between(run);
    const double begin_s = weft_clock_s();
    weft_err status = WEFT_OK;
    weft_camera_set_idle(run->camera, keep_lit, run);
    while (status == WEFT_OK && (run->args->seconds <= 0 || weft_clock_s() - begin_s < run->args->seconds)) {
        const double turn_s = weft_clock_s();
        status = keep_lit(run, err);
        if (status == WEFT_OK)
            status = weft_camera_expose(run->camera, DEADLINE_S, &frame, err);
        if (status == WEFT_OK)
            status = show(run, &frame, err);
        if (status == WEFT_OK)
            status = wait_for_turn(run, turn_s + period_s, err);
    }
    weft_camera_set_idle(run->camera, NULL, NULL);
    weft_captured_frame_fini(&frame);
    return status == WEFT_ERR_CANCELLED && run->args->seconds <= 0 ? WEFT_OK : status;
}

static weft_err print_result(const live_run *run, weft_error *err)
{
    const weft_live_stats *const s = &run->stats;
    if (run->inv->json)
        return weft_print_json(run->inv,
                               json_pack("{s:i, s:[f,f,f], s:[f,f,f]}", "frames", run->n, "mean", s->mean[0],
                                         s->mean[1], s->mean[2], "clipped", s->clipped[0], s->clipped[1],
                                         s->clipped[2]),
                               err);
    fprintf(run->inv->out,
            "%d frames; the last: mean red %.1f, green %.1f, blue %.1f %%, clipped %.2f, %.2f, %.2f %%\n",
            run->n, 100 * s->mean[0], 100 * s->mean[1], 100 * s->mean[2], 100 * s->clipped[0],
            100 * s->clipped[1], 100 * s->clipped[2]);
    return WEFT_OK;
}

static weft_err run_live(const weft_invocation *inv, const void *args, weft_error *err)
{
    live_run run = {.inv = inv, .args = args};
    WEFT_TRY(weft_device_open_both(&run.args->devices, &run.camera, &run.controller, err));
    weft_controller_panic_on_crash(run.controller);
    weft_err status =
        parse_lights(run.args->lights, weft_controller_get_info(run.controller)->n_lights, &run.lights, err);
    const weft_camera_settings wanted = {.exposure_s = run.args->exposure_s, .gain = run.args->gain};
    if (status == WEFT_OK)
        status = weft_camera_configure(run.camera, &wanted, err);
    if (status == WEFT_OK)
        status = look(&run, err);
    weft_controller_close(run.controller);
    weft_camera_close(run.camera);
    return status == WEFT_OK ? print_result(&run, err) : status;
}

const weft_command weft_cmd_live = {
    .name = "live",
    .summary = "look through the camera, to aim, focus and light",
    .operands = "",
    .args_size = sizeof(live_args),
    .fields = fields,
    .details =
        "Takes frames until Ctrl-C.  With --output each replaces the file.  Through weftd they are shown at\n"
        "/v1/live.jpg and /v1/live.mjpg, with histogram and clipping of each colour at /v1/live.\n"
        "Colours are balanced so that the frame is grey on average: for looking only.",
    .example = "weft live --lights all --exposure 0.02 -o live.jpg",
    .run = run_live,
};
