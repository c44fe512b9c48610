/**
 * The virtual scanner as numbers: camera, lamps, sensor and room.  Everything follows from a seed and an
 * optional scene file, so a run can be repeated to the bit.
 *
 * Linear values are those of docs/formats.md: (DN - black) / (white - black) / exposure_s / gain, unit 1/s.
 */
#ifndef WEFT_HOST_RIG_SCENE_H
#define WEFT_HOST_RIG_SCENE_H

#include "calibration/calibration.h"
#include "core/error.h"
#include "core/fields.h"
#include "host/rig/spectra.h"

#include <stdbool.h>
#include <stdint.h>

#define WEFT_RIG_N_LIGHTS 10

/** Default frame; other sizes keep the field of view across the width. */
#define WEFT_RIG_WIDTH  1232
#define WEFT_RIG_HEIGHT 816
/** Largest frame: the sensor of a Nikon D5100. */
#define WEFT_RIG_MAX_WIDTH  4928
#define WEFT_RIG_MAX_HEIGHT 3264

/** A white sheet that does not lie as it should.  All 0: it fills the table and is flat. */
typedef struct weft_rig_sheet {
    double bow_mm[2];    /* how far its middle stands over the edges of the field, across and up */
    double tilt_deg[2];  /* rises towards +X and +Y */
    double offset_mm[2]; /* of its middle */
    double size_mm[2];   /* 0: as large as the table */
} weft_rig_sheet;

/** What a user may set; the rest follows from the seed. */
typedef struct weft_rig_setup {
    weft_size size;         /* px; both even (a Bayer cell is 2 x 2) */
    uint64_t seed;          /* same seed, same scanner and same noise */
    bool noise;             /* shot noise, read noise and fixed pattern */
    int supersample;        /* n x n samples in each photosite, 3..9 */
    double light_jitter_mm; /* sigma of a lamp's place, each axis */
    double aim_jitter_deg;  /* a lamp looks past the middle by at most this */
    double room_light;      /* share of the range that a white sheet shows after 0.04 s with all lamps off */
    bool interreflection;   /* light from yarn to yarn (docs/virtual-scanner.md) */
    double light_drift;     /* rms by which a lamp's power is off while anything but "white" is there */
    double strip_mm[4];     /* left, bottom, right, top of the white strip on the table; all 0: none */
    weft_rig_sheet sheet;   /* how the sheet "white" lies */
    bool has_lights;        /* `lights` replaces what the seed would give */
    struct {
        double position_mm[3];
        double axis[3];
        double exponent;
        double power;      /* relative to the other lamps */
        double pump_scale; /* blue of the LED, 0.9..1.1 */
    } lights[WEFT_RIG_N_LIGHTS];
} weft_rig_setup;

/** 1232 x 816, seed 1, noise on, 3 x 3 samples, 2 mm, 1 deg, 0.3 %, interreflection on. */
void weft_rig_setup_init(weft_rig_setup *setup);

/** Reads a scene file into `setup` (docs/virtual-scanner.md); absent keys leave their value.
 *  @return WEFT_ERR_FORMAT for unknown keys, WEFT_ERR_RANGE, WEFT_ERR_VERSION naming file and key */
weft_err weft_rig_setup_load(const char *path, weft_rig_setup *setup, weft_error *err);

/** What a 14-bit converter makes of the light. */
typedef struct weft_rig_sensor {
    double black_dn, white_dn;
    double full_well_e;  /* electrons at white_dn and gain 1 */
    double read_noise_e; /* rms */
    double prnu;         /* relative rms of the photosites' sensitivity */
} weft_rig_sensor;

typedef struct weft_rig_scene {
    weft_rig_setup setup;
    weft_spectra spectra;
    weft_camera camera;   /* with pose */
    double vignetting[2]; /* factor 1 + a q + b q^2 besides cos^4; q: squared distance from the principal
                             point over that of the frame's corner */
    weft_light lights[WEFT_RIG_N_LIGHTS]; /* intensity in camera RGB, 1/s */
    weft_spectrum led[WEFT_RIG_N_LIGHTS]; /* the lamp's light times its power: sensor_rgb() of a 100 % sheet
                                             under it is its intensity */
    weft_spectrum room; /* likewise: sensor_rgb() of a 100 % sheet is the room light's value */
    weft_rig_sensor sensor;
} weft_rig_scene;

/**
 * The scanner of a setup.
 *
 * Lamps stand on a dome of 300 mm: 0-5 at 35 deg elevation, 6-8 at 60, 9 at 80.  All powers are scaled
 * together so that a 99 % sheet reaches 75 % of the range after 0.04 s at gain 1 at its brightest pixel
 * of all lamps and channels.
 */
weft_err weft_rig_scene_init(weft_rig_scene *scene, const weft_rig_setup *setup, weft_error *err);

/** Share of the light that reaches photosite (u, v), 1 at the principal point. */
double weft_rig_vignetting(const weft_rig_scene *scene, double u, double v);

/**
 * What `sample` finds of lamp `light`'s power: 1 for the sample "white", 1 + light_drift * a normal number of
 * the sample's name for others.  LEDs warm up and age between the sheet and the scan.
 */
double weft_rig_drift(const weft_rig_scene *scene, const char *sample, int light);

/** FNV-1a of a sample's name: so that its noise and drift do not depend on when it is looked at. */
uint64_t weft_rig_name_hash(const char *name);

/** A repeatable random number in [0, 1) of a seed, a stream and an index (SplitMix64's finisher). */
double weft_rig_random(uint64_t seed, uint64_t stream, uint64_t index);

#endif
