#include "host/set/frame_file.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/formats/png_file.h"
#include "core/formats/raw_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "core/sha256.h"

#include <math.h>
#include <string.h>

/* Beyond this a set's black or white level is not the file's: LibRaw rounds levels to whole numbers. */
#define LEVEL_TOLERANCE_DN 0.51

static weft_err check_hash(const char *path, const char *wanted, weft_error *err)
{
    char found[65];
    if (!weft_file_exists(path))
        return weft_fail(err, WEFT_ERR_MISSING,
                         "%s: set.json names it but it is not there; copy it back, or take it again with "
                         "weft capture --resume",
                         path);
    if (!*wanted)
        return WEFT_OK;
    WEFT_TRY(weft_sha256_file(path, found, err));
    if (strcmp(found, wanted) == 0)
        return WEFT_OK;
    return weft_fail(
        err, WEFT_ERR_MISMATCH,
        "%s: is not the file that was captured (sha256 %.12s..., set.json has %.12s...); copy it again", path,
        found, wanted);
}

static weft_err check_size(const weft_set *set, const char *path, int width, int height, weft_error *err)
{
    if (width == set->width && height == set->height)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_MISMATCH, "%s: is %d x %d pixels, set.json says %d x %d", path, width,
                     height, set->width, set->height);
}

/* ---- mosaics ---- */

static weft_err check_levels(const weft_set *set, const char *path, const weft_mosaic *mosaic,
                             weft_error *err)
{
    if (mosaic->cfa != set->cfa)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: its colour filters are %s, set.json says %s", path,
                         weft_cfa_name(mosaic->cfa), weft_cfa_name(set->cfa));
    if (set->white <= 0) /* the set leaves it to the files */
        return WEFT_OK;
    if (fabs((double)mosaic->white - set->white) > LEVEL_TOLERANCE_DN)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s: its white level is %g, set.json says %g", path,
                         (double)mosaic->white, set->white);
    for (int i = 0; i < 4; i++)
        if (fabs((double)mosaic->black[i] - set->black[i]) > LEVEL_TOLERANCE_DN)
            return weft_fail(err, WEFT_ERR_MISMATCH, "%s: its black level %d is %g, set.json says %g", path,
                             i, (double)mosaic->black[i], set->black[i]);
    return WEFT_OK;
}

static weft_err read_picture_mosaic(const weft_set *set, const char *path, weft_mosaic *mosaic,
                                    weft_error *err)
{
    weft_raster raster;
    if (set->white <= 0)
        return weft_fail(
            err, WEFT_ERR_MISSING,
            "%s: a mosaic in a PNG or TIFF needs \"black\" and \"white\" of \"sensor\" in set.json", path);
    if (weft_path_has_suffix(path, ".png"))
        WEFT_TRY(weft_png_read(path, &raster, err));
    else if (weft_path_has_suffix(path, ".tif") || weft_path_has_suffix(path, ".tiff"))
        WEFT_TRY(weft_tiff_read(path, &raster, err));
    else
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: a mosaic must be a camera raw file, or a 16-bit grey .png or .tif", path);
    if (raster.channels != 1 || raster.bits != 16) {
        weft_fail(err, WEFT_ERR_MISMATCH,
                  "%s: has %d channels of %d bits; set.json says it is a %s mosaic, which has 1 of 16", path,
                  raster.channels, raster.bits, weft_cfa_name(set->cfa));
        weft_raster_fini(&raster);
        return WEFT_ERR_MISMATCH;
    }
    *mosaic = (weft_mosaic){.width = raster.width,
                            .height = raster.height,
                            .cfa = set->cfa,
                            .white = (float)set->white,
                            .data = raster.data}; /* one layout */
    for (int i = 0; i < 4; i++)
        mosaic->black[i] = (float)set->black[i];
    return WEFT_OK;
}

static weft_err read_mosaic(const weft_set *set, const char *path, weft_mosaic *mosaic, weft_error *err)
{
    weft_mosaic made;
    const bool raw = weft_raw_is_name(path);
    WEFT_TRY(raw ? weft_raw_read(path, &made, NULL, err) : read_picture_mosaic(set, path, &made, err));
    weft_err status = check_size(set, path, made.width, made.height, err);
    if (status == WEFT_OK && raw)
        status = check_levels(set, path, &made, err);
    if (status != WEFT_OK) {
        weft_mosaic_fini(&made);
        return status;
    }
    *mosaic = made;
    return WEFT_OK;
}

typedef struct conversion {
    const weft_mosaic *mosaic;
    float scale[4]; /* per site of the cell */
    weft_image *image;
    weft_mask *saturated, *grown;
} conversion;

static void convert_rows(void *context, int band, int row_begin, int row_end)
{
    const conversion *const c = context;
    const weft_mosaic *const m = c->mosaic;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const uint16_t *const dn = m->data + (size_t)v * (size_t)m->width;
        float *const out = weft_image_row(c->image, 0, v);
        uint8_t *const clip = c->saturated->data + (size_t)v * (size_t)m->width;
        const float *const black = &m->black[v & 1 ? 2 : 0], *const scale = &c->scale[v & 1 ? 2 : 0];
        for (int u = 0; u < m->width; u++) {
            const float value = (float)dn[u];
            out[u] = (value - black[u & 1]) * scale[u & 1];
            clip[u] = value >= m->white ? 255 : 0;
        }
    }
}

