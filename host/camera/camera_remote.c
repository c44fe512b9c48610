#include "host/camera/camera_remote.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Each is longer than the backend's own deadlines, which know better what is wrong: they strike when the
 * library hangs.  WEFT_CAMERA_PATIENCE (seconds) replaces all of them in tests. */
#define OPEN_S      30 /* a body that was switched off and on again takes its time over USB */
#define CONFIGURE_S 20
#define EXPOSE_S    12 /* beside exposure and deadline: starting a stream, unpacking, a slow body */
#define CLOSE_S     5

static double patience_s(double normal_s)
{
    const char *const given = getenv("WEFT_CAMERA_PATIENCE");
    char *end = NULL;
    const long seconds = given ? strtol(given, &end, 10) : 0;
    return given && *end == '\0' && seconds > 0 ? (double)seconds : normal_s;
}

/* A request and its answer; says in words which camera when the helper has ended. */
static weft_err call(weft_camera_remote *r, const weft_camera_wait *wait, weft_camera_message *m,
                     size_t body_size, int *fd, weft_error *err)
{
    weft_err status = weft_camera_child_ask(&r->child, m, body_size, err);
    if (status == WEFT_OK)
        status = weft_camera_child_answer(&r->child, wait, m, fd, err);
    if (status != WEFT_OK && r->child.pid == 0 && !r->child.stopped) {
        r->n_deaths++;
        weft_prefix(err, status, "camera %s", r->address);
    }
    return status;
}

/* The size of frames may be unknown until the camera is configured. */
static weft_err check_state(const weft_camera_remote *r, weft_camera_state *s, bool configured,
                            weft_error *err)
{
    char *const texts[] = {s->vendor, s->model, s->serial};
    for (int i = 0; i < 3; i++)
        texts[i][sizeof s->vendor - 1] = '\0';
    s->id[sizeof s->id - 1] = s->suffix[sizeof s->suffix - 1] = '\0';
    if (s->width == 0 && s->height == 0 && s->exposure_s > 0 && s->gain > 0 && !configured)
        return WEFT_OK;
    if (s->width < 2 || s->height < 2 || s->width > WEFT_IMAGE_MAX_SIDE || s->height > WEFT_IMAGE_MAX_SIDE ||
        s->bits < 1 || s->bits > 16 || s->cfa > WEFT_CFA_BGGR || !(s->white > 0 && s->white <= 65535) ||
        !(s->exposure_s > 0) || !(s->gain > 0))
        return weft_fail(err, WEFT_ERR_PROTOCOL,
                         "camera %s: its driver says impossible things about it (%d x %d, %d bits, white %g)",
                         r->address, s->width, s->height, s->bits, s->white);
    return WEFT_OK;
}

/* Starts the helper and opens the camera in it. */
static weft_err open_anew(weft_camera_remote *r, const weft_camera_wait *wait, weft_error *err)
{
    weft_camera_message m = {.call = WEFT_CALL_OPEN};
    weft_camera_wait patient = *wait;
    patient.deadline_s = patience_s(OPEN_S);
    patient.polite = false;
    weft_err status = weft_camera_child_start(&r->child, r->backend, err);
    if (status != WEFT_OK) {
        r->n_deaths += r->child.end[0] != '\0'; /* it started, and ended before its first word */
        return status;
    }
    snprintf(m.body.address, sizeof m.body.address, "%s", r->address);
    status = call(r, &patient, &m, sizeof m.body.address, NULL, err);
    if (status == WEFT_OK)
        status = check_state(r, &m.body.state, false, err);
    if (status == WEFT_OK)
        r->info = m.body.state;
    else
        weft_camera_child_end(&r->child, status == WEFT_ERR_CANCELLED ? 0 : patience_s(CLOSE_S));
    return status;
}

static weft_err idle_of_open(void *context, weft_error *err)
{
    (void)context;
    return weft_cancelled() ? weft_fail(err, WEFT_ERR_CANCELLED, "cancelled while opening the camera")
                            : WEFT_OK;
}

weft_err weft_camera_remote_open(weft_camera_remote *r, const char *backend, const char *address,
                                 weft_camera_state *info, weft_error *err)
{
    const weft_camera_wait wait = {.idle = idle_of_open};
    *r = (weft_camera_remote){.child.fd = -1};
    snprintf(r->backend, sizeof r->backend, "%s", backend);
    if (snprintf(r->address, sizeof r->address, "%s", address) >= (int)sizeof r->address)
        return weft_fail(err, WEFT_ERR_USAGE, "camera %.40s...: the address is too long", address);
    WEFT_TRY(open_anew(r, &wait, err));
    *info = r->info;
    return WEFT_OK;
}

