#include "tests/calibration/chart_scene.h"

#include "tests/support/support.h"

#include "calibration/charts/homography.h"

#include <math.h>

static const double to_rad = 0.017453292519943295;

weft_mat3 chart_scene_view(const weft_chart *chart, int width, int height, double fill, double turn_deg,
                           double tilt_x_deg, double tilt_y_deg)
{
    const double mm = (chart->columns - 1) * chart->pitch_mm + chart->patch_mm + 2 * chart->border_mm;
    const double distance = 600, f = fill * width / mm * distance;
    const double c = cos(turn_deg * to_rad), s = sin(turn_deg * to_rad);
    const double cx = cos(tilt_x_deg * to_rad), sx = sin(tilt_x_deg * to_rad);
    const double cy = cos(tilt_y_deg * to_rad), sy = sin(tilt_y_deg * to_rad);
    /* camera: x right, y down, z away; chart y up is camera -y */
    const weft_mat3 roll = {{c, -s, 0, s, c, 0, 0, 0, 1}};
    const weft_mat3 about_x = {{1, 0, 0, 0, cx, -sx, 0, sx, cx}},
                    about_y = {{cy, 0, sy, 0, 1, 0, -sy, 0, cy}};
    const weft_mat3 flip = {{1, 0, 0, 0, -1, 0, 0, 0, 1}};
    weft_mat3 r = weft_mat3_multiply(&roll, &flip);
    r = weft_mat3_multiply(&about_x, &r);
    r = weft_mat3_multiply(&about_y, &r);
    const weft_mat3 k = {{f, 0, 0.5 * (width - 1), 0, f, 0.5 * (height - 1), 0, 0, 1}};
    const weft_mat3 pose = {{r.m[0], r.m[1], 0, r.m[3], r.m[4], 0, r.m[6], r.m[7], distance}};
    weft_mat3 h = weft_mat3_multiply(&k, &pose);
    for (int i = 0; i < 9; i++)
        h.m[i] /= distance;
    return h;
}

chart_scene chart_scene_make(const weft_chart *chart, weft_mat3 to_pixel)
{
    return (chart_scene){.width = 616,
                         .height = 408,
                         .chart = chart,
                         .to_pixel = to_pixel,
                         .frame = 0.04,
                         .table = 0.25,
                         .exposure = 0.8,
                         .blur = 0.5,
                         .seed = 1};
}

void chart_scene_camera(const double srgb[3], double camera[3])
{
    camera[0] = 0.38 * srgb[0] + 0.14 * srgb[1] + 0.03 * srgb[2];
    camera[1] = 0.12 * srgb[0] + 0.70 * srgb[1] + 0.18 * srgb[2];
    camera[2] = 0.02 * srgb[0] + 0.16 * srgb[1] + 0.52 * srgb[2];
    for (int c = 0; c < 3; c++)
        camera[c] = fmax(camera[c], 0);
}

/* Table with a pattern: smooth waves and hard tiles of random brightness. */
static void table_colour(const chart_scene *s, double u, double v, double camera[3])
{
    const double waves = sin(0.11 * u + 0.07 * v) * sin(0.05 * u - 0.13 * v);
    const int tile_u = (int)floor(u / 31), tile_v = (int)floor(v / 19);
    uint64_t state = s->seed * 77 + (uint64_t)(tile_u + 1000) * 7919 + (uint64_t)(tile_v + 1000);
    const double tile = weft_test_random(&state) - 0.5;
    const double value = fmax(s->table * (1 + s->clutter * (0.4 * waves + 1.2 * tile)), 0.005);
    const double grey[3] = {value, value, value};
    chart_scene_camera(grey, camera);
}

enum { ON_TABLE = -2, ON_FRAME = -1 }; /* or the number of a patch */

static int region_at(const chart_scene *s, const weft_mat3 *back, double u, double v)
{
    double x, y, px, py;
    if (!s->chart || !weft_homography_apply(back, u, v, &x, &y))
        return ON_TABLE;
    const weft_chart *const c = s->chart;
    const double half_x = 0.5 * ((c->columns - 1) * c->pitch_mm + c->patch_mm) + c->border_mm;
    const double half_y = 0.5 * ((c->rows - 1) * c->pitch_mm + c->patch_mm) + c->border_mm;
    if (fabs(x) > half_x || fabs(y) > half_y)
        return ON_TABLE;
    const int column = (int)floor(x / c->pitch_mm + 0.5 * c->columns);
    const int row = (int)floor(0.5 * c->rows - y / c->pitch_mm);
    if (column < 0 || column >= c->columns || row < 0 || row >= c->rows)
        return ON_FRAME;
    const int p = row * c->columns + column;
    weft_chart_patch_centre(c, p, &px, &py);
    return fabs(x - px) <= 0.5 * c->patch_mm && fabs(y - py) <= 0.5 * c->patch_mm ? p : ON_FRAME;
}

static void region_colour(const chart_scene *s, int region, double u, double v, double camera[3])
{
    const double dark[3] = {s->frame, s->frame, s->frame};
    if (region == ON_TABLE)
        table_colour(s, u, v, camera);
    else
        chart_scene_camera(region == ON_FRAME ? dark : s->chart->patches[region].linear_srgb, camera);
}

/* One channel over the footprint of a pixel: many samples only where regions meet. */
static double pixel_value(const chart_scene *s, const weft_mat3 *back, int u, int v, int colour)
{
    enum { N = 5 };
    double camera[3], sum = 0;
    const int region = region_at(s, back, u - s->blur, v - s->blur);
    if (region == region_at(s, back, u + s->blur, v - s->blur) &&
        region == region_at(s, back, u - s->blur, v + s->blur) &&
        region == region_at(s, back, u + s->blur, v + s->blur)) {
        region_colour(s, region, u, v, camera);
        return camera[colour];
    }
    for (int k = 0; k < N * N; k++) {
        const int i = k % N, j = k / N;
        const double su = u + 2 * s->blur * ((i + 0.5) / N - 0.5);
        const double sv = v + 2 * s->blur * ((j + 0.5) / N - 0.5);
        region_colour(s, region_at(s, back, su, sv), su, sv, camera);
        sum += camera[colour];
    }
    return sum / (N * N);
}

void chart_scene_draw(const chart_scene *s, weft_image *mosaic, weft_mask *clipped)
{
    weft_mat3 back = {{0}};
    uint64_t noise = s->seed;
    assert_ok(weft_image_init(mosaic, s->width, s->height, 1, err));
    assert_ok(weft_mask_init(clipped, s->width, s->height, 0, err));
    if (s->chart)
        assert_true(weft_mat3_invert(&s->to_pixel, &back));
    for (int v = 0; v < s->height; v++)
        for (int u = 0; u < s->width; u++) {
            const double light = s->exposure * exp(s->fall_u * (2.0 * u / s->width - 1) +
                                                   s->fall_v * (2.0 * v / s->height - 1));
            double value = light * pixel_value(s, &back, u, v, weft_cfa_colour(WEFT_CFA_RGGB, u, v));
            if (s->shot > 0 || s->read > 0)
                value += sqrt(s->shot * value + s->read * s->read) * weft_test_gauss(&noise);
            if (value >= 1) {
                value = 1;
                clipped->data[v * s->width + u] = 1;
            }
            weft_image_row(mosaic, 0, v)[u] = (float)value;
        }
}
