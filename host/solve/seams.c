#include "host/solve/seams.h"

#include "core/clones.h"
#include "core/parallel.h"

#include <math.h>
#include <string.h>

enum { COLUMNS = 128 };

/* Sums over three rows, of COLUMNS columns and one to either side. */
typedef struct column_sums {
    float known[COLUMNS + 2], albedo[COLUMNS + 2];
    float x[COLUMNS + 2], y[COLUMNS + 2], z[COLUMNS + 2];    /* of the normals */
    float ax[COLUMNS + 2], ay[COLUMNS + 2], az[COLUMNS + 2]; /* of albedo times normal */
} column_sums;

/* Columns [first - 1, first + n] of a row, as far as there are any. */
WEFT_INLINE void add_row(const weft_maps *m, int row, int first, int n, column_sums *to)
{
    const int begin = first > 0 ? first - 1 : 0, end = first + n < m->width ? first + n + 1 : m->width;
    const int at = begin - (first - 1), count = end - begin;
    const uint8_t *const mask = m->mask.data + (size_t)row * (size_t)m->width + begin;
    const float *const red = weft_image_row(&m->albedo, 0, row) + begin,
                       *const green = weft_image_row(&m->albedo, 1, row) + begin,
                       *const blue = weft_image_row(&m->albedo, 2, row) + begin;
    const float *const nx = weft_image_row(&m->normal, 0, row) + begin,
                       *const ny = weft_image_row(&m->normal, 1, row) + begin,
                       *const nz = weft_image_row(&m->normal, 2, row) + begin;
    WEFT_INDEPENDENT
    for (int i = 0; i < count; i++) {
        const float known = mask[i] ? 1.0F : 0.0F;
        const float grey = 0.2126F * red[i] + 0.7152F * green[i] + 0.0722F * blue[i];
        const float a = grey > 0 ? known * grey : 0.0F;
        to->known[at + i] += known;
        to->albedo[at + i] += a;
        to->x[at + i] += nx[i], to->y[at + i] += ny[i], to->z[at + i] += nz[i];
        to->ax[at + i] += a * nx[i], to->ay[at + i] += a * ny[i], to->az[at + i] += a * nz[i];
    }
}

WEFT_INLINE float three(const float *sums)
{
    return sums[0] + sums[1] + sums[2];
}

static const float degrees2 = 57.2957795F * 57.2957795F;

WEFT_INLINE void add_doubt(const column_sums *s, const uint8_t *mask, int n, float *restrict uncertainty)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        const float known = three(s->known + i), albedo = three(s->albedo + i);
        const float over_n = 1 / (known > 0 ? known : 1.0F), over_a = 1 / (albedo > 0 ? albedo : 1.0F);
        const float dx = three(s->ax + i) * over_a - three(s->x + i) * over_n,
                    dy = three(s->ay + i) * over_a - three(s->y + i) * over_n,
                    dz = three(s->az + i) * over_a - three(s->z + i) * over_n;
        const float seam2 = albedo > 0 ? degrees2 * (dx * dx + dy * dy + dz * dz) : 0.0F;
        const float error = sqrtf(uncertainty[i] * uncertainty[i] + seam2);
        uncertainty[i] = mask[i] ? error : 0.0F;
    }
}

WEFT_CLONES static void doubt_rows(void *context, int band, int row_begin, int row_end)
{
    weft_maps *const m = context;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int first = 0; first < m->width; first += COLUMNS) {
            const int n = m->width - first < COLUMNS ? m->width - first : COLUMNS;
            column_sums sums;
            memset(&sums, 0, sizeof sums);
            for (int v = row > 0 ? row - 1 : 0; v <= row + 1 && v < m->height; v++)
                add_row(m, v, first, n, &sums);
            add_doubt(&sums, m->mask.data + (size_t)row * (size_t)m->width + first, n,
                      weft_image_row(&m->uncertainty, 0, row) + first);
        }
}

void weft_seams_doubt(weft_maps *maps)
{
    weft_parallel_rows(maps->height, doubt_rows, maps);
}
