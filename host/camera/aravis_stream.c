/* Frames of GigE Vision and USB3 Vision cameras: stream, trigger, wait. */
#include "host/camera/aravis_private.h"

#include "core/log.h"
#include "core/progress.h"

#include <arpa/inet.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum {
    N_BUFFERS = 4,
    SLICE_US = 50000, /* between two calls of `idle` */
    REASON_SIZE = sizeof((weft_captured_frame *)0)->reason,
};

/* A frame that is whole sooner after its trigger than its exposure lasts is of another trigger.  Half of this
 * is what the simulated camera's clock may be off the wall clock. */
#define EARLY_S 0.1
/* How long after the exposure a frame that was called behind another one may still come. */
#define OURS_COMES_S 0.3
/* The first frame of a stream has taken up to 0.3 s on loopback, and half a second on sleeping cameras. */
#define FIRST_FRAME_S 3.0

void aravis_stop(aravis_camera *a)
{
    if (a->stream && !atomic_load(&a->lost))
        arv_camera_stop_acquisition(a->camera, NULL); /* a camera that does not answer is stopped already */
    g_clear_object(&a->stream);
    a->stale = false;
    a->has_last_id = false;
    a->clock = (weft_frame_clock){0};
}

static weft_err set_packet_size(aravis_camera *a, weft_error *err)
{
    if (!arv_camera_is_gv_device(a->camera))
        return WEFT_OK;
    if (a->loopback)
        arv_camera_gv_set_stream_options(a->camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    guint bytes = 0;
    if (a->loopback || a->wishes.packet_bytes) {
        /* A packet of 9 kB is charged 16 kB of socket memory; the largest there are lose nothing. */
        enum { LOOPBACK_BYTES = 65000 };
        const gint wanted = a->wishes.packet_bytes ? a->wishes.packet_bytes : LOOPBACK_BYTES;
        arv_camera_gv_set_packet_size_adjustment(a->camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
        ARAVIS_TRY(a, "setting the packet size", arv_camera_gv_set_packet_size(a->camera, wanted, &error));
        ARAVIS_TRY(a, "reading back the packet size",
                   bytes = arv_camera_gv_get_packet_size(a->camera, &error));
        if (a->wishes.packet_bytes && bytes != (guint)wanted)
            return weft_fail(err, WEFT_ERR_RANGE,
                             "camera %s: packets of %d bytes are not possible, it takes %u", a->address,
                             wanted, bytes);
        return WEFT_OK;
    }
    ARAVIS_TRY(a, "finding the largest packet that passes",
               bytes = arv_camera_gv_auto_packet_size(a->camera, &error));
    if (bytes < 8000)
        weft_explain("camera %s: packets of %u bytes; an MTU of 9000 on this network lowers the load",
                     a->address, bytes);
    return WEFT_OK;
}

static weft_err create_stream(aravis_camera *a, weft_error *err)
{
    guint payload = 0;
    WEFT_TRY(set_packet_size(a, err));
    ARAVIS_TRY(a, "asking the size of a frame", payload = arv_camera_get_payload(a->camera, &error));
    ARAVIS_TRY(a, "opening the stream", a->stream = arv_camera_create_stream(a->camera, NULL, NULL, &error));
    if (!a->stream)
        return aravis_fail(a, NULL, "opening the stream", err);
    if (ARV_IS_GV_STREAM(a->stream)) {
        /* Two frames, but never little: Aravis' own choice for a frame of one packet loses that packet. */
        enum { LEAST = 4 << 20, MOST = 256 << 20 };
        const gint bytes = payload > MOST / 2 ? MOST : payload > LEAST / 2 ? (gint)(2 * payload) : LEAST;
        const bool resend = a->wishes.resend < 0 ? !a->loopback : a->wishes.resend != 0;
        g_object_set(a->stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                     bytes, "packet-resend",
                     resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER, NULL);
    }
    for (int i = 0; i < N_BUFFERS; i++)
        arv_stream_push_buffer(a->stream, arv_buffer_new_allocate(payload));
    return WEFT_OK;
}

static weft_err check_there(const aravis_camera *a, weft_error *err)
{
    if (atomic_load(&a->lost))
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "camera %s: the connection was lost; check its cable and power, and that no other "
                         "program has taken it over",
                         a->address);
    return WEFT_OK;
}

static weft_err ping(aravis_camera *a, weft_error *err)
{
    struct in_addr unused;
    if (inet_pton(AF_INET, a->address, &unused) == 1) {
        if (!aravis_answers(a->address))
            atomic_store(&a->lost, true);
        return check_there(a, err);
    }
    ARAVIS_TRY(a, "waiting for a frame", (void)arv_camera_get_pixel_format(a->camera, &error));
    return WEFT_OK;
}

/* Triggers, or says by a call of `idle` that the pulse on the wire may come. */
static weft_err trigger(aravis_camera *a, weft_camera_trigger how, weft_camera_idle_fn *idle,
                        void *idle_context, weft_error *err)
{
    a->stale = true;
    a->triggered_s = weft_clock_s();
    if (how == WEFT_TRIGGER_WIRE)
        return idle ? idle(idle_context, err) : WEFT_OK;
    ARAVIS_TRY(a, "triggering a frame", arv_camera_software_trigger(a->camera, &error));
    return WEFT_OK;
}

/* Triggers and waits at most wait_s for whatever comes; *buffer is NULL when nothing did.  A silent camera
 * is asked whether it lives early enough for the answer to come before the deadline. */
static weft_err take(aravis_camera *a, weft_camera_trigger how, double wait_s, weft_camera_idle_fn *idle,
                     void *idle_context, ArvBuffer **buffer, weft_error *err)
{
    ArvBuffer *old;
    *buffer = NULL;
    while ((old = arv_stream_try_pop_buffer(a->stream)) != NULL)
        arv_stream_push_buffer(a->stream, old);
    WEFT_TRY(check_there(a, err));
    WEFT_TRY(trigger(a, how, idle, idle_context, err));
    const double start_s = weft_clock_s(), ping_after_s = wait_s - ARAVIS_PING_S;
    bool pinged =
        ping_after_s < a->set.exposure_s + ARAVIS_PING_S; /* no time for it: a short deadline is enough */
    for (double elapsed_s = 0; !*buffer && elapsed_s < wait_s; elapsed_s = weft_clock_s() - start_s) {
        *buffer = arv_stream_timeout_pop_buffer(a->stream, SLICE_US);
        if (*buffer)
            break;
        WEFT_TRY(check_there(a, err));
        if (idle)
            WEFT_TRY(idle(idle_context, err));
        if (!pinged && elapsed_s > ping_after_s) {
            WEFT_TRY(ping(a, err));
            pinged = true;
        }
    }
    a->stale = !*buffer;
    return WEFT_OK;
}

enum { LAST_OF_16_BITS = 65535 };

/* The number of a frame comes with its first packet: a damaged one may bear that of a frame before. */
static void note_id(aravis_camera *a, ArvBuffer *buffer)
{
    const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    a->has_last_id = whole || (a->has_last_id && a->last_id != LAST_OF_16_BITS);
    a->last_id = whole ? arv_buffer_get_frame_id(buffer) : a->last_id + 1;
}

/* Frames that the camera has counted since the last one and that nobody asked for: its numbers have 16 bits,
 * which leave out 0, or 64. */
static uint64_t uncalled(const aravis_camera *a, uint64_t id)
{
    if (!a->has_last_id || id == a->last_id + 1)
        return 0;
    if (a->last_id <= LAST_OF_16_BITS && id <= a->last_id)
        return id + LAST_OF_16_BITS - a->last_id - 1;
    return id - a->last_id - 1;
}

/* The camera's clock at the begin of a frame's exposure; 0: it does not tell. */
static double stamp_of(ArvBuffer *buffer)
{
    return arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS
               ? 1e-9 * (double)arv_buffer_get_timestamp(buffer)
               : 0;
}

/* A frame was ours. */
static void learn_clock(aravis_camera *a, ArvBuffer *buffer)
{
    const double stamp_s = stamp_of(buffer);
    if (stamp_s > 0)
        weft_frame_clock_learn(&a->clock, stamp_s, a->triggered_s);
}

/* Frames of the shortest exposure that are forgotten.  The socket buffer grows only when the first frame's
 * leader has come, so that one often lacks packets; the others tell how the camera's clock stands.  A frame
 * among them that nobody asked for would spoil that. */
static weft_err throw_some_away(aravis_camera *a, weft_camera_idle_fn *idle, void *idle_context, bool *good,
                                weft_error *err)
{
    enum { FRAMES = 3 };
    *good = true;
    for (int i = 0; i < FRAMES && *good; i++) {
        ArvBuffer *buffer = NULL;
        WEFT_TRY(take(a, WEFT_TRIGGER_SOFTWARE, FIRST_FRAME_S,
                      a->trigger == WEFT_TRIGGER_WIRE ? NULL : idle, /* a call of idle would mean "armed" */
                      idle_context, &buffer, err));
        *good = buffer && (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS ||
                           uncalled(a, arv_buffer_get_frame_id(buffer)) == 0);
        if (!buffer)
            return WEFT_OK;
        learn_clock(a, buffer);
        note_id(a, buffer);
        arv_stream_push_buffer(a->stream, buffer);
    }
    return WEFT_OK;
}

static weft_err warm_up(aravis_camera *a, weft_camera_idle_fn *idle, void *idle_context, bool *good,
                        weft_error *err)
{
    double achieved_s;
    WEFT_TRY(aravis_set_exposure(a, a->exposure_min_s, &achieved_s, err));
    if (a->trigger == WEFT_TRIGGER_WIRE) /* nobody would send a pulse for these */
        WEFT_TRY(aravis_set_trigger_source(a, "Software", err));
    WEFT_TRY(throw_some_away(a, idle, idle_context, good, err));
    if (a->trigger == WEFT_TRIGGER_WIRE)
        WEFT_TRY(aravis_set_trigger_source(a, a->wire_source, err));
    return aravis_set_exposure(a, a->set.exposure_s, &achieved_s, err);
}

static weft_err start(aravis_camera *a, weft_camera_idle_fn *idle, void *idle_context, weft_error *err)
{
    enum { TRIES = 3, SILENT_TRIES = 2 };
    bool good, strayed = false;
    for (int i = 0; i < (strayed ? TRIES : SILENT_TRIES); i++) {
        WEFT_TRY(create_stream(a, err));
        ARAVIS_TRY(a, "starting the stream", arv_camera_start_acquisition(a->camera, &error));
        WEFT_TRY(warm_up(a, idle, idle_context, &good, err));
        if (good)
            return WEFT_OK;
        strayed = !a->stale;
        aravis_stop(a);
    }
    if (strayed)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "camera %s: sends frames that nobody asked for; find what else is triggering it",
                         a->address);
    return weft_fail(
        err, WEFT_ERR_TIMEOUT,
        "camera %s: answers, but none of its frames arrives; let a firewall pass UDP from it, and "
        "check that it has an address of this network",
        a->address);
}

