/** What the tables of reflectance share: models at a pair of directions, and views of integrals. */
#ifndef WEFT_SHADING_VECTORS_VECTORS_PAIR_H
#define WEFT_SHADING_VECTORS_VECTORS_PAIR_H

#include "shading/brdf/brdf.h"
#include "shading/brdf/half_vector.h"
#include "shading/vectors/vectors_tables.h"

#include <stdbool.h>

/** The model `name` at nl, nv and their azimuths, with parameters (plane, value) of one row: three channels;
 *  NaN when there is no such model. */
static inline void weft_vectors_eval_rgb(const char *name, const double *values, double nl, double phi_l,
                                         double nv, double phi_v, double f[3])
{
    const weft_brdf *brdf;
    double l[3], v[3];
    f[0] = f[1] = f[2] = (double)NAN;
    if (weft_brdf_find(name, &brdf, NULL) != WEFT_OK)
        return;
    weft_brdf_direction(nl, phi_l, l);
    weft_brdf_direction(nv, phi_v, v);
    weft_brdf_eval_one(brdf, values, l, v, f);
}

/** Its first channel. */
static inline double weft_vectors_eval_at(const char *name, const double *values, double nl, double phi_l,
                                          double nv, double phi_v)
{
    double f[3];
    weft_vectors_eval_rgb(name, values, nl, phi_l, nv, phi_v, f);
    return f[0];
}

/** Half vector of nl, nv and the azimuth between. */
static inline weft_half weft_vectors_half(double nl, double nv, double phi)
{
    double l[3], v[3];
    weft_brdf_direction(nl, 0, l);
    weft_brdf_direction(nv, phi, v);
    return weft_half_of(l[0], l[1], l[2], v[0], v[1], v[2]);
}

/** Views of integrals: raised to 1e-4 as for every model (S-CNV-02); what is no cosine gives false. */
static inline bool weft_vectors_view(double *nv)
{
    *nv = weft_max(*nv, WEFT_MIN_NV);
    return *nv <= 1;
}

#endif
