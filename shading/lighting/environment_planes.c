#include "shading/lighting/environment_planes.h"

#include "core/clones.h"
#include "core/mem.h"

#include <math.h>

enum { N = WEFT_ENVIRONMENT_PLANES_SIZE, LEVELS = WEFT_ENVIRONMENT_LEVELS };

#define PI_F 3.14159265358979F

static void set_light(weft_environment_planes *planes, const weft_environment_map *map)
{
    static const double pi = 3.14159265358979323846;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < WEFT_SH_COUNT; k++) /* as weft_environment_map_irradiance() */
            planes->light[c][k] = (float)(map->light[c][k] * (k == 0 ? pi : k < 4 ? 2 * pi / 3 : pi / 4));
}

static void set_share(weft_environment_planes *planes, const weft_environment_table *table)
{
    for (int row = 0; row < N; row++)
        for (int column = 0; column < N; column++) {
            const double r = row / (N - 1.0), c = column / (N - 1.0);
            const weft_environment_share share =
                weft_environment_table_at(table, c * c * c * c, r * r * r * r);
            planes->share[row][column][0] = (float)share.scale;
            planes->share[row][column][1] = (float)share.bias;
        }
}

weft_err weft_environment_planes_init(weft_environment_planes *planes, const weft_environment_map *map,
                                      const weft_environment_table *table, weft_error *err)
{
    size_t total = 0;
    for (int level = 0; level < LEVELS; level++) {
        planes->offset[level] = (int)total;
        planes->width[level] = map->levels[level].width;
        planes->height[level] = map->levels[level].height;
        total += 3 * weft_image_plane_size(&map->levels[level]);
    }
    planes->texels = weft_alloc(total, sizeof *planes->texels, err);
    if (!planes->texels)
        return WEFT_ERR_NOMEM;
    for (int level = 0; level < LEVELS; level++) {
        const weft_image *const image = &map->levels[level];
        const size_t n = weft_image_plane_size(image);
        float *const to = planes->texels + planes->offset[level];
        for (size_t i = 0; i < n; i++)
            for (size_t c = 0; c < 3; c++)
                to[3 * i + c] = image->data[c * n + i];
    }
    set_light(planes, map);
    set_share(planes, table);
    return WEFT_OK;
}

void weft_environment_planes_fini(weft_environment_planes *planes)
{
    weft_free(planes->texels);
    planes->texels = NULL;
}

WEFT_CLONES
void weft_environment_planes_irradiance(const weft_environment_planes *planes, int n,
                                        const float *const normal[3], float *const e[3])
{
    const float *const nx = normal[0], *const ny = normal[1], *const nz = normal[2];
    for (int c = 0; c < 3; c++) {
        const float *const l = planes->light[c];
        float *const to = e[c];
        /* the nine terms of spherical_harmonics.h, their constants gathered */
        const float flat = 0.28209479F * l[0] - 0.31539157F * l[6];
        const float k1 = 0.48860251F, k2 = 1.09254843F, k20 = 0.94617470F, k22 = 0.54627422F;
        const float ly = k1 * l[1], lz = k1 * l[2], lx = k1 * l[3], lxy = k2 * l[4], lyz = k2 * l[5];
        const float lzz = k20 * l[6], lxz = k2 * l[7], ldd = k22 * l[8];
        WEFT_INDEPENDENT
        for (int i = 0; i < n; i++) {
            const float x = nx[i], y = ny[i], z = nz[i];
            const float sum = flat + x * (lx + lxy * y + lxz * z) + y * (ly + lyz * z) + z * (lz + lzz * z) +
                              ldd * (x * x - y * y);
            to[i] = sum > 0 ? sum : 0;
        }
    }
}

