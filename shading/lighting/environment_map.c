#include "shading/lighting/environment_map.h"

#include "core/parallel.h"
#include "shading/brdf/sampling.h"

#include <string.h>

enum { SHARPEST = 1024, FILTERED = 128, N_POINTS = 256, MAX_MIPS = 12 };

/* The panorama and its halves. */
typedef struct pyramid {
    int n;
    weft_image mips[MAX_MIPS];
} pyramid;

static void direction_of(const weft_image *image, int column, int row, double d[3])
{
    const double azimuth = WEFT_PI * (2 * (column + 0.5) / image->width - 1); /* from +y towards +x */
    const double zenith = WEFT_PI * (row + 0.5) / image->height;
    d[0] = sin(zenith) * sin(azimuth);
    d[1] = sin(zenith) * cos(azimuth);
    d[2] = cos(zenith);
}

static double solid_angle(const weft_image *image, int row)
{
    const double top = cos(WEFT_PI * row / image->height), bottom = cos(WEFT_PI * (row + 1) / image->height);
    return 2 * WEFT_PI / image->width * (top - bottom);
}

/* atan2 to 1e-5 rad, a fraction of a hundredth of a texel: a fit of odd degree eleven on 0..1.
 * Source: Abramowitz and Stegun 1964, 4.4.49 (truncated). */
static double quick_atan2(double y, double x)
{
    const double ax = fabs(x), ay = fabs(y), large = ax > ay ? ax : ay, small = ax > ay ? ay : ax;
    const double t = large > 0 ? small / large : 0, t2 = t * t;
    double a =
        t *
        (0.99997726 +
         t2 * (-0.33262347 + t2 * (0.19354346 + t2 * (-0.11643287 + t2 * (0.05265332 - t2 * 0.01172120)))));
    a = ay > ax ? WEFT_PI / 2 - a : a;
    a = x < 0 ? WEFT_PI - a : a;
    return y < 0 ? -a : a;
}

/* A direction's place on any panorama: shares of width and height. */
typedef struct spot {
    double across, down;
} spot;

static spot spot_of(const double d[3])
{
    return (spot){quick_atan2(d[0], d[1]) / (2 * WEFT_PI) + 0.5,
                  quick_atan2(sqrt(d[0] * d[0] + d[1] * d[1]), d[2]) / WEFT_PI};
}

/* Bilinear; wraps across, stops at the poles. */
static void look_at(const weft_image *image, spot at, double weight, double sum[3])
{
    const double u = at.across * image->width + image->width - 0.5, v = at.down * image->height - 0.5;
    const int fu = (int)u, fv = v > 0 ? (int)v : 0, last = image->height - 1;
    const double tu = u - fu, tv = v > 0 ? v - fv : 0;
    const int x0 = fu % image->width, x1 = x0 + 1 < image->width ? x0 + 1 : 0;
    const int y0 = fv < last ? fv : last, y1 = y0 < last ? y0 + 1 : last;
    for (int c = 0; c < 3; c++) {
        const float *const a = weft_image_row(image, c, y0), *const b = weft_image_row(image, c, y1);
        sum[c] += weight * ((1 - tv) * ((1 - tu) * (double)a[x0] + tu * (double)a[x1]) +
                            tv * ((1 - tu) * (double)b[x0] + tu * (double)b[x1]));
    }
}

/* Scales by area on the sphere to 3 clean planes. */
static weft_err shrink(const weft_image *from, int width, int height, weft_image *to, weft_error *err)
{
    WEFT_TRY(weft_image_init(to, width, height, 3, err));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const int y0 = y * from->height / height, y1 = (y + 1) * from->height / height;
            const int x0 = x * from->width / width, x1 = (x + 1) * from->width / width;
            double sum[3] = {0}, area = 0;
            for (int j = y0; j < y1 || j == y0; j++)
                for (int i = x0; i < x1 || i == x0; i++) {
                    const double w = solid_angle(from, j);
                    area += w;
                    for (int c = 0; c < 3; c++) {
                        const double v = (double)weft_image_row(from, from->planes == 3 ? c : 0, j)[i];
                        sum[c] += v > 0 && isfinite(v) ? w * v : 0;
                    }
                }
            for (int c = 0; c < 3; c++)
                weft_image_row(to, c, y)[x] = (float)(sum[c] / area);
        }
    return WEFT_OK;
}

static void pyramid_fini(pyramid *p)
{
    for (int i = 0; i < p->n; i++)
        weft_image_fini(&p->mips[i]);
    *p = (pyramid){0};
}

static weft_err pyramid_init(pyramid *p, const weft_image *panorama, weft_error *err)
{
    int width = panorama->width < SHARPEST ? panorama->width : SHARPEST;
    int height = panorama->height < SHARPEST / 2 ? panorama->height : SHARPEST / 2;
    weft_err status = shrink(panorama, width, height, &p->mips[0], err);
    for (p->n = status == WEFT_OK; status == WEFT_OK && width >= 8 && height >= 4 && p->n < MAX_MIPS;) {
        width /= 2;
        height /= 2;
        status = shrink(&p->mips[p->n - 1], width, height, &p->mips[p->n], err);
        p->n += status == WEFT_OK;
    }
    return status;
}

