/* Every model of the table against what it promises, and against numbers from elsewhere. */
#include "tests/support/support.h"

#include "shading/brdf/albedo.h"
#include "shading/brdf/beckmann.h"
#include "shading/brdf/charlie.h"
#include "shading/brdf/cloth.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/log_positive.h"
#include "shading/brdf/quadrature.h"
#include "shading/brdf/sampling.h"
#include "shading/brdf/specular_doubt.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SEED 20261123u

static double between(uint64_t *random, double min, double max)
{
    return min + (max - min) * weft_test_random(random);
}

static void random_direction(uint64_t *random, double min_cosine, double direction[3])
{
    weft_brdf_direction(between(random, min_cosine, 1), between(random, -WEFT_PI, WEFT_PI), direction);
}

/* Each parameter somewhere in its range, often at an end of it. */
static void random_values(const weft_brdf *brdf, uint64_t *random, double values[WEFT_BRDF_MAX_PLANES])
{
    int plane = 0;
    for (const weft_brdf_param *p = brdf->params; p->name; p++)
        for (int c = 0; c < p->components; c++) {
            const double choice = weft_test_random(random);
            values[plane++] = choice < 0.1 ? p->min : choice < 0.2 ? p->max : between(random, p->min, p->max);
        }
}

static void test_table_is_sound(void **state)
{
    (void)state;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        const weft_brdf *const brdf = *b;
        const weft_brdf *found = NULL;
        assert_ok(weft_brdf_find(brdf->name, &found, err));
        assert_ptr_equal(found, brdf); /* names are unique */
        assert_true(weft_brdf_n_planes(brdf) <= WEFT_BRDF_MAX_PLANES);
        assert_true(brdf->summary && brdf->source && brdf->eval && brdf->eval_f32 && brdf->params);
        assert_int_equal(brdf->sample == NULL, brdf->pdf == NULL);
        for (const weft_brdf_param *p = brdf->params; p->name; p++) {
            assert_true(p->components == 1 || p->components == 3);
            assert_true(p->min < p->max && p->def >= p->min && p->def <= p->max && p->unit && p->help);
        }
    }
}

static void check_value(const weft_brdf *brdf, const double values[], const double l[3], const double v[3])
{
    double f[3];
    weft_brdf_eval_one(brdf, values, l, v, f);
    for (int c = 0; c < 3; c++)
        if (!isfinite(f[c]) || f[c] < 0 || (l[2] <= 0 && f[c] != 0))
            fail_msg("%s is %g at l %.17g %.17g %.17g, v %.17g %.17g %.17g", brdf->name, f[c], l[0], l[1],
                     l[2], v[0], v[1], v[2]);
}

static void test_values_are_finite_and_not_negative(void **state)
{
    (void)state;
    static const double cosines[] = {1, 0.999999999999, 0.5, 1e-3, 1e-9, 1e-300, 0, -1e-9, -0.5, -1};
    enum { N = sizeof cosines / sizeof cosines[0] };
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        double values[WEFT_BRDF_MAX_PLANES], l[3], v[3];
        for (int i = 0; i < 20000; i++) {
            random_values(*b, &random, values);
            random_direction(&random, -1, l);
            random_direction(&random, -1, v);
            check_value(*b, values, l, v);
            check_value(*b, values, l, l); /* retro */
            const double opposite[3] = {-l[0], -l[1], -l[2]}, mirror[3] = {-l[0], -l[1], l[2]};
            check_value(*b, values, l, opposite);
            check_value(*b, values, l, mirror);
        }
        for (int i = 0; i < N * N * 4; i++) {
            random_values(*b, &random, values);
            weft_brdf_direction(cosines[i % N], 0, l);
            const int quarter = i / (N * N);
            weft_brdf_direction(cosines[i / N % N], quarter * WEFT_PI / 3, v);
            check_value(*b, values, l, v);
        }
    }
}