static weft_err tell(weft_camera_remote *r, const weft_camera_wait *wait, const weft_camera_settings *wanted,
                     weft_error *err)
{
    weft_camera_message m = {.call = WEFT_CALL_CONFIGURE, .body.wanted = *wanted};
    weft_camera_wait patient = *wait;
    patient.deadline_s = patience_s(CONFIGURE_S);
    patient.polite = false;
    WEFT_TRY(call(r, &patient, &m, sizeof m.body.wanted, NULL, err));
    WEFT_TRY(check_state(r, &m.body.state, true, err));
    r->info = m.body.state;
    return WEFT_OK;
}

static weft_err check_same(const weft_camera_remote *r, const weft_camera_state *before, weft_error *err)
{
    const weft_camera_state *const now = &r->info;
    if (strcmp(now->vendor, before->vendor) == 0 && strcmp(now->model, before->model) == 0 &&
        strcmp(now->serial, before->serial) == 0)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH,
                     "camera %s: is now %s %s %s and was %s %s %s; connect that one again", r->address,
                     now->vendor, now->model, now->serial, before->vendor, before->model, before->serial);
}

/* The same camera in a new helper, set as it was: what comes next need not know. */
static weft_err come_back(weft_camera_remote *r, const weft_camera_wait *wait, weft_error *err)
{
    const weft_camera_state before = r->info;
    weft_explain("camera %s: its helper process %s; starting another", r->address, r->child.end);
    weft_err status = open_anew(r, wait, err);
    if (status == WEFT_OK)
        status = check_same(r, &before, err);
    if (status == WEFT_OK)
        status = tell(r, wait, &r->wanted, err);
    if (status == WEFT_OK && (r->info.width != before.width || r->info.height != before.height))
        status = weft_fail(err, WEFT_ERR_MISMATCH,
                           "camera %s: its frames are now %d x %d and were %d x %d; begin anew", r->address,
                           r->info.width, r->info.height, before.width, before.height);
    if (status != WEFT_OK) {
        weft_camera_child_end(&r->child, 0);
        r->info = before;
    }
    return status;
}

weft_err weft_camera_remote_prepare(weft_camera_remote *r, const weft_camera_wait *wait, weft_error *err)
{
    weft_err status = WEFT_OK;
    while (r->child.pid == 0) {
        const int deaths = r->n_deaths;
        if (deaths >= WEFT_CAMERA_MAX_DEATHS)
            return weft_fail(
                err, WEFT_ERR_DEVICE,
                "camera %s: its helper process ended %d times in a row (the last time it %s); it "
                "is not started again: unplug the camera, plug it in and try again",
                r->address, deaths, r->child.end);
        status = come_back(r, wait, err);
        if (status != WEFT_OK && r->n_deaths == deaths) /* not a death: the camera itself is in the way */
            return status;
    }
    return status;
}

weft_err weft_camera_remote_configure(weft_camera_remote *r, const weft_camera_wait *wait,
                                      const weft_camera_settings *wanted, weft_camera_state *info,
                                      weft_error *err)
{
    weft_err status;
    do { /* a helper that dies of it takes the limit of deaths to end this */
        WEFT_TRY(weft_camera_remote_prepare(r, wait, err));
        status = tell(r, wait, wanted, err);
    } while (status != WEFT_OK && r->child.pid == 0 && !r->child.stopped);
    if (status == WEFT_OK) {
        r->wanted = *wanted;
        *info = r->info;
    }
    return status;
}

/* ---- frames ---- */

static weft_err read_all(int fd, size_t from, void *to, size_t n, weft_error *err)
{
    size_t done = 0;
    while (done < n) {
        const ssize_t got = pread(fd, (char *)to + done, n - done, (off_t)(from + done));
        if (got == 0 || (got < 0 && errno != EINTR))
            return weft_fail_errno(err, WEFT_ERR_IO, "the memory of a frame cannot be read");
        done += got > 0 ? (size_t)got : 0;
    }
    return WEFT_OK;
}

static size_t sample_bytes(const weft_captured_frame *frame)
{
    return sizeof *frame->mosaic.data * (size_t)frame->mosaic.width * (size_t)frame->mosaic.height;
}

