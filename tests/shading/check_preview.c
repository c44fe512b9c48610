/* The preview against closed forms: where it is bright, how bright, and which way round. */
#include "tests/support/support.h"

#include "core/parallel.h"
#include "shading/brdf/albedo.h"
#include "shading/brdf/half_vector.h"
#include "shading/preview/preview.h"
#include "shading/preview/tone.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static weft_image constant_image(int width, int height, double a, double b, double c)
{
    weft_image image;
    const double values[3] = {a, b, c};
    assert_ok(weft_image_init(&image, width, height, 3, err));
    for (int p = 0; p < 3; p++)
        for (size_t i = 0; i < weft_image_plane_size(&image); i++)
            weft_image_plane(&image, p)[i] = (float)values[p];
    return image;
}

static weft_preview_surface surface_of(const char *brdf, int width, int height)
{
    weft_preview_surface surface = {.width = width, .height = height};
    assert_ok(weft_brdf_find(brdf, &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    return surface;
}

static weft_preview_view view_of(int width, int height, double azimuth_deg, double elevation_deg)
{
    weft_preview_view view = weft_preview_view_defaults();
    view.width = width;
    view.height = height;
    weft_preview_direction(azimuth_deg, elevation_deg, view.lights[0].direction);
    return view;
}

static double pixel(const weft_image *image, int plane, int x, int y)
{
    return (double)weft_image_row(image, plane, y)[x];
}

/* Lambert under a distant light: albedo/pi E sin(elevation), to the edge of the picture. */
static void test_flat_plane(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 40, 30);
    weft_preview_view view = view_of(40, 30, 70, 30);
    weft_image albedo = constant_image(40, 30, 0.8, 0.4, 0.1), picture;
    const double irradiance[3] = {3, 2, 1}, albedos[3] = {0.8, 0.4, 0.1};
    memcpy(view.lights[0].irradiance, irradiance, sizeof irradiance);
    view.exposure_ev = 1;
    view.ambient = 0.25;
    assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < 30; y++)
            for (int x = 0; x < 40; x++)
                assert_near(pixel(&picture, c, x, y), 2 * albedos[c] * (irradiance[c] / WEFT_PI * 0.5 + 0.25),
                            2e-6);
    weft_image_fini(&picture);
    weft_image_fini(&albedo);
}

static void set_params(weft_preview_surface *surface, const char *const *texts)
{
    for (; *texts; texts++)
        assert_ok(weft_brdf_set(surface->brdf, *texts, surface->params, err));
}

/* The even glow alone: what each model reflects of it is its matte part. */
static void test_ambient_light(void **state)
{
    (void)state;
    static const struct {
        const char *model, *params[6];
        double matte;
    } rows[] = {
        {"ggx", {"albedo=0.3"}, 0.3},
        {"ggx-specular", {NULL}, 0},
        {"unreal", {"base=0.6", "metallic=0.25", "cavity=0.5"}, 0.6 * 0.75 * 0.5},
        {"disney", {"base=0.6", "metallic=0.25"}, 0.6 * 0.75},
        {"ggx-cloth", {"albedo=0.2", "cloth_albedo=0.6", "cloth=0.25"}, 0.3},
    };
    for (size_t m = 0; m < sizeof rows / sizeof rows[0]; m++) {
        weft_preview_surface surface = surface_of(rows[m].model, 4, 4);
        weft_preview_view view = view_of(4, 4, 0, 90);
        weft_image picture;
        view.n_lights = 0;
        view.ambient = 0.4;
        set_params(&surface, rows[m].params);
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        assert_near(pixel(&picture, 1, 2, 2), 0.4 * rows[m].matte, 1e-6);
        weft_image_fini(&picture);
    }
}

