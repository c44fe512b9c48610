/* Still cameras under libgphoto2: who it is, what it is set to. */
#include "host/camera/gphoto_private.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A shutter speed must come within a sixth of a stop of the end of the body's list; inside the list nothing
 * is further away than that. */
#define NEAR_ENOUGH   (log(2) / 6 + 0.05)
#define BATTERY_EMPTY 5
#define BATTERY_LOW   20
/* The frame that tells the size of frames. */
#define LEARN_S          (1.0 / 60)
#define LEARN_DEADLINE_S 6

/* ---- who it is ---- */

static void read_text(gphoto_camera *a, const char *name, char *to, size_t size)
{
    char value[GPHOTO_TEXT] = "";
    gphoto_read(&a->session, name, value);
    snprintf(to, size, "%s", value);
}

static void identify(gphoto_camera *a)
{
    read_text(a, "manufacturer", a->info->vendor, sizeof a->info->vendor);
    read_text(a, "cameramodel", a->info->model, sizeof a->info->model);
    gphoto_read_serial(&a->session, a->info->serial);
    a->body = gphoto_body_find(a->info->vendor, a->info->model);
}

/* The first of "a|b" that the body has. */
static bool pick_name(gphoto_camera *a, const char *names, char name[32])
{
    gphoto_choice choice;
    for (int k = 0; gphoto_split(names, k, name, 32); k++)
        if (gphoto_get(&a->session, name, &choice)) {
            gphoto_choice_free(&choice);
            return true;
        }
    name[0] = '\0';
    return false;
}

/* ---- settings that never change ---- */

static weft_err make_setting(gphoto_camera *a, const gphoto_setting *setting, bool again, weft_error *err)
{
    gphoto_choice choice;
    char before[GPHOTO_TEXT], value[GPHOTO_TEXT] = "";
    if (!gphoto_get(&a->session, setting->name, &choice))
        return WEFT_OK; /* not a thing that this body has */
    memcpy(before, choice.value, sizeof before);
    const bool already = gphoto_find_value(&(const char *){before}, 1, setting->values) >= 0;
    const int wanted = gphoto_find_value(choice.texts, choice.n, setting->values);
    const bool keep = already && (!again || choice.read_only);
    int code = GP_OK;
    if (!keep && wanted >= 0) {
        snprintf(value, sizeof value, "%s", choice.texts[wanted]);
        code = gphoto_set(&a->session, &choice, setting->name, value);
    }
    gphoto_choice_free(&choice);
    const bool done =
        keep || (wanted >= 0 && code == GP_OK && gphoto_read(&a->session, setting->name, value) &&
                 gphoto_find_value(&(const char *){value}, 1, setting->values) >= 0);
    if (done || setting->wish)
        return WEFT_OK;
    if (code == GP_ERROR_IO || code == GP_ERROR_TIMEOUT || code == GP_ERROR_CAMERA_BUSY)
        return gphoto_fail(&a->session, code, setting->name, err);
    char first[GPHOTO_TEXT];
    gphoto_split(setting->values, 0, first, sizeof first);
    return weft_fail(err, WEFT_ERR_UNSUPPORTED, "camera %s: its setting %s %s \"%s\" and must be \"%s\"; %s",
                     a->address, setting->name, already ? "was changed from" : "stays at", before, first,
                     setting->remedy);
}

weft_err gphoto_make_settings(gphoto_camera *a, bool again, weft_error *err)
{
    for (int i = 0; i < GPHOTO_MAX_SETTINGS && a->body->settings[i].name; i++)
        WEFT_TRY(make_setting(a, &a->body->settings[i], again, err));
    return WEFT_OK;
}

weft_err gphoto_check_battery(gphoto_camera *a, weft_error *err)
{
    char value[GPHOTO_TEXT];
    double percent;
    if (!gphoto_read(&a->session, "batterylevel", value))
        return WEFT_OK;
    value[strcspn(value, "%")] = '\0';
    if (!weft_text_to_double(value, &percent)) /* some bodies say "Low" or "Unknown value" */
        return WEFT_OK;
    if (percent <= BATTERY_EMPTY)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "camera %s: its battery is at %.0f %%; charge it or connect the mains adapter",
                         a->address, percent);
    if (percent <= BATTERY_LOW && !a->warned_battery) {
        weft_warn("camera %s: its battery is at %.0f %%", a->address, percent);
        a->warned_battery = true;
    }
    return WEFT_OK;
}

