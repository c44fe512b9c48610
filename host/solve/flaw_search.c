#include "host/solve/flaw_search.h"

#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

void weft_flaw_begin(weft_flaw_search *s)
{
    memset(s->marks.data, 0, (size_t)s->maps->width * (size_t)s->maps->height);
    s->found = (weft_flaws_found){0};
    s->least_mm = s->least_width_mm = s->widest_mm = s->least_mm2 = 0;
}

bool weft_flaw_keep(const weft_component *c, void *context)
{
    weft_flaw_search *const s = context;
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

weft_err weft_flaw_quantile(const weft_image *image, const weft_mask *of, double share, float *value,
                            weft_error *err)
{
    const size_t n = weft_image_plane_size(image);
    float *const some = weft_alloc(n / 7 + 1, sizeof *some, err);
    size_t count = 0;
    if (!some)
        return WEFT_ERR_NOMEM;
    for (size_t i = 0; i < n; i += 7)
        if (of->data[i])
            some[count++] = image->data[i];
    qsort(some, count, sizeof *some, compare_floats);
    *value = count ? some[(size_t)(share * (double)(count - 1))] : 0;
    weft_free(some);
    return WEFT_OK;
}

void weft_flaw_mark(const weft_image *image, float strong, float weak, weft_mask *marks)
{
    const size_t n = weft_image_plane_size(image);
    for (size_t i = 0; i < n; i++)
        marks->data[i] = image->data[i] >= strong ? WEFT_MARK_STRONG
                         : image->data[i] >= weak ? WEFT_MARK_WEAK
                                                  : 0;
}
