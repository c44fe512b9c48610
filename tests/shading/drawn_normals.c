#include "tests/shading/drawn_normals.h"

#include "tests/support/support.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE = DRAWN_SIDE, DRAWS = DRAWN_DRAWS };

const double drawn_alphas[DRAWN_ALPHAS] = {0.05, 0.1, 0.2, 0.35, 0.5};

static const double pi = 3.14159265358979323846;

/* Heights of three fabrics in texels; u, v in texels. */
static double plain(double u, double v)
{
    return 1.5 * sin(pi * u / 8) * cos(pi * v / 8);
}

static double twill(double u, double v)
{
    return 1.2 * sin(pi * (u + v) / 8) + 0.4 * cos(pi * u / 2) * sin(pi * v / 4);
}

static double corded(double u, double v)
{
    return 3 * fabs(sin(pi * u / 16)) + 0.15 * sin(pi * v / 2);
}

typedef double fabric_fn(double u, double v);
static fabric_fn *const fabrics[DRAWN_FABRICS] = {plain, twill, corded};

void drawn_normals_make(weft_baked *b, int of)
{
    fabric_fn *const fabric = fabrics[of];
    const double e = 1e-3;
    assert_ok(weft_baked_init(b, "f", weft_material_type_find("opaquematerial"), err));
    assert_ok(weft_baked_add(b, WEFT_BAKED_NORMAL, SIDE, SIDE, err));
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double u = x + 0.5, v = y + 0.5;
            const double dx = (fabric(u + e, v) - fabric(u - e, v)) / (2 * e);
            const double dy = (fabric(u, v + e) - fabric(u, v - e)) / (2 * e),
                         l = sqrt(dx * dx + dy * dy + 1);
            weft_image *const n = &b->maps[WEFT_BAKED_NORMAL].mips[0];
            weft_image_row(n, 0, y)[x] = (float)(-dx / l);
            weft_image_row(n, 1, y)[x] = (float)(dy / l);
            weft_image_row(n, 2, y)[x] = (float)(1 / l);
        }
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

bool drawn_next(drawn_footprint *at)
{
    const int side = SIDE >> at->level, step = side > 3 ? side / 3 : 1;
    at->x += step;
    if (at->level > 0 && at->x >= side) {
        at->x = step / 2;
        at->y += step;
    }
    if (at->level == 0 || at->y >= side) {
        at->level++;
        const int next = SIDE >> at->level;
        at->x = at->y = (next > 3 ? next / 3 : 1) / 2;
    }
    return at->level <= DRAWN_LEVELS;
}

void drawn_normals_draw(const weft_baked *b, const drawn_footprint *at, double alpha,
                        drawn_tangents *tangents)
{
    const int level = at->level, tx = at->x, ty = at->y;
    const weft_image *const n0 = &b->maps[WEFT_BAKED_NORMAL].mips[0];
    const weft_image *const nl = &b->maps[WEFT_BAKED_NORMAL].mips[level];
    double mean[3];
    for (int c = 0; c < 3; c++)
        mean[c] = (double)weft_image_row(nl, c, ty)[tx];
    uint64_t random = (uint64_t)level * 1000 + (uint64_t)(ty * SIDE + tx) + 1;
    const int side = 1 << level;
    for (int k = 0; k < DRAWS; k++) {
        /* strata over the footprint and over the lobe */
        const int cell = side * side <= DRAWS ? k % (side * side)
                                              : (int)((k + weft_test_random(&random)) * side * side / DRAWS);
        const int x = tx * side + cell % side, y = ty * side + cell / side;
        double n[3], m[3];
        for (int c = 0; c < 3; c++)
            n[c] = (double)weft_image_row(n0, c, y)[x];
        const double u = weft_test_random(&random), phi = 2 * pi * weft_test_random(&random);
        const double cos_m = sqrt((1 - u) / (1 + (alpha * alpha - 1) * u)), sin_m = sqrt(1 - cos_m * cos_m);
        const double tl = hypot(n[0], n[2]), t[3] = {n[2] / tl, 0, -n[0] / tl};
        const double s[3] = {n[1] * t[2], n[2] * t[0] - n[0] * t[2], -n[1] * t[0]};
        for (int c = 0; c < 3; c++)
            m[c] = sin_m * (cos(phi) * t[c] + sin(phi) * s[c]) + cos_m * n[c];
        const double cosine = m[0] * mean[0] + m[1] * mean[1] + m[2] * mean[2];
        tangents->t[k] = cosine > 1e-3 ? sqrt(fmax(1 - cosine * cosine, 0)) / cosine : 1e3;
    }
    qsort(tangents->t, DRAWS, sizeof tangents->t[0], by_value);
}

double drawn_distance(const drawn_tangents *tangents, double alpha)
{
    /* of GGX the share within t is t^2/(t^2 + alpha^2) */
    double most = 0;
    for (int k = 0; k < DRAWS; k++) {
        const double t2 = tangents->t[k] * tangents->t[k], model = t2 / (t2 + alpha * alpha);
        most = fmax(most, fmax(fabs(model - (double)k / DRAWS), fabs(model - (k + 1.0) / DRAWS)));
    }
    return most;
}

double drawn_least_distance(const drawn_tangents *tangents)
{
    double least = 1;
    for (double alpha = 0.01; alpha <= 1; alpha *= 1.02)
        least = fmin(least, drawn_distance(tangents, alpha));
    return least;
}
