#include "core/image.h"

#include "core/mem.h"

#include <math.h>
#include <string.h>

static weft_err check_size(int width, int height, weft_error *err)
{
    if (width < 1 || height < 1 || width > WEFT_IMAGE_MAX_SIDE || height > WEFT_IMAGE_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_RANGE, "an image of %d x %d pixels is not possible (1 to %d a side)",
                         width, height, WEFT_IMAGE_MAX_SIDE);
    return WEFT_OK;
}

weft_err weft_image_init(weft_image *image, int width, int height, int planes, weft_error *err)
{
    WEFT_TRY(check_size(width, height, err));
    if (planes < 1 || planes > WEFT_IMAGE_MAX_PLANES)
        return weft_fail(err, WEFT_ERR_RANGE, "an image of %d planes is not possible (1 to %d)", planes,
                         WEFT_IMAGE_MAX_PLANES);
    float *const data = weft_alloc((size_t)width * (size_t)height * (size_t)planes, sizeof *data, err);
    if (!data)
        return WEFT_ERR_NOMEM;
    *image = (weft_image){width, height, planes, data};
    return WEFT_OK;
}

void weft_image_fini(weft_image *image)
{
    weft_free(image->data);
    *image = (weft_image){0};
}

weft_err weft_image_copy(weft_image *copy, const weft_image *image, weft_error *err)
{
    WEFT_TRY(weft_image_init(copy, image->width, image->height, image->planes, err));
    memcpy(copy->data, image->data,
           weft_image_plane_size(image) * (size_t)image->planes * sizeof *image->data);
    return WEFT_OK;
}

float weft_image_sample(const weft_image *image, int plane, double u, double v)
{
    const double u_in = fmin(fmax(u, 0), image->width - 1);
    const double v_in = fmin(fmax(v, 0), image->height - 1);
    const int u0 = (int)u_in, v0 = (int)v_in;
    const int u1 = u0 + 1 < image->width ? u0 + 1 : u0;
    const int v1 = v0 + 1 < image->height ? v0 + 1 : v0;
    const float fu = (float)(u_in - u0), fv = (float)(v_in - v0);
    const float *const top = weft_image_row(image, plane, v0);
    const float *const bottom = weft_image_row(image, plane, v1);
    return (1 - fv) * ((1 - fu) * top[u0] + fu * top[u1]) + fv * ((1 - fu) * bottom[u0] + fu * bottom[u1]);
}

weft_err weft_mask_init(weft_mask *mask, int width, int height, uint8_t value, weft_error *err)
{
    WEFT_TRY(check_size(width, height, err));
    const size_t n = (size_t)width * (size_t)height;
    uint8_t *const data = weft_alloc(n, 1, err);
    if (!data)
        return WEFT_ERR_NOMEM;
    if (value != 0) /* zeroed it is, and not touched where it is in a file */
        memset(data, value, n);
    *mask = (weft_mask){width, height, data};
    return WEFT_OK;
}

void weft_mask_fini(weft_mask *mask)
{
    weft_free(mask->data);
    *mask = (weft_mask){0};
}

static const char *const cfa_names[] = {"none", "RGGB", "GRBG", "GBRG", "BGGR"};

const char *weft_cfa_name(weft_cfa cfa)
{
    return cfa_names[cfa];
}

bool weft_cfa_from_name(const char *name, weft_cfa *cfa)
{
    for (int i = 0; i < (int)(sizeof cfa_names / sizeof cfa_names[0]); i++)
        if (strcmp(name, cfa_names[i]) == 0) {
            *cfa = (weft_cfa)i;
            return true;
        }
    return false;
}

weft_err weft_mosaic_init(weft_mosaic *mosaic, int width, int height, weft_cfa cfa, weft_error *err)
{
    WEFT_TRY(check_size(width, height, err));
    uint16_t *const data = weft_alloc((size_t)width * (size_t)height, sizeof *data, err);
    if (!data)
        return WEFT_ERR_NOMEM;
    *mosaic = (weft_mosaic){.width = width, .height = height, .cfa = cfa, .white = 65535, .data = data};
    return WEFT_OK;
}

void weft_mosaic_fini(weft_mosaic *mosaic)
{
    weft_free(mosaic->data);
    *mosaic = (weft_mosaic){0};
}
