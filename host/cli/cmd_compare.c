/* weft compare: how two map folders, pictures or calibrations differ. */
#include "host/cli/command.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "host/set/compare.h"

#include <math.h>
#include <string.h>

typedef struct compare_args {
    const char *mask;
} compare_args;

static const weft_field fields[] = {
    {.key = "mask",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(compare_args, mask),
     .unit = "FILE",
     .help = "PNG of the size of A: only where it is not 0"},
    {0},
};

typedef enum kind { KIND_MAPS, KIND_CALIBRATION, KIND_PICTURE } kind;

static weft_err kind_of(const char *path, kind *k, weft_error *err)
{
    if (!weft_folder_exists(path)) {
        *k = KIND_PICTURE;
        return weft_file_exists(path) ? WEFT_OK : weft_fail(err, WEFT_ERR_MISSING, "%s is not there", path);
    }
    char *const calibration = weft_path_join(path, "calibration.json", err);
    if (!calibration)
        return WEFT_ERR_NOMEM;
    *k = weft_file_exists(calibration) ? KIND_CALIBRATION : KIND_MAPS;
    weft_free(calibration);
    return WEFT_OK;
}

static json_t *spread_json(const weft_spread *s)
{
    return json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:f}", "n", (json_int_t)s->n, "mean", s->mean, "median",
                     s->median, "p95", s->p95, "p99", s->p99, "max", s->max, "rms", s->rms);
}

static void print_spread(FILE *out, const char *what, const char *unit, const weft_spread *s)
{
    fprintf(out, "%-16s mean %.4f  median %.4f  p95 %.4f  p99 %.4f  max %.4f %s  (%zu px)\n", what, s->mean,
            s->median, s->p95, s->p99, s->max, unit, s->n);
}

/* ---- maps ---- */

static const char *const flaw_names[WEFT_N_FLAWS] = {"tears", "creases", "lint"};

static double share(size_t part, size_t whole)
{
    return whole ? (double)part / (double)whole : (double)NAN;
}

static json_t *share_json(size_t part, size_t whole)
{
    return whole ? json_real(share(part, whole)) : json_null();
}

static json_t *flaws_json(const weft_maps_difference *d)
{
    json_t *const o = json_object();
    for (int k = 0; k < WEFT_N_FLAWS; k++) {
        const weft_flaw_match *const m = &d->flaws[k];
        json_object_set_new(o, flaw_names[k],
                            json_pack("{s:I, s:I, s:o, s:o}", "a_px", (json_int_t)m->a, "b_px",
                                      (json_int_t)m->b, "precision", share_json(m->hits, m->a), "recall",
                                      share_json(m->found, m->b)));
    }
    return o;
}

static void print_flaws(FILE *out, const weft_maps_difference *d)
{
    for (int k = 0; k < WEFT_N_FLAWS; k++) {
        const weft_flaw_match *const m = &d->flaws[k];
        if (m->a || m->b)
            fprintf(out,
                    "%-16s %zu px in A, %.1f %% of them near B's; %zu px in B, %.1f %% of them near A's\n",
                    flaw_names[k], m->a, 100 * share(m->hits, m->a), m->b, 100 * share(m->found, m->b));
    }
}

static weft_err print_maps(const weft_invocation *inv, const weft_maps_difference *d, weft_error *err)
{
    if (inv->json) {
        json_t *const o =
            json_pack("{s:s, s:[i,i], s:I, s:I}", "kind", "maps", "offset_px", d->offset_px[0],
                      d->offset_px[1], "only_a", (json_int_t)d->only_a, "only_b", (json_int_t)d->only_b);
        if (d->has_normal) {
            json_object_set_new(o, "normal_deg", spread_json(&d->normal_deg));
            json_object_set_new(o, "mean_normal_turn_deg",
                                json_pack("[f,f]", d->mean_normal_deg[0], d->mean_normal_deg[1]));
        }
        if (d->has_albedo) {
            json_object_set_new(o, "albedo_delta_e", spread_json(&d->delta_e));
            json_object_set_new(o, "albedo_luminance", spread_json(&d->luminance));
            json_object_set_new(o, "albedo_is_camera_rgb", json_boolean(d->albedo_is_camera_rgb));
        }
        if (d->has_alpha) {
            json_object_set_new(o, "alpha", spread_json(&d->alpha));
            json_object_set_new(o, "cover", json_pack("[f,f]", d->cover[0], d->cover[1]));
        }
        if (d->has_flaws)
            json_object_set_new(o, "flaws", flaws_json(d));
        return weft_print_json(inv, o, err);
    }
    if (d->has_normal) {
        print_spread(inv->out, "normal", "deg", &d->normal_deg);
        fprintf(inv->out, "%-16s %.4f about y, %.4f about x deg\n", "mean normal", d->mean_normal_deg[0],
                d->mean_normal_deg[1]);
    }
    if (d->has_albedo) {
        print_spread(inv->out, "albedo dE2000", "", &d->delta_e);
        print_spread(inv->out, "albedo luminance", "relative", &d->luminance);
    }
    if (d->has_alpha) {
        print_spread(inv->out, "alpha", "where open", &d->alpha);
        fprintf(inv->out, "%-16s %.4f of A, %.4f of B\n", "covered", d->cover[0], d->cover[1]);
    }
    if (d->has_flaws)
        print_flaws(inv->out, d);
    if (d->only_a || d->only_b)
        fprintf(inv->out, "%-16s %zu px in A, %zu px in B\n", "in one alone", d->only_a, d->only_b);
    return WEFT_OK;
}

