/* Lights, sky, environment and occlusion against figures and integrals from elsewhere. */
#define _POSIX_C_SOURCE 200809L /* mkdtemp, setenv */
#include "tests/support/support.h"

#include "core/file.h"
#include "shading/brdf/albedo.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/sampling.h"
#include "shading/lighting/ambient_occlusion.h"
#include "shading/lighting/area_light.h"
#include "shading/lighting/environment.h"
#include "shading/lighting/environment_cone.h"
#include "shading/lighting/environment_map.h"
#include "shading/lighting/environment_planes.h"
#include "shading/lighting/environment_rings.h"
#include "shading/lighting/environment_table.h"
#include "shading/lighting/sky.h"
#include "shading/lighting/volume_light.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SEED 20261124u

static double between(uint64_t *random, double min, double max)
{
    return min + (max - min) * weft_test_random(random);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void test_sky_has_its_published_values(void **state)
{
    (void)state;
    const double degree = WEFT_PI / 180;
    const weft_sky *const skies[] = {&weft_sky_cie_clear, &weft_sky_far_cry_3};
    /* CIE S 011 type 12: element at zenith angle 45, opposite of a sun at zenith angle 30 */
    assert_near(weft_sky_relative_to_zenith(&weft_sky_cie_clear, 45 * degree, 180 * degree, 30 * degree),
                0.4544524, 5e-8);
    for (int i = 0; i < 2; i++) {
        assert_near(weft_sky_relative_to_zenith(skies[i], 0, 1, 0.7), 1, 1e-14);
        assert_near(weft_sky_relative_to_sun(skies[i], 0.7, 0, 0.7), 1, 1e-14);
        const double horizon = weft_sky_relative_to_zenith(skies[i], WEFT_PI / 2, 1, 0.7);
        assert_near(weft_sky_relative_to_zenith(skies[i], WEFT_PI / 2 - 1e-6, 1, 0.7), horizon, 1e-5);
        for (double zenith = 0; zenith <= WEFT_PI; zenith += 0.01)
            assert_true(weft_sky_relative_to_sun(skies[i], zenith, 2, 1.5) > 0);
    }
}

/* The projection against a plain sum over the hemisphere, with the sun at any azimuth. */
static void test_sky_projection(void **state)
{
    (void)state;
    enum { RINGS = 400, SECTORS = 400 };
    const double sun_zenith = 0.9, sun_azimuth = 2.3;
    double light[WEFT_SH_COUNT], sum[WEFT_SH_COUNT] = {0};
    weft_sky_project(&weft_sky_cie_clear, sun_zenith, sun_azimuth, light);
    for (int ring = 0; ring < RINGS; ring++)
        for (int sector = 0; sector < SECTORS; sector++) {
            const double zenith = (ring + 0.5) / RINGS * WEFT_PI / 2;
            const double azimuth = (sector + 0.5) / SECTORS * 2 * WEFT_PI;
            const double area = sin(zenith) * WEFT_PI / 2 / RINGS * 2 * WEFT_PI / SECTORS;
            const double value =
                weft_sky_relative_to_sun(&weft_sky_cie_clear, zenith, azimuth - sun_azimuth, sun_zenith);
            double basis[WEFT_SH_COUNT];
            weft_sh_basis(sin(zenith) * cos(azimuth), sin(zenith) * sin(azimuth), cos(zenith), basis);
            for (int k = 0; k < WEFT_SH_COUNT; k++)
                sum[k] += value * area * basis[k];
        }
    for (int k = 0; k < WEFT_SH_COUNT; k++)
        assert_near(light[k], sum[k], 2e-5);
}

/* Light of 1 from everywhere is irradiance pi whichever way one looks; from one direction, a blurred cosine
 * of the right integral. */
static void test_irradiance_by_spherical_harmonics(void **state)
{
    (void)state;
    uint64_t random = SEED;
    const double even[WEFT_SH_COUNT] = {2 * sqrt(WEFT_PI)};
    for (int i = 0; i < 100; i++) {
        double n[3], sun[3], beam[WEFT_SH_COUNT];
        weft_brdf_direction(between(&random, -1, 1), between(&random, 0, 7), n);
        weft_brdf_direction(between(&random, -1, 1), between(&random, 0, 7), sun);
        assert_near(weft_sh_convolve(n, weft_sh_cosine, even), WEFT_PI, 1e-13);
        weft_sh_basis(sun[0], sun[1], sun[2], beam);
        const double c = dot(n, sun); /* 1/4 + c/2 + 5/32 (3 c^2 - 1): three bands of the clamped cosine */
        assert_near(weft_sh_convolve(n, weft_sh_cosine, beam), 0.25 + c / 2 + 5.0 / 32 * (3 * c * c - 1),
                    1e-13);
    }
}

static void test_falloff(void **state)
{
    (void)state;
    assert_near(weft_light_falloff(0, 10), 1, 0);
    assert_near(weft_light_falloff(10, 10), 0, 0);
    assert_near(weft_light_falloff(1e9, 10), 0, 0);
    assert_near(weft_light_falloff(1, 1e6), 0.5, 1e-12);
    for (double d = 0; d < 10; d += 0.01)
        assert_true(weft_light_falloff(d + 0.01, 10) <= weft_light_falloff(d, 10));
}

/* Distance of a point from the ray along r. */
static double from_ray(const double p[3], const double r[3])
{
    const double along = dot(p, r);
    return sqrt(fmax(dot(p, p) - along * along, 0));
}

static void test_sphere_takes_its_nearest_point(void **state)
{
    (void)state;
    uint64_t random = SEED;
    for (int i = 0; i < 200; i++) {
        const double centre[3] = {between(&random, -2, 2), between(&random, -2, 2), between(&random, 3, 6)};
        const double radius = between(&random, 0, 1.5);
        double r[3];
        weft_brdf_direction(between(&random, 0.85, 1), between(&random, 0, 7), r); /* not away from it */
        const weft_light_point point = weft_light_sphere(centre, r, radius, 0.2);
        assert_near(dot(point.l, point.l), 1, 1e-14);
        assert_true(point.alpha >= 0.2 && point.norm <= 1);
        /* a point of the sphere: the ray along l comes as near to the centre as the radius */
        assert_true(from_ray(centre, point.l) <= radius + 1e-12);
        const weft_light_point small = weft_light_sphere(centre, r, 0, 0.2);
        assert_near(dot(small.l, centre), sqrt(dot(centre, centre)), 1e-12);
        assert_near(small.norm, 1, 1e-15);
        if (from_ray(centre, r) <= radius) /* the ray hits: it is the highlight itself */
            assert_near(dot(point.l, r), 1, 1e-12);
        else /* it misses: on the rim towards the ray */
            assert_true(dot(point.l, r) > dot(small.l, r) - 1e-15);
    }
}

static void test_tube_against_sums_along_it(void **state)
{
    (void)state;
    enum { N = 20000 };
    uint64_t random = SEED;
    const double n[3] = {0, 0, 1};
    for (int i = 0; i < 20; i++) {
        double l0[3], l1[3], r[3], sum = 0, nearest = HUGE_VAL, best = 0, widest = -2, best_angle = 0;
        for (int c = 0; c < 3; c++) {
            l0[c] = between(&random, c == 2 ? 1 : -3, 3);
            l1[c] = between(&random, c == 2 ? 1 : -3, 3);
        }
        weft_brdf_direction(between(&random, 0.3, 1), between(&random, 0, 7), r);
        for (int k = 0; k < N; k++) {
            const double t = (k + 0.5) / N;
            const double p[3] = {l0[0] + t * (l1[0] - l0[0]), l0[1] + t * (l1[1] - l0[1]),
                                 l0[2] + t * (l1[2] - l0[2])};
            const double d2 = dot(p, p), off = from_ray(p, r), angle = dot(p, r) / sqrt(d2);
            sum += dot(p, n) / (d2 * sqrt(d2)) / N;
            best = off < nearest ? t : best;
            nearest = fmin(off, nearest);
            best_angle = angle > widest ? t : best_angle;
            widest = fmax(angle, widest);
        }
        const weft_light_tube tube = weft_light_tube_of(l0, l1, r, 0.3);
        assert_near(weft_light_tube_irradiance(l0, l1, n), sum, 1e-8);
        assert_near(tube.t, best, 1e-3);
        if (tube.smallest_angle > 0 && tube.smallest_angle < 1 && best_angle > 0.001 && best_angle < 0.999)
            assert_near(tube.smallest_angle, best_angle, 1e-3);
    }
    const double along[3] = {0, 0, 2}, further[3] = {0, 0, 5};
    assert_near(weft_light_tube_of(along, further, n, 0.3).t, 0, 0); /* parallel to the ray: the nearer end */
    assert_near(weft_light_tube_of(further, along, n, 0.3).t, 1, 0);
    assert_near(weft_light_tube_irradiance_soft(along, along, n), 1.0 / 5, 1e-15);
}

/* What an area light has to be (S-UE4-19): the point light when it is small, for both of its parts. */
static void test_a_small_tube_is_a_point(void **state)
{
    (void)state;
    uint64_t random = SEED;
    const double n[3] = {0, 0, 1}, length = 1e-6;
    for (int i = 0; i < 50; i++) {
        const double at[3] = {between(&random, -2, 2), between(&random, -2, 2), between(&random, 1, 4)};
        const double d2 = dot(at, at), d = sqrt(d2);
        double axis[3], r[3], end[3];
        weft_brdf_direction(between(&random, -1, 1), between(&random, 0, 7), axis);
        weft_brdf_direction(between(&random, 0.2, 1), between(&random, 0, 7), r);
        for (int c = 0; c < 3; c++)
            end[c] = at[c] + length * axis[c];
        const weft_light_tube tube = weft_light_tube_of(at, end, r, 0.2);
        assert_near(dot(tube.point.l, at), d, length);
        assert_near(tube.point.norm, 1, length);
        assert_near(weft_light_tube_irradiance(at, end, n), at[2] / (d2 * d), 2 * length);
        assert_near(weft_light_tube_irradiance_soft(at, end, n), at[2] / (d * (d2 + 1)), 2 * length);
    }
}

/* Reflectance of everything above the cone by a plain sum over light directions. */
static double cone_sum(double alpha, double nv, double cone)
{
    enum { RINGS = 600, SECTORS = 600 };
    double v[3], sum = 0;
    weft_brdf_direction(nv, 0, v);
    for (int ring = 0; ring < RINGS; ring++)
        for (int sector = 0; sector < SECTORS; sector++) {
            double l[3];
            weft_brdf_direction(cone + (1 - cone) * (ring + 0.5) / RINGS, (sector + 0.5) / SECTORS * WEFT_PI,
                                l);
            const weft_half h = weft_half_of(l[0], l[1], l[2], v[0], v[1], v[2]);
            sum += weft_ggx_d(h.nh, h.s2, alpha) * weft_ggx_v1(l[2], alpha) * weft_ggx_v1(nv, alpha) * l[2];
        }
    return sum * (1 - cone) * 2 * WEFT_PI / ((double)RINGS * SECTORS);
}

static void test_environment(void **state)
{
    (void)state;
    const weft_brdf *ggx = NULL;
    assert_ok(weft_brdf_find("ggx-specular", &ggx, err));
    for (int i = 0; i < 6; i++) {
        const double alpha = (double[]){0.01, 0.1, 0.5}[i % 3], nv = i < 3 ? 0.3 : 0.9;
        const double white[WEFT_BRDF_MAX_PLANES] = {1, 1, 1, alpha};
        double albedo[3], last = 2;
        weft_brdf_albedo(ggx, white, nv, 0, WEFT_ALBEDO_EXACT, albedo);
        const weft_environment_share all = weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, alpha, nv, 0);
        assert_near(all.scale + all.bias, albedo[0], 1e-12);
        assert_near(weft_environment_diffuse(all, 1), 1 - albedo[0], 1e-12);
        for (int k = 0; k <= 7; k++) { /* the slices of Call of Duty's table */
            const weft_environment_share cut =
                weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, alpha, nv, k / 7.0);
            assert_true(cut.scale + cut.bias < last && cut.scale >= 0 && cut.bias >= 0);
            last = cut.scale + cut.bias;
            if (alpha > 0.2 && k % 3 == 1)
                assert_near(last, cone_sum(alpha, nv, k / 7.0), 1e-5);
        }
        assert_near(last, 0, 0);
    }
    /* Unreal's: k = alpha/2 is Smith itself at alpha 1 (S-UE4-04) */
    const weft_environment_share smith = weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, 1, 0.4, 0);
    const weft_environment_share schlick = weft_environment_brdf(WEFT_ENVIRONMENT_SCHLICK, 1, 0.4, 0);
    assert_near(smith.scale, schlick.scale, 1e-12);
    assert_true(isfinite(weft_environment_brdf(WEFT_ENVIRONMENT_SCHLICK, 0.3, 0, 0).scale));
}

