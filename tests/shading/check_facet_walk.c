/* Walks on matte facets against what must hold of them, and single scattering against its integral. */
#include "tests/support/support.h"

#include "shading/brdf/facet_walk.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/multiscatter.h"
#include "shading/brdf/sampling.h"

#include <math.h>
#include <stdio.h>

enum { ENDLESS = 1000000 };

static void direction(double cosine, double phi_rad, double d[3])
{
    const double sine = sqrt(1 - cosine * cosine);
    d[0] = sine * cos(phi_rad);
    d[1] = sine * sin(phi_rad);
    d[2] = cosine;
}

static double walk(double alpha, weft_facet_coat coat, int meetings, double nl, double nv, double phi_rad,
                   long n)
{
    const weft_facet_surface surface = {alpha, 0.04, coat, meetings};
    double light[3], view[3];
    direction(nl, 0, light);
    direction(nv, phi_rad, view);
    return weft_facet_walk(&surface, light, view, n, 1);
}

/* Bare facets keep all light: what leaves over all views is what came. */
static void test_bare_facets_lose_nothing(void **state)
{
    (void)state;
    static const double alphas[] = {0.15, 0.5, 1}, cosines[] = {0.1, 0.5, 0.95};
    enum { VIEWS = 4096, WALKS = 24 };
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < 3; i++) {
            const weft_facet_surface surface = {alphas[a], 0.04, WEFT_FACET_BARE, ENDLESS};
            double light[3], albedo = 0;
            direction(cosines[i], 0, light);
            for (int k = 0; k < VIEWS; k++) {
                double u[2], view[3];
                weft_hammersley((uint32_t)k, VIEWS, u);
                weft_sample_cosine((u[0] * VIEWS + 0.5) / VIEWS, u[1], view);
                albedo += weft_facet_walk(&surface, light, view, WALKS, (uint64_t)k) * WEFT_PI / VIEWS;
            }
            printf("alpha %g, n.l %g: %.4f of the light comes back\n", alphas[a], cosines[i], albedo);
            assert_near(albedo, 1, 0.006);
        }
}

/* Single scattering with height-correlated masking, by sums over the facets:
 * integral of (l.m)+ (v.m)+ D(m) (1 - F(l.m)) dm / (pi n.l n.v (1 + Lambda(l) + Lambda(v))). */
static double single_scattering(double alpha, const double light[3], const double view[3])
{
    enum { RINGS = 400, ARCS = 400 };
    double sum = 0;
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < ARCS; k++) {
            const double theta = (i + 0.5) / RINGS * WEFT_PI / 2, phi = 2 * WEFT_PI * (k + 0.5) / ARCS;
            const double m[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            const double lm = light[0] * m[0] + light[1] * m[1] + light[2] * m[2];
            const double vm = view[0] * m[0] + view[1] * m[1] + view[2] * m[2];
            const double c2 = m[2] * m[2], a2 = alpha * alpha, bend = c2 * (a2 - 1) + 1;
            if (lm > 0 && vm > 0)
                sum += lm * vm * a2 / (WEFT_PI * bend * bend) * (1 - weft_fresnel_schlick(0.04, lm)) *
                       sin(theta);
        }
    sum *= WEFT_PI / 2 / RINGS * 2 * WEFT_PI / ARCS;
    return sum / (WEFT_PI * light[2] * view[2] *
                  (1 + weft_facet_lambda(alpha, light[2]) + weft_facet_lambda(alpha, view[2])));
}

