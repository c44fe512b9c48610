/* The preview's turned shapes: what may not change, what moves where, and the drape against its mesh. */
#include "tests/support/support.h"

#include "tests/shading/drape_mesh.h"

#include "shading/brdf/half_vector.h"
#include "shading/preview/preview.h"
#include "shading/preview/preview_samples.h"

#include <math.h>
#include <string.h>

static weft_preview_surface surface_of(const char *brdf, int side)
{
    weft_preview_surface surface = {
        .width = side, .height = side, .mm_per_px = 1, .origin_mm = {-(side - 1) / 2.0, (side - 1) / 2.0}};
    assert_ok(weft_brdf_find(brdf, &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    return surface;
}

static weft_preview_view view_of(weft_preview_shape shape, int side)
{
    weft_preview_view view = weft_preview_view_defaults();
    view.width = view.height = side;
    view.shape = shape;
    return view;
}

static double largest_difference(const weft_image *a, const weft_image *b)
{
    double largest = 0;
    for (size_t i = 0; i < 3 * weft_image_plane_size(a); i++)
        largest = fmax(largest, fabs((double)(a->data[i] - b->data[i])));
    return largest;
}

/* An even ball or roll looks the same however it is turned: the lamps and the surroundings stay. */
static void test_even_shapes_stay(void **state)
{
    (void)state;
    static weft_environment_table table;
    weft_environment_map map;
    weft_image panorama;
    assert_ok(weft_environment_paint_sky(&panorama, &weft_sky_cie_clear, 0.9, 2, err));
    assert_ok(weft_environment_map_init(&map, &panorama, err));
    weft_environment_table_get(&table, WEFT_ENVIRONMENT_SMITH);
    static const char *const models[] = {"ggx", "cloth"};
    for (int m = 0; m < 2; m++)
        for (int shape = WEFT_PREVIEW_SPHERE; shape <= WEFT_PREVIEW_CYLINDER; shape++) {
            weft_preview_surface surface = surface_of(models[m], 64);
            weft_preview_view view = view_of((weft_preview_shape)shape, 64);
            weft_image still, turned;
            view.fov_deg = shape == WEFT_PREVIEW_SPHERE ? 30 : 0;
            view.surroundings = (weft_preview_surroundings){&map, &table, 0.5};
            view.n_lights = 2;
            view.lights[1] = (weft_preview_light){
                .kind = WEFT_PREVIEW_POINT, .position_mm = {60, 20, 40}, .irradiance = {1, 2, 3}};
            assert_ok(weft_preview_render(&surface, &view, &still, err));
            view.turn_rad = 1.1;
            assert_ok(weft_preview_render(&surface, &view, &turned, err));
            /* 32 directions of a frame that turns with the ball see a slightly other sky */
            assert_true(largest_difference(&still, &turned) < (m == 0 ? 3e-3 : 3e-2));
            weft_image_fini(&turned);
            weft_image_fini(&still);
        }
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
}

/* Uneven albedo and slopes. */
static void make_maps(int side, weft_image *albedo, weft_image *normal)
{
    assert_ok(weft_image_init(albedo, side, side, 3, err));
    assert_ok(weft_image_init(normal, side, side, 3, err));
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            const double nx = 0.4 * sin(x / 9.0), ny = 0.3 * cos(y / 7.0 + x / 15.0);
            weft_image_row(normal, 0, y)[x] = (float)nx;
            weft_image_row(normal, 1, y)[x] = (float)ny;
            weft_image_row(normal, 2, y)[x] = (float)sqrt(1 - nx * nx - ny * ny);
            for (int c = 0; c < 3; c++)
                weft_image_row(albedo, c, y)[x] = (float)(x + 2 * y + 3 * c) / (float)(4 * side);
        }
}

/* A plane turned by a quarter is the picture turned by a quarter, under a lamp a quarter back. */
static void test_plane_quarter(void **state)
{
    (void)state;
    enum { SIDE = 48 };
    weft_preview_surface surface = surface_of("lambert", SIDE);
    weft_preview_view view = view_of(WEFT_PREVIEW_PLANE, SIDE);
    weft_image albedo, normal, turned, still;
    make_maps(SIDE, &albedo, &normal);
    surface.normal = &normal;
    assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
    weft_preview_direction(60, 30, view.lights[0].direction);
    view.n_lights = 2;
    view.lights[1] =
        (weft_preview_light){.kind = WEFT_PREVIEW_POINT, .position_mm = {20, 5, 30}, .irradiance = {1, 1, 1}};
    view.turn_rad = WEFT_PI / 2;
    assert_ok(weft_preview_render(&surface, &view, &turned, err));
    view.turn_rad = 0;
    weft_preview_direction(-30, 30, view.lights[0].direction);
    view.lights[1].position_mm[0] = 5;
    view.lights[1].position_mm[1] = -20;
    assert_ok(weft_preview_render(&surface, &view, &still, err));
    for (int y = 2; y < SIDE - 2; y++)
        for (int x = 2; x < SIDE - 2; x++) /* anticlockwise: the right edge comes to the top */
            assert_near((double)weft_image_row(&turned, 1, y)[x],
                        (double)weft_image_row(&still, 1, x)[SIDE - 1 - y], 1e-4);
    weft_image_fini(&turned);
    weft_image_fini(&still);
    weft_image_fini(&albedo);
    weft_image_fini(&normal);
}

/* A dark line along the middle of the map, in front of the roll and the ball, moves to the right by
 * sin(turn). */
static void test_marks_move(void **state)
{
    (void)state;
    enum { SIDE = 64, WIDE = 401 };
    for (int shape = WEFT_PREVIEW_SPHERE; shape <= WEFT_PREVIEW_CYLINDER; shape++) {
        weft_preview_surface surface = surface_of("lambert", SIDE);
        weft_preview_view view = view_of((weft_preview_shape)shape, WIDE);
        weft_image albedo, picture;
        assert_ok(weft_image_init(&albedo, SIDE, SIDE, 1, err));
        for (int i = 0; i < SIDE * SIDE; i++)
            albedo.data[i] = i % SIDE == SIDE / 2 || i % SIDE == SIDE / 2 - 1 ? 0 : 1;
        assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
        view.n_lights = 0;
        view.ambient = 1;
        view.turn_rad = 0.5;
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        double sum = 0, weight = 0;
        for (int x = 200; x < 360; x++) {
            const double dark = 1 - fmin(1, (double)weft_image_row(&picture, 0, WIDE / 2)[x]);
            if (fabs(x - 200 - 160 * 0.48) < 30) {
                sum += dark * x;
                weight += dark;
            }
        }
        const double radius = shape == WEFT_PREVIEW_SPHERE ? 0.92 * WIDE / 2 : 0.7 * WIDE / 2;
        assert_near(sum / weight, 200 + radius * sin(0.5), 1.0);
        weft_image_fini(&picture);
        weft_image_fini(&albedo);
    }
}

enum { SIDE = 28 };

/* The turned drape under a lamp at the camera shows |n.eye|, as the nearest triangle of its mesh does. */
static void test_drape_against_its_mesh(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 16);
    weft_preview_view view = view_of(WEFT_PREVIEW_DRAPE, SIDE);
    int wrong = 0, on = 0;
    drape_mesh_make();
    for (int c = 0; c < 3; c++)
        surface.params[c] = 1;
    view.draft = true;
    view.background = 0;
    weft_preview_direction(0, 90, view.lights[0].direction);
    for (int k = 0; k < 3; k++) {
        static const double turns[3] = {0.7, 2.2, 4};
        const double c = cos(turns[k]), s = sin(turns[k]), d[3] = {s, 0, -c};
        weft_image picture;
        view.turn_rad = turns[k];
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                const double px = (x + 0.5 - SIDE / 2.0) / (0.92 * SIDE / 2),
                             py = (SIDE / 2.0 - y - 0.5) / (0.92 * SIDE / 2);
                const double o[3] = {c * px - 2 * s, py, s * px + 2 * c}, want = drape_mesh_facing(o, d);
                const double got = (double)weft_image_row(&picture, 0, y)[x];
                on += want >= 0;
                wrong += fabs(got - fmax(want, 0)) > 0.07; /* the mesh is flat between its corners */
            }
        weft_image_fini(&picture);
    }
    print_message("%d of %d places of the turned drape are not those of its mesh\n", wrong, on);
    assert_true(on > SIDE * SIDE / 2);
    assert_true(wrong <= on / 200); /* edges of folds, where the mesh cuts corners */
}

/* The slow path of the turned drape finds what the straight one does; from behind it is mirrored. */
static void test_drape_from_behind(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 16);
    weft_preview_view view = view_of(WEFT_PREVIEW_DRAPE, 60);
    weft_image front, still, behind;
    weft_preview_direction(0, 90, view.lights[0].direction);
    assert_ok(weft_preview_render(&surface, &view, &front, err));
    view.turn_rad = 1e-7;
    assert_ok(weft_preview_render(&surface, &view, &still, err));
    view.turn_rad = WEFT_PI;
    assert_ok(weft_preview_render(&surface, &view, &behind, err));
    assert_true(largest_difference(&front, &still) < 0.02);
    for (int y = 4; y < 56; y++)
        for (int x = 4; x < 56; x++)
            assert_near((double)weft_image_row(&behind, 0, y)[x],
                        (double)weft_image_row(&front, 0, y)[59 - x], 0.01);
    weft_image_fini(&front);
    weft_image_fini(&still);
    weft_image_fini(&behind);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_even_shapes_stay),  cmocka_unit_test(test_plane_quarter),
        cmocka_unit_test(test_marks_move),        cmocka_unit_test(test_drape_against_its_mesh),
        cmocka_unit_test(test_drape_from_behind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
