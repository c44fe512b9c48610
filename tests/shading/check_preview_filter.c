/* Maps with chains of mips: minified pictures against ones of which every texel is shaded. */
#include "tests/support/support.h"

#include "core/parallel.h"
#include "shading/bake/mips.h"
#include "shading/preview/preview.h"

#include <math.h>
#include <string.h>

enum { SIDE = 512, PICTURE = 64 };

/* A plain weave of glossy yarns in two colours: both normals and albedo change from yarn to yarn. */
static void make_weave(weft_baked *baked, double period, double alpha)
{
    assert_ok(weft_baked_init(baked, "weave", NULL, err));
    assert_ok(weft_baked_add(baked, WEFT_BAKED_NORMAL, SIDE, SIDE, err));
    assert_ok(weft_baked_add(baked, WEFT_BAKED_ALBEDO, SIDE, SIDE, err));
    baked->maps[WEFT_BAKED_ROUGHNESS].constant[0] = (float)alpha;
    weft_image *const normal = &baked->maps[WEFT_BAKED_NORMAL].mips[0];
    weft_image *const albedo = &baked->maps[WEFT_BAKED_ALBEDO].mips[0];
    const double k = 2 * 3.14159265358979323846 / period;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const bool warp = (x / (int)period + y / (int)period) % 2 == 0; /* which yarn is on top */
            const double a = warp ? 0.7 * sin(k * x) : 0.1 * sin(k * x);
            const double b = warp ? 0.1 * sin(k * y) : 0.5 * sin(k * y), z = 1 / sqrt(1 + a * a + b * b);
            const double n[3] = {-a * z, -b * z, z}, colour[3] = {0.5, 0.05, 0.05};
            for (int c = 0; c < 3; c++) {
                weft_image_row(normal, c, y)[x] = (float)n[c];
                weft_image_row(albedo, c, y)[x] = (float)(warp ? colour[c] : 0.3 - 0.5 * colour[c]);
            }
        }
    const weft_mip_options options = weft_mip_defaults();
    assert_ok(weft_mips_make(baked, &options, err));
}

static weft_preview_surface surface_of(const weft_baked *baked)
{
    weft_preview_surface surface = {.width = SIDE, .height = SIDE, .mm_per_px = 0.1};
    int plane = 0;
    assert_ok(weft_brdf_find("ggx", &surface.brdf, err));
    weft_brdf_defaults(surface.brdf, surface.params);
    assert_ok(weft_brdf_set(surface.brdf, "f0=0.2", surface.params, err));
    surface.normal = baked->maps[WEFT_BAKED_NORMAL].mips;
    surface.normal_levels = baked->maps[WEFT_BAKED_NORMAL].n_mips;
    assert_non_null(weft_brdf_find_param(surface.brdf, "albedo", &plane));
    for (int c = 0; c < 3; c++)
        surface.maps[plane + c] =
            (weft_preview_map){baked->maps[WEFT_BAKED_ALBEDO].mips, c, baked->maps[WEFT_BAKED_ALBEDO].n_mips};
    assert_non_null(weft_brdf_find_param(surface.brdf, "alpha", &plane));
    surface.maps[plane] = (weft_preview_map){baked->maps[WEFT_BAKED_ROUGHNESS].mips, 0,
                                             baked->maps[WEFT_BAKED_ROUGHNESS].n_mips};
    return surface;
}

static weft_image look(const weft_preview_surface *surface, weft_preview_shape shape,
                       weft_preview_filter filter, bool draft)
{
    weft_preview_view view = weft_preview_view_defaults();
    weft_image picture;
    view.width = view.height = PICTURE;
    view.shape = shape;
    view.filter = filter;
    view.draft = draft;
    view.exposure_ev = -1;
    weft_preview_direction(120, shape == WEFT_PREVIEW_PLANE ? 65 : 45, view.lights[0].direction);
    assert_ok(weft_preview_render(surface, &view, &picture, err));
    return picture;
}

/* PSNR in dB over pictures cut at 1, and the ratio of their means. */
static double psnr(const weft_image *a, const weft_image *b, double *ratio)
{
    double error = 0, sum_a = 0, sum_b = 0;
    const size_t n = 3 * weft_image_plane_size(a);
    for (size_t i = 0; i < n; i++) {
        const double x = fmin((double)a->data[i], 1), y = fmin((double)b->data[i], 1);
        error += (x - y) * (x - y);
        sum_a += x;
        sum_b += y;
    }
    *ratio = sum_a / sum_b;
    return -10 * log10(error / (double)n);
}

static const char *const shapes[] = {"plane", "sphere", "cylinder", "drape"};

/* Eight texels a pixel: filtered pictures are near those of every texel, unfiltered ones are not. */
static void check_minified(int period, double alpha, weft_preview_shape shape, double least_db)
{
    weft_baked baked = {0};
    double ratio;
    make_weave(&baked, period, alpha);
    weft_preview_surface surface = surface_of(&baked);
    weft_image every = look(&surface, shape, WEFT_PREVIEW_SAMPLES, false);
    weft_image points = look(&surface, shape, WEFT_PREVIEW_SAMPLES, true);
    weft_image filtered = look(&surface, shape, WEFT_PREVIEW_ANISOTROPIC, false);
    weft_image draft = look(&surface, shape, WEFT_PREVIEW_ANISOTROPIC, true);
    const double points_db = psnr(&points, &every, &ratio), draft_db = psnr(&draft, &every, &ratio);
    const double db = psnr(&filtered, &every, &ratio);
    print_message("  yarns of %2d texels, alpha %.2f, %-9s %.1f dB (mean %.3f), one sample a pixel %.1f dB, "
                  "unfiltered %.1f dB\n",
                  period, alpha, shapes[shape], db, ratio, draft_db, points_db);
    assert_true(db > least_db && fabs(ratio - 1) < 0.07);
    assert_true(db > points_db + 5 && draft_db > points_db + 2.5);
    weft_image_fini(&every);
    weft_image_fini(&points);
    weft_image_fini(&filtered);
    weft_image_fini(&draft);
    weft_baked_fini(&baked);
}

