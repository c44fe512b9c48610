#include "shading/material/mask.h"

#include "shading/bake/height_poisson.h"
#include "shading/bake/relief.h"
#include "shading/material/asset.h"
#include "shading/material/texture.h"

#include <math.h>
#include <string.h>

enum { CAVITY_RADIUS_PX = 8, OCTAVES = 3 };

static weft_err from_file(const weft_rad_record *record, int w, int h, weft_image *mask, weft_error *err)
{
    double tiling[2] = {1, 1};
    weft_image texture;
    const weft_rad_member *const name = weft_rad_at(record, "name");
    if (!name)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "a mask needs :name = \"image.png\", or :from = noise, slope, ...");
    weft_rad_numbers(record, "tiling", 2, tiling);
    WEFT_TRY(weft_texture_read(record, WEFT_TEXTURE_SCALAR, &texture, err));
    const weft_err status = weft_texture_resample(&texture, WEFT_TEXTURE_SCALAR, w, h, tiling, mask, err);
    weft_image_fini(&texture);
    return status;
}

static weft_err from_slope(const weft_baked *below, weft_image *mask, weft_error *err)
{
    WEFT_TRY(weft_image_init(mask, below->width, below->height, 1, err));
    const weft_baked_map *const map = &below->maps[WEFT_BAKED_NORMAL];
    for (size_t i = 0; map->n_mips > 0 && i < weft_image_plane_size(mask); i++) {
        const weft_image *const n = &map->mips[0];
        mask->data[i] = hypotf(weft_image_plane(n, 0)[i], weft_image_plane(n, 1)[i]) /
                        fmaxf(weft_image_plane(n, 2)[i], 0.01F);
    }
    return WEFT_OK;
}

/* Height of the layers below: their map, or what their normals say. */
static weft_err from_height(const weft_baked *below, weft_image *mask, weft_error *err)
{
    const weft_baked_map *const height = &below->maps[WEFT_BAKED_HEIGHT], *const normal =
                                                                              &below->maps[WEFT_BAKED_NORMAL];
    if (height->n_mips > 0)
        return weft_image_copy(mask, &height->mips[0], err);
    if (normal->n_mips == 0)
        return weft_image_init(mask, below->width, below->height, 1, err);
    const double mm = below->size_mm[0] > 0 ? below->size_mm[0] / below->width : 1;
    return weft_height_integrate(&normal->mips[0], NULL, mm, below->periodic, mask, NULL, err);
}

static weft_err from_cavity(const weft_baked *below, weft_image *mask, weft_error *err)
{
    weft_image height;
    WEFT_TRY(from_height(below, &height, err));
    const weft_err status = weft_relief_cavity(&height, 1, CAVITY_RADIUS_PX, below->periodic, mask, err);
    weft_image_fini(&height);
    return status;
}

/* A number in 0..1 of a corner of the lattice: a mix of bits (xxHash's last steps). */
static double corner(uint32_t x, uint32_t y, uint32_t seed)
{
    uint32_t v = x * 374761393U + y * 668265263U + seed * 2246822519U;
    v = (v ^ (v >> 15)) * 2246822519U;
    v = (v ^ (v >> 13)) * 3266489917U;
    return (double)(v ^ (v >> 16)) / 4294967296.0;
}

static double smooth_noise(double x, double y, int period, uint32_t seed)
{
    const int x0 = (int)floor(x), y0 = (int)floor(y);
    double s = x - x0, t = y - y0;
    s = s * s * (3 - 2 * s);
    t = t * t * (3 - 2 * t);
    const uint32_t xa = (uint32_t)(x0 % period), xb = (uint32_t)((x0 + 1) % period);
    const uint32_t ya = (uint32_t)(y0 % period), yb = (uint32_t)((y0 + 1) % period);
    const double top = corner(xa, ya, seed) + s * (corner(xb, ya, seed) - corner(xa, ya, seed));
    const double bottom = corner(xa, yb, seed) + s * (corner(xb, yb, seed) - corner(xa, yb, seed));
    return top + t * (bottom - top);
}

static weft_err from_noise(const weft_rad_record *record, const weft_baked *below, weft_image *mask,
                           weft_error *err)
{
    const int period = (int)weft_rad_number(record, "period", 16);
    const uint32_t seed = (uint32_t)weft_rad_number(record, "seed", 1);
    WEFT_TRY(weft_image_init(mask, below->width, below->height, 1, err));
    for (int y = 0; y < mask->height; y++)
        for (int x = 0; x < mask->width; x++) {
            double sum = 0, all = 0;
            for (int k = 0; k < OCTAVES; k++) {
                const int cells = period << k;
                sum += smooth_noise((x + 0.5) * cells / mask->width, (y + 0.5) * cells / mask->height, cells,
                                    seed + (uint32_t)k) /
                       (1 << k);
                all += 1.0 / (1 << k);
            }
            weft_image_row(mask, 0, y)[x] = (float)(sum / all);
        }
    return WEFT_OK;
}

weft_err weft_mask_make(const weft_rad_record *record, const weft_baked *below, weft_image *mask,
                        weft_error *err)
{
    const char *const from = weft_rad_text(record, "from", "file");
    weft_err status;
    if (strcmp(from, "noise") == 0)
        status = from_noise(record, below, mask, err);
    else if (strcmp(from, "slope") == 0)
        status = from_slope(below, mask, err);
    else if (strcmp(from, "height") == 0)
        status = from_height(below, mask, err);
    else if (strcmp(from, "cavity") == 0)
        status = from_cavity(below, mask, err);
    else
        status = from_file(record, below->width, below->height, mask, err);
    if (status != WEFT_OK)
        return status;
    const float low = (float)weft_rad_number(record, "low", 0),
                high = (float)weft_rad_number(record, "high", 1);
    for (size_t i = 0; i < weft_image_plane_size(mask); i++) {
        const float t = fabsf(high - low) > 0 ? (mask->data[i] - low) / (high - low) : mask->data[i] >= low;
        mask->data[i] = t < 0 ? 0 : t > 1 ? 1 : t;
    }
    return WEFT_OK;
}
