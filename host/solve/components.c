#include "host/solve/components.h"

#include "core/mem.h"

#include <math.h>

/* Pixels of the region at hand are OPEN while they wait for their neighbours, in the list from then on. */
enum { OPEN = 128, KEPT = 255 };

static void take(const weft_mask *marks, uint32_t at, uint32_t *list, size_t *n, weft_component *c)
{
    const int u = (int)(at % (uint32_t)marks->width), v = (int)(at / (uint32_t)marks->width);
    c->area++;
    c->strong += marks->data[at] == WEFT_MARK_STRONG;
    c->left = u < c->left ? u : c->left;
    c->right = u > c->right ? u : c->right;
    c->top = v < c->top ? v : c->top;
    c->bottom = v > c->bottom ? v : c->bottom;
    marks->data[at] = OPEN;
    list[(*n)++] = at;
}

/* The region of a marked pixel; `list` gets its pixels. */
static weft_component grow(const weft_mask *marks, uint32_t seed, uint32_t *list)
{
    weft_component c = {.left = marks->width, .top = marks->height, .right = -1, .bottom = -1};
    size_t n = 0;
    take(marks, seed, list, &n, &c);
    for (size_t i = 0; i < n; i++) {
        const int u = (int)(list[i] % (uint32_t)marks->width), v = (int)(list[i] / (uint32_t)marks->width);
        for (int k = 0; k < 9; k++) {
            const int x = u + k % 3 - 1, y = v + k / 3 - 1;
            if (x < 0 || y < 0 || x >= marks->width || y >= marks->height)
                continue;
            const uint32_t at = (uint32_t)y * (uint32_t)marks->width + (uint32_t)x;
            if (marks->data[at] == WEFT_MARK_WEAK || marks->data[at] == WEFT_MARK_STRONG)
                take(marks, at, list, &n, &c);
        }
    }
    c.length = hypot(c.right - c.left + 1, c.bottom - c.top + 1);
    return c;
}

weft_err weft_components_keep(weft_mask *marks, weft_component_keep_fn *keep, void *context, weft_error *err)
{
    const uint32_t n = (uint32_t)marks->width * (uint32_t)marks->height; /* sides are below 2^15 */
    uint32_t *const list = weft_alloc(n, sizeof *list, err);
    if (!list)
        return WEFT_ERR_NOMEM;
    for (uint32_t at = 0; at < n; at++) {
        if (marks->data[at] != WEFT_MARK_WEAK && marks->data[at] != WEFT_MARK_STRONG)
            continue;
        const weft_component c = grow(marks, at, list);
        const uint8_t value = c.strong > 0 && keep(&c, context) ? KEPT : 0;
        for (size_t i = 0; i < c.area; i++)
            marks->data[list[i]] = value;
    }
    weft_free(list);
    return WEFT_OK;
}
