/* weft_dng_write(), declared in tiff_file.h.  Which reader needs which tag is told in docs/formats.md. */
#include "core/colour.h"
#include "core/file.h"
#include "core/formats/tiff_file.h"
#include "core/formats/tiff_open.h"
#include "core/linalg.h"
#include "core/version.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define ROWS_PER_STRIP     64
#define ILLUMINANT_D65     21    /* EXIF LightSource */
#define DATE_TIME_LETTERS  19    /* "2026:11:23 10:00:00" */
#define PHOTOMETRIC_OF_CFA 32803 /* without it LibRaw refuses the file */
#define LAYOUT_RECTANGULAR 1
#define LIBRAW_MIN_SIDE    22 /* it takes anything smaller for a thumbnail */

static weft_err check(const char *path, const weft_mosaic *mosaic, const weft_frame_info *info,
                      weft_error *err)
{
    if (mosaic->cfa == WEFT_CFA_NONE)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "%s: a DNG holds a colour mosaic; write grey and RGB frames as PNG, TIFF or EXR",
                         path);
    if (mosaic->width < LIBRAW_MIN_SIDE || mosaic->height < LIBRAW_MIN_SIDE)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: %d x %d pixels; LibRaw reads no raw frame smaller than %d x %d", path,
                         mosaic->width, mosaic->height, LIBRAW_MIN_SIDE, LIBRAW_MIN_SIDE);
    if (!(mosaic->white >= 1 && mosaic->white <= 65535))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: white level %g, wanted 1 to 65535", path,
                         (double)mosaic->white);
    for (int i = 0; i < 4; i++)
        if (!(mosaic->black[i] >= 0 && mosaic->black[i] < mosaic->white))
            return weft_fail(err, WEFT_ERR_RANGE, "%s: black level %g, wanted 0 to below white (%g)", path,
                             (double)mosaic->black[i], (double)mosaic->white);
    if (!(info->exposure_s >= 0) || !isfinite(info->exposure_s))
        return weft_fail(err, WEFT_ERR_RANGE, "%s: exposure of %g s", path, info->exposure_s);
    return WEFT_OK;
}

static bool set_picture_tags(TIFF *t, const weft_mosaic *m)
{
    return TIFFSetField(t, TIFFTAG_SUBFILETYPE, 0) &&
           TIFFSetField(t, TIFFTAG_IMAGEWIDTH, (uint32_t)m->width) &&
           TIFFSetField(t, TIFFTAG_IMAGELENGTH, (uint32_t)m->height) &&
           TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 16) &&
           TIFFSetField(t, TIFFTAG_COMPRESSION, COMPRESSION_NONE) &&
           TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_OF_CFA) &&
           TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1) &&
           TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
           TIFFSetField(t, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) &&
           TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, ROWS_PER_STRIP);
}

static bool set_camera_tags(TIFF *t, const weft_frame_info *info)
{
    char unique[160];
    const char *const make = info->make[0] ? info->make : "Weft";
    const char *const model = info->model[0] ? info->model : "camera";
    snprintf(unique, sizeof unique, "%s %s", make, model);
    return TIFFSetField(t, TIFFTAG_MAKE, make) && TIFFSetField(t, TIFFTAG_MODEL, model) &&
           TIFFSetField(t, TIFFTAG_UNIQUECAMERAMODEL, unique) &&
           (!info->serial[0] || TIFFSetField(t, TIFFTAG_CAMERASERIALNUMBER, info->serial)) &&
           TIFFSetField(t, TIFFTAG_SOFTWARE, "Weft " WEFT_VERSION) &&
           (strlen(info->date_time) != DATE_TIME_LETTERS ||
            TIFFSetField(t, TIFFTAG_DATETIME, info->date_time));
}

static bool set_sensor_tags(TIFF *t, const weft_mosaic *m)
{
    static const uint8_t version[4] = {1, 4, 0, 0}, backward[4] = {1, 1, 0, 0}, planes[3] = {0, 1, 2};
    const uint16_t cell[2] = {2, 2};
    const uint32_t white[1] = {(uint32_t)lroundf(m->white)};
    const uint32_t area[4] = {0, 0, (uint32_t)m->height, (uint32_t)m->width};
    const float origin[2] = {0, 0}, size[2] = {(float)m->width, (float)m->height};
    uint8_t pattern[4];
    for (int i = 0; i < 4; i++)
        pattern[i] = (uint8_t)weft_cfa_colour(m->cfa, i & 1, i >> 1);
    return TIFFSetField(t, TIFFTAG_DNGVERSION, version) &&
           TIFFSetField(t, TIFFTAG_DNGBACKWARDVERSION, backward) &&
           TIFFSetField(t, TIFFTAG_CFAREPEATPATTERNDIM, cell) &&
           TIFFSetField(t, TIFFTAG_CFAPATTERN, 4, pattern) &&
           TIFFSetField(t, TIFFTAG_CFAPLANECOLOR, 3, planes) &&
           TIFFSetField(t, TIFFTAG_CFALAYOUT, LAYOUT_RECTANGULAR) &&
           TIFFSetField(t, TIFFTAG_BLACKLEVELREPEATDIM, cell) &&
           TIFFSetField(t, TIFFTAG_BLACKLEVEL, 4, m->black) &&
           TIFFSetField(t, TIFFTAG_WHITELEVEL, 1, white) && TIFFSetField(t, TIFFTAG_ACTIVEAREA, area) &&
           TIFFSetField(t, TIFFTAG_DEFAULTCROPORIGIN, origin) &&
           TIFFSetField(t, TIFFTAG_DEFAULTCROPSIZE, size);
}

