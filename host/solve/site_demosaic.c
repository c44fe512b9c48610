#include "host/solve/site_demosaic.h"

#include "core/clones.h"
#include "core/parallel.h"

#include <math.h>
#include <string.h>

/*
 * The picture is worked on in tiles of STRIP columns and TILE_ROWS rows, and a tile row by row: each step is
 * done once per row, as soon as the rows that it looks at are there, and only the last RING rows of it are
 * kept.  So a tile stays in the second-level cache, and nothing of the size of the picture is made but the
 * answer.  A pixel's value does not depend on the tile that it falls into.
 */
enum {
    PAD = 10, /* columns around a strip; even, so that a column's parity tells its colour */
    STRIP = 256,
    LANES = 16,
    SPAN = (STRIP + 2 * PAD + 2 * LANES - 1) / (2 * LANES) * (2 * LANES),
    MARGIN =
        LANES, /* beside a row, so that steps need not know where it ends: what they make there is not used */
    ROW = MARGIN + SPAN + MARGIN,
    HALF = MARGIN + SPAN / 2 + MARGIN,
    TILE_ROWS = 128,
    RING = 16,
    LEAST = 10
};

/* How many rows a step lags behind the reading of rows, because of those below that it looks at. */
enum { LAG_DIFFERENCE = 2, LAG_TURN = 3, LAG_BOX = 5, LAG_GREEN = 7, LAG_COLOUR = 9 };

/* Greens that differ by less than this part of their sum count as alike: a few times the noise. */
static const float alike = 0.05F;

typedef struct demosaic_job {
    const weft_image *mosaic;
    weft_cfa cfa;
    weft_image *rgb;
    weft_site_done_fn *done;
    void *context;
    int strips; /* to a row of tiles */
} demosaic_job;

/* The last rows of each step; column u of the strip is at u + PAD of a row. */
typedef struct ring {
    float row[RING][ROW];
} ring;

/* What is known of a row's pixels of one parity.  Green; the tolerance within which it is alike; of the
 * parity whose sites are not green also the difference of green and their colour. */
typedef struct halves {
    float green[HALF], near[HALF], difference[HALF];
} halves;

typedef struct tile {
    const demosaic_job *job;
    int left, top, width, height; /* of the picture's part that is to be made */
    int span;                     /* width and PAD on both sides, in whole vectors */
    ring site;
    /* Green minus the other colour of the row, and of the column, estimated at every pixel: green's own site
     * takes the other colour from its neighbours, the other's site green. */
    ring across, along;
    /* How much these change from the neighbour before to the one after, over five pixels of a row. */
    ring turn_across, turn_along;
    /* Of five rows: the change, and the mean of `along`. */
    ring box_along, mean_along;
    halves own[RING], green[RING]; /* of the sites that have another colour, and of green's */
} tile;

static inline float *row_of(ring *r, int row)
{
    return r->row[row & (RING - 1)] + MARGIN;
}

static int mirror(int i, int n)
{
    const int inside = i < 0 ? -i : i >= n ? 2 * (n - 1) - i : i;
    return inside < 0 ? 0 : inside >= n ? n - 1 : inside;
}

/* Parity of the columns whose sites are not green. */
static int coloured(const tile *t, int row)
{
    return weft_cfa_colour(t->job->cfa, 0, row) == 1 ? 1 : 0;
}

/* A row of the mosaic and its margins; beyond the picture it is mirrored, which keeps parity and colour. */
static void read_row(tile *t, int row)
{
    const weft_image *const m = t->job->mosaic;
    const float *const from = weft_image_row(m, 0, mirror(row, m->height));
    float *const to = row_of(&t->site, row);
    const int first = t->left - PAD, before = first < 0 ? -first : 0;
    const int after = first + t->span > m->width ? first + t->span - m->width : 0;
    memcpy(to + before, from + first + before, (size_t)(t->span - before - after) * sizeof *to);
    for (int i = 0; i < before; i++)
        to[i] = from[mirror(first + i, m->width)];
    for (int i = t->span - after; i < t->span; i++)
        to[i] = from[mirror(first + i, m->width)];
}

