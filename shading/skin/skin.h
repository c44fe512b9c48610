/** Pre-integrated skin: diffusion profile, transfer along a ring, its zonal coefficients (S-ORD-10 to
 *  S-ORD-13).  Channels are red, green, blue; lengths in millimetres. */
#ifndef WEFT_SHADING_SKIN_SKIN_H
#define WEFT_SHADING_SKIN_SKIN_H

/** Three normalisations of the profile are in circulation; the relative weight of its wide and narrow parts
 *  differs. */
typedef enum weft_skin_profile {
    WEFT_SKIN_RADIAL, /* per mm^2: the literal reading of the Order's eq. 16, and the default */
    WEFT_SKIN_LINE,   /* per mm: the profile integrated across the ring, right for a cylinder */
    WEFT_SKIN_WIDE,   /* line with variances sqrt(2) larger: what the cited worksheets computed */
} weft_skin_profile;

/**
 * Six-Gaussian diffusion profile at a distance.
 *
 *     radial R = sum w exp(-d^2/(2 v))/(2 pi v),   line R = sum w exp(-d^2/(2 v))/sqrt(2 pi v)
 *
 * The weights of each channel sum to 1, so that radial R integrates to 1 over the plane.
 * Source: d'Eon and Luebke 2007 (GPU Gems 3, ch. 14); S-ORD-10.
 */
void weft_skin_reflectance(weft_skin_profile profile, double distance_mm, double rgb[3]);

/**
 * Transfer that stands for n.l on skin of a radius of curvature:
 *
 *     D = integral of max(cos(theta + x), 0) R(2 r sin(|x|/2)) dx / integral of R(2 r sin(|x|/2)) dx, x
 * -pi..pi
 *
 * The clamp is lost in the printed text; without it no light bleeds over the terminator.  r to infinity gives
 * the clamped cosine, r to 0 gives 1/pi everywhere.  To be multiplied by albedo/pi as Lambert is.
 *
 * @param theta_rad  angle between normal and light, 0..pi
 * @param radius_mm  above 0; the lookup of a table uses curvature 1/r
 * All digits, some 50 us.  Source: The Order eqs. 16, 17 after Penner and Borshukov; S-ORD-11.
 */
void weft_skin_transfer(weft_skin_profile profile, double theta_rad, double radius_mm, double rgb[3]);

/**
 * Zonal coefficients of the transfer, bands 0..2:
 *
 *     D_l = 2 pi integral of Y_l0(theta) D(theta, r) sin(theta) dtheta, theta 0..end
 *
 * @param end_rad  pi; the printed pi/2 cuts the bleed off and is for comparison
 * @param zonal    [l][channel], for weft_sh_convolve()
 * Has up to 4/pi of a cosine's energy (r to 0): divide by D_0/A_0 where that matters.
 * Source: The Order eq. 19; S-ORD-12.
 */
void weft_skin_zonal(weft_skin_profile profile, double radius_mm, double end_rad, double zonal[3][3]);

#endif
