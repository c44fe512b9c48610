/* The registry of camera backends, and what is the same for all of them. */
#include "host/camera/camera.h"

#include "core/mem.h"

#include <stdio.h>
#include <string.h>

const weft_camera_backend *const weft_camera_backends[] = {
    &weft_camera_aravis,
    NULL,
};

struct weft_camera_device {
    const weft_camera_backend *backend;
    void *state;
    weft_camera_state info;
    weft_camera_idle_fn *idle;
    void *idle_context;
};

weft_err weft_camera_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    int total = 0;
    for (const weft_camera_backend *const *b = weft_camera_backends; *b && total < max; b++) {
        int here = 0;
        WEFT_TRY((*b)->list(found + total, max - total, &here, err));
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

weft_err weft_camera_open_on(const weft_camera_backend *backend, const char *address,
                             weft_camera_device **camera, weft_error *err)
{
    weft_camera_device *const device = weft_alloc(1, sizeof *device, err);
    void *const state = weft_alloc(1, backend->state_size, err);
    if (!device || !state) {
        weft_free(device);
        weft_free(state);
        return WEFT_ERR_NOMEM;
    }
    *device = (weft_camera_device){.backend = backend, .state = state};
    const weft_err status = backend->open(state, address, &device->info, err);
    if (status != WEFT_OK) {
        weft_camera_close(device);
        return status;
    }
    snprintf(device->info.id, sizeof device->info.id, "%s:%s", backend->name, address);
    *camera = device;
    return WEFT_OK;
}

weft_err weft_camera_open(const char *id, weft_camera_device **camera, weft_error *err)
{
    char chosen[128], names[256] = "";
    if (strcmp(id, "auto") == 0) {
        WEFT_TRY(choose(chosen, err));
        id = chosen;
    }
    const char *const colon = strchr(id, ':');
    for (const weft_camera_backend *const *b = weft_camera_backends; *b; b++) {
        const size_t n = strlen((*b)->name);
        if (colon && colon[1] && (size_t)(colon - id) == n && memcmp(id, (*b)->name, n) == 0)
            return weft_camera_open_on(*b, colon + 1, camera, err);
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", (*b)->name);
    }
    return weft_fail(
        err, WEFT_ERR_USAGE,
        "%s: wanted a camera as BACKEND:ADDRESS (such as aravis:192.168.1.20); this build has the "
        "backends %s",
        id, names);
}

weft_err weft_camera_configure(weft_camera_device *camera, const weft_camera_settings *wanted,
                               weft_error *err)
{
    return camera->backend->configure(camera->state, wanted, &camera->info, err);
}

const weft_camera_state *weft_camera_get_state(const weft_camera_device *camera)
{
    return &camera->info;
}

const char *weft_camera_backend_name(const weft_camera_device *camera)
{
    return camera->backend->name;
}

void weft_camera_set_idle(weft_camera_device *camera, weft_camera_idle_fn *idle, void *context)
{
    camera->idle = idle;
    camera->idle_context = context;
}

weft_err weft_camera_expose(weft_camera_device *camera, double deadline_s, weft_captured_frame *frame,
                            weft_error *err)
{
    return camera->backend->expose(camera->state, deadline_s, camera->idle, camera->idle_context, frame, err);
}

void weft_camera_close(weft_camera_device *camera)
{
    if (!camera)
        return;
    camera->backend->close(camera->state);
    weft_free(camera->state);
    weft_free(camera);
}
