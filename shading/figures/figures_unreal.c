/* Figures of Real Shading in Unreal Engine 4: 4 (split sum), 10 and 12 (spherical light), 11 (widening). */
#include "shading/figures/figures.h"

#include "core/file.h"
#include "core/mem.h"
#include "core/plot/plot.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/sampling.h"
#include "shading/brdf/schlick_smith.h"
#include "shading/lighting/area_light.h"
#include "shading/lighting/environment_map.h"
#include "shading/lighting/environment_table.h"

#include <stdio.h>

enum { SIDE = 130, COLUMNS = 5, ROWS = 3 };

static const double up[3] = {0, 0, 1};

/* Draws and saves a grid: fn is called with the contexts, row by row. */
static weft_err save_grid(const char *folder, const char *name, weft_figure_fn *fn,
                          const void *const contexts[ROWS * COLUMNS], const char *const words[],
                          weft_tone tone, weft_error *err)
{
    weft_image pictures[ROWS * COLUMNS] = {0}, *each[ROWS * COLUMNS];
    weft_err status = WEFT_OK;
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        each[i] = &pictures[i];
        if (status == WEFT_OK)
            status = weft_figure_sphere(&pictures[i], SIDE, fn, contexts[i], err);
    }
    if (status == WEFT_OK)
        status = weft_figure_save(folder, name, COLUMNS, ROWS, each, words, tone, err);
    for (int i = 0; i < ROWS * COLUMNS; i++)
        weft_image_fini(&pictures[i]);
    return status;
}

/* ---- 4: light from all round ---- */

typedef struct all_round {
    const weft_environment_map *map;
    const weft_environment_table *table;
    double alpha, f0;
    int row; /* 0 reference, 1 split sum, 2 with n = v too */
} all_round;

/* A clear sky over a chequered ground, and a bright window beside: something to see mirrored. */
static weft_err paint_surroundings(weft_image *panorama, weft_error *err)
{
    WEFT_TRY(weft_environment_paint_sky(panorama, &weft_sky_cie_clear, 0.9, 0.6, err)); /* 512 x 256 */
    for (int row = 0; row < panorama->height; row++)
        for (int column = 0; column < panorama->width; column++) {
            const bool window =
                row > 75 && row < 115 && column > 165 && column < 210 && (column - 165) % 23 > 2;
            const bool ground = row >= panorama->height / 2, light = (row / 22 + column / 32) % 2 == 0;
            for (int c = 0; c < 3 && (ground || window); c++)
                weft_image_row(panorama, c, row)[column] = window  ? 6.0f
                                                           : light ? 0.5f - 0.12f * (float)c
                                                                   : 0.06f;
        }
    return WEFT_OK;
}

static void look(const weft_environment_map *map, const double d[3], double rgb[3])
{
    const double panorama[3] = {d[0], -d[2], d[1]}; /* its zenith is +Y; its middle is behind */
    weft_environment_map_look(map, panorama, 0, rgb);
}

/* A number in [0, 1) that differs from place to place: each of a pixel's nine sees other points. */
static double scatter(const double n[3])
{
    const double x = 43758.5453 * (12.9898 * n[0] + 78.233 * n[1]);
    return x - floor(x);
}

/* Sums over mirrored directions drawn from GGX: the reference, and the two factors of the split sum. */
static void sum_directions(const all_round *a, const double n[3], double reference[3], double filtered[3])
{
    enum { POINTS = 64 };
    const double k = weft_schlick_k_ggx(a->alpha), nv = weft_max(n[2], 1e-3);
    const double shift = scatter(n);
    double t[3], b[3], total = 0, sum[3] = {0};
    weft_figure_frame(n, t, b);
    for (int c = 0; c < 3; c++)
        reference[c] = 0;
    for (uint32_t i = 0; i < POINTS; i++) {
        double u[2], h[3], l[3], radiance[3];
        weft_hammersley(i, POINTS, u);
        u[0] = fmod(u[0] + shift, 1);
        const double nh = weft_sample_ggx_cosine(a->alpha, u[0]), side = sqrt(1 - nh * nh);
        const double phi = 2 * WEFT_PI * u[1];
        for (int c = 0; c < 3; c++)
            h[c] = side * cos(phi) * t[c] + side * sin(phi) * b[c] + nh * n[c];
        weft_reflect(up, h, l);
        const double nl = weft_figure_dot(n, l), vh = h[2];
        if (nl <= 0 || vh <= 0)
            continue;
        look(a->map, l, radiance);
        /* F G lh/(nh nv), with G = nl nv V */
        const double weight =
            weft_fresnel_schlick(a->f0, vh) * weft_schlick_v1(nl, k) * weft_schlick_v1(nv, k) * nl * vh / nh;
        total += nl;
        for (int c = 0; c < 3; c++) {
            reference[c] += weight * radiance[c] / POINTS;
            sum[c] += nl * radiance[c];
        }
    }
    for (int c = 0; c < 3; c++)
        filtered[c] = total > 0 ? sum[c] / total : 0;
}