/* Ball lamps with lobes that do not stand about the mirrored ray keep their 24 points. */
static void test_representative_point_is_for_glossy_models(void **state)
{
    (void)state;
    static const char *const models[] = {"ggx", "cloth", "ggx-cloth", "charlie", "unreal"};
    for (int m = 0; m < 5; m++) {
        weft_preview_surface surface = surface_of(models[m], 12, 12);
        weft_preview_view view = view_of(12, 12, 0, 90);
        weft_image points, representative;
        surface.mm_per_px = 1;
        view.lights[0].kind = WEFT_PREVIEW_BALL;
        view.lights[0].position_mm[2] = 30;
        view.lights[0].radius_mm = 15;
        assert_ok(weft_preview_render(&surface, &view, &points, err));
        view.lights[0].area = WEFT_PREVIEW_REPRESENTATIVE;
        assert_ok(weft_preview_render(&surface, &view, &representative, err));
        const bool same = memcmp(points.data, representative.data, 3 * 144 * sizeof *points.data) == 0;
        assert_true(same == (m > 0));
        weft_image_fini(&points);
        weft_image_fini(&representative);
    }
}

/* A point light: E D^2/r^2 cos at each place, in mm. */
static void test_point_light(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 100, 100);
    weft_preview_view view = view_of(100, 100, 0, 0);
    const double p[3] = {30, -20, 40};
    weft_image picture;
    surface.mm_per_px = 0.5;
    surface.origin_mm[0] = -20; /* the middle is at (4.75, 5.25) */
    surface.origin_mm[1] = 30;
    view.lights[0].kind = WEFT_PREVIEW_POINT;
    memcpy(view.lights[0].position_mm, p, sizeof p);
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int y = 5; y < 100; y += 30)
        for (int x = 5; x < 100; x += 30) {
            const double at[2] = {-20 + x * 0.5, 30 - y * 0.5};
            const double r2 = pow(p[0] - at[0], 2) + pow(p[1] - at[1], 2) + p[2] * p[2];
            const double d2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
            assert_near(pixel(&picture, 0, x, y), 0.5 * d2 / r2 * p[2] / sqrt(r2), 1e-3);
        }
    weft_image_fini(&picture);
}

/* Slopes to the right and upwards brighten under light from there: n.l exactly. */
static void test_slopes_face_their_light(void **state)
{
    (void)state;
    static const struct {
        double slope[3], azimuth;
    } cases[] = {{{0.5, 0, 0.8660254}, 0},
                 {{0.5, 0, 0.8660254}, 180},
                 {{0, 0.5, 0.8660254}, 90},
                 {{0, 0.5, 0.8660254}, 270}};
    for (int i = 0; i < 4; i++) {
        const double *const n = cases[i].slope;
        weft_preview_surface surface = surface_of("lambert", 16, 16);
        weft_preview_view view = view_of(16, 16, cases[i].azimuth, 40);
        weft_image normal = constant_image(16, 16, n[0], n[1], n[2]), picture;
        surface.normal = &normal;
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        const double side = (i % 2 ? -0.5 : 0.5) * cos(40 * WEFT_PI / 180);
        assert_near(pixel(&picture, 1, 8, 8), 0.5 * (side + 0.8660254 * sin(40 * WEFT_PI / 180)), 1e-6);
        weft_image_fini(&picture);
        weft_image_fini(&normal);
    }
}

static void test_picture_is_the_right_way_up(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 40, 20);
    weft_preview_view view = view_of(80, 80, 0, 90); /* the map lies in the middle, 80 x 40 */
    weft_image albedo = constant_image(40, 20, 0, 0, 0.5), picture;
    view.background = 0.07;
    for (int y = 0; y < 10; y++)
        for (int x = 0; x < 20; x++)
            weft_image_row(&albedo, 0, y)[x] = 1; /* red at the top left */
    assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    assert_near(pixel(&picture, 0, 5, 25), 1, 1e-6);
    assert_near(pixel(&picture, 0, 5, 55), 0, 1e-6);
    assert_near(pixel(&picture, 0, 75, 25), 0, 1e-6);
    assert_near(pixel(&picture, 2, 75, 55), 0.5, 1e-6);
    assert_near(pixel(&picture, 2, 40, 10), 0.07, 1e-6);
    assert_near(pixel(&picture, 2, 40, 70), 0.07, 1e-6);
    weft_image_fini(&picture);
    weft_image_fini(&albedo);
}

