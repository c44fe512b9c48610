#include "host/solve/info.h"

#include "core/file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/mem_limit.h"
#include "core/sha256.h"
#include "core/version.h"

#include <math.h>

static weft_err hash_into(json_t *object, const char *folder, const char *name, weft_error *err)
{
    char hex[65];
    char *const path = weft_path_join(folder, name, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const weft_err status = weft_sha256_file(path, hex, err);
    weft_free(path);
    if (status == WEFT_OK)
        json_object_set_new(object, name, json_string(hex));
    return status;
}

/* Frames whose hash the set records were checked against it when they were read. */
static weft_err frame_hashes(const weft_set *set, json_t *frames, weft_error *err)
{
    for (int i = 0; i < set->n_frames; i++) {
        const weft_set_frame *const f = &set->frames[i];
        if (f->role != WEFT_ROLE_LIGHT && f->role != WEFT_ROLE_AMBIENT)
            continue;
        if (f->sha256[0])
            json_object_set_new(frames, f->file, json_string(f->sha256));
        else
            WEFT_TRY(hash_into(frames, set->folder, f->file, err));
    }
    return WEFT_OK;
}

static weft_err inputs(const weft_set *set, const char *cal_folder, json_t *to, weft_error *err)
{
    json_t *const set_part = json_object(), *const cal_part = json_object(), *const frames = json_object();
    json_object_set_new(to, "set", set_part);
    json_object_set_new(to, "calibration", cal_part);
    json_object_set_new(set_part, "folder", json_string(set->folder));
    json_object_set_new(set_part, "frames", frames);
    json_object_set_new(cal_part, "folder", json_string(cal_folder));
    WEFT_TRY(hash_into(set_part, set->folder, "set.json", err));
    WEFT_TRY(frame_hashes(set, frames, err));
    return hash_into(cal_part, cal_folder, "calibration.json", err);
}

static json_t *options_json(const weft_solve_options *o, const weft_maps *maps)
{
    const weft_solve_method *const method = o->method ? o->method : weft_solve_methods[0];
    return json_pack("{s:s, s:s, s:s, s:f, s:f, s:s, s:s}", "method", method->name, "geometry",
                     maps->geometry == WEFT_GEOMETRY_PLANE ? "plane" : "sensor", "resolution",
                     o->half     ? "half"
                     : o->linear ? "linear"
                                 : "full",
                     "thickness_mm", o->height_mm, "shadow", o->shadow, "gloss", o->matte ? "off" : "auto",
                     "bounce", o->no_bounce ? "off" : "auto");
}

static json_t *gloss_json(const weft_gloss *g)
{
    return json_pack("{s:f, s:f, s:f, s:f}", "strength", (double)g->strength, "alpha_along",
                     (double)g->alpha_along, "alpha_across", (double)g->alpha_across, "fibre_deg",
                     57.29577951308232 * atan2((double)g->fibre[0][1], (double)g->fibre[0][0]));
}

/* [light][colour]: what the strip gave over what the calibration says. */
static json_t *drift_json(const weft_solve_run *run)
{
    json_t *const gains = json_array();
    for (int j = 0; j < run->n_drift; j++)
        json_array_append_new(gains, weft_json_numbers(run->drift.gain[j], 3));
    return json_pack("{s:o, s:f}", "gain", gains, "sigma", run->drift.sigma);
}

static json_t *result_json(const weft_maps *maps, const weft_solve_run *run)
{
    const size_t width = (size_t)maps->width;
    size_t answered = 0;
    double residual = 0, confidence = 0, uncertainty = 0;
    for (size_t v = 0; v < (size_t)maps->height; v++, weft_mem_trim())
        for (size_t i = v * width; i < (v + 1) * width; i++)
            if (maps->mask.data[i]) {
                answered++;
                residual += (double)maps->residual.data[i];
                confidence += (double)maps->confidence.data[i];
                uncertainty += (double)maps->uncertainty.data[i];
            }
    const double count = answered ? (double)answered : 1;
    json_t *const result =
        json_pack("{s:i, s:i, s:I, s:f, s:f, s:f}", "width", maps->width, "height", maps->height,
                  "answered_px", (json_int_t)answered, "residual_mean", residual / count, "confidence_mean",
                  confidence / count, "uncertainty_deg_mean", uncertainty / count);
    if (result && run->report.found)
        json_object_set_new(result, "gloss", gloss_json(&run->gloss));
    if (result && run->bounce.done)
        json_object_set_new(result, "bounce",
                            json_pack("{s:f, s:f}", "relief_mm", run->bounce.relief_mm, "openness_mean",
                                      run->bounce.openness));
    if (result && run->n_drift)
        json_object_set_new(result, "drift", drift_json(run));
    return result;
}

weft_err weft_solve_describe(const weft_set *set, const char *cal_folder, const weft_solve_options *options,
                             const weft_solve_run *run, weft_maps *maps, weft_error *err)
{
    json_t *const info = json_object(), *const from = json_object();
    weft_err status = WEFT_OK;
    json_object_set_new(info, "software", json_string("weft " WEFT_VERSION));
    json_object_set_new(info, "inputs", from);
    if (info && from)
        status = inputs(set, cal_folder, from, err);
    json_object_set_new(info, "options", options_json(options, maps));
    json_object_set_new(info, "result", result_json(maps, run));
    if (json_object_set_new(info, "seconds",
                            json_pack("{s:f, s:f, s:f, s:f}", "read", run->seconds.read, "solve",
                                      run->seconds.solve, "bounce", run->seconds.bounce, "rectify",
                                      run->seconds.rectify)) != 0 &&
        status == WEFT_OK)
        status = weft_fail(err, WEFT_ERR_NOMEM, "out of memory for the description of the maps");
    if (status != WEFT_OK)
        json_decref(info);
    else
        maps->info = info;
    return status;
}