static void shade_all_round(const void *context, const double n[3], double radiance[3])
{
    const all_round *const a = context;
    double filtered[3] = {0};
    if (a->row < 2)
        sum_directions(a, n, radiance, filtered);
    if (a->row == 0)
        return;
    if (a->row == 2) {
        const double r[3] = {2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - 1};
        const double panorama[3] = {r[0], -r[2], r[1]};
        weft_environment_map_look(a->map, panorama, sqrt(a->alpha), filtered);
    }
    const weft_environment_share share = weft_environment_table_at(a->table, n[2], a->alpha);
    for (int c = 0; c < 3; c++)
        radiance[c] = filtered[c] * (a->f0 * share.scale + share.bias);
}

weft_err weft_figure_unreal_4(const char *folder, weft_error *err)
{
    static const double roughness[COLUMNS] = {0.1, 0.3, 0.5, 0.7, 0.9};
    static const char *const rows[ROWS] = {"reference", "split sum", "and n = v"};
    static weft_environment_table table;
    weft_image panorama = {0};
    weft_environment_map map = {0};
    all_round each[ROWS * COLUMNS];
    const void *contexts[ROWS * COLUMNS];
    const char *words[ROWS * COLUMNS];
    char text[ROWS * COLUMNS][40];
    weft_err status = paint_surroundings(&panorama, err);
    if (status == WEFT_OK)
        status = weft_environment_map_init(&map, &panorama, err);
    if (status == WEFT_OK) {
        weft_environment_table_get(&table, WEFT_ENVIRONMENT_SCHLICK);
        for (int i = 0; i < ROWS * COLUMNS; i++) {
            const double r = roughness[i % COLUMNS];
            each[i] = (all_round){&map, &table, r * r, 0.95, i / COLUMNS};
            contexts[i] = &each[i];
            words[i] = text[i];
            snprintf(text[i], sizeof text[i], "%s %g", rows[i / COLUMNS], r);
        }
        status = save_grid(folder, "unreal-4.png", shade_all_round, contexts, words, WEFT_TONE_AGX, err);
    }
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
    return status;
}

/* ---- 10 and 12: a ball of light ---- */

typedef struct ball {
    double alpha;
    int row; /* 0 reference, 1 widened D, 2 representative point */
} ball;

static const double ball_centre[3] = {-1.1, 1.5, 2.4}, ball_radius = 0.5;

/* f n.l of GGX at F0 0.4; `wide` is alpha of D, masking keeps the material's. */
static double lobe(const double n[3], const double l[3], double alpha, double wide)
{
    double h[3] = {l[0], l[1], l[2] + 1}, nl = weft_figure_dot(n, l), nv = weft_max(n[2], WEFT_MIN_NV);
    if (nl <= 0)
        return 0;
    weft_figure_unit(h);
    const double nh = weft_figure_dot(n, h);
    const double cross[3] = {n[1] * h[2] - n[2] * h[1], n[2] * h[0] - n[0] * h[2], n[0] * h[1] - n[1] * h[0]};
    return weft_ggx_d(nh, weft_figure_dot(cross, cross), wide) * weft_ggx_v1(nl, alpha) *
           weft_ggx_v1(nv, alpha) * weft_fresnel_schlick(0.4, h[2]) * nl;
}