/* n.l on the ball, dark behind the terminator, for both cameras. */
static void test_sphere_terminator(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 64, 64);
    for (int perspective = 0; perspective < 2; perspective++) {
        weft_preview_view view = view_of(200, 200, 0, 0); /* from +X, in the plane of the picture */
        weft_image picture;
        view.shape = WEFT_PREVIEW_SPHERE;
        view.fov_deg = perspective ? 30 : 0;
        assert_ok(weft_preview_render(&surface, &view, &picture, err));
        for (int y = 0; y < 200; y++)
            for (int x = 0; x < 200; x++) {
                const double px = (x - 99.5) / 92, py = (99.5 - y) / 92, r = sqrt(px * px + py * py);
                if (r > 1.03)
                    assert_near(pixel(&picture, 0, x, y), 0.18, 1e-6);
                if (r < 0.95 && px < -0.02)
                    assert_near(pixel(&picture, 0, x, y), 0, 1e-6);
                if (r < 0.95 && px > 0.02 && !perspective)
                    assert_near(pixel(&picture, 0, x, y), 0.5 * px, 1e-3);
                if (r < 0.95 && px > 0.02 &&
                    perspective) /* nearer to the eye the same pixel shows more side */
                    assert_true(pixel(&picture, 0, x, y) < 0.5 * px + 1e-3 &&
                                pixel(&picture, 0, x, y) > 0.35 * px);
            }
        weft_image_fini(&picture);
    }
}

/* On the ball the map repeats mirrored, and so must the slope; the frame follows the surface. */
static void test_sphere_mirrors_normals(void **state)
{
    (void)state;
    enum { SIZE = 300 };
    weft_preview_surface surface = surface_of("lambert", 64, 64);
    weft_preview_view view = view_of(SIZE, SIZE, 20, 60);
    weft_image normal = constant_image(64, 64, 0.28, 0, 0.96), picture;
    const double *const l = view.lights[0].direction;
    view.shape = WEFT_PREVIEW_SPHERE;
    view.repeat = 4; /* a tile is an arc of 45 degrees: the first edge is at 22.5 degrees */
    surface.normal = &normal;
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    const double radius = 0.92 * SIZE / 2;
    for (int degrees = -60; degrees <= 60; degrees += 10) {
        const double angle = degrees * WEFT_PI / 180;
        const bool mirrored = abs(degrees) > 22 && abs(degrees) < 68;
        const double slope = mirrored ? -0.28 : 0.28;
        /* along the equator the frame turns about Y: n = slope (cos, 0, -sin) + 0.96 (sin, 0, cos) */
        const double n[3] = {slope * cos(angle) + 0.96 * sin(angle), 0,
                             -slope * sin(angle) + 0.96 * cos(angle)};
        const double nl = n[0] * l[0] + n[2] * l[2];
        const double g = fmin((sin(angle) * l[0] + cos(angle) * l[2]) / (nl * 0.96), 1);
        const double wanted = 0.5 * nl * (g + g * g - g * g * g); /* with the soft terminator */
        const int x = (int)lround(SIZE / 2.0 - 0.5 + radius * sin(angle));
        const double got = 0.5 * (pixel(&picture, 0, x, SIZE / 2 - 1) + pixel(&picture, 0, x, SIZE / 2));
        if (wanted > 0.1)
            assert_near(got, wanted, 0.012); /* half a pixel is up to 0.7 degrees there */
    }
    weft_image_fini(&picture);
    weft_image_fini(&normal);
}

/* The highlight of a flat shiny plane is where the half vector is the normal: x = distance/tan(elevation). */
static void test_perspective_highlight(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("ggx-specular", 100, 100);
    weft_preview_view view = view_of(200, 200, 180, 75);
    weft_image picture;
    int brightest = 0;
    assert_ok(weft_brdf_set(surface.brdf, "alpha=0.05", surface.params, err));
    view.fov_deg = 50;
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int x = 0; x < 200; x++)
        if (pixel(&picture, 0, x, 100) > pixel(&picture, 0, brightest, 100))
            brightest = x;
    const double distance = 100 / tan(25 * WEFT_PI / 180);
    assert_near(brightest - 99.5, -distance / tan(75 * WEFT_PI / 180), 1);
    weft_image_fini(&picture);
}