static void test_prefilter(void **state)
{
    (void)state;
    /* S-UE4-08, by other means */
    const double roughness[] = {0.25, 0.5, 0.75, 1}, published[] = {0.97609, 0.86740, 0.74513, 2.0 / 3};
    for (int i = 0; i < 4; i++) {
        enum { N = 1 << 16 };
        double moments[2], first = 0, second = 0, total = 0;
        weft_environment_prefilter(roughness[i], 2, moments);
        assert_near(moments[0], published[i], 6e-6);
        for (uint32_t k = 0; k < N; k++) { /* the listing, N = V = R */
            double u[2], h[3];
            const double up[3] = {0, 0, 1};
            weft_hammersley(k, N, u);
            weft_sample_ggx_normal(up, roughness[i] * roughness[i], u[0], u[1], h);
            const double nl = 2 * h[2] * h[2] - 1;
            if (nl > 0) {
                total += nl;
                first += nl * nl;
                second += nl * (3 * nl * nl - 1) / 2;
            }
        }
        assert_near(moments[0], first / total, 2e-4);
        assert_near(moments[1], second / total, 4e-4);
    }
}

/* A panorama with radiance 1 + 0.5 n.a + 0.25 P2(n.b): filtering must multiply the bands by the kernel's
 * moments, and the irradiance is known. */