WEFT_INLINE void find_differences(tile *t, int row)
{
    const float *const c = row_of(&t->site, row);
    const float *const up = row_of(&t->site, row - 1), *const up2 = row_of(&t->site, row - 2);
    const float *const down = row_of(&t->site, row + 1), *const down2 = row_of(&t->site, row + 2);
    float *const across = row_of(&t->across, row), *const along = row_of(&t->along, row);
    const float even = coloured(t, row) ? 1.0F : -1.0F;
    for (int first = 0; first < t->span; first += LANES)
#pragma omp simd
        for (int u = first; u < first + LANES; u++) {
            const float sign = u & 1 ? -even : even;
            const float h = 0.5F * (c[u - 1] + c[u + 1]) + 0.25F * (2 * c[u] - c[u - 2] - c[u + 2]);
            const float v = 0.5F * (up[u] + down[u]) + 0.25F * (2 * c[u] - up2[u] - down2[u]);
            across[u] = sign * (c[u] - h);
            along[u] = sign * (c[u] - v);
        }
}

/* to[u] = scale times the sum of five neighbours. */
WEFT_INLINE void add_columns(const float *from, float scale, int span, float *to)
{
    for (int first = 0; first < span; first += LANES)
#pragma omp simd
        for (int u = first; u < first + LANES; u++)
            to[u] = scale * ((from[u - 2] + from[u - 1]) + from[u] + (from[u + 1] + from[u + 2]));
}

WEFT_INLINE void add_rows(ring *from, int row, float scale, int span, float *to)
{
    const float *const a = row_of(from, row - 2), *const b = row_of(from, row - 1),
                       *const c = row_of(from, row), *const d = row_of(from, row + 1),
                       *const e = row_of(from, row + 2);
    for (int first = 0; first < span; first += LANES)
#pragma omp simd
        for (int u = first; u < first + LANES; u++)
            to[u] = scale * ((a[u] + b[u]) + c[u] + (d[u] + e[u]));
}

WEFT_INLINE void find_turns(tile *t, int row)
{
    float across[ROW] = {0}, along[ROW] = {0};
    const float *const here = row_of(&t->across, row);
    const float *const above = row_of(&t->along, row - 1), *const below = row_of(&t->along, row + 1);
    for (int first = 0; first < t->span; first += LANES)
#pragma omp simd
        for (int u = first; u < first + LANES; u++) {
            across[MARGIN + u] = fabsf(here[u + 1] - here[u - 1]);
            along[MARGIN + u] = fabsf(below[u] - above[u]);
        }
    add_columns(across + MARGIN, 1, t->span, row_of(&t->turn_across, row));
    add_columns(along + MARGIN, 1, t->span, row_of(&t->turn_along, row));
}

/* The reciprocal of a direction's weight: the square of the change in it.  The bounds keep products of three
 * within a float's range, so that one division is enough. */
WEFT_INLINE float doubt(float change)
{
    const float c = 100 * change + 1e-4F, square = c * c;
    return square < 1e8F ? square : 1e8F;
}

/* Green of a row: the site's own, or its colour plus the mean difference of the four directions, those in
 * which it changes least first.  A direction's mean is over five pixels, its change over five by five. */
WEFT_INLINE void estimate_green(tile *t, int row, float *estimate)
{
    float mean_row[ROW] = {0},
          box_row[ROW] = {0}, *const mean = mean_row + MARGIN, *const box = box_row + MARGIN;
    const float *const own = row_of(&t->site, row);
    const float *const mean_up = row_of(&t->mean_along, row - 2);
    const float *const mean_down = row_of(&t->mean_along, row + 2);
    const float *const box_up = row_of(&t->box_along, row - 2), *const box_down =
                                                                    row_of(&t->box_along, row + 2);
    add_rows(&t->turn_across, row, 1, t->span, box);
    add_columns(row_of(&t->across, row), 0.2F, t->span, mean);
    for (int first = 0; first < t->span; first += LANES)
#pragma omp simd
        for (int u = first; u < first + LANES; u++) {
            const float l = doubt(box[u - 2]), r = doubt(box[u + 2]);
            const float a = doubt(box_up[u]), b = doubt(box_down[u]);
            const float lr = l * r, ab = a * b;
            const float sum =
                ab * (mean[u - 2] * r + mean[u + 2] * l) + lr * (mean_up[u] * b + mean_down[u] * a);
            estimate[u] = own[u] + sum / (ab * (l + r) + lr * (a + b));
        }
}

