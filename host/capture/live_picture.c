#include "host/capture/live_picture.h"

#include "core/formats/jpeg_bytes.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/report_channel.h"

#include <math.h>

#define MIN_PERIOD_S 0.2
#define QUALITY      80

weft_err weft_live_stats_make(const weft_mosaic *m, weft_live_stats *stats, weft_error *err)
{
    double sums[3] = {0};
    uint64_t n[3] = {0}, clipped[3] = {0};
    if (m->cfa == WEFT_CFA_NONE)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED, "a picture without a filter array is not shown");
    *stats = (weft_live_stats){0};
    for (int v = 0; v < m->height; v++) {
        const uint16_t *const row = m->data + (size_t)v * (size_t)m->width;
        for (int site = 0; site < 2; site++) {
            const int colour = weft_cfa_colour(m->cfa, site, v);
            const float black = m->black[(v & 1) * 2 + site], scale = WEFT_LIVE_BINS / (m->white - black);
            uint32_t *const bins = stats->bins[colour];
            double sum = 0;
            for (int u = site; u < m->width; u += 2) {
                const float value = ((float)row[u] - black) * scale;
                const int bin = value <= 0 ? 0 : value >= WEFT_LIVE_BINS ? WEFT_LIVE_BINS - 1 : (int)value;
                bins[bin]++;
                sum += (double)value;
                clipped[colour] += (float)row[u] >= m->white;
            }
            sums[colour] += sum / WEFT_LIVE_BINS;
            n[colour] += (uint64_t)((m->width - site + 1) / 2);
        }
    }
    for (int c = 0; c < 3; c++) {
        stats->mean[c] = n[c] ? sums[c] / (double)n[c] : 0;
        stats->clipped[c] = n[c] ? (double)clipped[c] / (double)n[c] : 0;
    }
    return WEFT_OK;
}

/* sRGB code of a linear value, by a table of 4096 steps. */
static void fill_srgb(uint8_t table[4097])
{
    for (int i = 0; i <= 4096; i++) {
        const double x = i / 4096.0;
        const double coded = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
        table[i] = (uint8_t)lround(255 * coded);
    }
}

/* Mean of each colour over the cells [v0, v0 + 2 step) x [u0, u0 + 2 step), less black. */
static void average(const weft_mosaic *m, int u0, int v0, int step, float out[3])
{
    float sums[3] = {0}, n[3] = {0};
    for (int v = v0; v < v0 + 2 * step; v++)
        for (int u = u0; u < u0 + 2 * step; u++) {
            const int colour = weft_cfa_colour(m->cfa, u, v);
            sums[colour] +=
                (float)m->data[(size_t)v * (size_t)m->width + (size_t)u] - m->black[(v & 1) * 2 + (u & 1)];
            n[colour] += 1;
        }
    for (int c = 0; c < 3; c++)
        out[c] = sums[c] / n[c];
}

weft_err weft_live_picture_make(const weft_mosaic *m, const weft_live_stats *stats, uint8_t **rgb, int *width,
                                int *height, weft_error *err)
{
    uint8_t srgb[4097];
    float gain[3];
    const int longest = m->width > m->height ? m->width : m->height;
    const int step = (longest + 2 * WEFT_LIVE_SIDE - 1) / (2 * WEFT_LIVE_SIDE);
    const int w = m->width / (2 * step), h = m->height / (2 * step);
    uint8_t *const out = w > 0 && h > 0 ? weft_alloc((size_t)w * (size_t)h, 3, err) : NULL;
    if (!out)
        return w > 0 && h > 0 ? WEFT_ERR_NOMEM
                              : weft_fail(err, WEFT_ERR_RANGE, "the frame is too small to show");
    fill_srgb(srgb);
    for (int c = 0; c < 3; c++) {
        const double balance = stats->mean[c] > 0 && stats->mean[1] > 0 ? stats->mean[1] / stats->mean[c] : 1;
        gain[c] = (float)(4096 * fmin(fmax(balance, 0.25), 4)) / (m->white - m->black[0]);
    }
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            float mean[3];
            average(m, 2 * step * x, 2 * step * y, step, mean);
            for (int c = 0; c < 3; c++) {
                const float value = mean[c] * gain[c];
                out[3 * ((size_t)y * (size_t)w + (size_t)x) + (size_t)c] = srgb[value <= 0      ? 0
                                                                                : value >= 4096 ? 4096
                                                                                                : (int)value];
            }
        }
    *rgb = out;
    *width = w;
    *height = h;
    return WEFT_OK;
}

static json_t *describe(const char *name, const weft_mosaic *m, const weft_live_stats *s, int width,
                        int height)
{
    static const char *const colours[] = {"red", "green", "blue"};
    json_t *const histogram = json_object();
    for (int c = 0; c < 3; c++) {
        json_t *const bins = json_array();
        for (int i = 0; i < WEFT_LIVE_BINS; i++)
            json_array_append_new(bins, json_integer(s->bins[c][i]));
        json_object_set_new(histogram, colours[c], bins);
    }
    return json_pack("{s:{s:s, s:i, s:i, s:[i,i], s:[f,f,f], s:[f,f,f], s:o}}", "picture", "name", name,
                     "width", width, "height", height, "frame", m->width, m->height, "mean", s->mean[0],
                     s->mean[1], s->mean[2], "clipped", s->clipped[0], s->clipped[1], s->clipped[2],
                     "histogram", histogram);
}

static weft_err report(const char *name, const weft_mosaic *mosaic, weft_error *err)
{
    weft_live_stats *const stats = weft_alloc(1, sizeof *stats, err);
    uint8_t *rgb = NULL;
    unsigned char *bytes = NULL;
    int width = 0, height = 0;
    size_t n = 0;
    weft_err status = stats ? weft_live_stats_make(mosaic, stats, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_live_picture_make(mosaic, stats, &rgb, &width, &height, err);
    if (status == WEFT_OK)
        status = weft_jpeg_encode(rgb, width, height, QUALITY, &bytes, &n, err);
    if (status == WEFT_OK) {
        weft_report_send_picture(describe(name, mosaic, stats, width, height), bytes, n);
        weft_jpeg_free(bytes);
    }
    weft_free(rgb);
    weft_free(stats);
    return status;
}

void weft_live_picture_report(const char *name, const weft_mosaic *mosaic)
{
    static double reported_s = -1;
    weft_error error = {0};
    const double now_s = weft_clock_s();
    if (!weft_report_active() || (reported_s >= 0 && now_s - reported_s < MIN_PERIOD_S))
        return;
    reported_s = now_s;
    if (report(name, mosaic, &error) != WEFT_OK)
        weft_explain("live picture: %s", error.text);
}
