#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/exr_words.h"
#include "core/formats/half.h"
#include "core/mem.h"
#include "core/parallel.h"

#include <string.h>

#define CHUNKS_AT_ONCE 16 /* chunks compressed side by side before they are written in order */

typedef struct exr_writer {
    const weft_image *image;
    const char *const *names;
    weft_exr_type type;
    exr_context_t context;
    weft_exr_failure failure;
    int part, lines, n_chunks, first_chunk;
    exr_encode_pipeline_t pipes[CHUNKS_AT_ONCE];
    bool started[CHUNKS_AT_ONCE];
    uint16_t *halves; /* [CHUNKS_AT_ONCE][planes][lines][width] for WEFT_EXR_HALF, else NULL */
} exr_writer;

static weft_err check_names(const char *path, const weft_image *image, const char *const *names,
                            weft_error *err)
{
    for (int p = 0; p < image->planes; p++) {
        const size_t n = strlen(names[p]);
        if (n < 1 || n > 255)
            return weft_fail(err, WEFT_ERR_RANGE, "%s: a channel name has 1 to 255 letters, not %zu", path,
                             n);
        for (int q = 0; q < p; q++)
            if (strcmp(names[p], names[q]) == 0)
                return weft_fail(err, WEFT_ERR_RANGE, "%s: the channel name %s is given twice", path,
                                 names[p]);
    }
    return WEFT_OK;
}