/* Takes over what the helper says of the frame, and its samples; false when they do not belong together. */
static bool fits(const weft_camera_remote *r, const weft_captured_frame *said, int fd)
{
    if (said->status == WEFT_FRAME_INCOMPLETE || said->status == WEFT_FRAME_TIMEOUT)
        return fd < 0 && said->reason[0];
    return said->status == WEFT_FRAME_COMPLETE && said->mosaic.width == r->info.width &&
           said->mosaic.height == r->info.height && said->mosaic.cfa <= WEFT_CFA_BGGR &&
           said->exposure_s > 0 && said->gain > 0 && said->file.size <= WEFT_CAMERA_MAX_FILE &&
           weft_camera_is_sealed_memory(fd, sample_bytes(said) + said->file.size);
}

/* The camera's own file lies behind the samples. */
static weft_err take_file(const weft_captured_frame *said, int fd, weft_camera_file *file, weft_error *err)
{
    if (said->file.size == 0) {
        weft_free(file->bytes);
        *file = (weft_camera_file){0};
        return WEFT_OK;
    }
    uint8_t *const bytes = weft_realloc(file->bytes, said->file.size, 1, err);
    if (!bytes)
        return WEFT_ERR_NOMEM;
    *file = said->file;
    file->bytes = bytes;
    file->suffix[sizeof file->suffix - 1] = '\0';
    return read_all(fd, sample_bytes(said), bytes, file->size, err);
}

static weft_err take_over(const weft_captured_frame *said, int fd, weft_captured_frame *frame,
                          weft_error *err)
{
    weft_mosaic *const m = &frame->mosaic;
    weft_mosaic kept = *m;
    weft_camera_file file;
    if (said->status == WEFT_FRAME_COMPLETE) {
        const weft_mosaic *const s = &said->mosaic;
        if (!kept.data || kept.width != s->width || kept.height != s->height) {
            weft_mosaic_fini(m);
            WEFT_TRY(weft_mosaic_init(m, s->width, s->height, s->cfa, err));
            kept = *m;
        }
        WEFT_TRY(read_all(fd, 0, kept.data, sample_bytes(said), err));
        WEFT_TRY(take_file(said, fd, &frame->file, err));
        uint16_t *const data = kept.data;
        kept = *s;
        kept.data = data;
    }
    file = frame->file;
    *frame = *said;
    frame->mosaic = kept;
    frame->file = file;
    return WEFT_OK;
}

static void abort_frame(const weft_camera_remote *r, weft_captured_frame *frame, const char *why)
{
    frame->status = WEFT_FRAME_ABORTED;
    frame->exposure_s = r->info.exposure_s;
    frame->gain = r->info.gain;
    snprintf(frame->reason, sizeof frame->reason, "%.*s", (int)sizeof frame->reason - 1, why);
}

weft_err weft_camera_remote_expose(weft_camera_remote *r, const weft_camera_wait *wait, double deadline_s,
                                   weft_captured_frame *frame, weft_error *err)
{
    weft_camera_message m = {.call = WEFT_CALL_EXPOSE, .body.deadline_s = deadline_s};
    weft_camera_wait patient = *wait;
    weft_error death = {0};
    int fd = -1;
    WEFT_TRY(weft_camera_remote_prepare(r, wait, err));
    patient.deadline_s = r->info.exposure_s + deadline_s + patience_s(EXPOSE_S);
    patient.polite = true;
    weft_err status = call(r, &patient, &m, sizeof m.body.deadline_s, &fd, &death);
    if (status == WEFT_OK && !fits(r, &m.body.frame, fd)) {
        weft_camera_child_end(&r->child, 0);
        r->n_deaths++;
        status = weft_fail(&death, WEFT_ERR_DEVICE,
                           "camera %s: its helper process sent a frame that is none "
                           "and was ended",
                           r->address);
    }
    if (status == WEFT_OK) {
        status = take_over(&m.body.frame, fd, frame, err);
        if (status == WEFT_OK && frame->status == WEFT_FRAME_COMPLETE)
            r->n_deaths = 0;
    } else if (r->child.pid == 0 && !r->child.stopped) {
        abort_frame(r, frame, death.text);
        status = WEFT_OK;
    } else if (err) {
        *err = death;
    }
    if (fd >= 0)
        close(fd);
    return status;
}

void weft_camera_remote_close(weft_camera_remote *r)
{
    weft_camera_child_end(&r->child, patience_s(CLOSE_S));
}
