/* What is kept of a frame: its file, its sidecar, its entry in set.json. */
#include "host/capture/capture_private.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/sha256.h"
#include "host/capture/sidecar.h"

#include <pthread.h>
#include <stdio.h>
#include <time.h>

json_t *weft_capture_describe_shot(const weft_capture_state *run, const weft_planned_frame *frame,
                                   const weft_shot *shot, json_t *retries)
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

static void describe_dng(const weft_capture_state *run, weft_frame_info *info)
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
static weft_err write_frame(const weft_capture_state *run, const char *path, weft_error *err)
{
    const weft_captured_frame *const frame = &run->shooter.frame;
    weft_frame_info info;
    if (frame->file.size > 0)
        return weft_file_write(path, frame->file.bytes, frame->file.size, err);
    describe_dng(run, &info);
    return weft_dng_write(path, &frame->mosaic, &info, err);
}

/* Writes the file, then its row in set.json: a row's file is always whole. */
static weft_err keep_frame(weft_capture_state *run, weft_planned_frame *planned, json_t *capture,
                           weft_error *err)
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
    weft_capture_state *run;
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
weft_err weft_capture_keep(weft_capture_state *run, weft_planned_frame *frame, json_t *capture,
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
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_nsec += 100000000;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        if (pthread_clockjoin_np(thread, NULL, CLOCK_MONOTONIC, &until) == 0)
            break;
        if (awake == WEFT_OK)
            awake = weft_shooter_keep_alive(&run->shooter, &sleepy);
    }
    if (job.status != WEFT_OK) {
        if (err)
            *err = job.error;
        return job.status;
    }
    return awake == WEFT_OK ? WEFT_OK : weft_capture_come_back(run, awake, &sleepy, err);
}
