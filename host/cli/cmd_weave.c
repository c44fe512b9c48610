/* weft weave: threads per centimetre, repeat and skew of a scan; a tile of whole repeats that closes. */
#include "host/cli/command.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "host/set/maps.h"
#include "shading/bake/weave.h"

#include <math.h>
#include <string.h>

typedef struct weave_args {
    const char *output, *picture;
    int tile;
} weave_args;

static const weft_field fields[] = {
    {.key = "output",
     .short_opt = 'o',
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weave_args, output),
     .unit = "MAPS",
     .help = "write the tile as maps: cut to whole repeats, straightened, seam closed"},
    {.key = "picture",
     .type = WEFT_FIELD_TEXT,
     .offset = offsetof(weave_args, picture),
     .unit = "IMAGE",
     .help = "a picture of the tile's albedo laid side by side, to look for the seam"},
    {.key = "tile",
     .type = WEFT_FIELD_INT,
     .offset = offsetof(weave_args, tile),
     .min = 1,
     .max = 16,
     .def = "3",
     .help = "how often the picture repeats the tile"},
    {0},
};

static weft_err write_picture(const char *path, const weft_image *tile, int times, bool force,
                              weft_error *err)
{
    weft_image picture;
    WEFT_TRY(weft_file_refuse_existing(path, force, err));
    WEFT_TRY(weft_image_init(&picture, tile->width * times, tile->height * times, tile->planes, err));
    for (int p = 0; p < tile->planes; p++)
        for (int y = 0; y < picture.height; y++)
            for (int k = 0; k < times; k++)
                memcpy(weft_image_row(&picture, p, y) + (size_t)k * (size_t)tile->width,
                       weft_image_row(tile, p, y % tile->height), (size_t)tile->width * sizeof(float));
    const weft_err status = weft_image_write(path, &picture, 8, WEFT_TRANSFER_SRGB, err);
    weft_image_fini(&picture);
    return status;
}

static weft_err write_tile(const weft_maps *from, const weft_weave *weave, weft_image tiles[2],
                           const char *folder, bool force, weft_error *err)
{
    weft_maps maps = {.width = tiles[0].width,
                      .height = tiles[0].height,
                      .geometry = from->geometry,
                      .mm_per_px = from->mm_per_px,
                      .normal = tiles[0],
                      .albedo = tiles[1],
                      .albedo_is_srgb = from->albedo_is_srgb};
    maps.info =
        json_pack("{s:b, s:[i,i], s:[f,f], s:f, s:[f,f]}", "periodic", 1, "repeat_threads", weave->threads[0],
                  weave->threads[1], "step_px", hypot(weave->step_px[0][0], weave->step_px[0][1]),
                  hypot(weave->step_px[1][0], weave->step_px[1][1]), "skew_deg", weave->skew_deg, "bow",
                  weave->bow[0], weave->bow[1]);
    maps.origin_mm[0] = -0.5 * (maps.width - 1) * maps.mm_per_px;
    maps.origin_mm[1] = 0.5 * (maps.height - 1) * maps.mm_per_px;
    const weft_err status = weft_maps_save(folder, &maps, force, err);
    json_decref(maps.info);
    return status;
}

