#include "host/cli/brdf_plot.h"

#include "core/file.h"
#include "core/formats/image_file.h"
#include "core/plot/plot.h"
#include "shading/brdf/albedo.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/sampling.h"

#include <math.h>
#include <stdio.h>

enum { LOBE_POINTS = 721, N_LOBES = 4, SLICE = 256 };

const double weft_furnace_nv[WEFT_FURNACE_VIEWS] = {0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1};

static const double lobe_deg[N_LOBES] = {0, 30, 60, 80};

/* f (n.l), green, for the light at `light_rad` from the normal on the other side of the view. */
static double lobe_at(const weft_brdf *brdf, const double *values, double view_rad, double light_rad)
{
    const double v[3] = {-sin(view_rad), 0, cos(view_rad)}, l[3] = {sin(light_rad), 0, cos(light_rad)};
    double f[3];
    weft_brdf_eval_one(brdf, values, l, v, f);
    return l[2] > 0 ? f[1] * l[2] : 0;
}

static double light_angle(int i)
{
    return WEFT_PI * (i / (LOBE_POINTS - 1.0) - 0.5);
}

static weft_err plot_lobes(const weft_brdf *brdf, const double *values, const char *path, weft_error *err)
{
    weft_text_buffer out = {0};
    weft_plot plot;
    double most = 1e-12;
    char title[160];
    for (int k = 0; k < N_LOBES; k++)
        for (int i = 0; i < LOBE_POINTS; i++)
            most = fmax(most, lobe_at(brdf, values, lobe_deg[k] * WEFT_PI / 180, light_angle(i)));
    snprintf(title, sizeof title, "%s: f cos, cube root; the outer circle is %.3g / sr", brdf->name, most);
    weft_plot_begin(&plot,
                    &(weft_plot_spec){.title = title,
                                      .width = 560,
                                      .height = 380,
                                      .x = {NULL, -1.05, 1.05, false},
                                      .y = {NULL, -0.05, 1.05, false},
                                      .same_scale = true,
                                      .no_ticks = true,
                                      .legend_rows = 1,
                                      .standalone = true},
                    &out);
    for (int decade = 0; decade < 4; decade++)
        weft_plot_circle(&plot, 7, 0, 0, cbrt(pow(10, -decade)));
    for (int k = 0; k < N_LOBES; k++) {
        double x[LOBE_POINTS], y[LOBE_POINTS];
        const double view = lobe_deg[k] * WEFT_PI / 180;
        char words[32];
        for (int i = 0; i < LOBE_POINTS; i++) {
            const double r = cbrt(lobe_at(brdf, values, view, light_angle(i)) / most);
            x[i] = r * sin(light_angle(i));
            y[i] = r * cos(light_angle(i));
        }
        snprintf(words, sizeof words, "view %g deg", lobe_deg[k]);
        weft_plot_line(&plot, k, LOBE_POINTS, x, y, words);
        weft_plot_stroke(&plot, k, -1.04 * sin(view), 1.04 * cos(view), -0.94 * sin(view), 0.94 * cos(view),
                         true);
    }
    weft_plot_end(&plot);
    weft_err status = weft_text_buffer_status(&out, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    weft_text_buffer_fini(&out);
    return status;
}

static weft_err plot_slice(const weft_brdf *brdf, const double *values, const char *path, weft_error *err)
{
    weft_image slice;
    WEFT_TRY(weft_image_init(&slice, SLICE, SLICE, 3, err));
    for (int y = 0; y < SLICE; y++)
        for (int x = 0; x < SLICE; x++) {
            const double th = (x + 0.5) / SLICE * WEFT_PI / 2, td = (SLICE - y - 0.5) / SLICE * WEFT_PI / 2;
            /* phi_d 90 degrees: light and view lie across the plane of n and h, on both sides of it */
            const double l[3] = {sin(th) * cos(td), sin(td), cos(th) * cos(td)};
            const double v[3] = {l[0], -l[1], l[2]};
            double f[3];
            weft_brdf_eval_one(brdf, values, l, v, f);
            for (int c = 0; c < 3; c++)
                weft_image_row(&slice, c, y)[x] = (float)(WEFT_PI * f[c]);
        }
    const weft_err status = weft_image_write(path, &slice, 8, WEFT_TRANSFER_SRGB, err);
    weft_image_fini(&slice);
    return status;
}

weft_err weft_brdf_plot(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], const char *path,
                        weft_error *err)
{
    if (weft_path_has_suffix(path, ".svg"))
        return plot_lobes(brdf, values, path, err);
    if (weft_path_has_suffix(path, ".png") || weft_path_has_suffix(path, ".exr"))
        return plot_slice(brdf, values, path, err);
    return weft_fail(err, WEFT_ERR_USAGE,
                     "--plot wants NAME.svg for lobes, or NAME.png or NAME.exr for a slice, not %s", path);
}

void weft_brdf_furnace(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                       double albedo[WEFT_FURNACE_VIEWS][3])
{
    for (int i = 0; i < WEFT_FURNACE_VIEWS; i++)
        weft_brdf_albedo(brdf, values, weft_furnace_nv[i], 0, WEFT_ALBEDO_QUICK, albedo[i]);
}

double weft_brdf_reciprocity(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], int n)
{
    double worst = 0;
    for (int i = 0; i < n; i++) {
        double u[2], l[3], v[3], there[3], back[3];
        weft_hammersley((uint32_t)i, (uint32_t)n, u);
        weft_brdf_direction(1e-3 + 0.999 * u[0], 2.399963229728653 * i, l);
        weft_brdf_direction(1e-3 + 0.999 * u[1], 5.1 * i, v);
        weft_brdf_eval_one(brdf, values, l, v, there);
        weft_brdf_eval_one(brdf, values, v, l, back);
        for (int c = 0; c < 3; c++) {
            const double larger = fmax(there[c], back[c]);
            worst = larger > 0 ? fmax(worst, fabs(there[c] - back[c]) / larger) : worst;
        }
    }
    return worst;
}
