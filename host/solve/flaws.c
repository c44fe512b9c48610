#include "host/solve/flaws.h"

#include "core/colour.h"
#include "core/mem.h"
#include "host/solve/components.h"
#include "host/solve/finish.h"
#include "host/solve/running_mean.h"
#include "shading/bake/height.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 3, PATTERN_HOLES = 50, GROWN = 1 };

/* What is narrower is a thread that lies on the cloth, not a tear in it. */
static const double thread_mm = 0.35;
/* A tear in a net is larger than so many of its holes; a thread that is too thin to see joins two or three.
 */
static const double usual_holes = 6;

/* A search: what was marked, what is kept of it. */
typedef struct search {
    const weft_maps *maps;
    const weft_mask *cloth; /* 1 where there is nothing but cloth */
    weft_mask marks;
    double least_mm;                  /* length of a place */
    double least_width_mm, widest_mm; /* area over length */
    double least_mm2;
    weft_flaws_found found;
} search;

static bool answered(const weft_maps *maps, size_t i)
{
    return !maps->mask.data || maps->mask.data[i];
}

/* For the next kind of flaw. */
static void begin(search *s)
{
    memset(s->marks.data, 0, (size_t)s->maps->width * (size_t)s->maps->height);
    s->found = (weft_flaws_found){0};
    s->least_mm = s->least_width_mm = s->widest_mm = s->least_mm2 = 0;
}

/* Whether a region is long and slender enough; counts it. */
static bool keep(const weft_component *c, void *context)
{
    search *const s = context;
    const double mm = s->maps->mm_per_px, length = c->length * mm, area = (double)c->area * mm * mm;
    if (length < s->least_mm || area < s->least_mm2 || area > s->widest_mm * length ||
        area < s->least_width_mm * length)
        return false;
    s->found.n++;
    s->found.length_mm += length;
    return true;
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The value that a share of the cloth stays below; of one pixel in 7, which is plenty. */
static weft_err find_quantile(const search *s, const weft_image *image, double share, float *value,
                              weft_error *err)
{
    const size_t n = weft_image_plane_size(image);
    float *const some = weft_alloc(n / 7 + 1, sizeof *some, err);
    size_t count = 0;
    if (!some)
        return WEFT_ERR_NOMEM;
    for (size_t i = 0; i < n; i += 7)
        if (s->cloth->data[i])
            some[count++] = image->data[i];
    qsort(some, count, sizeof *some, compare_floats);
    *value = count ? some[(size_t)(share * (double)(count - 1))] : 0;
    weft_free(some);
    return WEFT_OK;
}

static void mark(const weft_image *image, float strong, float weak, weft_mask *marks)
{
    const size_t n = weft_image_plane_size(image);
    for (size_t i = 0; i < n; i++)
        marks->data[i] = image->data[i] >= strong ? WEFT_MARK_STRONG
                         : image->data[i] >= weak ? WEFT_MARK_WEAK
                                                  : 0;
}

/* ---- creases ---- */

/* The weave is averaged out with this sigma; more would blur the crease. */
static const double crease_sigma_mm = 2;
/* Least curvature, 1/mm, and in units of the cloth's usual one. */
static const float crease_curvature = 0.03F, crease_usual = 8;

/* Slopes and weights, averaged. */
static weft_err average_slopes(const search *s, weft_image *slopes, weft_error *err)
{
    const weft_maps *const maps = s->maps;
    const double sigma_px = crease_sigma_mm / maps->mm_per_px;
    const int reach = (int)lround((sqrt(4 * sigma_px * sigma_px + 1) - 1) / 2);
    const size_t n = weft_image_plane_size(slopes);
    for (size_t i = 0; i < n; i++) {
        const bool use = s->cloth->data[i];
        for (int c = 0; c < 2; c++)
            weft_image_plane(slopes, c)[i] =
                use ? (float)weft_height_slope((double)weft_image_plane(&maps->normal, c)[i],
                                               (double)weft_image_plane(&maps->normal, 2)[i])
                    : 0;
        weft_image_plane(slopes, 2)[i] = use ? 1 : 0;
    }
    WEFT_TRY(weft_running_mean(slopes, reach, ROUNDS, err));
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < 2; c++)
            weft_image_plane(slopes, c)[i] /= fmaxf(weft_image_plane(slopes, 2)[i], 1e-6F);
    return WEFT_OK;
}

