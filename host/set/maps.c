#include "host/set/maps.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/mem_limit.h"

#include <math.h>
#include <string.h>

static const char *const normal_names[] = {"X", "Y", "Z"};
static const char *const colour_names[] = {"R", "G", "B"};
static const char *const grey_names[] = {"Y"};

/* Keys of maps.json that this file owns; all others belong to `info`. */
static const char *const own_keys[] = {"weft",     "version",   "width",     "height",
                                       "geometry", "mm_per_px", "origin_mm", "albedo_colour"};

void weft_maps_fini(weft_maps *maps)
{
    weft_image_fini(&maps->normal);
    weft_image_fini(&maps->albedo);
    weft_image_fini(&maps->residual);
    weft_image_fini(&maps->confidence);
    weft_image_fini(&maps->uncertainty);
    weft_image_fini(&maps->height_mm);
    weft_image_fini(&maps->alpha);
    weft_mask_fini(&maps->flaws);
    weft_mask_fini(&maps->lights);
    weft_mask_fini(&maps->quality);
    weft_mask_fini(&maps->mask);
    json_decref(maps->info);
    *maps = (weft_maps){0};
}

/* ---- saving ---- */

static weft_err check_image(const char *folder, const char *what, const weft_image *image, int planes,
                            const weft_maps *maps, weft_error *err)
{
    if (image->planes == 0)
        return WEFT_OK;
    if (image->planes != planes || image->width != maps->width || image->height != maps->height)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s: the %s map is %d x %d with %d planes, wanted %d x %d with %d", folder, what,
                         image->width, image->height, image->planes, maps->width, maps->height, planes);
    return WEFT_OK;
}

static weft_err check_mask(const char *folder, const char *what, const weft_mask *mask, const weft_maps *maps,
                           weft_error *err)
{
    if (mask->data && (mask->width != maps->width || mask->height != maps->height))
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: the %s is %d x %d, wanted %d x %d", folder, what,
                         mask->width, mask->height, maps->width, maps->height);
    return WEFT_OK;
}

static weft_err check_maps(const char *folder, const weft_maps *maps, weft_error *err)
{
    if (maps->normal.planes == 0 && maps->albedo.planes == 0)
        return weft_fail(err, WEFT_ERR_MISSING, "%s: there is neither a normal nor an albedo map to save",
                         folder);
    WEFT_TRY(check_image(folder, "normal", &maps->normal, 3, maps, err));
    WEFT_TRY(check_image(folder, "albedo", &maps->albedo, 3, maps, err));
    WEFT_TRY(check_image(folder, "residual", &maps->residual, 1, maps, err));
    WEFT_TRY(check_image(folder, "confidence", &maps->confidence, 1, maps, err));
    WEFT_TRY(check_image(folder, "uncertainty", &maps->uncertainty, 1, maps, err));
    WEFT_TRY(check_image(folder, "alpha", &maps->alpha, 1, maps, err));
    WEFT_TRY(check_mask(folder, "map of flaws", &maps->flaws, maps, err));
    WEFT_TRY(check_mask(folder, "map of lights used", &maps->lights, maps, err));
    WEFT_TRY(check_mask(folder, "quality map", &maps->quality, maps, err));
    WEFT_TRY(check_mask(folder, "mask", &maps->mask, maps, err));
    if (maps->geometry == WEFT_GEOMETRY_PLANE && !(maps->mm_per_px > 0 && isfinite(maps->mm_per_px)))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: %g mm per pixel is not possible", folder, maps->mm_per_px);
    return WEFT_OK;
}

/* 0.5 + 0.5 n in 16 bits, rounded to nearest; no answer (0, 0, 0) is 32768. */
static weft_err write_normal_png(const char *path, const weft_image *normal, weft_error *err)
{
    weft_raster raster;
    WEFT_TRY(weft_raster_init(&raster, normal->width, normal->height, 3, 16, err));
    const size_t n = (size_t)normal->width;
    for (int v = 0; v < normal->height; v++, weft_mem_trim())
        for (int p = 0; p < 3; p++) {
            const float *const row = weft_image_row(normal, p, v);
            uint16_t *const to = raster.data + 3 * n * (size_t)v + (size_t)p;
            for (size_t i = 0; i < n; i++) {
                const double code = 32767.5 + 32767.5 * fmin(fmax((double)row[i], -1), 1);
                to[3 * i] = isfinite(row[i]) ? (uint16_t)lround(code) : 32768;
            }
        }
    const weft_err status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    return status;
}

