/* Holes, tears, creases and lint of cloths that are given by formulas. */
#include "host/set/compare.h"
#include "host/solve/alpha.h"
#include "host/solve/components.h"
#include "host/solve/flaws.h"
#include "tests/support/support.h"

#include <math.h>
#include <string.h>

enum { W = 360, H = 240 };

static const double mm = 0.125, pitch = 1.6, ground = 0.02;
static weft_error error;

/* World place of a pixel's middle. */
static double x_of(int u)
{
    return (u - (W - 1) / 2.0) * mm;
}

static double y_of(int v)
{
    return ((H - 1) / 2.0 - v) * mm;
}

static void make_maps(weft_maps *m)
{
    *m = (weft_maps){.width = W,
                     .height = H,
                     .geometry = WEFT_GEOMETRY_PLANE,
                     .mm_per_px = mm,
                     .origin_mm = {x_of(0), y_of(0)},
                     .albedo_is_srgb = true};
    assert_ok(weft_image_init(&m->normal, W, H, 3, err));
    assert_ok(weft_image_init(&m->albedo, W, H, 3, err));
    assert_ok(weft_mask_init(&m->mask, W, H, 255, err));
    m->info = json_pack("{s:{}}", "result");
}

static void put_slope(weft_maps *m, int u, int v, double p, double q)
{
    const double over = 1 / sqrt(1 + p * p + q * q);
    weft_image_row(&m->normal, 0, v)[u] = (float)(-p * over);
    weft_image_row(&m->normal, 1, v)[u] = (float)(-q * over);
    weft_image_row(&m->normal, 2, v)[u] = (float)over;
}

static void put_colour(weft_maps *m, int u, int v, double r, double g, double b)
{
    weft_image_row(&m->albedo, 0, v)[u] = (float)r;
    weft_image_row(&m->albedo, 1, v)[u] = (float)g;
    weft_image_row(&m->albedo, 2, v)[u] = (float)b;
}

/* How much of a pixel whose middle is `d` mm inside an edge is inside. */
static double inside(double d)
{
    return fmin(fmax(0.5 + d / mm, 0), 1);
}

/* A plain weave with slopes to 25 degrees; every fourth yarn is dark. */
static void weave(weft_maps *m)
{
    const double k = 3.14159265358979 / pitch;
    for (int v = 0; v < H; v++)
        for (int u = 0; u < W; u++) {
            const double x = x_of(u), y = y_of(v);
            const double yarn = (int)floor(x / pitch + 1000) % 4 == 0 ? 0.15 : 0.5;
            put_slope(m, u, v, 0.45 * cos(k * x) * sin(k * y), 0.45 * sin(k * x) * cos(k * y));
            put_colour(m, u, v, yarn, 0.9 * yarn, 0.8 * yarn);
        }
}

/* Lays a thing of `colour` that covers `share` over a pixel. */
static void cover(weft_maps *m, int u, int v, double share, double colour)
{
    for (int c = 0; c < 3; c++) {
        float *const at = &weft_image_row(&m->albedo, c, v)[u];
        *at = (float)((1 - share) * (double)*at + share * colour);
    }
}

static void fold(weft_maps *m, weft_mask *truth)
{
    for (int v = 0; v < H; v++)
        for (int u = 0; u < W; u++) {
            const double d = 0.8 * x_of(u) + 0.6 * y_of(v) + 6, far = sqrt(d * d + 0.16);
            const double steep = -0.25 * exp(-far / 4) * d / far;
            const double z = (double)weft_image_row(&m->normal, 2, v)[u];
            put_slope(m, u, v, 0.8 * steep - (double)weft_image_row(&m->normal, 0, v)[u] / z,
                      0.6 * steep - (double)weft_image_row(&m->normal, 1, v)[u] / z);
            if (fabs(d) < 0.25)
                truth->data[v * W + u] |= WEFT_FLAW_CREASE;
        }
}

/* An arc of 12 mm, a fibre 0.2 mm thick. */
static void drop_fibre(weft_maps *m, weft_mask *truth)
{
    for (int v = 0; v < H; v++)
        for (int u = 0; u < W; u++) {
            const double x = x_of(u) - 8, y = y_of(v) + 2, r = hypot(x, y);
            const double share = y < 0 ? 0 : inside(0.1 - fabs(r - 4));
            if (share > 0)
                truth->data[v * W + u] |= WEFT_FLAW_LINT;
            cover(m, u, v, share, 0.03);
        }
}

