/* weft devices: what there is, and why one cannot be used. */
#include "core/mem.h"
#include "core/progress.h"
#include "host/cli/command.h"
#include "host/cli/device_open.h"
#include "host/usb/usb_devices.h"

#include <stdio.h>
#include <string.h>

enum { MAX_DEVICES = 32 };

typedef struct devices_args {
    weft_device_options devices;
    bool watch;
} devices_args;

static const weft_field devices_fields[] = {
    WEFT_DEVICE_FIELDS(devices_args, devices),
    {.key = "watch",
     .type = WEFT_FIELD_FLAG,
     .offset = offsetof(devices_args, watch),
     .help = "tell what is plugged in and out over USB, a line each, until Ctrl-C; nothing is opened"},
    {0},
};

/* A serial port and who answered on it. */
typedef struct found_controller {
    char port[256];
    weft_controller_info info;
    char problem[512]; /* empty: it answered */
} found_controller;

typedef struct found_devices {
    int n_cameras, n_controllers;
    weft_camera_found cameras[MAX_DEVICES];
    found_controller controllers[MAX_DEVICES];
} found_devices;

static void try_camera(const char *id, found_devices *found)
{
    weft_camera_found *const f = &found->cameras[found->n_cameras++];
    weft_camera_device *camera = NULL;
    weft_error problem = {0};
    *f = (weft_camera_found){0};
    snprintf(f->id, sizeof f->id, "%s", id);
    if (weft_camera_open(id, &camera, &problem) != WEFT_OK) {
        snprintf(f->problem, sizeof f->problem, "%.255s", problem.text);
        return;
    }
    const weft_camera_state *const state = weft_camera_get_state(camera);
    memcpy(f->vendor, state->vendor, sizeof f->vendor);
    memcpy(f->model, state->model, sizeof f->model);
    memcpy(f->serial, state->serial, sizeof f->serial);
    weft_camera_close(camera);
}

static void try_port(const char *port, found_devices *found)
{
    found_controller *const f = &found->controllers[found->n_controllers++];
    weft_controller *controller = NULL;
    weft_error problem = {0};
    *f = (found_controller){0};
    snprintf(f->port, sizeof f->port, "%s", port);
    if (weft_controller_open(port, WEFT_DEVICE_LEASE_MS, &controller, &problem) != WEFT_OK) {
        snprintf(f->problem, sizeof f->problem, "%.511s", problem.text);
        return;
    }
    f->info = *weft_controller_get_info(controller);
    weft_controller_close(controller);
}

static weft_err try_ports(found_devices *found, weft_error *err)
{
    char **ports = NULL;
    WEFT_TRY(weft_controller_list_ports(&ports, err));
    for (int i = 0; ports[i] && i < MAX_DEVICES; i++)
        try_port(ports[i], found);
    weft_controller_free_ports(ports);
    return WEFT_OK;
}

static bool is_listed(const found_devices *found, const weft_usb_device *usb)
{
    for (int i = 0; i < found->n_cameras; i++)
        if (usb->serial[0] && strcmp(found->cameras[i].serial, usb->serial) == 0)
            return true;
    return false;
}

/* Cameras on USB that no library could open, and so did not list: why. */
static weft_err add_locked_cameras(found_devices *found, weft_error *err)
{
    weft_usb_device usb[MAX_DEVICES];
    int n = 0;
    WEFT_TRY(weft_usb_list(usb, MAX_DEVICES, &n, err));
    for (int i = 0; i < n && found->n_cameras < MAX_DEVICES; i++) {
        if (usb[i].kind == WEFT_USB_CONTROLLER || !usb[i].problem[0] || is_listed(found, &usb[i]))
            continue;
        weft_camera_found *const f = &found->cameras[found->n_cameras++];
        *f = (weft_camera_found){0};
        snprintf(f->id, sizeof f->id, "usb:%s", usb[i].identity);
        snprintf(f->vendor, sizeof f->vendor, "%s", weft_usb_kind_name(usb[i].kind));
        snprintf(f->model, sizeof f->model, "%.63s", usb[i].name);
        snprintf(f->serial, sizeof f->serial, "%.63s", usb[i].serial);
        snprintf(f->problem, sizeof f->problem, "%.255s", usb[i].problem);
    }
    return WEFT_OK;
}

/* What was named is tried and nothing else; without a name everything is looked for. */
static weft_err find_devices(const weft_device_options *options, found_devices *found, weft_error *err)
{
    const bool all = !options->rig && !options->port && !options->camera;
    weft_device_names names;
    WEFT_TRY(weft_device_options_resolve(options, &names, err));
    if (all)
        WEFT_TRY(weft_camera_list(found->cameras, MAX_DEVICES, &found->n_cameras, err));
    if (all)
        WEFT_TRY(add_locked_cameras(found, err));
    else if (options->rig || options->camera)
        try_camera(names.camera, found);
    if (all)
        WEFT_TRY(try_ports(found, err));
    else if (names.port[0])
        try_port(names.port, found);
    return WEFT_OK;
}