static void test_mask_shows_the_background(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 60, 60);
    weft_preview_view view = view_of(40, 40, 0, 90);
    weft_image albedo = constant_image(60, 60, 0.6, 0.6, 0.6), picture;
    weft_mask mask;
    assert_ok(weft_mask_init(&mask, 60, 60, 0, err));
    for (int y = 0; y < 60; y++)
        for (int x = 0; x < 60; x++) {
            const bool in = x >= 10 && x < 50 && y >= 10 && y < 50 && !(x < 20 && y < 20);
            mask.data[y * 60 + x] = in ? 255 : 0;
            for (int c = 0; c < 3 && !in; c++)
                weft_image_row(&albedo, c, y)[x] = NAN; /* must not leak in */
        }
    surface.mask = &mask;
    assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
    assert_ok(weft_preview_render(&surface, &view, &picture, err)); /* the box of the mask fills it */
    assert_near(pixel(&picture, 0, 3, 3), 0.18, 1e-6);
    assert_near(pixel(&picture, 0, 39, 0), 0.6, 1e-6);
    assert_near(pixel(&picture, 0, 12, 30), 0.6, 1e-6);
    weft_image_fini(&picture);
    view.crop = (weft_preview_crop){12, 12, 16, 16}; /* half of it lies in the notch */
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    assert_near(pixel(&picture, 0, 10, 10), 0.18, 1e-6);
    assert_near(pixel(&picture, 0, 30, 30), 0.6, 1e-6);
    view.crop.x = 50;
    assert_fails(weft_preview_render(&surface, &view, &(weft_image){0}, err), WEFT_ERR_RANGE, "not inside");
    view.crop.width = 0;
    memset(mask.data, 0, 3600);
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_NODATA, "mask is empty");
    weft_mask_fini(&mask);
    weft_image_fini(&picture);
    weft_image_fini(&albedo);
}

/* Stripes as fine as the samples come out grey, not as slow waves. */
static void test_fine_weaves_do_not_beat(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 1000, 200);
    weft_preview_view view = view_of(317, 60, 0, 90);
    weft_image albedo = constant_image(1000, 200, 0, 0, 0), picture;
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < 200; y++)
            for (int x = 0; x < 1000; x++)
                weft_image_row(&albedo, c, y)[x] = (float)(x / 2 % 2); /* 1.27 pixels a period */
    assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int x = 10; x < 307; x++)
        assert_near(pixel(&picture, 0, x, 30), 0.5, 0.04);
    weft_image_fini(&picture);
    weft_image_fini(&albedo);
}

static void test_threads_do_not_change_it(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("cloth", 50, 50);
    weft_preview_view view = view_of(120, 90, 30, 20);
    weft_image one, three;
    view.shape = WEFT_PREVIEW_SPHERE;
    weft_parallel_set_threads(1);
    assert_ok(weft_preview_render(&surface, &view, &one, err));
    weft_parallel_set_threads(3);
    assert_ok(weft_preview_render(&surface, &view, &three, err));
    weft_parallel_set_threads(0);
    assert_memory_equal(one.data, three.data, sizeof(float) * 3 * 120 * 90);
    weft_image_fini(&one);
    weft_image_fini(&three);
}

static void test_refusals(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 20, 20);
    weft_preview_view view = view_of(10, 10, 0, 90);
    weft_image small = constant_image(10, 20, 0, 0, 1), picture;
    assert_fails(weft_preview_set_map(&surface, "albedo", &small, err), WEFT_ERR_MISMATCH, "10 x 20");
    assert_fails(weft_preview_set_map(&surface, "alpha", &small, err), WEFT_ERR_USAGE, "no parameter alpha");
    surface.normal = &small;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_MISMATCH, "normal map");
    surface.normal = NULL;
    view.lights[0].kind = WEFT_PREVIEW_POINT;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_MISSING, "no");
    view.lights[0].kind = WEFT_PREVIEW_DISTANT;
    view.repeat = 0;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_RANGE, "repeat");
    view.repeat = 1;
    view.width = 0;
    assert_fails(weft_preview_render(&surface, &view, &picture, err), WEFT_ERR_RANGE, "0 x 10");
    weft_image_fini(&small);
}

