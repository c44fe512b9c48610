#include "core/formats/png_file.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/mem_limit.h"

#include <png.h>
#include <stdio.h>
#include <stdlib.h>

/* Deflate cannot do better than 1032 to 1: a header that promises more pixels than that is damaged, and is
 * refused before memory is asked for. */
#define MAX_DEFLATE_RATIO 1032

/* What libpng's callbacks need, and what must survive its longjmp. */
typedef struct png_job {
    const char *path; /* as the user knows it */
    uint64_t size;    /* of the file that is read */
    FILE *file;
    png_structp png;
    png_infop info;
    png_bytep *rows;
    weft_raster raster;
    const weft_raster_note *note; /* to be written; NULL: none */
    weft_error *err;
    weft_err status; /* set before the longjmp */
    bool writing;
} png_job;

static void on_error(png_structp png, png_const_charp text)
{
    png_job *const job = png_get_error_ptr(png);
    if (job->status == WEFT_OK)
        job->status = job->writing
                          ? weft_fail(job->err, WEFT_ERR_IO, "%s: cannot be written: %s", job->path, text)
                          : weft_fail(job->err, WEFT_ERR_FORMAT, "%s: is a damaged PNG: %s", job->path, text);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp text)
{
    const png_job *const job = png_get_error_ptr(png);
    weft_explain("%s: %s", job->path, text);
}

static void on_read(png_structp png, png_bytep bytes, size_t n)
{
    const png_job *const job = png_get_io_ptr(png);
    if (fread(bytes, 1, n, job->file) != n)
        png_error(png, feof(job->file) ? "it is cut short" : "reading failed");
}

static void on_write(png_structp png, png_bytep bytes, size_t n)
{
    png_job *const job = png_get_io_ptr(png);
    if (fwrite(bytes, 1, n, job->file) == n)
        return;
    job->status =
        weft_fail_errno(job->err, WEFT_ERR_IO, "%s: cannot be written; is the disk full?", job->path);
    png_error(png, "write");
}

static void on_flush(png_structp png)
{
    (void)png; /* fclose does it */
}

static weft_err open_for_reading(png_job *job)
{
    uint8_t signature[8];
    WEFT_TRY(weft_file_size(job->path, &job->size, job->err));
    job->file = fopen(job->path, "rb");
    if (!job->file)
        return weft_fail_errno(job->err, WEFT_ERR_IO, "%s: cannot be opened", job->path);
    if (fread(signature, 1, 8, job->file) != 8 || png_sig_cmp(signature, 0, 8) != 0)
        return weft_fail(job->err, WEFT_ERR_FORMAT, "%s: is not a PNG file", job->path);
    return WEFT_OK;
}

static weft_err check_header(png_job *job, size_t bytes_per_row, png_uint_32 height)
{
    if ((double)bytes_per_row * height > (double)job->size * MAX_DEFLATE_RATIO)
        return weft_fail(job->err, WEFT_ERR_FORMAT,
                         "%s: is a damaged PNG: %ju bytes cannot hold the picture its header promises",
                         job->path, (uintmax_t)job->size);
    return WEFT_OK;
}

/* libpng fills rows of bytes; of 8-bit pictures they lie in the upper half of each raster row, from where
 * widening in place never overtakes what it still has to read. */
static void widen_rows(weft_raster *raster)
{
    const size_t n = (size_t)raster->width * (size_t)raster->channels;
    for (int y = 0; y < raster->height; y++) {
        uint16_t *const row = raster->data + (size_t)y * n;
        const uint8_t *const bytes = (const uint8_t *)row + n;
        for (size_t i = 0; i < n; i++) {
            const uint8_t value = bytes[i];
            row[i] = value;
        }
    }
}

