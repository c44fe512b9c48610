#include "host/capture/capture.h"

#include "core/file.h"
#include "core/formats/raw_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "host/capture/average.h"
#include "host/capture/exposures.h"
#include "host/capture/light_print.h"
#include "host/capture/live_picture.h"
#include "host/capture/set_folder.h"
#include "host/capture/shoot.h"
#include "host/capture/sidecar.h"
#include "host/capture/weights.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

/* A frame with a light must beat the one without by 2 % (lamps of the room flicker) and by 0.05 % of the
 * range (8 of 16384 DN: the mean of a million photosites knows its offset much better than that). */
#define BRIGHTER_FACTOR 1.02
#define BRIGHTER_OFFSET 0.0005
/* Clipped photosites of one colour that are worth a warning. */
#define CLIPPED_SHARE 0.001
/* Frames of one light have one shape to a few thousandths (noise; a lamp that warms up moves nothing); those
 * of two lamps of a dome differ by some hundredths at least.  Short exposures of a bracket have more noise.
 */
#define SAME_SHAPE  0.005
#define OTHER_SHAPE 0.03
/* A room this bright costs range and adds its own noise. */
#define BRIGHT_ROOM 0.05
/* A DNG is its samples and some tags. */
#define DNG_TAGS_BYTES 65536
#define SPARE_BYTES    (UINT64_C(4) << 20)

typedef struct capture_run {
    weft_capture_options o; /* with nothing left to default */
    weft_shooter shooter;
    weft_capture_plan plan;
    weft_set set;
    weft_capture_report report;
    weft_progress *progress;
    bool has_dark_mean;
    double dark_mean; /* mean of a frame without lights, share of the range per second and gain */
    weft_light_print dark_print;
    weft_light_print prints[WEFT_CAPTURE_MAX_LIGHTS]; /* of the middle exposures that there are */
} capture_run;

static weft_err complete_options(capture_run *run, const weft_controller_info *info, weft_error *err)
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

static weft_err ask_camera(capture_run *run, double exposure_s, double *achieved_s, weft_error *err)
{
    WEFT_TRY(weft_shooter_set_camera(&run->shooter, exposure_s, run->o.gain, err));
    *achieved_s = weft_camera_get_state(run->shooter.camera)->exposure_s;
    return WEFT_OK;
}

/* Each exposure of the plan is told to the camera once, so that an impossible bracket fails at once. */
static weft_err check_exposures(capture_run *run, weft_error *err)
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

static weft_err check_disk(const capture_run *run, weft_error *err)
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

static weft_err describe_set(capture_run *run, weft_error *err)
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

/* ---- one frame ---- */

/* A light that does not light must not pass for a dark side of the cloth. */
static void check_brightness(const capture_run *run, const weft_planned_frame *frame, weft_shot *shot)
{
    const double without = run->dark_mean * run->shooter.frame.exposure_s * run->shooter.frame.gain;
    if (!frame->lights || !frame->middle || !run->has_dark_mean)
        return;
    if (shot->stats.mean <= without * BRIGHTER_FACTOR + BRIGHTER_OFFSET)
        snprintf(shot->reason, sizeof shot->reason,
                 "no brighter than without it (%.2f %% of the range, without %.2f %%): %s",
                 100 * shot->stats.mean, 100 * without,
                 without > BRIGHT_ROOM ? "does this lamp shine all the time?" : "is the lamp connected?");
}

static weft_light_print print_of_frame(const capture_run *run)
{
    const weft_captured_frame *const f = &run->shooter.frame;
    return weft_light_print_make(&f->mosaic, f->exposure_s * f->gain);
}

/* The controller answers for its outputs; the picture for the lamps behind them. */
static void check_shape(const capture_run *run, const weft_planned_frame *frame, weft_shot *shot)
{
    if (frame->role != WEFT_ROLE_LIGHT)
        return;
    const weft_light_print now = print_of_frame(run);
    for (int light = 0; light < WEFT_CAPTURE_MAX_LIGHTS && !shot->reason[0]; light++) {
        const double d = weft_light_print_difference(&now, &run->prints[light], &run->dark_print);
        if (d < 0)
            continue;
        if (light == frame->light && !frame->middle && d > OTHER_SHAPE)
            snprintf(
                shot->reason, sizeof shot->reason,
                "another picture than its exposure of %g s (they differ by %.1f %%): was another lamp on, or "
                "did the sample move?",
                run->prints[light].time / run->shooter.frame.gain, 100 * d);
        else if (light != frame->light && frame->middle && d < SAME_SHAPE)
            snprintf(
                shot->reason, sizeof shot->reason,
                "the same picture as under light %d (they differ by %.2f %%): does its wire go to that lamp?",
                light, 100 * d);
    }
}