/* atan2 of x >= 0 or any y to 1e-5 rad.  Source: Abramowitz and Stegun 1964, 4.4.49 (truncated). */
WEFT_INLINE float quick_atan2(float y, float x)
{
    const float ax = fabsf(x), ay = fabsf(y), large = ax > ay ? ax : ay, small = ax > ay ? ay : ax;
    const float t = small / (large > 1e-30F ? large : 1e-30F), t2 = t * t;
    float a = t * (0.99997726F +
                   t2 * (-0.33262347F +
                         t2 * (0.19354346F + t2 * (-0.11643287F + t2 * (0.05265332F - t2 * 0.01172120F)))));
    a = ay > ax ? 0.5F * PI_F - a : a;
    a = x < 0 ? PI_F - a : a;
    return y < 0 ? -a : a;
}

/* The four texels around a place and their weights. */
typedef struct taps {
    int at[4];
    float weight[4];
} taps;

WEFT_INLINE taps taps_at(const weft_environment_planes *planes, int level, float across, float down,
                         float weight)
{
    const int width = planes->width[level], height = planes->height[level], offset = planes->offset[level];
    const float u = across * (float)width - 0.5F, v = down * (float)height - 0.5F;
    const float fu = floorf(u), high = v > 0 ? v : 0, fv = floorf(high), tu = u - fu, tv = high - fv;
    const int x = (int)fu, y = (int)fv;
    const int x0 = x < 0 ? x + width : x < width ? x : x - width, x1 = x0 + 1 < width ? x0 + 1 : 0;
    const int y0 = y < height - 1 ? y : height - 1, y1 = y0 < height - 1 ? y0 + 1 : y0;
    return (taps){
        {offset + 3 * (y0 * width + x0), offset + 3 * (y0 * width + x1), offset + 3 * (y1 * width + x0),
         offset + 3 * (y1 * width + x1)},
        {weight * (1 - tv) * (1 - tu), weight * (1 - tv) * tu, weight * tv * (1 - tu), weight * tv * tu}};
}

WEFT_CLONES
void weft_environment_planes_look(const weft_environment_planes *planes, int n,
                                  const float *const direction[3], const float *alpha,
                                  float *const radiance[3])
{
    const float *const dx = direction[0], *const dy = direction[1], *const dz = direction[2];
    const float *const texels = planes->texels;
    float *const r = radiance[0], *const g = radiance[1], *const b = radiance[2];
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        const float flat = sqrtf(dx[i] * dx[i] + dy[i] * dy[i]);
        const float across = quick_atan2(dx[i], dy[i]) * (0.5F / PI_F) + 0.5F;
        const float down = quick_atan2(flat, dz[i]) * (1 / PI_F);
        const float at = sqrtf(alpha[i]) * (LEVELS - 1);
        const int whole = (int)at, level = whole < LEVELS - 2 ? whole : LEVELS - 2;
        const float part = at - (float)level;
        const taps low = taps_at(planes, level, across, down, 1 - part);
        const taps high = taps_at(planes, level + 1, across, down, part);
        float sum[3] = {0};
        for (int k = 0; k < 4; k++)
            for (int c = 0; c < 3; c++)
                sum[c] += low.weight[k] * texels[low.at[k] + c] + high.weight[k] * texels[high.at[k] + c];
        r[i] = sum[0];
        g[i] = sum[1];
        b[i] = sum[2];
    }
}

WEFT_CLONES
void weft_environment_planes_share(const weft_environment_planes *planes, int n, const float *nv,
                                   const float *alpha, float *scale, float *bias)
{
    const float *const table = &planes->share[0][0][0];
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        const float x = sqrtf(sqrtf(nv[i])) * (N - 1), y = sqrtf(sqrtf(alpha[i])) * (N - 1);
        const int column = x < N - 2 ? (int)x : N - 2, row = y < N - 2 ? (int)y : N - 2;
        const float tx = x - (float)column, ty = y - (float)row;
        const int at = 2 * (row * N + column);
        const float a = (1 - tx) * (1 - ty), b = tx * (1 - ty), c = (1 - tx) * ty, d = tx * ty;
        scale[i] = a * table[at] + b * table[at + 2] + c * table[at + 2 * N] + d * table[at + 2 * N + 2];
        bias[i] =
            a * table[at + 1] + b * table[at + 3] + c * table[at + 2 * N + 1] + d * table[at + 2 * N + 3];
    }
}
