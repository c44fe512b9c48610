#include "host/cli/preview_input.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/log.h"
#include "core/mem.h"

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

static weft_err set_param(weft_preview_input *input, const char *text, weft_error *err)
{
    weft_preview_surface *const surface = &input->surface;
    const char *const equals = strchr(text, '=');
    if (!equals || !weft_file_exists(equals + 1))
        return set_constant(surface, text, err);
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)(equals - text), text);
    weft_image *const image = &input->extra[input->n_extra];
    WEFT_TRY(weft_image_read(equals + 1, WEFT_TRANSFER_LINEAR, image, err));
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
    WEFT_TRY(weft_brdf_find(brdf, &input->surface.brdf, err));
    weft_brdf_defaults(input->surface.brdf, input->surface.params);
    if (maps->albedo.planes && weft_brdf_find_param(input->surface.brdf, "albedo", NULL))
        WEFT_TRY(weft_preview_set_map(&input->surface, "albedo", &maps->albedo, err));
    if (maps->albedo.planes && !maps->albedo_is_srgb)
        weft_warn(
            "%s: the albedo is in the camera's colours; calibrate the colour and solve again to see true "
            "ones",
            folder);
    for (int i = 0; i < params->n; i++)
        WEFT_TRY(set_param(input, params->values[i], err));
    return WEFT_OK;
}

weft_err weft_preview_input_load(weft_preview_input *input, const char *folder, const char *brdf,
                                 const weft_texts *params, weft_error *err)
{
    *input = (weft_preview_input){0};
    WEFT_TRY(weft_maps_load(folder, &input->maps, err));
    const weft_err status = make_surface(input, folder, brdf, params, err);
    if (status != WEFT_OK)
        weft_preview_input_fini(input);
    return status;
}

void weft_preview_input_fini(weft_preview_input *input)
{
    for (int i = 0; i < input->n_extra; i++)
        weft_image_fini(&input->extra[i]);
    weft_maps_fini(&input->maps);
    *input = (weft_preview_input){0};
}

char *weft_preview_title(const char *folder, weft_error *err)
{
    char *const path = weft_strdup(folder, err);
    if (!path)
        return NULL;
    for (size_t n = strlen(path); n > 1 && path[n - 1] == '/'; n--)
        path[n - 1] = '\0';
    static const char *const endings[] = {".maps", ".set"};
    for (int i = 0; i < 2; i++)
        if (weft_path_has_suffix(path, endings[i]) && strlen(weft_path_name(path)) > strlen(endings[i]))
            path[strlen(path) - strlen(endings[i])] = '\0';
    char *const title = weft_strdup(weft_path_name(path), err);
    weft_free(path);
    return title;
}