static void tear(weft_maps *m, weft_mask *truth)
{
    for (int v = 0; v < H; v++)
        for (int u = 0; u < W; u++) {
            const double x = (x_of(u) + 14) / 3, y = y_of(v) - 6;
            const double share = inside(0.6 * (1 - x * x) - fabs(y));
            if (share > 0)
                truth->data[v * W + u] |= WEFT_FLAW_TEAR;
            cover(m, u, v, share, ground);
        }
}

static void nothing_on_a_clean_cloth(void **state)
{
    (void)state;
    weft_maps m;
    weft_flaws_found found[WEFT_N_FLAWS];
    make_maps(&m);
    weave(&m);
    assert_ok(weft_maps_find_alpha(&m, ground, err));
    for (int i = 0; i < W * H; i++)
        assert_true(m.alpha.data[i] == 1); /* dark yarns are no holes */
    assert_ok(weft_maps_find_flaws(&m, found, err));
    for (int i = 0; i < W * H; i++)
        assert_int_equal(m.flaws.data[i], 0);
    assert_int_equal(found[0].n + found[1].n + found[2].n, 0);
    weft_maps_fini(&m);
}

static void each_flaw_is_found_where_it_is(void **state)
{
    (void)state;
    weft_maps m, truth;
    weft_flaws_found found[WEFT_N_FLAWS];
    weft_maps_difference d;
    make_maps(&m);
    make_maps(&truth);
    assert_ok(weft_mask_init(&truth.flaws, W, H, 0, err));
    weave(&m);
    fold(&m, &truth.flaws);
    drop_fibre(&m, &truth.flaws);
    tear(&m, &truth.flaws);
    memset(truth.normal.data, 0, (size_t)W * H * 2 * sizeof(float));
    for (int i = 0; i < W * H; i++)
        truth.normal.data[2 * W * H + i] = 1;
    assert_ok(weft_maps_find_alpha(&m, ground, err));
    assert_ok(weft_maps_find_flaws(&m, found, err));
    assert_ok(weft_compare_maps(&m, &truth, NULL, &d, err));
    assert_true(d.has_flaws && !d.has_alpha);
    for (int k = 0; k < WEFT_N_FLAWS; k++) {
        const weft_flaw_match *const f = &d.flaws[k];
        print_message("flaw %d: %zu px, %zu of them right; truth %zu px, %zu of them found\n", 1 << k, f->a,
                      f->hits, f->b, f->found);
        assert_int_equal(found[k].n, 1);
        assert_true(f->a > 0 && (double)f->hits > 0.97 * (double)f->a);
        assert_true((double)f->found > 0.97 * (double)f->b);
    }
    json_t *const lint = json_object_get(json_object_get(json_object_get(m.info, "result"), "flaws"), "lint");
    assert_int_equal(json_integer_value(json_object_get(lint, "n")), 1);
    weft_maps_fini(&m);
    weft_maps_fini(&truth);
}

/* Yarns 0.7 mm wide, light and dark ones: alpha is the share of a pixel that they cover. */
static void make_net(weft_maps *m, weft_image *truth)
{
    for (int v = 0; v < H; v++)
        for (int u = 0; u < W; u++) {
            const double x = x_of(u) / pitch, y = y_of(v) / pitch;
            const double ax = inside(0.35 - fabs(x - round(x)) * pitch),
                         ay = inside(0.35 - fabs(y - round(y)) * pitch);
            const double share = 1 - (1 - ax) * (1 - ay), yarn = (int)(round(y) + 1000) % 3 ? 0.6 : 0.2;
            put_slope(m, u, v, 0, 0);
            put_colour(m, u, v, ground, ground, ground);
            cover(m, u, v, ax, 0.6);
            cover(m, u, v, ay, yarn);
            weft_image_row(truth, 0, v)[u] = (float)share;
        }
}

