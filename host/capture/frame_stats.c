#include "host/capture/frame_stats.h"

#include "core/json.h"
#include "core/mem.h"

#include <math.h>

enum { N_LEVELS = 65536 };

/* counts[colour][DN]; the sums need no second look at the picture. */
static void count_levels(const weft_mosaic *m, uint32_t *counts)
{
    for (int v = 0; v < m->height; v++) {
        const uint16_t *const row = m->data + (size_t)v * (size_t)m->width;
        uint32_t *const even = counts + (size_t)weft_cfa_colour(m->cfa, 0, v) * N_LEVELS;
        uint32_t *const odd = counts + (size_t)weft_cfa_colour(m->cfa, 1, v) * N_LEVELS;
        for (int u = 0; u < m->width; u++)
            (u & 1 ? odd : even)[row[u]]++;
    }
}

static double black_of(const weft_mosaic *m, int colour)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < 4; i++)
        if (weft_cfa_colour(m->cfa, i & 1, i >> 1) == colour) {
            sum += (double)m->black[i];
            n++;
        }
    return n ? sum / n : 0;
}

/* The level at or below which so many of the photosites lie. */
static int quantile(const uint32_t *counts, double wanted)
{
    double below = 0;
    for (int dn = 0; dn < N_LEVELS; dn++)
        if ((below += counts[dn]) >= wanted && counts[dn])
            return dn;
    return 0;
}

static void summarise(const uint32_t *counts, double black, double white, weft_colour_stats *stats,
                      double *total, double *n_total)
{
    double n = 0, sum = 0, clipped = 0;
    int max = 0;
    for (int dn = 0; dn < N_LEVELS; dn++) {
        if (!counts[dn])
            continue;
        n += counts[dn];
        sum += (double)counts[dn] * dn;
        clipped += dn >= white ? counts[dn] : 0;
        max = dn;
    }
    const double scale = 1 / fmax(white - black, 1);
    *stats = n > 0 ? (weft_colour_stats){.mean = (sum / n - black) * scale,
                                         .middle = (quantile(counts, 0.5 * n) - black) * scale,
                                         .high = (quantile(counts, 0.999 * n) - black) * scale,
                                         .top = (quantile(counts, 0.9999 * n) - black) * scale,
                                         .max = (max - black) * scale,
                                         .clipped = clipped / n}
                   : (weft_colour_stats){0};
    *total += n * stats->mean;
    *n_total += n;
}

weft_err weft_frame_stats_make(const weft_mosaic *mosaic, weft_frame_stats *stats, weft_error *err)
{
    uint32_t *const counts = weft_alloc((size_t)3 * N_LEVELS, sizeof *counts, err);
    double total = 0, n_total = 0;
    if (!counts)
        return WEFT_ERR_NOMEM;
    count_levels(mosaic, counts);
    for (int c = 0; c < 3; c++)
        summarise(counts + (size_t)c * N_LEVELS, black_of(mosaic, c), (double)mosaic->white,
                  &stats->colours[c], &total, &n_total);
    stats->mean = n_total > 0 ? total / n_total : 0;
    weft_free(counts);
    return WEFT_OK;
}

double weft_frame_stats_high(const weft_frame_stats *stats)
{
    return fmax(fmax(stats->colours[0].high, stats->colours[1].high), stats->colours[2].high);
}

double weft_frame_stats_clipped(const weft_frame_stats *stats, const char **colour)
{
    static const char *const names[3] = {"red", "green", "blue"};
    int worst = 0;
    for (int c = 1; c < 3; c++)
        if (stats->colours[c].clipped > stats->colours[worst].clipped)
            worst = c;
    *colour = names[worst];
    return stats->colours[worst].clipped;
}

json_t *weft_frame_stats_to_json(const weft_frame_stats *stats)
{
    const weft_colour_stats *const c = stats->colours;
#define OF_EACH(what) weft_json_numbers((const double[]){c[0].what, c[1].what, c[2].what}, 3)
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "mean", OF_EACH(mean), "middle", OF_EACH(middle),
                     "high", OF_EACH(high), "top", OF_EACH(top), "max", OF_EACH(max), "clipped",
                     OF_EACH(clipped));
#undef OF_EACH
}