static void test_single_scattering(void **state)
{
    (void)state;
    static const double cases[][4] = {/* alpha, nl, nv, phi */
                                      {1, 1, 1, 0},
                                      {1, 0.2, 0.3, 3},
                                      {1, 0.1, 0.15, 0.1},
                                      {0.5, 0.4, 0.9, 1.5},
                                      {0.2, 0.3, 0.3, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const double *const c = cases[i];
        double light[3], view[3];
        direction(c[1], 0, light);
        direction(c[2], c[3], view);
        const double wanted = single_scattering(c[0], light, view);
        const double got = walk(c[0], WEFT_FACET_EACH, 1, c[1], c[2], c[3], 400000);
        printf("alpha %g: single scattering %.5f, integral %.5f\n", c[0], got, wanted);
        assert_near(got / wanted, 1, 0.002);
    }
}

static void test_light_and_view_change_places(void **state)
{
    (void)state;
    static const double cases[][4] = {{1, 0.1, 0.9, 0.3}, {1, 0.3, 0.12, 3}, {0.6, 0.2, 0.7, 1.2}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const double *const c = cases[i];
        const double there = walk(c[0], WEFT_FACET_BOTH, ENDLESS, c[1], c[2], c[3], 300000);
        const double back = walk(c[0], WEFT_FACET_BOTH, ENDLESS, c[2], c[1], c[3], 300000);
        printf("alpha %g: %.5f there, %.5f back\n", c[0], there, back);
        assert_near(there / back, 1, 0.006);
    }
}

/* A smooth surface is a plane: Lambert below its coat. */
static void test_smooth_surfaces_are_lambert(void **state)
{
    (void)state;
    for (int i = 1; i <= 9; i += 2) {
        const double nl = 0.1 * i, nv = 1 - 0.09 * i;
        const double in = 1 - weft_fresnel_schlick(0.04, nl), out = 1 - weft_fresnel_schlick(0.04, nv);
        assert_near(walk(1e-4, WEFT_FACET_BARE, ENDLESS, nl, nv, 1, 2000) * WEFT_PI, 1, 2e-3);
        assert_near(walk(1e-4, WEFT_FACET_FIRST, ENDLESS, nl, nv, 1, 2000) * WEFT_PI, in, 2e-3);
        assert_near(walk(1e-4, WEFT_FACET_BOTH, ENDLESS, nl, nv, 1, 2000) * WEFT_PI, in * out, 2e-3);
    }
}

/* The deck's own fit to its simulation at gloss 0, over its slice: printed coefficients, not ours. */
static void test_printed_slice_at_gloss_0(void **state)
{
    (void)state;
    double off = 0, worst = 0;
    int n = 0;
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 8; k++) {
            const double th = 80.0 * i / 8 * WEFT_PI / 180, td = (5 + 10.0 * k) * WEFT_PI / 180;
            const double light[3] = {sin(th) * cos(td), sin(td), cos(th) * cos(td)};
            const double view[3] = {light[0], -light[1], light[2]};
            const weft_facet_surface surface = {1, 0.04, WEFT_FACET_FIRST, ENDLESS};
            const double got = weft_facet_walk(&surface, light, view, 2000, 3);
            const double d = WEFT_PI * fabs(got - weft_multiscatter_slice(cos(th), cos(td)));
            off += d;
            worst = fmax(worst, d);
            n++;
        }
    printf("walks against the printed slice of gloss 0, pi f: mean off %.4f, largest %.4f\n", off / n, worst);
    assert_true(off / n < 0.04 && worst < 0.2);
}

static void test_masking(void **state)
{
    (void)state;
    for (int i = 1; i <= 20; i++) {
        const double x = i / 20.0, alpha = 0.7;
        assert_near(1 / (1 + weft_facet_lambda(alpha, x)), 2 * x * weft_ggx_v1(x, alpha), 1e-12); /* G1 */
        assert_near(weft_facet_lambda(alpha, -x), -1 - weft_facet_lambda(alpha, x), 1e-12);
    }
}

static void test_seeds(void **state)
{
    (void)state;
    const weft_facet_surface surface = {0.8, 0.04, WEFT_FACET_BOTH, ENDLESS};
    double light[3], view[3];
    direction(0.4, 0, light);
    direction(0.6, 2, view);
    const double first = weft_facet_walk(&surface, light, view, 1000, 5);
    assert_true(first == weft_facet_walk(&surface, light, view, 1000, 5));
    assert_true(first != weft_facet_walk(&surface, light, view, 1000, 6));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_masking),
        cmocka_unit_test(test_bare_facets_lose_nothing),
        cmocka_unit_test(test_single_scattering),
        cmocka_unit_test(test_light_and_view_change_places),
        cmocka_unit_test(test_seeds),
        cmocka_unit_test(test_printed_slice_at_gloss_0),
        cmocka_unit_test(test_smooth_surfaces_are_lambert),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
