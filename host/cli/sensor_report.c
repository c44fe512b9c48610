#include "host/cli/sensor_report.h"

#include "calibration/sensor_noise.h"
#include "core/formats/raw_file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

/* Adds a frame; one that is no raw is passed over. */
static weft_err add_frame(const weft_set *set, int frame, const double *offset, weft_sensor_frames **frames,
                          double black[WEFT_SENSOR_CLASSES], weft_error *err)
{
    weft_mosaic mosaic;
    weft_frame_info info;
    char *const path = weft_set_frame_path(set, frame, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const bool raw = weft_raw_read(path, &mosaic, &info, NULL) == WEFT_OK;
    weft_free(path);
    if (!raw)
        return WEFT_OK;
    for (int s = 0; s < WEFT_SENSOR_CLASSES; s++) {
        const double stated = (double)mosaic.black[s];
        black[s] = stated + (offset ? offset[s] * ((double)mosaic.white - stated) : 0);
    }
    weft_err status = *frames ? WEFT_OK : weft_sensor_frames_create(&mosaic, frames, err);
    if (status == WEFT_OK)
        status = weft_sensor_frames_add(*frames, &mosaic, black, err);
    weft_mosaic_fini(&mosaic);
    return status;
}

static json_t *class_json(const weft_sensor_class *c, double black)
{
    json_t *const one =
        json_pack("{s:f, s:f, s:f, s:f, s:f, s:o, s:o}", "black_dn", black, "gain_e_per_dn", c->gain_e_per_dn,
                  "gain_sigma", c->gain_sigma, "read_noise_e", c->read_noise_e, "fixed_pattern", c->prnu,
                  "level_dn", weft_json_numbers(c->level_dn, c->n_levels), "variance_dn2",
                  weft_json_numbers(c->variance_dn2, c->n_levels));
    if (one)
        json_object_set_new(one, "saturation_dn",
                            c->saturation_dn > 0 ? json_real(c->saturation_dn) : json_null());
    return one;
}

static json_t *fit_classes(const weft_sensor_frames *frames, const double black[WEFT_SENSOR_CLASSES])
{
    json_t *const noise = json_array();
    for (int s = 0; s < WEFT_SENSOR_CLASSES; s++) {
        weft_sensor_class c;
        weft_error error = {0};
        if (weft_sensor_fit(frames, s, &c, &error) != WEFT_OK) {
            weft_note("noise of the sensor: %s", error.text);
            json_decref(noise);
            return NULL;
        }
        json_array_append_new(noise, class_json(&c, black[s]));
    }
    return noise;
}

weft_err weft_sensor_report(const weft_set *set, const double *offset, json_t **noise, weft_error *err)
{
    weft_sensor_frames *frames = NULL;
    double black[WEFT_SENSOR_CLASSES] = {0};
    weft_err status = WEFT_OK;
    weft_progress progress = {0};
    *noise = NULL;
    weft_progress_begin(&progress, "measuring the noise", "frames", set->n_frames);
    for (int f = 0; f < set->n_frames && status == WEFT_OK; f++) {
        if (set->cfa != WEFT_CFA_NONE && set->frames[f].gain == set->frames[0].gain)
            status = add_frame(set, f, offset, &frames, black, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    if (status == WEFT_OK && frames)
        *noise = fit_classes(frames, black);
    weft_sensor_frames_destroy(frames);
    return status;
}