static void project(const weft_image *image, double light[3][WEFT_SH_COUNT])
{
    memset(light, 0, 3 * sizeof light[0]);
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            double d[3], basis[WEFT_SH_COUNT];
            direction_of(image, x, y, d);
            weft_sh_basis(d[0], d[1], d[2], basis);
            for (int c = 0; c < 3; c++)
                for (int k = 0; k < WEFT_SH_COUNT; k++)
                    light[c][k] += solid_angle(image, y) * (double)weft_image_row(image, c, y)[x] * basis[k];
        }
}

/* The points of a level's kernel about +z: mirrored direction, weight, mip of the panorama. */
typedef struct kernel {
    int n;
    double l[N_POINTS][3], weight[N_POINTS], lod[N_POINTS];
} kernel;

static void kernel_init(kernel *k, double alpha, const weft_image *sharpest)
{
    double total = 0;
    k->n = 0;
    for (uint32_t i = 0; i < N_POINTS; i++) {
        double u[2];
        weft_hammersley(i, N_POINTS, u);
        const double nh = weft_sample_ggx_cosine(alpha, u[1]), nl = 2 * nh * nh - 1;
        const double sine = 2 * nh * sqrt(weft_max(1 - nh * nh, 0)), phi = 2 * WEFT_PI * u[0];
        if (nl <= 0)
            continue;
        double *const l = k->l[k->n];
        l[0] = sine * cos(phi);
        l[1] = sine * sin(phi);
        l[2] = nl;
        const double share = 4 / (N_POINTS * weft_ggx_d(nh, 1 - nh * nh, alpha)); /* of the sphere, sr */
        const double texel = 4 * WEFT_PI / ((double)sharpest->width * sharpest->height);
        k->lod[k->n] = weft_max(0.5 * log2(share / texel), 0);
        k->weight[k->n++] = nl;
        total += nl;
    }
    for (int i = 0; i < k->n; i++)
        k->weight[i] /= total;
}

typedef struct filter_job {
    const pyramid *from;
    const kernel *kernel;
    weft_image *to;
} filter_job;