static void test_minified(void **state)
{
    (void)state;
    check_minified(20, 0.35, WEFT_PREVIEW_PLANE, 43);
    check_minified(20, 0.15, WEFT_PREVIEW_SPHERE, 33);
    check_minified(20, 0.35, WEFT_PREVIEW_SPHERE, 43);
    check_minified(4, 0.35, WEFT_PREVIEW_SPHERE, 43);
    check_minified(20, 0.35, WEFT_PREVIEW_CYLINDER, 43);
    check_minified(4, 0.35, WEFT_PREVIEW_DRAPE, 43);
}

/* Stripes round a roll, seen ever flatter towards its edges: look-ups along the footprint keep them there. */
static void test_anisotropic_keeps_stripes_at_the_edge(void **state)
{
    (void)state;
    weft_baked baked = {0};
    make_weave(&baked, 16, 0.5);
    weft_image *const albedo = &baked.maps[WEFT_BAKED_ALBEDO].mips[0];
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++)
                weft_image_row(albedo, c, y)[x] = y / 10 % 2 ? 0.9F : 0.1F;
    const weft_mip_options options = weft_mip_defaults();
    assert_ok(weft_mips_make(&baked, &options, err));
    weft_preview_surface surface = surface_of(&baked);
    surface.normal = NULL;
    double contrast[3];
    for (int filter = 0; filter < 3; filter++) {
        weft_image picture = look(&surface, WEFT_PREVIEW_CYLINDER, (weft_preview_filter)filter, false);
        const int x = 10; /* the roll's edge is at 9.6 */
        double high = 0, low = 1e9;
        for (int y = 24; y < 40; y++) {
            const double v = (double)weft_image_row(&picture, 1, y)[x];
            high = fmax(high, v);
            low = fmin(low, v);
        }
        contrast[filter] = (high - low) / (high + low);
        weft_image_fini(&picture);
    }
    print_message("  contrast at the edge: every texel %.3f, trilinear %.3f, anisotropic %.3f\n", contrast[0],
                  contrast[1], contrast[2]);
    assert_true(contrast[2] > 0.7 * contrast[0] && contrast[1] < 0.4 * contrast[0]);
    weft_baked_fini(&baked);
}

/* Magnified, a chain is not looked at: the picture is that of level 0. */
static void test_magnified(void **state)
{
    (void)state;
    weft_baked baked = {0};
    make_weave(&baked, 20, 0.3);
    weft_preview_surface surface = surface_of(&baked);
    weft_preview_view view = weft_preview_view_defaults();
    weft_image filtered, plain;
    view.width = view.height = 96;
    view.crop = (weft_preview_crop){40, 60, 24, 24};
    view.draft = true;
    assert_ok(weft_preview_render(&surface, &view, &filtered, err));
    view.filter = WEFT_PREVIEW_SAMPLES;
    assert_ok(weft_preview_render(&surface, &view, &plain, err));
    double worst = 0; /* not at the crop's edges, which repeat in one and go on in the other */
    for (int c = 0; c < 3; c++)
        for (int y = 4; y < 92; y++)
            for (int x = 4; x < 92; x++)
                worst = fmax(worst, fabs((double)weft_image_row(&filtered, c, y)[x] -
                                         (double)weft_image_row(&plain, c, y)[x]));
    print_message("  largest difference of magnified pictures %.1e\n", worst);
    assert_near(worst, 0, 1e-3);
    weft_image_fini(&filtered);
    weft_image_fini(&plain);
    weft_baked_fini(&baked);
}

/* A texture made once gives what one made for the picture gives, to the bit; one too coarse is not used; and
 * the number of threads does not matter. */
static void test_textures_are_used_again(void **state)
{
    (void)state;
    weft_baked baked = {0};
    weft_preview_texture texture;
    make_weave(&baked, 20, 0.3);
    weft_preview_surface surface = surface_of(&baked);
    weft_image once = look(&surface, WEFT_PREVIEW_SPHERE, WEFT_PREVIEW_ANISOTROPIC, true);
    for (int first = 0; first <= 5; first += 5) {
        assert_ok(weft_preview_texture_init(&texture, &surface, first, err));
        surface.texture = &texture;
        weft_parallel_set_threads(first ? 3 : 1);
        weft_image again = look(&surface, WEFT_PREVIEW_SPHERE, WEFT_PREVIEW_ANISOTROPIC, true);
        assert_memory_equal(again.data, once.data, 3 * weft_image_plane_size(&once) * sizeof *once.data);
        weft_image_fini(&again);
        weft_preview_texture_fini(&texture);
    }
    weft_parallel_set_threads(0);
    weft_image_fini(&once);
    weft_baked_fini(&baked);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_minified),
        cmocka_unit_test(test_anisotropic_keeps_stripes_at_the_edge),
        cmocka_unit_test(test_magnified),
        cmocka_unit_test(test_textures_are_used_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
