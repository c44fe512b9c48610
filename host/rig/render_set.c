#include "host/rig/render_set.h"

#include "calibration/lens/lens_model.h"
#include "core/file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/version.h"
#include "host/rig/sensor.h"
#include "host/rig/stage.h"
#include "host/set/set.h"

#include <math.h>
#include <string.h>

#define AUTO_LEVEL 0.75 /* of the range, at the brightest photosite */
#define STRIP_EDGE 2    /* px left out along its border */

/* All that rendering needs. */
typedef struct renderer {
    const weft_rig_render_plan *plan;
    const weft_rig_scene *scene;
    const weft_rig_view *view;
    weft_mosaic mosaic;
} renderer;

/* One sample's pictures and set. */
typedef struct render_set {
    const char *name;
    weft_rig_frames frames;
    weft_set set;
    uint64_t sequence; /* of the next frame's noise */
    double on[WEFT_RIG_N_LIGHTS];
} render_set;

static bool is_board(const char *sample)
{
    return strncmp(sample, "board-", 6) == 0;
}

/* The brightest expected value of the frames that will be taken. */
static double brightest(const render_set *r)
{
    const size_t n = (size_t)r->frames.width * (size_t)r->frames.height;
    double most = 0;
    for (size_t k = 0; k < n; k++) {
        double sum = 0, single = 0;
        for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++) {
            sum += (double)r->frames.light[i][k];
            single = fmax(single, (double)r->frames.light[i][k]);
        }
        most = fmax(most, (is_board(r->name) ? sum : single) + (double)r->frames.room[k]);
    }
    return most;
}

