#include "host/cli/colour_apply.h"

#include "calibration/calibration_colour.h"
#include "calibration/charts/chart_overlay.h"
#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/icc_profile.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/sha256.h"
#include "core/version.h"
#include "host/photo/photo_colour.h"

#include <stdio.h>
#include <string.h>

enum { FORMAT_TIFF, FORMAT_PNG, FORMAT_EXR };
#define MANIFEST "corrected.json"

/* Gradient of the light over the chart above which its colours are in doubt (S-FC3-03). */
static const double doubtful_gradient = 0.10;

/* One run. */
typedef struct apply_run {
    const weft_invocation *inv;
    const weft_apply_options *options;
    const weft_apply_chart *args;
    weft_photo_flat flat;
    weft_photo_correction correction;
    weft_gamut gamut;
    weft_photo_chart seen;
    bool has_chart;
    json_t *recipe; /* what was done with every photograph: the manifest's "correction" */
    json_t *photos; /* the manifest's "photos", by the name of the file */
    weft_text_buffer icc;
    char description[200];
    int n_done, n_skipped, n_failed;
} apply_run;

static weft_err hash_of(const char *path, char hex[65], weft_error *err)
{
    return weft_sha256_file(path, hex, err);
}

/* ---- the correction ---- */

static weft_err make_flat(apply_run *run, weft_error *err)
{
    const char *const path = run->options->flat;
    weft_photo sheet;
    if (!path)
        return WEFT_OK;
    WEFT_TRY(weft_photo_read(path, (weft_photo_transfer)run->options->input, &sheet, err));
    weft_err status = weft_photo_flat_make(&sheet, &run->flat, err);
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s", path);
    weft_photo_fini(&sheet);
    return status;
}

static weft_err draw_overlay(const apply_run *run, const weft_photo *photo, weft_error *err)
{
    const weft_chart_picture picture = {&photo->image, photo->cfa, NULL};
    unsigned char left_out[WEFT_CHART_MAX_PATCHES];
    weft_raster raster = {0};
    for (int p = 0; p < WEFT_CHART_MAX_PATCHES; p++)
        left_out[p] = run->seen.colours[p].excluded != NULL;
    WEFT_TRY(weft_chart_overlay(run->seen.chart, &picture, &run->seen.pose, left_out, &raster, err));
    const weft_err status = weft_png_write(run->args->overlay, &raster, err);
    weft_raster_fini(&raster);
    return status;
}

static weft_err correction_from_chart(apply_run *run, weft_error *err)
{
    const weft_apply_chart *const args = run->args;
    const char *const path = run->options->chart_photo;
    const weft_chart *chart;
    double corners[4][2];
    weft_photo photo;
    memcpy(corners, args->corners->values, sizeof corners);
    WEFT_TRY(weft_chart_find(args->name, args->edition, &chart, err));
    WEFT_TRY(weft_photo_read(path, (weft_photo_transfer)run->options->input, &photo, err));
    weft_err status = weft_photo_flatten(&photo, &run->flat, err);
    if (status == WEFT_OK)
        status =
            weft_photo_correction_fit(&photo, chart, args->corners->n ? (const double(*)[2])corners : NULL,
                                      args->exclude, args->method, &run->seen, &run->correction, err);
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s", path);
    if (status == WEFT_OK && args->overlay)
        status = draw_overlay(run, &photo, err);
    weft_photo_fini(&photo);
    run->has_chart = status == WEFT_OK;
    if (status == WEFT_OK && run->seen.light_gradient > doubtful_gradient)
        weft_warn(
            "%s: the light changes by %.0f %% over the chart; its colours are fitted nevertheless, but the "
            "photographs stay uneven: photograph a blank sheet in the chart's place too and give it as "
            "--flat",
            path, 100 * run->seen.light_gradient);
    return status;
}

static weft_err correction_from_calibration(apply_run *run, weft_error *err)
{
    weft_calibration cal;
    WEFT_TRY(weft_calibration_load(run->options->cal, &cal, err));
    const weft_err status = weft_photo_correction_of(&cal, run->options->cal, &run->correction, err);
    weft_calibration_fini(&cal);
    return status;
}