static void test_reciprocity(void **state)
{
    (void)state;
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        double worst = 0;
        for (int i = 0; i < 5000; i++) {
            double values[WEFT_BRDF_MAX_PLANES], l[3], v[3], there[3], back[3];
            random_values(*b, &random, values);
            random_direction(&random, 1e-4, l);
            random_direction(&random, 1e-4, v);
            weft_brdf_eval_one(*b, values, l, v, there);
            weft_brdf_eval_one(*b, values, v, l, back);
            for (int c = 0; c < 3; c++)
                if (there[c] > 1e-290) /* far tails end in numbers of few digits */
                    worst = fmax(worst, fabs(back[c] / there[c] - 1));
        }
        if ((*b)->flags & WEFT_BRDF_RECIPROCAL)
            assert_near(worst, 0, 1e-12);
        else if (worst < 1e-6)
            fail_msg("%s is reciprocal and does not say so", (*b)->name);
    }
}

/* Loops of every length must give what single evaluations give, to the bit. */
static void test_arrays_give_what_single_evaluations_give(void **state)
{
    (void)state;
    enum { N = 37 };
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        double l[3][N], v[3][N], f[3][N + 1], params[WEFT_BRDF_MAX_PLANES][N], single[N][3];
        for (int i = 0; i < N; i++) {
            double values[WEFT_BRDF_MAX_PLANES], light[3], view[3];
            random_values(*b, &random, values);
            random_direction(&random, -0.2, light);
            random_direction(&random, -0.2, view);
            weft_brdf_eval_one(*b, values, light, view, single[i]);
            for (int c = 0; c < 3; c++) {
                l[c][i] = light[c];
                v[c][i] = view[c];
            }
            for (int k = 0; k < weft_brdf_n_planes(*b); k++)
                params[k][i] = values[k];
        }
        for (int n = 0; n <= N; n++) {
            weft_brdf_batch batch = {.n = n, .light = {l[0], l[1], l[2]}, .view = {v[0], v[1], v[2]}};
            double *const out[3] = {f[0], f[1], f[2]};
            for (int k = 0; k < weft_brdf_n_planes(*b); k++)
                batch.param[k] = params[k];
            f[0][n] = f[1][n] = f[2][n] = -7;
            (*b)->eval(&batch, out);
            for (int c = 0; c < 3; c++) {
                for (int i = 0; i < n; i++)
                    assert_true(f[c][i] == single[i][c]);
                assert_true(f[c][n] == -7);
            }
        }
    }
}

/* Likewise in single precision. */
static void test_single_precision_loops_give_what_single_evaluations_give(void **state)
{
    (void)state;
    enum { N = 67 };
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        float l[3][N], v[3][N], f[3][N + 1], params[WEFT_BRDF_MAX_PLANES][N], alone[N][3];
        for (int i = 0; i < N; i++) {
            double values[WEFT_BRDF_MAX_PLANES], light[3], view[3];
            float *const out[3] = {&alone[i][0], &alone[i][1], &alone[i][2]};
            weft_brdf_batch_f32 one = {.n = 1};
            random_values(*b, &random, values);
            random_direction(&random, -0.2, light);
            random_direction(&random, -0.2, view);
            for (int c = 0; c < 3; c++) {
                l[c][i] = (float)light[c];
                v[c][i] = (float)view[c];
                one.light[c] = &l[c][i];
                one.view[c] = &v[c][i];
            }
            for (int k = 0; k < weft_brdf_n_planes(*b); k++) {
                params[k][i] = (float)values[k];
                one.param[k] = &params[k][i];
            }
            (*b)->eval_f32(&one, out);
        }
        for (int n = 0; n <= N; n++) {
            weft_brdf_batch_f32 batch = {.n = n, .light = {l[0], l[1], l[2]}, .view = {v[0], v[1], v[2]}};
            float *const out[3] = {f[0], f[1], f[2]};
            for (int k = 0; k < weft_brdf_n_planes(*b); k++)
                batch.param[k] = params[k];
            f[0][n] = f[1][n] = f[2][n] = -7;
            (*b)->eval_f32(&batch, out);
            for (int c = 0; c < 3; c++) {
                for (int i = 0; i < n; i++)
                    assert_true(f[c][i] == alone[i][c]);
                assert_true(f[c][n] == -7);
            }
        }
    }
}