/* A cable that was pulled out may be put in again.  Meanwhile the controller goes dark by itself, and what
 * was being exposed is void.  Any other failure stays one. */
static weft_err come_back(capture_run *run, weft_err status, weft_error *why, weft_error *err)
{
    weft_controller *const c = run->shooter.controller;
    if (!weft_controller_is_gone(c)) {
        if (err)
            *err = *why;
        return status;
    }
    weft_warn("%s; waiting %g s for it", why->text, run->o.patience_s);
    return weft_controller_reopen(c, run->o.patience_s, err);
}

/* One exposure; a controller that was unplugged and is back gives a reason to take it again. */
static weft_err shoot(capture_run *run, const weft_planned_frame *frame, weft_shot *shot, weft_error *err)
{
    weft_error why = {0};
    const weft_err status =
        weft_shoot(&run->shooter, frame->lights, frame->exposure_s, run->o.gain, shot, &why);
    if (status == WEFT_OK)
        return WEFT_OK;
    WEFT_TRY(come_back(run, status, &why, err));
    snprintf(shot->reason, sizeof shot->reason, "the light controller was unplugged");
    return WEFT_OK;
}

/* Takes the frame until it is good.  `retries` gets a reason for each one that was not. */
static weft_err shoot_until_good(capture_run *run, const weft_planned_frame *frame, weft_shot *shot,
                                 json_t *retries, weft_error *err)
{
    char what[32];
    weft_planned_frame_words(frame, what);
    for (int try = 1;; try++) {
        const weft_err status = shoot(run, frame, shot, err);
        if (status != WEFT_OK)
            return weft_prefix(err, status, "%s", what);
        if (!shot->reason[0])
            check_brightness(run, frame, shot);
        if (!shot->reason[0])
            check_shape(run, frame, shot);
        if (!shot->reason[0])
            return WEFT_OK;
        if (try >= run->o.tries)
            return weft_fail(err, WEFT_ERR_DEVICE, "%s: %s (tried %d times)", what, shot->reason, try);
        weft_warn("%s: %s; taking it again", what, shot->reason);
        json_array_append_new(retries, json_string(shot->reason));
        run->report.n_retries++;
    }
}

/* Each of the frames is judged by itself; what is kept is their mean, as a DNG. */
static weft_err shoot_mean(capture_run *run, const weft_planned_frame *frame, weft_shot *shot,
                           json_t *retries, weft_error *err)
{
    weft_captured_frame *const f = &run->shooter.frame;
    weft_average mean = {0};
    weft_err status = WEFT_OK;
    for (int i = 0; i < run->o.average && status == WEFT_OK; i++) {
        status = shoot_until_good(run, frame, shot, retries, err);
        if (status == WEFT_OK && run->o.average > 1)
            status = weft_average_add(&mean, &f->mosaic, err);
        if (status == WEFT_OK && weft_cancelled())
            status = weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
    }
    if (status == WEFT_OK && run->o.average > 1) {
        weft_average_get(&mean, &f->mosaic);
        f->file.size = 0;
        status = weft_frame_stats_make(&f->mosaic, &shot->stats, err);
    }
    weft_average_fini(&mean);
    return status;
}

static void remember_dark_mean(capture_run *run, const weft_shot *shot)
{
    const weft_captured_frame *const f = &run->shooter.frame;
    run->dark_mean = fmax(shot->stats.mean, 0) / (f->exposure_s * f->gain);
    run->has_dark_mean = true;
    run->dark_print = print_of_frame(run);
    if (shot->stats.mean > BRIGHT_ROOM) {
        weft_warn("the room is bright: %.0f %% of the range with all lights off; darken it",
                  100 * shot->stats.mean);
        run->report.n_warnings++;
    }
}

/* What the lights are compared with when the set has or gets no ambient frame now. */
static weft_err look_at_the_dark(capture_run *run, weft_error *err)
{
    const weft_planned_frame frame = {.role = WEFT_ROLE_AMBIENT,
                                      .light = -1,
                                      .exposure_s = weft_exposures_longest(&run->o),
                                      .middle = true};
    weft_shot shot;
    json_t *const reasons = json_array();
    const weft_err status = shoot_until_good(run, &frame, &shot, reasons, err);
    json_decref(reasons);
    if (status == WEFT_OK)
        remember_dark_mean(run, &shot);
    return status;
}

static void warn_of_clipping(capture_run *run, const weft_planned_frame *frame, const weft_shot *shot)
{
    const char *colour;
    const double share = weft_frame_stats_clipped(&shot->stats, &colour);
    if (!frame->shortest || share <= CLIPPED_SHARE)
        return;
    weft_warn("%s: %.1f %% of the %s pixels are clipped at %g s; give a shorter --exposure, or --bracket 3",
              frame->file, 100 * share, colour, run->shooter.frame.exposure_s);
    run->report.n_warnings++;
}