static uint64_t missing_packets(const aravis_camera *a)
{
    guint64 resent = 0, missing = 0;
    if (ARV_IS_GV_STREAM(a->stream))
        arv_gv_stream_get_statistics(ARV_GV_STREAM(a->stream), &resent, &missing);
    return missing;
}

/* A frame of another trigger than ours, as far as that can be known; else false. */
static bool is_uncalled(const aravis_camera *a, ArvBuffer *buffer, double age_s, char reason[REASON_SIZE])
{
    const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    const uint64_t n = whole ? uncalled(a, arv_buffer_get_frame_id(buffer)) : 0;
    if (n > 0)
        snprintf(reason, REASON_SIZE,
                 "the camera counts %" PRIu64
                 " frames that nobody asked for: is something else triggering it?",
                 n);
    else if (age_s < a->set.exposure_s - EARLY_S)
        snprintf(reason, REASON_SIZE,
                 "a frame came that nobody asked for, %.2f s after the trigger of an exposure of %.2f s: is "
                 "something else triggering the camera?",
                 age_s, a->set.exposure_s);
    else
        return false;
    return true;
}

/* Whether the buffer is a whole frame of the kind that was asked for; else the reason in words. */
static bool is_whole(const aravis_camera *a, ArvBuffer *buffer, uint64_t n_missing, char reason[REASON_SIZE])
{
    const ArvBufferStatus status = arv_buffer_get_status(buffer);
    if (status != ARV_BUFFER_STATUS_SUCCESS) {
        snprintf(reason, REASON_SIZE, "the frame is incomplete (%" PRIu64 " packets missing): %s", n_missing,
                 aravis_status_words(status));
        return false;
    }
    size_t size = 0;
    const size_t wanted = weft_raw_format_bytes(&a->format, (size_t)a->info->width * (size_t)a->info->height);
    (void)arv_buffer_get_image_data(buffer, &size);
    if (arv_buffer_get_image_pixel_format(buffer) != a->code ||
        arv_buffer_get_image_width(buffer) != a->info->width ||
        arv_buffer_get_image_height(buffer) != a->info->height || size < wanted) {
        snprintf(reason, REASON_SIZE, "the frame is %d x %d of format 0x%08x, not %d x %d %s",
                 arv_buffer_get_image_width(buffer), arv_buffer_get_image_height(buffer),
                 (unsigned)arv_buffer_get_image_pixel_format(buffer), a->info->width, a->info->height,
                 a->format.name);
        return false;
    }
    return true;
}

