/* Plain pictures, one a map: colour as 8-bit sRGB, everything else as 16-bit linear numbers. */
#include "shading/export/exporter.h"

#include "core/formats/png_file.h"
#include "core/mem.h"

#include <math.h>

/* How a quantity is coded in 0..1; offset and scale bring signed ones there. */
typedef struct coding {
    weft_baked_kind kind;
    weft_transfer transfer;
    int bits;
    float scale, offset;
} coding;

static const coding codings[] = {
    {WEFT_BAKED_ALBEDO, WEFT_TRANSFER_SRGB, 8, 1, 0},
    {WEFT_BAKED_SPECULAR, WEFT_TRANSFER_LINEAR, 16, 1, 0},
    {WEFT_BAKED_ROUGHNESS, WEFT_TRANSFER_LINEAR, 16, 1, 0},
    {WEFT_BAKED_NORMAL, WEFT_TRANSFER_LINEAR, 16, 0.5F, 0.5F},
    {WEFT_BAKED_OCCLUSION, WEFT_TRANSFER_LINEAR, 8, 1, 0},
    {WEFT_BAKED_CAVITY, WEFT_TRANSFER_LINEAR, 8, 1, 0},
    {WEFT_BAKED_OPACITY, WEFT_TRANSFER_LINEAR, 8, 1, 0},
    {WEFT_BAKED_CLOTH, WEFT_TRANSFER_LINEAR, 8, 1, 0},
    {WEFT_BAKED_CLOTH_ALBEDO, WEFT_TRANSFER_SRGB, 8, 1, 0},
    {WEFT_BAKED_CLOTH_SPECULAR, WEFT_TRANSFER_LINEAR, 16, 1, 0},
    {WEFT_BAKED_CLOTH_ROUGHNESS, WEFT_TRANSFER_LINEAR, 16, 1, 0},
};

static weft_err write_map(const weft_export_job *job, const coding *c, const weft_image *level,
                          weft_error *err)
{
    weft_image coded;
    weft_raster raster = {0};
    char *const name = weft_asprintf(err, "%s/%s.png", job->folder, weft_baked_rows[c->kind].name);
    if (!name)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_image_copy(&coded, level, err);
    for (size_t i = 0; status == WEFT_OK && i < weft_image_plane_size(&coded) * (size_t)coded.planes; i++)
        coded.data[i] = coded.data[i] * c->scale + c->offset;
    if (status == WEFT_OK)
        status = weft_raster_from_image(&raster, &coded, c->bits, c->transfer, err);
    if (status == WEFT_OK)
        status = weft_png_write(name, &raster, err);
    weft_raster_fini(&raster);
    weft_image_fini(&coded);
    weft_free(name);
    return status;
}

/* Height is coded over its own range, which the report gives. */
static weft_err write_height(const weft_export_job *job, weft_error *err)
{
    const weft_image *const h = &job->baked->maps[WEFT_BAKED_HEIGHT].mips[0];
    float low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < weft_image_plane_size(h); i++) {
        low = fminf(low, h->data[i]);
        high = fmaxf(high, h->data[i]);
    }
    const float range = high > low ? high - low : 1;
    const coding c = {WEFT_BAKED_HEIGHT, WEFT_TRANSFER_LINEAR, 16, 1 / range, -low / range};
    weft_export_lose(job, "height.png: 0 is %.6g mm and 65535 is %.6g mm: PNG has no unit", (double)low,
                     (double)high);
    return write_map(job, &c, h, err);
}

static weft_err write(const weft_export_job *job, weft_error *err)
{
    for (size_t i = 0; i < sizeof codings / sizeof codings[0]; i++) {
        const weft_baked_map *const map = &job->baked->maps[codings[i].kind];
        if (map->n_mips > 0)
            WEFT_TRY(write_map(job, &codings[i], &map->mips[0], err));
    }
    if (job->baked->maps[WEFT_BAKED_HEIGHT].n_mips > 0)
        WEFT_TRY(write_height(job, err));
    weft_export_lose(
        job, "mips: a PNG has one level; roughness that stands for averaged normals is in the EXR maps");
    return WEFT_OK;
}

const weft_exporter weft_exporter_png = {
    .name = "png",
    .summary = "one PNG a map: albedo in sRGB, normals and roughness in 16 bits",
    .version = 1,
    .write = write,
};