/* Largest curvature of the averaged surface; 0 near what has no answer, where the average is lopsided. */
static float curvature_at(const weft_image *slopes, double mm_per_px, int u, int v)
{
    const double scale = 0.5 / mm_per_px;
    if (u < 1 || v < 1 || u + 1 >= slopes->width || v + 1 >= slopes->height)
        return 0;
    for (int k = -1; k <= 1; k++)
        if (weft_image_row(slopes, 2, v + k)[u] < 0.25F || weft_image_row(slopes, 2, v)[u + k] < 0.25F)
            return 0;
    double d[2][2]; /* of p and q, along x and y (rows go down) */
    for (int c = 0; c < 2; c++) {
        d[c][0] = scale * (double)(weft_image_row(slopes, c, v)[u + 1] - weft_image_row(slopes, c, v)[u - 1]);
        d[c][1] = scale * (double)(weft_image_row(slopes, c, v - 1)[u] - weft_image_row(slopes, c, v + 1)[u]);
    }
    const double mean = (d[0][0] + d[1][1]) / 2;
    return (float)(fabs(mean) + hypot((d[0][0] - d[1][1]) / 2, (d[0][1] + d[1][0]) / 2));
}

static weft_err find_creases(search *s, weft_error *err)
{
    weft_image slopes, curvature = {0};
    float usual = 0;
    WEFT_TRY(weft_image_init(&slopes, s->maps->width, s->maps->height, 3, err));
    weft_err status = weft_image_init(&curvature, s->maps->width, s->maps->height, 1, err);
    if (status == WEFT_OK)
        status = average_slopes(s, &slopes, err);
    for (int v = 0; v < curvature.height && status == WEFT_OK; v++)
        for (int u = 0; u < curvature.width; u++)
            weft_image_row(&curvature, 0, v)[u] = curvature_at(&slopes, s->maps->mm_per_px, u, v);
    if (status == WEFT_OK)
        status = find_quantile(s, &curvature, 0.5, &usual, err);
    if (status == WEFT_OK) {
        const float strong = fmaxf(crease_curvature, crease_usual * usual);
        mark(&curvature, strong, strong / 2, &s->marks);
        s->least_mm = 12;
        s->widest_mm = 5;
        status = weft_components_keep(&s->marks, keep, s, err);
    }
    weft_image_fini(&slopes);
    weft_image_fini(&curvature);
    return status;
}

/* ---- lint ---- */

/* Thinner than this is lint, thicker a yarn. */
static const double lint_mm = 0.5;
/* Least contrast, relative to the cloth around, and in units of what the cloth itself has. */
static const float lint_contrast = 0.12F, lint_usual = 3;

/* Least (sign 1) or greatest (-1) value within `reach` along a line of n pixels that are `step` apart. */
static void reach_line(const float *from, int n, size_t step, int reach, float sign, float *to)
{
    for (int i = 0; i < n; i++) {
        float least = INFINITY;
        for (int k = i - reach < 0 ? 0 : i - reach; k <= i + reach && k < n; k++)
            least = fminf(least, sign * from[(size_t)k * step]);
        to[(size_t)i * step] = sign * least;
    }
}

static void reach_square(const weft_image *from, int reach, float sign, weft_image *between, weft_image *to)
{
    for (int v = 0; v < from->height; v++)
        reach_line(weft_image_row(from, 0, v), from->width, 1, reach, sign, weft_image_row(between, 0, v));
    for (int u = 0; u < from->width; u++)
        reach_line(between->data + u, from->height, (size_t)from->width, reach, sign, to->data + u);
}

/* One colour, and how much of the surroundings is cloth. */
static void fill_colour(const search *s, int c, weft_image *colour, weft_image *around)
{
    const size_t n = weft_image_plane_size(colour);
    const float *const from = weft_image_plane(&s->maps->albedo, c);
    for (size_t i = 0; i < n; i++) {
        const bool use = s->cloth->data[i];
        colour->data[i] = around->data[i] = use ? from[i] : 0;
        around->data[n + i] = use ? 1 : 0;
    }
}

typedef struct lint_images {
    weft_image colour, around, between, opened;
} lint_images;

static weft_err make_lint_images(lint_images *to, int width, int height, weft_error *err)
{
    WEFT_TRY(weft_image_init(&to->colour, width, height, 1, err));
    WEFT_TRY(weft_image_init(&to->around, width, height, 2, err));
    WEFT_TRY(weft_image_init(&to->between, width, height, 1, err));
    return weft_image_init(&to->opened, width, height, 1, err);
}

/* Brighter than what a square of lint_mm fits into (sign 1: opening), or darker (-1: closing), relative to
 * the mean around; of the three colours the most. */