static void test_panorama(void **state)
{
    (void)state;
    const double a[3] = {0.6, 0, 0.8}, b[3] = {0, 0.8, -0.6};
    weft_image panorama;
    weft_environment_map map;
    assert_ok(weft_image_init(&panorama, 256, 128, 1, err));
    for (int y = 0; y < 128; y++)
        for (int x = 0; x < 256; x++) {
            const double azimuth = WEFT_PI * (2 * (x + 0.5) / 256 - 1), zenith = WEFT_PI * (y + 0.5) / 128;
            const double d[3] = {sin(zenith) * sin(azimuth), sin(zenith) * cos(azimuth), cos(zenith)};
            weft_image_row(&panorama, 0, y)[x] =
                (float)(1 + 0.5 * dot(d, a) + 0.125 * (3 * dot(d, b) * dot(d, b) - 1));
        }
    assert_ok(weft_environment_map_init(&map, &panorama, err));
    uint64_t random = SEED;
    for (int i = 0; i < 200; i++) {
        double n[3], e[3], radiance[3], moments[2];
        weft_brdf_direction(between(&random, -1, 1), between(&random, 0, 7), n);
        const double p1 = 0.5 * dot(n, a), p2 = 0.125 * (3 * dot(n, b) * dot(n, b) - 1);
        weft_environment_map_irradiance(&map, n, e);
        assert_near(e[2], WEFT_PI * (1 + p1 * 2 / 3 + p2 / 4), 2e-3);
        const double roughness = (i % WEFT_ENVIRONMENT_LEVELS) / (WEFT_ENVIRONMENT_LEVELS - 1.0);
        weft_environment_prefilter(roughness, 2, moments);
        weft_environment_map_look(&map, n, roughness, radiance);
        assert_near(radiance[0], 1 + moments[0] * p1 + moments[1] * p2, 8e-3);
    }
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
}

