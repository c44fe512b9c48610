#include "core/formats/raw_file.h"

#include "core/file.h"
#include "core/formats/tiff_extent.h"
#include "core/mem_limit.h"

#include <libraw.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

bool weft_raw_is_name(const char *path)
{
    static const char *const suffixes[] = {".dng", ".nef", ".nrw", ".cr2", ".cr3", ".crw", ".arw", ".sr2",
                                           ".srf", ".srw", ".raf", ".rw2", ".orf", ".pef", ".3fr", ".fff",
                                           ".iiq", ".mos", ".mef", ".erf", ".dcr", ".kdc", ".raw", ".rwl"};
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++)
        if (weft_path_has_suffix(path, suffixes[i]))
            return true;
    return false;
}

/* LibRaw goes on after damaged data and only calls this. */
static void on_damaged_data(void *data, const char *file, int offset)
{
    (void)file, (void)offset;
    *(bool *)data = true;
}

static void on_no_memory(void *data, const char *file, const char *where)
{
    (void)data, (void)file, (void)where; /* the call that wanted it fails */
}

static weft_err libraw_failed(const char *path, int code, weft_error *err)
{
    switch (code) {
    case LIBRAW_FILE_UNSUPPORTED:
    case LIBRAW_NOT_IMPLEMENTED:
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: is not a raw file that LibRaw %s reads, or is cut short; convert it to DNG",
                         path, libraw_version());
    case LIBRAW_IO_ERROR:
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is cut short or cannot be read; copy it again", path);
    case LIBRAW_DATA_ERROR:
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: is damaged, or compressed in a way LibRaw %s does not know; copy it again or "
                         "convert it to uncompressed DNG",
                         path, libraw_version());
    case LIBRAW_UNSUFFICIENT_MEMORY:
    case LIBRAW_TOO_BIG:
    case LIBRAW_MEMPOOL_OVERFLOW:
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: its header asks for more memory than a frame can need",
                         path);
    default:
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: cannot be read: %s", path,
                         code > 0 ? strerror(code) : libraw_strerror(code));
    }
}

static weft_err no_bayer_plane(const char *path, const char *what, weft_error *err)
{
    return weft_fail(
        err, WEFT_ERR_FORMAT,
        "%s: %s; Weft needs a raw file with an RGB Bayer mosaic (or RGB pictures as PNG, TIFF, EXR)", path,
        what);
}

/* The colour filters as LibRaw sees them, of the visible area.  X-Trans, CMYG and sRAW end here. */
static weft_err read_cfa(libraw_data_t *raw, const char *path, weft_cfa *cfa, weft_error *err)
{
    if (!raw->rawdata.raw_image)
        return no_bayer_plane(path, "holds no mosaic (linear DNG, sRAW or RGB)", err);
    if (raw->idata.filters < 1000) /* 0 none, 1 Leaf, 9 X-Trans */
        return no_bayer_plane(path, "its colour filters are no 2 x 2 Bayer pattern", err);
    char name[5] = "";
    for (int i = 0; i < 8 * 2; i++) {
        const int row = i >> 1, column = i & 1;
        const int colour = libraw_COLOR(raw, row, column);
        const char letter = colour >= 0 && colour < 4 ? raw->idata.cdesc[colour] : '?';
        if (i < 4)
            name[i] = letter;
        else if (letter != name[(row & 1) * 2 + column])
            return no_bayer_plane(path, "its colour filters do not repeat after 2 rows", err);
    }
    if (!weft_cfa_from_name(name, cfa))
        return no_bayer_plane(path, "its colour filters are not red, green, green and blue", err);
    return WEFT_OK;
}

/* Black of one photosite: `black`, the colour's part and the repeating pattern's part.  The first two alone
 * are all 0 in a DNG whose BlackLevel is a 2 x 2 table. */
static unsigned site_black(libraw_data_t *raw, int row, int column)
{
    const libraw_colordata_t *const c = &raw->color;
    unsigned black = c->black + c->cblack[libraw_COLOR(raw, row, column)];
    if (c->cblack[4] && c->cblack[5])
        black += c->cblack[6 + (unsigned)row % c->cblack[4] * c->cblack[5] + (unsigned)column % c->cblack[5]];
    return black;
}

static weft_err read_levels(libraw_data_t *raw, const char *path, float black[4], float *white,
                            weft_error *err)
{
    const unsigned *const cblack = raw->color.cblack;
    const unsigned rows = cblack[4] ? cblack[4] : 1, columns = cblack[5] ? cblack[5] : 1;
    if ((uint64_t)rows * columns > LIBRAW_CBLACK_SIZE - 6)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is damaged: a table of %u x %u black levels", path, rows,
                         columns);
    for (unsigned y = 0; y < 2 * rows; y++)
        for (unsigned x = 0; x < 2 * columns; x++) {
            const float value = (float)site_black(raw, (int)y, (int)x);
            float *const site = &black[(y & 1) * 2 + (x & 1)];
            if (y < 2 && x < 2)
                *site = value;
            else if (*site != value)
                return weft_fail(err, WEFT_ERR_FORMAT,
                                 "%s: its black levels do not repeat after 2 x 2 pixels; convert it to DNG",
                                 path);
        }
    *white = (float)raw->color.maximum;
    for (int i = 0; i < 4; i++)
        if (*white <= black[i])
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: is damaged: white level %g is not above black %g",
                             path, (double)*white, (double)black[i]);
    return WEFT_OK;
}