static weft_err find_contrast(const search *s, float sign, lint_images *im, weft_image *contrast,
                              weft_error *err)
{
    const int reach = (int)fmax(2, round(lint_mm / 2 / s->maps->mm_per_px));
    const size_t n = weft_image_plane_size(contrast);
    for (int c = 0; c < 3; c++) {
        fill_colour(s, c, &im->colour, &im->around);
        WEFT_TRY(weft_running_mean(&im->around, 4 * reach, 1, err));
        reach_square(&im->colour, reach, sign, &im->between, &im->opened);
        reach_square(&im->opened, reach, -sign, &im->between, &im->opened);
        for (size_t i = 0; i < n; i++) {
            const float weight = im->around.data[n + i];
            if (!s->cloth->data[i] || weight < 0.9F)
                continue;
            const float mean = fmaxf(im->around.data[i] / weight, 0.02F);
            contrast->data[i] =
                fmaxf(contrast->data[i], sign * (im->colour.data[i] - im->opened.data[i]) / mean);
        }
    }
    return WEFT_OK;
}

static weft_err find_lint(search *s, float sign, weft_error *err)
{
    lint_images images = {0};
    weft_image contrast;
    float usual = 0;
    WEFT_TRY(weft_image_init(&contrast, s->maps->width, s->maps->height, 1, err));
    weft_err status = make_lint_images(&images, s->maps->width, s->maps->height, err);
    if (status == WEFT_OK)
        status = find_contrast(s, sign, &images, &contrast, err);
    weft_image_fini(&images.colour);
    weft_image_fini(&images.around);
    weft_image_fini(&images.between);
    weft_image_fini(&images.opened);
    if (status == WEFT_OK)
        status = find_quantile(s, &contrast, 0.98, &usual, err);
    if (status == WEFT_OK) {
        const float strong = fmaxf(lint_contrast, lint_usual * usual);
        mark(&contrast, strong, strong / 2, &s->marks);
        s->least_mm = 2;
        s->widest_mm = lint_mm;
        status = weft_components_keep(&s->marks, keep, s, err);
    }
    weft_image_fini(&contrast);
    return status;
}

/* ---- tears ---- */

typedef struct holes {
    float *areas;
    size_t n, room;
} holes;

static bool count_hole(const weft_component *c, void *context)
{
    holes *const h = context;
    if (h->n < h->room)
        h->areas[h->n++] = (float)c->area;
    return true;
}

static bool in_hole(const weft_maps *maps, int u, int v)
{
    const size_t i = (size_t)v * (size_t)maps->width + (size_t)u;
    return answered(maps, i) && maps->alpha.data[i] < 0.5F;
}

/* The insides of holes: a pixel at their edge would join the holes on both sides of a thin thread. */
static void mark_holes(const weft_maps *maps, weft_mask *marks)
{
    memset(marks->data, 0, (size_t)maps->width * (size_t)maps->height);
    for (int v = 1; v + 1 < maps->height; v++)
        for (int u = 1; u + 1 < maps->width; u++) {
            bool inside = true;
            for (int k = 0; k < 9 && inside; k++)
                inside = in_hole(maps, u + k % 3 - 1, v + k / 3 - 1);
            marks->data[(size_t)v * (size_t)maps->width + (size_t)u] = inside ? WEFT_MARK_STRONG : 0;
        }
}

/* Back to the edge of the holes that were kept. */
static void grow_to_edge(const weft_maps *maps, weft_mask *marks)
{
    for (int v = 1; v + 1 < maps->height; v++)
        for (int u = 1; u + 1 < maps->width; u++) {
            uint8_t *const here = &marks->data[(size_t)v * (size_t)maps->width + (size_t)u];
            for (int k = 0; k < 9 && !*here && in_hole(maps, u, v); k++)
                if (here[(k / 3 - 1) * maps->width + k % 3 - 1] == 255)
                    *here = GROWN;
        }
}

/* Holes that are several times as large as the pattern's usual one; of a closed cloth, all that are long.
 * @param pattern  whether the cloth has a pattern of holes */
static weft_err find_tears(search *s, bool *pattern, weft_error *err)
{
    const weft_maps *const m = s->maps;
    const double mm2 = m->mm_per_px * m->mm_per_px;
    holes h = {.room = (size_t)m->width * (size_t)m->height / 8 + 1};
    if (!(h.areas = weft_alloc(h.room, sizeof *h.areas, err)))
        return WEFT_ERR_NOMEM;
    mark_holes(m, &s->marks);
    weft_err status = weft_components_keep(&s->marks, count_hole, &h, err);
    if (status == WEFT_OK) {
        qsort(h.areas, h.n, sizeof *h.areas, compare_floats);
        *pattern = h.n >= PATTERN_HOLES;
        mark_holes(m, &s->marks);
        s->least_mm = 1.5;
        s->least_width_mm = thread_mm;
        s->widest_mm = INFINITY;
        s->least_mm2 = *pattern ? usual_holes * mm2 * (double)h.areas[h.n / 2] : 0;
        status = weft_components_keep(&s->marks, keep, s, err);
    }
    if (status == WEFT_OK)
        grow_to_edge(m, &s->marks);
    weft_free(h.areas);
    return status;
}