/* A ball gives a facing card what a point in its middle gives, a small one everywhere; the tube's mean. */
static void test_area_lights(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 60, 60);
    weft_preview_view view = view_of(30, 30, 0, 90);
    weft_image point, ball, small, tube;
    surface.mm_per_px = 0.1;
    surface.origin_mm[0] = -2.95;
    surface.origin_mm[1] = 2.95;
    const double middle[3] = {10, -5, 40};
    view.lights[0].kind = WEFT_PREVIEW_POINT;
    memcpy(view.lights[0].position_mm, middle, sizeof middle);
    assert_ok(weft_preview_render(&surface, &view, &point, err));
    view.lights[0].kind = WEFT_PREVIEW_BALL;
    view.lights[0].radius_mm = 15;
    assert_ok(weft_preview_render(&surface, &view, &ball, err));
    view.lights[0].radius_mm = 0.01;
    assert_ok(weft_preview_render(&surface, &view, &small, err));
    view.lights[0].kind = WEFT_PREVIEW_TUBE;
    memcpy(view.lights[0].end_mm, middle, sizeof middle);
    view.lights[0].position_mm[0] -= 0.02;
    view.lights[0].end_mm[0] += 0.02;
    assert_ok(weft_preview_render(&surface, &view, &tube, err));
    for (int y = 1; y < 29; y++)
        for (int x = 1; x < 29; x++) {
            /* a whole sphere above the horizon lights a plane as its middle would, whatever its size */
            assert_near(pixel(&ball, 0, x, y), pixel(&point, 0, x, y), 0.01);
            assert_near(pixel(&small, 1, x, y), pixel(&point, 1, x, y), 1e-4);
            assert_near(pixel(&tube, 2, x, y), pixel(&point, 2, x, y), 1e-4);
        }
    weft_image_fini(&point);
    weft_image_fini(&ball);
    weft_image_fini(&small);
    weft_image_fini(&tube);
}

/* Both ways to sum a small ball agree: Unreal's point is then the middle. */
static void test_representative_point(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("ggx", 40, 40);
    weft_preview_view view = view_of(20, 20, 0, 90);
    weft_image points, representative;
    surface.mm_per_px = 1;
    view.lights[0].kind = WEFT_PREVIEW_BALL;
    view.lights[0].position_mm[2] = 60;
    view.lights[0].position_mm[0] = 20;
    view.lights[0].radius_mm = 0.05;
    view.fov_deg = 40;
    assert_ok(weft_preview_render(&surface, &view, &points, err));
    view.lights[0].area = WEFT_PREVIEW_REPRESENTATIVE;
    assert_ok(weft_preview_render(&surface, &view, &representative, err));
    for (int i = 0; i < 400; i++)
        assert_near((double)representative.data[i], (double)points.data[i], 0.02 * (double)points.data[i]);
    weft_image_fini(&points);
    weft_image_fini(&representative);
}

/* In an even white room everything shows its own directional albedo. */
static void test_even_surroundings(void **state)
{
    (void)state;
    static weft_environment_table table;
    static const char *const models[] = {"lambert", "ggx-specular", "cloth", "charlie"};
    weft_image white, picture;
    weft_environment_map map;
    /* seen straight on at one width only: the table's other places do not count */
    const weft_environment_share share = weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, 0.3, 1, 0);
    for (int i = 0; i < WEFT_ENVIRONMENT_TABLE_SIZE * WEFT_ENVIRONMENT_TABLE_SIZE; i++) {
        (&table.share[0][0][0])[i] = (float)share.scale;
        (&table.share[1][0][0])[i] = (float)share.bias;
    }
    assert_ok(weft_image_init(&white, 32, 16, 1, err));
    for (int i = 0; i < 512; i++)
        white.data[i] = 1;
    assert_ok(weft_environment_map_init(&map, &white, err));
    for (int m = 0; m < 4; m++) {
        weft_preview_surface surface = surface_of(models[m], 8, 8);
        weft_preview_view view = view_of(8, 8, 0, 90);
        double albedo[3];
        view.n_lights = 0;
        view.surroundings = (weft_preview_surroundings){&map, &table, 2};
        assert_ok(weft_preview_render(&surface, &view, &picture, err)); /* seen straight on */
        weft_brdf_albedo(surface.brdf, surface.params, 1, 0, WEFT_ALBEDO_QUICK, albedo);
        assert_near(pixel(&picture, 0, 4, 4), 2 * albedo[0], 0.02);
        weft_image_fini(&picture);
    }
    weft_environment_map_fini(&map);
    weft_image_fini(&white);
}