/* A row spreads to its own left and right and to the rows above and below. */
static void grow_rows(void *context, int band, int row_begin, int row_end)
{
    const conversion *const c = context;
    const int width = c->saturated->width, height = c->saturated->height;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        uint8_t *const out = c->grown->data + (size_t)v * (size_t)width;
        for (int dv = v > 0 ? -1 : 0; dv <= (v + 1 < height ? 1 : 0); dv++) {
            const uint8_t *const in = c->saturated->data + (size_t)(v + dv) * (size_t)width;
            out[0] |= in[0];
            for (int u = 1; u < width; u++) {
                out[u] |= in[u] | in[u - 1];
                out[u - 1] |= in[u];
            }
        }
    }
}

static weft_err convert_mosaic(const weft_mosaic *mosaic, double scale, weft_image *image, weft_mask *clipped,
                               weft_error *err)
{
    weft_mask saturated = {0};
    conversion c = {.mosaic = mosaic, .image = image, .saturated = &saturated, .grown = clipped};
    for (int i = 0; i < 4; i++)
        c.scale[i] = (float)(scale / (double)(mosaic->white - mosaic->black[i]));
    weft_err status = weft_image_init(image, mosaic->width, mosaic->height, 1, err);
    if (status == WEFT_OK)
        status = weft_mask_init(clipped, mosaic->width, mosaic->height, 0, err);
    if (status == WEFT_OK)
        status = weft_mask_init(&saturated, mosaic->width, mosaic->height, 0, err);
    if (status == WEFT_OK) {
        weft_parallel_rows(mosaic->height, convert_rows, &c);
        weft_parallel_rows(mosaic->height, grow_rows, &c);
    }
    weft_mask_fini(&saturated);
    return status;
}

/* ---- pictures ---- */

/* Linear light of the whole range of codes, or of black..white where the set gives them, and where it ends.
 */
static weft_err read_picture(const weft_set *set, const char *path, weft_image *image, double *black,
                             double *white, weft_error *err)
{
    const bool exr = weft_path_has_suffix(path, ".exr"), png = weft_path_has_suffix(path, ".png");
    *black = 0;
    *white = exr ? INFINITY : 1;
    if (!exr && !png && !weft_path_has_suffix(path, ".tif") && !weft_path_has_suffix(path, ".tiff"))
        return weft_fail(err, WEFT_ERR_FORMAT, WEFT_FRAME_NOT_READ, path);
    if (exr) {
        WEFT_TRY(weft_image_read(path, WEFT_TRANSFER_LINEAR, image, err));
        if (set->white > 0) {
            *black = set->black[0];
            *white = set->white;
        }
        return WEFT_OK;
    }
    weft_raster raster;
    WEFT_TRY(png ? weft_png_read(path, &raster, err) : weft_tiff_read(path, &raster, err));
    const weft_transfer transfer = raster.bits == 8 ? set->transfer : WEFT_TRANSFER_LINEAR;
    if (set->white > 0 && transfer == WEFT_TRANSFER_LINEAR) {
        const double top = (1 << raster.bits) - 1;
        *black = set->black[0] / top;
        *white = set->white / top;
    }
    const weft_err status = weft_image_from_raster(image, &raster, transfer, err);
    weft_raster_fini(&raster);
    return status;
}

static weft_err convert_picture(const char *path, weft_image *image, double black, double white, double scale,
                                weft_mask *clipped, weft_error *err)
{
    const size_t n = weft_image_plane_size(image);
    const bool scaled = isfinite(white) && (white != 1 || black != 0);
    const float offset = (float)black, factor = (float)(scaled ? scale / (white - black) : scale);
    const float top = isfinite(white) ? (float)white * (1 - 1e-6f) : INFINITY;
    size_t n_wrong = 0;
    WEFT_TRY(weft_mask_init(clipped, image->width, image->height, 0, err));
    for (int p = 0; p < image->planes; p++) {
        float *const plane = weft_image_plane(image, p);
        for (size_t i = 0; i < n; i++) {
            const bool finite = isfinite(plane[i]);
            if (!finite || plane[i] >= top)
                clipped->data[i] = 255;
            plane[i] = finite ? (plane[i] - offset) * factor : 0;
            n_wrong += !finite;
        }
    }
    if (n_wrong == n * (size_t)image->planes)
        return weft_fail(err, WEFT_ERR_NODATA, "%s: holds no finite value", path);
    return WEFT_OK;
}

static weft_err read_any(const weft_set *set, const char *path, double scale, weft_image *image,
                         weft_mask *clipped, weft_error *err)
{
    if (set->cfa != WEFT_CFA_NONE) {
        weft_mosaic mosaic;
        WEFT_TRY(read_mosaic(set, path, &mosaic, err));
        const weft_err status = convert_mosaic(&mosaic, scale, image, clipped, err);
        weft_mosaic_fini(&mosaic);
        return status;
    }
    if (weft_raw_is_name(path))
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s: is a camera raw file, but \"cfa\" in set.json is \"none\"; give its pattern",
                         path);
    double black, white;
    WEFT_TRY(read_picture(set, path, image, &black, &white, err));
    WEFT_TRY(check_size(set, path, image->width, image->height, err));
    return convert_picture(path, image, black, white, scale, clipped, err);
}

weft_err weft_frame_read(const weft_set *set, int frame, double scale, weft_image *image, weft_mask *clipped,
                         weft_error *err)
{
    weft_image read = {0};
    weft_mask mask = {0};
    char *const path = weft_set_frame_path(set, frame, err);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = check_hash(path, set->frames[frame].sha256, err);
    if (status == WEFT_OK)
        status = read_any(set, path, scale, &read, &mask, err);
    weft_free(path);
    if (status != WEFT_OK) {
        weft_image_fini(&read);
        weft_mask_fini(&mask);
        return status;
    }
    *image = read;
    *clipped = mask;
    return WEFT_OK;
}
