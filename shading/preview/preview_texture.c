#include "shading/preview/preview_texture.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "shading/preview/preview.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static int levels_of(int levels)
{
    return levels > 1 ? levels : 1;
}

int weft_preview_surface_levels(const weft_preview_surface *surface)
{
    int least = surface->normal ? levels_of(surface->normal_levels) : 0;
    for (int k = 0; k < weft_brdf_n_planes(surface->brdf); k++) {
        const weft_preview_map *const map = &surface->maps[k];
        if (map->image && (least == 0 || levels_of(map->levels) < least))
            least = levels_of(map->levels);
    }
    return least < WEFT_PREVIEW_MAX_LEVELS ? least : WEFT_PREVIEW_MAX_LEVELS;
}

/* Where a channel comes from: level 0 of a chain. */
typedef struct source {
    const weft_image *chain[WEFT_PREVIEW_MAX_CHANNELS];
    int plane[WEFT_PREVIEW_MAX_CHANNELS];
} source;

static void add_channel(weft_preview_texture *texture, source *from, const weft_image *chain, int image_plane,
                        int plane, double low, double high)
{
    const int c = texture->channels++;
    from->chain[c] = chain;
    from->plane[c] = image_plane;
    texture->plane[c] = plane;
    texture->scale[c] = (float)((high - low) / (plane < 0 ? 65534 : 65535));
    texture->offset[c] = plane < 0 ? 0 : (float)(low + 32768 * (high - low) / 65535);
}

static void list_channels(weft_preview_texture *texture, source *from, const weft_preview_surface *surface)
{
    int plane = 0;
    for (int c = 0; c < 3 && surface->normal; c++)
        add_channel(texture, from, surface->normal, c, -1 - c, -1, 1);
    for (const weft_brdf_param *p = surface->brdf->params; p->name; p++)
        for (int c = 0; c < p->components; c++, plane++)
            if (surface->maps[plane].image)
                add_channel(texture, from, surface->maps[plane].image, surface->maps[plane].plane, plane,
                            p->min, p->max);
    texture->stride = (texture->channels + 7) / 8 * 8;
}

typedef struct pack_job {
    const weft_preview_texture *texture;
    const source *from;
    int level;
    int16_t *to;
} pack_job;

static void pack_rows(void *context, int band, int row_begin, int row_end)
{
    const pack_job *const job = context;
    const weft_preview_texture *const t = job->texture;
    const int width = t->width[job->level], stride = t->stride;
    (void)band;
    for (int y = row_begin; y < row_end; y++)
        for (int c = 0; c < t->channels; c++) {
            const float *const row = weft_image_row(&job->from->chain[c][job->level], job->from->plane[c], y);
            int16_t *const to = job->to + (size_t)y * (size_t)width * (size_t)stride + c;
            const float inverse = 1 / t->scale[c], offset = t->offset[c];
            const float low = t->plane[c] < 0 ? -32767.0F : -32768.0F;
            for (int x = 0; x < width; x++) {
                const float q = (row[x] - offset) * inverse,
                            up = q > low ? q : low; /* NaN is the lower end */
                to[(size_t)x * (size_t)stride] = (int16_t)lrintf(up < 32767 ? up : 32767);
            }
        }
}

weft_err weft_preview_texture_init(weft_preview_texture *texture, const weft_preview_surface *surface,
                                   int first, weft_error *err)
{
    source from = {0};
    size_t total = 0;
    *texture = (weft_preview_texture){.levels = weft_preview_surface_levels(surface)};
    if (texture->levels == 0)
        return WEFT_OK;
    texture->first = first < 0 ? 0 : first < texture->levels ? first : texture->levels - 1;
    list_channels(texture, &from, surface);
    assert(from.chain[0]);
    for (int l = texture->first; l < texture->levels; l++) {
        texture->width[l] = from.chain[0][l].width;
        texture->height[l] = from.chain[0][l].height;
        total += (size_t)texture->width[l] * (size_t)texture->height[l] * (size_t)texture->stride;
    }
    texture->texels = weft_alloc(total, sizeof *texture->texels, err);
    if (!texture->texels)
        return WEFT_ERR_NOMEM;
    total = 0;
    for (int l = texture->first; l < texture->levels; l++) {
        texture->level[l] = texture->texels + total;
        weft_parallel_rows(texture->height[l], pack_rows,
                           &(pack_job){texture, &from, l, texture->texels + total});
        total += (size_t)texture->width[l] * (size_t)texture->height[l] * (size_t)texture->stride;
    }
    return WEFT_OK;
}

void weft_preview_texture_fini(weft_preview_texture *texture)
{
    weft_free(texture->texels);
    *texture = (weft_preview_texture){0};
}
