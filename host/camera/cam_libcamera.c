/* Cameras of libcamera: Raspberry Pi modules and other raw sensors of embedded boards, through
 * libcamera_shim. */
#include "host/camera/camera.h"
#include "host/camera/libcamera_shim.h"

#include "core/log.h"
#include "core/progress.h"
#include "host/camera/libcamera_formats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SLICE_MS = 40, FIRST_FRAME_MS = 3000 };

typedef struct libcamera_state {
    weft_libcamera *camera;
    char address[112];
    weft_raw_layout layout;
    weft_libcamera_mode mode;
    weft_libcamera_ranges ranges;
    weft_camera_settings set, streaming; /* as asked; as the stream runs, exposure 0: it does not */
    weft_camera_state *info;
    bool has_sequence;
    uint32_t sequence; /* of the last frame that came */
} libcamera_state;

typedef struct found_list {
    weft_camera_found *found;
    int max, n;
} found_list;

static void add_found(void *context, const char *id, const char *model)
{
    found_list *const list = context;
    if (list->n >= list->max)
        return;
    weft_camera_found *const f = &list->found[list->n++];
    *f = (weft_camera_found){0};
    snprintf(f->id, sizeof f->id, "libcamera:%.111s", id);
    snprintf(f->vendor, sizeof f->vendor, "libcamera");
    snprintf(f->model, sizeof f->model, "%.63s", model);
}

static void hush(void)
{
    if (weft_log_get_level() != WEFT_LOG_VERBOSE)
        weft_libcamera_hush();
}

static weft_err libcamera_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    found_list list = {found, max, 0};
    char problem[WEFT_LIBCAMERA_TEXT] = "";
    hush();
    if (!weft_libcamera_list(add_found, &list, problem))
        return weft_fail(err, WEFT_ERR_DEVICE, "%s", problem);
    *n = list.n;
    return WEFT_OK;
}

static weft_err set_format(libcamera_state *s, weft_error *err)
{
    char names[32][24], best[24] = "", list[300] = "", problem[WEFT_LIBCAMERA_TEXT] = "";
    int n = 0;
    while (n < 32 && weft_libcamera_format(s->camera, n, names[n]))
        n++;
    for (int i = 0; i < n; i++) {
        weft_raw_layout layout;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%.23s", i ? ", " : "", names[i]);
        if (weft_raw_layout_from_name(names[i], &layout) && (!best[0] || layout.bits > s->layout.bits)) {
            s->layout = layout;
            snprintf(best, sizeof best, "%.23s", names[i]);
        }
    }
    if (!best[0])
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: has no raw Bayer format (only %s); webcams give pictures, not raw data",
                         s->address, list);
    if (!weft_libcamera_set_format(s->camera, best, &s->mode, problem))
        return weft_fail(err, WEFT_ERR_DEVICE, "camera %s: %s", s->address, problem);
    if (strcmp(s->mode.format, best) != 0)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "camera %s: takes format %s when told %s", s->address,
                         s->mode.format, best);
    if (s->mode.width < 2 || s->mode.height < 2 || s->mode.width > WEFT_IMAGE_MAX_SIDE ||
        s->mode.height > WEFT_IMAGE_MAX_SIDE ||
        (size_t)s->mode.stride < weft_raw_layout_row_bytes(&s->layout, s->mode.width))
        return weft_fail(err, WEFT_ERR_PROTOCOL,
                         "camera %s: says its frames are %d x %d with rows of %d bytes", s->address,
                         s->mode.width, s->mode.height, s->mode.stride);
    return WEFT_OK;
}

static weft_err libcamera_configure(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                                    weft_error *err)
{
    libcamera_state *const s = state;
    const weft_libcamera_ranges *const r = &s->ranges;
    weft_camera_settings got = *wanted;
    got.exposure_s = wanted->exposure_s > 0 ? wanted->exposure_s : s->set.exposure_s;
    got.gain = wanted->gain > 0 ? wanted->gain : fmax(1, r->gain_min);
    if (wanted->trigger != WEFT_TRIGGER_SOFTWARE || wanted->region.width > 0)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: libcamera has no trigger input and no region; use --trigger software",
                         s->address);
    if (got.exposure_s < 0.999 * r->exposure_min_s || got.exposure_s > 1.001 * r->exposure_max_s)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "camera %s: an exposure of %g s is not possible, only %g to %g s", s->address,
                         got.exposure_s, r->exposure_min_s, r->exposure_max_s);
    if (r->gain_max > 0 ? got.gain < 0.999 * r->gain_min || got.gain > 1.001 * r->gain_max : got.gain != 1)
        return weft_fail(err, WEFT_ERR_RANGE, "camera %s: gain %g is not possible, only %g to %g", s->address,
                         got.gain, fmax(r->gain_min, 1), fmax(r->gain_max, 1));
    s->set = got;
    info->exposure_s = got.exposure_s;
    info->gain = got.gain;
    return WEFT_OK;
}