static void round_all(const double *from, int n, float *rounded, double *back)
{
    for (int i = 0; i < n; i++) {
        volatile float through_memory = (float)from[i]; /* gcc 12 drops the rounding of pairs otherwise */
        rounded[i] = through_memory;
        back[i] = (double)through_memory;
    }
}

/* Largest difference of the two precisions at the same arguments, as a share of what brdf.h allows. */
static double single_share(const weft_brdf *brdf, const double values[], const double l[3], const double v[3])
{
    float l32[3], v32[3], params32[WEFT_BRDF_MAX_PLANES], f32[3];
    double l64[3], v64[3], params64[WEFT_BRDF_MAX_PLANES], f[3], worst = 0;
    float *const out[3] = {&f32[0], &f32[1], &f32[2]};
    weft_brdf_batch_f32 batch = {.n = 1};
    round_all(l, 3, l32, l64);
    round_all(v, 3, v32, v64);
    round_all(values, weft_brdf_n_planes(brdf), params32, params64);
    for (int c = 0; c < 3; c++) {
        batch.light[c] = &l32[c];
        batch.view[c] = &v32[c];
    }
    for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
        batch.param[k] = &params32[k];
    brdf->eval_f32(&batch, out);
    weft_brdf_eval_one(brdf, params64, l64, v64, f);
    for (int c = 0; c < 3; c++) {
        const double share = fabs((double)f32[c] - f[c]) / (1e-6 + 1e-5 * f[c]);
        if (!isfinite(f32[c]) || f32[c] < 0 || (l32[2] <= 0 && f32[c] != 0) || !(share <= 1))
            fail_msg(
                "%s is %.9g in single precision and %.17g in double (share %g) at l %.17g %.17g %.17g, v "
                "%.17g %.17g %.17g, parameters %g %g %g %g %g %g %g %g",
                brdf->name, (double)f32[c], f[c], share, l64[0], l64[1], l64[2], v64[0], v64[1], v64[2],
                params64[0], params64[1], params64[2], params64[3], params64[4], params64[5], params64[6],
                params64[7]);
        worst = fmax(worst, share);
    }
    return worst;
}

/* The same arguments in both precisions over the whole domain, both ends of the parameters included. */
static void test_single_precision_follows_double(void **state)
{
    (void)state;
    static const double cosines[] = {1, 0.9999999, 0.999, 0.5, 1e-3, 1e-4, 1e-9, 0, -1e-9, -0.5, -1};
    enum { N = sizeof cosines / sizeof cosines[0] };
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        double values[WEFT_BRDF_MAX_PLANES], l[3], v[3], worst = 0;
        for (int i = 0; i < 20000; i++) {
            random_values(*b, &random, values);
            random_direction(&random, -1, l);
            random_direction(&random, i % 2 ? -1 : 0, v);
            const double opposite[3] = {-l[0], -l[1], -l[2]}, mirror[3] = {-l[0], -l[1], l[2]};
            worst = fmax(worst, single_share(*b, values, l, v));
            worst = fmax(worst, single_share(*b, values, l, l));
            worst = fmax(worst, single_share(*b, values, l, opposite));
            worst = fmax(worst, single_share(*b, values, l, mirror));
        }
        for (int i = 0; i < N * N * 8; i++) {
            random_values(*b, &random, values);
            weft_brdf_direction(cosines[i % N], 0, l);
            weft_brdf_direction(cosines[i / N % N], i / (N * N) * WEFT_PI / 4, v);
            worst = fmax(worst, single_share(*b, values, l, v));
        }
        print_message("  %-20s largest difference %.2f of 1e-5 f + 1e-6\n", (*b)->name, worst);
    }
}