weft_err gphoto_set_up(gphoto_camera *a, weft_error *err)
{
    WEFT_TRY(gphoto_connect(&a->session, a->address, err));
    identify(a);
    WEFT_TRY(gphoto_check_battery(a, err));
    WEFT_TRY(gphoto_make_settings(a, false, err));
    if (!pick_name(a, a->body->shutter, a->shutter))
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: %s %s lets no computer set its shutter speed; it cannot be used",
                         a->address, a->info->vendor, a->info->model);
    pick_name(a, a->body->iso, a->iso);
    return WEFT_OK;
}

/* ---- exposure ---- */

static weft_err cannot_expose(const gphoto_camera *a, const gphoto_choice *choice, double exposure_s,
                              weft_error *err)
{
    double least = INFINITY, most = 0, one;
    for (int i = 0; i < choice->n; i++)
        if (gphoto_parse_shutter(choice->texts[i], &one)) {
            least = fmin(least, one);
            most = fmax(most, one);
        }
    return weft_fail(err, WEFT_ERR_RANGE, "camera %s: an exposure of %g s is not possible, only %g to %g s",
                     a->address, exposure_s, least, most);
}

/* Sets one of a list of numbers and reads it back. */
static weft_err set_nearest(gphoto_camera *a, gphoto_choice *choice, const char *name, int nearest,
                            bool again, weft_error *err)
{
    char value[GPHOTO_TEXT], back[GPHOTO_TEXT] = "";
    snprintf(value, sizeof value, "%s", choice->texts[nearest]);
    if (strcmp(choice->value, value) == 0 && !again)
        return WEFT_OK;
    const int code = gphoto_set(&a->session, choice, name, value);
    if (code != GP_OK)
        return gphoto_fail(&a->session, code, name, err);
    if (gphoto_read(&a->session, name, back) && strcmp(back, value) == 0)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_PROTOCOL,
                     "camera %s: its %s stays at \"%s\" when told \"%s\"; turn the mode dial to M",
                     a->address, name, back, value);
}

static weft_err set_shutter(gphoto_camera *a, double exposure_s, bool again, double *achieved_s,
                            weft_error *err)
{
    gphoto_choice choice;
    weft_err status = WEFT_OK;
    if (!gphoto_get(&a->session, a->shutter, &choice))
        return gphoto_fail(&a->session, GP_ERROR, "asking for its shutter speeds", err);
    if (exposure_s <= 0 && gphoto_parse_shutter(choice.value, achieved_s)) {
        gphoto_choice_free(&choice);
        return WEFT_OK;
    }
    const double wanted_s = exposure_s > 0 ? exposure_s : LEARN_S;
    const int nearest = gphoto_nearest_shutter(choice.texts, choice.n, wanted_s, achieved_s);
    if (nearest < 0 || fabs(log(*achieved_s / wanted_s)) > NEAR_ENOUGH)
        status = cannot_expose(a, &choice, wanted_s, err);
    else
        status = set_nearest(a, &choice, a->shutter, nearest, again, err);
    gphoto_choice_free(&choice);
    return status;
}

/* @param gain  0: as it is, or base when that is no number (automatic) */
static weft_err set_iso(gphoto_camera *a, double gain, bool again, double *achieved, weft_error *err)
{
    gphoto_choice choice;
    double iso = 0;
    weft_err status = WEFT_OK;
    *achieved = 1;
    if (!a->iso[0] || !gphoto_get(&a->session, a->iso, &choice))
        return gain > 0 && gain != 1
                   ? weft_fail(err, WEFT_ERR_UNSUPPORTED,
                               "camera %s: its ISO speed cannot be set; leave the gain at 1", a->address)
                   : WEFT_OK;
    const double wanted = (gain > 0 ? gain : 1) * a->body->base_iso;
    const int nearest = gphoto_nearest_iso(choice.texts, choice.n, wanted, &iso);
    if (nearest < 0 || fabs(log(iso / wanted)) > NEAR_ENOUGH)
        status = weft_fail(err, WEFT_ERR_RANGE, "camera %s: gain %g is ISO %g, which it does not have",
                           a->address, gain, wanted);
    else
        status = set_nearest(a, &choice, a->iso, nearest, again, err);
    *achieved = iso / a->body->base_iso;
    gphoto_choice_free(&choice);
    return status;
}

weft_err gphoto_set_exposure(gphoto_camera *a, double exposure_s, double gain, bool again,
                             weft_camera_settings *got, weft_error *err)
{
    WEFT_TRY(set_iso(a, gain, again, &got->gain, err));
    return set_shutter(a, exposure_s, again, &got->exposure_s, err);
}

/* ---- the backend ---- */

