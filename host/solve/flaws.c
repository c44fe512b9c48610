#include "host/solve/flaws.h"

#include "host/solve/finish.h"
#include "host/solve/flaw_search.h"

#include <math.h>
#include <string.h>

/* Takes tears with a margin, and of an open cloth the holes, out of what counts as cloth. */
static void leave_out(const weft_maps *maps, const weft_mask *tears, bool pattern, weft_mask *cloth)
{
    const int reach = (int)ceil(WEFT_FLAW_THREAD_MM / maps->mm_per_px), w = maps->width, h = maps->height;
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

static void put(const weft_flaw_search *s, weft_flaw flaw, weft_mask *flaws, weft_flaws_found *found)
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
    weft_flaw_search s = {.maps = maps, .cloth = cloth};
    WEFT_TRY(weft_mask_init(&s.marks, maps->width, maps->height, 0, err));
    for (size_t i = 0; i < n; i++)
        cloth->data[i] = weft_flaw_answered(maps, i);
    weft_err status = WEFT_OK;
    if (maps->alpha.planes) {
        status = weft_flaw_find_tears(&s, &pattern, err);
        put(&s, WEFT_FLAW_TEAR, flaws, &found[0]);
        leave_out(maps, &s.marks, pattern, cloth);
    }
    if (status == WEFT_OK) {
        weft_flaw_begin(&s);
        status = weft_flaw_find_creases(&s, err);
        put(&s, WEFT_FLAW_CREASE, flaws, &found[1]);
    }
    for (int side = 0; side < 2 && status == WEFT_OK; side++) {
        weft_flaw_begin(&s);
        status = weft_flaw_find_lint(&s, side ? -1.0F : 1.0F, err);
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