static weft_err source_json(json_t *to, const char *key, const char *path, weft_error *err)
{
    char hex[65];
    if (!path)
        return WEFT_OK;
    char *const inside =
        weft_folder_exists(path) ? weft_path_join(path, "calibration.json", err) : weft_strdup(path, err);
    const weft_err status = inside ? hash_of(inside, hex, err) : WEFT_ERR_NOMEM;
    weft_free(inside);
    WEFT_TRY(status);
    return json_object_set_new(to, key,
                               json_pack("{s:s, s:s}", "file", weft_path_name(path), "sha256", hex)) == 0
               ? WEFT_OK
               : weft_fail(err, WEFT_ERR_NOMEM, "no memory for " MANIFEST);
}

/* Two runs with the same recipe make the same pictures. */
static weft_err write_recipe(apply_run *run, weft_error *err)
{
    static const char *const formats[] = {"tiff", "png", "exr"}, *const inputs[] = {"auto", "linear", "srgb"};
    const weft_apply_options *const o = run->options;
    const bool linear = o->format == FORMAT_EXR || o->encoding == 1;
    run->recipe =
        json_pack("{s:s, s:s, s:i, s:s, s:o, s:f, s:o}", "format", formats[o->format], "encoding",
                  linear ? "linear" : "srgb", "bits", o->bits ? 8 : 16, "input", inputs[o->input], "gain",
                  weft_json_numbers(run->correction.gain, 3), "chart_exposure", run->correction.exposure,
                  "colour", weft_calibration_colour_to_json(&run->correction.colour));
    if (!run->recipe)
        return weft_fail(err, WEFT_ERR_NOMEM, "no memory for " MANIFEST);
    WEFT_TRY(source_json(run->recipe, "chart", o->chart_photo, err));
    WEFT_TRY(source_json(run->recipe, "flat", o->flat, err));
    WEFT_TRY(source_json(run->recipe, "calibration", o->cal, err));
    if (run->has_chart)
        json_object_set_new(run->recipe, "edition", json_string(run->seen.chart->edition));
    snprintf(run->description, sizeof run->description,
             "%s sRGB, corrected by %s (%s, CIEDE2000 %.2f trained, %.2f held out)",
             linear ? "linear" : "encoded",
             run->has_chart ? run->seen.chart->name : "a scanner's calibration",
             weft_colour_method_name(run->correction.colour.model.method),
             run->correction.colour.delta_e_mean, run->correction.colour.delta_e_held_out_mean);
    weft_icc_profile(linear ? WEFT_TRANSFER_LINEAR : WEFT_TRANSFER_SRGB, &run->icc);
    return weft_text_buffer_status(&run->icc, err);
}

static weft_err make_correction(apply_run *run, weft_error *err)
{
    const weft_apply_options *const o = run->options;
    if (!o->chart_photo == !o->cal)
        return weft_fail(err, WEFT_ERR_USAGE, "--apply wants --chart-photo FILE, or -c CAL, and not both");
    WEFT_TRY(make_flat(run, err));
    WEFT_TRY(o->cal ? correction_from_calibration(run, err) : correction_from_chart(run, err));
    const weft_colour_part *const colour = &run->correction.colour;
    weft_gamut_init(&run->gamut, colour->n_gamut, colour->gamut);
    return write_recipe(run, err);
}

/* ---- the manifest ---- */

static weft_err manifest_save(const apply_run *run, weft_error *err)
{
    char *const path = weft_path_join(run->args->output, MANIFEST, err);
    json_t *const all = json_pack("{s:s, s:i, s:s, s:O, s:O}", "weft", "corrected", "version", 1, "software",
                                  "weft " WEFT_VERSION, "correction", run->recipe, "photos", run->photos);
    const weft_err status = path && all ? weft_json_save(path, all, err)
                                        : weft_fail(err, WEFT_ERR_NOMEM, "no memory for " MANIFEST);
    json_decref(all);
    weft_free(path);
    return status;
}