/* light: 0.., -1 for the room alone, WEFT_RIG_N_LIGHTS for all. */
static weft_err write_frame(renderer *to, render_set *r, int light, int bracket, double exposure_s,
                            weft_error *err)
{
    char name[48];
    const bool all = light == WEFT_RIG_N_LIGHTS;
    double on[WEFT_RIG_N_LIGHTS] = {0};
    for (int i = 0; i < WEFT_RIG_N_LIGHTS; i++)
        if (all || i == light)
            on[i] = weft_rig_drift(to->scene, r->name, i);
    if (all || light < 0)
        snprintf(name, sizeof name, "%s", all ? "all" : "ambient");
    else
        snprintf(name, sizeof name, "light-%02d", light);
    if (to->plan->exposures.n > 1)
        snprintf(name + strlen(name), sizeof name - strlen(name), "-b%d", bracket);
    snprintf(name + strlen(name), sizeof name - strlen(name), ".dng");
    weft_rig_expose(to->scene, &r->frames, on, exposure_s, 1, r->sequence++, to->mosaic.data);
    const weft_frame_info info = {
        .exposure_s = exposure_s, .gain = 1, .make = "Weft", .model = "Virtual scanner"};
    char *const path = weft_path_join(r->set.folder, name, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const weft_err status = weft_dng_write(path, &to->mosaic, &info, err);
    weft_free(path);
    WEFT_TRY(status);
    const weft_set_frame frame = {.file = name,
                                  .role = all         ? WEFT_ROLE_ALL
                                          : light < 0 ? WEFT_ROLE_AMBIENT
                                                      : WEFT_ROLE_LIGHT,
                                  .light = all ? -1 : light,
                                  .exposure_s = exposure_s,
                                  .gain = 1};
    return weft_set_add_frame(&r->set, &frame, err);
}

static weft_err write_frames(renderer *to, render_set *r, weft_error *err)
{
    const weft_numbers *const given = &to->plan->exposures;
    const double automatic = round(1e6 * AUTO_LEVEL / brightest(r)) / 1e6;
    const int first = is_board(r->name) ? WEFT_RIG_N_LIGHTS : -1,
              last = is_board(r->name) ? WEFT_RIG_N_LIGHTS : WEFT_RIG_N_LIGHTS - 1;
    for (int light = first; light <= last; light++)
        for (int b = 0; b < (given->n ? given->n : 1); b++) {
            if (weft_cancelled())
                return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
            WEFT_TRY(write_frame(to, r, light, b, given->n ? given->values[b] : automatic, err));
        }
    return WEFT_OK;
}

/* Where the strip is seen, upright and inside its borders. */
static weft_err add_strip(const renderer *to, weft_set *set, weft_error *err)
{
    const double *const s = to->scene->setup.strip_mm;
    double u[4], v[4];
    if (!(s[0] < s[2]) || strcmp(set->name, "white") == 0) /* the sheet lies over it */
        return WEFT_OK;
    for (int k = 0; k < 4; k++)
        if (!weft_camera_project(&to->scene->camera, (weft_vec3){s[k & 1 ? 2 : 0], s[k & 2 ? 3 : 1], 0},
                                 &u[k], &v[k]))
            return weft_fail(err, WEFT_ERR_RANGE, "the camera does not see the white strip");
    const double rect[4] = {fmax(ceil(fmax(u[0], u[2])) + STRIP_EDGE, 0),
                            fmax(ceil(fmax(v[2], v[3])) + STRIP_EDGE, 0),
                            fmin(floor(fmin(u[1], u[3])) - STRIP_EDGE, set->width - 1),
                            fmin(floor(fmin(v[0], v[1])) - STRIP_EDGE, set->height - 1)};
    if (!(rect[0] < rect[2] && rect[1] < rect[3]))
        return weft_fail(err, WEFT_ERR_RANGE, "the white strip lies outside the frame");
    if (!set->other)
        set->other = json_object();
    json_t *const strip = json_pack("{s:o, s:f}", "rect_px", weft_json_numbers(rect, 4), "reflectance", 0.99);
    if (!set->other || !strip || json_object_set_new(set->other, "strip", strip) != 0)
        return weft_fail(err, WEFT_ERR_NOMEM, "out of memory");
    return WEFT_OK;
}

static weft_err begin_set(const renderer *to, render_set *r, const char *folder, weft_error *err)
{
    weft_set *const set = &r->set;
    WEFT_TRY(weft_file_refuse_existing(folder, to->plan->force, err));
    WEFT_TRY(weft_folder_create(folder, err));
    WEFT_TRY(weft_set_init(set, folder, err));
    weft_free(set->name);
    if (!(set->name = weft_strdup(r->name, err)))
        return WEFT_ERR_NOMEM;
    set->width = to->scene->camera.width;
    set->height = to->scene->camera.height;
    set->cfa = WEFT_CFA_RGGB;
    set->white = to->scene->sensor.white_dn;
    for (int i = 0; i < 4; i++)
        set->black[i] = to->scene->sensor.black_dn;
    set->complete = true;
    snprintf(set->camera_backend, sizeof set->camera_backend, "rig");
    snprintf(set->camera_model, sizeof set->camera_model, "Virtual scanner");
    snprintf(set->camera_serial, sizeof set->camera_serial, "seed-%llu",
             (unsigned long long)to->scene->setup.seed);
    return add_strip(to, set, err);
}

static weft_err render_sample(renderer *to, const char *name, weft_error *err)
{
    weft_rig_sample *const sample = weft_alloc(1, sizeof *sample, err);
    render_set r = {.name = name, .sequence = weft_rig_name_hash(name) >> 24 << 12};
    char file[64];
    if (!sample)
        return WEFT_ERR_NOMEM;
    snprintf(file, sizeof file, "%s.set", name);
    char *const folder = weft_path_join(to->plan->folder, file, err);
    weft_err status = folder ? weft_rig_sample_init(sample, to->scene, name, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = begin_set(to, &r, folder, err);
    if (status == WEFT_OK)
        status = weft_rig_frames_init(&r.frames, to->scene, to->view, sample, err);
    if (status == WEFT_OK) {
        status = write_frames(to, &r, err);
        weft_rig_frames_fini(&r.frames);
    }
    if (status == WEFT_OK)
        status = weft_set_save(&r.set, err);
    weft_set_fini(&r.set);
    weft_rig_sample_fini(sample);
    weft_free(sample);
    weft_free(folder);
    return status;
}

static weft_err render_all(renderer *to, weft_error *err)
{
    char name[32];
    for (const char *p = to->plan->samples; *p;) {
        const size_t n = strcspn(p, ",");
        if (n == 0 || n >= sizeof name)
            return weft_fail(err, WEFT_ERR_USAGE, "--sample %s: wanted names with commas between",
                             to->plan->samples);
        memcpy(name, p, n);
        name[n] = '\0';
        const double start_s = weft_clock_s();
        WEFT_TRY(render_sample(to, name, err));
        weft_note("%s.set after %.1f s", name, weft_clock_s() - start_s);
        p += n + (p[n] == ',');
    }
    return WEFT_OK;
}

weft_err weft_rig_render_sets(const weft_rig_setup *setup, const weft_rig_render_plan *plan, weft_error *err)
{
    weft_rig_view view = {0};
    weft_rig_scene *const scene = weft_alloc(1, sizeof *scene, err);
    char *const truth = weft_path_join(plan->folder, "truth.cal", err);
    renderer to = {.plan = plan, .scene = scene, .view = &view};
    weft_err status = scene && truth ? weft_folder_create(plan->folder, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_rig_scene_init(scene, setup, err);
    if (status == WEFT_OK)
        status = weft_rig_view_sensor(&view, scene, err);
    if (status == WEFT_OK)
        status = weft_mosaic_init(&to.mosaic, scene->camera.width, scene->camera.height, WEFT_CFA_RGGB, err);
    if (status == WEFT_OK) {
        for (int i = 0; i < 4; i++)
            to.mosaic.black[i] = (uint16_t)scene->sensor.black_dn;
        to.mosaic.white = (uint16_t)scene->sensor.white_dn;
        status = render_all(&to, err);
    }
    if (status == WEFT_OK)
        status = weft_rig_truth_calibration(scene, truth, err);
    weft_mosaic_fini(&to.mosaic);
    weft_rig_view_fini(&view);
    weft_free(truth);
    weft_free(scene);
    return status;
}
