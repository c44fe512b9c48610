#include "host/solve/strip.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"
#include "core/json.h"
#include "core/mem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PARTS         8    /* along the strip */
#define PIXELS_WANTED 512  /* of each colour, 64 in a part */
#define UNEVEN_MOST   0.03 /* of a part against the whole; a lamp that is another one differs by more */
#define CLIPPED_MOST  0.01

weft_err weft_strip_of_set(const weft_set *set, weft_strip *strip, bool *present, weft_error *err)
{
    char place[1024];
    const json_t *object = set->other ? json_object_get(set->other, "strip") : NULL;
    *present = object != NULL;
    if (!object)
        return WEFT_OK;
    snprintf(place, sizeof place, "%s/set.json: strip", set->folder);
    strip->reflectance = 0.99;
    WEFT_TRY(weft_json_get_numbers(object, "rect_px", WEFT_JSON_REQUIRED, 4, strip->rect_px, place, err));
    WEFT_TRY(weft_json_get_number(object, "reflectance", WEFT_JSON_OPTIONAL, 0.05, 1, &strip->reflectance,
                                  place, err));
    const double *const r = strip->rect_px;
    if (!(r[0] >= 0 && r[1] >= 0 && r[0] < r[2] && r[1] < r[3] && r[2] <= set->width - 1 &&
          r[3] <= set->height - 1))
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "%s: \"rect_px\" must be left, top, right, bottom inside the frame of %d x %d pixels", place,
            set->width, set->height);
    return WEFT_OK;
}

/* The strip in the plates' pixels, and room for the ratios of a part. */
typedef struct strip_work {
    const weft_light_plates *plates;
    const weft_calibration *cal;
    const weft_strip *strip;
    weft_pixel_scale pixel;
    int left, top, right, bottom; /* inclusive */
    bool along_u;                 /* the parts lie side by side */
    double *ratios;               /* [pixels] */
    long n_seen, n_clipped;       /* of the last part */
} strip_work;