/* White material: colours 1, the coat as given, other parameters at a share of their range; at shares below
 * 0 anywhere. */
static void white_values(const weft_brdf *brdf, double f0, double share, uint64_t *random, double values[])
{
    int plane = 0;
    for (const weft_brdf_param *p = brdf->params; p->name; p++) {
        const double value = p->min + (share < 0 ? weft_test_random(random) : share) * (p->max - p->min);
        for (int c = 0; c < p->components; c++)
            values[plane++] = strcmp(p->name, "f0") == 0 ? f0 : p->components == 1 ? value : p->max;
    }
}

/* White furnace: nothing comes back that did not go in. */
static void test_furnace(void **state)
{
    (void)state;
    static const double f0s[] = {0, 0.04, 0.5, 1}, shares[] = {0, 0.01, 0.05, 0.2, 0.5, 1};
    static const double cosines[] = {0.01, 0.1, 0.3, 0.6, 1};
    enum { N_SHARES = sizeof shares / sizeof shares[0] };
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        double highest = 0;
        for (int i = 0; i < 4 * N_SHARES * 5; i++) {
            double values[WEFT_BRDF_MAX_PLANES], albedo[3];
            white_values(*b, f0s[i % 4], shares[i / 4 % N_SHARES], &random, values);
            weft_brdf_albedo(*b, values, cosines[i / (4 * N_SHARES)], 0.4, WEFT_ALBEDO_QUICK, albedo);
            highest = fmax(highest, albedo[0]);
        }
        for (int i = 0; i < 60; i++) { /* anywhere in the ranges, where lobes gain most */
            double values[WEFT_BRDF_MAX_PLANES], albedo[3];
            white_values(*b, 1, -1, &random, values);
            weft_brdf_albedo(*b, values, 0.01, 0.4, WEFT_ALBEDO_QUICK, albedo);
            highest = fmax(highest, albedo[0]);
        }
        print_message("  %-18s highest albedo %.6f\n", (*b)->name, highest);
        if ((*b)->flags & WEFT_BRDF_PASSIVE)
            assert_true(highest <= 1 + 1e-6);
        else
            assert_true(highest > 1.01); /* or it should promise to be passive */
    }
}

static void test_density_integrates_to_one(void **state)
{
    (void)state;
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++) {
        double worst = 0;
        for (int i = 0; i < 20 && (*b)->pdf; i++) {
            double values[WEFT_BRDF_MAX_PLANES];
            random_values(*b, &random, values);
            const double nv = i == 0 ? 1 : between(&random, 0.02, 1);
            const double total =
                weft_brdf_pdf_integral(*b, values, nv, between(&random, -3, 3), WEFT_ALBEDO_QUICK);
            worst = fmax(worst, fabs(total - 1));
        }
        print_message("  %-18s largest |integral of pdf - 1| %.2e\n", (*b)->name, worst);
        /* ridges of a width 1e5 times below the lobe's length cost the quadrature digits */
        assert_near(worst, 0, (*b)->flags & WEFT_BRDF_ANISOTROPIC ? 2e-5 : 1e-8);
    }
}

enum { RINGS = 24, SECTORS = 24, SAMPLES = 100000, SUB = 12 };