static json_t *describe_shot(const capture_run *run, const weft_planned_frame *frame, const weft_shot *shot,
                             json_t *retries)
{
    char now[32];
    weft_time_now_iso(now);
    json_t *const o =
        json_pack("{s:s, s:I, s:O, s:o}", "taken", now, "sequence", (json_int_t)run->shooter.frame.sequence,
                  "retries", retries, "statistics", weft_frame_stats_to_json(&shot->stats));
    if (o && run->o.average > 1)
        json_object_set_new(o, "mean_of", json_integer(run->o.average));
    if (o && frame->bracket >= 0)
        json_object_set_new(o, "bracket", json_integer(frame->bracket));
    if (!o || (!frame->lights && !shot->proved))
        return o;
    const weft_controller_info *const info = weft_controller_get_info(run->shooter.controller);
    json_object_set_new(o, "proof", json_string(shot->proved ? "exposure line" : "controller and picture"));
    if (shot->proved) {
        json_object_set_new(o, "rise_tick", json_integer((json_int_t)shot->rise_tick));
        json_object_set_new(o, "fall_tick", json_integer((json_int_t)shot->fall_tick));
    }
    json_object_set_new(o, "lights", json_integer((json_int_t)frame->lights));
    json_object_set_new(o, "level", json_integer(run->o.level));
    json_object_set_new(o, "settle_s", json_real(run->o.settle_s));
    json_object_set_new(o, "on_tick", json_integer((json_int_t)shot->on_tick));
    json_object_set_new(o, "off_tick", json_integer((json_int_t)shot->off_tick));
    json_object_set_new(o, "tick_hz", json_integer((json_int_t)info->tick_hz));
    return o;
}

static void describe_dng(const capture_run *run, weft_frame_info *info)
{
    const weft_camera_state *const camera = weft_camera_get_state(run->shooter.camera);
    const time_t now = time(NULL);
    struct tm local;
    *info = (weft_frame_info){.exposure_s = run->shooter.frame.exposure_s, .gain = run->shooter.frame.gain};
    snprintf(info->make, sizeof info->make, "%s", camera->vendor);
    snprintf(info->model, sizeof info->model, "%s", camera->model);
    snprintf(info->serial, sizeof info->serial, "%s", camera->serial);
    localtime_r(&now, &local);
    strftime(info->date_time, sizeof info->date_time, "%Y:%m:%d %H:%M:%S", &local);
}

/* The camera's own file where it has one, else a DNG. */
static weft_err write_frame(const capture_run *run, const char *path, weft_error *err)
{
    const weft_captured_frame *const frame = &run->shooter.frame;
    weft_frame_info info;
    if (frame->file.size > 0)
        return weft_file_write(path, frame->file.bytes, frame->file.size, err);
    describe_dng(run, &info);
    return weft_dng_write(path, &frame->mosaic, &info, err);
}

/* Writes the file, then its row in set.json: a row's file is always whole. */
static weft_err keep_frame(capture_run *run, weft_planned_frame *planned, json_t *capture, weft_error *err)
{
    weft_set_frame row = {.file = (char *)(uintptr_t)planned->file, /* copied, not changed */
                          .role = planned->role,
                          .light = planned->light,
                          .exposure_s = run->shooter.frame.exposure_s,
                          .gain = run->shooter.frame.gain,
                          .capture = capture};
    char *const path = weft_path_join(run->o.folder, planned->file, err);
    weft_err status = path ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = write_frame(run, path, err);
    if (status == WEFT_OK)
        status = weft_sha256_file(path, row.sha256, err);
    weft_free(path);
    WEFT_TRY(status);
    if (planned->row < 0) {
        WEFT_TRY(weft_set_add_frame(&run->set, &row, err));
        planned->row = run->set.n_frames - 1;
    } else {
        weft_set_frame *const old = &run->set.frames[planned->row];
        row.file = old->file;
        json_decref(old->capture);
        *old = row;
    }
    json_incref(capture); /* the set's own */
    if (run->o.sidecar)
        WEFT_TRY(weft_sidecar_write(&run->set, planned->row, err));
    return weft_set_save(&run->set, err);
}

/* Writing a frame on another thread. */
typedef struct keep_job {
    capture_run *run;
    weft_planned_frame *frame;
    json_t *capture;
    weft_err status;
    weft_error error;
} keep_job;

static void *do_keep_job(void *context)
{
    keep_job *const job = context;
    job->status = keep_frame(job->run, job->frame, job->capture, &job->error);
    return NULL;
}

