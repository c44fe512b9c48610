/* Checks of the camera, and of the lamps by what it sees. */
#include "host/capture/light_print.h"
#include "host/capture/shoot.h"
#include "host/cli/device_open.h"
#include "host/cli/doctor.h"
#include "host/usb/usb_devices.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void weft_doctor_camera_helpers(weft_doctor *doctor, weft_doctor_result *result)
{
    char list[200] = "";
    (void)doctor;
    for (const weft_camera_kind *k = weft_camera_kinds; k->name; k++) {
        const size_t used = strlen(list);
        if (weft_camera_is_installed(k->name))
            snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", k->name);
    }
    if (list[0])
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s", list);
    else
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "build with libaravis-dev installed (./dev deps)",
                        "no helper weft-camera-NAME beside the program");
}

/* Plugged in, and may be opened: the libraries do not list a camera that may not. */
void weft_doctor_usb_cameras(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_usb_device devices[WEFT_USB_MAX];
    weft_error why = {0};
    int n = 0, n_cameras = 0;
    if (doctor->is_rig) {
        weft_doctor_say(result, WEFT_DOCTOR_SKIPPED, NULL, "the virtual scanner has none");
        return;
    }
    if (weft_usb_list(devices, WEFT_USB_MAX, &n, &why) != WEFT_OK) {
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, NULL, "%s", why.text);
        return;
    }
    for (int i = 0; i < n; i++) {
        if (devices[i].kind == WEFT_USB_CONTROLLER)
            continue;
        n_cameras++;
        if (devices[i].problem[0]) {
            weft_doctor_say(result, WEFT_DOCTOR_FAILED, devices[i].problem, "%s %s (%s) cannot be opened",
                            weft_usb_kind_name(devices[i].kind), devices[i].name, devices[i].identity);
            return;
        }
    }
    if (n_cameras == 0)
        weft_doctor_say(result, WEFT_DOCTOR_SKIPPED, NULL, "none plugged in");
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%d, free to be opened", n_cameras);
}

/* -- camera --------------------------------------------------------------------------------------------- */

void weft_doctor_camera(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    weft_camera_device *camera = NULL;
    if (weft_camera_open(doctor->names.camera, &camera, &why) != WEFT_OK) {
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why.text);
        return;
    }
    const weft_camera_state *const s = weft_camera_get_state(camera);
    snprintf(doctor->camera, sizeof doctor->camera, "%s", s->id);
    if (s->width > 0)
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s: %s %s, %d x %d, %d bits", s->id, s->vendor,
                        s->model, s->width, s->height, s->bits);
    else /* a still camera: only a picture would tell */
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%s: %s %s", s->id, s->vendor, s->model);
    weft_camera_close(camera);
}

/* A frame comes as some thousand packets in a row, and the program reads them when it is its turn. */
#define WANTED_BUFFER 33554432l

void weft_doctor_receive_buffer(weft_doctor *doctor, weft_doctor_result *result)
{
    static const char place[] = "/proc/sys/net/core/rmem_max";
    char line[32] = "";
    if (strncmp(doctor->camera, "aravis:", 7) != 0) {
        weft_doctor_say(result, WEFT_DOCTOR_SKIPPED, NULL, "no camera on the network");
        return;
    }
    FILE *const file = fopen(place, "r");
    const bool read = file && fgets(line, sizeof line, file);
    if (file)
        fclose(file);
    const long bytes = strtol(line, NULL, 10);
    if (!read)
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, NULL, "%s cannot be read", place);
    else if (bytes < WANTED_BUFFER)
        weft_doctor_say(result, WEFT_DOCTOR_WARNING,
                        "sudo sysctl -w net.core.rmem_max=33554432, and the same in /etc/sysctl.d/weft.conf",
                        "%ld bytes at most: frames may come incomplete", bytes);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "up to %ld bytes", bytes);
}

/* -- lamps ---------------------------------------------------------------------------------------------- */

enum { MAX_LAMPS = 16 };
static const double exposure_s = 0.02, settle_s = 0.02, frame_deadline_s = 5;
static const double least_rise = 0.001; /* of the range: more than the noise of a mean of any frame */
static const double least_share = 0.1;  /* of the middle lamp */
static const double most_room = 0.5;    /* likewise: what the picture may have with all lamps off */

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What the camera saw of the lamps: how much brighter than dark the picture is, and whose light it shows. */
typedef struct lamp_walk {
    int n;
    double dark, rise[MAX_LAMPS];
    weft_light_print dark_print, prints[MAX_LAMPS];
} lamp_walk;

/* Every lamp alone. */
static weft_err walk(weft_shooter *s, lamp_walk *w, weft_error *err)
{
    for (int i = -1; i < w->n; i++) {
        weft_shot shot;
        for (int k = 0; k < 3; k++) { /* a first frame, or a busy network, may fail once */
            WEFT_TRY(weft_shoot(s, i < 0 ? 0 : 1u << i, exposure_s, 1, &shot, err));
            if (!shot.reason[0])
                break;
        }
        if (shot.reason[0])
            return weft_fail(err, WEFT_ERR_DEVICE, "lamp %d: %s", i, shot.reason);
        const weft_light_print print =
            weft_light_print_make(&s->frame.mosaic, s->frame.exposure_s * s->frame.gain);
        if (i < 0) {
            w->dark = shot.stats.mean;
            w->dark_print = print;
        } else {
            w->rise[i] = shot.stats.mean - w->dark;
            w->prints[i] = print;
        }
    }
    return WEFT_OK;
}

