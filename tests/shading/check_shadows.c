/* Shadows of the relief and of the folds against rays that leave nothing out. */
#include "tests/support/support.h"

#include "tests/shading/drape_mesh.h"

#include "shading/brdf/half_vector.h"
#include "shading/preview/bayer.h"
#include "shading/preview/preview_visibility.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 96, MOST = 384 };
#define MM_PER_PX  0.05
#define HIGHEST_MM 0.45 /* of the weave below: 0.6 (0.25 + 0.2) is less */

/* A plain weave of round yarns, 12 texels from yarn to yarn: height in mm. */
static double weave_mm(double x, double y)
{
    const double pitch = 12, fx = x / pitch, fy = y / pitch;
    const double ux = fx - floor(fx) - 0.5, uy = fy - floor(fy) - 0.5;
    const double up = ((int)floor(fx) + (int)floor(fy)) % 2 == 0 ? 1 : -1;
    const double warp = 0.5 * sqrt(0.25 - 0.9 * ux * ux) + up * 0.2 * cos(WEFT_PI * uy);
    const double weft = 0.5 * sqrt(0.25 - 0.9 * uy * uy) - up * 0.2 * cos(WEFT_PI * ux);
    return pitch * MM_PER_PX * fmax(warp, weft);
}

static weft_image weave_height(void)
{
    weft_image height;
    assert_ok(weft_image_init(&height, SIDE, SIDE, 1, err));
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            weft_image_row(&height, 0, y)[x] = (float)weave_mm(x, y);
    return height;
}

/* Bilinear height in mm, written apart from the library. */
static double height_mm_at(const weft_image *map, double u, double v)
{
    double sum = 0;
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < 2; x++) {
            const int column = (int)floor(u) + x, row = (int)floor(v) + y;
            const double weight = (1 - fabs(u - column)) * (1 - fabs(v - row));
            const int i = column < 0 ? 0 : column < map->width ? column : map->width - 1;
            const int j = row < 0 ? 0 : row < map->height ? row : map->height - 1;
            sum += weight * (double)map->data[j * map->width + i];
        }
    return sum;
}

/* The truth: 64 looks a texel until the ray has left the map or is above everything. */
static bool truly_lit(const weft_image *map, double u, double v, const double light[3])
{
    const double across = hypot(light[0], light[1]), start = height_mm_at(map, u, v);
    for (int k = 1; k < 64 * 3 * SIDE; k++) {
        const double t = k / 64.0, x = u + t * light[0] / across, y = v - t * light[1] / across;
        if (start + t * MM_PER_PX * light[2] / across > HIGHEST_MM || x < -0.5 || y < -0.5 ||
            x > map->width - 0.5 || y > map->height - 0.5)
            break;
        if (start + t * MM_PER_PX * light[2] / across < height_mm_at(map, x, y) - 5e-4 * MM_PER_PX)
            return false;
    }
    return true;
}

/* Every value of the matrix once in any window, and at any place once in sixteen phases. */
static void test_bayer(void **state)
{
    (void)state;
    for (int at = 0; at < 64; at++) {
        unsigned window = 0, phases = 0;
        for (int k = 0; k < 16; k++) {
            window |= 1u << (int)(16 * weft_bayer(at % 8 + k % 4, at / 8 + k / 4, 5));
            phases |= 1u << (int)(16 * weft_bayer(at % 8, at / 8, k));
        }
        assert_int_equal(window, 0xffff);
        assert_int_equal(phases, 0xffff);
    }
    assert_near(weft_bayer(1, 0, 0), 0.5, 0);  /* the printed first row is 0 8 2 10 */
    assert_near(weft_bayer(1, 1, 0), 0.25, 0); /* and where it has 0.22 */
}

