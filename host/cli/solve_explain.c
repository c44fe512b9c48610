#include "host/cli/solve_explain.h"

#include "core/file.h"
#include "core/json.h"
#include "core/plot/plot.h"
#include "host/solve/explain.h"

#include <math.h>
#include <string.h>

static const double degrees = 57.29577951308232;

static double elevation_deg(const weft_explained_light *l)
{
    return degrees * asin(fmax(-1, fmin(1, l->direction[2])));
}

static double azimuth_deg(const weft_explained_light *l)
{
    const double a = degrees * atan2(l->direction[1], l->direction[0]);
    return a < 0 ? a + 360 : a;
}

/* Of n . l. */
static double cosine(const weft_explanation *e, const weft_explained_light *l)
{
    return e->normal[0] * l->direction[0] + e->normal[1] * l->direction[1] + e->normal[2] * l->direction[2];
}

static double off_sigmas(const weft_explained_light *l)
{
    return l->sigma > 0 ? (l->value - l->mirror - l->fit) / l->sigma : 0;
}

/* ---- words ---- */

static void print_pixel(FILE *out, const weft_set *set, const weft_explanation *e)
{
    static const char *const colours[] = {"red", "green", "blue"};
    fprintf(out, "%s, pixel %d,%d of the %s", set->name, e->x, e->y, e->plane ? "plane" : "sensor");
    if (e->plane)
        fprintf(out, " of %.4g mm: pixel %d,%d of the sensor", e->mm_per_px, e->column, e->row);
    if (e->colour >= 0)
        fprintf(out, ", a %s photosite", colours[e->colour]);
    if (e->has_world)
        fprintf(out, ", at %.2f,%.2f mm", e->world_mm[0], e->world_mm[1]);
    fprintf(out, "%s\n", e->inside ? "" : ", outside the set's mask");
}

static void print_answer(FILE *out, const weft_explanation *e)
{
    fprintf(out, "method %s: %s\n", e->method,
            !e->valid     ? "no answer: the lights that can be used do not fix a normal"
            : e->searched ? "the samples contradict a matte surface; the lights that agree were searched for"
            : e->glossy   ? "with the cloth's mirror light taken off"
                          : "least squares over the samples used");
    if (e->glossy)
        fprintf(out, "mirror light: strength %.4f, roughness %.3f along and %.3f across the fibres\n",
                (double)e->gloss.strength, (double)e->gloss.alpha_along, (double)e->gloss.alpha_across);
    if (!e->valid)
        return;
    fprintf(out, "normal %.4f %.4f %.4f (leans %.2f degrees), albedo", e->normal[0], e->normal[1],
            e->normal[2], degrees * atan2(hypot(e->normal[0], e->normal[1]), e->normal[2]));
    for (int c = 0; c < (e->colour >= 0 ? 1 : 3); c++)
        fprintf(out, " %.4f", e->albedo[c]);
    fprintf(out,
            "\n%d of %d lights, residual %.2f %%, expected error %.2f degrees, confidence %.3f%s%s%s%s\n",
            e->n_used, e->n_lights, 100 * e->residual, e->uncertainty_deg, e->confidence,
            e->quality & WEFT_QUALITY_CLIPPED ? ", clipped" : "",
            e->quality & WEFT_QUALITY_SHADOWED ? ", shadowed" : "",
            e->quality & WEFT_QUALITY_ILL_CONDITIONED ? ", ill-conditioned" : "",
            e->quality & WEFT_QUALITY_NOT_LAMBERTIAN ? ", not Lambertian" : "");
}

static void print_lights(FILE *out, const weft_explanation *e)
{
    fprintf(out, "%5s %7s %9s %7s %8s %8s %8s %7s %9s\n", "light", "azimuth", "elevation", "sensor", "value",
            e->glossy ? "mirror" : "", "fit", "sigmas", "deg per %");
    for (int j = 0; j < e->n_lights; j++) {
        const weft_explained_light *const l = &e->lights[j];
        char mirror[16] = "";
        if (e->glossy)
            snprintf(mirror, sizeof mirror, "%.4f", l->mirror);
        fprintf(out, "%5d %7.1f %9.1f %5.1f %% %8.4f %8s %8.4f %+7.1f %9.3f  %s\n", j, azimuth_deg(l),
                elevation_deg(l), 100 * l->full_scale, l->value, mirror, l->fit, off_sigmas(l),
                l->influence_deg, weft_explain_why_name(l->why));
    }
}

/* ---- JSON ---- */

static json_t *light_json(const weft_explanation *e, int j)
{
    const weft_explained_light *const l = &e->lights[j];
    return json_pack("{s:i, s:o, s:f, s:f, s:f, s:f, s:f, s:f, s:f, s:b, s:s}", "light", j, "direction",
                     weft_json_numbers(l->direction, 3), "full_scale", l->full_scale, "value", l->value,
                     "mirror", l->mirror, "fit", l->fit, "sigma", l->sigma, "off_sigmas", off_sigmas(l),
                     "influence_deg_per_percent", l->influence_deg, "used", l->why == WEFT_EXPLAIN_USED,
                     "why", weft_explain_why_name(l->why));
}

