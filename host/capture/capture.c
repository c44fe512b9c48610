#include "host/capture/capture.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/capture/capture_private.h"
#include "host/capture/exposures.h"
#include "host/capture/live_picture.h"
#include "host/capture/set_folder.h"
#include "host/capture/sidecar.h"
#include "host/capture/weights.h"

#include <stdio.h>
#include <string.h>

/* A DNG is its samples and some tags. */
#define DNG_TAGS_BYTES 65536
#define SPARE_BYTES    (UINT64_C(4) << 20)

static weft_err complete_options(weft_capture_state *run, const weft_controller_info *info, weft_error *err)
{
    weft_capture_options *const o = &run->o;
    const int n = info->n_lights;
    const uint32_t every = n < 32 ? (UINT32_C(1) << n) - 1 : UINT32_MAX;
    if (n < 1 || n > WEFT_CAPTURE_MAX_LIGHTS)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "%s: says it has %d lights", info->port, n);
    if (o->lights & ~every)
        return weft_fail(err, WEFT_ERR_RANGE, "there is no light %d: the controller has 0 to %d",
                         31 - __builtin_clz(o->lights & ~every), n - 1);
    for (int i = n; i < WEFT_CAPTURE_MAX_LIGHTS; i++)
        if (o->exposures_s[i] > 0 || o->brackets[i] > 0)
            return weft_fail(err, WEFT_ERR_RANGE, "there is no light %d: the controller has 0 to %d", i,
                             n - 1);
    if (o->level > info->level_max)
        return weft_fail(err, WEFT_ERR_RANGE, "level %d is not possible, only 1 to %d", o->level,
                         info->level_max);
    o->lights = o->lights ? o->lights : every;
    o->level = o->level ? o->level : info->level_max;
    o->bracket = o->bracket ? o->bracket : 1;
    weft_exposures_apply(o);
    o->average = o->average ? o->average : 1;
    o->gain = o->gain > 0 ? o->gain : weft_camera_get_state(run->shooter.camera)->gain;
    o->settle_s = o->settle_s > 0 ? o->settle_s : 0.005;
    o->deadline_s = o->deadline_s > 0 ? o->deadline_s : 6;
    o->tries = o->tries ? o->tries : 3;
    o->patience_s = o->patience_s > 0 ? o->patience_s : 10;
    run->shooter.level = o->level;
    run->shooter.settle_s = o->settle_s;
    run->shooter.deadline_s = o->deadline_s;
    run->shooter.trigger = o->trigger;
    return WEFT_OK;
}

static weft_err ask_camera(weft_capture_state *run, double exposure_s, double *achieved_s, weft_error *err)
{
    WEFT_TRY(weft_shooter_set_camera(&run->shooter, exposure_s, run->o.gain, err));
    *achieved_s = weft_camera_get_state(run->shooter.camera)->exposure_s;
    return WEFT_OK;
}

/* Each exposure of the plan is told to the camera once, so that an impossible bracket fails at once. */
static weft_err check_exposures(weft_capture_state *run, weft_error *err)
{
    double achieved_s;
    for (int i = 0; i < run->plan.n; i++) {
        WEFT_TRY(ask_camera(run, run->plan.frames[i].exposure_s, &achieved_s, err));
        run->report.n_exposures += run->plan.frames[i].role == WEFT_ROLE_LIGHT;
    }
    WEFT_TRY(ask_camera(run, weft_exposures_shortest(&run->o), &run->report.shortest_s, err));
    WEFT_TRY(ask_camera(run, weft_exposures_longest(&run->o), &run->report.exposure_s, err));
    run->report.gain = weft_camera_get_state(run->shooter.camera)->gain;
    return WEFT_OK;
}

static int count_missing(const weft_capture_plan *plan)
{
    int n = 0;
    for (int i = 0; i < plan->n; i++)
        n += !plan->frames[i].have;
    return n;
}

static weft_err check_disk(const weft_capture_state *run, weft_error *err)
{
    const weft_camera_state *const camera = weft_camera_get_state(run->shooter.camera);
    const int n = count_missing(&run->plan);
    const uint64_t frame_bytes = 2 * (uint64_t)camera->width * (uint64_t)camera->height + DNG_TAGS_BYTES;
    const uint64_t needed = (uint64_t)n * frame_bytes + (n ? SPARE_BYTES : 0);
    uint64_t there = 0;
    WEFT_TRY(weft_disk_free(run->o.folder, &there, err));
    if (there < needed)
        return weft_fail(
            err, WEFT_ERR_IO,
            "%s: the disk has %.0f MB free and %d frames need %.0f MB; make room or give another "
            "folder",
            run->o.folder, 1e-6 * (double)there, n, 1e-6 * (double)needed);
    return WEFT_OK;
}

