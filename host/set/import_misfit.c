#include "core/colour.h"
#include "core/file.h"
#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"
#include "host/set/import_list.h"

#include <math.h>
#include <string.h>

enum { SAMPLES = 20000 };

/* Grey values of a spread of pixels under every light, read in both ways. */
typedef struct samples {
    int n_lights, n;
    double *value[2]; /* linear, sRGB: [n_lights][n] */
    bool *skip;       /* [n]: outside the mask, or saturated under some light */
} samples;

static void samples_fini(samples *s)
{
    weft_free(s->value[0]);
    weft_free(s->value[1]);
    weft_free(s->skip);
}

static size_t stride_of(const weft_raster *raster)
{
    const size_t pixels = (size_t)raster->width * (size_t)raster->height;
    return pixels / SAMPLES > 0 ? pixels / SAMPLES | 1 : 1; /* odd: not in step with the columns */
}

static weft_err samples_init(samples *s, int n_lights, const weft_raster *first, weft_error *err)
{
    const size_t pixels = (size_t)first->width * (size_t)first->height;
    *s = (samples){.n_lights = n_lights, .n = (int)(pixels / stride_of(first))};
    for (int i = 0; i < 2; i++)
        s->value[i] = weft_alloc((size_t)n_lights * (size_t)s->n, sizeof *s->value[i], err);
    s->skip = weft_alloc((size_t)s->n, sizeof *s->skip, err);
    return s->value[0] && s->value[1] && s->skip ? WEFT_OK : WEFT_ERR_NOMEM;
}

static void take(samples *s, int light, const weft_raster *raster, const double intensity[3])
{
    const size_t stride = stride_of(raster);
    const double full = raster->bits == 8 ? 255 : 65535;
    for (int i = 0; i < s->n; i++) {
        const uint16_t *const p = raster->data + (size_t)i * stride * (size_t)raster->channels;
        double linear = 0, decoded = 0;
        for (int c = 0; c < 3; c++) {
            const uint16_t code = p[raster->channels >= 3 ? c : 0];
            const double weight = (c == 0 ? 0.2126 : c == 1 ? 0.7152 : 0.0722) / intensity[c];
            s->skip[i] |= code >= full;
            linear += weight * code / full;
            decoded += weight * weft_srgb_decode(code / full);
        }
        s->value[0][(size_t)light * (size_t)s->n + (size_t)i] = linear;
        s->value[1][(size_t)light * (size_t)s->n + (size_t)i] = decoded;
    }
}

static weft_err skip_outside(samples *s, const char *path, const weft_raster *like, weft_error *err)
{
    weft_mask mask;
    WEFT_TRY(weft_png_read_mask(path, &mask, err));
    weft_err status = WEFT_OK;
    if (mask.width != like->width || mask.height != like->height)
        status = weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d x %d pixels, the pictures have %d x %d", path,
                           mask.width, mask.height, like->width, like->height);
    else
        for (int i = 0; i < s->n; i++)
            s->skip[i] |= mask.data[(size_t)i * stride_of(like)] == 0;
    weft_mask_fini(&mask);
    return status;
}

static weft_err read_raster(const char *path, weft_raster *raster, weft_error *err)
{
    return weft_path_has_suffix(path, ".png") ? weft_png_read(path, raster, err)
                                              : weft_tiff_read(path, raster, err);
}

static weft_err take_all(const weft_import_list *list, samples *s, weft_error *err)
{
    weft_err status = WEFT_OK;
    int width = 0, height = 0;
    for (int j = 0; j < list->n && status == WEFT_OK; j++) {
        weft_raster raster;
        WEFT_TRY(read_raster(list->items[j].path, &raster, err));
        if (j == 0) {
            width = raster.width;
            height = raster.height;
            status = samples_init(s, list->n, &raster, err);
            if (status == WEFT_OK && list->mask)
                status = skip_outside(s, list->mask, &raster, err);
        } else if (raster.width != width || raster.height != height)
            status = weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d x %d pixels, %s has %d x %d",
                               list->items[j].path, raster.width, raster.height, list->items[0].path, width,
                               height);
        if (status == WEFT_OK)
            take(s, j, &raster, list->items[j].intensity);
        weft_raster_fini(&raster);
    }
    return status;
}

/* Sum of squared residuals of one pixel's best Lambertian surface. */
static double misfit_of(const weft_import_list *list, const weft_mat3 *inverse, const double *value,
                        size_t step)
{
    weft_vec3 b = {0, 0, 0};
    double squares = 0;
    for (int j = 0; j < list->n; j++)
        b = weft_add(b, weft_scale(list->items[j].direction, value[(size_t)j * step]));
    const weft_vec3 scaled = weft_mat3_apply(inverse, b);
    for (int j = 0; j < list->n; j++) {
        const double d = value[(size_t)j * step] - weft_dot(scaled, list->items[j].direction);
        squares += d * d;
    }
    return squares;
}

static double misfit(const weft_import_list *list, const samples *s, const weft_mat3 *inverse, int which)
{
    double squares = 0, light = 0;
    for (int i = 0; i < s->n; i++) {
        if (s->skip[i])
            continue;
        const double *const value = s->value[which] + i;
        squares += misfit_of(list, inverse, value, (size_t)s->n);
        for (int j = 0; j < s->n_lights; j++)
            light += value[(size_t)j * (size_t)s->n] * value[(size_t)j * (size_t)s->n];
    }
    return light > 0 ? sqrt(squares / light) : 0;
}

weft_err weft_import_measure_misfit(const weft_import_list *list, double *linear, double *srgb,
                                    weft_error *err)
{
    weft_mat3 a = {{0}}, inverse;
    for (int j = 0; j < list->n; j++) {
        const weft_vec3 d = list->items[j].direction;
        const double v[3] = {d.x, d.y, d.z};
        for (int i = 0; i < 9; i++)
            a.m[i] += v[i / 3] * v[i % 3];
    }
    *linear = *srgb = 0;
    samples s = {0};
    const weft_err status = take_all(list, &s, err);
    if (status == WEFT_OK && list->n > 3 && weft_mat3_invert(&a, &inverse)) {
        *linear = misfit(list, &s, &inverse, 0);
        *srgb = misfit(list, &s, &inverse, 1);
    }
    samples_fini(&s);
    return status;
}