/* Two wires to one lamp: " 7 and 8"; empty when there are none. */
static void find_twins(const lamp_walk *w, char *list, size_t size)
{
    list[0] = '\0';
    for (int i = 0; i < w->n; i++)
        for (int k = i + 1; k < w->n; k++) {
            const double d = weft_light_print_difference(&w->prints[i], &w->prints[k], &w->dark_print);
            const size_t used = strlen(list);
            if (d >= 0 && d < WEFT_PRINT_SAME_SHAPE)
                snprintf(list + used, size - used, "%s %d and %d", used ? "," : "", i, k);
        }
}

/* " 3, 5" */
static void add_lamp(char list[100], int lamp)
{
    const size_t used = strlen(list);
    snprintf(list + used, 100 - used, "%s %d", used ? "," : "", lamp);
}

static void judge(const lamp_walk *w, weft_doctor_result *result)
{
    double sorted[MAX_LAMPS];
    char dark[100] = "", weak[100] = "", twins[100];
    if (w->n < 1) {
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, "weft light set lights 10", "the controller has none");
        return;
    }
    memcpy(sorted, w->rise, (size_t)w->n * sizeof sorted[0]);
    qsort(sorted, (size_t)w->n, sizeof sorted[0], by_value);
    const double middle = sorted[w->n / 2];
    for (int i = 0; i < w->n; i++)
        if (w->rise[i] < least_rise)
            add_lamp(dark, i);
        else if (w->rise[i] < least_share * middle)
            add_lamp(weak, i);
    find_twins(w, twins, sizeof twins);
    if (dark[0] && w->dark > most_room * middle)
        weft_doctor_say(
            result, WEFT_DOCTOR_FAILED,
            "a lamp that always shines: replace its MOSFET (docs/hardware.md); or room light: darken it",
            "with all lamps off the picture is not dark (%.1f %% of the range), and it gets no lighter by%s",
            100 * w->dark, dark);
    else if (dark[0])
        weft_doctor_say(
            result, WEFT_DOCTOR_FAILED,
            "check the LED's 12 V, its polarity, its AND gate and MOSFET (docs/hardware.md), and that the "
            "lens cap is off",
            "the camera sees no light of%s", dark);
    else if (twins[0])
        weft_doctor_say(result, WEFT_DOCTOR_FAILED,
                        "follow the wires of both from the Arduino's pins to the LEDs",
                        "the same lamp shines for%s", twins);
    else if (w->dark > most_room * middle)
        weft_doctor_say(result, WEFT_DOCTOR_WARNING, "darken the room",
                        "with all lamps off the picture has %.1f %% of the range, with one on %.1f %% more",
                        100 * w->dark, 100 * middle);
    else if (weak[0])
        weft_doctor_say(result, WEFT_DOCTOR_WARNING,
                        "check its resistor and its aim, then calibrate the lights",
                        "much weaker than the others:%s", weak);
    else
        weft_doctor_say(result, WEFT_DOCTOR_OK, NULL, "%d lamps, %.1f to %.1f %% of the range above dark",
                        w->n, 100 * sorted[0], 100 * sorted[w->n - 1]);
}

void weft_doctor_lamps(weft_doctor *doctor, weft_doctor_result *result)
{
    weft_error why = {0};
    weft_shooter shooter = {.settle_s = settle_s, .deadline_s = frame_deadline_s};
    lamp_walk seen = {.n = doctor->info.n_lights < MAX_LAMPS ? doctor->info.n_lights : MAX_LAMPS};
    if (!doctor->walk || !doctor->camera[0] || !doctor->info.firmware[0]) {
        weft_doctor_say(result, WEFT_DOCTOR_SKIPPED, NULL, "%s",
                        doctor->walk ? "needs controller and camera"
                                     : "not asked for: --lamps lights each before the camera");
        return;
    }
    weft_device_names names = doctor->names;
    snprintf(names.port, sizeof names.port, "%s", doctor->port);
    weft_err status = weft_camera_open(doctor->camera, &shooter.camera, &why);
    if (status == WEFT_OK)
        status = weft_device_open_controller(&names, &shooter.controller, &why);
    if (status == WEFT_OK) {
        shooter.level = doctor->info.level_max;
        weft_controller_panic_on_crash(shooter.controller);
        weft_shooter_begin(&shooter);
        status = walk(&shooter, &seen, &why);
        weft_shooter_end(&shooter);
        if (status == WEFT_OK)
            judge(&seen, result);
    }
    if (status != WEFT_OK)
        weft_doctor_say(result, WEFT_DOCTOR_FAILED, NULL, "%s", why.text);
    weft_controller_close(shooter.controller);
    weft_camera_close(shooter.camera);
}
