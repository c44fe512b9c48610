#include "host/rig/sample.h"

#include "calibration/lens/lens_model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define RAD_PER_DEG     0.017453292519943295
#define WEFT_RIG_GROUND 0.02 /* reflectance of black velvet */

/* ------------------------------------------------------------------------------------------ names */

static const struct {
    const char *name, *summary;
} flat_samples[] = {
    {"white", "99 % white sheet, matte, flat on the table"},
    {"flat", "50 % grey sheet, matte, flat on the table"},
    {"munsell", "chart of 12 matte Munsell neutrals, flat on the table"},
    {"macbeth", "ColorChecker with the spectra of Ohta 1997, flat on the table"},
    {"balls", "four glossy dark balls of 24 mm on the table"},
    {"board-table", "checkerboard flat on the table, its middle at the origin, rows along +X"},
};
#define N_FLAT ((int)(sizeof flat_samples / sizeof flat_samples[0]))

bool weft_rig_sample_describe(int i, char *name, char *summary)
{
    if (i < N_FLAT) {
        snprintf(name, 32, "%s", flat_samples[i].name);
        snprintf(summary, 128, "%s", flat_samples[i].summary);
        return true;
    }
    i -= N_FLAT;
    if (i < WEFT_RIG_N_BOARDS) {
        snprintf(name, 32, "board-%d", i);
        snprintf(summary, 128, "checkerboard in pose %d of %d", i + 1, WEFT_RIG_N_BOARDS);
        return true;
    }
    i -= WEFT_RIG_N_BOARDS;
    for (const weft_weave *w = weft_weaves; w->name; w++)
        if (i-- == 0) {
            snprintf(name, 32, "%s", w->name);
            snprintf(summary, 128, "%s", w->summary);
            return true;
        }
    return false;
}

static weft_err fail_unknown(const char *name, weft_error *err)
{
    char nearest[32] = "", candidate[32], summary[128];
    int best = 4;
    for (int i = 0; weft_rig_sample_describe(i, candidate, summary); i++) {
        const int distance = weft_text_distance(name, candidate);
        if (distance < best) {
            best = distance;
            snprintf(nearest, sizeof nearest, "%s", candidate);
        }
    }
    return weft_fail(err, WEFT_ERR_USAGE,
                     "there is no sample \"%.40s\"%s%s%s; the command \"samples\" lists them", name,
                     nearest[0] ? ", did you mean \"" : "", nearest, nearest[0] ? "\"" : "");
}

/* ------------------------------------------------------------------------------------------ plates */

weft_vec3 weft_rig_plate_point(const weft_rig_plate *plate, double x, double y)
{
    return weft_add(plate->centre, weft_add(weft_scale(plate->ax, x), weft_scale(plate->ay, y)));
}

static int checker_material(const weft_rig_plate *plate, double x, double y)
{
    const double i = floor(x / plate->square_mm + plate->columns / 2.0);
    const double j = floor(plate->rows / 2.0 - y / plate->square_mm);
    if (i < 0 || j < 0 || i >= plate->columns || j >= plate->rows)
        return 2;
    return ((int)i + (int)j) % 2 ? 2 : 1;
}

static int chart_material(const weft_rig_plate *plate, double x, double y)
{
    const weft_chart *const chart = plate->chart;
    const double i = floor(x / chart->pitch_mm + chart->columns / 2.0);
    const double j = floor(chart->rows / 2.0 - y / chart->pitch_mm);
    if (i < 0 || j < 0 || i >= chart->columns || j >= chart->rows)
        return 1;
    const int patch = (int)j * chart->columns + (int)i;
    double cx, cy;
    weft_chart_patch_centre(chart, patch, &cx, &cy);
    const bool inside = fabs(x - cx) <= chart->patch_mm / 2 && fabs(y - cy) <= chart->patch_mm / 2;
    return inside ? 2 + patch : 1;
}

int weft_rig_plate_material(const weft_rig_plate *plate, double x, double y)
{
    if (!(fabs(x) <= plate->half_width && fabs(y) <= plate->half_height))
        return 0;
    return plate->pattern == WEFT_RIG_CHECKER ? checker_material(plate, x, y) : chart_material(plate, x, y);
}

