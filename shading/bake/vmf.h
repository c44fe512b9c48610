/** Von Mises-Fisher lobes of normals: width from an averaged normal, filtered roughness (S-ORD-20 to
 *  S-ORD-22). */
#ifndef WEFT_SHADING_BAKE_VMF_H
#define WEFT_SHADING_BAKE_VMF_H

/**
 * Density in 1/sr at a cosine to the mean: kappa/(2 pi (1 - e^(-2 kappa))) e^(kappa (c - 1)); 1/(4 pi) at
 * kappa 0.  Source: The Order eq. 33 in a form that does not overflow; S-ORD-20.
 */
double weft_vmf_density(double kappa, double cosine);

/** Legendre coefficient l of the lobe, I_(l+1/2)(kappa)/I_(1/2)(kappa): 1 at l = 0.  Source: S-ORD-20. */
double weft_vmf_coefficient(double kappa, int l);

/** The seed's approximation of it, e^(-l^2/(2 kappa)).  Source: The Order eq. 34; S-ORD-20. */
double weft_vmf_coefficient_gauss(double kappa, int l);

/** Kappa of a mean normal of length r: (3 r - r^3)/(1 - r^2), high by up to 4.9 %; infinite from r = 1.
 *  Source: The Order, ComputeRoughness; S-ORD-21. */
double weft_vmf_kappa(double r);

/** What the listing has: the same, with 10000 at r >= 1 (only there: just below 1 it is larger). */
double weft_vmf_kappa_listing(double r);

/** The exact inverse of r = coth kappa - 1/kappa, 0 <= r < 1; infinite from r = 1.  Source: S-ORD-21. */
double weft_vmf_kappa_exact(double r);

/** How much a lobe of normals widens the material's: the seed contradicts itself. */
typedef enum weft_vmf_widening {
    WEFT_VMF_LISTING,    /* alpha^2 + 1/kappa, the default */
    WEFT_VMF_EQ_37,      /* alpha^2 + 1/(2 kappa), as printed */
    WEFT_VMF_CONSISTENT, /* alpha^2 + 2/kappa, the variances of one domain; right for Beckmann */
} weft_vmf_widening;

/** sqrt(alpha^2 + widening), not cut: a caller that shades with it takes at most 1.  Infinite kappa gives
 *  alpha.  Source: S-ORD-22. */
double weft_vmf_roughness(double alpha, double kappa, weft_vmf_widening widening);

#endif
