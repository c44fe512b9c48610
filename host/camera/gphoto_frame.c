/* Frames of still cameras: release, wait for the picture, fetch it, look at it. */
#include "host/camera/gphoto_private.h"

#include "core/formats/raw_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    SLICE_MS = 40,        /* of waiting, between two calls of idle */
    AFTER_MS = 20,        /* for a second picture of the same release */
    LONG_AFTER_MS = 1500, /* the same when an earlier picture may still come */
    MAX_DRAINED = 64,
};

/* A JPEG may come before its raw brother. */
#define BROTHER_S 1.0
/* A body whose line broke is looked for so long: a bumped plug, a USB reset. */
#define COME_BACK_S 2.5
/* What a file may say of its exposure: less than half of a third of a stop. */
#define SAME_EXPOSURE 0.11
/* The least that a body may take between accepting the release and being ready for another word. */
#define RETRY_MS 100

/** One release and what came of it. */
typedef struct shot {
    gphoto_camera *a;
    weft_camera_idle_fn *idle;
    void *idle_context;
    double end_s; /* of patience */
    weft_captured_frame *frame;
    int n_raw;
    bool have_jpeg, complete;
    double jpeg_s; /* when it came */
    bool broken;   /* the line: connect again */
    bool turned;   /* a dial, by hand: set it again */
} shot;

static weft_err call_idle(const shot *s, weft_error *err)
{
    return s->idle ? s->idle(s->idle_context, err) : WEFT_OK;
}

static void give_up(shot *s, weft_frame_status status, const char *reason)
{
    s->frame->status = status;
    snprintf(s->frame->reason, sizeof s->frame->reason, "%s", reason);
}

/* ---- one picture ---- */

static bool is_jpeg(const uint8_t *bytes, size_t n)
{
    return n > 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff;
}

static weft_err keep_bytes(weft_camera_file *file, const char *name, const void *bytes, size_t n,
                           weft_error *err)
{
    const char *const dot = strrchr(name, '.');
    uint8_t *const grown = weft_realloc(file->bytes, n, 1, err);
    if (!grown)
        return WEFT_ERR_NOMEM;
    memcpy(grown, bytes, n);
    file->bytes = grown;
    file->size = n;
    snprintf(file->suffix, sizeof file->suffix, "%s", dot && weft_raw_is_name(name) ? dot : ".raw");
    for (char *c = file->suffix; *c; c++)
        *c = (char)tolower((unsigned char)*c);
    return WEFT_OK;
}

/* The picture that was announced, as it is in the camera.  It stays on a card, and goes from memory. */
static weft_err fetch(shot *s, const CameraFilePath *path, weft_error *err)
{
    gphoto_session *const session = &s->a->session;
    CameraFile *file = NULL;
    const char *bytes = NULL;
    unsigned long n = 0;
    char sha256[65];
    int code = gp_file_new(&file);
    weft_err status = WEFT_OK;
    if (code == GP_OK)
        GPHOTO_CALL(session, code,
                    gp_camera_file_get(session->camera, path->folder, path->name, GP_FILE_TYPE_NORMAL, file,
                                       session->context));
    if (code == GP_OK)
        code = gp_file_get_data_and_size(file, &bytes, &n);
    if (code != GP_OK) {
        s->broken = true;
        goto out;
    }
    weft_sha256 hash;
    weft_sha256_init(&hash);
    weft_sha256_update(&hash, bytes, n);
    weft_sha256_final_hex(&hash, sha256);
    if (strcmp(sha256, s->a->last_sha256) == 0) { /* noise makes no two pictures alike */
        weft_explain("camera %s: the picture before was announced again; passed over", s->a->address);
    } else if (is_jpeg((const uint8_t *)bytes, n)) {
        s->have_jpeg = true;
        s->jpeg_s = weft_clock_s();
    } else {
        status = keep_bytes(&s->frame->file, path->name, bytes, n, err);
        s->n_raw++;
        memcpy(s->a->last_sha256, sha256, sizeof sha256);
    }
    if (path->folder[1] == '\0') { /* "/": not on a card */
        int ignored;
        GPHOTO_CALL(session, ignored,
                    gp_camera_file_delete(session->camera, path->folder, path->name, session->context));
        (void)ignored;
    }
out:
    if (file)
        gp_file_free(file);
    return status;
}

