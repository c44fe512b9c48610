#include "host/cli/scan_input.h"

#include "host/set/maps.h"

#include <string.h>

/* A hole in a scan would be a black pit with a normal of no length. */
static void fill_unknown(const weft_mask *mask, weft_image *albedo, weft_image *normal)
{
    const weft_image *const any = normal->planes ? normal : albedo;
    const size_t n = weft_image_plane_size(any);
    double sum[3] = {0, 0, 0};
    size_t known = 0;
    for (size_t i = 0; i < n; i++) {
        if (!mask->data[i])
            continue;
        known++;
        for (int p = 0; p < albedo->planes && p < 3; p++)
            sum[p] += (double)weft_image_plane(albedo, p)[i];
    }
    for (size_t i = 0; i < n && known > 0; i++) {
        if (mask->data[i])
            continue;
        for (int p = 0; p < albedo->planes && p < 3; p++)
            weft_image_plane(albedo, p)[i] = (float)(sum[p] / (double)known);
        for (int p = 0; p < normal->planes; p++)
            weft_image_plane(normal, p)[i] = p == 2;
    }
}

weft_err weft_scan_input_load(void *context, const char *path, weft_scan *scan, weft_error *err)
{
    weft_maps maps;
    (void)context;
    WEFT_TRY(weft_maps_load(path, &maps, err));
    if (maps.mask.data)
        fill_unknown(&maps.mask, &maps.albedo, &maps.normal);
    *scan = (weft_scan){.albedo = maps.albedo, .normal = maps.normal, .mm_per_px = maps.mm_per_px};
    maps.albedo = maps.normal = (weft_image){0};
    weft_maps_fini(&maps);
    return WEFT_OK;
}
