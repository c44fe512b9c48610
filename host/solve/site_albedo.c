#include "host/solve/site_albedo.h"

#include "core/parallel.h"
#include "host/set/plate.h"

#include <string.h>

typedef struct fill_job {
    const weft_maps *maps;
    weft_plate *mosaic;
} fill_job;

/* Mean of the answered sites of the same colour around (u, v); false when there is none. */
static bool neighbours(const weft_maps *m, int u, int v, float *mean)
{
    float sum = 0;
    int n = 0;
    for (int dv = -2; dv <= 2; dv += 2)
        for (int du = -2; du <= 2; du += 2) {
            const int x = u + du, y = v + dv;
            if (x < 0 || y < 0 || x >= m->width || y >= m->height || !m->mask.data[y * m->width + x])
                continue;
            sum += weft_image_row(&m->albedo, 0, y)[x];
            n++;
        }
    *mean = n ? sum / (float)n : 0;
    return n > 0;
}

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const fill_job *const job = context;
    const weft_maps *const m = job->maps;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const size_t at = (size_t)v * (size_t)m->width;
        float *const to = weft_image_row(&job->mosaic->image, 0, v);
        memcpy(to, weft_image_row(&m->albedo, 0, v), (size_t)m->width * sizeof *to);
        for (int u = 0; u < m->width; u++)
            if (!m->mask.data[at + (size_t)u] && !neighbours(m, u, v, &to[u]))
                job->mosaic->clipped.data[at + (size_t)u] = 255;
    }
}

weft_err weft_site_albedo_finish(weft_maps *maps, weft_cfa cfa, weft_error *err)
{
    weft_plate mosaic = {.cfa = cfa}, rgb = {0};
    weft_err status = weft_image_init(&mosaic.image, maps->width, maps->height, 1, err);
    if (status == WEFT_OK)
        status = weft_mask_init(&mosaic.clipped, maps->width, maps->height, 0, err);
    if (status == WEFT_OK) {
        fill_job job = {maps, &mosaic};
        weft_parallel_rows(maps->height, fill_rows, &job);
        status = weft_plate_demosaic(&mosaic, WEFT_DEMOSAIC_LINEAR, &rgb, err);
    }
    weft_plate_fini(&mosaic);
    if (status != WEFT_OK)
        return status;
    const size_t n = weft_image_plane_size(&rgb.image);
    for (size_t i = 0; i < n; i++)
        maps->mask.data[i] = rgb.clipped.data[i] ? 0 : maps->mask.data[i];
    weft_image_fini(&maps->albedo);
    maps->albedo = rgb.image;
    rgb.image = (weft_image){0};
    weft_plate_fini(&rgb);
    return WEFT_OK;
}
