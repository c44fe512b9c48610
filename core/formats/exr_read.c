#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/exr_words.h"
#include "core/mem.h"
#include "core/parallel.h"

#include <string.h>

static weft_err damaged(weft_error *err, const char *path, weft_exr_failure *failure, exr_result_t code)
{
    weft_exr_note(failure, code);
    if (failure->code == EXR_ERR_OUT_OF_MEMORY)
        return weft_fail(err, WEFT_ERR_NOMEM, "%s: no memory to read it", path);
    return weft_fail(err, WEFT_ERR_FORMAT, "%s: is a damaged or unknown EXR: %s", path,
                     weft_exr_words(failure));
}

typedef struct exr_reader {
    const char *path;
    uint64_t size; /* of the file, bytes */
    exr_context_t context;
    weft_exr_failure failure;
    int part, level; /* level: of mips */
    exr_storage_t storage;
    exr_attr_box2i_t window;
    int width, height;
    int tile_width, tile_height; /* a scan-line chunk is a tile as wide as the image */
    int n_across, n_chunks;
    exr_chunk_info_t *chunks; /* [n_chunks] */
    int n_planes;
    const char **channel_of; /* [n_planes] the file's channel that fills the plane */
    weft_image image;
} exr_reader;

static weft_err open_reader(exr_reader *r, const char *path, weft_error *err)
{
    r->path = path;
    WEFT_TRY(weft_file_size(path, &r->size, err));
    const exr_context_initializer_t init = weft_exr_initializer();
    const exr_result_t code = exr_start_read(&r->context, path, &init);
    return code == EXR_ERR_SUCCESS ? WEFT_OK : damaged(err, path, &r->failure, code);
}

static void close_reader(exr_reader *r)
{
    if (r->context)
        exr_finish(&r->context);
    weft_free(r->chunks);
    weft_free(r->channel_of);
    weft_image_fini(&r->image);
}

/* The channel of `list` that `wanted` ("X|R") takes, or NULL. */
static const exr_attr_chlist_entry_t *find_channel(const exr_attr_chlist_t *list, const char *wanted)
{
    while (*wanted) {
        const size_t n = strcspn(wanted, "|");
        for (int c = 0; c < list->num_channels; c++)
            if ((size_t)list->entries[c].name.length == n &&
                memcmp(list->entries[c].name.str, wanted, n) == 0)
                return &list->entries[c];
        wanted += n + (wanted[n] == '|');
    }
    return NULL;
}

static char *list_channels(const exr_attr_chlist_t *list, weft_error *err)
{
    char *text = weft_strdup("", err);
    for (int c = 0; text && c < list->num_channels; c++) {
        char *const longer = weft_asprintf(err, "%s%s%s", text, c ? "," : "", list->entries[c].name.str);
        weft_free(text);
        text = longer;
    }
    return text;
}

static weft_err missing_channel(const exr_reader *r, const char *wanted, weft_error *err)
{
    const exr_attr_chlist_t *list;
    if (exr_get_channels(r->context, 0, &list) != EXR_ERR_SUCCESS)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: lists no channels", r->path);
    char *const has = list_channels(list, err);
    if (!has)
        return WEFT_ERR_NOMEM;
    weft_fail(err, WEFT_ERR_MISSING, "%s: has no channel %s (it has %s)", r->path, wanted, has);
    weft_free(has);
    return WEFT_ERR_MISSING;
}

/* Takes the first part that has all channels. */
static weft_err choose_part(exr_reader *r, const char *const *names, int n, weft_error *err)
{
    int n_parts = 0;
    const char *lacking = names[0];
    exr_get_count(r->context, &n_parts);
    for (r->part = 0; r->part < n_parts; r->part++) {
        const exr_attr_chlist_t *list;
        int found = 0;
        if (exr_get_channels(r->context, r->part, &list) != EXR_ERR_SUCCESS)
            continue;
        for (; found < n; found++) {
            const exr_attr_chlist_entry_t *const entry = find_channel(list, names[found]);
            if (!entry)
                break;
            if (entry->x_sampling != 1 || entry->y_sampling != 1)
                return weft_fail(err, WEFT_ERR_FORMAT, "%s: channel %s is subsampled; store it at full size",
                                 r->path, entry->name.str);
            r->channel_of[found] = entry->name.str;
        }
        if (found == n)
            return WEFT_OK;
        if (r->part == 0)
            lacking = names[found];
    }
    return missing_channel(r, lacking, err);
}

