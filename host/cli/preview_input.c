#include "host/cli/preview_input.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "shading/bake/material_file.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/specular_doubt.h"

#include <string.h>

/* A constant wins over a map that came with the input. */
static weft_err set_constant(weft_preview_surface *surface, const char *text, weft_error *err)
{
    char name[64];
    int plane = 0;
    WEFT_TRY(weft_brdf_set(surface->brdf, text, surface->params, err));
    snprintf(name, sizeof name, "%.*s", (int)strcspn(text, "="), text);
    const weft_brdf_param *const param = weft_brdf_find_param(surface->brdf, name, &plane);
    for (int c = 0; param && c < param->components; c++)
        surface->maps[plane + c] = (weft_preview_map){0};
    return WEFT_OK;
}

static bool is_picture_name(const char *name)
{
    static const char *const endings[] = {".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"};
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++)
        if (weft_path_has_suffix(name, endings[i]))
            return true;
    return false;
}

static weft_err set_param(weft_preview_input *input, const char *text, weft_error *err)
{
    weft_preview_surface *const surface = &input->surface;
    const char *const equals = strchr(text, '=');
    if (equals && is_picture_name(equals + 1) && !weft_file_exists(equals + 1))
        return weft_fail(err, WEFT_ERR_MISSING, "%s: there is no such picture", text);
    if (!equals || !weft_file_exists(equals + 1))
        return set_constant(surface, text, err);
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)(equals - text), text);
    const weft_brdf_param *const param = weft_brdf_find_param(surface->brdf, name, NULL);
    weft_image *const image = &input->extra[input->n_extra];
    WEFT_TRY(weft_image_read(equals + 1,
                             param && param->components == 3 ? WEFT_TRANSFER_BY_BITS : WEFT_TRANSFER_LINEAR,
                             image, err));
    input->n_extra++;
    const weft_err status = weft_preview_set_map(surface, name, image, err);
    return status == WEFT_OK ? WEFT_OK : weft_prefix(err, status, "%s", equals + 1);
}

static weft_err make_surface(weft_preview_input *input, const char *folder, const char *brdf,
                             const weft_texts *params, weft_error *err)
{
    const weft_maps *const maps = &input->maps;
    input->surface = (weft_preview_surface){
        .width = maps->width,
        .height = maps->height,
        .mm_per_px = maps->mm_per_px,
        .origin_mm = {maps->origin_mm[0], maps->origin_mm[1]},
        .normal = maps->normal.planes ? &maps->normal : NULL,
        .mask = maps->mask.data ? &maps->mask : NULL,
    };
    WEFT_TRY(weft_brdf_open(brdf, &input->measured, &input->surface.brdf, err));
    weft_brdf_defaults(input->surface.brdf, input->surface.params);
    static const char *const colours[] = {"albedo", "base", "cloth_albedo"};
    for (int i = 0; i < 3 && maps->albedo.planes; i++)
        if (weft_brdf_find_param(input->surface.brdf, colours[i], NULL))
            WEFT_TRY(weft_preview_set_map(&input->surface, colours[i], &maps->albedo, err));
    if (maps->albedo.planes && !maps->albedo_is_srgb)
        weft_warn(
            "%s: the albedo is in the camera's colours; calibrate the colour and solve again to see true "
            "ones",
            folder);
    for (int i = 0; i < params->n; i++)
        WEFT_TRY(set_param(input, params->values[i], err));
    return WEFT_OK;
}

/* Texels along a pixel that are shaded one by one. */
enum { MOST_TEXELS = 8 };

/* Which of a material's maps is which parameter. */
static const struct {
    const char *param;
    weft_baked_kind kind;
} material_params[] = {
    {"albedo", WEFT_BAKED_ALBEDO},
    {"base", WEFT_BAKED_ALBEDO},
    {"f0", WEFT_BAKED_SPECULAR},
    {"alpha", WEFT_BAKED_ROUGHNESS},
    {"anisotropy", WEFT_BAKED_ANISOTROPY},
    {"front", WEFT_BAKED_FRONT_TINT},
    {"rim", WEFT_BAKED_RIM_TINT},
    {"amplitude", WEFT_BAKED_RIM_AMPLITUDE},
    {"cloth", WEFT_BAKED_CLOTH},
    {"cloth_albedo", WEFT_BAKED_CLOTH_ALBEDO},
    {"cloth_f0", WEFT_BAKED_CLOTH_SPECULAR},
    {"cloth_alpha", WEFT_BAKED_CLOTH_ROUGHNESS},
};