WEFT_INLINE void find_green(tile *t, int row)
{
    float estimate[SPAN] = {0};
    const float *const own = row_of(&t->site, row);
    const int p = coloured(t, row);
    halves *const at_own = &t->own[row & (RING - 1)], *const at_green = &t->green[row & (RING - 1)];
    estimate_green(t, row, estimate);
    for (int first = 0; first < t->span / 2; first += LANES)
#pragma omp simd
        for (int i = first; i < first + LANES; i++) {
            const float found = estimate[2 * i + p], here = own[2 * i + 1 - p];
            at_own->green[MARGIN + i] = found;
            at_own->near[MARGIN + i] = alike * fabsf(found) + 0.5e-3F;
            at_own->difference[MARGIN + i] = found - own[2 * i + p];
            at_green->green[MARGIN + i] = here;
            at_green->near[MARGIN + i] = alike * fabsf(here) + 0.5e-3F;
        }
}

/* A mean sum (d / q) over sum (1 / q) is kept as fractions of a common denominator, so that one division is
 * enough; the bound of q keeps products of six within a float's range. */
typedef struct fraction {
    float above, below, common;
} fraction;

WEFT_INLINE void add_site(fraction *f, const float *site, int i, float green, float near, float away)
{
    const float *const difference = site + offsetof(halves, difference) / sizeof(float);
    const float *const site_near = site + offsetof(halves, near) / sizeof(float);
    const float apart = site[i] - green, tolerance = site_near[i] + near;
    const float wide = (apart * apart + tolerance * tolerance) * away;
    const float q = wide < 1e5F ? wide : 1e5F;
    f->above = f->above * q + difference[i] * f->common;
    f->below = f->below * q + f->common;
    f->common *= q;
}

/* A colour beside its sites: green less the mean difference of the sites near by, those of like green first.
 * The two nearest, and four that are further: `away` is 1 + the square of their distance, times 5.
 *
 * @param site  the green of the first pixel's sites */
WEFT_CLONES static void colour_beside(const float *const site[6], const halves *at, int span,
                                      float *restrict to)
{
    const float *const a = site[0], *const b = site[1], *const c = site[2], *const d = site[3],
                       *const e = site[4], *const g = site[5];
    const float *const green = at->green + MARGIN, *const near = at->near + MARGIN;
    for (int first = 0; first < span; first += LANES)
#pragma omp simd
        for (int i = first; i < first + LANES; i++) {
            fraction f = {0, 0, 1};
            add_site(&f, a, i, green[i], near[i], 10);
            add_site(&f, b, i, green[i], near[i], 10);
            add_site(&f, c, i, green[i], near[i], 30);
            add_site(&f, d, i, green[i], near[i], 30);
            add_site(&f, e, i, green[i], near[i], 30);
            add_site(&f, g, i, green[i], near[i], 30);
            to[i] = green[i] - f.above / f.below;
        }
}

/* A colour amid four of its sites. */
WEFT_CLONES static void colour_amid(const float *const site[4], const halves *at, int span,
                                    float *restrict to)
{
    const float *const a = site[0], *const b = site[1], *const c = site[2], *const d = site[3];
    const float *const green = at->green + MARGIN, *const near = at->near + MARGIN;
    for (int first = 0; first < span; first += LANES)
#pragma omp simd
        for (int i = first; i < first + LANES; i++) {
            fraction f = {0, 0, 1};
            add_site(&f, a, i, green[i], near[i], 10);
            add_site(&f, b, i, green[i], near[i], 10);
            add_site(&f, c, i, green[i], near[i], 10);
            add_site(&f, d, i, green[i], near[i], 10);
            to[i] = green[i] - f.above / f.below;
        }
}

/* Pixels of two parities side by side again, the tile's `width` of them. */
WEFT_INLINE void interleave(const tile *t, const float *even, const float *odd, float *to)
{
    float row[SPAN];
    for (int first = 0; first < t->span / 2; first += LANES)
#pragma omp simd
        for (ptrdiff_t i = first; i < first + LANES; i++) {
            row[2 * i] = even[i];
            row[2 * i + 1] = odd[i];
        }
    memcpy(to + t->left, row + PAD, (size_t)t->width * sizeof *to);
}