static json_t *describe(const weft_maps *maps)
{
    json_t *const root = json_pack("{s:s, s:i, s:i, s:i, s:s}", "weft", "maps", "version", WEFT_MAPS_VERSION,
                                   "width", maps->width, "height", maps->height, "geometry",
                                   maps->geometry == WEFT_GEOMETRY_PLANE ? "plane" : "sensor");
    if (root && maps->geometry == WEFT_GEOMETRY_PLANE) {
        json_object_set_new(root, "mm_per_px", json_real(maps->mm_per_px));
        json_object_set_new(root, "origin_mm", weft_json_numbers(maps->origin_mm, 2));
    }
    if (root && maps->albedo.planes)
        json_object_set_new(root, "albedo_colour",
                            json_string(maps->albedo_is_srgb ? "linear-srgb" : "camera-rgb"));
    if (root && maps->info)
        json_object_update_missing(root, maps->info);
    return root;
}

typedef weft_err write_map_fn(const char *path, const weft_maps *maps, weft_error *err);

static weft_err write_normal_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->normal, normal_names, WEFT_EXR_FLOAT, err);
}

static weft_err write_normal_view(const char *path, const weft_maps *maps, weft_error *err)
{
    return write_normal_png(path, &maps->normal, err);
}

static weft_err write_albedo_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->albedo, colour_names, WEFT_EXR_HALF, err);
}

static weft_err write_albedo_view(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_image_write(path, &maps->albedo, 8, WEFT_TRANSFER_SRGB, err);
}

static weft_err write_residual_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->residual, grey_names, WEFT_EXR_HALF, err);
}

static weft_err write_confidence_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->confidence, grey_names, WEFT_EXR_HALF, err);
}

static weft_err write_height_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->height_mm, grey_names, WEFT_EXR_FLOAT, err);
}

static weft_err write_uncertainty_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->uncertainty, grey_names, WEFT_EXR_HALF, err);
}

static weft_err write_alpha_exr(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_exr_write(path, &maps->alpha, grey_names, WEFT_EXR_HALF, err);
}

static weft_err write_flaws_png(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_png_write_bytes(path, &maps->flaws, err);
}

static weft_err write_lights_png(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_png_write_bytes(path, &maps->lights, err);
}

static weft_err write_quality_png(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_png_write_bytes(path, &maps->quality, err);
}

static weft_err write_mask_png(const char *path, const weft_maps *maps, weft_error *err)
{
    return weft_png_write_mask(path, &maps->mask, err);
}

static weft_err write_json(const char *path, const weft_maps *maps, weft_error *err)
{
    json_t *const root = describe(maps);
    const weft_err status = root ? weft_json_save(path, root, err)
                                 : weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for its text", path);
    json_decref(root);
    return status;
}

static weft_err write_all(const char *folder, const weft_maps *maps, weft_error *err)
{
    const bool normal = maps->normal.planes != 0, albedo = maps->albedo.planes != 0;
    const struct {
        bool wanted;
        const char *name;
        write_map_fn *write;
    } files[] = {
        {normal, "normal.exr", write_normal_exr},
        {normal, "normal.png", write_normal_view},
        {albedo, "albedo.exr", write_albedo_exr},
        {albedo, "albedo.png", write_albedo_view},
        {maps->residual.planes != 0, "residual.exr", write_residual_exr},
        {maps->confidence.planes != 0, "confidence.exr", write_confidence_exr},
        {maps->uncertainty.planes != 0, "uncertainty.exr", write_uncertainty_exr},
        {maps->height_mm.planes != 0, "height.exr", write_height_exr},
        {maps->alpha.planes != 0, "alpha.exr", write_alpha_exr},
        {maps->flaws.data != NULL, "flaws.png", write_flaws_png},
        {maps->lights.data != NULL, "lights.png", write_lights_png},
        {maps->quality.data != NULL, "quality.png", write_quality_png},
        {maps->mask.data != NULL, "mask.png", write_mask_png},
        {true, "maps.json", write_json},
    };
    weft_err status = WEFT_OK;
    for (size_t i = 0; i < sizeof files / sizeof files[0] && status == WEFT_OK; i++) {
        if (!files[i].wanted)
            continue;
        char *const path = weft_path_join(folder, files[i].name, err);
        status = path ? files[i].write(path, maps, err) : WEFT_ERR_NOMEM;
        weft_free(path);
    }
    return status;
}