/* Only a frame tells how large frames are, and where they begin and end: a short one, of whatever light. */
static weft_err learn_geometry(gphoto_camera *a, weft_error *err)
{
    enum { TRIES = 3 };
    const weft_camera_settings wanted = a->set;
    weft_captured_frame frame = {0};
    weft_err status =
        gphoto_set_exposure(a, fmin(wanted.exposure_s, LEARN_S), wanted.gain, false, &a->set, err);
    for (int try = 0; status == WEFT_OK && a->info->width == 0 && try < TRIES; try++)
        status = gphoto_expose(a, LEARN_DEADLINE_S, NULL, NULL, true, &frame, err);
    if (status == WEFT_OK && a->info->width == 0)
        status = weft_fail(err, WEFT_ERR_DEVICE, "camera %s: its first frame: %s", a->address, frame.reason);
    if (status == WEFT_OK)
        status = gphoto_set_exposure(a, wanted.exposure_s, wanted.gain, false, &a->set, err);
    weft_captured_frame_fini(&frame);
    return status;
}

static weft_err gphoto_configure(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                                 weft_error *err)
{
    gphoto_camera *const a = state;
    weft_camera_settings got = {0};
    const weft_camera_region *const r = &wanted->region;
    a->info = info;
    if (wanted->trigger == WEFT_TRIGGER_WIRE)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: a still camera has no trigger line; leave it out", a->address);
    if (r->width > 0 && (r->x || r->y || r->width != info->width || r->height != info->height))
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: a still camera has no region; take the whole frame", a->address);
    WEFT_TRY(gphoto_set_exposure(a, wanted->exposure_s, wanted->gain > 0 ? wanted->gain : a->set.gain, false,
                                 &got, err));
    a->set = got;
    if (info->width == 0)
        WEFT_TRY(learn_geometry(a, err));
    info->exposure_s = a->set.exposure_s;
    info->gain = a->set.gain;
    return WEFT_OK;
}

static weft_err gphoto_expose_frame(void *state, double deadline_s, weft_camera_idle_fn *idle,
                                    void *idle_context, weft_captured_frame *frame, weft_error *err)
{
    return gphoto_expose(state, deadline_s, idle, idle_context, false, frame, err);
}

static weft_err gphoto_open(void *state, const char *address, weft_camera_state *info, weft_error *err)
{
    gphoto_camera *const a = state;
    snprintf(a->address, sizeof a->address, "%s", address);
    a->info = info;
    WEFT_TRY(gphoto_set_up(a, err));
    WEFT_TRY(gphoto_set_exposure(a, 0, 0, false, &a->set, err));
    info->exposure_s = a->set.exposure_s;
    info->gain = a->set.gain;
    weft_explain("camera %s: %s %s, serial number %s", a->address, info->vendor, info->model, info->serial);
    return WEFT_OK;
}

static void gphoto_close(void *state)
{
    gphoto_camera *const a = state;
    gphoto_disconnect(&a->session);
    if (a->session.context)
        gp_context_unref(a->session.context);
    a->session.context = NULL;
}

/* Says who the camera is, or why that cannot be said. */
static void probe(const gphoto_seen *seen, weft_camera_found *f)
{
    gphoto_camera a = {0};
    weft_camera_state info = {0};
    weft_error problem = {0};
    *f = (weft_camera_found){0};
    snprintf(f->id, sizeof f->id, "gphoto:%s", seen->port);
    snprintf(f->model, sizeof f->model, "%s", seen->model);
    a.info = &info;
    snprintf(a.address, sizeof a.address, "%s", seen->port);
    if (gphoto_connect(&a.session, seen->port, &problem) == WEFT_OK) {
        identify(&a);
        memcpy(f->vendor, info.vendor, sizeof f->vendor);
        memcpy(f->model, info.model, sizeof f->model);
        memcpy(f->serial, info.serial, sizeof f->serial);
        gphoto_check_battery(&a, &problem);
    }
    if (f->serial[0])
        snprintf(f->id, sizeof f->id, "gphoto:serial:%s", f->serial); /* the same at every socket */
    snprintf(f->problem, sizeof f->problem, "%.255s", problem.text);
    gphoto_close(&a);
}

static weft_err gphoto_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    enum { MAX = 16 };
    gphoto_seen seen[MAX];
    WEFT_TRY(gphoto_look(seen, max < MAX ? max : MAX, n, err));
    for (int i = 0; i < *n; i++)
        probe(&seen[i], &found[i]);
    return WEFT_OK;
}

const weft_camera_backend weft_camera_gphoto = {
    .name = "gphoto",
    .summary = "still cameras over USB and PTP/IP (libgphoto2)",
    .state_size = sizeof(gphoto_camera),
    .list = gphoto_list,
    .open = gphoto_open,
    .configure = gphoto_configure,
    .expose = gphoto_expose_frame,
    .close = gphoto_close,
};