/* Takes tears with a margin, and of an open cloth the holes, out of what counts as cloth. */
static void leave_out(const weft_maps *maps, const weft_mask *tears, bool pattern, weft_mask *cloth)
{
    const int reach = (int)ceil(thread_mm / maps->mm_per_px), w = maps->width, h = maps->height;
    for (int v = 0; v < h; v++)
        for (int u = 0; u < w; u++) {
            const size_t i = (size_t)v * (size_t)w + (size_t)u;
            if (pattern && maps->alpha.data[i] < 1)
                cloth->data[i] = 0;
            if (!tears->data[i])
                continue;
            for (int y = v - reach < 0 ? 0 : v - reach; y <= v + reach && y < h; y++)
                for (int x = u - reach < 0 ? 0 : u - reach; x <= u + reach && x < w; x++)
                    cloth->data[(size_t)y * (size_t)w + (size_t)x] = 0;
        }
}

/* ---- all of them ---- */

static void put(const search *s, weft_flaw flaw, weft_mask *flaws, weft_flaws_found *found)
{
    const size_t n = (size_t)flaws->width * (size_t)flaws->height;
    size_t area = 0;
    for (size_t i = 0; i < n; i++)
        if (s->marks.data[i]) {
            flaws->data[i] |= (uint8_t)flaw;
            area++;
        }
    found->n += s->found.n;
    found->area_mm2 += (double)area * s->maps->mm_per_px * s->maps->mm_per_px;
    found->length_mm += s->found.length_mm;
}

static weft_err find_all(const weft_maps *maps, weft_mask *cloth, weft_mask *flaws,
                         weft_flaws_found found[WEFT_N_FLAWS], weft_error *err)
{
    const size_t n = (size_t)maps->width * (size_t)maps->height;
    bool pattern = false;
    search s = {.maps = maps, .cloth = cloth};
    WEFT_TRY(weft_mask_init(&s.marks, maps->width, maps->height, 0, err));
    for (size_t i = 0; i < n; i++)
        cloth->data[i] = answered(maps, i);
    weft_err status = WEFT_OK;
    if (maps->alpha.planes) {
        status = find_tears(&s, &pattern, err);
        put(&s, WEFT_FLAW_TEAR, flaws, &found[0]);
        leave_out(maps, &s.marks, pattern, cloth);
    }
    if (status == WEFT_OK) {
        begin(&s);
        status = find_creases(&s, err);
        put(&s, WEFT_FLAW_CREASE, flaws, &found[1]);
    }
    for (int side = 0; side < 2 && status == WEFT_OK; side++) {
        begin(&s);
        status = find_lint(&s, side ? -1.0F : 1.0F, err);
        put(&s, WEFT_FLAW_LINT, flaws, &found[2]);
    }
    weft_mask_fini(&s.marks);
    return status;
}

static void note(weft_maps *maps, const weft_flaws_found found[WEFT_N_FLAWS])
{
    static const char *const names[WEFT_N_FLAWS] = {"tears", "creases", "lint"};
    json_t *const result = json_object_get(maps->info, "result"), *const flaws = json_object();
    for (int i = 0; i < WEFT_N_FLAWS; i++)
        if (i > 0 || maps->alpha.planes)
            json_object_set_new(flaws, names[i],
                                json_pack("{s:i, s:f, s:f}", "n", found[i].n, "area_mm2", found[i].area_mm2,
                                          "length_mm", found[i].length_mm));
    if (result)
        json_object_set(result, "flaws", flaws);
    json_decref(flaws);
}

weft_err weft_maps_find_flaws(weft_maps *maps, weft_flaws_found *found, weft_error *err)
{
    weft_flaws_found all[WEFT_N_FLAWS] = {{0}};
    weft_mask flaws = {0}, cloth = {0};
    WEFT_TRY(weft_maps_require_plane(maps, "--flaws", err));
    if (maps->mm_per_px > WEFT_FLAWS_MAX_MM_PER_PX)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "--flaws: %.3g mm a pixel are too coarse to see lint (at most %g)", maps->mm_per_px,
                         WEFT_FLAWS_MAX_MM_PER_PX);
    weft_err status = weft_mask_init(&flaws, maps->width, maps->height, 0, err);
    if (status == WEFT_OK)
        status = weft_mask_init(&cloth, maps->width, maps->height, 0, err);
    if (status == WEFT_OK)
        status = find_all(maps, &cloth, &flaws, all, err);
    weft_mask_fini(&cloth);
    if (status != WEFT_OK) {
        weft_mask_fini(&flaws);
        return status;
    }
    weft_mask_fini(&maps->flaws);
    maps->flaws = flaws;
    note(maps, all);
    if (found)
        memcpy(found, all, sizeof all);
    return WEFT_OK;
}
