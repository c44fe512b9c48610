#include "core/formats/tiff_file.h"

#include "core/file.h"
#include "core/formats/tiff_open.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

/* No compression of libtiff packs pixels tighter (Zstandard comes nearest, on one colour): a header that
 * promises more is damaged, and is refused before memory is asked for. */
#define MAX_RATIO 20000

/* A picture is made of blocks: strips as wide as the picture, or tiles. */
typedef struct tiff_layout {
    uint32_t width, height;
    uint32_t block_width, block_height;
    uint16_t channels, bits, photometric;
    uint16_t per_block; /* channels in a block: all, or 1 when they lie in separate planes */
    bool tiled;
} tiff_layout;

static weft_err check_layout(const tiff_layout *l, const char *path, uint16_t format, weft_error *err)
{
    if (l->width < 1 || l->height < 1 || l->width > WEFT_IMAGE_MAX_SIDE || l->height > WEFT_IMAGE_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: a picture of %u x %u pixels is not possible", path,
                         l->width, l->height);
    if ((l->bits != 8 && l->bits != 16) || format != SAMPLEFORMAT_UINT)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: has %u-bit %s samples; only whole numbers of 8 or 16 bit are read (use EXR "
                         "for floating point)",
                         path, l->bits, format == SAMPLEFORMAT_IEEEFP ? "floating point" : "such");
    if (l->channels < 1 || l->channels > 4)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: has %u channels, wanted 1 to 4", path, l->channels);
    if (l->photometric != PHOTOMETRIC_MINISBLACK && l->photometric != PHOTOMETRIC_MINISWHITE &&
        l->photometric != PHOTOMETRIC_RGB && l->photometric != PHOTOMETRIC_CFA)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: is neither grey nor RGB (photometric interpretation %u); save it as RGB", path,
                         l->photometric);
    if (l->photometric == PHOTOMETRIC_RGB && l->channels < 3)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: calls itself RGB but has %u channels", path, l->channels);
    if (l->block_width < 1 || l->block_height < 1 || l->block_width > 2 * WEFT_IMAGE_MAX_SIDE ||
        l->block_height > 2 * WEFT_IMAGE_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: has impossible tiles of %u x %u pixels", path,
                         l->block_width, l->block_height);
    return WEFT_OK;
}

static weft_err read_layout(TIFF *tiff, const weft_tiff_log *log, tiff_layout *l, weft_error *err)
{
    uint16_t planar, format;
    *l = (tiff_layout){.tiled = TIFFIsTiled(tiff) != 0};
    if (!TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &l->width) ||
        !TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &l->height) ||
        !TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &l->photometric))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is a TIFF without a picture", log->path);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &l->bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &l->channels);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planar);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
    l->per_block = planar == PLANARCONFIG_SEPARATE ? 1 : l->channels;
    if (l->tiled) {
        if (!TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &l->block_width) ||
            !TIFFGetField(tiff, TIFFTAG_TILELENGTH, &l->block_height))
            return weft_tiff_damaged(log, err);
    } else {
        l->block_width = l->width;
        TIFFGetFieldDefaulted(tiff, TIFFTAG_ROWSPERSTRIP, &l->block_height);
        if (l->block_height > l->height) /* 2^32 - 1 stands for one strip */
            l->block_height = l->height;
    }
    return check_layout(l, log->path, format, err);
}

/* Copies the part of a block that lies inside the picture.  `block` holds the file's 8- or 16-bit samples. */
static void place_block(weft_raster *raster, const tiff_layout *l, const void *block, uint32_t x0,
                        uint32_t y0, uint32_t first_channel)
{
    const uint32_t w = l->width - x0 < l->block_width ? l->width - x0 : l->block_width;
    const uint32_t h = l->height - y0 < l->block_height ? l->height - y0 : l->block_height;
    const size_t line = (size_t)l->block_width * l->per_block;
    for (uint32_t y = 0; y < h; y++) {
        const uint8_t *const bytes = (const uint8_t *)block + y * line;
        const uint16_t *const words = (const uint16_t *)block + y * line;
        uint16_t *const row = raster->data + ((size_t)(y0 + y) * l->width + x0) * l->channels + first_channel;
        for (size_t x = 0; x < w; x++)
            for (size_t c = 0; c < l->per_block; c++) {
                const size_t i = x * l->per_block + c;
                row[x * l->channels + c] = l->bits == 8 ? bytes[i] : words[i];
            }
    }
}

static weft_err read_blocks(TIFF *tiff, const weft_tiff_log *log, const tiff_layout *l, weft_raster *raster,
                            weft_error *err)
{
    const size_t block_bytes = (size_t)l->block_width * l->block_height * l->per_block * (l->bits / 8);
    if (block_bytes != (size_t)(l->tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff)))
        return weft_tiff_damaged(log, err);
    void *const block = weft_alloc(block_bytes, 1, err);
    if (!block)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    for (uint16_t s = 0; s < l->channels && status == WEFT_OK; s = (uint16_t)(s + l->per_block))
        for (uint32_t y = 0; y < l->height && status == WEFT_OK; y += l->block_height)
            for (uint32_t x = 0; x < l->width && status == WEFT_OK; x += l->block_width) {
                const tmsize_t size = (tmsize_t)block_bytes;
                const uint32_t rows = l->height - y < l->block_height ? l->height - y : l->block_height;
                const tmsize_t least = l->tiled ? size : size / l->block_height * rows;
                const tmsize_t got =
                    l->tiled ? TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, x, y, 0, s), block, size)
                             : TIFFReadEncodedStrip(tiff, TIFFComputeStrip(tiff, y, s), block, size);
                if (got < least || log->failed)
                    status = weft_tiff_damaged(log, err);
                else
                    place_block(raster, l, block, x, y, s);
            }
    weft_free(block);
    return status;
}