/* Whether all corners of the plate are in the picture, `margin` px from its edge. */
static bool in_view(const weft_rig_plate *plate, const weft_camera *camera, double margin)
{
    for (int i = 0; i < 4; i++) {
        double u, v;
        const weft_vec3 corner = weft_rig_plate_point(plate, i & 1 ? plate->half_width : -plate->half_width,
                                                      i & 2 ? plate->half_height : -plate->half_height);
        if (!weft_camera_project(camera, corner, &u, &v))
            return false;
        if (u < margin || v < margin || u > camera->width - 1 - margin || v > camera->height - 1 - margin)
            return false;
    }
    return true;
}

/* Moves the plate along (dx, dy) as far as it stays in view. */
static void push(weft_rig_plate *plate, const weft_camera *camera, double dx, double dy)
{
    const double margin = 0.008 * camera->width;
    for (int halvings = 0; halvings < 7; halvings++) {
        const double step = ldexp(16, -halvings); /* 16 mm down to 0.25 */
        for (;;) {
            const weft_vec3 before = plate->centre;
            plate->centre = weft_add(before, (weft_vec3){dx * step, dy * step, 0});
            if (in_view(plate, camera, margin))
                continue;
            plate->centre = before;
            break;
        }
    }
}

/* Leans the plate by `tilt` towards azimuth `towards` after turning it by `roll`. */
static void orient(weft_rig_plate *plate, double roll, double tilt, double towards)
{
    const weft_vec3 k = {-sin(towards), cos(towards), 0}; /* axis of the tilt (Rodrigues) */
    weft_vec3 axes[3] = {{cos(roll), sin(roll), 0}, {-sin(roll), cos(roll), 0}, {0, 0, 1}};
    for (int i = 0; i < 3; i++) {
        const weft_vec3 a = axes[i];
        axes[i] = weft_add(weft_add(weft_scale(a, cos(tilt)), weft_scale(weft_cross(k, a), sin(tilt))),
                           weft_scale(k, weft_dot(k, a) * (1 - cos(tilt))));
    }
    plate->ax = axes[0];
    plate->ay = axes[1];
    plate->normal = axes[2];
}

/* Lifts the plate until its lowest corner is `clearance` over the table. */
static void lift(weft_rig_plate *plate, double clearance)
{
    const double reach = plate->half_width * fabs(plate->ax.z) + plate->half_height * fabs(plate->ay.z);
    plate->centre.z = clearance + reach;
}

static weft_rig_plate make_board(void)
{
    const double square = WEFT_RIG_BOARD_SQUARE_MM, margin = WEFT_RIG_BOARD_MARGIN_MM;
    return (weft_rig_plate){
        .ax = {1, 0, 0},
        .ay = {0, 1, 0},
        .normal = {0, 0, 1},
        .half_width = WEFT_RIG_BOARD_COLUMNS * square / 2 + margin,
        .half_height = WEFT_RIG_BOARD_ROWS * square / 2 + margin,
        .pattern = WEFT_RIG_CHECKER,
        .columns = WEFT_RIG_BOARD_COLUMNS,
        .rows = WEFT_RIG_BOARD_ROWS,
        .square_mm = square,
    };
}

/* Poses that together fill the frame: leaning in all directions, near and far, pushed to edges and corners.
 */
static void pose_board(weft_rig_plate *plate, const weft_camera *camera, int pose)
{
    static const struct {
        double roll_deg, tilt_deg, towards_deg, clearance_mm, dx, dy;
    } poses[WEFT_RIG_N_BOARDS] = {
        {0, 0, 0, 3, 0, 0},       {4, 20, 0, 4, 1, 1},     {-5, 22, 180, 4, -1, 1},
        {3, 26, 90, 4, -1, -1},   {-3, 26, 270, 4, 1, -1}, {8, 32, 40, 5, 1, -1},
        {-8, 32, 140, 5, -1, 1},  {6, 32, 220, 5, -1, -1}, {-6, 32, 320, 5, 1, 1},
        {2, 38, 0, 6, 1, 0},      {-2, 38, 180, 6, -1, 0}, {12, 40, 90, 6, 0, 1},
        {-12, 40, 270, 6, 0, -1}, {184, 36, 60, 25, 0, 0}, {176, 12, 240, 12, -1, -1},
    };
    orient(plate, RAD_PER_DEG * poses[pose].roll_deg, RAD_PER_DEG * poses[pose].tilt_deg,
           RAD_PER_DEG * poses[pose].towards_deg);
    lift(plate, poses[pose].clearance_mm);
    if (poses[pose].dx != 0)
        push(plate, camera, poses[pose].dx, 0);
    if (poses[pose].dy != 0)
        push(plate, camera, 0, poses[pose].dy);
}