static int count_levels(const exr_reader *r)
{
    int across = 1, down = 1;
    if (r->storage == EXR_STORAGE_TILED &&
        exr_get_tile_levels(r->context, r->part, &across, &down) != EXR_ERR_SUCCESS)
        return 1;
    return across < down ? across : down;
}

/* A smaller level in place of the whole picture. */
static weft_err choose_level(exr_reader *r, weft_error *err)
{
    const int levels = count_levels(r);
    int32_t width, height;
    if (r->level >= levels)
        return weft_fail(err, WEFT_ERR_MISSING, "%s: has no level %d of mips (it has %d)", r->path, r->level,
                         levels);
    if (exr_get_level_sizes(r->context, r->part, r->level, r->level, &width, &height) != EXR_ERR_SUCCESS ||
        width < 1 || height < 1 || width > r->width || height > r->height)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is a damaged EXR: level %d has no size", r->path,
                         r->level);
    r->width = width;
    r->height = height;
    return WEFT_OK;
}

static weft_err read_layout(exr_reader *r, weft_error *err)
{
    exr_result_t code = exr_get_storage(r->context, r->part, &r->storage);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_data_window(r->context, r->part, &r->window);
    if (code != EXR_ERR_SUCCESS)
        return damaged(err, r->path, &r->failure, code);
    if (r->storage != EXR_STORAGE_SCANLINE && r->storage != EXR_STORAGE_TILED)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: holds deep samples, wanted a flat image", r->path);
    const int64_t width = (int64_t)r->window.max.x - r->window.min.x + 1;
    const int64_t height = (int64_t)r->window.max.y - r->window.min.y + 1;
    if (width < 1 || height < 1 || width > WEFT_IMAGE_MAX_SIDE || height > WEFT_IMAGE_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: an image of %lld x %lld pixels is not possible", r->path,
                         (long long)width, (long long)height);
    r->width = (int)width;
    r->height = (int)height;
    if (r->level > 0)
        WEFT_TRY(choose_level(r, err));
    r->tile_width = r->width;
    if (r->storage == EXR_STORAGE_SCANLINE)
        code = exr_get_scanlines_per_chunk(r->context, r->part, &r->tile_height);
    else
        code = exr_get_tile_sizes(r->context, r->part, r->level, r->level, &r->tile_width, &r->tile_height);
    if (code != EXR_ERR_SUCCESS || r->tile_width < 1 || r->tile_height < 1)
        return damaged(err, r->path, &r->failure, code);
    r->n_across = (r->width + r->tile_width - 1) / r->tile_width;
    const int n_down = (r->height + r->tile_height - 1) / r->tile_height;
    if (__builtin_mul_overflow(r->n_across, n_down, &r->n_chunks))
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: has an impossible number of tiles", r->path);
    return WEFT_OK;
}

/* Finds every chunk before memory for the picture is asked for: a cut file ends here. */
static weft_err find_chunks(exr_reader *r, weft_error *err)
{
    if (r->size / 8 < (uint64_t)r->n_chunks) /* the offset table alone */
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: is cut short", r->path);
    r->chunks = weft_alloc((size_t)r->n_chunks, sizeof *r->chunks, err);
    if (!r->chunks)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < r->n_chunks; i++) {
        const int across = i % r->n_across, down = i / r->n_across;
        const exr_result_t code =
            r->storage == EXR_STORAGE_SCANLINE
                ? exr_read_scanline_chunk_info(r->context, r->part, r->window.min.y + down * r->tile_height,
                                               &r->chunks[i])
                : exr_read_tile_chunk_info(r->context, r->part, across, down, r->level, r->level,
                                           &r->chunks[i]);
        if (code != EXR_ERR_SUCCESS)
            return damaged(err, r->path, &r->failure, code);
        const int w = r->width - across * r->tile_width, h = r->height - down * r->tile_height;
        if (r->chunks[i].width > w || r->chunks[i].height > h || r->chunks[i].width < 1 ||
            r->chunks[i].height < 1)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: is a damaged EXR: chunk %d has a wrong size", r->path,
                             i);
    }
    return WEFT_OK;
}

/* Points the pipeline's channels into the planes; a plane whose channel came before is copied later.
 * Channels that nobody wants go to `spare`: OpenEXRCore 3.1.5 crashes in some of its fast paths when one is
 * left NULL. */
