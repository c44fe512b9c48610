#include "host/capture/average.h"

#include "core/mem.h"

weft_err weft_average_add(weft_average *a, const weft_mosaic *frame, weft_error *err)
{
    const size_t n = (size_t)frame->width * (size_t)frame->height;
    if (!a->sum) {
        a->sum = weft_alloc(n, sizeof *a->sum, err);
        a->clipped = weft_alloc(n, sizeof *a->clipped, err);
        a->n_sites = n;
        if (!a->sum || !a->clipped)
            return WEFT_ERR_NOMEM;
    }
    if (n != a->n_sites)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "the camera changed the size of its frames to %d x %d; begin anew", frame->width,
                         frame->height);
    a->white = (uint16_t)frame->white;
    for (size_t i = 0; i < n; i++) {
        a->sum[i] += frame->data[i];
        a->clipped[i] |= frame->data[i] >= a->white;
    }
    a->n++;
    return WEFT_OK;
}

void weft_average_get(const weft_average *a, weft_mosaic *frame)
{
    const uint32_t n = (uint32_t)a->n, half = n / 2;
    for (size_t i = 0; i < a->n_sites; i++)
        frame->data[i] = (uint16_t)(a->clipped[i] ? a->white : (a->sum[i] + half) / n);
}

void weft_average_fini(weft_average *a)
{
    weft_free(a->sum);
    weft_free(a->clipped);
    *a = (weft_average){0};
}
