#include "host/photo/photo.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "host/solve/site_demosaic.h"

#include <math.h>
#include <string.h>

static const float end_of_range = 0.998F; /* of a picture's code, of a raw's white: at it nothing is known */

void weft_photo_fini(weft_photo *photo)
{
    weft_image_fini(&photo->image);
    weft_mask_fini(&photo->clipped);
    *photo = (weft_photo){0};
}

static double exposure_of(const weft_frame_info *info)
{
    if (!(info->exposure_s > 0))
        return 0;
    const double iso = info->iso > 0 ? info->iso / 100 : info->gain > 0 ? info->gain : 1;
    return info->exposure_s * iso / (info->f_number > 0 ? info->f_number * info->f_number : 1);
}

/* A clipped photosite makes its neighbours of all colours doubtful: crosstalk. */
static void grow(weft_mask *mask)
{
    const int w = mask->width, h = mask->height;
    for (int v = 0; v < h; v++)
        for (int u = 0; u < w; u++) {
            if (mask->data[(size_t)v * (size_t)w + (size_t)u] != 1)
                continue;
            for (int y = v > 0 ? v - 1 : 0; y <= v + 1 && y < h; y++)
                for (int x = u > 0 ? u - 1 : 0; x <= u + 1 && x < w; x++) {
                    uint8_t *const at = &mask->data[(size_t)y * (size_t)w + (size_t)x];
                    *at = *at ? *at : 2;
                }
        }
}

static void mark_clipped(const weft_image *image, float limit, weft_mask *mask)
{
    const size_t n = weft_image_plane_size(image);
    for (int c = 0; c < image->planes; c++)
        for (size_t i = 0; i < n; i++)
            if (!(image->data[(size_t)c * n + i] < limit))
                mask->data[i] = 1;
    grow(mask);
}

static weft_err read_raw(const char *path, weft_photo *photo, weft_error *err)
{
    weft_mosaic mosaic;
    WEFT_TRY(weft_raw_read(path, &mosaic, &photo->info, err));
    weft_err status = weft_image_init(&photo->image, mosaic.width, mosaic.height, 1, err);
    for (int v = 0; v < mosaic.height && status == WEFT_OK; v++) {
        const uint16_t *const from = mosaic.data + (size_t)v * (size_t)mosaic.width;
        float *const to = weft_image_row(&photo->image, 0, v);
        for (int u = 0; u < mosaic.width; u++) {
            const float black = mosaic.black[(v & 1) * 2 + (u & 1)];
            to[u] = ((float)from[u] - black) / (mosaic.white - black);
        }
    }
    photo->cfa = mosaic.cfa;
    photo->exposure = exposure_of(&photo->info);
    weft_mosaic_fini(&mosaic);
    return status;
}

static weft_err read_picture(const char *path, weft_photo_transfer transfer, weft_photo *photo,
                             weft_error *err)
{
    const bool png = weft_path_has_suffix(path, ".png");
    weft_raster raster;
    if (weft_path_has_suffix(path, ".exr"))
        return weft_image_read(path, WEFT_TRANSFER_LINEAR, &photo->image, err);
    if (!png && !weft_path_has_suffix(path, ".tif") && !weft_path_has_suffix(path, ".tiff"))
        return weft_fail(
            err, WEFT_ERR_FORMAT,
            "%s: is no raw, TIFF, PNG or EXR by its name; a JPEG has lost what is needed: use the raw", path);
    WEFT_TRY(png ? weft_png_read(path, &raster, err) : weft_tiff_read(path, &raster, err));
    const bool curve = transfer == WEFT_PHOTO_SRGB || (transfer == WEFT_PHOTO_AUTO && raster.bits == 8);
    const weft_err status = weft_image_from_raster(&photo->image, &raster,
                                                   curve ? WEFT_TRANSFER_SRGB : WEFT_TRANSFER_LINEAR, err);
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_photo_read(const char *path, weft_photo_transfer transfer, weft_photo *photo, weft_error *err)
{
    weft_photo p = {.cfa = WEFT_CFA_NONE};
    const bool raw = weft_raw_is_name(path);
    weft_err status = raw ? read_raw(path, &p, err) : read_picture(path, transfer, &p, err);
    if (status == WEFT_OK && !raw && p.image.planes != 3)
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: is grey; colours cannot be corrected in it", path);
    if (status == WEFT_OK)
        status = weft_mask_init(&p.clipped, p.image.width, p.image.height, 0, err);
    if (status == WEFT_OK) {
        if (raw || !weft_path_has_suffix(path, ".exr")) /* EXR has no end of range */
            mark_clipped(&p.image, end_of_range, &p.clipped);
        *photo = p;
    } else
        weft_photo_fini(&p);
    return status;
}

/* Rows of one colour in a mosaic, and of a channel else. */
static double gain_at(const weft_photo *photo, const double gain[3], int plane, int u, int v)
{
    return gain[photo->cfa == WEFT_CFA_NONE ? plane : weft_cfa_colour(photo->cfa, u, v)];
}

weft_err weft_photo_develop(weft_photo *photo, const double gain[3], weft_error *err)
{
    const float limit = (float)fmin(gain[0], fmin(gain[1], gain[2]));
    const bool ends = photo->clipped.data != NULL;
    for (int c = 0; c < photo->image.planes; c++)
        for (int v = 0; v < photo->image.height; v++) {
            float *const row = weft_image_row(&photo->image, c, v);
            const uint8_t *const clipped = photo->clipped.data + (size_t)v * (size_t)photo->image.width;
            for (int u = 0; u < photo->image.width; u++) {
                const float value = row[u] * (float)gain_at(photo, gain, c, u, v);
                row[u] = ends && clipped[u] && value > limit ? limit : value;
            }
        }
    if (photo->cfa == WEFT_CFA_NONE)
        return WEFT_OK;
    weft_image rgb;
    WEFT_TRY(weft_site_demosaic(&photo->image, photo->cfa, &rgb, err));
    weft_image_fini(&photo->image);
    photo->image = rgb;
    photo->cfa = WEFT_CFA_NONE;
    return WEFT_OK;
}