/* Takes over what a former run with the same correction has done. */
static weft_err manifest_open(apply_run *run, weft_error *err)
{
    json_t *former = NULL;
    run->photos = json_object();
    WEFT_TRY(weft_folder_create(run->args->output, err));
    char *const path = weft_path_join(run->args->output, MANIFEST, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (weft_file_exists(path) && !run->inv->force)
        status = weft_json_load_kind(path, "corrected", 1, &former, err);
    if (former && json_equal(json_object_get(former, "correction"), run->recipe))
        json_object_update(run->photos, json_object_get(former, "photos"));
    else if (former)
        status = weft_fail(
            err, WEFT_ERR_EXISTS,
            "%s holds pictures of another correction: give another --output, or --force to replace them",
            run->args->output);
    json_decref(former);
    weft_free(path);
    return status;
}

/* ---- one photograph ---- */

static char *output_of(const apply_run *run, const char *photo, weft_error *err)
{
    static const char *const suffixes[] = {".tif", ".png", ".exr"};
    const char *const name = weft_path_name(photo), *const dot = strrchr(name, '.');
    const int stem = dot && dot != name ? (int)(dot - name) : (int)strlen(name);
    return weft_asprintf(err, "%s/%.*s%s", run->args->output, stem, name, suffixes[run->options->format]);
}

static weft_err write_picture(const apply_run *run, const char *path, const weft_photo *photo,
                              weft_error *err)
{
    static const char *const names[] = {"R", "G", "B"};
    const weft_transfer transfer = run->options->encoding == 1 ? WEFT_TRANSFER_LINEAR : WEFT_TRANSFER_SRGB;
    const weft_raster_note note = {.icc = run->icc.text,
                                   .icc_size = run->icc.n,
                                   .description = run->description,
                                   .software = "weft " WEFT_VERSION,
                                   .make = photo->info.make,
                                   .model = photo->info.model,
                                   .date_time = photo->info.date_time};
    weft_raster raster;
    if (run->options->format == FORMAT_EXR)
        return weft_exr_write(path, &photo->image, names, WEFT_EXR_HALF, err);
    WEFT_TRY(weft_raster_from_image(&raster, &photo->image, run->options->bits ? 8 : 16, transfer, err));
    const weft_err status = run->options->format == FORMAT_PNG
                                ? weft_png_write_noted(path, &raster, &note, err)
                                : weft_tiff_write_noted(path, &raster, &note, err);
    weft_raster_fini(&raster);
    return status;
}

static json_t *describe(const apply_run *run, const weft_photo *photo, const char *output, const char *sha256)
{
    const weft_colour_part *const colour = &run->correction.colour;
    weft_gamut_survey s;
    long clipped = 0;
    const size_t n = weft_image_plane_size(&photo->image);
    for (size_t i = 0; i < n; i++)
        clipped += photo->clipped.data[i] == 1;
    weft_gamut_look(&run->gamut, colour->n_gamut, colour->gamut, &photo->image, NULL, &s);
    return json_pack("{s:s, s:s, s:f, s:f}", "output", weft_path_name(output), "sha256", sha256,
                     "clipped_share", (double)clipped / (double)n, "outside_gamut_share",
                     s.counted ? (double)s.outside / (double)s.counted : 0.0);
}

static weft_err correct_one(const apply_run *run, const char *path, const char *output, const char *sha256,
                            json_t **entry, weft_error *err)
{
    weft_photo photo;
    WEFT_TRY(weft_photo_read(path, (weft_photo_transfer)run->options->input, &photo, err));
    weft_err status = weft_photo_flatten(&photo, &run->flat, err);
    if (status == WEFT_OK)
        status = weft_photo_correct(&photo, &run->correction, err);
    if (status == WEFT_OK)
        status = write_picture(run, output, &photo, err);
    if (status == WEFT_OK)
        *entry = describe(run, &photo, output, sha256);
    else if (!strstr(err->text, path))
        weft_prefix(err, status, "%s", path);
    weft_photo_fini(&photo);
    return status;
}

/* Whether a former run made exactly this picture of exactly this file. */
static bool is_done(const apply_run *run, const char *name, const char *output, const char *sha256)
{
    const json_t *const entry = json_object_get(run->photos, name);
    const char *const same = json_string_value(json_object_get(entry, "sha256"));
    const char *const made = json_string_value(json_object_get(entry, "output"));
    return same && made && strcmp(same, sha256) == 0 && strcmp(made, weft_path_name(output)) == 0 &&
           weft_file_exists(output);
}

static weft_err refuse_twin(const apply_run *run, int i, const char *output, weft_error *err)
{
    for (int j = 0; j < i; j++) {
        char *const other = output_of(run, run->inv->operands[j], err);
        const bool same = other && strcmp(other, output) == 0;
        weft_free(other);
        if (same)
            return weft_fail(err, WEFT_ERR_EXISTS, "%s: would overwrite the result of %s: rename one",
                             run->inv->operands[i], run->inv->operands[j]);
    }
    return WEFT_OK;
}

static weft_err work_on(apply_run *run, int i, weft_error *err)
{
    const char *const path = run->inv->operands[i], *const name = weft_path_name(path);
    char sha256[65];
    json_t *entry = NULL;
    char *const output = output_of(run, path, err);
    weft_err status = output ? refuse_twin(run, i, output, err) : WEFT_ERR_NOMEM;
    if (status != WEFT_OK) { /* the name in the manifest is the other's */
        run->n_failed++;
        weft_free(output);
        return status;
    }
    status = hash_of(path, sha256, err);
    if (status == WEFT_OK && is_done(run, name, output, sha256)) {
        run->n_skipped++;
        weft_free(output);
        return WEFT_OK;
    }
    if (status == WEFT_OK && !json_object_get(run->photos, name))
        status = weft_file_refuse_existing(output, run->inv->force, err);
    if (status == WEFT_OK)
        status = correct_one(run, path, output, sha256, &entry, err);
    if (status == WEFT_OK) {
        run->n_done++;
        if (!run->inv->json)
            fprintf(run->inv->out, "%s: %.2f %% clipped, %.1f %% outside the chart's gamut\n", output,
                    100 * json_number_value(json_object_get(entry, "clipped_share")),
                    100 * json_number_value(json_object_get(entry, "outside_gamut_share")));
    } else {
        run->n_failed++;
        entry = json_pack("{s:s}", "error", err->text);
    }
    json_object_set_new(run->photos, name, entry);
    weft_free(output);
    return status;
}

static weft_err work_on_all(apply_run *run, weft_error *err)
{
    weft_progress progress;
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, "correcting", "photographs", run->inv->n_operands);
    for (int i = 0; i < run->inv->n_operands && status == WEFT_OK; i++) {
        weft_error why = {0};
        if (work_on(run, i, &why) != WEFT_OK)
            weft_warn("%s", why.text); /* the others go on */
        status = manifest_save(run, err);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    return status;
}

static weft_err report(apply_run *run, weft_error *err)
{
    if (run->inv->json)
        return weft_print_json(run->inv,
                               json_pack("{s:i, s:i, s:i, s:O, s:O}", "corrected", run->n_done, "done_before",
                                         run->n_skipped, "failed", run->n_failed, "correction", run->recipe,
                                         "photos", run->photos),
                               err);
    fprintf(run->inv->out, "%d corrected, %d done before, %d failed\n", run->n_done, run->n_skipped,
            run->n_failed);
    return WEFT_OK;
}

static void print_correction(const apply_run *run)
{
    const weft_photo_chart *const s = &run->seen;
    if (!run->has_chart || run->inv->json)
        return;
    fprintf(run->inv->out,
            "%s %s: %d of %d patches, %s, CIEDE2000 before %.2f, trained %.2f, held out %.2f; light within "
            "%.1f %%\n",
            s->chart->name, s->chart->edition, s->fit.n_used, s->chart->columns * s->chart->rows,
            weft_colour_method_name(s->fit.model.method), s->fit.before_mean, s->fit.trained_mean,
            s->fit.held_out_mean, 100 * s->light_gradient);
    for (int p = 0; p < s->chart->columns * s->chart->rows; p++)
        if (s->colours[p].excluded)
            fprintf(run->inv->out, "left out: %s (%s)\n", s->chart->patches[p].name, s->colours[p].excluded);
}

weft_err weft_colour_apply(const weft_invocation *inv, const weft_apply_options *options,
                           const weft_apply_chart *chart, weft_error *err)
{
    apply_run run = {.inv = inv, .options = options, .args = chart};
    weft_err status = make_correction(&run, err);
    if (status == WEFT_OK)
        status = manifest_open(&run, err);
    if (status == WEFT_OK) {
        print_correction(&run);
        status = work_on_all(&run, err);
    }
    if (status == WEFT_OK)
        status = report(&run, err);
    if (status == WEFT_OK && run.n_failed > 0)
        status = weft_fail(err, WEFT_ERR_NODATA, "%d of %d photographs failed; the others are in %s",
                           run.n_failed, inv->n_operands, chart->output);
    weft_photo_flat_fini(&run.flat);
    weft_text_buffer_fini(&run.icc);
    json_decref(run.recipe);
    json_decref(run.photos);
    return status;
}