weft_err weft_maps_save(const char *folder, const weft_maps *maps, bool force, weft_error *err)
{
    weft_atomic a;
    WEFT_TRY(check_maps(folder, maps, err));
    WEFT_TRY(weft_atomic_folder_begin(&a, folder, force, err));
    const weft_err status = write_all(a.temp_path, maps, err);
    if (status == WEFT_OK)
        return weft_atomic_commit(&a, err);
    weft_atomic_abort(&a);
    return weft_prefix(err, status, "%s", folder);
}

/* ---- loading ---- */

static weft_err read_header(const char *path, weft_maps *maps, weft_error *err)
{
    json_t *root;
    const char *geometry = NULL, *colour = "linear-srgb";
    WEFT_TRY(weft_json_load_kind(path, "maps", WEFT_MAPS_VERSION, &root, err));
    weft_err status = weft_json_get_text(root, "geometry", WEFT_JSON_REQUIRED, &geometry, path, err);
    if (status == WEFT_OK && strcmp(geometry, "plane") != 0 && strcmp(geometry, "sensor") != 0)
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: \"geometry\" is \"%s\", wanted \"plane\" or \"sensor\"",
                           path, geometry);
    if (status == WEFT_OK && strcmp(geometry, "plane") == 0) {
        maps->geometry = WEFT_GEOMETRY_PLANE;
        status = weft_json_get_number(root, "mm_per_px", WEFT_JSON_REQUIRED, 1e-6, 1e6, &maps->mm_per_px,
                                      path, err);
        if (status == WEFT_OK)
            status =
                weft_json_get_numbers(root, "origin_mm", WEFT_JSON_REQUIRED, 2, maps->origin_mm, path, err);
    }
    if (status == WEFT_OK)
        status = weft_json_get_text(root, "albedo_colour", WEFT_JSON_OPTIONAL, &colour, path, err);
    const int most = WEFT_IMAGE_MAX_SIDE;
    if (status == WEFT_OK)
        status = weft_json_get_int(root, "width", WEFT_JSON_OPTIONAL, 1, most, &maps->width, path, err);
    if (status == WEFT_OK)
        status = weft_json_get_int(root, "height", WEFT_JSON_OPTIONAL, 1, most, &maps->height, path, err);
    if (status != WEFT_OK) {
        json_decref(root);
        return status;
    }
    maps->albedo_is_srgb = strcmp(colour, "linear-srgb") == 0;
    for (size_t i = 0; i < sizeof own_keys / sizeof own_keys[0]; i++)
        json_object_del(root, own_keys[i]);
    maps->info = root;
    return WEFT_OK;
}

/* The first file or maps.json says the size; the rest must have it. */
static weft_err agree(weft_maps *maps, const char *path, int width, int height, weft_error *err)
{
    if (maps->width == 0)
        maps->width = width;
    if (maps->height == 0)
        maps->height = height;
    if (width == maps->width && height == maps->height)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH, "%s: is %d x %d, the rest of the folder %d x %d", path, width,
                     height, maps->width, maps->height);
}

