#include "host/solve/site_albedo.h"

#include "core/parallel.h"
#include "host/solve/site_demosaic.h"

#include <string.h>

/* Every pass fills two pixels more of a hole; the demosaicing reaches eight. */
enum { PASSES = 4 };

typedef struct fill_job {
    const weft_image *from;
    const weft_mask *known;
    weft_image *to;
    weft_mask *now_known;
} fill_job;

/* Mean of the known sites of the same colour around (u, v); false when there is none. */
static bool neighbours(const fill_job *job, int u, int v, float *mean)
{
    const weft_image *const from = job->from;
    float sum = 0;
    int n = 0;
    for (int y = v - 2; y <= v + 2; y += 2)
        for (int x = u - 2; x <= u + 2; x += 2) {
            if (x < 0 || y < 0 || x >= from->width || y >= from->height ||
                !job->known->data[(size_t)y * (size_t)from->width + (size_t)x])
                continue;
            sum += weft_image_row(from, 0, y)[x];
            n++;
        }
    *mean = n ? sum / (float)n : 0;
    return n > 0;
}

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const fill_job *const job = context;
    const int width = job->from->width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const uint8_t *const known = job->known->data + (size_t)v * (size_t)width;
        uint8_t *const now_known = job->now_known->data + (size_t)v * (size_t)width;
        float *const to = weft_image_row(job->to, 0, v);
        memcpy(to, weft_image_row(job->from, 0, v), (size_t)width * sizeof *to);
        for (int u = 0; u < width; u++)
            now_known[u] = known[u] || neighbours(job, u, v, &to[u]) ? 255 : 0;
    }
}

/* Fills the holes of `mosaic`, of which `mask` says where it is known. */
static weft_err fill_holes(weft_image *mosaic, const weft_mask *mask, weft_error *err)
{
    weft_image other = {0};
    weft_mask known[2] = {{0}, {0}};
    weft_err status = weft_image_init(&other, mosaic->width, mosaic->height, 1, err);
    for (int i = 0; i < 2 && status == WEFT_OK; i++)
        status = weft_mask_init(&known[i], mosaic->width, mosaic->height, 0, err);
    if (status == WEFT_OK)
        memcpy(known[0].data, mask->data, weft_image_plane_size(mosaic));
    for (int pass = 0; pass < PASSES && status == WEFT_OK; pass += 2) {
        fill_job there = {mosaic, &known[0], &other, &known[1]};
        weft_parallel_rows(mosaic->height, fill_rows, &there);
        fill_job back = {&other, &known[1], mosaic, &known[0]};
        weft_parallel_rows(mosaic->height, fill_rows, &back);
    }
    weft_image_fini(&other);
    weft_mask_fini(&known[0]);
    weft_mask_fini(&known[1]);
    return status;
}

typedef struct copy_job {
    const weft_image *from;
    weft_image *to;
} copy_job;

/* Plane 0. */
static void copy_rows(void *context, int band, int row_begin, int row_end)
{
    const copy_job *const job = context;
    (void)band;
    memcpy(weft_image_row(job->to, 0, row_begin), weft_image_row(job->from, 0, row_begin),
           (size_t)(row_end - row_begin) * (size_t)job->to->width * sizeof(float));
}

weft_err weft_site_albedo_finish(weft_maps *maps, weft_cfa cfa, weft_site_done_fn *done, void *context,
                                 weft_error *err)
{
    weft_image mosaic = {0};
    WEFT_TRY(weft_site_require_size(maps->width, maps->height, err));
    WEFT_TRY(weft_image_init(&mosaic, maps->width, maps->height, 1, err));
    copy_job copy = {&maps->albedo, &mosaic};
    weft_parallel_rows(maps->height, copy_rows, &copy);
    weft_err status = WEFT_OK;
    if (memchr(maps->mask.data, 0, weft_image_plane_size(&mosaic)))
        status = fill_holes(&mosaic, &maps->mask, err);
    if (status == WEFT_OK)
        weft_site_demosaic_into(&mosaic, cfa, &maps->albedo, done, context);
    weft_image_fini(&mosaic);
    return status;
}