static weft_err report(const weft_invocation *inv, const weft_maps *maps, const weft_weave *weave,
                       const weft_seam *seam, const weft_image *tile, weft_error *err)
{
    double per_cm[2];
    for (int c = 0; c < 2; c++)
        per_cm[c] = maps->mm_per_px > 0 ? weave->threads_per_px[c] * 10 / maps->mm_per_px : 0;
    if (inv->json)
        return weft_print_json(
            inv,
            json_pack(
                "{s:[f,f], s:[f,f], s:[i,i], s:[f,f], s:f, s:[f,f], s:[i,i], s:[i,i], s:[f,f], s:[f,f], s:f}",
                "threads_per_cm", per_cm[0], per_cm[1], "step_px",
                hypot(weave->step_px[0][0], weave->step_px[0][1]),
                hypot(weave->step_px[1][0], weave->step_px[1][1]), "repeat", weave->threads[0],
                weave->threads[1], "likeness", weave->likeness[0], weave->likeness[1], "skew_deg",
                weave->skew_deg, "bow", weave->bow[0], weave->bow[1], "tile_threads", seam->threads[0],
                seam->threads[1], "tile_px", tile->width, tile->height, "seam_step", seam->across[0],
                seam->across[1], "inner_step", seam->inside[0], seam->inside[1], "repetition",
                seam->repetition),
            err);
    if (maps->mm_per_px > 0)
        fprintf(inv->out, "threads    %.2f x %.2f per cm\n", per_cm[0], per_cm[1]);
    else
        fprintf(inv->out, "threads    every %.2f x %.2f pixels; the maps have no scale\n",
                1 / weave->threads_per_px[0], 1 / weave->threads_per_px[1]);
    fprintf(inv->out,
            "repeat     %d x %d threads (likeness %.2f, %.2f), skew %.2f deg, bow %.2f %% of the warp, %.2f "
            "%% of the weft\n",
            weave->threads[0], weave->threads[1], weave->likeness[0], weave->likeness[1], weave->skew_deg,
            100 * weave->bow[0], 100 * weave->bow[1]);
    fprintf(inv->out, "tile       %d x %d threads, %d x %d pixels\n", seam->threads[0], seam->threads[1],
            tile->width, tile->height);
    fprintf(inv->out, "seam       steps %.4f, %.4f; the largest inside %.4f, %.4f\n", seam->across[0],
            seam->across[1], seam->inside[0], seam->inside[1]);
    fprintf(inv->out, "repetition %.1f %% rms between repeats\n", 100 * seam->repetition);
    return WEFT_OK;
}

static weft_err run(const weft_invocation *inv, const void *void_args, weft_error *err)
{
    const weave_args *const args = void_args;
    weft_maps maps;
    weft_weave weave = {0};
    weft_seam seam;
    weft_image tiles[2] = {{0}};
    WEFT_TRY(weft_maps_load(inv->operands[0], &maps, err));
    const weft_image *const planes[2] = {&maps.normal, &maps.albedo};
    weft_err status = WEFT_OK;
    if (maps.normal.planes == 0)
        status = weft_fail(err, WEFT_ERR_MISSING, "%s: has no normals", inv->operands[0]);
    if (status == WEFT_OK)
        status = weft_weave_find(&maps.normal, &maps.albedo, &weave, err);
    if (status == WEFT_OK)
        status = weft_weave_cut(planes, maps.albedo.planes ? 2 : 1, &weave, tiles, &seam, err);
    if (status != WEFT_OK)
        weft_prefix(err, status, "%s", inv->operands[0]);
    if (status == WEFT_OK && args->picture)
        status = write_picture(args->picture, &tiles[tiles[1].planes > 0], args->tile, inv->force, err);
    if (status == WEFT_OK && args->output)
        status = write_tile(&maps, &weave, tiles, args->output, inv->force, err);
    if (status == WEFT_OK)
        status = report(inv, &maps, &weave, &seam, &tiles[0], err);
    weft_image_fini(&tiles[0]);
    weft_image_fini(&tiles[1]);
    weft_weave_fini(&weave);
    weft_maps_fini(&maps);
    return status;
}

const weft_command weft_cmd_weave = {
    .name = "weave",
    .summary = "threads per centimetre and repeat of a scan; cut a tile that closes",
    .operands = "MAPS",
    .min_operands = 1,
    .max_operands = 1,
    .args_size = sizeof(weave_args),
    .fields = fields,
    .details = "Warp and weft should lie about along the picture (6 degrees are fine); the tile is "
               "straightened to them, bow and waves included.",
    .example = "weft weave twill.maps -o twill-tile.maps --picture tile.png --tile 3",
    .run = run,
};