/* All that may longjmp.  The job is not in registers, so its members survive. */
static void read_with_libpng(png_job *job)
{
    if (setjmp(png_jmpbuf(job->png)))
        return;
    png_set_read_fn(job->png, job, on_read);
    png_set_sig_bytes(job->png, 8);
    png_set_user_limits(job->png, WEFT_IMAGE_MAX_SIDE, WEFT_IMAGE_MAX_SIDE);
    png_read_info(job->png, job->info);
    const png_uint_32 width = png_get_image_width(job->png, job->info);
    const png_uint_32 height = png_get_image_height(job->png, job->info);
    job->status = check_header(job, png_get_rowbytes(job->png, job->info), height);
    if (job->status != WEFT_OK)
        return;
    png_set_expand(job->png);
    if (png_get_bit_depth(job->png, job->info) == 16)
        png_set_swap(job->png); /* the file is big-endian, we run on little-endian */
    png_set_interlace_handling(job->png);
    png_read_update_info(job->png, job->info);
    const int channels = png_get_channels(job->png, job->info);
    const int bits = png_get_bit_depth(job->png, job->info);
    job->status = weft_raster_init(&job->raster, (int)width, (int)height, channels, bits, job->err);
    if (job->status != WEFT_OK) {
        weft_prefix(job->err, job->status, "%s", job->path);
        return;
    }
    job->rows = weft_alloc(height, sizeof *job->rows, job->err);
    if (!job->rows) {
        job->status = WEFT_ERR_NOMEM;
        return;
    }
    const size_t n = (size_t)width * (size_t)channels;
    for (size_t y = 0; y < height; y++)
        job->rows[y] = (png_bytep)(job->raster.data + y * n) + (bits == 8 ? n : 0);
    png_read_image(job->png, job->rows);
    png_read_end(job->png, NULL);
    if (bits == 8)
        widen_rows(&job->raster);
}

weft_err weft_png_read(const char *path, weft_raster *raster, weft_error *err)
{
    png_job job = {.path = path, .err = err};
    weft_err status = open_for_reading(&job);
    if (status == WEFT_OK) {
        job.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
        job.info = job.png ? png_create_info_struct(job.png) : NULL;
        if (job.info)
            read_with_libpng(&job);
        else
            job.status = weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory for libpng", path);
        status = job.status;
    }
    if (job.png)
        png_destroy_read_struct(&job.png, &job.info, NULL);
    if (job.file)
        fclose(job.file);
    weft_free(job.rows);
    if (status == WEFT_OK)
        *raster = job.raster;
    else
        weft_raster_fini(&job.raster);
    return status;
}

/* Sixteen bits go out big-endian, eight bits as bytes; `line` holds one row of the file. */
static void fill_line(uint8_t *line, const uint16_t *row, size_t n, int bits)
{
    if (bits == 8) {
        for (size_t i = 0; i < n; i++)
            line[i] = (uint8_t)row[i];
        return;
    }
    for (size_t i = 0; i < n; i++) {
        line[2 * i] = (uint8_t)(row[i] >> 8);
        line[2 * i + 1] = (uint8_t)row[i];
    }
}

static void set_note(png_job *job, const weft_raster_note *n)
{
    png_text texts[2] = {{.compression = PNG_TEXT_COMPRESSION_NONE},
                         {.compression = PNG_TEXT_COMPRESSION_NONE}};
    int count = 0;
    if (n->icc)
        png_set_iCCP(job->png, job->info, "ICC profile", PNG_COMPRESSION_TYPE_BASE, n->icc,
                     (png_uint_32)n->icc_size);
    if (n->description) {
        texts[count].key = (png_charp) "Description";
        texts[count++].text = (png_charp)n->description;
    }
    if (n->software) {
        texts[count].key = (png_charp) "Software";
        texts[count++].text = (png_charp)n->software;
    }
    png_set_text(job->png, job->info, texts, count);
}