static void use_material_map(weft_preview_surface *surface, const char *param, const weft_baked_map *map,
                             int planes, int level)
{
    int plane = 0;
    const weft_brdf_param *const row = weft_brdf_find_param(surface->brdf, param, &plane);
    if (!row || (row->components == 1 && planes == 3 && !strstr(param, "f0")))
        return;
    for (int c = 0; c < row->components; c++) {
        const double value = (double)map->constant[planes == 3 ? c : 0];
        surface->params[plane + c] = value < row->min ? row->min : value > row->max ? row->max : value;
        surface->maps[plane + c] =
            map->n_mips ? (weft_preview_map){&map->mips[level], planes == 3 ? c : 0, map->n_mips - level}
                        : (weft_preview_map){0};
    }
}

/* Points the surface at one level of the material. */
static weft_err use_level(weft_preview_input *input, int level, weft_error *err)
{
    weft_baked *const baked = &input->baked;
    weft_preview_surface *const surface = &input->surface;
    const weft_baked_map *const normal = &baked->maps[WEFT_BAKED_NORMAL];
    input->level = level;
    surface->width = baked->width >> level > 0 ? baked->width >> level : 1;
    surface->height = baked->height >> level > 0 ? baked->height >> level : 1;
    surface->mm_per_px = baked->size_mm[0] / surface->width;
    surface->origin_mm[0] = -0.5 * (surface->width - 1) * surface->mm_per_px;
    surface->origin_mm[1] = 0.5 * (surface->height - 1) * surface->mm_per_px;
    surface->normal = normal->n_mips ? &normal->mips[level] : NULL;
    surface->normal_levels = normal->n_mips ? normal->n_mips - level : 0;
    for (size_t i = 0; i < sizeof material_params / sizeof material_params[0]; i++) {
        const weft_baked_kind kind = material_params[i].kind;
        use_material_map(surface, material_params[i].param, &baked->maps[kind], weft_baked_rows[kind].planes,
                         level);
    }
    for (int i = 0; i < input->params.n; i++)
        WEFT_TRY(set_param(input, input->params.values[i], err));
    return WEFT_OK;
}

static weft_err load_material(weft_preview_input *input, const char *folder, const char *brdf,
                              weft_error *err)
{
    WEFT_TRY(weft_material_load(folder, &input->baked, err));
    WEFT_TRY(weft_brdf_open(brdf, &input->measured, &input->surface.brdf, err));
    if (input->baked.two_lobes && strcmp(input->surface.brdf->name, weft_baked_brdf(&input->baked)) != 0)
        weft_warn("%s: GGX and cloth lie side by side; --brdf %s shows both, %s the smooth part alone",
                  folder, weft_baked_brdf(&input->baked), input->surface.brdf->name);
    if (weft_brdf_find_param(input->surface.brdf, "roughness", NULL))
        weft_warn("%s: %s takes the root of alpha and not the material's roughness map; give it by --param "
                  "roughness",
                  folder, input->surface.brdf->name);
    weft_brdf_defaults(input->surface.brdf, input->surface.params);
    return use_level(input, 0, err);
}

/* The size of the first picture among the parameters; unchanged when there is none. */
static weft_err picture_size(const weft_texts *params, int *width, int *height, weft_error *err)
{
    for (int i = 0; i < params->n; i++) {
        const char *const equals = strchr(params->values[i], '=');
        weft_image image;
        if (!equals || !weft_file_exists(equals + 1))
            continue;
        WEFT_TRY(weft_image_read(equals + 1, WEFT_TRANSFER_LINEAR, &image, err));
        *width = image.width;
        *height = image.height;
        weft_image_fini(&image);
        break;
    }
    return WEFT_OK;
}

static weft_err make_even(weft_preview_input *input, const char *brdf, weft_error *err)
{
    int width = 64, height = 64;
    WEFT_TRY(picture_size(&input->params, &width, &height, err));
    const double mm_per_px = 50 * WEFT_PI / (width < height ? width : height);
    input->surface =
        (weft_preview_surface){.width = width,
                               .height = height,
                               .mm_per_px = mm_per_px,
                               .origin_mm = {-0.5 * (width - 1) * mm_per_px, 0.5 * (height - 1) * mm_per_px}};
    WEFT_TRY(weft_brdf_open(brdf, &input->measured, &input->surface.brdf, err));
    weft_brdf_defaults(input->surface.brdf, input->surface.params);
    for (int i = 0; i < input->params.n; i++)
        WEFT_TRY(set_param(input, input->params.values[i], err));
    return WEFT_OK;
}

