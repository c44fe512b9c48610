/* The registry of camera backends, and what is the same for all of them. */
#include "host/camera/camera_remote.h"

#include "core/log.h"
#include "core/mem.h"

#include <stdio.h>
#include <string.h>

const weft_camera_kind weft_camera_kinds[] = {
    {"aravis", "GigE Vision and USB3 Vision cameras (Aravis)"},
    {"gphoto", "still cameras over USB and PTP/IP (libgphoto2)"},
    {"libcamera", "Raspberry Pi and other raw sensors (libcamera)"},
    {0},
};

enum { N_KINDS = sizeof weft_camera_kinds / sizeof weft_camera_kinds[0] - 1 };

/* Longer than any discovery: Aravis listens for a second, libgphoto2 walks the bus. */
#define LIST_S 20

/* Either a backend in this process with its state, or one in a helper. */
struct weft_camera_device {
    const weft_camera_backend *backend; /* NULL: `remote` */
    void *state;
    weft_camera_remote remote;
    char backend_name[16];
    weft_camera_state info;
    weft_camera_settings wanted;
    weft_camera_wait wait; /* idle and fire */
    bool fired;
};

bool weft_camera_is_installed(const char *backend)
{
    return weft_camera_child_exists(backend);
}

/* ---- finding ---- */

static weft_err take_list(weft_camera_child *child, weft_camera_found *found, int max, int *n,
                          weft_error *err)
{
    weft_camera_message *const m = weft_alloc(1, sizeof *m, err);
    const weft_camera_wait wait = {.deadline_s = LIST_S};
    if (!m)
        return WEFT_ERR_NOMEM;
    m->call = WEFT_CALL_LIST;
    const weft_err status = weft_camera_child_answer(child, &wait, m, NULL, err);
    const int here = status == WEFT_OK ? m->body.list.n : 0;
    *n = 0;
    for (int i = 0; i < here && i < WEFT_CAMERA_MESSAGE_MAX_FOUND && *n < max; i++) {
        weft_camera_found *const f = &found[(*n)++];
        *f = m->body.list.found[i];
        f->id[sizeof f->id - 1] = f->problem[sizeof f->problem - 1] = '\0';
        f->vendor[sizeof f->vendor - 1] = f->model[sizeof f->model - 1] = f->serial[sizeof f->serial - 1] =
            '\0';
    }
    weft_free(m);
    return status;
}

weft_err weft_camera_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    weft_camera_child children[N_KINDS];
    int total = 0;
    (void)err;
    for (int i = 0; i < N_KINDS; i++) { /* all look at the same time */
        weft_camera_message m = {.call = WEFT_CALL_LIST};
        weft_error problem = {0};
        const char *const name = weft_camera_kinds[i].name;
        children[i] = (weft_camera_child){.fd = -1};
        if (weft_camera_child_exists(name) &&
            (weft_camera_child_start(&children[i], name, &problem) != WEFT_OK ||
             weft_camera_child_ask(&children[i], &m, 0, &problem) != WEFT_OK))
            weft_warn("%s cameras cannot be looked for: %s", name, problem.text);
    }
    for (int i = 0; i < N_KINDS; i++) {
        weft_error problem = {0};
        int here = 0;
        if (children[i].pid == 0)
            continue;
        if (take_list(&children[i], found + total, max - total, &here, &problem) != WEFT_OK)
            weft_warn("%s cameras cannot be looked for: %s", weft_camera_kinds[i].name, problem.text);
        weft_camera_child_end(&children[i], 2);
        total += here;
    }
    *n = total;
    return WEFT_OK;
}

/* The id of the only camera of this machine. */
static weft_err choose(char id[128], weft_error *err)
{
    enum { MAX = 16 };
    weft_camera_found found[MAX];
    char names[800] = "";
    int n = 0;
    WEFT_TRY(weft_camera_list(found, MAX, &n, err));
    if (n == 0)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "no camera was found; check its power and cable, name it with --camera, or start a "
                         "virtual scanner (weft rig) and give --rig");
    if (n > 1) {
        for (int i = 0; i < n; i++) {
            const size_t used = strlen(names);
            snprintf(names + used, sizeof names - used, "%s%.48s", i ? ", " : "", found[i].id);
        }
        return weft_fail(err, WEFT_ERR_MISSING, "there are %d cameras: choose one with --camera: %s", n,
                         names);
    }
    if (found[0].problem[0])
        return weft_fail(err, WEFT_ERR_DEVICE, "%s", found[0].problem);
    memcpy(id, found[0].id, sizeof found[0].id);
    return WEFT_OK;
}

/* ---- opening ---- */

static weft_err begin(const char *name, const char *address, weft_camera_device **camera, weft_error *err)
{
    weft_camera_device *const d = weft_alloc(1, sizeof *d, err);
    if (!d)
        return WEFT_ERR_NOMEM;
    d->remote.child.fd = -1;
    snprintf(d->backend_name, sizeof d->backend_name, "%s", name);
    snprintf(d->info.id, sizeof d->info.id, "%s:%s", name, address);
    *camera = d;
    return WEFT_OK;
}

