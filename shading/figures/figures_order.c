/* The Order: 1886, figure 1 (masking of views below the horizon) and figure 2 (skin under a light probe). */
#include "shading/figures/figures.h"

#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/half_vector.h"
#include "shading/lighting/spherical_harmonics.h"
#include "shading/preview/sheet.h"
#include "shading/skin/skin.h"

#include <stdbool.h>

/* ---- 1 ---- */

typedef struct bumpy {
    bool cut; /* G is 0 where n.v <= 0 */
} bumpy;

/* The sphere's normal, turned by bumps as a normal map would: without moving the surface. */
static void bump(const double at[3], double n[3])
{
    static const double waves[][3] = {{13, 5, 3}, {-4, 14, 6}, {6, -7, 13}, {-11, -9, 8}, {9, 12, -10}};
    double slope[3] = {0};
    for (size_t k = 0; k < sizeof waves / sizeof waves[0]; k++) {
        const double swing = 0.35 * cos(weft_figure_dot(waves[k], at) + (double)k);
        for (int c = 0; c < 3; c++)
            slope[c] += swing * waves[k][c] / 14;
    }
    const double along = weft_figure_dot(slope, at);
    for (int c = 0; c < 3; c++)
        n[c] = at[c] - (slope[c] - along * at[c]);
    weft_figure_unit(n);
}

static void shade_bumpy(const void *context, const double at[3], double radiance[3])
{
    static const double light[3] = {0.78, 0.6, -0.178};
    const bumpy *const b = context;
    const double alpha = 0.3;
    double n[3], h[3] = {light[0], light[1], light[2] + 1};
    bump(at, n);
    weft_figure_unit(h);
    const double nl = weft_figure_dot(n, light), nv = n[2], nh = weft_max(weft_figure_dot(n, h), 0);
    const double shape =
        weft_figure_dot(at, light) > -0.05 ? 1 : 0; /* the sphere's own shadow, a little soft */
    double value = 0;
    if (nl > 0 && (nv > 0 || !b->cut))
        value = weft_ggx_d(nh, 1 - nh * nh, alpha) * weft_fresnel_schlick(0.15, h[2]) *
                weft_ggx_v1(nl, alpha) * weft_ggx_v1(weft_max(nv, WEFT_MIN_NV), alpha) * nl;
    for (int c = 0; c < 3; c++)
        radiance[c] = 0.01 + 1.5 * shape * WEFT_PI * value;
}

weft_err weft_figure_order_1(const char *folder, weft_error *err)
{
    enum { SIDE = 800, PART = 300 };
    static const char *const words[] = {"G is 0 for n.v <= 0", "as if facing"};
    weft_image pictures[2] = {0}, *const each[] = {&pictures[0], &pictures[1]};
    weft_err status = WEFT_OK;
    for (int i = 0; i < 2 && status == WEFT_OK; i++) {
        weft_image whole;
        status = weft_figure_sphere(&whole, SIDE, shade_bumpy, &(bumpy){i == 0}, err);
        if (status == WEFT_OK) {
            status = weft_image_crop(&pictures[i], &whole, SIDE - PART - 20, 130, PART, PART, err);
            weft_image_fini(&whole);
        }
    }
    if (status == WEFT_OK)
        status = weft_figure_save(folder, "order-1.png", 2, 1, each, words, WEFT_TONE_AGX, err);
    for (int i = 0; i < 2; i++)
        weft_image_fini(&pictures[i]);
    return status;
}

/* ---- 2 ---- */

enum { HEAD_WIDTH = 230, HEAD_HEIGHT = 290, RADII = 48 };

#define HEAD_PX    130.0
#define RADIUS_MIN 0.5
#define RADIUS_MAX 150.0

/* Height of something like a face, in half heights; below 0 beside it. */
static double face(double x, double y)
{
    static const struct {
        double x, y, wide, high, up;
    } parts[] = {
        {0, -0.12, 0.075, 0.2, 0.2},      {0, -0.23, 0.085, 0.06, 0.13},    {-0.1, -0.27, 0.05, 0.04, 0.05},
        {0.1, -0.27, 0.05, 0.04, 0.05},   {0, 0.2, 0.4, 0.09, 0.06},        {-0.24, 0.07, 0.11, 0.075, -0.09},
        {0.24, 0.07, 0.11, 0.075, -0.09}, {-0.24, 0.06, 0.07, 0.045, 0.05}, {0.24, 0.06, 0.07, 0.045, 0.05},
        {0, -0.47, 0.17, 0.035, 0.05},    {0, -0.56, 0.14, 0.035, 0.055},   {0, -0.515, 0.16, 0.014, -0.05},
        {0, -0.78, 0.16, 0.09, 0.07},     {-0.36, -0.2, 0.16, 0.16, 0.04},  {0.36, -0.2, 0.16, 0.16, 0.04},
    };
    const double rest = 1 - x * x / 0.5 - y * y / 1.05;
    double z = rest > 0 ? 0.9 * sqrt(rest) : -1;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        const double u = (x - parts[i].x) / parts[i].wide, v = (y - parts[i].y) / parts[i].high;
        z += parts[i].up * exp(-0.5 * (u * u + v * v));
    }
    return rest > 0 ? z : -1;
}

