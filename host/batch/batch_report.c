/* What came of a batch: report.json, and report.html with everything inside. */
#include "host/batch/batch.h"

#include "core/file.h"
#include "core/formats/jpeg_bytes.h"
#include "core/formats/png_file.h"
#include "core/json.h"
#include "core/mem.h"
#include "core/plot/plot.h"
#include "core/text_buffer.h"
#include "core/version.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const state_words[] = {"not solved", "solved", "there already", "failed"};
static const char *const state_tags[] = {"wait", "good", "kept", "bad"};

/* ---- JSON ---- */

/* Size, share of answers and means from maps.json, times from the stamp. */
static void add_maps(json_t *to, const weft_batch *batch, const weft_batch_item *item)
{
    json_t *maps = NULL;
    char *const folder = weft_batch_maps_path(batch, item->name, NULL);
    char *const path = folder ? weft_path_join(folder, "maps.json", NULL) : NULL;
    if (path && weft_json_load_kind(path, "maps", 1000, &maps, NULL) == WEFT_OK) {
        const json_t *const result = json_object_get(maps, "result");
        static const char *const means[] = {"residual_mean", "confidence_mean", "uncertainty_deg_mean"};
        const double answered = json_number_value(json_object_get(result, "answered_px"));
        const double width = json_number_value(json_object_get(maps, "width"));
        const double height = json_number_value(json_object_get(maps, "height"));
        json_object_set(to, "width", json_object_get(maps, "width"));
        json_object_set(to, "height", json_object_get(maps, "height"));
        json_object_set(to, "mm_per_px", json_object_get(maps, "mm_per_px"));
        if (width * height > 0)
            json_object_set_new(to, "answered", json_real(answered / (width * height)));
        for (int i = 0; i < 3; i++)
            if (json_object_get(result, means[i]))
                json_object_set(to, means[i], json_object_get(result, means[i]));
    }
    static const char *const kept[] = {"begun", "finished", "seconds", "host", "software"};
    for (int i = 0; i < 5; i++)
        if (json_object_get(item->stamp, kept[i]))
            json_object_set(to, kept[i], json_object_get(item->stamp, kept[i]));
    json_object_set_new(to, "maps", json_string(folder));
    json_decref(maps);
    weft_free(path);
    weft_free(folder);
}

static json_t *item_json(const weft_batch *batch, const weft_batch_item *item)
{
    json_t *const object =
        json_pack("{s:s, s:s, s:s, s:s, s:i}", "name", item->name, "set", item->set, "state",
                  state_words[item->state], "key", item->key, "attempts", item->attempts);
    if (object && item->stamp)
        add_maps(object, batch, item);
    if (object && item->state == WEFT_BATCH_FAILED)
        json_object_set_new(object, "error", json_string(item->error));
    return object;
}

json_t *weft_batch_report(const weft_batch *batch, double seconds)
{
    char created[32];
    weft_time_now_iso(created);
    json_t *const options = json_array(), *const sets = json_array();
    for (int i = 0; i < batch->n_options; i++)
        json_array_append_new(options, json_string(batch->options[i]));
    for (int i = 0; i < batch->n_items; i++)
        json_array_append_new(sets, item_json(batch, &batch->items[i]));
    return json_pack("{s:s, s:i, s:s, s:s, s:s, s:s, s:o, s:f, s:{s:i, s:i, s:i, s:i}, s:o}", "weft",
                     "batch-report", "version", 1, "created", created, "software", "weft " WEFT_VERSION,
                     "folder", batch->folder, "calibration", batch->calibration, "options", options,
                     "seconds", seconds, "counts", "solved", weft_batch_count(batch, WEFT_BATCH_SOLVED),
                     "kept", weft_batch_count(batch, WEFT_BATCH_KEPT), "failed",
                     weft_batch_count(batch, WEFT_BATCH_FAILED), "waiting",
                     weft_batch_count(batch, WEFT_BATCH_WAITING), "sets", sets);
}

/* ---- pictures ---- */

enum { THUMB_WIDTH = 120 };