static json_t *explanation_json(const weft_set *set, const weft_explanation *e)
{
    json_t *const lights = json_array();
    for (int j = 0; j < e->n_lights; j++)
        json_array_append_new(lights, light_json(e, j));
    json_t *const object = json_pack(
        "{s:s, s:[i,i], s:s, s:[i,i], s:i, s:s, s:b, s:b, s:b, s:b, s:o, s:o, s:f, s:f, s:f, s:i, s:i, s:o}",
        "set", set->folder, "pixel", e->x, e->y, "geometry", e->plane ? "plane" : "sensor", "sensor_px",
        e->column, e->row, "colour", e->colour, "method", e->method, "answered", e->valid, "searched",
        e->searched, "glossy", e->glossy, "inside", e->inside, "normal", weft_json_numbers(e->normal, 3),
        "albedo", weft_json_numbers(e->albedo, e->colour >= 0 ? 1 : 3), "residual", e->residual, "confidence",
        e->confidence, "uncertainty_deg", e->uncertainty_deg, "n_used", e->n_used, "quality", (int)e->quality,
        "lights", lights);
    if (object && e->has_world)
        json_object_set_new(object, "world_mm", weft_json_numbers(e->world_mm, 2));
    return object;
}

/* ---- plot: samples over the cosine, which a matte surface puts on a line through the origin ---- */

static void plot_lights(weft_plot *plot, const weft_explanation *e)
{
    for (int j = 0; j < e->n_lights; j++) {
        const weft_explained_light *const l = &e->lights[j];
        const double x = cosine(e, l), y = l->value - l->mirror;
        const bool used = l->why == WEFT_EXPLAIN_USED;
        char words[128], number[16];
        snprintf(words, sizeof words, "light %d: %s, %+.1f sigmas", j, weft_explain_why_name(l->why),
                 off_sigmas(l));
        snprintf(number, sizeof number, "%d", j);
        if (l->mirror > 0)
            weft_plot_stroke(plot, 3, x, l->value, x, y, true);
        weft_plot_stroke(plot, used ? 0 : 1, x, y - l->sigma, x, y + l->sigma, false);
        weft_plot_dot(plot, used ? 0 : 1, used ? 4.5 : 3.5, x, y, words);
        weft_plot_words(plot, x, y, 6, j & 1 ? 12 : -4, number);
    }
}

static weft_err write_plot(const char *path, const weft_set *set, const weft_explanation *e, weft_error *err)
{
    weft_text_buffer svg = {0};
    weft_plot plot;
    double top = 0, k = 0;
    char title[160];
    for (int j = 0; j < e->n_lights; j++) {
        top = fmax(top, fmax(e->lights[j].value, e->lights[j].fit) + e->lights[j].sigma);
        if (cosine(e, &e->lights[j]) > 0.05)
            k = e->lights[j].fit / cosine(e, &e->lights[j]);
    }
    snprintf(title, sizeof title, "%.100s, pixel %d,%d", set->name, e->x, e->y);
    const weft_plot_spec spec = {
        .title = title,
        .width = 560,
        .height = 400,
        .x = {"cosine between normal and light", -0.15, 1.03, false},
        .y = {"reflected over incident light", fmin(-0.06 * top, -1e-6), fmax(1.08 * top, 1e-6), false},
        .legend_rows = 1,
        .standalone = true};
    weft_plot_begin(&plot, &spec, &svg);
    weft_plot_line(&plot, 2, 2, (double[]){0, 1}, (double[]){0, k}, "matte surface");
    weft_plot_dots(&plot, 0, 0.1, 1, (double[]){-9}, (double[]){-9}, "used");
    weft_plot_dots(&plot, 1, 0.1, 1, (double[]){-9}, (double[]){-9}, "left out");
    if (e->glossy)
        weft_plot_line(&plot, 3, 2, (double[]){-9, -8}, (double[]){-9, -9}, "mirror light");
    plot_lights(&plot, e);
    weft_plot_end(&plot);
    weft_err status = weft_text_buffer_status(&svg, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, svg.text, svg.n, err);
    weft_text_buffer_fini(&svg);
    return status;
}

/* ---- all ---- */

weft_err weft_print_explanation(const weft_invocation *inv, const char *set_folder,
                                const weft_calibration *cal, const char *cal_folder,
                                const weft_solve_options *options, const weft_numbers *xy, const char *plot,
                                weft_error *err)
{
    weft_set set;
    weft_explanation e;
    if (xy->n != 2 || fabs(xy->values[0]) > 1e6 || fabs(xy->values[1]) > 1e6 ||
        xy->values[0] != floor(xy->values[0]) || xy->values[1] != floor(xy->values[1]))
        return weft_fail(err, WEFT_ERR_USAGE, "--explain wants column and row of a pixel, as 300,200");
    if (plot)
        WEFT_TRY(weft_file_refuse_existing(plot, inv->force, err));
    WEFT_TRY(weft_set_load(set_folder, &set, err));
    weft_err status =
        weft_solve_explain(&set, cal, cal_folder, options, (int)xy->values[0], (int)xy->values[1], &e, err);
    if (status == WEFT_OK && plot)
        status = write_plot(plot, &set, &e, err);
    if (status == WEFT_OK && inv->json)
        status = weft_print_json(inv, explanation_json(&set, &e), err);
    else if (status == WEFT_OK) {
        print_pixel(inv->out, &set, &e);
        print_answer(inv->out, &e);
        print_lights(inv->out, &e);
    }
    weft_set_fini(&set);
    return status;
}