static void filter_texel(const filter_job *job, const double n[3], double sum[3])
{
    const double side = fabs(n[2]) < 0.999 ? 0 : 1; /* up is z, or x near the poles */
    double t[3] = {(1 - side) * -n[1], (1 - side) * n[0] - side * n[2], side * n[1]};
    const double inverse = 1 / sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (int c = 0; c < 3; c++)
        t[c] *= inverse;
    const double b[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
    for (int i = 0; i < job->kernel->n; i++) {
        const double *const l = job->kernel->l[i];
        const double lod = fmin(job->kernel->lod[i], job->from->n - 1), low = floor(lod), part = lod - low;
        double d[3];
        for (int c = 0; c < 3; c++)
            d[c] = l[0] * t[c] + l[1] * b[c] + l[2] * n[c];
        const spot at = spot_of(d);
        look_at(&job->from->mips[(int)low], at, job->kernel->weight[i] * (1 - part), sum);
        if (part > 0)
            look_at(&job->from->mips[(int)low + 1], at, job->kernel->weight[i] * part, sum);
    }
}

static void filter_rows(void *context, int band, int row_begin, int row_end)
{
    const filter_job *const job = context;
    (void)band;
    for (int y = row_begin; y < row_end; y++)
        for (int x = 0; x < job->to->width; x++) {
            double n[3], sum[3] = {0};
            direction_of(job->to, x, y, n);
            filter_texel(job, n, sum);
            for (int c = 0; c < 3; c++)
                weft_image_row(job->to, c, y)[x] = (float)sum[c];
        }
}

static weft_err make_levels(weft_environment_map *map, const pyramid *from, weft_error *err)
{
    kernel k;
    WEFT_TRY(weft_image_copy(&map->levels[0], &from->mips[0], err));
    for (int level = 1; level < WEFT_ENVIRONMENT_LEVELS; level++) {
        const double roughness = level / (WEFT_ENVIRONMENT_LEVELS - 1.0);
        const int width = level == 1 ? 2 * FILTERED : FILTERED;
        WEFT_TRY(weft_image_init(&map->levels[level], width, width / 2, 3, err));
        kernel_init(&k, roughness * roughness, &from->mips[0]);
        weft_parallel_rows(width / 2, filter_rows, &(filter_job){from, &k, &map->levels[level]});
    }
    return WEFT_OK;
}

/* The filter before the camera, on the upper half of every mip. */
static void filter_sky(pyramid *p, const double factor[3])
{
    for (int level = 0; level < p->n; level++)
        for (int c = 0; c < 3; c++)
            for (int y = 0; 2 * y + 1 <= p->mips[level].height; y++) {
                /* a row across the horizon is half sky */
                const double sky = 2 * y + 2 <= p->mips[level].height ? 1 : 0.5;
                float *const row = weft_image_row(&p->mips[level], c, y);
                for (int x = 0; x < p->mips[level].width; x++)
                    row[x] *= (float)(1 + sky * (factor[c] - 1));
            }
}

static void desaturate(double light[3][WEFT_SH_COUNT], double saturation)
{
    static const double luma[3] = {0.2126, 0.7152, 0.0722};
    for (int k = 0; k < WEFT_SH_COUNT; k++) {
        const double y = luma[0] * light[0][k] + luma[1] * light[1][k] + luma[2] * light[2][k];
        for (int c = 0; c < 3; c++)
            light[c][k] = y + saturation * (light[c][k] - y);
    }
}

weft_err weft_environment_map_init(weft_environment_map *map, const weft_image *panorama, weft_error *err)
{
    return weft_environment_map_init_filtered(map, panorama, &(weft_sky_filter){{1, 1, 1}, 1}, err);
}

weft_err weft_environment_map_init_filtered(weft_environment_map *map, const weft_image *panorama,
                                            const weft_sky_filter *filter, weft_error *err)
{
    weft_environment_map made = {0};
    pyramid from = {0};
    if (panorama->width < 8 || panorama->height < 4)
        return weft_fail(err, WEFT_ERR_RANGE, "a panorama of %d x %d pixels is too small (8 x 4 at least)",
                         panorama->width, panorama->height);
    weft_err status = pyramid_init(&from, panorama, err);
    if (status == WEFT_OK) {
        project(&from.mips[0], made.light);
        if (filter->ambient_saturation != 1)
            desaturate(made.light, filter->ambient_saturation);
        filter_sky(&from, filter->factor);
        status = make_levels(&made, &from, err);
    }
    pyramid_fini(&from);
    if (status != WEFT_OK)
        weft_environment_map_fini(&made);
    else
        *map = made;
    return status;
}

void weft_environment_map_fini(weft_environment_map *map)
{
    for (int level = 0; level < WEFT_ENVIRONMENT_LEVELS; level++)
        weft_image_fini(&map->levels[level]);
    *map = (weft_environment_map){0};
}

weft_err weft_environment_paint_sky(weft_image *panorama, const weft_sky *sky, double sun_zenith_rad,
                                    double sun_azimuth_rad, weft_error *err)
{
    double card = 0;
    WEFT_TRY(weft_image_init(panorama, 512, 256, 3, err));
    for (int y = 0; y < panorama->height / 2; y++)
        for (int x = 0; x < panorama->width; x++) {
            double d[3];
            direction_of(panorama, x, y, d);
            const double value = weft_sky_relative_to_zenith(
                sky, acos(d[2]), atan2(d[1], d[0]) - sun_azimuth_rad, sun_zenith_rad);
            weft_image_row(panorama, 0, y)[x] = (float)value;
            card += value * d[2] * solid_angle(panorama, y) / WEFT_PI;
        }
    for (size_t i = 0; i < weft_image_plane_size(panorama); i++)
        for (int c = 2; c >= 0; c--)
            weft_image_plane(panorama, c)[i] = (float)((double)weft_image_plane(panorama, 0)[i] / card);
    return WEFT_OK;
}

void weft_environment_map_irradiance(const weft_environment_map *map, const double n[3], double e[3])
{
    /* sqrt(4 pi/(2 l + 1)) A_l of the clamped cosine: pi, 2 pi/3, pi/4 */
    double basis[WEFT_SH_COUNT];
    weft_sh_basis(n[0], n[1], n[2], basis);
    for (int k = 0; k < WEFT_SH_COUNT; k++)
        basis[k] *= k == 0 ? WEFT_PI : k < 4 ? 2 * WEFT_PI / 3 : WEFT_PI / 4;
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int k = 0; k < WEFT_SH_COUNT; k++)
            sum += map->light[c][k] * basis[k];
        e[c] = weft_max(sum, 0);
    }
}

void weft_environment_map_look(const weft_environment_map *map, const double direction[3], double roughness,
                               double radiance[3])
{
    const double last = WEFT_ENVIRONMENT_LEVELS - 1,
                 within = roughness > 0 ? (roughness < 1 ? roughness : 1) : 0;
    const double level_at = within * last;
    const int level = level_at < last ? (int)level_at : WEFT_ENVIRONMENT_LEVELS - 2;
    const spot at = spot_of(direction);
    radiance[0] = radiance[1] = radiance[2] = 0;
    look_at(&map->levels[level], at, 1 - (level_at - level), radiance);
    look_at(&map->levels[level + 1], at, level_at - level, radiance);
}