/* Where the camera's colours are not known, those of linear sRGB stand in: a viewer needs some. */
static bool set_colour_tags(TIFF *t, const weft_frame_info *info)
{
    float matrix[9], neutral[3];
    bool known = false;
    for (int i = 0; i < 9; i++)
        known |= info->xyz_to_camera[i] != 0;
    for (int j = 0; j < 3 && !known; j++) {
        double xyz[3] = {j == 0, j == 1, j == 2}, rgb[3];
        weft_xyz_to_srgb(xyz, rgb);
        for (int i = 0; i < 3; i++)
            matrix[3 * i + j] = (float)rgb[i];
    }
    for (int i = 0; i < 9 && known; i++)
        matrix[i] = (float)info->xyz_to_camera[i];
    for (int i = 0; i < 3; i++)
        neutral[i] = info->as_shot_neutral[i] > 0 ? (float)info->as_shot_neutral[i] : 1;
    return TIFFSetField(t, TIFFTAG_COLORMATRIX1, 9, matrix) &&
           TIFFSetField(t, TIFFTAG_CALIBRATIONILLUMINANT1, ILLUMINANT_D65) &&
           TIFFSetField(t, TIFFTAG_ASSHOTNEUTRAL, 3, neutral);
}

static bool write_strips(TIFF *t, const weft_mosaic *m)
{
    for (int y = 0; y < m->height; y += ROWS_PER_STRIP) {
        const int rows = m->height - y < ROWS_PER_STRIP ? m->height - y : ROWS_PER_STRIP;
        uint16_t *const from = m->data + (size_t)y * (size_t)m->width;
        const tmsize_t bytes = (tmsize_t)rows * m->width * (tmsize_t)sizeof *from;
        if (TIFFWriteEncodedStrip(t, (uint32_t)(y / ROWS_PER_STRIP), from, bytes) != bytes)
            return false;
    }
    return true;
}

/* libtiff forgets the directory it has written without freeing its texts. */
static bool begin_picture(TIFF *t)
{
    TIFFFreeDirectory(t);
    return TIFFCreateDirectory(t) == 0;
}

/* The EXIF directory goes to the file before the picture, which then points to it.  The other way round
 * needs a flush, a checkpoint and a rewritten directory, and loses the last strip without the flush. */
static bool write_exif(TIFF *t, const weft_frame_info *info)
{
    static const char exif_version[4] = {'0', '2', '3', '0'};
    uint64_t offset = 0;
    const uint16_t iso[1] = {(uint16_t)lround(fmin(info->iso, 65535))};
    return TIFFCreateEXIFDirectory(t) == 0 && TIFFSetField(t, EXIFTAG_EXIFVERSION, exif_version) &&
           (info->exposure_s <= 0 || TIFFSetField(t, EXIFTAG_EXPOSURETIME, info->exposure_s)) &&
           (info->f_number <= 0 || TIFFSetField(t, EXIFTAG_FNUMBER, info->f_number)) &&
           (iso[0] == 0 || TIFFSetField(t, EXIFTAG_ISOSPEEDRATINGS, 1, iso)) &&
           (strlen(info->date_time) != DATE_TIME_LETTERS ||
            TIFFSetField(t, EXIFTAG_DATETIMEORIGINAL, info->date_time)) &&
           TIFFWriteCustomDirectory(t, &offset) && begin_picture(t) &&
           TIFFSetField(t, TIFFTAG_EXIFIFD, offset);
}

weft_err weft_dng_write(const char *path, const weft_mosaic *mosaic, const weft_frame_info *info,
                        weft_error *err)
{
    weft_tiff_log log = {.path = path};
    weft_atomic a;
    TIFF *tiff;
    WEFT_TRY(check(path, mosaic, info, err));
    WEFT_TRY(weft_atomic_file_begin(&a, path, err));
    weft_err status = weft_tiff_open(&tiff, a.temp_path, "w", &log, err);
    if (status == WEFT_OK) {
        if (!write_exif(tiff, info) || !set_picture_tags(tiff, mosaic) || !set_camera_tags(tiff, info) ||
            !set_sensor_tags(tiff, mosaic) || !set_colour_tags(tiff, info) || !write_strips(tiff, mosaic) ||
            !TIFFFlush(tiff))
            log.failed = true;
        status = weft_tiff_close_written(tiff, &log, err);
    }
    if (status == WEFT_OK)
        return weft_atomic_commit(&a, err);
    weft_atomic_abort(&a);
    return status;
}