WEFT_INLINE void find_colours(tile *t, int row)
{
    const int p = coloured(t, row), q = 1 - p, l = p ? -1 : 0, r = p ? 0 : 1; /* beside a green one */
    const float *site[5];
    for (int i = 0; i < 5; i++)
        site[i] = t->own[(row - 2 + i) & (RING - 1)].green + MARGIN;
    const float *const above = site[1], *const below = site[3]; /* where the other colour's sites are */
    const float *const mine_beside[6] = {site[2] + l, site[2] + r, site[0] + l,
                                         site[0] + r, site[4] + l, site[4] + r};
    const float *const other_amid[4] = {above - r, above - l, below - r, below - l};
    const float *const other_beside[6] = {above, below, above - 1, above + 1, below - 1, below + 1};
    const halves *const at_own = &t->own[row & (RING - 1)], *const at_green = &t->green[row & (RING - 1)];
    const weft_image *const rgb = t->job->rgb;
    const int colour = weft_cfa_colour(t->job->cfa, p, row), half = t->span / 2;
    const float *const here = row_of(&t->site, row), *green[2];
    float mine[2][SPAN / 2], other[2][SPAN / 2];
    colour_beside(mine_beside, at_green, half, mine[q]);
    colour_amid(other_amid, at_own, half, other[p]);
    colour_beside(other_beside, at_green, half, other[q]);
    for (int first = 0; first < half; first += LANES)
#pragma omp simd
        for (int i = first; i < first + LANES; i++)
            mine[p][i] = here[2 * i + p];
    green[p] = at_own->green + MARGIN;
    green[q] = at_green->green + MARGIN;
    interleave(t, mine[0], mine[1], weft_image_row(rgb, colour, row));
    interleave(t, other[0], other[1], weft_image_row(rgb, 2 - colour, row));
    interleave(t, green[0], green[1], weft_image_row(rgb, 1, row));
}

/* One row more, and what it makes possible. */
WEFT_CLONES static void step(tile *t, int row)
{
    const int first = t->top, last = t->top + t->height;
    read_row(t, row);
    if (row - LAG_DIFFERENCE >= first - 7)
        find_differences(t, row - LAG_DIFFERENCE);
    if (row - LAG_TURN >= first - 6)
        find_turns(t, row - LAG_TURN);
    if (row - LAG_BOX >= first - 4) {
        const int box = row - LAG_BOX;
        add_rows(&t->turn_along, box, 1, t->span, row_of(&t->box_along, box));
        add_rows(&t->along, box, 0.2F, t->span, row_of(&t->mean_along, box));
    }
    if (row - LAG_GREEN >= first - 2)
        find_green(t, row - LAG_GREEN);
    if (row - LAG_COLOUR >= first && row - LAG_COLOUR < last)
        find_colours(t, row - LAG_COLOUR);
}

static void do_tile(void *context, int band, int row_begin, int row_end)
{
    const demosaic_job *const job = context;
    const weft_image *const m = job->mosaic;
    (void)row_begin, (void)row_end;
    static _Thread_local tile t;
    t.job = job;
    t.left = band % job->strips * STRIP;
    t.top = band / job->strips * TILE_ROWS;
    t.width = m->width - t.left < STRIP ? m->width - t.left : STRIP;
    t.height = m->height - t.top < TILE_ROWS ? m->height - t.top : TILE_ROWS;
    t.span = (t.width + 2 * PAD + 2 * LANES - 1) / (2 * LANES) * (2 * LANES);
    for (int row = t.top - LAG_COLOUR; row < t.top + t.height + LAG_COLOUR; row++) {
        step(&t, row);
        if (job->done && row - LAG_COLOUR >= t.top)
            job->done(job->context, row - LAG_COLOUR, t.left, t.width);
    }
}

void weft_site_demosaic_into(const weft_image *mosaic, weft_cfa cfa, weft_image *rgb, weft_site_done_fn *done,
                             void *context)
{
    demosaic_job job = {mosaic, cfa, rgb, done, context, (mosaic->width + STRIP - 1) / STRIP};
    const int tiles = job.strips * ((mosaic->height + TILE_ROWS - 1) / TILE_ROWS);
    weft_parallel_rows(tiles * WEFT_BAND_ROWS, do_tile, &job); /* a tile a band */
}

weft_err weft_site_require_size(int width, int height, weft_error *err)
{
    if (width < LEAST || height < LEAST)
        return weft_fail(err, WEFT_ERR_RANGE, "a mosaic of %d x %d pixels is too small (at least %d a side)",
                         width, height, LEAST);
    return WEFT_OK;
}

weft_err weft_site_demosaic(const weft_image *mosaic, weft_cfa cfa, weft_image *rgb, weft_error *err)
{
    WEFT_TRY(weft_site_require_size(mosaic->width, mosaic->height, err));
    WEFT_TRY(weft_image_init(rgb, mosaic->width, mosaic->height, 3, err));
    weft_site_demosaic_into(mosaic, cfa, rgb, NULL, NULL);
    return WEFT_OK;
}