static weft_err compare_maps(const weft_invocation *inv, const weft_mask *mask, weft_error *err)
{
    weft_maps a = {0}, b = {0};
    weft_maps_difference d;
    WEFT_TRY(weft_maps_load(inv->operands[0], &a, err));
    weft_err status = weft_maps_load(inv->operands[1], &b, err);
    if (status == WEFT_OK)
        status = weft_compare_maps(&a, &b, mask, &d, err);
    weft_maps_fini(&a);
    weft_maps_fini(&b);
    WEFT_TRY(status);
    if (d.has_albedo && d.albedo_is_camera_rgb)
        weft_note("an albedo is not colour calibrated: its delta E says little");
    return print_maps(inv, &d, err);
}

/* ---- pictures ---- */

static weft_err print_pictures(const weft_invocation *inv, const weft_picture_difference *d, weft_error *err)
{
    if (inv->json)
        return weft_print_json(inv,
                               json_pack("{s:s, s:o, s:o, s:f, s:f}", "kind", "pictures", "psnr_db",
                                         isfinite(d->psnr_db) ? json_real(d->psnr_db) : json_null(),
                                         "delta_e", spread_json(&d->delta_e), "rms", d->rms, "max", d->max),
                               err);
    fprintf(inv->out, "%-16s %.2f dB\n", "PSNR", d->psnr_db);
    print_spread(inv->out, "dE2000", "", &d->delta_e);
    fprintf(inv->out, "%-16s rms %.6g  max %.6g\n", "linear", d->rms, d->max);
    return WEFT_OK;
}

static weft_err compare_pictures(const weft_invocation *inv, const weft_mask *mask, weft_error *err)
{
    weft_image a = {0}, b = {0};
    weft_picture_difference d;
    WEFT_TRY(weft_image_read(inv->operands[0], WEFT_TRANSFER_SRGB, &a, err));
    weft_err status = weft_image_read(inv->operands[1], WEFT_TRANSFER_SRGB, &b, err);
    if (status == WEFT_OK)
        status = weft_compare_pictures(&a, &b, mask, &d, err);
    weft_image_fini(&a);
    weft_image_fini(&b);
    WEFT_TRY(status);
    return print_pictures(inv, &d, err);
}

/* ---- calibrations ---- */

static json_t *calibration_json(const weft_calibration_difference *d)
{
    json_t *const o = json_pack("{s:s}", "kind", "calibrations");
    if (d->has_lights) {
        json_object_set_new(
            o, "lights",
            json_pack("{s:i, s:f, s:f, s:i, s:f, s:f, s:f, s:f, s:f, s:f, s:f}", "n", d->n_lights,
                      "position_error_mm_mean", d->position_mm[0], "position_error_mm_max", d->position_mm[1],
                      "worst_light", (int)d->position_mm[2], "direction_error_deg_mean", d->direction_deg[0],
                      "direction_error_deg_max", d->direction_deg[1], "intensity_ratio_mean",
                      d->intensity_ratio_mean, "intensity_ratio_spread", d->intensity_ratio_spread,
                      "irradiance_ratio_mean", d->irradiance_ratio_mean, "irradiance_ratio_spread",
                      d->irradiance_ratio_spread, "exponent_error_max", d->exponent_max));
    }
    if (d->has_camera)
        json_object_set_new(o, "camera",
                            json_pack("{s:f, s:f, s:f, s:f, s:f, s:f}", "fx_ratio", d->focal_ratio,
                                      "principal_point_px", d->principal_px, "centre_mm", d->centre_mm,
                                      "view_deg", d->view_deg, "projection_px_mean", d->projection_px[0],
                                      "projection_px_max", d->projection_px[1]));
    if (d->has_colour)
        json_object_set_new(o, "colour_matrix_max", json_real(d->matrix_max));
    return o;
}

