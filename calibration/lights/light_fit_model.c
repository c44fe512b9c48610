/* The model of a lamp over a sheet, and its derivatives. */
#include "calibration/lights/light_fit_internal.h"

#include <math.h>

static void common_terms(fit_place place, double terms[FIT_COMMON])
{
    const double rho2 = place.x * place.x + place.y * place.y;
    terms[0] = rho2;
    terms[1] = rho2 * rho2;
    terms[2] = rho2 * rho2 * rho2;
    terms[3] = place.x;
    terms[4] = place.y;
}

double fit_common_log(const double v[FIT_COMMON], fit_place place)
{
    double terms[FIT_COMMON], sum = 0;
    common_terms(place, terms);
    for (int k = 0; k < FIT_COMMON; k++)
        sum += v[k] * terms[k];
    return sum;
}

/* Slopes of the terms of the height, per mm. */
static void shape_slopes(const fit_problem *f, int cell, double by_x[FIT_SHAPE], double by_y[FIT_SHAPE])
{
    const double s = 1 / f->field_mm, x = f->cell[cell].x * s, y = f->cell[cell].y * s;
    const double dx[FIT_SHAPE] = {s, 0, 2 * x * s, y * s, 0}, dy[FIT_SHAPE] = {0, s, 0, x * s, 2 * y * s};
    for (int k = 0; k < FIT_SHAPE; k++) {
        by_x[k] = dx[k];
        by_y[k] = dy[k];
    }
}

/* The height is taken where the ray meets the plane: a sheet that rises by a millimetre is hit a tenth beside
 * it, and its slope of a hundredth makes that a micrometre. */
fit_surface fit_surface_at(const fit_problem *f, int cell)
{
    const fit_cell *const at = &f->cell[cell];
    const double *const shape = f->shared.shape, x = at->x / f->field_mm, y = at->y / f->field_mm;
    fit_surface s = {.term = {x, y, x * x, x * y, y * y}};
    double by_x[FIT_SHAPE], by_y[FIT_SHAPE], z = 0;
    shape_slopes(f, cell, by_x, by_y);
    s.n = (weft_vec3){0, 0, 1};
    for (int k = 0; k < FIT_SHAPE; k++) {
        z += shape[k] * s.term[k];
        s.n.x -= shape[k] * by_x[k];
        s.n.y -= shape[k] * by_y[k];
    }
    s.x = (weft_vec3){at->x + z * at->dx, at->y + z * at->dy, f->options->sheet_height_mm + z};
    s.n2 = weft_dot(s.n, s.n);
    return s;
}

/* The pieces of the lamp's model at x, in mm: d = x to lamp, b = spot to lamp. */
typedef struct lamp_at {
    weft_vec3 d, b;
    double r2, b2, db, dn; /* d.d, b.b, d.b, d.n */
    double off_axis;       /* log of the cosine between d and b */
} lamp_at;

static lamp_at look_at(const fit_lamp *lamp, const fit_surface *s)
{
    const weft_vec3 p = {lamp->p[0], lamp->p[1], lamp->p[2]}, m = {lamp->m[0], lamp->m[1], 0};
    lamp_at at = {.d = weft_sub(p, s->x), .b = weft_sub(p, m)};
    at.r2 = weft_dot(at.d, at.d);
    at.b2 = weft_dot(at.b, at.b);
    at.db = weft_dot(at.d, at.b);
    at.dn = weft_dot(at.d, s->n);
    at.off_axis = log(at.db / sqrt(at.r2 * at.b2)); /* NaN from 90 degrees on */
    return at;
}

static double log_at(const fit_lamp *lamp, const fit_surface *s, const lamp_at *at)
{
    /* mm^-2 to m^-2; NaN for a lamp below the sheet */
    return log(at->dn * 1e6 / (at->r2 * sqrt(at->r2 * s->n2))) + lamp->e * at->off_axis;
}

double fit_lamp_log(const fit_lamp *lamp, const fit_surface *s)
{
    const lamp_at at = look_at(lamp, s);
    return log_at(lamp, s, &at);
}

double fit_lamp_gradient(const fit_problem *f, const fit_lamp *lamp, int cell, const fit_surface *s,
                         double by_lamp[FIT_GEOMETRY], double by_shape[FIT_SHAPE])
{
    const lamp_at at = look_at(lamp, s);
    const double *const d = &at.d.x, *const b = &at.b.x, *const n = &s->n.x;
    for (int k = 0; k < 3; k++)
        by_lamp[k] =
            n[k] / at.dn - 3 * d[k] / at.r2 + lamp->e * ((b[k] + d[k]) / at.db - d[k] / at.r2 - b[k] / at.b2);
    by_lamp[3] = at.off_axis;
    for (int k = 0; k < 2; k++)
        by_lamp[4 + k] = lamp->e * (b[k] / at.b2 - d[k] / at.db);
    double by_x[FIT_SHAPE], by_y[FIT_SHAPE];
    shape_slopes(f, cell, by_x, by_y);
    const weft_vec3 up = {f->cell[cell].dx, f->cell[cell].dy, 1}; /* how the point moves as the sheet rises */
    const double rise = -weft_dot(s->n, up) / at.dn + 3 * weft_dot(at.d, up) / at.r2 +
                        lamp->e * (weft_dot(at.d, up) / at.r2 - weft_dot(at.b, up) / at.db);
    for (int k = 0; k < FIT_SHAPE; k++)
        by_shape[k] = rise * s->term[k] - (by_x[k] * at.d.x + by_y[k] * at.d.y) / at.dn +
                      (s->n.x * by_x[k] + s->n.y * by_y[k]) / s->n2;
    return log_at(lamp, s, &at);
}

double fit_ratio(const fit_problem *f, int light, int channel, int cell)
{
    const fit_lamp *const lamp = &f->lamps[light];
    const fit_surface s = fit_surface_at(f, cell);
    return (double)f->y[fit_plane(f, light, channel) + (size_t)cell] - lamp->log_phi[channel] -
           fit_lamp_log(lamp, &s);
}