/* The painted sky against the projection by quadrature, and the card that reads 1. */
static void test_painted_sky(void **state)
{
    (void)state;
    const double zenith = 0.8, azimuth = 2.1, up[3] = {0, 0, 1};
    double wanted[WEFT_SH_COUNT], e[3];
    weft_image panorama;
    weft_environment_map map;
    assert_ok(weft_environment_paint_sky(&panorama, &weft_sky_cie_clear, zenith, azimuth, err));
    assert_ok(weft_environment_map_init(&map, &panorama, err));
    weft_sky_project(&weft_sky_cie_clear, zenith, azimuth, wanted);
    for (int k = 1; k < WEFT_SH_COUNT; k++)
        assert_near(map.light[0][k] / map.light[0][0], wanted[k] / wanted[0], 2e-3);
    weft_environment_map_irradiance(&map, up, e);
    assert_near(e[1], WEFT_PI, 0.02 * WEFT_PI); /* three bands of it */
    weft_environment_map_fini(&map);
    weft_image_fini(&panorama);
}

/* Planes of directions in single precision against one at a time in double, poles and seam included. */
static void check_planes(const weft_environment_table *table)
{
    enum { N = 3000 };
    static float d[3][N], alpha[N], nv[N], e[3][N], look[3][N], scale[N], bias[N];
    const float *const direction[3] = {d[0], d[1], d[2]};
    float *const irradiance[3] = {e[0], e[1], e[2]}, *const radiance[3] = {look[0], look[1], look[2]};
    uint64_t random = SEED;
    weft_image sky;
    weft_environment_map map;
    static weft_environment_planes planes;
    assert_ok(weft_environment_paint_sky(&sky, &weft_sky_cie_clear, 1.2, 2, err));
    for (int y = 0; y < sky.height; y++)
        weft_image_row(&sky, 2, y)[0] *= 30; /* a bright column at the seam */
    assert_ok(weft_environment_map_init(&map, &sky, err));
    assert_ok(weft_environment_planes_init(&planes, &map, table, err));
    for (int i = 0; i < N; i++) {
        double l[3];
        weft_brdf_direction(i % 7   ? between(&random, -1, 1)
                            : i % 2 ? 1
                                    : -1,
                            i % 3 ? between(&random, 0, 7) : 1.5 * WEFT_PI + 1e-3 * (i % 11 - 5), l);
        for (int c = 0; c < 3; c++)
            d[c][i] = (float)l[c];
        alpha[i] = (float)(i % 5 ? pow(weft_test_random(&random), 2) : i % 2);
        nv[i] = (float)(i % 5 ? between(&random, 1e-3, 1) : 1);
    }
    weft_environment_planes_irradiance(&planes, N, direction, irradiance);
    weft_environment_planes_look(&planes, N, direction, alpha, radiance);
    weft_environment_planes_share(&planes, N, nv, alpha, scale, bias);
    double worst = 0;
    for (int i = 0; i < N; i++) {
        const double at[3] = {(double)d[0][i], (double)d[1][i], (double)d[2][i]};
        double want_e[3], want[3];
        weft_environment_map_irradiance(&map, at, want_e);
        weft_environment_map_look(&map, at, sqrt((double)alpha[i]), want);
        const weft_environment_share share =
            weft_environment_table_at(table, (double)nv[i], (double)alpha[i]);
        for (int c = 0; c < 3; c++) {
            assert_near(e[c][i], want_e[c], 1e-5);
            assert_near(look[c][i], want[c], 2e-3 * (1 + want[c]));
        }
        worst = fmax(worst, fabs((double)scale[i] - share.scale));
        worst = fmax(worst, fabs((double)bias[i] - share.bias));
    }
    print_message("  shares in planes: largest difference from the table %.1e\n", worst);
    assert_near(worst, 0, 1.5e-3);
    weft_environment_planes_fini(&planes);
    weft_environment_map_fini(&map);
    weft_image_fini(&sky);
}