/* Probability of each cell of the sphere (n.l by azimuth) by midpoints. */
static void expected_cells(const weft_brdf *brdf, const double values[], const double v[3],
                           double expected[RINGS][SECTORS])
{
    for (int ring = 0; ring < RINGS; ring++)
        for (int sector = 0; sector < SECTORS; sector++) {
            double light[3][SUB * SUB], view[3][SUB * SUB], density[SUB * SUB], sum = 0;
            double params[WEFT_BRDF_MAX_PLANES][SUB * SUB];
            weft_brdf_batch batch = {
                .n = SUB * SUB, .light = {light[0], light[1], light[2]}, .view = {view[0], view[1], view[2]}};
            for (int i = 0; i < SUB * SUB; i++) {
                double l[3];
                const int across = i / SUB;
                const double cosine = -1 + 2.0 * (ring + (across + 0.5) / SUB) / RINGS;
                weft_brdf_direction(cosine, 2 * WEFT_PI * (sector + (i % SUB + 0.5) / SUB) / SECTORS, l);
                for (int c = 0; c < 3; c++) {
                    light[c][i] = l[c];
                    view[c][i] = v[c];
                }
                for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
                    params[k][i] = values[k];
            }
            for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
                batch.param[k] = params[k];
            brdf->pdf(&batch, density);
            for (int i = 0; i < SUB * SUB; i++)
                sum += density[i];
            expected[ring][sector] = SAMPLES * sum * 4 * WEFT_PI / (RINGS * SECTORS * SUB * SUB);
        }
}

static void count_cells(const weft_brdf *brdf, const double values[], const double v[3], uint64_t *random,
                        double counted[RINGS][SECTORS])
{
    memset(counted, 0, sizeof(double[RINGS][SECTORS]));
    for (int i = 0; i < SAMPLES; i++) {
        double u[3], l[3];
        const double *const uniform[3] = {&u[0], &u[1], &u[2]};
        double *const light[3] = {&l[0], &l[1], &l[2]};
        weft_brdf_batch batch = {.n = 1, .view = {&v[0], &v[1], &v[2]}};
        for (int k = 0; k < weft_brdf_n_planes(brdf); k++)
            batch.param[k] = &values[k];
        for (int c = 0; c < 3; c++)
            u[c] = weft_test_random(random);
        brdf->sample(&batch, uniform, light);
        assert_near(l[0] * l[0] + l[1] * l[1] + l[2] * l[2], 1, 1e-9);
        const double phi = atan2(l[1], l[0]);
        const int ring = (int)fmin((l[2] + 1) / 2 * RINGS, RINGS - 1);
        const int sector =
            (int)fmin((phi < 0 ? phi + 2 * WEFT_PI : phi) / (2 * WEFT_PI) * SECTORS, SECTORS - 1);
        counted[ring < 0 ? 0 : ring][sector]++;
    }
}

/* Chi-square in units of its own scatter: (X - cells)/sqrt(2 cells); cells below 5 go into one. */
static double chi_square_score(double expected[RINGS][SECTORS], double counted[RINGS][SECTORS])
{
    double sum = 0, rare_expected = 0, rare_counted = 0;
    int cells = 0;
    for (int ring = 0; ring < RINGS; ring++)
        for (int sector = 0; sector < SECTORS; sector++) {
            const double e = expected[ring][sector], o = counted[ring][sector];
            if (e < 5) {
                rare_expected += e;
                rare_counted += o;
            } else {
                sum += (o - e) * (o - e) / e;
                cells++;
            }
        }
    if (rare_expected >= 5) {
        sum += (rare_counted - rare_expected) * (rare_counted - rare_expected) / rare_expected;
        cells++;
    } else if (rare_counted > 30) {
        return 1e9; /* samples where the density says there are none */
    }
    return (sum - (cells - 1)) / sqrt(2.0 * (cells - 1));
}

/* The normal distributions behind the models; x is |n x h|^2. */
static double ndf_ggx(double nh, double x, double alpha)
{
    return weft_ggx_d(nh, x, alpha);
}

static double ndf_beckmann(double nh, double x, double alpha)
{
    return weft_beckmann_d(nh, x, alpha);
}

static double ndf_cloth(double nh, double x, double alpha)
{
    return weft_cloth_d(nh, x, alpha, 4);
}

static double ndf_charlie(double nh, double x, double alpha)
{
    (void)nh;
    return weft_charlie_d(x, alpha);
}

/* integral of D (n.h) over the hemisphere is pi times that of D over x; cut at decades of x and of 1 - x, for
 * lobes may be narrow at either end. */
