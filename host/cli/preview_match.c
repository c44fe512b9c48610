#include "host/cli/preview_match.h"

#include "core/formats/image_file.h"
#include "core/progress.h"
#include "host/solve/rematch.h"
#include "shading/preview/sheet.h"

#include <math.h>
#include <stdio.h>

enum { TILE_WIDTH = 300, DIFFERENCE_GAIN = 4 };

/* Three tiles of a light: photograph, rendering, |difference| enlarged. */
static weft_err place_light(weft_sheet *sheet, const weft_rematch_figures *f, weft_image pictures[2],
                            weft_error *err)
{
    char label[3][64];
    const size_t n = 3 * weft_image_plane_size(&pictures[0]);
    snprintf(label[0], sizeof label[0], "light %d: photograph", f->light);
    snprintf(label[1], sizeof label[1], "rendering, %.1f dB", f->psnr_db);
    snprintf(label[2], sizeof label[2], "difference x %d", DIFFERENCE_GAIN);
    WEFT_TRY(weft_sheet_place(sheet, 0, f->light, &pictures[0], label[0], err));
    WEFT_TRY(weft_sheet_place(sheet, 1, f->light, &pictures[1], label[1], err));
    for (size_t i = 0; i < n; i++)
        pictures[0].data[i] = DIFFERENCE_GAIN * fabsf(pictures[0].data[i] - pictures[1].data[i]);
    return weft_sheet_place(sheet, 2, f->light, &pictures[0], label[2], err);
}

static weft_err match_lights(const weft_rematch *match, weft_sheet *sheet, weft_rematch_figures *figures,
                             weft_error *err)
{
    weft_progress progress;
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, "matching", "lights", match->plates.n);
    for (int light = 0; light < match->plates.n && status == WEFT_OK; light++) {
        weft_image pictures[2] = {0};
        status = weft_rematch_light(match, light, &figures[light], pictures, err);
        if (status == WEFT_OK)
            status = place_light(sheet, &figures[light], pictures, err);
        weft_image_fini(&pictures[0]);
        weft_image_fini(&pictures[1]);
        if (status == WEFT_OK)
            status = weft_progress_step(&progress, 1, err);
    }
    weft_progress_end(&progress);
    return status;
}

static weft_err print_figures(const weft_invocation *inv, const weft_rematch_figures *figures, int n,
                              const char *output, weft_error *err)
{
    double mean = 0;
    json_t *const rows = json_array();
    if (!inv->json)
        fprintf(inv->out, "light  psnr, dB  linear, dB  rendering/photograph  pixels\n");
    for (int i = 0; i < n; i++) {
        const weft_rematch_figures *const f = &figures[i];
        mean += f->psnr_db / n;
        json_array_append_new(rows, json_pack("{s:i, s:f, s:f, s:f, s:I}", "light", f->light, "psnr_db",
                                              f->psnr_db, "psnr_linear_db", f->psnr_linear_db, "ratio",
                                              f->ratio, "pixels", (json_int_t)f->n_pixels));
        if (!inv->json)
            fprintf(inv->out, "%5d  %8.2f  %10.2f  %20.4f  %zu\n", f->light, f->psnr_db, f->psnr_linear_db,
                    f->ratio, f->n_pixels);
    }
    if (inv->json)
        return weft_print_json(
            inv, json_pack("{s:s, s:f, s:o}", "output", output, "psnr_db_mean", mean, "lights", rows), err);
    json_decref(rows);
    fprintf(inv->out, "%s: %d lights, %.2f dB on the mean\n", output, n, mean);
    return WEFT_OK;
}

/* The height over the calibrated plane that the maps were solved with. */
static double solved_height_mm(const weft_maps *maps)
{
    const json_t *const options = maps->info ? json_object_get(maps->info, "options") : NULL;
    return json_number_value(json_object_get(options, "thickness_mm"));
}

static weft_err run_match(const weft_invocation *inv, const weft_preview_input *input, const weft_set *set,
                          const weft_calibration *cal, const char *cal_folder, const char *output,
                          weft_error *err)
{
    weft_rematch match;
    weft_rematch_figures figures[WEFT_LIGHTS_MAX];
    weft_sheet sheet = {0};
    const weft_maps *const maps = &input->maps;
    const int height = (int)fmax(1, (double)TILE_WIDTH * maps->height / maps->width);
    WEFT_TRY(
        weft_rematch_init(&match, &input->surface, maps, set, cal, cal_folder, solved_height_mm(maps), err));
    weft_err status = weft_sheet_init(&sheet, 3, match.plates.n, TILE_WIDTH, height, set->name, err);
    if (status == WEFT_OK)
        status = match_lights(&match, &sheet, figures, err);
    if (status == WEFT_OK)
        status = weft_image_write(output, &sheet.image, 8, WEFT_TRANSFER_SRGB, err);
    weft_sheet_fini(&sheet);
    if (status == WEFT_OK)
        status = print_figures(inv, figures, match.plates.n, output, err);
    weft_rematch_fini(&match);
    return status;
}

weft_err weft_preview_match(const weft_invocation *inv, const weft_preview_input *input,
                            const char *set_folder, const char *cal_folder, const char *output,
                            weft_error *err)
{
    weft_set set;
    weft_calibration cal;
    WEFT_TRY(weft_calibration_load(cal_folder, &cal, err));
    weft_err status = weft_set_load(set_folder, &set, err);
    if (status == WEFT_OK) {
        status = run_match(inv, input, &set, &cal, cal_folder, output, err);
        weft_set_fini(&set);
    }
    weft_calibration_fini(&cal);
    return status;
}
