#include "host/cli/device_options.h"

#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"
#include "host/cli/rig_start.h"

#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#define RIG_VERSION 1

static weft_err copy_name(char *to, size_t size, const char *name, const char *option, weft_error *err)
{
    const size_t n = strlen(name);
    if (n == 0 || n >= size)
        return weft_fail(err, WEFT_ERR_USAGE, "--%s: wanted a name of 1 to %zu bytes, not %zu", option,
                         size - 1, n);
    memcpy(to, name, n + 1);
    return WEFT_OK;
}

/* A rig that was killed leaves its file: only a living process is a rig. */
static weft_err check_alive(const json_t *rig, const char *folder, const char *place, weft_error *err)
{
    int pid = 0;
    WEFT_TRY(weft_json_get_int(rig, "pid", WEFT_JSON_REQUIRED, 1, INT_MAX, &pid, place, err));
    if (kill((pid_t)pid, 0) != 0 && errno == ESRCH)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: the virtual scanner has ended (process %d is gone); start it again with "
                         "\"weft rig --dir %s\"",
                         folder, pid, folder);
    return WEFT_OK;
}

/* Of a rig's cameras the one of this backend. */
static weft_err pick_camera(const json_t *rig, const char *backend, const char *place, const char **camera,
                            weft_error *err)
{
    char there[300] = "";
    size_t i;
    const json_t *one;
    const size_t n = strlen(backend);
    json_array_foreach(json_object_get(rig, "cameras"), i, one)
    {
        const char *const id = json_string_value(one);
        const size_t used = strlen(there);
        if (id && strncmp(id, backend, n) == 0 && id[n] == ':') {
            *camera = id;
            return WEFT_OK;
        }
        snprintf(there + used, sizeof there - used, "%s%s", used ? ", " : "", id ? id : "?");
    }
    return weft_fail(err, WEFT_ERR_MISSING,
                     "--camera %s: the virtual scanner of %s has no such camera, only %s", backend, place,
                     there);
}

static weft_err read_rig(const json_t *rig, const char *folder, const char *place, const char *backend,
                         weft_device_names *names, weft_error *err)
{
    const char *pty = NULL, *camera = NULL;
    WEFT_TRY(check_alive(rig, folder, place, err));
    WEFT_TRY(weft_json_get_text(rig, "pty", WEFT_JSON_REQUIRED, &pty, place, err));
    if (!pty[0])
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: its light controller is unplugged; weft rig --dir %s --tell \"board plug\"",
                         folder, folder);
    WEFT_TRY(weft_json_get_text(rig, "camera", WEFT_JSON_REQUIRED, &camera, place, err));
    if (backend)
        WEFT_TRY(pick_camera(rig, backend, place, &camera, err));
    if (copy_name(names->port, sizeof names->port, pty, "rig", NULL) != WEFT_OK ||
        copy_name(names->camera, sizeof names->camera, camera, "rig", NULL) != WEFT_OK)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: \"pty\" or \"camera\" is empty or too long", place);
    return WEFT_OK;
}

/* The rig's ports lie in DIR/dev, as a computer's in /dev. */
static weft_err name_dev(const char *folder, weft_device_names *names, weft_error *err)
{
    if (snprintf(names->dev, sizeof names->dev, "%s/dev", folder) < (int)sizeof names->dev)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_USAGE, "%s: the path of this folder is too long", folder);
}

/* @param backend  NULL: the rig's first camera */
static weft_err load_rig(const char *folder, const char *backend, weft_device_names *names, weft_error *err)
{
    json_t *rig = NULL;
    WEFT_TRY(weft_rig_start_wait(folder, err));
    char *const path = weft_path_join(folder, "rig.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status;
    if (!weft_file_exists(path))
        status = weft_fail(err, WEFT_ERR_MISSING,
                           "%s: no virtual scanner runs there (no rig.json); start one with "
                           "\"weft rig --dir %s\"",
                           folder, folder);
    else
        status = weft_json_load_kind(path, "rig", RIG_VERSION, &rig, err);
    if (status == WEFT_OK)
        status = read_rig(rig, folder, path, backend, names, err);
    if (status == WEFT_OK)
        status = name_dev(folder, names, err);
    json_decref(rig);
    weft_free(path);
    return status;
}

weft_err weft_device_options_resolve(const weft_device_options *options, weft_device_names *names,
                                     weft_error *err)
{
    weft_device_names resolved = {.dev = "/dev", .camera = "auto"};
    const bool backend_alone = options->rig && options->camera && options->camera[0] &&
                               !strchr(options->camera, ':') && strcmp(options->camera, "auto") != 0;
    if (options->rig)
        WEFT_TRY(load_rig(options->rig, backend_alone ? options->camera : NULL, &resolved, err));
    if (options->port)
        WEFT_TRY(copy_name(resolved.port, sizeof resolved.port, options->port, "port", err));
    if (options->camera && !backend_alone)
        WEFT_TRY(copy_name(resolved.camera, sizeof resolved.camera, options->camera, "camera", err));
    *names = resolved;
    return WEFT_OK;
}