static double ndf_integral(double (*d)(double nh, double x, double alpha), double alpha)
{
    enum { DECADES = 12 };
    weft_quadrature q;
    double sum = 0;
    weft_quadrature_init(&q, 16);
    for (int part = 0; part < 2 * DECADES + 2; part++) {
        const int k = part / 2;
        const double high = 0.5 * pow(10, -k), low = k < DECADES ? 0.1 * high : 0;
        for (int i = 0; i < q.n; i++) {
            const double t = low + (high - low) * q.at[i], x = part % 2 ? 1 - t : t;
            const double nh2 = part % 2 ? t : 1 - t;
            sum += WEFT_PI * (high - low) * q.weight[i] * d(sqrt(nh2), x, alpha);
        }
    }
    return sum;
}

static void test_normal_distributions_integrate_to_one(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double (*d)(double nh, double x, double alpha);
        double least; /* of alpha */
    } rows[] = {{"ggx", ndf_ggx, 1e-4},
                {"beckmann", ndf_beckmann, 1e-4},
                {"cloth", ndf_cloth, 1e-4},
                {"charlie", ndf_charlie, 0.1}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double worst = 0;
        for (int k = 0; k <= 20; k++) {
            const double alpha = pow(rows[i].least, 1 - k / 20.0);
            worst = fmax(worst, fabs(ndf_integral(rows[i].d, alpha) - 1));
        }
        print_message("  %-18s largest |integral of D cos - 1| %.2e\n", rows[i].name, worst);
        assert_near(worst, 0, 1e-6);
    }
}

static void test_samples_follow_the_density(void **state)
{
    (void)state;
    static const double views[][2] = {{0.95, 0.3}, {0.5, 2.0}, {0.15, -1.0}};
    uint64_t random = SEED;
    for (const weft_brdf *const *b = weft_brdfs; *b; b++)
        for (int i = 0; i < 3 && (*b)->sample; i++) {
            double values[WEFT_BRDF_MAX_PLANES], v[3], wrong[3];
            static double expected[RINGS][SECTORS], counted[RINGS][SECTORS];
            weft_brdf_defaults(*b, values);
            weft_brdf_direction(views[i][0], views[i][1], v);
            weft_brdf_direction(views[i][0] - 0.1, views[i][1] + 0.2, wrong);
            expected_cells(*b, values, v, expected);
            count_cells(*b, values, v, &random, counted);
            const double score = chi_square_score(expected, counted);
            if (score > 5)
                fail_msg("%s, view %d: chi-square is %.1f sigma above (seed %u)", (*b)->name, i, score, SEED);
            count_cells(*b, values, wrong, &random, counted); /* the test must see a lobe that is off */
            const double score_wrong = chi_square_score(expected, counted);
            print_message("  %-18s view %d: chi-square %+.1f sigma, of a view 0.1 off %+.1f\n", (*b)->name, i,
                          score, score_wrong);
            if ((*b)->sample != weft_brdf_sample_cosine)
                assert_true(score_wrong > 10);
        }
}

/* What vector code uses in place of libm, against libm. */
static void test_logarithm_and_exponential(void **state)
{
    (void)state;
    uint64_t random = SEED;
    for (int i = 0; i < 200000; i++) {
        const double t = pow(weft_test_random(&random), i % 40 + 1), x = exp(between(&random, -690, 690));
        if (t < 1)
            assert_near(weft_log_one_minus(t), log1p(-t), 6e-16 * -log1p(-t) + 1e-320);
        assert_near(weft_log_positive(x), log(x), 6e-16 * fabs(log(x)) + 1e-16);
        const double y = between(&random, -700, 700);
        assert_near(weft_exp_negative(y) / exp(y), 1, 5e-16);
    }
    assert_near(weft_log_one_minus(0), 0, 0);
    assert_true(exp(weft_log_one_minus(1)) < 1e-300 && exp(weft_log_positive(0)) < 1e-300);
}