static void aim_channels(exr_reader *r, exr_decode_pipeline_t *pipe, int chunk, float *spare)
{
    const size_t x = (size_t)(chunk % r->n_across) * (size_t)r->tile_width;
    const int y = chunk / r->n_across * r->tile_height;
    for (int c = 0; c < pipe->channel_count; c++) {
        exr_coding_channel_info_t *const channel = &pipe->channels[c];
        channel->decode_to_ptr = NULL;
        for (int p = 0; p < r->n_planes && !channel->decode_to_ptr; p++)
            if (strcmp(channel->channel_name, r->channel_of[p]) == 0)
                channel->decode_to_ptr = (uint8_t *)(weft_image_row(&r->image, p, y) + x);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_pixel_stride = sizeof(float);
        channel->user_line_stride = (int32_t)sizeof(float) * r->width;
        if (!channel->decode_to_ptr) {
            channel->decode_to_ptr = (uint8_t *)spare;
            channel->user_line_stride = (int32_t)sizeof(float) * pipe->chunk.width;
        }
    }
}

/* One chunk per band; the library allocates its own scratch as well. */
static void decode_chunk(void *context, int band, int row_begin, int row_end)
{
    exr_reader *const r = context;
    (void)row_begin, (void)row_end;
    if (atomic_load(&r->failure.code) != EXR_ERR_SUCCESS)
        return;
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    const exr_chunk_info_t *const chunk = &r->chunks[band];
    float *const spare = weft_alloc((size_t)chunk->width * (size_t)chunk->height, sizeof *spare, NULL);
    exr_result_t code =
        spare ? exr_decoding_initialize(r->context, r->part, chunk, &pipe) : EXR_ERR_OUT_OF_MEMORY;
    if (code == EXR_ERR_SUCCESS) {
        aim_channels(r, &pipe, band, spare);
        code = exr_decoding_choose_default_routines(r->context, r->part, &pipe);
    }
    if (code == EXR_ERR_SUCCESS)
        code = exr_decoding_run(r->context, r->part, &pipe);
    exr_decoding_destroy(r->context, &pipe);
    weft_free(spare);
    weft_exr_note(&r->failure, code);
}

static void copy_repeated_planes(exr_reader *r)
{
    const size_t bytes = weft_image_plane_size(&r->image) * sizeof(float);
    for (int p = 1; p < r->n_planes; p++)
        for (int q = 0; q < p; q++)
            if (strcmp(r->channel_of[p], r->channel_of[q]) == 0) {
                memcpy(weft_image_plane(&r->image, p), weft_image_plane(&r->image, q), bytes);
                break;
            }
}

weft_err weft_exr_read_level(const char *path, const char *const *names, int n, int level, weft_image *image,
                             weft_error *err)
{
    exr_reader r = {.n_planes = n, .level = level};
    weft_err status = open_reader(&r, path, err);
    if (status != WEFT_OK)
        goto out;
    r.channel_of = weft_alloc((size_t)n, sizeof *r.channel_of, err);
    status = r.channel_of ? choose_part(&r, names, n, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = read_layout(&r, err);
    if (status == WEFT_OK)
        status = find_chunks(&r, err);
    if (status == WEFT_OK && (status = weft_image_init(&r.image, r.width, r.height, n, err)) != WEFT_OK)
        weft_prefix(err, status, "%s", path);
    if (status != WEFT_OK)
        goto out;
    weft_parallel_rows(r.n_chunks * WEFT_BAND_ROWS, decode_chunk, &r);
    if (r.failure.code != EXR_ERR_SUCCESS) {
        status = damaged(err, path, &r.failure, r.failure.code);
        goto out;
    }
    copy_repeated_planes(&r);
    *image = r.image;
    r.image = (weft_image){0};
out:
    close_reader(&r);
    return status;
}

weft_err weft_exr_read(const char *path, const char *const *names, int n, weft_image *image, weft_error *err)
{
    return weft_exr_read_level(path, names, n, 0, image, err);
}

weft_err weft_exr_levels(const char *path, int *levels, weft_error *err)
{
    exr_reader r = {0};
    const weft_err status = open_reader(&r, path, err);
    if (status == WEFT_OK) {
        exr_get_storage(r.context, 0, &r.storage);
        *levels = count_levels(&r);
    }
    close_reader(&r);
    return status;
}

weft_err weft_exr_channels(const char *path, char **names, weft_error *err)
{
    exr_reader r = {0};
    const exr_attr_chlist_t *list;
    weft_err status = open_reader(&r, path, err);
    if (status == WEFT_OK) {
        const exr_result_t code = exr_get_channels(r.context, 0, &list);
        char *const text = code == EXR_ERR_SUCCESS ? list_channels(list, err) : NULL;
        if (code != EXR_ERR_SUCCESS)
            status = damaged(err, path, &r.failure, code);
        else if (!text)
            status = WEFT_ERR_NOMEM;
        else
            *names = text;
    }
    close_reader(&r);
    return status;
}
