/**
 * Which devices a hardware command talks to: --rig, --port and --camera, the same for all of them.
 *
 * A command puts a weft_device_options into its struct of options and the rows into its table:
 *
 *     typedef struct light_args { weft_device_options devices; int level; } light_args;
 *     static const weft_field light_fields[] = {
 *         WEFT_DEVICE_FIELDS(light_args, devices),
 *         {.key = "level", ...},
 *         {0},
 *     };
 *
 * A command without a camera takes WEFT_CONTROLLER_FIELDS, one without lights WEFT_CAMERA_FIELDS.
 */
#ifndef WEFT_HOST_CLI_DEVICE_OPTIONS_H
#define WEFT_HOST_CLI_DEVICE_OPTIONS_H

#include "core/error.h"
#include "core/fields.h"

/** As given by the user; NULL where nothing was. */
typedef struct weft_device_options {
    const char *rig;    /* folder of a running virtual scanner */
    const char *port;   /* serial line of the light controller */
    const char *camera; /* "backend:address" */
} weft_device_options;

#define WEFT_RIG_FIELD(args_type, member)                                                                    \
    {                                                                                                        \
        .key = "rig", .type = WEFT_FIELD_TEXT,                                                               \
        .offset = offsetof(args_type, member) + offsetof(weft_device_options, rig), .unit = "DIR",           \
        .help = "use the virtual scanner that runs in DIR (weft rig --dir DIR)"                              \
    }
#define WEFT_PORT_FIELD(args_type, member)                                                                   \
    {                                                                                                        \
        .key = "port", .type = WEFT_FIELD_TEXT,                                                              \
        .offset = offsetof(args_type, member) + offsetof(weft_device_options, port), .unit = "TTY",          \
        .help = "light controller's serial line, or serial:NUMBER (else the rig's, else the only one)"       \
    }
#define WEFT_CAMERA_FIELD(args_type, member)                                                                 \
    {                                                                                                        \
        .key = "camera", .type = WEFT_FIELD_TEXT,                                                            \
        .offset = offsetof(args_type, member) + offsetof(weft_device_options, camera), .unit = "ID",         \
        .help = "camera as weft devices prints it (else the rig's, else the only one there is)"              \
    }

/** Rows for a table of fields; `member` is the weft_device_options inside the struct `args_type`. */
#define WEFT_CONTROLLER_FIELDS(args_type, member)                                                            \
    WEFT_RIG_FIELD(args_type, member), WEFT_PORT_FIELD(args_type, member)
#define WEFT_CAMERA_FIELDS(args_type, member)                                                                \
    WEFT_RIG_FIELD(args_type, member), WEFT_CAMERA_FIELD(args_type, member)
#define WEFT_DEVICE_FIELDS(args_type, member)                                                                \
    WEFT_RIG_FIELD(args_type, member), WEFT_PORT_FIELD(args_type, member),                                   \
        WEFT_CAMERA_FIELD(args_type, member)

/** What to open. */
typedef struct weft_device_names {
    char port[256];   /* "/dev/ttyACM0", "serial:WL-00042"; empty: find the only one there is */
    char dev[512];    /* where ports are looked for: "/dev", or the rig's */
    char camera[128]; /* "aravis:127.0.0.1"; "auto" when nothing was said */
} weft_device_names;

/**
 * Turns the options into names: --port and --camera as they are, what is not given from DIR/rig.json.
 * With --rig, a --camera that is the name of a backend alone ("gphoto") is the rig's camera of that backend.
 * Nothing is opened.
 *
 * @return WEFT_ERR_MISSING when no rig was started in DIR, WEFT_ERR_DEVICE when the one that was has
 *         ended, WEFT_ERR_FORMAT for a damaged rig.json, WEFT_ERR_USAGE for a name that is too long;
 *         each says how to start a rig or which option to mend
 */
weft_err weft_device_options_resolve(const weft_device_options *options, weft_device_names *names,
                                     weft_error *err);

#endif