static double albedo_of(const char *name, const char *const *settings, double nv)
{
    const weft_brdf *brdf = NULL;
    double values[WEFT_BRDF_MAX_PLANES], albedo[3];
    assert_ok(weft_brdf_find(name, &brdf, err));
    weft_brdf_defaults(brdf, values);
    for (; *settings; settings++)
        assert_ok(weft_brdf_set(brdf, *settings, values, err));
    weft_brdf_albedo(brdf, values, nv, 0, WEFT_ALBEDO_EXACT, albedo);
    return albedo[0];
}

/* Closed forms, and the figures that the specification found by other means (four digits). */
static void test_albedos_known_from_elsewhere(void **state)
{
    (void)state;
    const char *const none[] = {NULL}, *const white[] = {"f0=1", "alpha=1", NULL};
    const char *const rough[] = {"albedo=1", "f0=0.04", "alpha=0.5", NULL};
    const char *const smooth[] = {"albedo=1", "f0=0.04", "alpha=0.01", NULL};
    const char *const round[] = {"f0=1", "alpha=0.5", "anisotropy=0", NULL};
    const char *const coat[] = {"albedo=0.7", "f0=0.1", NULL};
    assert_near(albedo_of("lambert", none, 0.3), 0.5, 1e-10);
    assert_near(albedo_of("ggx-specular", white, 1), 1 - log(2), 1e-10);
    assert_near(albedo_of("lambert-coupled", coat, 0.3), 0.7 * 0.9 * (1 - pow(0.7, 5)), 1e-10);
    assert_near(albedo_of("ggx-anisotropic", round, 0.5), 0.6860, 5e-5); /* S-ORD-05 */
    assert_near(albedo_of("ggx", rough, 0.01), 1.025, 5e-4);             /* S-ORD-08 */
    assert_near(albedo_of("ggx", rough, 1), 0.987, 5e-4);
    assert_near(albedo_of("ggx", smooth, 0.01), 1.696, 5e-4);
    assert_near(albedo_of("ggx", smooth, 0.5), 1.025, 5e-4);
}

static void test_parameters_are_set_by_name(void **state)
{
    (void)state;
    const weft_brdf *brdf = NULL;
    double values[WEFT_BRDF_MAX_PLANES];
    assert_ok(weft_brdf_find("ggx", &brdf, err));
    weft_brdf_defaults(brdf, values);
    assert_ok(weft_brdf_set(brdf, "f0=0.9,0.6,0.3", values, err));
    assert_ok(weft_brdf_set(brdf, "cdiff=0.25", values, err));
    assert_ok(weft_brdf_set(brdf, "alpha=0.125", values, err));
    const double wanted[] = {0.25, 0.25, 0.25, 0.9, 0.6, 0.3, 0.125};
    assert_memory_equal(values, wanted, sizeof wanted);
    assert_fails(weft_brdf_find("gx", &brdf, err), WEFT_ERR_USAGE, "lambert, ");
    assert_fails(weft_brdf_set(brdf, "alpha", values, err), WEFT_ERR_USAGE, "NAME=VALUE");
    assert_fails(weft_brdf_set(brdf, "roughness=1", values, err), WEFT_ERR_USAGE, "it has albedo, f0, alpha");
    assert_fails(weft_brdf_set(brdf, "alpha=2", values, err), WEFT_ERR_USAGE, "wanted 0.0001 to 1");
    assert_fails(weft_brdf_set(brdf, "alpha=nan", values, err), WEFT_ERR_USAGE, "a number");
    assert_fails(weft_brdf_set(brdf, "alpha=0.1,0.2", values, err), WEFT_ERR_USAGE, "too many");
    assert_fails(weft_brdf_set(brdf, "f0=0.1,0.2", values, err), WEFT_ERR_USAGE, "one number or 3");
    assert_fails(weft_brdf_set(brdf, "f0=0.1,0.2,0.3,0.4", values, err), WEFT_ERR_USAGE, "too many");
    assert_memory_equal(values, wanted, sizeof wanted);
}