/* A wall of height H shades H/tan(elevation) behind it, a mirrored one behind its picture too. */
static void test_wall(void **state)
{
    (void)state;
    enum { WIDE = 200 };
    weft_image height;
    weft_height_field field;
    assert_ok(weft_image_init(&height, WIDE, 4, 1, err));
    for (int y = 0; y < 4; y++)
        for (int x = 120; x < 140; x++)
            weft_image_row(&height, 0, y)[x] = 1; /* 20 texels high */
    assert_ok(weft_height_field_init(&field, &height, MM_PER_PX, err));
    const double light[3] = {cos(WEFT_PI / 6), 0, sin(WEFT_PI / 6)}; /* from the right, 30 degrees */
    /* from the foot at x the ray is sqrt(1/3) (120 - x) high at the ridge */
    const double edge = 120 - 20 * sqrt(3);
    for (int k = 0; k < 316; k++) {
        const double x = 1 + 0.37 * k;
        if (fabs(x - edge) > 0.6)
            assert_int_equal(
                weft_height_field_look(&field, x, 1.5, light, (weft_height_march){4000, 0.5}).lit, x < edge);
    }
    assert_true(weft_height_field_look(&field, 145, 1.5, light, (weft_height_march){4000, 0.5}).lit);
    weft_height_field_mirror(&field, 0, 0, WIDE, 4);
    /* the next wall to the right is the mirrored one from 199.5 + 60 on */
    assert_true(weft_height_field_look(&field, 222, 1.5, light, (weft_height_march){4000, 0.5}).lit);
    assert_false(weft_height_field_look(&field, 228, 9.5, light, (weft_height_march){4000, 0.5}).lit);
    assert_false(
        weft_height_field_look(&field, 228, 1.5, (const double[3]){1, 0, 0}, (weft_height_march){4, 0.5})
            .lit);
    assert_true(
        weft_height_field_look(&field, 110, 1.5, (const double[3]){0, 0, 1}, (weft_height_march){4, 0.5})
            .lit);
    weft_height_field_fini(&field);
    weft_image_fini(&height);
}

/* The share of each pixel that the relief leaves lit: a picture with shadows over one without. */
static void shares(const weft_image *height, const double light[3], int steps, weft_preview_blur blur,
                   int size, float *share)
{
    weft_preview_surface surface = {
        .width = SIDE, .height = SIDE, .mm_per_px = MM_PER_PX, .height_mm = height};
    weft_preview_view view = weft_preview_view_defaults();
    weft_image with, without;
    assert_ok(weft_brdf_find("lambert", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    view.width = view.height = size;
    memcpy(view.lights[0].direction, light, sizeof view.lights[0].direction);
    assert_ok(weft_preview_render(&surface, &view, &without, err));
    view.shadows.relief = true;
    view.shadows.blur = blur;
    view.shadows.steps = steps;
    assert_ok(weft_preview_render(&surface, &view, &with, err));
    for (int i = 0; i < size * size; i++)
        share[i] = with.data[i] / without.data[i];
    weft_image_fini(&with);
    weft_image_fini(&without);
}

typedef struct difference {
    double rms, mean;
} difference;

static difference differ(const float *got, const float *truth, int size)
{
    difference d = {0};
    for (int i = 0; i < size * size; i++) {
        d.mean += (double)(got[i] - truth[i]) / (size * size);
        d.rms += pow((double)(got[i] - truth[i]), 2) / (size * size);
    }
    d.rms = sqrt(d.rms);
    return d;
}

/* 4 x 4 true rays a pixel under the preview's tent of two pixels. */
static void true_shares(const weft_image *height, const double light[3], int size, float *share)
{
    enum { SUB = 4 };
    static float fine[MOST * SUB][MOST * SUB];
    const int n = size * SUB;
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++)
            fine[y][x] = truly_lit(height, (x + 0.5) * SIDE / n - 0.5, (y + 0.5) * SIDE / n - 0.5, light);
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            double sum = 0;
            for (int j = -SUB / 2; j < SUB + SUB / 2; j++)
                for (int i = -SUB / 2; i < SUB + SUB / 2; i++) {
                    const int row = y * SUB + j, column = x * SUB + i;
                    const double wy = 1 - fabs((j + 0.5) / SUB - 0.5), wx = 1 - fabs((i + 0.5) / SUB - 0.5);
                    sum += wx * wy / (SUB * SUB) *
                           (double)fine[row < 0   ? 0
                                        : row < n ? row
                                                  : n - 1][column < 0   ? 0
                                                           : column < n ? column
                                                                        : n - 1];
                }
            share[y * size + x] = (float)sum;
        }
}

/* Errors of never blurring, blurring where coarse and everywhere, with so many steps a ray. */
static void measure(const weft_image *height, const double light[3], int size, int steps, const float *truth,
                    difference d[3])
{
    static float got[MOST * MOST];
    static const weft_preview_blur blurs[3] = {WEFT_PREVIEW_BLUR_NEVER, WEFT_PREVIEW_BLUR_COARSE,
                                               WEFT_PREVIEW_BLUR_ALWAYS};
    for (int k = 0; k < 3; k++) {
        shares(height, light, steps, blurs[k], size, got);
        d[k] = differ(got, truth, size);
    }
    print_message("%6d steps: rms %.4f, %.4f, %.4f; mean %+.4f, %+.4f, %+.4f\n", steps, d[0].rms, d[1].rms,
                  d[2].rms, d[0].mean, d[1].mean, d[2].mean);
}