static void face_normal(double x, double y, double n[3])
{
    const double step = 2e-3;
    n[0] = (face(x - step, y) - face(x + step, y)) / (2 * step);
    n[1] = (face(x, y - step) - face(x, y + step)) / (2 * step);
    n[2] = 1;
    weft_figure_unit(n);
}

/* Radius of curvature in mm: 2/(divergence of the normal), what an artist's curvature map holds. */
static double face_radius(double x, double y, double head_mm)
{
    const double step = 0.012;
    double a[3], b[3], c[3], d[3];
    face_normal(x - step, y, a);
    face_normal(x + step, y, b);
    face_normal(x, y - step, c);
    face_normal(x, y + step, d);
    const double divergence = fabs(b[0] - a[0] + d[1] - c[1]) / (2 * step) / head_mm;
    const double radius = divergence > 2 / RADIUS_MAX ? 2 / divergence : RADIUS_MAX;
    return weft_max(radius, RADIUS_MIN);
}

/* Zonal coefficients of skin over radii of even logarithm, band by band for each channel. */
static void zonal_of(double table[RADII][3][3], double radius, int channel, double zonal[3])
{
    const double at = log(radius / RADIUS_MIN) / log(RADIUS_MAX / RADIUS_MIN) * (RADII - 1);
    const int i = at < 0 ? 0 : at > RADII - 2 ? RADII - 2 : (int)at;
    for (int l = 0; l < 3; l++)
        zonal[l] = table[i][l][channel] + (at - i) * (table[i + 1][l][channel] - table[i][l][channel]);
}

/* head_mm is half its height; 0: Lambert. */
static void draw_face(weft_image *picture, double head_mm, double table[RADII][3][3])
{
    static const double albedo[3] = {0.75, 0.5, 0.38}, lamp[3] = {-0.82, 0.36, 0.44};
    double light[WEFT_SH_COUNT];
    weft_sh_basis(lamp[0], lamp[1], lamp[2], light);
    for (int k = 0; k < WEFT_SH_COUNT; k++)
        light[k] = 2.6 * light[k] + (k == 0 ? 0.25 : 0);
    for (int row = 0; row < HEAD_HEIGHT; row++)
        for (int column = 0; column < HEAD_WIDTH; column++) {
            const double x = (column + 0.5 - HEAD_WIDTH / 2.0) / HEAD_PX;
            const double y = (HEAD_HEIGHT / 2.0 - row - 0.5) / HEAD_PX;
            double n[3], zonal[3];
            const bool on = face(x, y) > -0.5;
            face_normal(x, y, n);
            const double radius = face_radius(x, y, head_mm > 0 ? head_mm : 1);
            for (int c = 0; c < 3; c++) {
                zonal_of(table, radius, c, zonal);
                const double e = weft_sh_convolve(n, head_mm > 0 ? zonal : weft_sh_cosine, light);
                weft_image_row(picture, c, row)[column] =
                    on ? (float)(albedo[c] / WEFT_PI * weft_max(e, 0)) : 0.02f;
            }
        }
}

weft_err weft_figure_order_2(const char *folder, weft_error *err)
{
    static const char *const words[] = {"Lambert's cosine", "skin, 23 cm high", "skin, 4 cm high"};
    static const double head_mm[] = {0, 115, 20};
    static double table[RADII][3][3];
    weft_image pictures[3] = {0}, *const each[] = {&pictures[0], &pictures[1], &pictures[2]};
    weft_err status = WEFT_OK;
    for (int i = 0; i < RADII; i++)
        weft_skin_zonal(WEFT_SKIN_RADIAL, RADIUS_MIN * pow(RADIUS_MAX / RADIUS_MIN, i / (RADII - 1.0)),
                        WEFT_PI, table[i]);
    for (int i = 0; i < 3 && status == WEFT_OK; i++) {
        status = weft_image_init(&pictures[i], HEAD_WIDTH, HEAD_HEIGHT, 3, err);
        if (status == WEFT_OK)
            draw_face(&pictures[i], head_mm[i], table);
    }
    if (status == WEFT_OK)
        status = weft_figure_save(folder, "order-2.png", 3, 1, each, words, WEFT_TONE_NONE, err);
    for (int i = 0; i < 3; i++)
        weft_image_fini(&pictures[i]);
    return status;
}
