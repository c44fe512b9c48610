/* A level of a picture at a size that a format asks for, a few texels larger than its own. */
#include "shading/export/channels.h"

#include "core/colour.h"
#include "core/mem.h"
#include "core/parallel.h"

#include <math.h>

/* Four texels along a side and their shares of one between the middle two. */
typedef struct taps {
    int at[4];
    float share[4];
} taps;

/* Keys 1981 with a = -1/2, which keeps straight lines and parabolas. */
static void cubic_shares(float t, float share[4])
{
    share[0] = 0.5F * t * (-1 + t * (2 - t));
    share[1] = 1 + 0.5F * t * t * (3 * t - 5);
    share[2] = 0.5F * t * (1 + t * (4 - 3 * t));
    share[3] = 0.5F * t * t * (t - 1);
}

/* For each of `to` texels along a side of `from`. */
static taps *make_taps(int from, int to, bool wraps, weft_error *err)
{
    taps *const all = weft_alloc((size_t)to, sizeof *all, err);
    for (int x = 0; all && x < to; x++) {
        const double u = (x + 0.5) * from / to - 0.5, below = floor(u);
        cubic_shares((float)(u - below), all[x].share);
        for (int k = 0; k < 4; k++) {
            const int at = (int)below - 1 + k;
            const int wrapped = (at % from + from) % from, nearest = at < 0 ? 0 : at < from ? at : from - 1;
            all[x].at[k] = wraps ? wrapped : nearest;
        }
    }
    return all;
}

typedef struct resize {
    const weft_image *from;
    const taps *across, *down; /* [to->width], [to->height] */
    bool srgb;
    weft_raster *to;
} resize;

static void resize_rows(void *context, int band, int begin, int end)
{
    const resize *const r = context;
    const int n = r->to->channels, width = r->to->width;
    const float top = (float)((1 << r->to->bits) - 1);
    (void)band;
    for (int y = begin; y < end; y++)
        for (int c = 0; c < n; c++) {
            const taps *const down = &r->down[y];
            const float *rows[4];
            for (int j = 0; j < 4; j++)
                rows[j] = weft_image_row(r->from, c, down->at[j]);
            uint16_t *const out = r->to->data + (size_t)y * (size_t)width * (size_t)n + (size_t)c;
            for (int x = 0; x < width; x++) {
                const taps *const across = &r->across[x];
                float v = 0;
                for (int j = 0; j < 4; j++)
                    for (int i = 0; i < 4; i++)
                        v += down->share[j] * across->share[i] * rows[j][across->at[i]];
                v = fminf(fmaxf(v, 0), 1);
                if (r->srgb && c < 3)
                    v = (float)weft_srgb_encode((double)v);
                out[(size_t)x * (size_t)n] = (uint16_t)(v * top + 0.5F);
            }
        }
}

static weft_err resized(const weft_image *planes, const weft_baked *baked, const weft_channels *channels,
                        int width, int height, weft_raster *raster, weft_error *err)
{
    taps *const across = make_taps(planes->width, width, baked->periodic, err);
    taps *const down = across ? make_taps(planes->height, height, baked->periodic, err) : NULL;
    weft_err status =
        down ? weft_raster_init(raster, width, height, planes->planes, channels->bits, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        resize r = {planes, across, down, channels->srgb, raster};
        weft_parallel_rows(height, resize_rows, &r);
    }
    weft_free(down);
    weft_free(across);
    return status;
}

weft_err weft_channels_raster_sized(const weft_baked *baked, const weft_channels *channels, int level,
                                    int width, int height, weft_raster *raster, weft_error *err)
{
    const int last = weft_baked_levels(baked->width, baked->height) - 1, shown = level < last ? level : last;
    const int w = baked->width >> shown, h = baked->height >> shown;
    if ((w > 0 ? w : 1) == width && (h > 0 ? h : 1) == height)
        return weft_channels_raster(baked, channels, shown, raster, err);
    weft_image planes;
    WEFT_TRY(weft_channels_planes(baked, channels, shown, &planes, err));
    const weft_err status = resized(&planes, baked, channels, width, height, raster, err);
    weft_image_fini(&planes);
    return status;
}