static weft_err read_picture(TIFF *tiff, const weft_tiff_log *log, uint64_t file_size, weft_raster *raster,
                             weft_error *err)
{
    tiff_layout l;
    weft_raster made;
    WEFT_TRY(read_layout(tiff, log, &l, err));
    const int pixel_bytes = l.channels * (l.bits / 8);
    const double area = (double)l.block_width * l.block_height;
    const double n_blocks = ceil((double)l.width / l.block_width) * ceil((double)l.height / l.block_height);
    if ((double)file_size < area * n_blocks * pixel_bytes / MAX_RATIO ||
        (double)file_size < 2 * n_blocks) /* each has an entry in a table of offsets */
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: is a damaged TIFF: %ju bytes cannot hold the picture its header promises",
                         log->path, (uintmax_t)file_size);
    WEFT_TRY(weft_raster_init(&made, (int)l.width, (int)l.height, l.channels, l.bits, err));
    const weft_err status = read_blocks(tiff, log, &l, &made, err);
    if (status != WEFT_OK) {
        weft_raster_fini(&made);
        return status;
    }
    const size_t n = (size_t)l.width * l.height * l.channels;
    const uint16_t top = l.bits == 8 ? 255 : 65535;
    if (l.photometric == PHOTOMETRIC_MINISWHITE)
        for (size_t i = 0; i < n; i++)
            made.data[i] = (uint16_t)(top - made.data[i]);
    *raster = made;
    return WEFT_OK;
}

weft_err weft_tiff_read(const char *path, weft_raster *raster, weft_error *err)
{
    weft_tiff_log log = {.path = path};
    TIFF *tiff;
    uint64_t size;
    WEFT_TRY(weft_file_size(path, &size, err));
    WEFT_TRY(weft_tiff_open(&tiff, path, "r", &log, err));
    const weft_err status = read_picture(tiff, &log, size, raster, err);
    TIFFClose(tiff);
    return status;
}

/* Tags of a plain picture: deflate with differences of neighbours, which every reader knows. */
static bool set_tags(TIFF *tiff, const weft_raster *raster)
{
    const bool alpha = raster->channels == 2 || raster->channels == 4;
    const uint16_t extra[1] = {EXTRASAMPLE_UNASSALPHA};
    return TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, (uint32_t)raster->width) &&
           TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, (uint32_t)raster->height) &&
           TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, raster->bits) &&
           TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, raster->channels) &&
           TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
           TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC,
                        raster->channels < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB) &&
           (!alpha || TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, extra)) &&
           TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE) &&
           TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL) &&
           TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) &&
           TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff, 0));
}

/* libtiff encodes in place, so each row goes through `line`. */
static bool write_rows(TIFF *tiff, const weft_raster *raster, void *line)
{
    const size_t n = (size_t)raster->width * (size_t)raster->channels;
    for (int y = 0; y < raster->height; y++) {
        const uint16_t *const row = raster->data + (size_t)y * n;
        if (raster->bits == 16)
            memcpy(line, row, n * sizeof *row);
        else
            for (size_t i = 0; i < n; i++)
                ((uint8_t *)line)[i] = (uint8_t)row[i];
        if (TIFFWriteScanline(tiff, line, (uint32_t)y, 0) != 1)
            return false;
    }
    return true;
}

static bool set_text(TIFF *tiff, uint32_t tag, const char *text)
{
    return !text || !text[0] || TIFFSetField(tiff, tag, text);
}

static bool set_note(TIFF *tiff, const weft_raster_note *n)
{
    return !n || ((!n->icc || TIFFSetField(tiff, TIFFTAG_ICCPROFILE, (uint32_t)n->icc_size, n->icc)) &&
                  set_text(tiff, TIFFTAG_IMAGEDESCRIPTION, n->description) &&
                  set_text(tiff, TIFFTAG_SOFTWARE, n->software) && set_text(tiff, TIFFTAG_MAKE, n->make) &&
                  set_text(tiff, TIFFTAG_MODEL, n->model) && set_text(tiff, TIFFTAG_DATETIME, n->date_time));
}

weft_err weft_tiff_write(const char *path, const weft_raster *raster, weft_error *err)
{
    return weft_tiff_write_noted(path, raster, NULL, err);
}

weft_err weft_tiff_write_noted(const char *path, const weft_raster *raster, const weft_raster_note *note,
                               weft_error *err)
{
    weft_tiff_log log = {.path = path};
    weft_atomic a;
    TIFF *tiff = NULL;
    WEFT_TRY(weft_atomic_file_begin(&a, path, err));
    void *const line = weft_alloc((size_t)raster->width * (size_t)raster->channels, 2, err);
    weft_err status = line ? weft_tiff_open(&tiff, a.temp_path, "w", &log, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        if (!set_tags(tiff, raster) || !set_note(tiff, note) || !write_rows(tiff, raster, line) ||
            !TIFFFlush(tiff))
            log.failed = true;
        status = weft_tiff_close_written(tiff, &log, err);
    }
    weft_free(line);
    if (status == WEFT_OK)
        return weft_atomic_commit(&a, err);
    weft_atomic_abort(&a);
    return status;
}