/* ------------------------------------------------------------------------------------------ samples */

/* Grey cloth-covered table: the measured "neutral 5". */
static void add_table(weft_rig_sample *sample, const weft_rig_scene *scene)
{
    sample->materials[sample->n_materials++] = scene->spectra.macbeth[21];
}

static void init_board(weft_rig_sample *sample, const weft_rig_scene *scene, int pose)
{
    add_table(sample, scene);
    sample->materials[sample->n_materials++] = scene->spectra.macbeth[23]; /* "black 2" */
    sample->materials[sample->n_materials++] =
        scene->spectra.macbeth[19]; /* "neutral 8": no glare on a raised board */
    sample->has_plate = true;
    sample->plate = make_board();
    if (pose >= 0)
        pose_board(&sample->plate, &scene->camera, pose);
}

static weft_err init_chart(weft_rig_sample *sample, const weft_rig_scene *scene, const char *name,
                           const char *edition, weft_error *err)
{
    const weft_chart *chart;
    WEFT_TRY(weft_chart_find(name, edition, &chart, err));
    add_table(sample, scene);
    sample->materials[sample->n_materials++] = weft_spectrum_flat(0.032); /* frame */
    for (int i = 0; i < chart->columns * chart->rows; i++)
        sample->materials[sample->n_materials++] =
            strcmp(name, "munsell") == 0
                ? weft_spectra_munsell(&scene->spectra, chart->patches[i].munsell_value)
                : scene->spectra.macbeth[i];
    sample->has_plate = true;
    sample->plate = (weft_rig_plate){
        .centre = {1.2, -0.8, 0},
        .half_width = ((chart->columns - 1) * chart->pitch_mm + chart->patch_mm) / 2 + chart->border_mm,
        .half_height = ((chart->rows - 1) * chart->pitch_mm + chart->patch_mm) / 2 + chart->border_mm,
        .pattern = WEFT_RIG_CHART,
        .chart = chart,
    };
    orient(&sample->plate, RAD_PER_DEG * 1.3, 0, 0);
    return WEFT_OK;
}

