#include "calibration/charts/chart_blobs.h"

#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 72, AREA_MIN = 36, VERSIONS_MAX = 60000 };
static const double level_step = 0.08; /* in log brightness: 72 steps are a range of 1 : 317 */

/* A region while it grows. */
typedef struct region {
    int parent;
    int border; /* touches the edge of the picture */
    double n, su, sv, suu, suv, svv;
} region;

typedef struct forest {
    int width, height;
    region *regions; /* [height * width] */
    uint8_t *level;  /* of each pixel; 0 never joins */
    int *order;      /* pixels from bright to dark */
    int start[LEVELS + 2];
    uint8_t *stamp; /* level at which a root was last looked at */
} forest;

static int find_root(region *r, int i)
{
    while (r[i].parent != i) {
        r[i].parent = r[r[i].parent].parent;
        i = r[i].parent;
    }
    return i;
}

static void join(region *r, int i, int j)
{
    i = find_root(r, i);
    j = find_root(r, j);
    if (i == j)
        return;
    if (r[i].n < r[j].n) {
        const int swap = i;
        i = j;
        j = swap;
    }
    r[j].parent = i;
    r[i].border |= r[j].border;
    r[i].n += r[j].n;
    r[i].su += r[j].su;
    r[i].sv += r[j].sv;
    r[i].suu += r[j].suu;
    r[i].suv += r[j].suv;
    r[i].svv += r[j].svv;
}

static void sort_by_level(forest *f, const weft_image *plane)
{
    const int n = f->width * f->height;
    float bright = 0;
    for (int i = 0; i < n; i++)
        if (isfinite(plane->data[i]) && plane->data[i] > bright)
            bright = plane->data[i];
    int count[LEVELS + 1] = {0};
    for (int i = 0; i < n; i++) {
        const double x = (double)plane->data[i];
        const double down = x > 0 && isfinite(x) ? log((double)bright / x) / level_step : LEVELS;
        f->level[i] = (uint8_t)(down < LEVELS ? LEVELS - (int)down : 0);
        count[f->level[i]]++;
    }
    int at = 0;
    for (int l = LEVELS; l >= 0; l--) {
        f->start[LEVELS - l] = at;
        at += count[l];
    }
    f->start[LEVELS + 1] = at;
    int next[LEVELS + 1];
    for (int l = 0; l <= LEVELS; l++)
        next[l] = f->start[LEVELS - l];
    for (int i = 0; i < n; i++)
        f->order[next[f->level[i]]++] = i;
}

static void add_pixel(forest *f, int i, int level)
{
    const int u = i % f->width, v = i / f->width;
    const double x = u, y = v;
    f->regions[i] = (region){.parent = i,
                             .border = u == 0 || v == 0 || u == f->width - 1 || v == f->height - 1,
                             .n = 1,
                             .su = x,
                             .sv = y,
                             .suu = x * x,
                             .suv = x * y,
                             .svv = y * y};
    static const int du[4] = {-1, 1, 0, 0}, dv[4] = {0, 0, -1, 1};
    for (int k = 0; k < 4; k++) {
        const int nu = u + du[k], nv = v + dv[k];
        if (nu < 0 || nv < 0 || nu >= f->width || nv >= f->height)
            continue;
        const int j = nv * f->width + nu;
        if (f->level[j] > level || (f->level[j] == level && f->regions[j].n > 0))
            join(f->regions, i, j);
    }
}

/* Whether a region looks like a patch; fills the blob. */
static bool judge(const region *r, double area_max, weft_blob *blob)
{
    if (r->border || r->n < AREA_MIN || r->n > area_max)
        return false;
    const double u = r->su / r->n, v = r->sv / r->n;
    const double cuu = r->suu / r->n - u * u + 1.0 / 12, cuv = r->suv / r->n - u * v;
    const double cvv = r->svv / r->n - v * v + 1.0 / 12;
    const double det = cuu * cvv - cuv * cuv, half = 0.5 * (cuu + cvv);
    const double root = sqrt(fmax(half * half - det, 0));
    if (!(det > 0) || half - root < 0.31 * (half + root)) /* sides 1 : 1.8; two patches in one blob are 2.2 */
        return false;
    *blob = (weft_blob){u, v, r->n, cuu, cuv, cvv, r->n / (12 * sqrt(det))};
    return blob->squareness > 0.86 && blob->squareness < 1.06;
}