/* Waits for one event, at most `ms`.  @param none  nothing came */
static weft_err take_event(shot *s, int ms, bool discard, bool *none, weft_error *err)
{
    gphoto_session *const session = &s->a->session;
    CameraEventType type = GP_EVENT_UNKNOWN;
    void *data = NULL;
    int code;
    weft_err status = WEFT_OK;
    GPHOTO_CALL(session, code, gp_camera_wait_for_event(session->camera, ms, &type, &data, session->context));
    *none = code == GP_OK && type == GP_EVENT_TIMEOUT;
    if (code == GP_OK && type == GP_EVENT_FILE_ADDED && !discard)
        status = fetch(s, data, err);
    else if (code == GP_OK && type == GP_EVENT_CAPTURE_COMPLETE)
        s->complete = true;
    else if (code != GP_OK && code != GP_ERROR_CAMERA_BUSY)
        s->broken = true;
    free(data);
    return status;
}

/* What is left of an earlier release must not become this one's picture: it has another light. */
static weft_err drain(shot *s, weft_error *err)
{
    bool none = false;
    for (int i = 0; i < MAX_DRAINED && !none && !s->broken; i++) {
        WEFT_TRY(take_event(s, 1, true, &none, err));
        WEFT_TRY(call_idle(s, err));
    }
    s->complete = false;
    return WEFT_OK;
}

/* ---- the release ---- */

static bool store_is_full(gphoto_session *session)
{
    CameraStorageInformation *stores = NULL;
    int n = 0, code;
    bool full = false;
    GPHOTO_CALL(session, code, gp_camera_get_storageinfo(session->camera, &stores, &n, session->context));
    for (int i = 0; code == GP_OK && i < n; i++)
        full |= (stores[i].fields & GP_STORAGEINFO_FREESPACEKBYTES) && stores[i].freekbytes == 0;
    free(stores);
    return full;
}

/* The camera answers and does not release: find out why, libgphoto2 often does not say. */
static weft_err explain_refusal(gphoto_camera *a, int code, weft_error *err)
{
    char words[sizeof a->session.words];
    snprintf(words, sizeof words, "%s", a->session.words[0] ? a->session.words : gp_result_as_string(code));
    WEFT_TRY(gphoto_check_battery(a, err));
    if (code == GP_ERROR_NO_SPACE || store_is_full(&a->session))
        return gphoto_fail(&a->session, GP_ERROR_NO_SPACE, "releasing the shutter", err);
    WEFT_TRY(gphoto_make_settings(a, true, err)); /* a dial was turned: says which */
    return weft_fail(
        err, WEFT_ERR_DEVICE,
        "camera %s: it refuses to release the shutter (libgphoto2: %s); look at its display, and see "
        "that lens and body are on manual focus and no menu is open",
        a->address, words);
}

/* Blocks while the shutter is open. */
static weft_err release(shot *s, bool *released, weft_error *err)
{
    gphoto_session *const session = &s->a->session;
    for (;;) {
        int code;
        GPHOTO_CALL(session, code, gp_camera_trigger_capture(session->camera, session->context));
        *released = code == GP_OK;
        if (code == GP_OK)
            return WEFT_OK;
        if (code != GP_ERROR_CAMERA_BUSY) {
            s->broken = !gphoto_is_alive(session);
            return s->broken ? WEFT_OK : explain_refusal(s->a, code, err);
        }
        if (weft_clock_s() > s->end_s) {
            give_up(s, WEFT_FRAME_TIMEOUT,
                    "the camera is busy; leave its menu, and wait until its lamp is dark");
            return WEFT_OK;
        }
        WEFT_TRY(call_idle(s, err));
        usleep(RETRY_MS * 1000);
    }
}

