#include "shading/material/texture.h"

#include "core/file.h"
#include "core/formats/exr_file.h"
#include "core/formats/image_file.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "shading/material/asset.h"

#include <math.h>
#include <string.h>

const char *weft_place_text(weft_place place)
{
    static _Thread_local char text[4][512];
    static _Thread_local int next;
    int line, column;
    weft_place_position(place, &line, &column);
    char *const out = text[next++ % 4];
    (void)snprintf(out, sizeof text[0], "%s:%d:%d", place.source ? place.source->path : "built-in", line,
                   column);
    return out;
}

weft_err weft_texture_path(const weft_rad_value *name, char **path, weft_error *err)
{
    static const char *const endings[] = {"", ".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"};
    char *const folder = weft_path_folder(name->place.source->path, err);
    char *const stem =
        folder ? weft_path_join(strcmp(folder, ".") == 0 ? NULL : folder, name->text, err) : NULL;
    weft_free(folder);
    if (!stem)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_ERR_MISSING;
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        char *const one = weft_asprintf(err, "%s%s", stem, endings[i]);
        if (!one) {
            status = WEFT_ERR_NOMEM;
            break;
        }
        if (weft_file_exists(one)) {
            *path = one;
            weft_free(stem);
            return WEFT_OK;
        }
        weft_free(one);
    }
    if (status == WEFT_ERR_MISSING)
        weft_fail(err, status, "%s: there is no image %s (nor with .exr, .png, .tif, .jpg behind)",
                  weft_place_text(name->place), stem);
    weft_free(stem);
    return status;
}

/* EXR by channel names; everything else through image_file. */
static weft_err read_exr(const char *path, const char *channel, int planes, weft_image *image,
                         weft_error *err)
{
    static const char *const colour[] = {"R|X|Y", "G|Y", "B|Z|Y"};
    static const struct {
        const char *channel, *name;
    } single[] = {{"r", "R|X|Y"}, {"g", "G|Y"}, {"b", "B|Z"}, {"a", "A"}};
    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++)
        if (strcmp(channel, single[i].channel) == 0)
            return weft_exr_read(path, &single[i].name, 1, image, err);
    if (planes == 3)
        return weft_exr_read(path, colour, 3, image, err);
    static const char *const grey[] = {"Y|Z|R"};
    return weft_exr_read(path, grey, 1, image, err);
}

static weft_err keep_planes(weft_image *image, int wanted, int channel, weft_error *err)
{
    const size_t n = weft_image_plane_size(image);
    weft_image out;
    WEFT_TRY(weft_image_init(&out, image->width, image->height, wanted, err));
    for (int p = 0; p < wanted; p++) {
        const float *const from = weft_image_plane(image, image->planes == 1 ? 0
                                                          : channel >= 0     ? channel
                                                                             : p);
        memcpy(weft_image_plane(&out, p), from, n * sizeof *from);
    }
    if (wanted == 1 && channel < 0 && image->planes == 3)
        for (size_t i = 0; i < n; i++)
            out.data[i] = (image->data[i] + image->data[n + i] + image->data[2 * n + i]) / 3;
    weft_image_fini(image);
    *image = out;
    return WEFT_OK;
}

static void decode_normals(weft_image *image, bool is_coded, bool green_down)
{
    const size_t n = weft_image_plane_size(image);
    for (size_t i = 0; i < n; i++) {
        double v[3];
        for (int c = 0; c < 3; c++)
            v[c] = (double)image->data[(size_t)c * n + i] * (is_coded ? 2 : 1) - (is_coded ? 1 : 0);
        if (green_down)
            v[1] = -v[1];
        const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int c = 0; c < 3; c++)
            image->data[(size_t)c * n + i] = length > 0 && isfinite(length) ? (float)(v[c] / length) : c == 2;
    }
}