static void write_with_libpng(png_job *job, const weft_raster *raster, uint8_t *line)
{
    static const int colour_types[5] = {0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                        PNG_COLOR_TYPE_RGB_ALPHA};
    if (setjmp(png_jmpbuf(job->png)))
        return;
    png_set_write_fn(job->png, job, on_write, on_flush);
    png_set_user_limits(job->png, WEFT_IMAGE_MAX_SIDE, WEFT_IMAGE_MAX_SIDE);
    png_set_compression_level(job->png, 4); /* half the time of 6 for a few percent of size */
    png_set_IHDR(job->png, job->info, (png_uint_32)raster->width, (png_uint_32)raster->height, raster->bits,
                 colour_types[raster->channels], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    if (job->note)
        set_note(job, job->note);
    png_write_info(job->png, job->info);
    const size_t n = (size_t)raster->width * (size_t)raster->channels;
    for (int y = 0; y < raster->height; y++) {
        fill_line(line, raster->data + (size_t)y * n, n, raster->bits);
        png_write_row(job->png, line);
        weft_mem_trim();
    }
    png_write_end(job->png, job->info);
}

/* Writes to job->file, which stays open. */
static weft_err write_stream(png_job *job, const weft_raster *raster)
{
    uint8_t *const line = weft_alloc((size_t)raster->width * (size_t)raster->channels, 2, job->err);
    if (!line)
        return WEFT_ERR_NOMEM;
    job->png = png_create_write_struct(PNG_LIBPNG_VER_STRING, job, on_error, on_warning);
    job->info = job->png ? png_create_info_struct(job->png) : NULL;
    if (job->info)
        write_with_libpng(job, raster, line);
    else
        job->status = weft_fail(job->err, WEFT_ERR_NOMEM, "%s: no memory for libpng", job->path);
    if (job->png)
        png_destroy_write_struct(&job->png, &job->info);
    weft_free(line);
    return job->status;
}

weft_err weft_png_write(const char *path, const weft_raster *raster, weft_error *err)
{
    return weft_png_write_noted(path, raster, NULL, err);
}

weft_err weft_png_write_noted(const char *path, const weft_raster *raster, const weft_raster_note *note,
                              weft_error *err)
{
    weft_atomic a;
    WEFT_TRY(weft_atomic_file_begin(&a, path, err));
    png_job job = {.path = path, .err = err, .writing = true, .note = note};
    job.file = fopen(a.temp_path, "wb");
    weft_err status = job.file ? write_stream(&job, raster)
                               : weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be written", path);
    if (job.file && fclose(job.file) != 0 && status == WEFT_OK)
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be written; is the disk full?", path);
    if (status == WEFT_OK)
        return weft_atomic_commit(&a, err);
    weft_atomic_abort(&a);
    return status;
}

weft_err weft_png_encode(const weft_raster *raster, weft_text_buffer *out)
{
    char *bytes = NULL;
    size_t n = 0;
    png_job job = {.path = "a picture in memory", .err = &out->failure, .writing = true};
    if (out->failure.code != WEFT_OK)
        return out->failure.code;
    job.file = open_memstream(&bytes, &n);
    weft_err status = job.file ? write_stream(&job, raster)
                               : weft_fail(&out->failure, WEFT_ERR_NOMEM, "no memory for a picture");
    if (job.file && fclose(job.file) != 0 && status == WEFT_OK)
        status = weft_fail(&out->failure, WEFT_ERR_NOMEM, "no memory for a picture");
    if (status == WEFT_OK)
        weft_text_add_bytes(out, bytes, n);
    free(bytes); /* of open_memstream, not of core/mem.h */
    return weft_text_buffer_status(out, NULL);
}

weft_err weft_png_read_mask(const char *path, weft_mask *mask, weft_error *err)
{
    weft_raster raster;
    WEFT_TRY(weft_png_read(path, &raster, err));
    const weft_err status = weft_mask_init(mask, raster.width, raster.height, 0, err);
    if (status == WEFT_OK) {
        const size_t n = (size_t)raster.width * (size_t)raster.height, step = (size_t)raster.channels;
        for (size_t i = 0; i < n; i++) {
            const uint16_t *const pixel = raster.data + i * step;
            const bool inside = pixel[0] != 0 || (step >= 3 && (pixel[1] != 0 || pixel[2] != 0));
            mask->data[i] = inside ? 255 : 0;
        }
    }
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_png_write_mask(const char *path, const weft_mask *mask, weft_error *err)
{
    weft_raster raster;
    WEFT_TRY(weft_raster_init(&raster, mask->width, mask->height, 1, 8, err));
    const size_t n = (size_t)mask->width * (size_t)mask->height;
    for (size_t i = 0; i < n; i++) {
        raster.data[i] = mask->data[i] ? 255 : 0;
        if (i % 65536 == 0)
            weft_mem_trim();
    }
    const weft_err status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_png_read_bytes(const char *path, weft_mask *bytes, weft_error *err)
{
    weft_raster raster;
    WEFT_TRY(weft_png_read(path, &raster, err));
    weft_err status = WEFT_OK;
    if (raster.channels != 1 || raster.bits != 8)
        status = weft_fail(err, WEFT_ERR_FORMAT, "%s: has %d channels of %d bits, wanted one of 8", path,
                           raster.channels, raster.bits);
    if (status == WEFT_OK)
        status = weft_mask_init(bytes, raster.width, raster.height, 0, err);
    for (size_t i = 0; status == WEFT_OK && i < (size_t)raster.width * (size_t)raster.height; i++)
        bytes->data[i] = (uint8_t)raster.data[i];
    weft_raster_fini(&raster);
    return status;
}

weft_err weft_png_write_bytes(const char *path, const weft_mask *bytes, weft_error *err)
{
    weft_raster raster;
    WEFT_TRY(weft_raster_init(&raster, bytes->width, bytes->height, 1, 8, err));
    const size_t n = (size_t)bytes->width * (size_t)bytes->height;
    for (size_t i = 0; i < n; i++) {
        raster.data[i] = bytes->data[i];
        if (i % 65536 == 0)
            weft_mem_trim();
    }
    const weft_err status = weft_png_write(path, &raster, err);
    weft_raster_fini(&raster);
    return status;
}