static void net_is_as_open_as_it_is(void **state)
{
    (void)state;
    weft_maps m;
    weft_image truth;
    weft_flaws_found found[WEFT_N_FLAWS];
    double sum = 0, open = 0, true_open = 0;
    make_maps(&m);
    assert_ok(weft_image_init(&truth, W, H, 1, err));
    make_net(&m, &truth);
    assert_ok(weft_maps_find_alpha(&m, ground, err));
    for (int i = 0; i < W * H; i++) {
        sum += fabs((double)m.alpha.data[i] - (double)truth.data[i]) / (W * H);
        open += (1 - (double)m.alpha.data[i]) / (W * H);
        true_open += (1 - (double)truth.data[i]) / (W * H);
    }
    print_message("net: %.4f open, truth %.4f, mean |difference| %.4f\n", open, true_open, sum);
    assert_true(true_open > 0.3);
    assert_near(open, true_open, 0.02); /* what an edge's yarn is like is a guess from both yarns */
    assert_true(sum < 0.03);
    assert_ok(weft_maps_find_flaws(&m, found, err)); /* its holes are no tears, its yarns no lint */
    assert_int_equal(found[0].n + found[1].n + found[2].n, 0);
    weft_image_fini(&truth);
    weft_maps_fini(&m);
}

/* A net with four of its holes made one. */
static void tear_in_a_net(void **state)
{
    (void)state;
    weft_maps m;
    weft_image truth;
    weft_flaws_found found[WEFT_N_FLAWS];
    make_maps(&m);
    assert_ok(weft_image_init(&truth, W, H, 1, err));
    make_net(&m, &truth);
    for (int v = 0; v < H; v++)
        for (int u = 0; u < W; u++)
            if (fabs(x_of(u)) < 3 && fabs(y_of(v)) < 1.5)
                cover(&m, u, v, 1, ground);
    assert_ok(weft_maps_find_alpha(&m, ground, err));
    assert_ok(weft_maps_find_flaws(&m, found, err));
    assert_int_equal(found[0].n, 1);
    assert_true(found[0].area_mm2 > 18 && found[0].area_mm2 < 30); /* 6 x 3 mm and the holes it touches */
    assert_true(m.flaws.data[H / 2 * W + W / 2] & WEFT_FLAW_TEAR);
    weft_image_fini(&truth);
    weft_maps_fini(&m);
}

static void what_cannot_be_found_is_refused(void **state)
{
    (void)state;
    weft_maps m;
    make_maps(&m);
    weave(&m);
    assert_int_equal(weft_maps_find_alpha(&m, 0.24, &error), WEFT_ERR_NODATA);
    assert_non_null(strstr(error.text, "--ground 0.24"));
    m.mm_per_px = 0.3;
    assert_int_equal(weft_maps_find_flaws(&m, NULL, &error), WEFT_ERR_RANGE);
    m.geometry = WEFT_GEOMETRY_SENSOR;
    assert_int_equal(weft_maps_find_flaws(&m, NULL, &error), WEFT_ERR_MISSING);
    assert_int_equal(weft_maps_find_alpha(&m, 0.02, &error), WEFT_ERR_MISSING);
    weft_maps_fini(&m);
}

static bool keep_large(const weft_component *c, void *context)
{
    int *const n = context;
    (*n)++;
    return c->area >= 4;
}

static void regions(void **state)
{
    (void)state;
    static const char picture[] = "1.....22"
                                  ".2...1.."
                                  "..1.1..."
                                  "11.2....";
    /* the one from the top left corner and the one from the right touch in the third row: one region */
    uint8_t data[32];
    weft_mask marks = {8, 4, data};
    int n = 0;
    for (int i = 0; i < 32; i++)
        data[i] = picture[i] == '.' ? 0 : (uint8_t)(picture[i] - '0');
    assert_ok(weft_components_keep(&marks, keep_large, &n, err));
    assert_int_equal(n, 1);
    for (int i = 0; i < 32; i++)
        assert_int_equal(data[i], picture[i] == '.' ? 0 : 255);
    memset(data, 0, sizeof data);
    data[0] = data[1] = data[8] = data[9] = WEFT_MARK_WEAK; /* four, but none is strong */
    data[5] = WEFT_MARK_STRONG;                             /* strong, but small */
    n = 0;
    assert_ok(weft_components_keep(&marks, keep_large, &n, err));
    assert_int_equal(n, 1);
    for (int i = 0; i < 32; i++)
        assert_int_equal(data[i], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(regions),
        cmocka_unit_test(nothing_on_a_clean_cloth),
        cmocka_unit_test(each_flaw_is_found_where_it_is),
        cmocka_unit_test(net_is_as_open_as_it_is),
        cmocka_unit_test(tear_in_a_net),
        cmocka_unit_test(what_cannot_be_found_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