static weft_err fill_mosaic(const aravis_camera *a, ArvBuffer *buffer, weft_mosaic *mosaic, weft_error *err)
{
    if (!mosaic->data || mosaic->width != a->info->width || mosaic->height != a->info->height) {
        weft_mosaic_fini(mosaic);
        WEFT_TRY(weft_mosaic_init(mosaic, a->info->width, a->info->height, a->format.cfa, err));
    }
    mosaic->cfa = a->format.cfa;
    mosaic->white = (float)a->info->white;
    for (int i = 0; i < 4; i++)
        mosaic->black[i] = (float)a->info->black[i];
    size_t size = 0;
    const uint8_t *const bytes = arv_buffer_get_image_data(buffer, &size);
    weft_raw_format_unpack(&a->format, bytes, (size_t)mosaic->width * (size_t)mosaic->height, mosaic->data);
    return WEFT_OK;
}

/* ---- frames that may be of another trigger ---- */

/* Lets what is under way come.  @param came  a frame did */
static weft_err wait_for_another(aravis_camera *a, double wait_s, weft_camera_idle_fn *idle,
                                 void *idle_context, bool *came, weft_error *err)
{
    const double end_s = weft_clock_s() + wait_s;
    *came = false;
    while (!*came && weft_clock_s() < end_s) {
        ArvBuffer *const buffer = arv_stream_timeout_pop_buffer(a->stream, SLICE_US);
        *came = buffer != NULL;
        if (buffer)
            arv_stream_push_buffer(a->stream, buffer);
        WEFT_TRY(check_there(a, err));
        if (idle)
            WEFT_TRY(idle(idle_context, err));
    }
    return WEFT_OK;
}