static weft_err copy_visible(const libraw_data_t *raw, const char *path, weft_mosaic *mosaic, weft_error *err)
{
    const libraw_image_sizes_t *const s = &raw->sizes;
    const int width = s->width, height = s->height;
    if (width < 2 || height < 2 || s->left_margin + width > s->raw_width ||
        s->top_margin + height > s->raw_height || s->raw_pitch < 2u * s->raw_width)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is damaged: its visible area lies outside the sensor",
                         path);
    const weft_err status = weft_mosaic_init(mosaic, width, height, WEFT_CFA_NONE, err);
    if (status != WEFT_OK)
        return weft_prefix(err, status, "%s", path);
    const size_t pitch = s->raw_pitch / sizeof(uint16_t);
    for (int y = 0; y < height; y++, weft_mem_trim())
        memcpy(mosaic->data + (size_t)y * (size_t)width,
               raw->rawdata.raw_image + (size_t)(s->top_margin + y) * pitch + s->left_margin,
               (size_t)width * sizeof(uint16_t));
    return WEFT_OK;
}

static void copy_text(char *to, size_t size, const char *from)
{
    snprintf(to, size, "%s", from);
}

static double finite_or_0(float value)
{
    return isfinite(value) && value > 0 ? (double)value : 0;
}

static void read_info(const libraw_data_t *raw, weft_frame_info *info)
{
    *info = (weft_frame_info){.exposure_s = finite_or_0(raw->other.shutter),
                              .iso = finite_or_0(raw->other.iso_speed),
                              .f_number = finite_or_0(raw->other.aperture)};
    copy_text(info->make, sizeof info->make, raw->idata.make);
    copy_text(info->model, sizeof info->model, raw->idata.model);
    copy_text(info->serial, sizeof info->serial, raw->shootinginfo.BodySerial);
    struct tm local;
    if (raw->other.timestamp > 0 && localtime_r(&raw->other.timestamp, &local))
        strftime(info->date_time, sizeof info->date_time, "%Y:%m:%d %H:%M:%S", &local);
    const float *const gain = raw->color.cam_mul;
    if (gain[0] > 0 && gain[1] > 0 && gain[2] > 0)
        for (int i = 0; i < 3; i++)
            info->as_shot_neutral[i] = (double)gain[1] / (double)gain[i];
    for (int i = 0; i < 9; i++)
        info->xyz_to_camera[i] = (double)raw->color.dng_color[0].colormatrix[i / 3][i % 3];
}

static weft_err read_opened(libraw_data_t *raw, const char *path, const bool *damaged, weft_mosaic *mosaic,
                            weft_frame_info *info, weft_error *err)
{
    weft_cfa cfa;
    float black[4] = {0}, white = 0;
    const int code = libraw_unpack(raw);
    if (code != LIBRAW_SUCCESS)
        return libraw_failed(path, code, err);
    if (*damaged)
        return libraw_failed(path, LIBRAW_DATA_ERROR, err);
    WEFT_TRY(read_cfa(raw, path, &cfa, err));
    WEFT_TRY(read_levels(raw, path, black, &white, err));
    WEFT_TRY(copy_visible(raw, path, mosaic, err));
    mosaic->cfa = cfa;
    mosaic->white = white;
    memcpy(mosaic->black, black, sizeof black);
    if (info)
        read_info(raw, info);
    return WEFT_OK;
}

/* @param bytes  NULL: open the file `path` */
static weft_err read_raw(const char *path, const void *bytes, size_t n, weft_mosaic *mosaic,
                         weft_frame_info *info, weft_error *err)
{
    bool damaged = false;
    weft_mem_give_back(); /* LibRaw's copy of the frame is not ours to keep in a file */
    libraw_data_t *const raw = libraw_init(0);
    if (!raw)
        return weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for LibRaw", path);
    libraw_set_dataerror_handler(raw, on_damaged_data, &damaged); /* both print to stderr by default */
    libraw_set_memerror_handler(raw, on_no_memory, NULL);
    const int code = bytes
                         ? libraw_open_buffer(raw, (void *)(uintptr_t)bytes, n) /* which it does not change */
                         : libraw_open_file(raw, path);
    const weft_err status = code != LIBRAW_SUCCESS ? libraw_failed(path, code, err)
                                                   : read_opened(raw, path, &damaged, mosaic, info, err);
    libraw_close(raw);
    return status;
}

weft_err weft_raw_read(const char *path, weft_mosaic *mosaic, weft_frame_info *info, weft_error *err)
{
    uint64_t size;
    WEFT_TRY(weft_file_size(path, &size, err));
    WEFT_TRY(weft_dng_check_extent(path, err));
    return read_raw(path, NULL, 0, mosaic, info, err);
}

weft_err weft_raw_read_bytes(const char *name, const void *bytes, size_t n, weft_mosaic *mosaic,
                             weft_frame_info *info, weft_error *err)
{
    return read_raw(name, bytes, n, mosaic, info, err);
}