/* Mean of the lobe over the ball as seen from the place: a cone of even directions. */
static double over_ball(const double n[3], const double to[3], double alpha)
{
    enum { RINGS = 14, ARCS = 20 };
    double axis[3] = {to[0], to[1], to[2]}, t[3], b[3], sum = 0;
    const double distance = weft_figure_unit(axis), sine = ball_radius / distance;
    const double edge = sqrt(1 - sine * sine), shift = scatter(n);
    weft_figure_frame(axis, t, b);
    for (int i = 0; i < RINGS * ARCS; i++) {
        const int ring = i / ARCS, arc = i % ARCS;
        const double z = 1 - (1 - edge) * (ring + shift) / RINGS, s = sqrt(1 - z * z);
        const double phi = 2 * WEFT_PI * (arc + shift + 0.618034 * ring) / ARCS;
        double l[3];
        for (int c = 0; c < 3; c++)
            l[c] = s * cos(phi) * t[c] + s * sin(phi) * b[c] + z * axis[c];
        sum += lobe(n, l, alpha, alpha);
    }
    return sum / (RINGS * ARCS);
}

static void shade_ball(const void *context, const double n[3], double radiance[3])
{
    const ball *const m = context;
    double to[3], l[3], value;
    for (int c = 0; c < 3; c++)
        l[c] = to[c] = ball_centre[c] - n[c];
    const double distance = weft_figure_unit(l);
    if (m->row == 0) {
        value = over_ball(n, to, m->alpha);
    } else if (m->row == 1) {
        value = lobe(n, l, m->alpha, weft_light_widened_alpha(m->alpha, ball_radius, distance));
    } else {
        const double r[3] = {2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - 1};
        const weft_light_point p = weft_light_sphere(to, r, ball_radius, m->alpha);
        value = p.norm * lobe(n, p.l, m->alpha, m->alpha);
    }
    for (int c = 0; c < 3; c++)
        radiance[c] = 2.5 * WEFT_PI * value / (distance * distance);
}

weft_err weft_figure_unreal_10(const char *folder, weft_error *err)
{
    static const double alphas[COLUMNS] = {0.03, 0.08, 0.16, 0.36, 0.64};
    static const char *const rows[ROWS] = {"reference", "wider D", "one point"};
    ball each[ROWS * COLUMNS];
    const void *contexts[ROWS * COLUMNS];
    const char *words[ROWS * COLUMNS];
    char text[ROWS * COLUMNS][40];
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        each[i] = (ball){alphas[i % COLUMNS], i / COLUMNS};
        contexts[i] = &each[i];
        words[i] = text[i];
        snprintf(text[i], sizeof text[i], "%s %g", rows[i / COLUMNS], each[i].alpha);
    }
    return save_grid(folder, "unreal-10.png", shade_ball, contexts, words, WEFT_TONE_AGX, err);
}

/* ---- 11: how a representative point widens a lobe ---- */

weft_err weft_figure_unreal_11(const char *folder, weft_error *err)
{
    enum { N = 361 };
    const double power = 40, half_size = 15 * WEFT_PI / 180, norm = (power + 2) / (2 * WEFT_PI);
    double deg[N], point[N], wide[N];
    weft_text_buffer out = {0};
    weft_plot plot;
    char *const path = weft_path_join(folder, "unreal-11.svg", err);
    if (!path)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < N; i++) {
        deg[i] = -90 + 180.0 * i / (N - 1);
        const double phi = fabs(deg[i]) * WEFT_PI / 180;
        point[i] = norm * pow(weft_max(cos(phi), 0), power);
        wide[i] = phi < half_size ? norm : norm * pow(weft_max(cos(phi - half_size), 0), power);
    }
    weft_plot_begin(
        &plot,
        &(weft_plot_spec){.title = "A lobe of power 40, and as a ball of half size 15 degrees widens it",
                          .width = 560,
                          .x = {"angle between mirrored view and light, degrees", -90, 90, false},
                          .y = {"intensity, 1/sr", 0, 1.15 * norm, false},
                          .legend_rows = 1,
                          .standalone = true},
        &out);
    weft_plot_line(&plot, 0, N, deg, point, "point (eq. 12)");
    weft_plot_line(&plot, 1, N, deg, wide, "sphere (eq. 13)");
    weft_plot_end(&plot);
    weft_err status = weft_text_buffer_status(&out, err);
    if (status == WEFT_OK)
        status = weft_file_write(path, out.text, out.n, err);
    if (status == WEFT_OK)
        printf("%s\n", path);
    weft_text_buffer_fini(&out);
    weft_free(path);
    return status;
}