/* A room with a bright window on one side and a floor half as bright as the rest. */
static double room(const double d[3])
{
    const double window = 0.6 * d[0] + 0.3 * d[1] + 0.7416198487 * d[2];
    return (window > 0.9 ? 12 : 1) * (d[2] < 0 ? 0.5 : 1);
}

/* f n.l L over the whole hemisphere, by the middle of 200 x 400 cells even in cosine. */
static double reflected(const weft_preview_surface *surface, const double frame[3][3], const double view[3])
{
    double sum = 0, local[3];
    for (int c = 0; c < 3; c++)
        local[c] = frame[c][0] * view[0] + frame[c][1] * view[1] + frame[c][2] * view[2];
    for (int i = 0; i < 200; i++)
        for (int k = 0; k < 400; k++) {
            double l[3], value[3], world[3];
            weft_brdf_direction((i + 0.5) / 200, 2 * 3.141592653589793 * (k + 0.5) / 400, l);
            for (int c = 0; c < 3; c++)
                world[c] = l[0] * frame[0][c] + l[1] * frame[1][c] + l[2] * frame[2][c];
            weft_brdf_eval_one(surface->brdf, surface->params, l, local, value);
            sum += value[0] * l[2] * room(world) * 2 * 3.141592653589793 / (200 * 400);
        }
    return sum;
}

/* Cloth and the like in a room that three bands cannot hold. */
static void test_room_on_cloth(void **state)
{
    (void)state;
    static weft_environment_table table;
    static const char *const models[] = {"cloth", "cloth-two-tone", "charlie", "lambert"};
    weft_image panorama;
    weft_environment_map map;
    double mean = 0;
    assert_ok(weft_image_init(&panorama, 256, 128, 1, err));
    for (int y = 0; y < 128; y++)
        for (int x = 0; x < 256; x++) {
            const double up = (0.5 - (y + 0.5) / 128) * 3.141592653589793,
                         round = (x - 127.5) / 256 * 2 * 3.141592653589793;
            const double d[3] = {cos(up) * sin(round), cos(up) * cos(round), sin(up)};
            weft_image_row(&panorama, 0, y)[x] = (float)room(d);
        }
    assert_ok(weft_environment_map_init(&map, &panorama, err));
    for (int m = 0; m < 4; m++)
        for (int tilt = 0; tilt < 4; tilt++) {
            weft_preview_surface surface = surface_of(models[m], 8, 8);
            weft_preview_view view = view_of(8, 8, 0, 90);
            const double angle = 0.4 * tilt - 0.4, n[3] = {sin(angle), 0, cos(angle)};
            weft_image normal = constant_image(8, 8, n[0], n[1], n[2]), picture;
            const double frame[3][3] = {{n[2], 0, -n[0]}, {0, 1, 0}, {n[0], n[1], n[2]}}, up[3] = {0, 0, 1};
            surface.normal = &normal;
            view.n_lights = 0;
            view.surroundings = (weft_preview_surroundings){&map, &table, 1};
            assert_ok(weft_preview_render(&surface, &view, &picture, err));
            const double wanted = reflected(&surface, frame, up);
            print_message("%s tilted %.1f: %.4f, whole hemisphere %.4f\n", models[m], angle,
                          pixel(&picture, 0, 4, 4), wanted);
            const double off = fabs(pixel(&picture, 0, 4, 4) / wanted - 1);
            assert_true(off < 0.12);
            mean += off / 16;
            weft_image_fini(&picture);
            weft_image_fini(&normal);
        }
    assert_true(mean < 0.025);
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
}