weft_err weft_texture_read(const weft_rad_record *record, weft_texture_use use, weft_image *image,
                           weft_error *err)
{
    const weft_rad_member *const name = weft_rad_at(record, "name");
    const char *const channel = weft_rad_text(record, "channel", "all");
    const char *const transfer = weft_rad_text(record, "transfer", "auto");
    const int planes = use == WEFT_TEXTURE_SCALAR ? 1 : 3;
    char *path;
    WEFT_TRY(weft_texture_path(name->value, &path, err));
    const bool is_exr = weft_path_has_suffix(path, ".exr");
    const bool is_srgb =
        strcmp(transfer, "srgb") == 0 || (strcmp(transfer, "auto") == 0 && use == WEFT_TEXTURE_COLOUR);
    weft_err status;
    if (is_exr)
        status = read_exr(path, channel, planes, image, err);
    else if (strcmp(channel, "a") == 0)
        status =
            weft_fail(err, WEFT_ERR_UNSUPPORTED, "%s: the alpha channel is read from .exr files only", path);
    else
        status = weft_image_read(path, is_srgb ? WEFT_TRANSFER_SRGB : WEFT_TRANSFER_LINEAR, image, err);
    weft_free(path);
    if (status != WEFT_OK)
        return weft_prefix(err, status, "%s", weft_place_text(name->value->place));
    if (image->planes != planes) {
        const char *const at = strchr("rgb", channel[0]);
        status = keep_planes(image, planes, channel[1] == '\0' && at ? (int)(at - "rgb") % 3 : -1, err);
        if (status != WEFT_OK) {
            weft_image_fini(image);
            return status;
        }
    }
    if (use == WEFT_TEXTURE_NORMAL) {
        decode_normals(image, !is_exr, strcmp(weft_rad_text(record, "green", "up"), "down") == 0);
        return WEFT_OK;
    }
    const float scale = (float)weft_rad_number(record, "scale", 1),
                offset = (float)weft_rad_number(record, "offset", 0);
    for (size_t i = 0; i < weft_image_plane_size(image) * (size_t)image->planes; i++)
        image->data[i] = isfinite(image->data[i]) ? image->data[i] * scale + offset : 0;
    return WEFT_OK;
}

typedef struct resample {
    const weft_image *from;
    weft_image *to;
    double step[2];
    int taps[2]; /* samples a texel, so that every texel of the source counts */
    bool unit;
} resample;

static float wrapped(const weft_image *image, int plane, double u, double v)
{
    const int w = image->width, h = image->height;
    const double fu = floor(u), fv = floor(v);
    const int x0 = (int)((long long)fu % w), y0 = (int)((long long)fv % h);
    const int xa = x0 < 0 ? x0 + w : x0, ya = y0 < 0 ? y0 + h : y0;
    const int xb = xa + 1 < w ? xa + 1 : 0, yb = ya + 1 < h ? ya + 1 : 0;
    const float s = (float)(u - fu), t = (float)(v - fv);
    const float *const a = weft_image_row(image, plane, ya), *const b = weft_image_row(image, plane, yb);
    const float top = a[xa] + s * (a[xb] - a[xa]), bottom = b[xa] + s * (b[xb] - b[xa]);
    return top + t * (bottom - top);
}

static void resample_rows(void *context, int band, int begin, int end)
{
    const resample *const r = context;
    const int planes = r->from->planes == 1 ? 1 : 3;
    (void)band;
    for (int y = begin; y < end; y++)
        for (int x = 0; x < r->to->width; x++) {
            double sum[3] = {0, 0, 0};
            for (int j = 0; j < r->taps[1]; j++)
                for (int i = 0; i < r->taps[0]; i++) {
                    const double u = (x + (i + 0.5) / r->taps[0]) * r->step[0] - 0.5;
                    const double v = (y + (j + 0.5) / r->taps[1]) * r->step[1] - 0.5;
                    for (int p = 0; p < planes; p++)
                        sum[p] += (double)wrapped(r->from, p, u, v);
                }
            double scale = 1.0 / (r->taps[0] * r->taps[1]);
            if (r->unit) {
                const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
                scale = length > 0 ? 1 / length : 0;
            }
            for (int p = 0; p < planes; p++)
                weft_image_row(r->to, p, y)[x] = (float)(sum[p] * scale);
        }
}

weft_err weft_texture_resample(const weft_image *image, weft_texture_use use, int w, int h,
                               const double tiling[2], weft_image *out, weft_error *err)
{
    WEFT_TRY(weft_image_init(out, w, h, image->planes, err));
    resample r = {.from = image, .to = out, .unit = use == WEFT_TEXTURE_NORMAL};
    const int size[2] = {image->width, image->height}, wanted[2] = {w, h};
    for (int k = 0; k < 2; k++) {
        r.step[k] = tiling[k] * size[k] / wanted[k];
        r.taps[k] = r.step[k] > 1 ? (int)ceil(r.step[k]) : 1;
    }
    weft_parallel_rows(h, resample_rows, &r);
    return WEFT_OK;
}