static void stop(libcamera_state *s)
{
    weft_libcamera_stop(s->camera);
    s->streaming.exposure_s = 0;
    s->has_sequence = false;
}

static weft_err start(libcamera_state *s, weft_error *err)
{
    char problem[WEFT_LIBCAMERA_TEXT] = "";
    if (s->streaming.exposure_s == s->set.exposure_s && s->streaming.gain == s->set.gain)
        return WEFT_OK;
    stop(s);
    if (!weft_libcamera_start(s->camera, s->set.exposure_s, s->set.gain, problem))
        return weft_fail(err, WEFT_ERR_DEVICE, "camera %s: %s; check its cable", s->address, problem);
    s->streaming = s->set;
    return WEFT_OK;
}

/* The order of the colours to the order of the 2 x 2 cell. */
static void take_black(weft_camera_state *info, const double black[4])
{
    for (int i = 0; i < 4; i++) {
        const int u = i & 1, v = i >> 1, colour = weft_cfa_colour(info->cfa, u, v);
        const bool beside_red = weft_cfa_colour(info->cfa, u ^ 1, v) == 0;
        const int which = colour == 0 ? 0 : colour == 2 ? 3 : beside_red ? 1 : 2;
        info->black[i] = black[which] * info->white / 65535;
    }
}

/* Black levels come with the frames: one is taken and forgotten.  A pipeline that tells none leaves 0, and
 * then the ambient frame of a set carries them. */
static weft_err learn_black(libcamera_state *s, weft_error *err)
{
    weft_libcamera_frame f;
    WEFT_TRY(start(s, err));
    if (weft_libcamera_next(s->camera, FIRST_FRAME_MS, &f) && f.has_black)
        take_black(s->info, f.black);
    stop(s);
    return WEFT_OK;
}

static weft_err libcamera_open(void *state, const char *address, weft_camera_state *info, weft_error *err)
{
    libcamera_state *const s = state;
    char problem[WEFT_LIBCAMERA_TEXT] = "";
    hush();
    snprintf(s->address, sizeof s->address, "%s", address);
    s->info = info;
    s->camera = weft_libcamera_open(address, info->model, problem);
    if (!s->camera)
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "camera %s: %s; check its cable, and your permission to use /dev/media* and /dev/video* "
            "(weft devices lists what there is)",
            address, problem);
    snprintf(info->vendor, sizeof info->vendor, "libcamera");
    snprintf(info->serial, sizeof info->serial, "%.63s", address);
    WEFT_TRY(set_format(s, err));
    s->ranges = weft_libcamera_get_ranges(s->camera);
    if (s->ranges.exposure_max_s <= 0)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: its exposure cannot be set; a camera with manual exposure is needed",
                         address);
    info->width = s->mode.width;
    info->height = s->mode.height;
    info->bits = s->layout.bits;
    info->cfa = s->layout.cfa;
    info->white = exp2(s->layout.bits) - 1;
    s->set.exposure_s = fmin(fmax(0.02, s->ranges.exposure_min_s), s->ranges.exposure_max_s);
    WEFT_TRY(libcamera_configure(s, &s->set, info, err));
    return learn_black(s, err);
}

