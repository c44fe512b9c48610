/**
 * Colour arithmetic: sRGB, CIE XYZ, L*a*b*, CIEDE2000.
 *
 * "Linear sRGB" is linear light in BT.709 primaries with D65 white, 1 = a perfect white diffuser.
 * XYZ is scaled to Y = 1 for that white.
 */
#ifndef WEFT_CORE_COLOUR_H
#define WEFT_CORE_COLOUR_H

/** White points (2 degree observer), Y = 1. */
extern const double weft_white_d65[3];
extern const double weft_white_d50[3];

/** sRGB transfer curve (IEC 61966-2-1), odd extension below 0, not clamped above 1. */
double weft_srgb_encode(double linear);
double weft_srgb_decode(double encoded);
/** 8-bit sRGB code of a linear value: clamped, rounded to nearest. */
int weft_srgb_encode8(double linear);

/** Linear sRGB <-> XYZ by the four-digit matrix of the sRGB standard (S-CNV-06) and its inverse. */
void weft_srgb_to_xyz(const double rgb[3], double xyz[3]);
void weft_xyz_to_srgb(const double xyz[3], double rgb[3]);

/** Chromaticity x, y and luminance Y of XYZ; black, which has none, gets that of D65: 0.3127, 0.3290
 *  (S-FC3-02). */
void weft_xyz_to_xyy(const double xyz[3], double xyy[3]);
/** Back; a y below 1e-6, which no light has, counts as 1e-6. */
void weft_xyy_to_xyz(const double xyy[3], double xyz[3]);

/** CIE 1976 L*a*b* against `white`. */
void weft_xyz_to_lab(const double xyz[3], const double white[3], double lab[3]);
void weft_lab_to_xyz(const double lab[3], const double white[3], double xyz[3]);

/** Linear sRGB to L*a*b* (D65). */
void weft_srgb_to_lab(const double rgb[3], double lab[3]);

/** Adapts XYZ from one white to another, linear Bradford. */
void weft_adapt_bradford(const double xyz[3], const double from_white[3], const double to_white[3],
                         double adapted[3]);

/** CIEDE2000 colour difference (Sharma, Wu, Dalal 2005), kL = kC = kH = 1. */
double weft_delta_e_2000(const double lab1[3], const double lab2[3]);

/** Relative luminance of linear sRGB: 0.2126 R + 0.7152 G + 0.0722 B (S-ORD-17). */
static inline double weft_luminance(double r, double g, double b)
{
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

#endif