static weft_err push(weft_blobs *blobs, const weft_blob *blob, weft_error *err)
{
    if (blobs->n == blobs->capacity) {
        const int capacity = blobs->capacity ? 2 * blobs->capacity : 256;
        weft_blob *const items = weft_realloc(blobs->items, (size_t)capacity, sizeof *items, err);
        if (!items)
            return WEFT_ERR_NOMEM;
        blobs->items = items;
        blobs->capacity = capacity;
    }
    blobs->items[blobs->n++] = *blob;
    return WEFT_OK;
}

static weft_err grow(forest *f, weft_blobs *blobs, weft_error *err)
{
    const double area_max = 0.12 * f->width * f->height;
    for (int level = LEVELS; level >= 1; level--) {
        const int begin = f->start[LEVELS - level], end = f->start[LEVELS - level + 1];
        for (int k = begin; k < end; k++)
            add_pixel(f, f->order[k], level);
        for (int k = begin; k < end; k++) {
            const int root = find_root(f->regions, f->order[k]);
            weft_blob blob;
            if (f->stamp[root] == level)
                continue;
            f->stamp[root] = (uint8_t)level;
            if (blobs->n < VERSIONS_MAX && judge(&f->regions[root], area_max, &blob))
                WEFT_TRY(push(blobs, &blob, err));
        }
    }
    return WEFT_OK;
}

/* Good shapes first, then the largest. */
static int compare_blobs(const void *pa, const void *pb)
{
    const weft_blob *const a = pa, *const b = pb;
    const int ta = fabs(a->squareness - 1) > 0.04, tb = fabs(b->squareness - 1) > 0.04;
    if (ta != tb)
        return ta - tb;
    if (a->area != b->area)
        return a->area > b->area ? -1 : 1;
    return a->v != b->v ? (a->v < b->v ? -1 : 1) : (a->u < b->u ? -1 : a->u > b->u);
}

static void keep_one_version(weft_blobs *blobs)
{
    if (blobs->n)
        qsort(blobs->items, (size_t)blobs->n, sizeof *blobs->items, compare_blobs);
    int kept = 0;
    for (int i = 0; i < blobs->n; i++) {
        const weft_blob *const b = &blobs->items[i];
        bool known = false;
        for (int j = 0; j < kept && !known; j++) {
            const weft_blob *const k = &blobs->items[j];
            const double ratio = b->area / k->area, reach = 0.4 * sqrt(fmax(k->area, b->area));
            known = ratio > 0.3 && ratio < 3.3 && fabs(b->u - k->u) < reach && fabs(b->v - k->v) < reach;
        }
        if (!known)
            blobs->items[kept++] = *b;
    }
    blobs->n = kept;
}

weft_err weft_blobs_find(const weft_image *plane, weft_blobs *blobs, weft_error *err)
{
    const size_t n = weft_image_plane_size(plane);
    *blobs = (weft_blobs){0};
    forest f = {.width = plane->width, .height = plane->height};
    f.regions = weft_alloc(n, sizeof *f.regions, err);
    f.level = weft_alloc(n, 1, err);
    f.stamp = weft_alloc(n, 1, err);
    f.order = weft_alloc(n, sizeof *f.order, err);
    weft_err status = f.regions && f.level && f.stamp && f.order ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        sort_by_level(&f, plane);
        status = grow(&f, blobs, err);
    }
    if (status == WEFT_OK)
        keep_one_version(blobs);
    else
        weft_blobs_fini(blobs);
    weft_free(f.regions);
    weft_free(f.level);
    weft_free(f.stamp);
    weft_free(f.order);
    return status;
}

void weft_blobs_fini(weft_blobs *blobs)
{
    weft_free(blobs->items);
    *blobs = (weft_blobs){0};
}