static weft_err wait_for_picture(shot *s, weft_error *err)
{
    bool none = false;
    while (s->n_raw == 0 && !s->broken) {
        WEFT_TRY(take_event(s, SLICE_MS, false, &none, err));
        WEFT_TRY(call_idle(s, err));
        const double now_s = weft_clock_s();
        if (s->have_jpeg && now_s > s->jpeg_s + BROTHER_S)
            break;
        if (now_s > s->end_s)
            return WEFT_OK;
    }
    for (none = false; !none && !s->broken;) { /* its JPEG brother, and what is announced twice */
        WEFT_TRY(take_event(s, s->a->owing ? LONG_AFTER_MS : AFTER_MS, false, &none, err));
        WEFT_TRY(call_idle(s, err));
    }
    if (s->n_raw == 1)
        s->broken = false; /* the picture is here: whatever broke is the next release's */
    return WEFT_OK;
}

/* ---- looking at it ---- */

static bool differs(double found, double set)
{
    return found > 0 && fabs(log(found / set)) > SAME_EXPOSURE;
}

static void learn(gphoto_camera *a, const weft_captured_frame *frame)
{
    const weft_mosaic *const m = &frame->mosaic;
    a->info->width = m->width;
    a->info->height = m->height;
    a->info->cfa = m->cfa;
    a->info->white = (double)m->white;
    a->info->bits = m->white > 4095.5F ? m->white > 16383.5F ? 16 : 14 : 12;
    for (int i = 0; i < 4; i++)
        a->info->black[i] = (double)m->black[i];
    snprintf(a->info->suffix, sizeof a->info->suffix, "%s", frame->file.suffix);
}

/* Decodes the file and compares it with what was asked for. */
static void examine(shot *s, bool learning)
{
    weft_captured_frame *const f = s->frame;
    const gphoto_camera *const a = s->a;
    weft_frame_info info;
    weft_mosaic made = {0};
    weft_error error = {0};
    char reason[sizeof f->reason];
    if (weft_raw_read_bytes("the camera's file", f->file.bytes, f->file.size, &made, &info, &error) !=
        WEFT_OK) {
        snprintf(reason, sizeof reason, "%.*s", (int)sizeof reason - 1, error.text);
        give_up(s, WEFT_FRAME_INCOMPLETE, reason);
        return;
    }
    weft_mosaic_fini(&f->mosaic);
    f->mosaic = made;
    if (learning)
        learn(s->a, f);
    if (made.width != a->info->width || made.height != a->info->height || made.cfa != a->info->cfa) {
        snprintf(reason, sizeof reason,
                 "the picture is %d x %d and was %d x %d; was its size changed at the body?", made.width,
                 made.height, a->info->width, a->info->height);
        give_up(s, WEFT_FRAME_INCOMPLETE, reason);
    } else if (differs(info.exposure_s, a->set.exposure_s)) {
        s->turned = true;
        snprintf(reason, sizeof reason, "the picture says %g s where %g s was set; was a dial turned?",
                 info.exposure_s, a->set.exposure_s);
        give_up(s, WEFT_FRAME_INCOMPLETE, reason);
    } else if (differs(info.iso, a->set.gain * a->body->base_iso)) {
        s->turned = true;
        snprintf(reason, sizeof reason, "the picture says ISO %g where %g was set; was a dial turned?",
                 info.iso, a->set.gain * a->body->base_iso);
        give_up(s, WEFT_FRAME_INCOMPLETE, reason);
    } else {
        f->status = WEFT_FRAME_COMPLETE;
        f->reason[0] = '\0';
    }
}

/* ---- when it fails ---- */