/* Means over blocks of an 8- or 16-bit picture as 8-bit RGB of THUMB_WIDTH columns. */
static uint8_t *shrink(const weft_raster *r, int *width, int *height)
{
    const int step = r->width > THUMB_WIDTH ? (r->width + THUMB_WIDTH - 1) / THUMB_WIDTH : 1;
    const int w = r->width / step, h = r->height / step > 0 ? r->height / step : 1;
    uint8_t *const rgb = weft_alloc(3 * (size_t)w * (size_t)h, 1, NULL);
    for (int i = 0; rgb && i < 3 * w * h; i++) {
        const int c = r->channels >= 3 ? i % 3 : 0, x = i / 3 % w, y = i / 3 / w;
        double sum = 0;
        int n = 0;
        for (int v = y * step; v < (y + 1) * step && v < r->height; v++)
            for (int u = x * step; u < (x + 1) * step; u++, n++)
                sum += r->data[((size_t)v * (size_t)r->width + (size_t)u) * (size_t)r->channels + (size_t)c];
        rgb[i] = (uint8_t)lround(255 * sum / (n * (double)((1 << r->bits) - 1)));
    }
    *width = w;
    *height = h;
    return rgb;
}

static void add_thumb(weft_text_buffer *page, const char *maps, const char *file)
{
    weft_raster raster = {0};
    unsigned char *bytes = NULL;
    size_t n = 0;
    int width = 0, height = 0;
    char *const path = weft_path_join(maps, file, NULL);
    if (path && weft_png_read(path, &raster, NULL) == WEFT_OK) {
        uint8_t *const rgb = shrink(&raster, &width, &height);
        if (rgb && weft_jpeg_encode(rgb, width, height, 80, &bytes, &n, NULL) == WEFT_OK) {
            weft_text_add(page, "<img alt=\"%s\" width=%d height=%d src=\"data:image/jpeg;base64,", file,
                          width, height);
            weft_text_add_base64(page, bytes, n);
            weft_text_add(page, "\">");
            weft_jpeg_free(bytes);
        }
        weft_free(rgb);
    }
    weft_raster_fini(&raster);
    weft_free(path);
}

/* ---- the page ---- */

static const char style[] =
    ":root{color-scheme:light dark}\n"
    "body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;max-width:1180px;padding:16px;color:#24292f;"
    "background:#fff}\n"
    "h1{font-size:24px;margin:8px 0}h2{font-size:19px;margin:28px 0 8px}svg{max-width:100%;height:auto}\n"
    ".soft{color:#57606a;font-size:13px}table{border-collapse:collapse;font-size:14px}\n"
    "th,td{text-align:left;padding:3px 12px 3px 0;vertical-align:middle}th{font-weight:600}\n"
    "th.n,td.n{text-align:right;font-variant-numeric:tabular-nums}tr+tr td{border-top:1px solid #d8dee4}\n"
    ".tag{display:inline-block;min-width:92px;text-align:center;border-radius:4px;color:#fff;font-size:13px}"
    "\n"
    ".good{background:#1a7f37}.kept{background:#57606a}.bad{background:#cf222e}.wait{background:#9a6700}\n"
    "td img{display:inline-block;margin-right:4px;vertical-align:middle}\n"
    "@media(prefers-color-scheme:dark){body{color:#e6edf3;background:#0d1117}tr+tr td{border-color:#30363d}"
    ".soft{color:#9ea7b3}}\n";

static void add_number(weft_text_buffer *page, const json_t *set, const char *key, double scale, int decimals)
{
    const json_t *const value = json_object_get(set, key);
    weft_text_add(page, "<td class=n>");
    if (json_is_number(value))
        weft_text_add(page, "%.*f", decimals, scale * json_number_value(value));
    weft_text_add(page, "</td>");
}

static void add_row(weft_text_buffer *page, const json_t *set, const weft_batch_item *item)
{
    const char *const maps = json_string_value(json_object_get(set, "maps"));
    weft_text_add(page, "<tr><td>");
    if (maps) {
        add_thumb(page, maps, "albedo.png");
        add_thumb(page, maps, "normal.png");
    }
    weft_text_add(page, "</td><td>");
    weft_text_add_escaped(page, item->name);
    weft_text_add(page, "</td><td><span class=\"tag %s\">%s</span></td>", state_tags[item->state],
                  state_words[item->state]);
    if (item->state == WEFT_BATCH_FAILED) {
        weft_text_add(page, "<td colspan=6>");
        weft_text_add_escaped(page, item->error);
        weft_text_add(page, "</td></tr>\n");
        return;
    }
    add_number(page, set, "width", 1, 0);
    add_number(page, set, "height", 1, 0);
    add_number(page, set, "answered", 100, 1);
    add_number(page, set, "residual_mean", 100, 2);
    add_number(page, set, "uncertainty_deg_mean", 1, 2);
    add_number(page, set, "seconds", 1, 1);
    weft_text_add(page, "</tr>\n");
}

