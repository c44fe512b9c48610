/**
 * Chains of mips that keep what the eye sees from afar: normals that are averaged become roughness.
 *
 * Every level is made from level 0 of the maps in floating point (S-ORD-23), with the areas of the texels as
 * weights (so that sizes need not be powers of two); colours, F0, opacity and the rest are averaged, normals
 * and roughness filtered together by one of the rules below.
 */
#ifndef WEFT_SHADING_BAKE_MIPS_H
#define WEFT_SHADING_BAKE_MIPS_H

#include "shading/bake/baked.h"

/** How roughness answers for the normals of its footprint. */
typedef enum weft_mip_rule {
    /**
     * The GGX whose distribution of micro-slopes is closest to the footprint's, by the largest distance of
     * the two cumulative distributions.  GGX slopes about a normal of slope d lie within t of the mean normal
     * with the probability
     *
     *     P(t) = 1/2 + 1/2 (t^2 - d^2 - alpha^2)/sqrt((t^2 + d^2 + alpha^2)^2 - 4 t^2 d^2),
     *
     * a closed form because GGX slopes are a stereographic image of the sphere; the footprint has the mean of
     * its texels' P, the GGX t^2/(t^2 + alpha'^2).
     */
    WEFT_MIP_CLOSEST,
    WEFT_MIP_LENGTH,         /* shortened normals, gloss and normal together: Call of Duty, S-COD-05 */
    WEFT_MIP_VMF,            /* alpha^2 + 1/kappa: the listing of The Order, S-ORD-22 */
    WEFT_MIP_VMF_CONSISTENT, /* alpha^2 + 2/kappa: Filament today, S-ORD-22 */
    WEFT_MIP_TOKSVIG,        /* a Blinn-Phong power by Toksvig's factor, S-FC3-14 */
    WEFT_MIP_NONE,           /* the mean of alpha: normals are forgotten */
} weft_mip_rule;

/** "closest|length|vmf|vmf-consistent|toksvig|none", in the order of the enum. */
extern const char weft_mip_rule_names[];

typedef struct weft_mip_options {
    weft_mip_rule rule;
    double
        coverage_at; /* opacity at which a shader cuts: levels keep the share of texels above it; 0: do not */
    int max_levels;  /* 0: down to 1 x 1 */
} weft_mip_options;

/** WEFT_MIP_CLOSEST, coverage not kept, all levels. */
weft_mip_options weft_mip_defaults(void);

/**
 * Fills the levels of every map that has a level 0; level 0 itself stays as it is (its normals describe
 * facets, S-COD-05).  A constant roughness becomes a map when the normals vary.  Adds
 * WEFT_BAKED_NORMAL_LENGTH.  Where GGX and cloth lie side by side the cloth's roughness is widened by
 * alpha^2 + 2/kappa, whatever the rule (none but for WEFT_MIP_NONE).
 * @return WEFT_ERR_NOMEM, WEFT_ERR_CANCELLED
 */
weft_err weft_mips_make(weft_baked *baked, const weft_mip_options *options, weft_error *err);

/** The roughness of one footprint by a rule: `n` unit normals with weights (sum 1) and alphas, their mean
 *  vector, and its length.  For tests and for maps made elsewhere. */
double weft_mip_roughness(weft_mip_rule rule, int n, const float (*normals)[3], const float *weights,
                          const float *alphas);

#endif