/* How long before its trigger the frame was begun, by the camera's clock; 0 when it was not. */
static double begun_early(const aravis_camera *a, double stamp_s)
{
    return stamp_s > 0 ? weft_frame_clock_early(&a->clock, stamp_s, a->triggered_s) : 0;
}

/* A frame seems to have been begun before it was called.  Either it is of another trigger, and then ours
 * comes after it; or the computer was busy each time that the clocks were compared, and this trigger was the
 * first to be quick: then the clocks are compared anew and the frame is taken again.
 *
 * @param stamp_s  the frame's, which counts as a comparison from the second time on
 * @param tried  how often this frame was doubted before
 * @param again  take it again; else frame->reason says what is wrong */
static weft_err settle_doubt(aravis_camera *a, double stamp_s, double early_s, int tried,
                             weft_camera_idle_fn *idle, void *idle_context, weft_captured_frame *frame,
                             bool *again, weft_error *err)
{
    enum { TRIES = 4 };
    const double triggered_s = a->triggered_s;
    const bool by_wire = a->trigger == WEFT_TRIGGER_WIRE; /* nobody would send a second pulse */
    bool another = false;
    if (!by_wire)
        WEFT_TRY(wait_for_another(a, a->set.exposure_s + OURS_COMES_S, idle, idle_context, &another, err));
    *again = !by_wire && !another && tried < TRIES;
    if (!*again) {
        frame->status = WEFT_FRAME_INCOMPLETE;
        snprintf(frame->reason, sizeof frame->reason,
                 "a frame came that nobody asked for, begun %.0f ms before its trigger: is something else "
                 "triggering the camera?",
                 1e3 * early_s);
        a->stale = true;
        return WEFT_OK;
    }
    weft_explain("camera %s: a frame seems to be begun %.1f ms before its trigger; comparing the clocks anew",
                 a->address, 1e3 * early_s);
    aravis_stop(a);
    WEFT_TRY(start(a, idle, idle_context, err));
    if (tried > 0) /* twice in a row: the triggers before were slow */
        weft_frame_clock_learn(&a->clock, stamp_s, triggered_s);
    return WEFT_OK;
}