/* The roll and the drape face the viewer where they are flat: n.l from there. */
static void test_roll_and_drape(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 64, 64);
    weft_preview_view view = view_of(200, 200, 0, 0);
    weft_image picture;
    view.shape = WEFT_PREVIEW_CYLINDER;
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int x = 100; x < 200; x++) {
        const double px = (x - 99.5) / 70;
        if (px > 1.03)
            assert_near(pixel(&picture, 0, x, 100), 0.18, 1e-6);
        if (px > 0.02 && px < 0.96)
            assert_near(pixel(&picture, 0, x, 100), 0.5 * px, 2e-3);
    }
    weft_image_fini(&picture);
    view = view_of(200, 200, 0, 30);
    view.shape = WEFT_PREVIEW_DRAPE;
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    double darkest = 1, brightest = 0;
    for (int x = 20; x < 180; x++) {
        darkest = fmin(darkest, pixel(&picture, 0, x, 180));
        brightest = fmax(brightest, pixel(&picture, 0, x, 180));
    }
    assert_near(darkest, 0, 1e-6); /* behind the folds */
    assert_true(brightest > 0.45 && brightest < 0.501);
    assert_near(pixel(&picture, 0, 3, 3), 0.18, 1e-6);
    weft_image_fini(&picture);
}

/* One sample a pixel: the flat plane is the same, and each map pixel its own. */
static void test_draft(void **state)
{
    (void)state;
    weft_preview_surface surface = surface_of("lambert", 300, 40);
    weft_preview_view view = view_of(300, 40, 0, 90);
    weft_image albedo = constant_image(300, 40, 0.5, 0.5, 0.5), picture;
    for (int x = 0; x < 300; x++)
        weft_image_row(&albedo, 1, 20)[x] = (float)(x / 300.0);
    view.draft = true;
    assert_ok(weft_preview_set_map(&surface, "albedo", &albedo, err));
    assert_ok(weft_preview_render(&surface, &view, &picture, err));
    for (int x = 0; x < 300; x++) {
        assert_near(pixel(&picture, 1, x, 20), x / 300.0, 1e-6);
        assert_near(pixel(&picture, 1, x, 21), 0.5, 1e-6);
    }
    weft_image_fini(&picture);
    weft_image_fini(&albedo);
}

static void test_tone_curves(void **state)
{
    (void)state;
    double grey[3] = {0.18, 0.18, 0.18}, bright[3] = {1e5, 1e5, 1e5}, odd[3] = {-1, NAN, 0};
    weft_tone_apply(WEFT_TONE_AGX, grey); /* the pivot of its curve */
    assert_near(pow(grey[0], 1 / 2.2), 0.5, 0.01);
    assert_near(grey[0], grey[2], 1e-3);
    weft_tone_apply(WEFT_TONE_AGX, bright);
    assert_true(bright[0] > 0.95 && bright[0] <= 1);
    weft_tone_apply(WEFT_TONE_ACES, odd);
    assert_near(odd[0] + odd[1] + odd[2], 0, 1e-9);
    for (int tone = WEFT_TONE_ACES; tone <= WEFT_TONE_AGX; tone++) {
        double last = 0;
        for (int i = 0; i < 145; i++) {
            const double x = 0.001 * pow(1.1, i);
            double rgb[3] = {x, x, x};
            weft_tone_apply((weft_tone)tone, rgb);
            assert_true(rgb[1] >= last && rgb[1] <= 1);
            last = rgb[1];
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_plane),
        cmocka_unit_test(test_point_light),
        cmocka_unit_test(test_slopes_face_their_light),
        cmocka_unit_test(test_picture_is_the_right_way_up),
        cmocka_unit_test(test_sphere_terminator),
        cmocka_unit_test(test_sphere_mirrors_normals),
        cmocka_unit_test(test_perspective_highlight),
        cmocka_unit_test(test_mask_shows_the_background),
        cmocka_unit_test(test_fine_weaves_do_not_beat),
        cmocka_unit_test(test_threads_do_not_change_it),
        cmocka_unit_test(test_area_lights),
        cmocka_unit_test(test_ambient_light),
        cmocka_unit_test(test_representative_point_is_for_glossy_models),
        cmocka_unit_test(test_representative_point),
        cmocka_unit_test(test_even_surroundings),
        cmocka_unit_test(test_room_on_cloth),
        cmocka_unit_test(test_roll_and_drape),
        cmocka_unit_test(test_draft),
        cmocka_unit_test(test_tone_curves),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
