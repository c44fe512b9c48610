/** The options of the virtual scanner: one table for `weft rig`, which passes them on, and weft-rig. */
#ifndef WEFT_HOST_RIG_RIG_OPTIONS_H
#define WEFT_HOST_RIG_RIG_OPTIONS_H

#include "core/fields.h"

typedef struct weft_rig_options {
    const char *dir, *scene, *sample, *address, *firmware, *bootloader;
    weft_size size;
    int seed;        /* 0: the scene file's */
    int supersample; /* 0: the default */
} weft_rig_options;

/** Rows for a table of fields; `member` is the weft_rig_options inside the struct `args_type`. */
#define WEFT_RIG_OPTION(args_type, member, field)                                                            \
    (offsetof(args_type, member) + offsetof(weft_rig_options, field))
#define WEFT_RIG_OPTION_FIELDS(args_type, member)                                                            \
    {.key = "dir",                                                                                           \
     .type = WEFT_FIELD_TEXT,                                                                                \
     .offset = WEFT_RIG_OPTION(args_type, member, dir),                                                      \
     .unit = "DIR",                                                                                          \
     .def = "weft-rig",                                                                                      \
     .help = "folder of rig.json and the control socket; the rig's name for other commands"},                \
        {.key = "scene",                                                                                     \
         .type = WEFT_FIELD_TEXT,                                                                            \
         .offset = WEFT_RIG_OPTION(args_type, member, scene),                                                \
         .unit = "FILE",                                                                                     \
         .help = "scene file: lamps, room light, noise (docs/virtual-scanner.md)"},                          \
        {.key = "sample",                                                                                    \
         .type = WEFT_FIELD_TEXT,                                                                            \
         .offset = WEFT_RIG_OPTION(args_type, member, sample),                                               \
         .unit = "NAME",                                                                                     \
         .def = "plain-weave",                                                                               \
         .help = "what lies on the table at first"},                                                         \
        {.key = "size",                                                                                      \
         .type = WEFT_FIELD_SIZE,                                                                            \
         .offset = WEFT_RIG_OPTION(args_type, member, size),                                                 \
         .def = "1232x816",                                                                                  \
         .help = "pixels of the sensor, even numbers up to 4928x3264"},                                      \
        {.key = "seed",                                                                                      \
         .type = WEFT_FIELD_INT,                                                                             \
         .offset = WEFT_RIG_OPTION(args_type, member, seed),                                                 \
         .min = 0,                                                                                           \
         .max = 2147483647,                                                                                  \
         .help = "which scanner and noise, 1 or more (0: the scene file's, else 1)"},                        \
        {.key = "address",                                                                                   \
         .type = WEFT_FIELD_TEXT,                                                                            \
         .offset = WEFT_RIG_OPTION(args_type, member, address),                                              \
         .unit = "IP",                                                                                       \
         .def = "127.0.0.1",                                                                                 \
         .help = "address of a network interface, at which the camera listens"},                             \
        {.key = "supersample",                                                                               \
         .type = WEFT_FIELD_INT,                                                                             \
         .offset = WEFT_RIG_OPTION(args_type, member, supersample),                                          \
         .min = 0,                                                                                           \
         .max = 9,                                                                                           \
         .help = "n x n rays in each photosite, 3 or more (0: 3)"},                                          \
        {.key = "bootloader",                                                                                \
         .type = WEFT_FIELD_TEXT,                                                                            \
         .offset = WEFT_RIG_OPTION(args_type, member, bootloader),                                           \
         .unit = "HEX",                                                                                      \
         .help = "bootloader of the light controller, so that weft flash can program it"},                   \
    {                                                                                                        \
        .key = "firmware", .type = WEFT_FIELD_TEXT, .offset = WEFT_RIG_OPTION(args_type, member, firmware),  \
        .unit = "ELF",                                                                                       \
        .help = "firmware of the light controller (default: that of this build; none: an empty chip)"        \
    }

#endif