/* The id stays ours, whatever a backend writes. */
static weft_err finish(weft_camera_device *device, weft_err status, weft_camera_state *info,
                       weft_camera_device **camera)
{
    if (status != WEFT_OK) {
        weft_camera_close(device);
        return status;
    }
    memcpy(info->id, device->info.id, sizeof info->id);
    device->info = *info;
    *camera = device;
    return WEFT_OK;
}

weft_err weft_camera_open_on(const weft_camera_backend *backend, const char *address,
                             weft_camera_device **camera, weft_error *err)
{
    weft_camera_device *d = NULL;
    WEFT_TRY(begin(backend->name, address, &d, err));
    weft_camera_state info = {0};
    d->backend = backend;
    d->state = weft_alloc(1, backend->state_size, err);
    if (!d->state) {
        weft_free(d);
        return WEFT_ERR_NOMEM;
    }
    /* d->info is where a backend may keep writing to */
    const weft_err status = backend->open(d->state, address, &d->info, err);
    info = d->info;
    snprintf(info.id, sizeof info.id, "%s:%s", backend->name, address);
    memcpy(d->info.id, info.id, sizeof info.id);
    return finish(d, status, &info, camera);
}

static weft_err open_remote(const char *backend, const char *address, weft_camera_device **camera,
                            weft_error *err)
{
    weft_camera_device *d = NULL;
    weft_camera_state info = {0};
    WEFT_TRY(begin(backend, address, &d, err));
    return finish(d, weft_camera_remote_open(&d->remote, backend, address, &info, err), &info, camera);
}

weft_err weft_camera_open(const char *id, weft_camera_device **camera, weft_error *err)
{
    char chosen[128], names[256] = "";
    if (strcmp(id, "auto") == 0) {
        WEFT_TRY(choose(chosen, err));
        id = chosen;
    }
    const char *const colon = strchr(id, ':');
    for (const weft_camera_kind *k = weft_camera_kinds; k->name; k++) {
        const size_t n = strlen(k->name);
        if (colon && colon[1] && (size_t)(colon - id) == n && memcmp(id, k->name, n) == 0)
            return open_remote(k->name, colon + 1, camera, err);
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", k->name);
    }
    return weft_fail(
        err, WEFT_ERR_USAGE,
        "%s: wanted a camera as BACKEND:ADDRESS (such as aravis:192.168.1.20); this build has the "
        "backends %s",
        id, names);
}

/* ---- using ---- */

weft_err weft_camera_configure(weft_camera_device *camera, const weft_camera_settings *wanted,
                               weft_error *err)
{
    if (camera->backend) {
        WEFT_TRY(camera->backend->configure(camera->state, wanted, &camera->info, err));
    } else {
        weft_camera_state info;
        WEFT_TRY(weft_camera_remote_configure(&camera->remote, &camera->wait, wanted, &info, err));
        memcpy(info.id, camera->info.id, sizeof info.id);
        camera->info = info;
    }
    camera->wanted = *wanted;
    return WEFT_OK;
}

const weft_camera_state *weft_camera_get_state(const weft_camera_device *camera)
{
    return &camera->info;
}

const char *weft_camera_backend_name(const weft_camera_device *camera)
{
    return camera->backend_name;
}

void weft_camera_set_idle(weft_camera_device *camera, weft_camera_idle_fn *idle, void *context)
{
    camera->wait.idle = idle;
    camera->wait.context = context;
}

void weft_camera_set_fire(weft_camera_device *camera, weft_camera_fire_fn *fire, void *context)
{
    camera->wait.fire = fire;
    camera->wait.fire_context = context;
}

weft_err weft_camera_prepare(weft_camera_device *camera, weft_error *err)
{
    return camera->backend ? WEFT_OK : weft_camera_remote_prepare(&camera->remote, &camera->wait, err);
}

long weft_camera_process(const weft_camera_device *camera)
{
    return camera->backend ? 0 : camera->remote.child.pid;
}

/* A backend in this process: the first call of idle says that the camera is armed. */
static weft_err idle_here(void *context, weft_error *err)
{
    weft_camera_device *const d = context;
    if (!d->fired && d->wanted.trigger == WEFT_TRIGGER_WIRE && d->wait.fire) {
        d->fired = true;
        WEFT_TRY(d->wait.fire(d->wait.fire_context, err));
    }
    return d->wait.idle ? d->wait.idle(d->wait.context, err) : WEFT_OK;
}

weft_err weft_camera_expose(weft_camera_device *camera, double deadline_s, weft_captured_frame *frame,
                            weft_error *err)
{
    camera->fired = false;
    if (camera->backend)
        return camera->backend->expose(camera->state, deadline_s, idle_here, camera, frame, err);
    return weft_camera_remote_expose(&camera->remote, &camera->wait, deadline_s, frame, err);
}

void weft_captured_frame_fini(weft_captured_frame *frame)
{
    weft_mosaic_fini(&frame->mosaic);
    weft_free(frame->file.bytes);
    frame->file = (weft_camera_file){0};
}

void weft_camera_close(weft_camera_device *camera)
{
    if (!camera)
        return;
    if (camera->backend)
        camera->backend->close(camera->state);
    else
        weft_camera_remote_close(&camera->remote);
    weft_free(camera->state);
    weft_free(camera);
}
