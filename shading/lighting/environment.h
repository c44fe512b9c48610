/**
 * Light from all round: the environment BRDF of the split sum, its cone-clipped form, what it leaves for the
 * diffuse term, and prefiltering (S-COD-19 to S-COD-21, S-UE4-07 to S-UE4-10).
 */
#ifndef WEFT_SHADING_LIGHTING_ENVIRONMENT_H
#define WEFT_SHADING_LIGHTING_ENVIRONMENT_H

/** Views below it are raised: at n.v = 0 the integrals have no value. */
#define WEFT_ENVIRONMENT_MIN_NV 1e-3

/** Which masking the lobe has. */
typedef enum weft_environment_lobe {
    WEFT_ENVIRONMENT_SMITH,   /* GGX with separable Smith: Call of Duty's tables (the deck does not say) */
    WEFT_ENVIRONMENT_SCHLICK, /* GGX with Schlick's masking, k = alpha/2: Unreal's */
} weft_environment_lobe;

/** Directional albedo of the lobe with Schlick's Fresnel: F0 scale + bias. */
typedef struct weft_environment_share {
    double scale, bias;
} weft_environment_share;

/**
 * Environment BRDF by integration, all digits, 3 ms.
 *
 *     scale = integral of f/F (1 - (1 - lh)^5) nl dl,   bias = integral of f/F (1 - lh)^5 nl dl
 *
 * @param alpha        width of the lobe, 0 < alpha <= 1
 * @param nv           raised to WEFT_ENVIRONMENT_MIN_NV
 * @param cone_cosine  lights with n.l below it are rejected: 0 for the whole hemisphere; at 1 both are 0
 * Source: Karis 2013 eq. 8, S-UE4-09; Chan 2018 pages 67-70, 80, S-COD-19, S-COD-20.
 */
weft_environment_share weft_environment_brdf(weft_environment_lobe lobe, double alpha, double nv,
                                             double cone_cosine);

/** What the specular lobe leaves for the diffuse term: 1 - (F0 scale + bias), `share` entered with n.l for a
 *  direct light (then f = c_diff/pi times it, which is not reciprocal) and n.v for image light.
 *  Source: Chan 2018 pages 77-82; S-COD-21. */
static inline double weft_environment_diffuse(weft_environment_share share, double f0)
{
    return 1 - (f0 * share.scale + share.bias);
}

/**
 * Legendre moments P_1..P_n of the kernel that prefilters an environment for image light, normal and view
 * along the reflection:
 *
 *     P_l = integral of P_l(nl) nl w / integral of nl w,   nl = 2 (r.h)^2 - 1 > 0, h from GGX
 *
 * Band l of the environment's spherical harmonics times P_l is the prefiltered one, exactly.
 *
 * @param roughness  0..1, the artist's: alpha is its square; 0 copies (all 1)
 * Source: Karis 2013, PrefilterEnvMap; S-UE4-08.
 */
void weft_environment_prefilter(double roughness, int n, double moments[]);

#endif