/* What light `as` should show at a pixel of the plates, by the calibration. */
static double expected(const strip_work *w, int as, int channel, int i, int j)
{
    const double u = w->pixel.scale * i + w->pixel.offset, v = w->pixel.scale * j + w->pixel.offset;
    const weft_light *const light = &w->cal->lights[as];
    weft_vec3 point = {0, 0, 0}, to_light;
    if (!light->distant && !weft_camera_to_plane(&w->cal->camera, u, v, 0, &point))
        return NAN;
    const double at = weft_light_at(light, point, &to_light);
    return w->strip->reflectance * light->intensity[channel] * at * fmax(to_light.z, 0) *
           weft_light_grid_gain(w->cal, as, channel, u, v);
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Median of measured/expected over part `part` (-1: all), as if the light were `as`; its scatter too. */
static double part_ratio(strip_work *w, int light, int as, int channel, int part, double *scatter,
                         long *count)
{
    const weft_plate *const plate = &w->plates->plate[light];
    const int length = w->along_u ? w->right - w->left + 1 : w->bottom - w->top + 1;
    const int from = part < 0 ? 0 : part * length / PARTS,
              to = part < 0 ? length : (part + 1) * length / PARTS;
    const int u0 = w->along_u ? w->left + from : w->left, u1 = w->along_u ? w->left + to - 1 : w->right;
    const int v0 = w->along_u ? w->top : w->top + from, v1 = w->along_u ? w->bottom : w->top + to - 1;
    long n = 0;
    w->n_seen = w->n_clipped = 0;
    for (int j = v0; j <= v1; j++)
        for (int i = u0; i <= u1; i++) {
            if (plate->cfa != WEFT_CFA_NONE && weft_cfa_colour(plate->cfa, i, j) != channel)
                continue;
            w->n_seen++;
            if (plate->clipped.data &&
                plate->clipped.data[(size_t)j * (size_t)plate->clipped.width + (size_t)i]) {
                w->n_clipped++;
                continue;
            }
            const int plane = plate->image.planes == 3 ? channel : 0;
            const double ratio =
                (double)weft_image_row(&plate->image, plane, j)[i] / expected(w, as, channel, i, j);
            if (isfinite(ratio))
                w->ratios[n++] = ratio;
        }
    *count = n;
    if (n == 0)
        return NAN;
    qsort(w->ratios, (size_t)n, sizeof *w->ratios, compare_doubles);
    const double median = w->ratios[n / 2];
    *scatter = 0.5 * (w->ratios[n * 84 / 100] - w->ratios[n * 16 / 100]);
    return median;
}

/* The largest deviation of a part from the whole, relative, in green. */
static double unevenness(strip_work *w, int light, int as)
{
    double scatter = 0, worst = 0;
    long n = 0;
    const double all = part_ratio(w, light, as, 1, -1, &scatter, &n);
    for (int part = 0; part < PARTS; part++) {
        const double ratio = part_ratio(w, light, as, 1, part, &scatter, &n);
        const double noise = n ? 4 * scatter / sqrt((double)n) / fabs(ratio) : 0;
        worst = fmax(worst, fabs(ratio / all - 1) - noise);
    }
    return worst;
}

/* A light that does not look like itself: does it look like another one? */
static weft_err explain_uneven(strip_work *w, int light, double uneven, weft_error *err)
{
    for (int other = 0; other < w->cal->n_lights; other++)
        if (other != light && unevenness(w, light, other) < fmin(UNEVEN_MOST, 0.5 * uneven))
            return weft_fail(
                err, WEFT_ERR_MISMATCH,
                "light %d: on the white strip it looks like light %d of the calibration; were two lights "
                "swapped?",
                light, other);
    return weft_fail(
        err, WEFT_ERR_MISMATCH,
        "light %d: the white strip is uneven by %.1f %% against the calibration; is it clean, flat, in "
        "full light, and where \"rect_px\" of set.json says?",
        light, 100 * uneven);
}

static weft_err measure_light(strip_work *w, int light, weft_strip_drift *drift, weft_error *err)
{
    const double uneven = unevenness(w, light, light);
    for (int c = 0; c < 3; c++) {
        double scatter = 0;
        long n = 0;
        const double gain = part_ratio(w, light, light, c, -1, &scatter, &n);
        if (w->n_clipped > CLIPPED_MOST * (double)w->n_seen)
            return weft_fail(err, WEFT_ERR_RANGE,
                             "light %d: %.0f %% of the white strip is saturated; expose shorter", light,
                             100.0 * (double)w->n_clipped / (double)w->n_seen);
        if (n < PIXELS_WANTED)
            return weft_fail(
                err, WEFT_ERR_RANGE,
                "light %d: the white strip has %ld usable pixels of a colour, wanted %d; make it wider",
                light, n, PIXELS_WANTED);
        drift->gain[light][c] = gain;
        drift->sigma = fmax(drift->sigma, 1.25 * scatter / sqrt((double)n)); /* of a median */
    }
    if (!(uneven <= UNEVEN_MOST))
        return explain_uneven(w, light, uneven, err);
    if (!(fabs(drift->gain[light][1] - 1) <= WEFT_STRIP_DRIFT_MOST))
        return weft_fail(
            err, WEFT_ERR_MISMATCH,
            "light %d: gives %.2f times the light it was calibrated with; that is no drift: check the lamp "
            "and calibrate again",
            light, drift->gain[light][1]);
    return WEFT_OK;
}

weft_err weft_strip_measure(const weft_light_plates *plates, weft_pixel_scale pixel,
                            const weft_calibration *cal, const weft_strip *strip, weft_strip_drift *drift,
                            weft_error *err)
{
    const double *const r = strip->rect_px;
    strip_work w = {.plates = plates, .cal = cal, .strip = strip, .pixel = pixel};
    w.left = (int)ceil((r[0] - pixel.offset) / pixel.scale);
    w.top = (int)ceil((r[1] - pixel.offset) / pixel.scale);
    w.right = (int)fmin(floor((r[2] - pixel.offset) / pixel.scale), plates->width - 1);
    w.bottom = (int)fmin(floor((r[3] - pixel.offset) / pixel.scale), plates->height - 1);
    w.along_u = w.right - w.left >= w.bottom - w.top;
    if (w.right < w.left || w.bottom < w.top)
        return weft_fail(err, WEFT_ERR_RANGE, "the white strip is smaller than a pixel");
    w.ratios =
        weft_alloc((size_t)(w.right - w.left + 1) * (size_t)(w.bottom - w.top + 1), sizeof *w.ratios, err);
    if (!w.ratios)
        return WEFT_ERR_NOMEM;
    *drift = (weft_strip_drift){.sigma = 0};
    weft_err status = WEFT_OK;
    for (int light = 0; light < plates->n && status == WEFT_OK; light++)
        status = measure_light(&w, light, drift, err);
    weft_free(w.ratios);
    return status;
}

weft_err weft_strip_follow(const weft_set *set, const weft_light_plates *plates, weft_pixel_scale pixel,
                           weft_calibration *cal, weft_strip_drift *drift, bool *present, weft_error *err)
{
    weft_strip strip;
    WEFT_TRY(weft_strip_of_set(set, &strip, present, err));
    if (!*present)
        return WEFT_OK;
    WEFT_TRY(weft_strip_measure(plates, pixel, cal, &strip, drift, err));
    for (int j = 0; j < plates->n; j++)
        for (int c = 0; c < 3; c++)
            cal->lights[j].intensity[c] *= drift->gain[j][c];
    return WEFT_OK;
}