/* "harris-tweed-07" of "scans/harris-tweed-07.set/" */
static char *name_of_folder(const char *folder, weft_error *err)
{
    size_t n = strlen(folder);
    while (n > 1 && folder[n - 1] == '/')
        n--;
    size_t begin = n;
    while (begin > 0 && folder[begin - 1] != '/')
        begin--;
    if (n - begin > 4 && memcmp(folder + n - 4, ".set", 4) == 0)
        n -= 4;
    return weft_asprintf(err, "%.*s", (int)(n - begin), folder + begin);
}

static weft_err describe_set(weft_capture_state *run, weft_error *err)
{
    const weft_camera_state *const camera = weft_camera_get_state(run->shooter.camera);
    weft_set *const set = &run->set;
    WEFT_TRY(weft_set_init(set, run->o.folder, err));
    set->name = run->o.name ? weft_strdup(run->o.name, err) : name_of_folder(run->o.folder, err);
    if (!set->name)
        return WEFT_ERR_NOMEM;
    snprintf(set->camera_backend, sizeof set->camera_backend, "%s",
             weft_camera_backend_name(run->shooter.camera));
    snprintf(set->camera_model, sizeof set->camera_model, "%s", camera->model);
    snprintf(set->camera_serial, sizeof set->camera_serial, "%s", camera->serial);
    set->width = camera->width;
    set->height = camera->height;
    set->cfa = camera->cfa;
    memcpy(set->black, camera->black, sizeof set->black);
    set->white = camera->white;
    return WEFT_OK;
}

static weft_err take_frame(weft_capture_state *run, weft_planned_frame *frame, weft_error *err)
{
    weft_shot shot = {0};
    json_t *const retries = json_array();
    json_t *capture = NULL;
    weft_err status = WEFT_OK;
    if (frame->role == WEFT_ROLE_DARK && run->o.cap_lens)
        status = run->o.cap_lens(run->o.context, err);
    if (status == WEFT_OK)
        status = weft_capture_shoot(run, frame, &shot, retries, err);
    if (status == WEFT_OK && !(capture = weft_capture_describe_shot(run, frame, &shot, retries)))
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the record of %s", frame->file);
    if (status == WEFT_OK) {
        weft_live_picture_report(frame->file, &run->shooter.frame.mosaic);
        status = weft_capture_keep(run, frame, capture, err);
    }
    json_decref(capture);
    json_decref(retries);
    WEFT_TRY(status);
    if (frame->role == WEFT_ROLE_AMBIENT)
        weft_capture_remember_dark(run, &shot);
    weft_capture_remember_light(run, frame);
    weft_capture_warn_of_clipping(run, frame, &shot);
    frame->have = true;
    run->report.n_taken++;
    return WEFT_OK;
}

static weft_err take_frames(weft_capture_state *run, weft_error *err)
{
    WEFT_TRY(weft_capture_read_prints(run, err));
    if (run->o.no_ambient || run->plan.frames[0].have)
        WEFT_TRY(weft_capture_look_at_the_dark(run, err));
    for (int i = 0; i < run->plan.n; i++) {
        if (run->plan.frames[i].have)
            continue;
        WEFT_TRY(take_frame(run, &run->plan.frames[i], err));
        WEFT_TRY(weft_progress_step(run->progress, 1, err));
    }
    return WEFT_OK;
}

/* ---- the whole ---- */

static weft_err make_plan(weft_capture_state *run, const weft_controller_info *info,
                          const weft_camera_state *camera, weft_error *err)
{
    const char *const suffix = camera->suffix[0] && run->o.average == 1 ? camera->suffix : ".dng";
    WEFT_TRY(weft_capture_plan_make(&run->o, info->n_lights, &run->set, suffix, &run->plan, err));
    return run->plan.n > 0 ? WEFT_OK : weft_fail(err, WEFT_ERR_USAGE, "no frame is asked for");
}

