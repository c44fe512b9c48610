/**
 * What weft doctor looks at: one table of checks (doctor_checks.c), run in order.
 *
 * A check is a function that looks at one thing, says what it found in one line and, when that is not as it
 * should be, the remedy in a second sentence.  A new one is a function, a declaration below and a line in the
 * table. Checks leave what they found in weft_doctor for those behind them, which say WEFT_DOCTOR_SKIPPED
 * with the reason when it is missing: one fault gives one failure.
 */
#ifndef WEFT_HOST_CLI_DOCTOR_H
#define WEFT_HOST_CLI_DOCTOR_H

#include "host/camera/camera.h"
#include "host/cli/device_options.h"
#include "host/light/controller.h"

#include <stdbool.h>

typedef enum weft_doctor_verdict {
    WEFT_DOCTOR_OK,
    WEFT_DOCTOR_WARNING, /* works, and may not work well; no failure of weft doctor */
    WEFT_DOCTOR_FAILED,
    WEFT_DOCTOR_SKIPPED, /* does not apply, or something before it failed */
} weft_doctor_verdict;

typedef struct weft_doctor_result {
    weft_doctor_verdict verdict;
    char text[640];   /* "1.1.0 (682aff81), as this build ships" */
    char remedy[400]; /* empty when ok or skipped, or when `text` says it */
} weft_doctor_result;

/** What is asked for, and what was found so far. */
typedef struct weft_doctor {
    weft_device_names names;
    bool is_rig;                 /* a virtual scanner: rules of udev and USB do not apply */
    bool walk;                   /* light lamp by lamp */
    const char *folder;          /* where scans will be kept */
    char port[256];              /* of the controller; empty: none found */
    bool port_is_free;           /* it may be opened */
    weft_controller *controller; /* open from its check to that of the serial line; NULL: none */
    weft_controller_info info;   /* firmware empty: nobody answered */
    char camera[128];            /* which one can be opened; empty: none */
} weft_doctor;

typedef struct weft_doctor_check {
    const char *name;
    void (*run)(weft_doctor *doctor, weft_doctor_result *result);
} weft_doctor_check;

/** In the order in which they run; ends with {0}. */
extern const weft_doctor_check weft_doctor_checks[];

/** Fills a result; `remedy` may be NULL. */
void weft_doctor_say(weft_doctor_result *result, weft_doctor_verdict verdict, const char *remedy,
                     const char *format, ...) WEFT_PRINTF(4, 5);

/* -- this computer (doctor_host.c) */

void weft_doctor_clock(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_disk(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_lens_module(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_avrdude(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_image(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_udev_rules(weft_doctor *doctor, weft_doctor_result *result);

/* -- light controller (doctor_light.c) */

void weft_doctor_board(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_permission(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_other_owner(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_controller(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_firmware(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_settings(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_last_start(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_serial_line(weft_doctor *doctor, weft_doctor_result *result);

/* -- camera (doctor_camera.c) */

void weft_doctor_camera_helpers(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_usb_cameras(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_camera(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_receive_buffer(weft_doctor *doctor, weft_doctor_result *result);
void weft_doctor_lamps(weft_doctor *doctor, weft_doctor_result *result);

#endif