static double clock_in_s(clockid_t which)
{
    struct timespec t;
    clock_gettime(which, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The frame's time on our clock.  Sensors count since the start of the computer with its sleep, V4L2 without:
 * the one that is nearer to now. */
static double time_of(const weft_libcamera_frame *frame)
{
    const double t = 1e-9 * (double)frame->timestamp_ns, mono = clock_in_s(CLOCK_MONOTONIC),
                 boot = clock_in_s(CLOCK_BOOTTIME);
    return fabs(t - mono) <= fabs(t - boot) ? t : t - (boot - mono);
}

/* Whether the whole exposure lies behind the trigger, and what the pipeline reports is what was asked for.
 * Whether the time is of the beginning or the end of the exposure differs, so the later is believed. */
static bool is_ours(const libcamera_state *s, const weft_libcamera_frame *f, double triggered_s)
{
    const bool settled =
        f->exposure_s <= 0 || fabs(f->exposure_s - s->set.exposure_s) < 0.02 * s->set.exposure_s + 5e-5;
    return settled && f->timestamp_ns > 0 && time_of(f) >= triggered_s + s->set.exposure_s;
}

static weft_err keep(libcamera_state *s, const weft_libcamera_frame *f, weft_captured_frame *frame,
                     weft_error *err)
{
    weft_mosaic *const m = &frame->mosaic;
    const size_t rows_bytes = (size_t)s->mode.stride * (size_t)(s->mode.height - 1) +
                              weft_raw_layout_row_bytes(&s->layout, s->mode.width);
    frame->status = WEFT_FRAME_INCOMPLETE;
    if (!f->good || f->size < rows_bytes) {
        snprintf(frame->reason, sizeof frame->reason,
                 "the frame is damaged (%zu of %zu bytes); check the cable", f->good ? f->size : 0,
                 rows_bytes);
        return WEFT_OK;
    }
    if (!m->data || m->width != s->mode.width || m->height != s->mode.height) {
        weft_mosaic_fini(m);
        WEFT_TRY(weft_mosaic_init(m, s->mode.width, s->mode.height, s->layout.cfa, err));
    }
    m->cfa = s->layout.cfa;
    m->white = (float)s->info->white;
    for (int i = 0; i < 4; i++)
        m->black[i] = (float)s->info->black[i];
    for (int v = 0; v < m->height; v++)
        weft_raw_layout_unpack(&s->layout, f->bytes + (size_t)v * (size_t)s->mode.stride, m->width,
                               m->data + (size_t)v * (size_t)m->width);
    frame->status = WEFT_FRAME_COMPLETE;
    frame->exposure_s = f->exposure_s > 0 ? f->exposure_s : s->set.exposure_s;
    frame->gain = f->gain > 0 ? f->gain : s->set.gain;
    return WEFT_OK;
}

/* Frames that the camera took and did not deliver since the last one that came. */
static uint32_t skipped(libcamera_state *s, const weft_libcamera_frame *f)
{
    const uint32_t n = s->has_sequence ? f->sequence - s->sequence - 1 : 0;
    s->has_sequence = true;
    s->sequence = f->sequence;
    return n;
}

static weft_err check_there(const libcamera_state *s, weft_error *err)
{
    if (weft_libcamera_is_gone(s->camera))
        return weft_fail(err, WEFT_ERR_DEVICE, "camera %s: was unplugged; plug it in and try again",
                         s->address);
    return WEFT_OK;
}

/* The first frame that began after the trigger; *status of `frame` tells. */
static weft_err wait_for_ours(libcamera_state *s, double deadline_s, weft_camera_idle_fn *idle,
                              void *idle_context, weft_captured_frame *frame, weft_error *err)
{
    const double triggered_s = weft_clock_s(), end_s = triggered_s + 3 * s->set.exposure_s + deadline_s;
    while (weft_clock_s() < end_s) {
        weft_libcamera_frame f;
        const bool came = weft_libcamera_next(s->camera, SLICE_MS, &f);
        weft_err status = check_there(s, err);
        if (status == WEFT_OK && idle)
            status = idle(idle_context, err);
        if (status != WEFT_OK && came)
            stop(s); /* takes the frame back */
        WEFT_TRY(status);
        if (!came)
            continue;
        const uint32_t n_skipped = skipped(s, &f);
        const bool ours = is_ours(s, &f, triggered_s) || !f.good;
        frame->sequence = f.sequence;
        if (n_skipped > 0) {
            frame->status = WEFT_FRAME_INCOMPLETE;
            snprintf(frame->reason, sizeof frame->reason,
                     "the camera skipped %u frames (its count went to %u); take load off this computer",
                     (unsigned)n_skipped, (unsigned)f.sequence);
        } else if (ours) {
            status = keep(s, &f, frame, err);
        }
        if (!weft_libcamera_give_back(s->camera, &f))
            stop(s); /* started anew with the next frame */
        if (status != WEFT_OK || ours || n_skipped > 0)
            return status;
    }
    frame->status = WEFT_FRAME_TIMEOUT;
    snprintf(frame->reason, sizeof frame->reason, "no frame came within %.1f s after the exposure",
             deadline_s);
    stop(s);
    return WEFT_OK;
}

static weft_err libcamera_expose(void *state, double deadline_s, weft_camera_idle_fn *idle,
                                 void *idle_context, weft_captured_frame *frame, weft_error *err)
{
    libcamera_state *const s = state;
    WEFT_TRY(check_there(s, err));
    WEFT_TRY(start(s, err));
    frame->exposure_s = s->set.exposure_s;
    frame->gain = s->set.gain;
    frame->reason[0] = '\0';
    return wait_for_ours(s, deadline_s, idle, idle_context, frame, err);
}

static void libcamera_close(void *state)
{
    libcamera_state *const s = state;
    weft_libcamera_close(s->camera);
    s->camera = NULL;
}

const weft_camera_backend weft_camera_libcamera = {
    .name = "libcamera",
    .summary = "Raspberry Pi and other raw sensors (libcamera)",
    .state_size = sizeof(libcamera_state),
    .list = libcamera_list,
    .open = libcamera_open,
    .configure = libcamera_configure,
    .expose = libcamera_expose,
    .close = libcamera_close,
};