static void test_environment_table(void **state)
{
    (void)state;
    static weft_environment_table table;
    char folder[] = "cache-XXXXXX";
    uint64_t random = SEED;
    assert_non_null(mkdtemp(folder));
    assert_int_equal(setenv("XDG_CACHE_HOME", folder, 1), 0);
    weft_environment_table_get(&table, WEFT_ENVIRONMENT_SMITH);
    double worst = 0;
    for (int i = 0; i < 160; i++) { /* the whole domain in decades, half of them where both are small */
        const double decades = i % 2 ? 3 : 1;
        const double alpha = 1e-3 * pow(10, between(&random, 0, decades));
        const double nv = i ? 1e-3 * pow(10, between(&random, 0, decades)) : 1e-3;
        const weft_environment_share wanted = weft_environment_brdf(WEFT_ENVIRONMENT_SMITH, alpha, nv, 0);
        const weft_environment_share got = weft_environment_table_at(&table, nv, alpha);
        worst = fmax(worst, fmax(fabs(got.scale - wanted.scale), fabs(got.bias - wanted.bias)));
    }
    print_message("  environment BRDF: the table is off by %.1e at most\n", worst);
    assert_near(worst, 0, 5e-4);
    static weft_environment_table again;
    weft_environment_table_get(&again, WEFT_ENVIRONMENT_SMITH); /* from the cache */
    assert_memory_equal(&again, &table, sizeof table);
    check_planes(&table);
    assert_ok(weft_folder_remove(folder, err));
}