/* A crease, tears, and lint that is dark on a light cloth and light on a dark one. */
static void spoil(weft_rig_sample *sample, const weft_rig_scene *scene)
{
    double luminance = 0, area = 0;
    for (int m = 0; m < sample->ground; m++) {
        double rgb[3];
        weft_spectra_srgb(&scene->spectra, &sample->materials[m], rgb);
        luminance += sample->share[m] * (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
        area += sample->share[m];
    }
    weft_rig_damage *const damage = &sample->damage;
    weft_rig_damage_init(damage, scene->setup.seed);
    damage->present = true;
    damage->ground = sample->ground;
    damage->lint = sample->n_materials++;
    damage->floor_mm = sample->cloth.lowest_mm - 0.3F;
    damage->crown_mm = sample->cloth.highest_mm;
    sample->materials[damage->lint] = weft_spectrum_flat(luminance > 0.25 * area ? 0.05 : 0.7);
}

static weft_err init_cloth(weft_rig_sample *sample, const weft_rig_scene *scene, const weft_weave *weave,
                           bool flawed, weft_error *err)
{
    for (int i = 0; i < WEFT_CLOTH_MAX_DYES && weave->dyes[i]; i++) {
        const weft_spectrum *dye;
        WEFT_TRY(weft_spectra_find_dye(&scene->spectra, weave->dyes[i], &dye, err));
        sample->materials[sample->n_materials++] = *dye;
    }
    if (weave->cover > 0 || flawed) {
        sample->ground = sample->n_materials++;
        sample->materials[sample->ground] = weft_spectrum_flat(WEFT_RIG_GROUND);
    }
    WEFT_TRY(weft_fabric_init(&sample->cloth, weave, scene->setup.seed, err));
    sample->has_cloth = true;
    memcpy(sample->share, sample->cloth.dye_share, sizeof sample->cloth.dye_share);
    if (flawed)
        spoil(sample, scene);
    return WEFT_OK;
}

static void init_white(weft_rig_sample *sample, const weft_rig_scene *scene)
{
    const weft_rig_sheet *const s = &scene->setup.sheet;
    sample->materials[sample->n_materials++] = weft_spectrum_flat(0.99);
    for (int k = 0; k < 2; k++)
        sample->has_sheet |=
            s->bow_mm[k] != 0 || s->tilt_deg[k] != 0 || s->offset_mm[k] != 0 || s->size_mm[k] != 0;
    if (!sample->has_sheet)
        return;
    sample->sheet = *s;
    add_table(sample, scene);
}

static void init_balls(weft_rig_sample *sample, const weft_rig_scene *scene)
{
    static const double places[WEFT_RIG_N_BALLS][2] = {{-48, -26}, {44, -29}, {-41, 27}, {50, 24}};
    add_table(sample, scene);
    sample->materials[sample->n_materials++] = weft_spectrum_flat(0.02);
    sample->n_balls = WEFT_RIG_N_BALLS;
    for (int i = 0; i < WEFT_RIG_N_BALLS; i++)
        sample->balls[i] = (weft_rig_ball){places[i][0], places[i][1], WEFT_RIG_BALL_RADIUS_MM};
}

static void add_strip(weft_rig_sample *sample, const weft_rig_setup *setup)
{
    if (!(setup->strip_mm[0] < setup->strip_mm[2]))
        return;
    memcpy(sample->strip_mm, setup->strip_mm, sizeof sample->strip_mm);
    sample->strip_material = sample->n_materials++;
    sample->materials[sample->strip_material] = weft_spectrum_flat(0.99);
}

static weft_err init_by_name(weft_rig_sample *sample, const weft_rig_scene *scene, const char *name,
                             weft_error *err)
{
    char board[32];
    if (strcmp(name, "white") == 0) {
        init_white(sample, scene);
        return WEFT_OK;
    }
    if (strcmp(name, "flat") == 0) {
        sample->materials[sample->n_materials++] = weft_spectrum_flat(0.5);
        return WEFT_OK;
    }
    if (strcmp(name, "balls") == 0) {
        init_balls(sample, scene);
        return WEFT_OK;
    }
    if (strcmp(name, "munsell") == 0)
        return init_chart(sample, scene, name, "", err);
    if (strcmp(name, "macbeth") == 0)
        return init_chart(sample, scene, name, "ohta1997", err);
    for (int i = -1; i < WEFT_RIG_N_BOARDS; i++) {
        snprintf(board, sizeof board, i < 0 ? "board-table" : "board-%d", i);
        if (strcmp(name, board) == 0) {
            init_board(sample, scene, i);
            return WEFT_OK;
        }
    }
    for (const weft_weave *w = weft_weaves; w->name; w++) {
        const size_t n = strlen(w->name);
        if (strncmp(name, w->name, n) == 0 && (!name[n] || strcmp(name + n, "+flaws") == 0))
            return init_cloth(sample, scene, w, name[n] != '\0', err);
    }
    return fail_unknown(name, err);
}

weft_err weft_rig_sample_init(weft_rig_sample *sample, const weft_rig_scene *scene, const char *name,
                              weft_error *err)
{
    *sample = (weft_rig_sample){0};
    snprintf(sample->name, sizeof sample->name, "%s", name);
    WEFT_TRY(init_by_name(sample, scene, name, err));
    if (strcmp(name, "white") != 0) /* the sheet lies over it */
        add_strip(sample, &scene->setup);
    return WEFT_OK;
}

void weft_rig_sample_fini(weft_rig_sample *sample)
{
    weft_fabric_fini(&sample->cloth);
    *sample = (weft_rig_sample){0};
}