static weft_err prepare(weft_capture_state *run, weft_set_found found, weft_error *err)
{
    const weft_controller_info *const info = weft_controller_get_info(run->shooter.controller);
    const weft_camera_state *const camera = weft_camera_get_state(run->shooter.camera);
    if (camera->width == 0) /* a frame tells, in the dark */
        WEFT_TRY(weft_camera_configure(run->shooter.camera, &(weft_camera_settings){0}, err));
    if (found == WEFT_SET_INTERRUPTED) {
        WEFT_TRY(weft_set_folder_check_camera(&run->set, weft_camera_backend_name(run->shooter.camera),
                                              camera, err));
        WEFT_TRY(weft_set_folder_adopt(&run->set, &run->o, err));
    }
    WEFT_TRY(complete_options(run, info, err));
    if (found != WEFT_SET_INTERRUPTED)
        WEFT_TRY(describe_set(run, err));
    WEFT_TRY(
        make_plan(run, info, camera, err)); /* once without exposures: a wish that cannot be fails at once */
    if (weft_exposures_are_open(&run->o)) {
        WEFT_TRY(weft_exposures_find(&run->shooter, &run->o, info->n_lights, err));
        WEFT_TRY(make_plan(run, info, camera, err));
    }
    WEFT_TRY(check_exposures(run, err));
    if (found == WEFT_SET_INTERRUPTED)
        WEFT_TRY(weft_set_folder_find_frames(&run->set, &run->plan, err));
    else
        WEFT_TRY(weft_set_folder_check_names(&run->o, found, &run->plan, err));
    WEFT_TRY(check_disk(run, err));
    WEFT_TRY(weft_set_folder_begin(&run->o, found, err));
    return weft_set_folder_remember(&run->set, &run->o, info, err);
}

weft_err weft_capture_check_folder(const weft_capture_options *options, weft_error *err)
{
    weft_set_found found;
    weft_set set = {0};
    WEFT_TRY(weft_set_folder_inspect(options, &found, &set, err));
    weft_set_fini(&set);
    return WEFT_OK;
}

/* After a failure: what is there, and how to go on. */
static weft_err tell_what_is_kept(const weft_capture_state *run, weft_err status, weft_error *err)
{
    const int kept = run->report.n_kept + run->report.n_taken;
    if (status == WEFT_ERR_CANCELLED)
        return weft_fail(err, status, "%s: cancelled; %d of %d frames are kept, --resume goes on",
                         run->o.folder, kept, run->plan.n);
    if (kept > 0)
        weft_note("%s: %d of %d frames are kept; --resume goes on with the set", run->o.folder, kept,
                  run->plan.n);
    return status;
}

/* What can be said only of the whole, and sidecars that were lost.  set.json comes last: it says complete. */
static weft_err finish_set(weft_capture_state *run, bool changed, weft_error *err)
{
    if (changed && run->report.n_exposures > weft_set_n_lights(&run->set))
        WEFT_TRY(weft_weights_record(&run->set, err));
    for (int i = 0; i < run->plan.n && run->o.sidecar && changed; i++)
        if (run->plan.frames[i].bracket >= 0)
            WEFT_TRY(weft_sidecar_write(&run->set, run->plan.frames[i].row, err));
    if (run->o.sidecar)
        WEFT_TRY(weft_sidecar_write_missing(&run->set, err));
    run->set.complete = true;
    return weft_set_save(&run->set, err);
}

static weft_err capture(weft_capture_state *run, weft_error *err)
{
    weft_set_found found;
    WEFT_TRY(weft_set_folder_inspect(&run->o, &found, &run->set, err));
    WEFT_TRY(prepare(run, found, err));
    const int missing = count_missing(&run->plan);
    run->report.n_frames = run->plan.n;
    run->report.n_kept = run->plan.n - missing;
    if (missing > 0) {
        run->set.complete = false;
        WEFT_TRY(weft_set_save(&run->set, err));
        weft_progress_begin(run->progress, "capturing", "frames", missing);
        const weft_err status = take_frames(run, err);
        if (status != WEFT_OK)
            return tell_what_is_kept(run, status, err);
    }
    return finish_set(run, missing > 0, err);
}

weft_err weft_capture_run(const weft_capture_options *options, weft_camera_device *camera,
                          weft_controller *controller, weft_progress *progress, weft_set *set,
                          weft_capture_report *report, weft_error *err)
{
    const double start_s = weft_clock_s();
    weft_capture_state *const run = weft_alloc(1, sizeof *run, err);
    if (!run)
        return WEFT_ERR_NOMEM;
    run->o = *options;
    run->progress = progress;
    run->shooter.camera = camera;
    run->shooter.controller = controller;
    weft_controller_panic_on_crash(controller);
    weft_shooter_begin(&run->shooter);
    const weft_err status = capture(run, err);
    weft_shooter_end(&run->shooter);
    weft_progress_end(progress);
    run->report.seconds = weft_clock_s() - start_s;
    if (status == WEFT_OK) {
        *set = run->set;
        if (report)
            *report = run->report;
    } else {
        weft_set_fini(&run->set);
    }
    weft_free(run);
    return status;
}