/* The largest difference of the cone table from the integral at places all over its domain. */
static double cone_table_error(const weft_environment_cone_table *table, weft_environment_lobe lobe)
{
    uint64_t random = SEED;
    double worst = 0;
    for (int i = 0; i < 120; i++) {
        const double alpha = 1e-3 * pow(10, between(&random, 0, 3));
        const double grazing = 1e-3 * pow(10, between(&random, 0, 3)); /* n.v, or what is missing of it */
        const double nv = i % 2 ? grazing : fmax(1 - 0.999 * grazing * grazing, 1e-3);
        const double place = i % 10 ? weft_test_random(&random) : 0;
        const double cone = weft_environment_ring_cosine(alpha, nv, place);
        const weft_environment_share wanted = weft_environment_brdf(lobe, alpha, nv, cone);
        const weft_environment_share got = weft_environment_cone_at(table, nv, alpha, cone);
        assert_near(weft_environment_ring_place(alpha, nv, cone), place, 1e-9);
        worst = fmax(worst, fmax(fabs(got.scale - wanted.scale), fabs(got.bias - wanted.bias)));
    }
    return worst;
}

static void test_cone_table(void **state)
{
    (void)state;
    static weft_environment_cone_table table, again;
    char folder[] = "cache-XXXXXX", path[300] = "";
    assert_non_null(mkdtemp(folder));
    assert_int_equal(setenv("XDG_CACHE_HOME", folder, 1), 0);
    for (int lobe = 0; lobe < 2; lobe++) {
        weft_environment_cone_get(&table, (weft_environment_lobe)lobe);
        const double worst = cone_table_error(&table, (weft_environment_lobe)lobe);
        print_message("  environment BRDF above cones: the table is off by %.1e at most\n", worst);
        assert_near(worst, 0, 5e-4);
        assert_true(weft_environment_cone_at(&table, 0.3, 0.2, 1).scale == 0);
    }
    weft_environment_cone_get(&again, WEFT_ENVIRONMENT_SCHLICK); /* from the cache */
    assert_memory_equal(&again, &table, sizeof table);
    /* files that are not whole, or not what they were, are not believed */
    char name[320];
    snprintf(name, sizeof name, "%s/weft", folder);
    DIR *const files = opendir(name);
    assert_non_null(files);
    for (const struct dirent *entry; (entry = readdir(files));)
        if (entry->d_name[0] != '.') {
            snprintf(path, sizeof path, "%s/weft/%.200s", folder, entry->d_name);
            FILE *const file = fopen(path, "r+b");
            assert_non_null(file);
            assert_int_equal(fseek(file, 1000, SEEK_SET), 0);
            assert_int_equal(fputs("damaged", file) >= 0, 1);
            assert_int_equal(fclose(file), 0);
        }
    closedir(files);
    assert_true(path[0]);
    memset(&again, 0, sizeof again);
    weft_environment_cone_get(&again, WEFT_ENVIRONMENT_SCHLICK);
    assert_memory_equal(&again, &table, sizeof table);
    assert_ok(weft_folder_remove(folder, err));
}

