#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/exr_words.h"
#include "core/mem.h"
#include "core/parallel.h"

#include <string.h>

enum { TILE = 128, SLOTS = 32 }; /* tiles compressed side by side before they are written in order */

typedef struct mip_writer {
    const weft_image *levels;
    const char *const *names;
    exr_pixel_type_t type;
    exr_context_t context;
    weft_exr_failure failure;
    int part, level, across, first; /* the level under way, its tiles in a row, the first of this round */
    exr_encode_pipeline_t pipes[SLOTS];
    bool started[SLOTS];
} mip_writer;

static exr_result_t write_header(mip_writer *w, int n_planes)
{
    exr_set_longname_support(w->context, 1);
    exr_result_t code = exr_add_part(w->context, NULL, EXR_STORAGE_TILED, &w->part);
    if (code == EXR_ERR_SUCCESS)
        code = exr_initialize_required_attr_simple(w->context, w->part, w->levels[0].width,
                                                   w->levels[0].height, EXR_COMPRESSION_ZIP);
    if (code == EXR_ERR_SUCCESS)
        code = exr_set_tile_descriptor(w->context, w->part, TILE, TILE, EXR_TILE_MIPMAP_LEVELS,
                                       EXR_TILE_ROUND_DOWN);
    for (int p = 0; p < n_planes && code == EXR_ERR_SUCCESS; p++)
        code = exr_add_channel(w->context, w->part, w->names[p], w->type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    if (code == EXR_ERR_SUCCESS)
        code = exr_set_zip_compression_level(w->context, w->part, 4);
    return code == EXR_ERR_SUCCESS ? exr_write_header(w->context) : code;
}

/* The library converts to half itself: tiles are small, and this is no inner loop. */
static void aim_source(const mip_writer *w, exr_encode_pipeline_t *pipe, int tile)
{
    const weft_image *const image = &w->levels[w->level];
    const size_t x = (size_t)(tile % w->across) * TILE;
    const int y = tile / w->across * TILE;
    for (int c = 0; c < pipe->channel_count; c++) {
        exr_coding_channel_info_t *const channel = &pipe->channels[c];
        int p = 0;
        while (strcmp(channel->channel_name, w->names[p]) != 0)
            p++;
        channel->encode_from_ptr = (const uint8_t *)(weft_image_row(image, p, y) + x);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_pixel_stride = sizeof(float);
        channel->user_line_stride = (int32_t)sizeof(float) * image->width;
    }
}

/* OpenEXRCore 3.1.5 cuts tiles at the border of level 0, whatever the level. */
static void correct_size(const mip_writer *w, int tile, exr_chunk_info_t *chunk)
{
    const weft_image *const image = &w->levels[w->level];
    const int width = image->width - tile % w->across * TILE,
              height = image->height - tile / w->across * TILE;
    chunk->width = width < TILE ? width : TILE;
    chunk->height = height < TILE ? height : TILE;
    chunk->unpacked_size = (uint64_t)chunk->width * (uint64_t)chunk->height * (uint64_t)image->planes *
                           (w->type == EXR_PIXEL_HALF ? 2 : 4);
}

static void encode_tile(void *context, int band, int row_begin, int row_end)
{
    mip_writer *const w = context;
    (void)row_begin, (void)row_end;
    const int tile = w->first + band;
    exr_encode_pipeline_t *const pipe = &w->pipes[band];
    exr_chunk_info_t chunk;
    exr_result_t code = exr_write_tile_chunk_info(w->context, w->part, tile % w->across, tile / w->across,
                                                  w->level, w->level, &chunk);
    correct_size(w, tile, &chunk);
    if (w->started[band]) /* begun anew: the next tile may have another size */
        exr_encoding_destroy(w->context, pipe);
    w->started[band] = false;
    if (code == EXR_ERR_SUCCESS) {
        code = exr_encoding_initialize(w->context, w->part, &chunk, pipe);
        w->started[band] = code == EXR_ERR_SUCCESS;
    }
    if (code == EXR_ERR_SUCCESS) {
        aim_source(w, pipe, tile);
        code = exr_encoding_choose_default_routines(w->context, w->part, pipe);
        pipe->yield_until_ready_fn = NULL;
        pipe->write_fn = NULL;
    }
    if (code == EXR_ERR_SUCCESS)
        code = exr_encoding_run(w->context, w->part, pipe);
    weft_exr_note(&w->failure, code);
}

static exr_result_t write_level(mip_writer *w, int level)
{
    const weft_image *const image = &w->levels[level];
    w->level = level;
    w->across = (image->width + TILE - 1) / TILE;
    const int n_tiles = w->across * ((image->height + TILE - 1) / TILE);
    for (w->first = 0; w->first < n_tiles; w->first += SLOTS) {
        const int n = n_tiles - w->first < SLOTS ? n_tiles - w->first : SLOTS;
        weft_parallel_rows(n * WEFT_BAND_ROWS, encode_tile, w);
        if (w->failure.code != EXR_ERR_SUCCESS)
            return w->failure.code;
        for (int slot = 0; slot < n; slot++) {
            const int tile = w->first + slot;
            const exr_result_t code =
                exr_write_tile_chunk(w->context, w->part, tile % w->across, tile / w->across, level, level,
                                     w->pipes[slot].compressed_buffer, w->pipes[slot].compressed_bytes);
            if (code != EXR_ERR_SUCCESS)
                return code;
        }
    }
    return EXR_ERR_SUCCESS;
}

weft_err weft_exr_write_mips(const char *path, const weft_image *levels, int n_levels,
                             const char *const *names, weft_exr_type type, weft_error *err)
{
    mip_writer *const w = weft_alloc(1, sizeof *w, err);
    weft_atomic a = {0};
    if (!w)
        return WEFT_ERR_NOMEM;
    w->levels = levels;
    w->names = names;
    w->type = type == WEFT_EXR_HALF ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    weft_err status = weft_atomic_file_begin(&a, path, err);
    if (status == WEFT_OK) {
        const exr_context_initializer_t init = weft_exr_initializer();
        weft_exr_note(&w->failure, exr_start_write(&w->context, a.temp_path, EXR_WRITE_FILE_DIRECTLY, &init));
        if (w->failure.code == EXR_ERR_SUCCESS)
            weft_exr_note(&w->failure, write_header(w, levels[0].planes));
        for (int level = 0; level < n_levels && w->failure.code == EXR_ERR_SUCCESS; level++)
            weft_exr_note(&w->failure, write_level(w, level));
        for (int slot = 0; slot < SLOTS; slot++)
            if (w->started[slot])
                exr_encoding_destroy(w->context, &w->pipes[slot]);
        if (w->context)
            weft_exr_note(&w->failure, exr_finish(&w->context));
        if (w->failure.code != EXR_ERR_SUCCESS)
            status = weft_fail(err, WEFT_ERR_IO, "%s: cannot be written: %s; is the disk full?", path,
                               weft_exr_words(&w->failure));
        if (status == WEFT_OK)
            status = weft_atomic_commit(&a, err);
        else
            weft_atomic_abort(&a);
    }
    weft_free(w);
    return status;
}
