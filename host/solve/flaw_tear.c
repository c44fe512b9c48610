/* Tears: holes that do not belong to the cloth. */
#include "core/mem.h"
#include "host/solve/flaw_search.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PATTERN_HOLES = 50, GROWN = 1 };

/* A tear in a net is larger than so many of its holes; a thread too thin to see joins two or three. */
static const double usual_holes = 6;
/* Fewer holes than this part of the picture are flecks of yarn as dark as the ground, and no net. */
static const double pattern_share = 0.05;

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

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
    return weft_flaw_answered(maps, i) && maps->alpha.data[i] < 0.5F;
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
 */
weft_err weft_flaw_find_tears(weft_flaw_search *s, bool *pattern, weft_error *err)
{
    const weft_maps *const m = s->maps;
    const double mm2 = m->mm_per_px * m->mm_per_px;
    double open = 0;
    holes h = {.room = (size_t)m->width * (size_t)m->height / 8 + 1};
    if (!(h.areas = weft_alloc(h.room, sizeof *h.areas, err)))
        return WEFT_ERR_NOMEM;
    mark_holes(m, &s->marks);
    weft_err status = weft_components_keep(&s->marks, count_hole, &h, err);
    if (status == WEFT_OK) {
        qsort(h.areas, h.n, sizeof *h.areas, compare_floats);
        for (size_t i = 0; i < h.n; i++)
            open += (double)h.areas[i];
        *pattern = h.n >= PATTERN_HOLES && open > pattern_share * m->width * m->height;
        mark_holes(m, &s->marks);
        s->least_mm = 1.5;
        s->least_width_mm = WEFT_FLAW_THREAD_MM;
        s->widest_mm = INFINITY;
        s->least_mm2 = *pattern ? usual_holes * mm2 * (double)h.areas[h.n / 2] : 0;
        status = weft_components_keep(&s->marks, weft_flaw_keep, s, err);
    }
    if (status == WEFT_OK)
        grow_to_edge(m, &s->marks);
    weft_free(h.areas);
    return status;
}