/* Many cones of one view against one at a time. */
static void test_rings(void **state)
{
    (void)state;
    enum { N = 32 };
    uint64_t random = SEED;
    double worst = 0;
    for (int i = 0; i < 60; i++) {
        const weft_environment_lobe lobe = i % 2 ? WEFT_ENVIRONMENT_SMITH : WEFT_ENVIRONMENT_SCHLICK;
        const double alpha = 1e-4 * pow(10, between(&random, 0, 4));
        const double nv =
            i % 3 ? 1e-3 * pow(10, between(&random, 0, 3)) : 1 - pow(10, -between(&random, 1, 6));
        const int k = (int)between(&random, 0, N - 1);
        weft_environment_share share[N];
        weft_environment_rings(lobe, alpha, nv, N, share);
        const weft_environment_share wanted =
            weft_environment_brdf(lobe, alpha, nv, weft_environment_ring_cosine(alpha, nv, k / (N - 1.0)));
        worst = fmax(worst, fmax(fabs(share[k].scale - wanted.scale), fabs(share[k].bias - wanted.bias)));
        assert_true(share[N - 1].scale == 0 && share[N - 1].bias == 0);
    }
    print_message("  rings: off by %.1e at most\n", worst);
    assert_near(worst, 0, 5e-5);
}

static void test_occlusion(void **state)
{
    (void)state;
    enum { N = 100000 };
    double threshold = 0, smooth = 0, sharp = 0, series = 0;
    const double cone = weft_ao_cone_cosine(0.5);
    for (int i = 0; i < N; i++) { /* cosine-weighted over the hemisphere: nl^2 is even (S-COD-17) */
        const double nl = sqrt((i + 0.5) / N);
        threshold += weft_ao_shadow_threshold(nl, cone) / N;
        smooth += weft_ao_shadow_smooth(nl, cone) / N;
        sharp += weft_ao_shadow_sharp(nl, cone) / N;
    }
    assert_near(threshold, 0.5, 1e-4);
    assert_near(smooth, 5.0 / 6, 1e-4);
    assert_near(sharp, 0.75, 1e-4);
    for (int k = 0; k < 200; k++) /* one bounce after the other (S-COD-15) */
        series += 0.4 * pow(0.8 * (1 - 0.4), k);
    assert_near(weft_ao_interreflect(0.4, 0.8), series, 1e-12);
    assert_near(weft_ao_interreflect(0, 1), 1, 0);
    assert_near(weft_ao_shadow_smooth(0.5, 0), 1, 0); /* open */
    assert_near(weft_ao_shadow_smooth(-0.5, 0), 0, 0);
    assert_near(weft_ao_cone_cosine(1 + 1e-15), 0, 0);
}

static void test_phase_function_integrates_to_one(void **state)
{
    (void)state;
    enum { N = 200000 };
    double sum = 0;
    for (int i = 0; i < N; i++)
        sum += weft_phase_henyey_greenstein(0.8, -1 + 2 * (i + 0.5) / N) * 4 * WEFT_PI / N;
    assert_near(sum, 1, 1e-8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sky_has_its_published_values),
        cmocka_unit_test(test_sky_projection),
        cmocka_unit_test(test_irradiance_by_spherical_harmonics),
        cmocka_unit_test(test_falloff),
        cmocka_unit_test(test_sphere_takes_its_nearest_point),
        cmocka_unit_test(test_tube_against_sums_along_it),
        cmocka_unit_test(test_a_small_tube_is_a_point),
        cmocka_unit_test(test_environment),
        cmocka_unit_test(test_prefilter),
        cmocka_unit_test(test_panorama),
        cmocka_unit_test(test_painted_sky),
        cmocka_unit_test(test_rings),
        cmocka_unit_test(test_environment_table),
        cmocka_unit_test(test_cone_table),
        cmocka_unit_test(test_occlusion),
        cmocka_unit_test(test_phase_function_integrates_to_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
