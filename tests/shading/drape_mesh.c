#include "tests/shading/drape_mesh.h"

#include "shading/preview/preview_samples.h"

#include <math.h>

enum { MESH = 120 };

static double vertices[MESH + 1][MESH + 1][3];

void drape_mesh_make(void)
{
    for (int row = 0; row <= MESH; row++)
        for (int column = 0; column <= MESH; column++) {
            double slope[2], *const at = vertices[row][column];
            at[0] = 2.0 * column / MESH - 1;
            at[1] = 2.0 * row / MESH - 1;
            at[2] = weft_preview_drape_height(at[0], at[1], slope);
        }
}

/* Distance along the ray to a triangle (Moller and Trumbore 1997), either side, or infinity; its normal. */
static double meet(const double o[3], const double d[3], const double *a, const double *b, const double *c,
                   double n[3])
{
    double e1[3], e2[3], s[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = b[k] - a[k];
        e2[k] = c[k] - a[k];
        s[k] = o[k] - a[k];
    }
    const double p[3] = {d[1] * e2[2] - d[2] * e2[1], d[2] * e2[0] - d[0] * e2[2],
                         d[0] * e2[1] - d[1] * e2[0]};
    const double det = e1[0] * p[0] + e1[1] * p[1] + e1[2] * p[2];
    if (fabs(det) < 1e-14)
        return HUGE_VAL;
    const double u = (s[0] * p[0] + s[1] * p[1] + s[2] * p[2]) / det;
    const double q[3] = {s[1] * e1[2] - s[2] * e1[1], s[2] * e1[0] - s[0] * e1[2],
                         s[0] * e1[1] - s[1] * e1[0]};
    const double v = (d[0] * q[0] + d[1] * q[1] + d[2] * q[2]) / det;
    const double t = (e2[0] * q[0] + e2[1] * q[1] + e2[2] * q[2]) / det;
    if (u < 0 || v < 0 || u + v > 1 || t <= 1e-6)
        return HUGE_VAL;
    n[0] = e1[1] * e2[2] - e1[2] * e2[1];
    n[1] = e1[2] * e2[0] - e1[0] * e2[2];
    n[2] = e1[0] * e2[1] - e1[1] * e2[0];
    return t;
}

/* The first triangle, or with `any` the first in the order of the mesh. */
static double nearest(const double o[3], const double d[3], bool any, double normal[3])
{
    double best = HUGE_VAL;
    for (int row = 0; row < MESH; row++)
        for (int column = 0; column < MESH; column++)
            for (int k = 0; k < 2 && !(any && best < HUGE_VAL); k++) {
                const double *const a = vertices[row][column], *const b = vertices[row + 1][column + 1];
                const double *const c = k ? vertices[row + 1][column] : vertices[row][column + 1];
                double n[3] = {0};
                const double t = meet(o, d, a, b, c, n);
                if (!(t < best))
                    continue;
                best = t;
                for (int j = 0; j < 3; j++)
                    normal[j] = n[j];
            }
    return best;
}

double drape_mesh_facing(const double o[3], const double d[3])
{
    double n[3] = {0};
    if (nearest(o, d, false, n) == HUGE_VAL)
        return -1;
    return fabs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) / sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

bool drape_mesh_meets(const double o[3], const double d[3])
{
    double n[3];
    return nearest(o, d, true, n) < HUGE_VAL;
}