/* A disk may take longer than the lease lasts: another thread writes while this one keeps the controller
 * awake.  Nothing else touches the run meanwhile. */
static weft_err keep_frame_awake(capture_run *run, weft_planned_frame *frame, json_t *capture,
                                 weft_error *err)
{
    keep_job job = {.run = run, .frame = frame, .capture = capture};
    weft_err awake = WEFT_OK;
    weft_error sleepy = {0};
    pthread_t thread;
    if (pthread_create(&thread, NULL, do_keep_job, &job) != 0)
        return weft_fail(err, WEFT_ERR_NOMEM, "no thread could be started to write %s", frame->file);
    for (;;) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += 100000000;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        if (pthread_timedjoin_np(thread, NULL, &until) == 0)
            break;
        if (awake == WEFT_OK)
            awake = weft_shooter_keep_alive(&run->shooter, &sleepy);
    }
    if (job.status != WEFT_OK) {
        if (err)
            *err = job.error;
        return job.status;
    }
    return awake == WEFT_OK ? WEFT_OK : come_back(run, awake, &sleepy, err);
}

static weft_err take_frame(capture_run *run, weft_planned_frame *frame, weft_error *err)
{
    weft_shot shot = {0};
    json_t *const retries = json_array();
    json_t *capture = NULL;
    weft_err status = WEFT_OK;
    if (frame->role == WEFT_ROLE_DARK && run->o.cap_lens)
        status = run->o.cap_lens(run->o.context, err);
    if (status == WEFT_OK)
        status = shoot_mean(run, frame, &shot, retries, err);
    if (status == WEFT_OK && !(capture = describe_shot(run, frame, &shot, retries)))
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the record of %s", frame->file);
    if (status == WEFT_OK) {
        weft_live_picture_report(frame->file, &run->shooter.frame.mosaic);
        status = keep_frame_awake(run, frame, capture, err);
    }
    json_decref(capture);
    json_decref(retries);
    WEFT_TRY(status);
    if (frame->role == WEFT_ROLE_AMBIENT)
        remember_dark_mean(run, &shot);
    if (frame->role == WEFT_ROLE_LIGHT && frame->middle)
        run->prints[frame->light] = print_of_frame(run);
    warn_of_clipping(run, frame, &shot);
    frame->have = true;
    run->report.n_taken++;
    return WEFT_OK;
}

/* Of frames from before: a set that is resumed is judged as one that is taken in one go. */
static weft_err read_prints(capture_run *run, weft_error *err)
{
    for (int i = 0; i < run->plan.n; i++) {
        const weft_planned_frame *const f = &run->plan.frames[i];
        if (!f->have || f->role != WEFT_ROLE_LIGHT || !f->middle)
            continue;
        weft_mosaic mosaic;
        char *const path = weft_set_frame_path(&run->set, f->row, err);
        const weft_err status = path ? weft_raw_read(path, &mosaic, NULL, err) : WEFT_ERR_NOMEM;
        weft_free(path);
        WEFT_TRY(status);
        run->prints[f->light] = weft_light_print_make(&mosaic, weft_set_frame_time(&run->set.frames[f->row]));
        weft_mosaic_fini(&mosaic);
    }
    return WEFT_OK;
}

static weft_err take_frames(capture_run *run, weft_error *err)
{
    WEFT_TRY(read_prints(run, err));
    if (run->o.no_ambient || run->plan.frames[0].have)
        WEFT_TRY(look_at_the_dark(run, err));
    for (int i = 0; i < run->plan.n; i++) {
        if (run->plan.frames[i].have)
            continue;
        WEFT_TRY(take_frame(run, &run->plan.frames[i], err));
        WEFT_TRY(weft_progress_step(run->progress, 1, err));
    }
    return WEFT_OK;
}

/* ---- the whole ---- */

static weft_err make_plan(capture_run *run, const weft_controller_info *info, const weft_camera_state *camera,
                          weft_error *err)
{
    const char *const suffix = camera->suffix[0] && run->o.average == 1 ? camera->suffix : ".dng";
    WEFT_TRY(weft_capture_plan_make(&run->o, info->n_lights, &run->set, suffix, &run->plan, err));
    return run->plan.n > 0 ? WEFT_OK : weft_fail(err, WEFT_ERR_USAGE, "no frame is asked for");
}

static weft_err prepare(capture_run *run, weft_set_found found, weft_error *err)
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
static weft_err tell_what_is_kept(const capture_run *run, weft_err status, weft_error *err)
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
static weft_err finish_set(capture_run *run, bool changed, weft_error *err)
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

static weft_err capture(capture_run *run, weft_error *err)
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
    capture_run *const run = weft_alloc(1, sizeof *run, err);
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