static exr_result_t write_header(exr_writer *w)
{
    const exr_pixel_type_t type = w->type == WEFT_EXR_HALF ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    exr_set_longname_support(w->context, 1);
    exr_result_t code = exr_add_part(w->context, NULL, EXR_STORAGE_SCANLINE, &w->part);
    if (code == EXR_ERR_SUCCESS)
        code = exr_initialize_required_attr_simple(w->context, w->part, w->image->width, w->image->height,
                                                   EXR_COMPRESSION_ZIP);
    for (int p = 0; p < w->image->planes && code == EXR_ERR_SUCCESS; p++)
        code = exr_add_channel(w->context, w->part, w->names[p], type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    if (code == EXR_ERR_SUCCESS)
        code = exr_set_zip_compression_level(w->context, w->part, 4); /* OpenEXR's default since 3.1.3 */
    if (code == EXR_ERR_SUCCESS)
        code = exr_write_header(w->context);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_scanlines_per_chunk(w->context, w->part, &w->lines);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_chunk_count(w->context, w->part, &w->n_chunks);
    return code;
}

/* Gives each channel of the pipeline its lines: the image's own floats, or their halves in `slot`. */
static void aim_source(exr_writer *w, exr_encode_pipeline_t *pipe, int slot, int y)
{
    const size_t width = (size_t)w->image->width;
    const size_t n = width * (size_t)pipe->chunk.height;
    for (int c = 0; c < pipe->channel_count; c++) {
        exr_coding_channel_info_t *const channel = &pipe->channels[c];
        int p = 0;
        while (strcmp(channel->channel_name, w->names[p]) != 0)
            p++;
        const float *const rows = weft_image_row(w->image, p, y);
        const void *source = rows;
        if (w->type == WEFT_EXR_HALF) {
            const size_t plane = (size_t)slot * (size_t)w->image->planes + (size_t)p;
            uint16_t *const halves = w->halves + plane * (size_t)w->lines * width;
            weft_half_from_float(halves, rows, n);
            source = halves;
        }
        const int32_t size = w->type == WEFT_EXR_HALF ? 2 : 4;
        channel->encode_from_ptr = source;
        channel->user_data_type = channel->data_type;
        channel->user_bytes_per_element = (int16_t)size;
        channel->user_pixel_stride = size;
        channel->user_line_stride = size * w->image->width;
    }
}

/* One chunk per band, compressed into the slot of that band; write_slots() puts them in the file. */
static void encode_chunk(void *context, int band, int row_begin, int row_end)
{
    exr_writer *const w = context;
    (void)row_begin, (void)row_end;
    const int y = (w->first_chunk + band) * w->lines;
    exr_encode_pipeline_t *const pipe = &w->pipes[band];
    exr_chunk_info_t chunk;
    exr_result_t code = exr_write_scanline_chunk_info(w->context, w->part, y, &chunk);
    if (code == EXR_ERR_SUCCESS && w->started[band])
        code = exr_encoding_update(w->context, w->part, &chunk, pipe);
    else if (code == EXR_ERR_SUCCESS) {
        code = exr_encoding_initialize(w->context, w->part, &chunk, pipe);
        w->started[band] = code == EXR_ERR_SUCCESS;
    }
    if (code == EXR_ERR_SUCCESS) {
        aim_source(w, pipe, band, y);
        code = exr_encoding_choose_default_routines(w->context, w->part, pipe);
        pipe->yield_until_ready_fn = NULL;
        pipe->write_fn = NULL;
    }
    if (code == EXR_ERR_SUCCESS)
        code = exr_encoding_run(w->context, w->part, pipe);
    weft_exr_note(&w->failure, code);
}

static exr_result_t write_chunks(exr_writer *w)
{
    for (w->first_chunk = 0; w->first_chunk < w->n_chunks; w->first_chunk += CHUNKS_AT_ONCE) {
        const int left = w->n_chunks - w->first_chunk;
        const int n = left < CHUNKS_AT_ONCE ? left : CHUNKS_AT_ONCE;
        weft_parallel_rows(n * WEFT_BAND_ROWS, encode_chunk, w);
        if (w->failure.code != EXR_ERR_SUCCESS)
            return w->failure.code;
        for (int slot = 0; slot < n; slot++) {
            const exr_encode_pipeline_t *const pipe = &w->pipes[slot];
            const exr_result_t code = exr_write_scanline_chunk(
                w->context, w->part, pipe->chunk.start_y, pipe->compressed_buffer, pipe->compressed_bytes);
            if (code != EXR_ERR_SUCCESS)
                return code;
        }
    }
    return EXR_ERR_SUCCESS;
}

/* The picture into an open file; `status` is ours, the result the library's. */
static exr_result_t write_picture(exr_writer *w, weft_err *status, weft_error *err)
{
    const exr_result_t code = write_header(w);
    if (code != EXR_ERR_SUCCESS)
        return code;
    if (w->type == WEFT_EXR_HALF) {
        const size_t n = (size_t)CHUNKS_AT_ONCE * (size_t)w->image->planes * (size_t)w->lines;
        w->halves = weft_alloc(n, (size_t)w->image->width * sizeof *w->halves, err);
        if (!w->halves) {
            *status = WEFT_ERR_NOMEM;
            return EXR_ERR_OUT_OF_MEMORY;
        }
    }
    return write_chunks(w);
}

weft_err weft_exr_write(const char *path, const weft_image *image, const char *const *names,
                        weft_exr_type type, weft_error *err)
{
    exr_writer w = {.image = image, .names = names, .type = type};
    weft_atomic a = {0};
    WEFT_TRY(check_names(path, image, names, err));
    WEFT_TRY(weft_atomic_file_begin(&a, path, err));
    weft_err status = WEFT_OK;
    const exr_context_initializer_t init = weft_exr_initializer();
    weft_exr_note(&w.failure, exr_start_write(&w.context, a.temp_path, EXR_WRITE_FILE_DIRECTLY, &init));
    if (w.failure.code == EXR_ERR_SUCCESS)
        weft_exr_note(&w.failure, write_picture(&w, &status, err));
    for (int slot = 0; slot < CHUNKS_AT_ONCE; slot++)
        if (w.started[slot])
            exr_encoding_destroy(w.context, &w.pipes[slot]);
    if (w.context)
        weft_exr_note(&w.failure, exr_finish(&w.context)); /* writes the table of offsets */
    weft_free(w.halves);
    if (status == WEFT_OK && w.failure.code != EXR_ERR_SUCCESS)
        status = weft_fail(err, WEFT_ERR_IO, "%s: cannot be written: %s; is the disk full?", path,
                           weft_exr_words(&w.failure));
    if (status == WEFT_OK)
        return weft_atomic_commit(&a, err);
    weft_atomic_abort(&a);
    return status;
}