static weft_err print_calibrations(const weft_invocation *inv, const weft_calibration_difference *d,
                                   weft_error *err)
{
    if (inv->json)
        return weft_print_json(inv, calibration_json(d), err);
    if (d->has_lights) {
        fprintf(inv->out, "%-16s mean %.3f  max %.3f mm (light %d)\n", "light position", d->position_mm[0],
                d->position_mm[1], (int)d->position_mm[2]);
        fprintf(inv->out, "%-16s mean %.3f  max %.3f deg from the origin\n", "light direction",
                d->direction_deg[0], d->direction_deg[1]);
        fprintf(inv->out, "%-16s A / B %.4f, spread %.2f %%; at the origin %.4f, spread %.2f %%\n",
                "intensity", d->intensity_ratio_mean, 100 * d->intensity_ratio_spread,
                d->irradiance_ratio_mean, 100 * d->irradiance_ratio_spread);
        fprintf(inv->out, "%-16s max %.3f\n", "exponent", d->exponent_max);
    }
    if (d->has_camera)
        fprintf(inv->out, "%-16s fx A / B %.6f, principal point %.2f px\n", "camera", d->focal_ratio,
                d->principal_px);
    if (d->has_pose)
        fprintf(inv->out, "%-16s centre %.3f mm, view %.4f deg, on the plane mean %.3f max %.3f px\n", "pose",
                d->centre_mm, d->view_deg, d->projection_px[0], d->projection_px[1]);
    if (d->has_colour)
        fprintf(inv->out, "%-16s max %.4f\n", "colour matrix", d->matrix_max);
    return WEFT_OK;
}

static weft_err compare_calibrations(const weft_invocation *inv, weft_error *err)
{
    weft_calibration a, b;
    weft_calibration_difference d;
    weft_calibration_init(&b);
    WEFT_TRY(weft_calibration_load(inv->operands[0], &a, err));
    weft_err status = weft_calibration_load(inv->operands[1], &b, err);
    if (status == WEFT_OK)
        status = weft_compare_calibrations(&a, &b, &d, err);
    weft_calibration_fini(&a);
    weft_calibration_fini(&b);
    WEFT_TRY(status);
    return print_calibrations(inv, &d, err);
}

static weft_err run(const weft_invocation *inv, const void *args_, weft_error *err)
{
    const compare_args *const args = args_;
    kind a, b;
    weft_mask mask = {0};
    WEFT_TRY(kind_of(inv->operands[0], &a, err));
    WEFT_TRY(kind_of(inv->operands[1], &b, err));
    if (a != b)
        return weft_fail(err, WEFT_ERR_USAGE, "%s and %s are different kinds of things", inv->operands[0],
                         inv->operands[1]);
    if (args->mask)
        WEFT_TRY(weft_png_read_mask(args->mask, &mask, err));
    const weft_mask *const given = args->mask ? &mask : NULL;
    const weft_err status = a == KIND_MAPS          ? compare_maps(inv, given, err)
                            : a == KIND_CALIBRATION ? compare_calibrations(inv, err)
                                                    : compare_pictures(inv, given, err);
    weft_mask_fini(&mask);
    return status;
}

const weft_command weft_cmd_compare = {
    .name = "compare",
    .summary = "how two map folders, pictures or calibrations differ",
    .operands = "A B",
    .min_operands = 2,
    .max_operands = 2,
    .args_size = sizeof(compare_args),
    .fields = fields,
    .details =
        "Maps: the angle between the normals, CIEDE2000 and relative luminance of the albedo.  Alpha and\n"
        "flaws where both have them: of A's flags the share that lies near one of B's, and the other\n"
        "way round (0.5 mm, creases 2 mm).  Plane maps of one scale are laid over each other by their "
        "origins.  Pictures (PNG, TIFF as\n"
        "sRGB, EXR as linear): PSNR of the sRGB codes and CIEDE2000.  Calibrations: lights,\n"
        "camera, pose and colour.",
    .example = "weft compare twill.maps truth/plane.maps",
    .run = run,
};
