/**
 * What lies under the virtual scanner: a fabric, or a flat plate (board, chart) over the table.
 */
#ifndef WEFT_HOST_RIG_SAMPLE_H
#define WEFT_HOST_RIG_SAMPLE_H

#include "calibration/charts/chart.h"
#include "host/rig/damage.h"
#include "host/rig/fabric.h"
#include "host/rig/scene.h"

#define WEFT_RIG_MAX_MATERIALS 48
#define WEFT_RIG_N_BOARDS      15

/** Half of what the camera sees of the table, mm: where a bowed sheet touches it. */
#define WEFT_RIG_HALF_FIELD_X 77.0
#define WEFT_RIG_HALF_FIELD_Y 51.0

/** Checkerboard: 10 x 7 squares, so 9 x 6 inner corners. */
#define WEFT_RIG_BOARD_COLUMNS   10
#define WEFT_RIG_BOARD_ROWS      7
#define WEFT_RIG_BOARD_SQUARE_MM 10.0
#define WEFT_RIG_BOARD_MARGIN_MM 5.0

typedef enum weft_rig_pattern { WEFT_RIG_CHECKER, WEFT_RIG_CHART } weft_rig_pattern;

/** A flat rectangle with a matte pattern.  Materials: 0 is the table; a checker has 1 dark, 2 light; a chart
 *  1 frame, 2.. its patches. */
typedef struct weft_rig_plate {
    weft_vec3 centre;               /* mm, world */
    weft_vec3 ax, ay, normal;       /* unit, right-handed: ax right, ay up, seen from the front */
    double half_width, half_height; /* mm */
    weft_rig_pattern pattern;
    int columns, rows; /* of squares */
    double square_mm;
    const weft_chart *chart; /* WEFT_RIG_CHART only */
} weft_rig_plate;

/** A glossy dark ball that lies on the table. */
typedef struct weft_rig_ball {
    double x, y, radius; /* mm; its middle is `radius` over the table */
} weft_rig_ball;

#define WEFT_RIG_N_BALLS        4
#define WEFT_RIG_BALL_RADIUS_MM 12.0

typedef struct weft_rig_sample {
    char name[32];
    int n_materials;
    weft_spectrum materials[WEFT_RIG_MAX_MATERIALS]; /* reflectance of a matte surface */
    double share[WEFT_RIG_MAX_MATERIALS];            /* of the surface; fabrics only (light between yarns) */
    bool has_plate, has_cloth;
    bool has_sheet;         /* "white" with setup.sheet: material 0 is the sheet, 1 the table */
    int strip_material;     /* of the white strip; 0: there is none */
    double strip_mm[4];     /* left, bottom, right, top */
    int ground;             /* material under an open or torn cloth; 0: nowhere seen */
    weft_rig_damage damage; /* of "FABRIC+flaws" */
    weft_rig_sheet sheet;
    int n_balls; /* material 0 is the table, 1 the balls */
    weft_rig_ball balls[WEFT_RIG_N_BALLS];
    weft_rig_plate plate;
    weft_fabric cloth;
} weft_rig_sample;

/** Name and one line about sample `i`; false behind the last.  `name` has room for 32, `summary` for 128. */
bool weft_rig_sample_describe(int i, char *name, char *summary);

/** Makes the sample of a name; a fabric's name with "+flaws" behind it is that fabric creased, torn and with
 *  lint on it.  @return WEFT_ERR_USAGE with the nearest name, WEFT_ERR_NOMEM */
weft_err weft_rig_sample_init(weft_rig_sample *sample, const weft_rig_scene *scene, const char *name,
                              weft_error *err);
void weft_rig_sample_fini(weft_rig_sample *sample);

/** World point of plate coordinates (mm from its centre). */
weft_vec3 weft_rig_plate_point(const weft_rig_plate *plate, double x, double y);

/** Material of the plate at (x, y) mm from its centre; 0 outside. */
int weft_rig_plate_material(const weft_rig_plate *plate, double x, double y);

#endif