static weft_err judge(aravis_camera *a, ArvBuffer *buffer, uint64_t n_missing, weft_captured_frame *frame,
                      weft_error *err)
{
    const double age_s = weft_clock_s() - a->triggered_s;
    frame->status = WEFT_FRAME_INCOMPLETE;
    frame->sequence = arv_buffer_get_frame_id(buffer);
    if (is_uncalled(a, buffer, age_s, frame->reason)) {
        a->stale = true; /* whose frame comes next is not known either */
        return WEFT_OK;
    }
    if (!is_whole(a, buffer, n_missing, frame->reason))
        return WEFT_OK;
    frame->status = WEFT_FRAME_COMPLETE;
    learn_clock(a, buffer);
    return fill_mosaic(a, buffer, &frame->mosaic, err);
}

weft_err aravis_expose(void *state, double deadline_s, weft_camera_idle_fn *idle, void *idle_context,
                       weft_captured_frame *frame, weft_error *err)
{
    aravis_camera *const a = state;
    WEFT_TRY(check_there(a, err));
    if (a->stale)
        aravis_stop(a);
    if (!a->stream)
        WEFT_TRY(start(a, idle, idle_context, err));
    frame->exposure_s = a->set.exposure_s;
    frame->gain = a->set.gain;
    bool again = true;
    for (int tried = 0; again; tried++) {
        ArvBuffer *buffer = NULL;
        const uint64_t missing_before = missing_packets(a);
        frame->reason[0] = '\0';
        again = false;
        WEFT_TRY(take(a, a->trigger, a->set.exposure_s + deadline_s, idle, idle_context, &buffer, err));
        if (!buffer) {
            frame->status = WEFT_FRAME_TIMEOUT;
            snprintf(frame->reason, sizeof frame->reason, "no frame came within %.1f s after the exposure",
                     deadline_s);
            return WEFT_OK;
        }
        const double stamp_s = stamp_of(buffer), early_s = begun_early(a, stamp_s);
        const weft_err status =
            early_s > 0 ? WEFT_OK : judge(a, buffer, missing_packets(a) - missing_before, frame, err);
        note_id(a, buffer);
        arv_stream_push_buffer(a->stream, buffer);
        WEFT_TRY(status);
        if (early_s > 0)
            WEFT_TRY(settle_doubt(a, stamp_s, early_s, tried, idle, idle_context, frame, &again, err));
    }
    return WEFT_OK;
}