/* f = diffuse + cavity times the lobe (S-UE4-11). */
static void test_cavity_shadows_the_lobe(void **state)
{
    (void)state;
    const weft_brdf *brdf;
    double values[WEFT_BRDF_MAX_PLANES], l[3], v[3], f[3][3];
    static const char *const cavities[] = {"cavity=0", "cavity=0.25", "cavity=1"};
    assert_ok(weft_brdf_find("unreal", &brdf, err));
    weft_brdf_defaults(brdf, values);
    weft_brdf_direction(0.7, 0, l);
    weft_brdf_direction(0.6, 3, v);
    for (int i = 0; i < 3; i++) {
        assert_ok(weft_brdf_set(brdf, cavities[i], values, err));
        weft_brdf_eval_one(brdf, values, l, v, f[i]);
    }
    assert_near(f[0][1], 0.5 / WEFT_PI, 1e-15);
    assert_true(f[2][1] > 1.05 * f[0][1]);
    assert_near(f[1][1], f[0][1] + 0.25 * (f[2][1] - f[0][1]), 1e-15);
}

static void test_doubts_of_the_specular_workflow(void **state)
{
    (void)state;
    static const struct {
        double diffuse[3], f0[3];
        unsigned doubts;
    } rows[] = {
        {{0.5, 0.5, 0.5}, {0.04, 0.04, 0.04}, 0},
        {{0.5, 0.5, 0.5}, {0.017, 0.017, 0.017}, 0}, /* both ends belong to dielectrics */
        {{0.5, 0.5, 0.5}, {0.067, 0.067, 0.067}, 0},
        {{0.5, 0.5, 0.5}, {0, 0, 0}, 0},
        {{0.5, 0.5, 0.5}, {0.016, 0.016, 0.016}, WEFT_DOUBT_LOW},
        {{0.5, 0.5, 0.5}, {0.068, 0.068, 0.068}, WEFT_DOUBT_HIGH},
        {{0.5, 0.5, 0.5}, {0.04, 0.041, 0.043}, 0}, /* as grey as a picture of 8 bits can say */
        {{0.5, 0.5, 0.5}, {0.04, 0.04, 0.05}, WEFT_DOUBT_COLOURED},
        {{0.5, 0.5, 0.5}, {0.1, 0.01, 0.01}, WEFT_DOUBT_COLOURED | WEFT_DOUBT_LOW | WEFT_DOUBT_HIGH},
        {{0.1, 0.1, 0.1}, {1, 0.78, 0.34}, 0}, /* gold, tarnished */
        {{0.3, 0.3, 0.3}, {1, 0.78, 0.34}, WEFT_DOUBT_DIFFUSE},
        {{0.9, 0, 0}, {1, 0.78, 0.34}, 0}, /* a red of luminance 0.19 */
        {{(double)NAN, 0, 0}, {0.04, 0.04, 0.04}, 0},
        {{0.5, 0.5, 0.5}, {(double)NAN, (double)NAN, (double)NAN}, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        assert_int_equal(weft_specular_doubts(rows[i].diffuse, rows[i].f0), rows[i].doubts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table_is_sound),
        cmocka_unit_test(test_values_are_finite_and_not_negative),
        cmocka_unit_test(test_reciprocity),
        cmocka_unit_test(test_arrays_give_what_single_evaluations_give),
        cmocka_unit_test(test_single_precision_loops_give_what_single_evaluations_give),
        cmocka_unit_test(test_single_precision_follows_double),
        cmocka_unit_test(test_furnace),
        cmocka_unit_test(test_density_integrates_to_one),
        cmocka_unit_test(test_normal_distributions_integrate_to_one),
        cmocka_unit_test(test_samples_follow_the_density),
        cmocka_unit_test(test_logarithm_and_exponential),
        cmocka_unit_test(test_albedos_known_from_elsewhere),
        cmocka_unit_test(test_parameters_are_set_by_name),
        cmocka_unit_test(test_cavity_shadows_the_lobe),
        cmocka_unit_test(test_doubts_of_the_specular_workflow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
