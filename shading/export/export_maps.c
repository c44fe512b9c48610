/*
 * Plain pictures, one a map, as PNG or as TIFF: colours in sRGB, everything else linear.  PNG has 8 bits
 * where they are enough to look at; TIFF is for programs that work on, and has 16 throughout.
 */
#include "shading/export/exporter.h"

#include "core/formats/png_file.h"
#include "core/formats/tiff_file.h"
#include "core/mem.h"
#include "core/text_buffer.h"

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

/* A kind of file. */
typedef struct pictures {
    const char *suffix;
    int least_bits;
    weft_err (*write)(const char *path, const weft_raster *raster, weft_error *err);
} pictures;

static weft_err write_map(const weft_export_job *job, const pictures *as, const coding *c,
                          const weft_image *level, weft_error *err)
{
    weft_image coded;
    weft_raster raster = {0};
    char *const name = weft_asprintf(err, "%s/%s.%s", job->folder, weft_baked_rows[c->kind].name, as->suffix);
    if (!name)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_image_copy(&coded, level, err);
    for (size_t i = 0; status == WEFT_OK && i < weft_image_plane_size(&coded) * (size_t)coded.planes; i++)
        coded.data[i] = coded.data[i] * c->scale + c->offset;
    const int bits = c->bits > as->least_bits ? c->bits : as->least_bits;
    if (status == WEFT_OK)
        status = weft_raster_from_image(&raster, &coded, bits, c->transfer, err);
    if (status == WEFT_OK)
        status = as->write(name, &raster, err);
    weft_raster_fini(&raster);
    weft_image_fini(&coded);
    weft_free(name);
    return status;
}

/* Height is coded over its own range, which the report gives. */
static weft_err write_height(const weft_export_job *job, const pictures *as, weft_error *err)
{
    const weft_image *const h = &job->baked->maps[WEFT_BAKED_HEIGHT].mips[0];
    float low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < weft_image_plane_size(h); i++) {
        low = fminf(low, h->data[i]);
        high = fmaxf(high, h->data[i]);
    }
    const float range = high > low ? high - low : 1;
    const coding c = {WEFT_BAKED_HEIGHT, WEFT_TRANSFER_LINEAR, 16, 1 / range, -low / range};
    weft_export_lose(job, "height.%s: 0 is %.6g mm and 65535 is %.6g mm: it has no unit", as->suffix,
                     (double)low, (double)high);
    return write_map(job, as, &c, h, err);
}

/* Maps that have no picture, by name. */
static weft_err lose_the_rest(const weft_export_job *job, weft_error *err)
{
    weft_text_buffer names = {0};
    for (int kind = 0; kind < WEFT_BAKED_COUNT; kind++) {
        bool written = job->baked->maps[kind].n_mips == 0 || kind == WEFT_BAKED_HEIGHT;
        for (size_t i = 0; i < sizeof codings / sizeof codings[0]; i++)
            written = written || (int)codings[i].kind == kind;
        if (!written)
            weft_text_add(&names, "%s%s", names.n > 0 ? ", " : "", weft_baked_rows[kind].name);
    }
    const weft_err status = weft_text_buffer_status(&names, err);
    if (status == WEFT_OK && names.n > 0)
        weft_export_lose(job, "%s: in the EXR maps alone", names.text);
    weft_text_buffer_fini(&names);
    return status;
}

static weft_err write_maps(const weft_export_job *job, const pictures *as, weft_error *err)
{
    for (size_t i = 0; i < sizeof codings / sizeof codings[0]; i++) {
        const weft_baked_map *const map = &job->baked->maps[codings[i].kind];
        if (map->n_mips > 0)
            WEFT_TRY(write_map(job, as, &codings[i], &map->mips[0], err));
    }
    if (job->baked->maps[WEFT_BAKED_HEIGHT].n_mips > 0)
        WEFT_TRY(write_height(job, as, err));
    weft_export_lose(
        job, "mips: one level a picture; roughness that stands for averaged normals is in the EXR maps");
    return lose_the_rest(job, err);
}

static weft_err write_png(const weft_export_job *job, weft_error *err)
{
    static const pictures png = {"png", 8, weft_png_write};
    return write_maps(job, &png, err);
}

static weft_err write_tiff(const weft_export_job *job, weft_error *err)
{
    static const pictures tiff = {"tif", 16, weft_tiff_write};
    return write_maps(job, &tiff, err);
}

const weft_exporter weft_exporter_png = {
    .name = "png",
    .summary = "one PNG a map: albedo in sRGB, normals and roughness in 16 bits",
    .version = 2,
    .write = write_png,
};

const weft_exporter weft_exporter_tiff = {
    .name = "tiff",
    .summary = "one TIFF of 16 bits a map: albedo in sRGB, the rest linear",
    .version = 1,
    .write = write_tiff,
};