/* One figure of every set as dots, so that the odd one is seen. */
static void add_dots(weft_text_buffer *page, const json_t *sets, const char *key, double scale,
                     const char *title, const char *unit)
{
    const int n = (int)json_array_size(sets);
    double most = 0;
    for (int i = 0; i < n; i++)
        most = fmax(most, scale * json_number_value(json_object_get(json_array_get(sets, (size_t)i), key)));
    if (!(most > 0))
        return;
    weft_plot plot;
    const weft_plot_spec spec = {
        .title = title, .x = {"set", 0, n + 1, false}, .y = {unit, 0, 1.08 * most, false}};
    weft_plot_begin(&plot, &spec, page);
    for (int i = 0; i < n; i++) {
        const json_t *const set = json_array_get(sets, (size_t)i);
        const json_t *const value = json_object_get(set, key);
        if (json_is_number(value))
            weft_plot_dot(&plot, 0, 3.5, i + 1, scale * json_number_value(value),
                          json_string_value(json_object_get(set, "name")));
    }
    weft_plot_end(&plot);
}

static void add_head(weft_text_buffer *page, const weft_batch *batch, const json_t *report)
{
    weft_text_add(
        page,
        "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\n<meta name=viewport "
        "content=\"width=device-width\">\n<title>Weft batch</title>\n<style>%s%s</style></head><body>\n"
        "<h1>Batch of %d sets</h1>\n<p><strong>%d solved, %d there already, %d failed, %d not "
        "solved</strong> in %.1f s</p>\n<p class=soft>",
        style, weft_plot_style(), batch->n_items, weft_batch_count(batch, WEFT_BATCH_SOLVED),
        weft_batch_count(batch, WEFT_BATCH_KEPT), weft_batch_count(batch, WEFT_BATCH_FAILED),
        weft_batch_count(batch, WEFT_BATCH_WAITING), json_number_value(json_object_get(report, "seconds")));
    weft_text_add_escaped(page, json_string_value(json_object_get(report, "software")));
    weft_text_add(page, ", %s, calibration ", json_string_value(json_object_get(report, "created")));
    weft_text_add_escaped(page, batch->calibration);
    for (int i = 0; i < batch->n_options; i++) {
        weft_text_add(page, ", ");
        weft_text_add_escaped(page, batch->options[i]);
    }
    weft_text_add(page, "</p>\n");
}

static weft_err write_page(const weft_batch *batch, const json_t *report, const char *path, weft_error *err)
{
    weft_text_buffer page = {0};
    const json_t *const sets = json_object_get(report, "sets");
    add_head(&page, batch, report);
    add_dots(&page, sets, "residual_mean", 100, "Residual", "%");
    add_dots(&page, sets, "seconds", 1, "Time", "s");
    weft_text_add(&page, "<h2>Sets</h2>\n<table><tr><th></th><th>set</th><th></th><th class=n>width</th><th "
                         "class=n>height</th>"
                         "<th class=n>answered, %%</th><th class=n>residual, %%</th><th class=n>uncertainty, "
                         "deg</th><th class=n>s</th></tr>\n");
    for (int i = 0; i < batch->n_items; i++)
        add_row(&page, json_array_get(sets, (size_t)i), &batch->items[i]);
    weft_text_add(&page, "</table>\n</body></html>\n");
    weft_err status = weft_text_buffer_status(&page, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, page.text, page.n, err);
    weft_text_buffer_fini(&page);
    return status;
}

weft_err weft_batch_report_save(const weft_batch *batch, const json_t *report, weft_error *err)
{
    char *const json = weft_path_join(batch->folder, "report.json", err);
    char *const page = weft_path_join(batch->folder, "report.html", err);
    weft_err status = WEFT_ERR_NOMEM;
    if (json && page)
        status = weft_json_save(json, report, err);
    if (status == WEFT_OK)
        status = write_page(batch, report, page, err);
    weft_free(json);
    weft_free(page);
    return status;
}