static json_t *problem_to_json(const char *problem)
{
    return problem[0] ? json_string(problem) : json_null();
}

static json_t *to_json(const found_devices *found)
{
    json_t *const cameras = json_array(), *const controllers = json_array();
    for (int i = 0; i < found->n_cameras; i++) {
        const weft_camera_found *const f = &found->cameras[i];
        json_array_append_new(cameras, json_pack("{s:s, s:s, s:s, s:s, s:o}", "id", f->id, "vendor",
                                                 f->vendor, "model", f->model, "serial", f->serial, "problem",
                                                 problem_to_json(f->problem)));
    }
    for (int i = 0; i < found->n_controllers; i++) {
        const found_controller *const f = &found->controllers[i];
        json_array_append_new(controllers,
                              json_pack("{s:s, s:s, s:s, s:i, s:o}", "port", f->port, "firmware",
                                        f->info.firmware, "serial", f->info.serial_number, "lights",
                                        f->info.n_lights, "problem", problem_to_json(f->problem)));
    }
    return json_pack("{s:o, s:o}", "cameras", cameras, "controllers", controllers);
}

static void print_devices(const found_devices *found, FILE *out)
{
    fputs(found->n_cameras ? "cameras:\n" : "cameras: none found\n", out);
    for (int i = 0; i < found->n_cameras; i++) {
        const weft_camera_found *const f = &found->cameras[i];
        fprintf(out, "  %-28s %s %s%s%s: %s\n", f->id, f->vendor, f->model, f->serial[0] ? ", serial " : "",
                f->serial, f->problem[0] ? f->problem : "ready");
    }
    fputs(found->n_controllers ? "light controllers:\n" : "light controllers: none found\n", out);
    for (int i = 0; i < found->n_controllers; i++) {
        const found_controller *const f = &found->controllers[i];
        if (f->problem[0])
            fprintf(out, "  %-28s %s\n", f->port, f->problem);
        else
            fprintf(out, "  %-28s firmware %s, %d lights%s%s: ready\n", f->port, f->info.firmware,
                    f->info.n_lights, f->info.serial_number[0] ? ", serial " : "", f->info.serial_number);
    }
}

static weft_err tell_event(const weft_invocation *inv, bool appeared, const weft_usb_device *d,
                           weft_error *err)
{
    const char *const what = appeared ? "appeared" : "vanished";
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:o}", "event", what, "kind",
                                         weft_usb_kind_name(d->kind), "identity", d->identity, "name",
                                         d->name, "node", d->node, "socket", d->place, "problem",
                                         problem_to_json(appeared ? d->problem : "")),
                               err);
    fprintf(inv->out, "%s  %-18s %s  %s at %s (%s)%s%s\n", what, weft_usb_kind_name(d->kind), d->identity,
            d->name, d->place, d->node, appeared && d->problem[0] ? ": " : "", appeared ? d->problem : "");
    fflush(inv->out);
    return WEFT_OK;
}

static weft_err watch_devices(const weft_invocation *inv, weft_error *err)
{
    enum { SLICE_MS = 200 };
    weft_usb_watch *watch = NULL;
    weft_err status = WEFT_OK;
    WEFT_TRY(weft_usb_watch_open(&watch, err));
    while (status == WEFT_OK && !weft_cancelled()) {
        weft_usb_device d;
        bool happened, appeared;
        status = weft_usb_watch_next(watch, SLICE_MS, &happened, &appeared, &d, err);
        if (status == WEFT_OK && happened)
            status = tell_event(inv, appeared, &d, err);
    }
    weft_usb_watch_close(watch);
    return status;
}

static weft_err run_devices(const weft_invocation *inv, const void *args, weft_error *err)
{
    const devices_args *const a = args;
    if (a->watch)
        return watch_devices(inv, err);
    found_devices *const found = weft_alloc(1, sizeof *found, err);
    if (!found)
        return WEFT_ERR_NOMEM;
    weft_err status = find_devices(&a->devices, found, err);
    if (status == WEFT_OK && inv->json)
        status = weft_print_json(inv, to_json(found), err);
    else if (status == WEFT_OK)
        print_devices(found, inv->out);
    weft_free(found);
    return status;
}

/* Nothing is opened, and it never ends: nothing for the one who owns the scanner. */
static bool is_watch(const void *args)
{
    return ((const devices_args *)args)->watch;
}

const weft_command weft_cmd_devices = {
    .name = "devices",
    .summary = "cameras and light controllers found, and why one cannot be used",
    .operands = "",
    .args_size = sizeof(devices_args),
    .fields = devices_fields,
    .details =
        "Without options it looks for everything: GigE Vision cameras on every network interface, USB3\n"
        "Vision cameras, and serial ports that may be a light controller (opening one resets an Arduino).\n"
        "With --rig, --port or --camera it tries what they name and nothing else.\n"
        "--watch tells of USB devices that come and go: a device keeps its identity in every socket.",
    .example = "weft devices --json",
    .run = run_devices,
    .stays_here = is_watch,
};