/* WEFT_TEST_LONG=1 prints the table of docs/shading.md. */
static void test_relief_against_every_step(void **state)
{
    (void)state;
    static float truth[MOST * MOST];
    const bool all = getenv("WEFT_TEST_LONG");
    weft_image height = weave_height();
    for (int size = SIDE; size <= (all ? 4 : 1) * SIDE; size *= 2)
        for (int elevation = 15; elevation < (all ? 40 : 20); elevation += 20) {
            double light[3], lit = 0;
            difference d[3];
            weft_preview_direction(30, elevation, light);
            true_shares(&height, light, size, truth);
            for (int i = 0; i < size * size; i++)
                lit += (double)truth[i] / (size * size);
            print_message("%d degrees, %d px a texel, %.3f lit: never, where coarse, always blurred\n",
                          elevation, size / SIDE, lit);
            for (int steps = 4; steps <= 64; steps *= all ? 2 : 4) {
                measure(&height, light, size, steps, truth, d);
                assert_true(d[2].rms < 0.12 && fabs(d[2].mean) < 0.04);
            }
            assert_true(d[0].rms < 0.04 && fabs(d[0].mean) < 0.006);
            assert_true(d[1].rms < d[2].rms && fabs(d[1].mean) < 0.012);
        }
    weft_image_fini(&height);
}

/* Every step of the truth, and every one here: the same answer everywhere. */
static void test_rays_agree_place_by_place(void **state)
{
    (void)state;
    weft_image height = weave_height();
    weft_height_field field;
    double light[3];
    int wrong = 0;
    weft_preview_direction(200, 20, light);
    assert_ok(weft_height_field_init(&field, &height, MM_PER_PX, err));
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            wrong +=
                truly_lit(&height, x + 0.3, y + 0.3, light) !=
                weft_height_field_look(&field, x + 0.3, y + 0.3, light, (weft_height_march){4096, 0.5}).lit;
    print_message("%d of %d rays disagree\n", wrong, SIDE * SIDE);
    assert_true(wrong <= SIDE * SIDE / 500);
    weft_height_field_fini(&field);
    weft_image_fini(&height);
}

/* A ball of light: one ray a place, dithered over the ball, against all of its points at every third place.
 */