static weft_err read_map(const char *folder, const char *name, const char *const *channels, int n,
                         weft_maps *maps, weft_image *image, weft_error *err)
{
    char *const path = weft_path_join(folder, name, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (weft_file_exists(path)) {
        status = weft_exr_read(path, channels, n, image, err);
        if (status == WEFT_OK)
            status = agree(maps, path, image->width, image->height, err);
    }
    weft_free(path);
    return status;
}

typedef weft_err read_mask_fn(const char *path, weft_mask *mask, weft_error *err);

static weft_err read_mask(const char *folder, const char *name, read_mask_fn *read, weft_maps *maps,
                          weft_mask *mask, weft_error *err)
{
    char *const path = weft_path_join(folder, name, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    if (weft_file_exists(path)) {
        status = read(path, mask, err);
        if (status == WEFT_OK)
            status = agree(maps, path, mask->width, mask->height, err);
    }
    weft_free(path);
    return status;
}

/* Makes normals unit; those that are nothing become (0, 0, 0) outside the mask. */
static weft_err tidy_normals(weft_maps *maps, weft_error *err)
{
    const size_t n = weft_image_plane_size(&maps->normal);
    float *const x = weft_image_plane(&maps->normal, 0), *const y = weft_image_plane(&maps->normal, 1),
                 *const z = weft_image_plane(&maps->normal, 2);
    for (size_t i = 0; i < n; i++) {
        const double length =
            sqrt((double)x[i] * (double)x[i] + (double)y[i] * (double)y[i] + (double)z[i] * (double)z[i]);
        if (isfinite(length) && length > 0) {
            if (fabs(length - 1) > 1e-6) { /* of halves, of other programs; our own stay as they are */
                x[i] = (float)((double)x[i] / length);
                y[i] = (float)((double)y[i] / length);
                z[i] = (float)((double)z[i] / length);
            }
            continue;
        }
        x[i] = y[i] = z[i] = 0;
        if (!maps->mask.data)
            WEFT_TRY(weft_mask_init(&maps->mask, maps->width, maps->height, 255, err));
        maps->mask.data[i] = 0;
    }
    return WEFT_OK;
}

static weft_err load_into(const char *folder, weft_maps *maps, weft_error *err)
{
    static const char *const normal_or_rgb[] = {"X|normal.X|R", "Y|normal.Y|G", "Z|normal.Z|B"};
    char *const path = weft_path_join(folder, "maps.json", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    const weft_err status = weft_file_exists(path) ? read_header(path, maps, err) : WEFT_OK;
    weft_free(path);
    WEFT_TRY(status);
    WEFT_TRY(read_map(folder, "normal.exr", normal_or_rgb, 3, maps, &maps->normal, err));
    WEFT_TRY(read_map(folder, "albedo.exr", colour_names, 3, maps, &maps->albedo, err));
    if (maps->normal.planes == 0 && maps->albedo.planes == 0)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "%s: has neither normal.exr nor albedo.exr; give a folder made by weft solve",
                         folder);
    WEFT_TRY(read_map(folder, "residual.exr", grey_names, 1, maps, &maps->residual, err));
    WEFT_TRY(read_map(folder, "confidence.exr", grey_names, 1, maps, &maps->confidence, err));
    WEFT_TRY(read_map(folder, "uncertainty.exr", grey_names, 1, maps, &maps->uncertainty, err));
    WEFT_TRY(read_map(folder, "alpha.exr", grey_names, 1, maps, &maps->alpha, err));
    WEFT_TRY(read_mask(folder, "flaws.png", weft_png_read_bytes, maps, &maps->flaws, err));
    WEFT_TRY(read_mask(folder, "lights.png", weft_png_read_bytes, maps, &maps->lights, err));
    WEFT_TRY(read_mask(folder, "quality.png", weft_png_read_bytes, maps, &maps->quality, err));
    WEFT_TRY(read_mask(folder, "mask.png", weft_png_read_mask, maps, &maps->mask, err));
    return maps->normal.planes ? tidy_normals(maps, err) : WEFT_OK;
}

weft_err weft_maps_load(const char *folder, weft_maps *maps, weft_error *err)
{
    if (!weft_folder_exists(folder))
        return weft_fail(err, WEFT_ERR_IO, "%s: is not a folder; give a folder of maps", folder);
    weft_maps loaded = {.geometry = WEFT_GEOMETRY_SENSOR, .albedo_is_srgb = true};
    const weft_err status = load_into(folder, &loaded, err);
    if (status != WEFT_OK) {
        weft_maps_fini(&loaded);
        return status;
    }
    *maps = loaded;
    return WEFT_OK;
}