/* The same body again, after a plug was bumped or the line was reset; set as it was. */
static weft_err connect_again(shot *s, weft_error *err)
{
    gphoto_camera *const a = s->a;
    const double end_s = weft_clock_s() + COME_BACK_S;
    weft_camera_state *const info = a->info;
    const weft_camera_state before = *info;
    weft_camera_settings got;
    weft_error last = {0};
    weft_err status;
    gphoto_disconnect(&a->session);
    for (;;) {
        status = gphoto_set_up(a, &last);
        if (status == WEFT_OK || weft_clock_s() > end_s)
            break;
        gphoto_disconnect(&a->session);
        WEFT_TRY(call_idle(s, err));
        usleep(RETRY_MS * 1000);
    }
    if (status == WEFT_OK && strcmp(info->serial, before.serial) != 0)
        status = weft_fail(&last, WEFT_ERR_MISMATCH, "camera %s: another body is there now (%s %s)",
                           a->address, info->model, info->serial);
    if (status == WEFT_OK)
        status = gphoto_set_exposure(a, a->set.exposure_s, a->set.gain, true, &got, &last);
    *info = before;
    if (status == WEFT_OK)
        return WEFT_OK;
    gphoto_disconnect(&a->session);
    weft_explain("%s", last.text);
    return weft_fail(err, WEFT_ERR_DEVICE,
                     "camera %s: the line to it broke and it does not come back; plug it in and switch it on",
                     a->address);
}

static weft_err conclude(shot *s, bool learning, weft_error *err)
{
    gphoto_camera *const a = s->a;
    weft_camera_settings got;
    if (s->n_raw == 1) {
        examine(s, learning);
        a->owing = false;
        return s->turned ? gphoto_set_exposure(a, a->set.exposure_s, a->set.gain, true, &got, err) : WEFT_OK;
    }
    if (s->n_raw > 1) { /* one of them is of another light, and nothing says which */
        give_up(s, WEFT_FRAME_INCOMPLETE,
                "the camera sent two pictures for one release; is it set to burst?");
        return gphoto_make_settings(a, true, err);
    }
    if (s->broken) {
        WEFT_TRY(connect_again(s, err));
        give_up(s, WEFT_FRAME_INCOMPLETE, "the line to the camera broke and was connected again");
        return WEFT_OK;
    }
    if (s->frame->reason[0]) /* said already */
        return WEFT_OK;
    if (s->have_jpeg) {
        give_up(s, WEFT_FRAME_INCOMPLETE, "the camera sent a JPEG and no raw picture; set it to raw alone");
        return gphoto_make_settings(a, true, err); /* again: somebody has changed them */
    }
    a->owing = true;
    give_up(s, WEFT_FRAME_TIMEOUT,
            s->complete ? "the camera released and sent no picture; is it set to save on its card?"
                        : "no picture came: did the shutter open? see the camera's display");
    return WEFT_OK;
}

weft_err gphoto_expose(gphoto_camera *a, double deadline_s, weft_camera_idle_fn *idle, void *idle_context,
                       bool learning, weft_captured_frame *frame, weft_error *err)
{
    bool released = false;
    shot s = {.a = a,
              .idle = idle,
              .idle_context = idle_context,
              .end_s = weft_clock_s() + a->set.exposure_s + deadline_s,
              .frame = frame};
    frame->reason[0] = '\0';
    frame->status = WEFT_FRAME_TIMEOUT;
    frame->exposure_s = a->set.exposure_s;
    frame->gain = a->set.gain;
    if (!a->session.camera) /* it was lost: the caller tries again */
        s.broken = true;
    if (!s.broken)
        WEFT_TRY(gphoto_check_battery(a, err));
    if (!s.broken)
        WEFT_TRY(drain(&s, err));
    if (!s.broken)
        WEFT_TRY(release(&s, &released, err));
    if (released)
        WEFT_TRY(wait_for_picture(&s, err));
    WEFT_TRY(conclude(&s, learning, err));
    frame->sequence = a->sequence += s.n_raw > 0;
    return WEFT_OK;
}