static bool is_material(const char *folder)
{
    char *const file = weft_path_join(folder, "material.json", NULL);
    const bool found = file && weft_file_exists(file);
    weft_free(file);
    return found;
}

weft_err weft_preview_input_load(weft_preview_input *input, const char *folder, const char *brdf,
                                 const weft_texts *params, weft_error *err)
{
    weft_err status;
    *input = (weft_preview_input){.params = *params};
    if (!folder) {
        status = make_even(input, brdf, err);
    } else if (is_material(folder)) {
        status = load_material(input, folder, brdf, err);
    } else {
        status = weft_maps_load(folder, &input->maps, err);
        if (status == WEFT_OK)
            status = make_surface(input, folder, brdf, params, err);
    }
    if (status != WEFT_OK)
        weft_preview_input_fini(input);
    return status;
}

weft_err weft_preview_input_level(weft_preview_input *input, double texels_per_px, weft_error *err)
{
    int level = 0;
    if (!input->baked.width || input->n_extra)
        return WEFT_OK; /* pictures given for parameters have one size only */
    const int levels = weft_baked_levels(input->baked.width, input->baked.height);
    for (double t = texels_per_px; t > MOST_TEXELS && level < levels - 1; t /= 2)
        level++;
    for (int k = 0; k < WEFT_BAKED_COUNT; k++)
        if (input->baked.maps[k].n_mips && level > input->baked.maps[k].n_mips - 1)
            level = input->baked.maps[k].n_mips - 1;
    return use_level(input, level, err);
}

static weft_err read_height(weft_preview_input *input, const char *path, weft_error *err)
{
    WEFT_TRY(weft_image_read(path, WEFT_TRANSFER_LINEAR, &input->height_mm, err));
    if (input->height_mm.planes != 1)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d planes; heights are one", path,
                         input->height_mm.planes);
    input->surface.height_mm = &input->height_mm;
    return WEFT_OK;
}

weft_err weft_preview_input_height(weft_preview_input *input, const char *folder, const char *file,
                                   weft_error *err)
{
    const weft_baked_map *const baked = &input->baked.maps[WEFT_BAKED_HEIGHT];
    if (file)
        return read_height(input, file, err);
    if (input->level < baked->n_mips) {
        input->surface.height_mm = &baked->mips[input->level];
        return WEFT_OK;
    }
    char *const path = folder ? weft_path_join(folder, "height.exr", err) : NULL;
    if (folder && !path)
        return WEFT_ERR_NOMEM;
    const bool found = path && weft_file_exists(path);
    const weft_err status = found ? read_height(input, path, err)
                                  : weft_fail(err, WEFT_ERR_MISSING,
                                              "there is no height map that could throw shadows (solve with "
                                              "--height poisson, or give --height-map)");
    weft_free(path);
    return status;
}

void weft_preview_input_warn(const weft_preview_input *input)
{
    bool known[WEFT_BRDF_MAX_PLANES];
    for (int k = 0; k < WEFT_BRDF_MAX_PLANES; k++)
        known[k] = !input->surface.maps[k].image;
    weft_specular_warn(input->surface.brdf, input->surface.params, known);
}

void weft_preview_input_fini(weft_preview_input *input)
{
    weft_image_fini(&input->height_mm);
    for (int i = 0; i < input->n_extra; i++)
        weft_image_fini(&input->extra[i]);
    weft_preview_texture_fini(&input->texture);
    weft_maps_fini(&input->maps);
    weft_baked_fini(&input->baked);
    weft_merl_destroy(input->measured);
    *input = (weft_preview_input){0};
}

char *weft_preview_title(const char *folder, weft_error *err)
{
    char *const path = weft_strdup(folder, err);
    if (!path)
        return NULL;
    for (size_t n = strlen(path); n > 1 && path[n - 1] == '/'; n--)
        path[n - 1] = '\0';
    static const char *const endings[] = {".maps", ".set", ".material"};
    for (int i = 0; i < 3; i++)
        if (weft_path_has_suffix(path, endings[i]) && strlen(weft_path_name(path)) > strlen(endings[i]))
            path[strlen(path) - strlen(endings[i])] = '\0';
    char *const title = weft_strdup(weft_path_name(path), err);
    weft_free(path);
    return title;
}