static void test_large_lamp(void **state)
{
    (void)state;
    enum { ZOOM = 3, WIDE = ZOOM * SIDE };
    static float truth[SIDE * SIDE], got[2][SIDE * SIDE];
    weft_image height = weave_height(), pictures[3];
    weft_preview_surface surface = {
        .width = SIDE, .height = SIDE, .mm_per_px = MM_PER_PX, .height_mm = &height};
    weft_preview_view view = weft_preview_view_defaults();
    weft_preview_samples one = {.n = 1};
    assert_ok(weft_brdf_find("lambert", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    view.width = view.height = WIDE;
    view.draft = true;
    view.lights[0] = (weft_preview_light){
        .kind = WEFT_PREVIEW_BALL, .position_mm = {150, 40, 70}, .radius_mm = 25, .irradiance = {1, 1, 1}};
    for (int at = 0; at < SIDE * SIDE; at++) {
        const int row = at / SIDE, column = at % SIDE;
        double lit = 0, all = 0;
        one.position_mm[0][0] = (float)(column * MM_PER_PX);
        one.position_mm[1][0] = (float)(-row * MM_PER_PX);
        for (int k = 0; k < WEFT_PREVIEW_AREA_POINTS; k++) {
            weft_preview_aim(&view.lights[0], &one, 0, k);
            const double to[3] = {(double)one.lamp[0][0], (double)one.lamp[1][0], (double)one.lamp[2][0]};
            all += (double)one.irradiance[0] * to[2];
            lit += truly_lit(&height, column, row, to) ? (double)one.irradiance[0] * to[2] : 0;
        }
        truth[at] = (float)(lit / all);
    }
    for (int k = 0; k < 3; k++) {
        view.shadows.relief = k > 0;
        view.shadows.blur = k == 1 ? WEFT_PREVIEW_BLUR_NEVER : WEFT_PREVIEW_BLUR_COARSE;
        assert_ok(weft_preview_render(&surface, &view, &pictures[k], err));
        for (int at = 0; at < SIDE * SIDE && k > 0; at++) {
            const int from = (at / SIDE * ZOOM + 1) * WIDE + at % SIDE * ZOOM + 1;
            got[k - 1][at] = pictures[k].data[from] / pictures[0].data[from];
        }
    }
    const difference hard = differ(got[0], truth, SIDE), soft = differ(got[1], truth, SIDE);
    print_message(
        "ball of light: one ray to its middle rms %.4f mean %+.4f, one dithered and blurred rms %.4f mean "
        "%+.4f\n",
        hard.rms, hard.mean, soft.rms, soft.mean);
    assert_true(soft.rms < 0.75 * hard.rms && fabs(soft.mean) < 0.02);
    for (int k = 0; k < 3; k++)
        weft_image_fini(&pictures[k]);
    weft_image_fini(&height);
}

/* ---- the folds ---- */

enum { PLACES = 400 };

typedef struct place {
    double at[3], normal[3];
    bool lit;
} place;

/* Places of the drape that face the light, and whether the mesh shades them. */
static int make_places(const double light[3], place *places)
{
    int n = 0;
    for (int k = 0; k < PLACES; k++) {
        place p;
        double slope[2];
        p.at[0] = 1.9 * fmod(0.5 + k * 0.7548776662466927, 1) - 0.95;
        p.at[1] = 1.9 * fmod(0.5 + k * 0.5698402909980532, 1) - 0.95;
        p.at[2] = weft_preview_drape_height(p.at[0], p.at[1], slope);
        const double up = 1 / sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
        p.normal[0] = -slope[0] * up;
        p.normal[1] = -slope[1] * up;
        p.normal[2] = up;
        if (p.normal[0] * light[0] + p.normal[1] * light[1] + p.normal[2] * light[2] < 0.05)
            continue;
        double off[3]; /* the mesh is flat between its corners: start as far off as it can be wrong */
        for (int c = 0; c < 3; c++)
            off[c] = p.at[c] + 2e-4 * p.normal[c];
        p.lit = !drape_mesh_meets(off, light);
        places[n++] = p;
    }
    return n;
}

static void test_voxels_against_the_mesh(void **state)
{
    (void)state;
    static place places[PLACES];
    double light[3];
    int dark = 0;
    weft_preview_direction(20, 25, light);
    drape_mesh_make();
    const int n = make_places(light, places);
    for (int k = 0; k < n; k++)
        dark += !places[k].lit;
    print_message("%d places face the light, %d of them in shadow\n", n, dark);
    assert_true(dark > n / 20 && n > PLACES / 2);
    for (int across = 64; across <= 256; across *= 2) {
        weft_voxels voxels;
        int walked = 0, marched[3] = {0};
        const int steps[3] = {across / 16, across / 4, across};
        assert_ok(weft_preview_drape_voxels(&voxels, across, err));
        for (int k = 0; k < n; k++) {
            weft_voxel_ray ray = {.reach = 1e9};
            memcpy(ray.from, places[k].at, sizeof ray.from);
            memcpy(ray.normal, places[k].normal, sizeof ray.normal);
            memcpy(ray.to, light, sizeof ray.to);
            walked += weft_voxels_lit_walked(&voxels, &ray) != places[k].lit;
            for (int j = 0; j < 3; j++)
                marched[j] +=
                    weft_voxels_lit_marched(&voxels, &ray, steps[j], (k % 16 + 0.5) / 16) != places[k].lit;
        }
        print_message("%3d voxels: %.3f of the places differ walked, %.3f, %.3f, %.3f in %d, %d, %d steps\n",
                      across, (double)walked / n, (double)marched[0] / n, (double)marched[1] / n,
                      (double)marched[2] / n, steps[0], steps[1], steps[2]);
        assert_true(walked <= 2 * n / across + 1);
        assert_true(marched[1] <= 2.5 * n / across + 1 && marched[0] <= 6.0 * n / across + 1);
        weft_voxels_fini(&voxels);
    }
}

/* A lamp before the folds: nothing behind it can shade, and a ray beside the grid meets nothing. */
static void test_voxel_reach(void **state)
{
    (void)state;
    weft_voxels voxels;
    assert_ok(weft_voxels_init(&voxels, (const double[3]){0, 0, 0}, (const double[3]){1, 1, 1}, 10, err));
    weft_voxels_add_triangle(&voxels, (const double[3]){0.55, 0, 0}, (const double[3]){0.55, 1, 0},
                             (const double[3]){0.55, 0.5, 1});
    int full = 0;
    for (int k = 0; k < 10; k++)
        full += weft_voxels_full(&voxels, (const double[3]){0.05 + 0.1 * k, 0.5, 0.05});
    assert_int_equal(full, 1);
    weft_voxel_ray ray = {.from = {0.15, 0.5, 0.05}, .to = {1, 0, 0}, .reach = 0.3};
    assert_true(weft_voxels_lit_walked(&voxels, &ray) && weft_voxels_lit_marched(&voxels, &ray, 20, 0.5));
    ray.reach = 0.6;
    assert_false(weft_voxels_lit_walked(&voxels, &ray) || weft_voxels_lit_marched(&voxels, &ray, 20, 0.5));
    ray.from[0] = -4; /* outside: it enters the grid, or passes by */
    ray.reach = 9;
    assert_false(weft_voxels_lit_walked(&voxels, &ray));
    ray.from[1] = 1.5;
    assert_true(weft_voxels_lit_walked(&voxels, &ray));
    weft_voxels_fini(&voxels);
    assert_fails(weft_voxels_init(&voxels, (const double[3]){0, 0, 0}, (const double[3]){1, 1, 1}, 4, err),
                 WEFT_ERR_RANGE, "8 to 1024");
}

/* The folds by voxels look like the folds by their formula. */
static void test_drape_pictures(void **state)
{
    (void)state;
    weft_preview_surface surface = {.width = 64, .height = 64, .mm_per_px = 1};
    weft_preview_view view = weft_preview_view_defaults();
    weft_image pictures[3];
    assert_ok(weft_brdf_find("lambert", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    view.width = view.height = 128;
    view.shape = WEFT_PREVIEW_DRAPE;
    weft_preview_direction(20, 25, view.lights[0].direction);
    for (int k = 0; k < 3; k++) {
        view.shadows.folds = (weft_preview_folds)k;
        assert_ok(weft_preview_render(&surface, &view, &pictures[k], err));
    }
    for (int k = 1; k < 3; k++) {
        double mean = 0;
        for (int i = 0; i < 128 * 128; i++)
            mean += fabs((double)(pictures[k].data[i] - pictures[0].data[i])) / (128 * 128);
        print_message("%s: %.4f from the formula on the mean\n", k == 1 ? "marched" : "walked", mean);
        assert_true(mean < 0.012);
    }
    for (int k = 0; k < 3; k++)
        weft_image_fini(&pictures[k]);
}

static void test_refusals(void **state)
{
    (void)state;
    weft_image height = weave_height(), small, picture;
    weft_preview_surface surface = {.width = SIDE, .height = SIDE, .mm_per_px = MM_PER_PX};
    weft_preview_view view = weft_preview_view_defaults();
    assert_ok(weft_brdf_find("lambert", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    view.width = view.height = 16;
    view.shadows.relief = true;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_MISSING, "no height map");
    surface.height_mm = &height;
    surface.mm_per_px = 0;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_MISSING, "scale");
    surface.mm_per_px = 1;
    view.shadows.steps = 0;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_RANGE, "steps");
    view.shadows.steps = 4;
    assert_ok(weft_image_init(&small, 9, 9, 1, err));
    surface.height_mm = &small;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_MISMATCH, "height");
    surface.height_mm = &height; /* holes are no peaks */
    for (int i = 0; i < SIDE; i++)
        height.data[i * SIDE + i] = i % 2 ? NAN : INFINITY;
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int i = 0; i < 16 * 16; i++)
        assert_true(isfinite(picture.data[i]) && picture.data[i] >= 0);
    weft_image_fini(&picture);
    weft_image_fini(&small);
    weft_image_fini(&height);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bayer),
        cmocka_unit_test(test_wall),
        cmocka_unit_test(test_rays_agree_place_by_place),
        cmocka_unit_test(test_relief_against_every_step),
        cmocka_unit_test(test_large_lamp),
        cmocka_unit_test(test_voxels_against_the_mesh),
        cmocka_unit_test(test_voxel_reach),
        cmocka_unit_test(test_drape_pictures),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
