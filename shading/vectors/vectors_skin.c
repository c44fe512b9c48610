/* Tables of pre-integrated skin and its light by spherical harmonics. */
#include "shading/lighting/spherical_harmonics.h"
#include "shading/skin/skin.h"
#include "shading/vectors/vectors_tables.h"

static const double pi = 3.14159265358979323846;

static void put_rgb(const double rgb[3], int i, double *const *out)
{
    for (int c = 0; c < 3; c++)
        out[c][i] = rgb[c];
}

static void profile(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        double rgb[3];
        weft_skin_reflectance(WEFT_SKIN_RADIAL, in[0][i], rgb);
        put_rgb(rgb, i, out);
        weft_skin_reflectance(WEFT_SKIN_LINE, in[0][i], rgb);
        put_rgb(rgb, i, out + 3);
    }
}

static void transfer(int n, const double *const *in, double *const *out)
{
    static const weft_skin_profile profiles[] = {WEFT_SKIN_RADIAL, WEFT_SKIN_LINE, WEFT_SKIN_WIDE};
    for (int i = 0; i < n; i++)
        for (int p = 0; p < 3; p++) {
            double rgb[3];
            weft_skin_transfer(profiles[p], in[0][i], in[1][i], rgb);
            put_rgb(rgb, i, out + (ptrdiff_t)3 * p);
        }
}

static void put_zonal(weft_skin_profile which, double radius_mm, double end_rad, int i, double *const *out)
{
    double zonal[3][3];
    weft_skin_zonal(which, radius_mm, end_rad, zonal);
    for (int l = 0; l < 3; l++)
        put_rgb(zonal[l], i, out + (ptrdiff_t)3 * l);
}

static void zonal(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        put_zonal(WEFT_SKIN_RADIAL, in[0][i], pi, i, out);
        put_zonal(WEFT_SKIN_RADIAL, in[0][i], pi / 2, i, out + 9);
        put_zonal(WEFT_SKIN_LINE, in[0][i], pi, i, out + 18);
    }
}

static void sh_light(int n, const double *const *in, double *const *out)
{
    for (int i = 0; i < n; i++) {
        const double normal[3] = {in[0][i], in[1][i], in[2][i]}, kernel[3] = {in[3][i], in[4][i], in[5][i]};
        double light[WEFT_SH_COUNT];
        for (int k = 0; k < WEFT_SH_COUNT; k++)
            light[k] = in[6 + k][i];
        out[0][i] = weft_sh_convolve(normal, kernel, light);
    }
}

const weft_vectors_model weft_vectors_skin[] = {
    {"skin_D", "S-ORD-11", "theta r_mm", "Dr Dg Db line_Dr line_Dg line_Db wide_Dr wide_Dg wide_Db", 1e-11,
     transfer},
    {"skin_profile", "S-ORD-10", "d_mm", "Rr Rg Rb line_r line_g line_b", 1e-12, profile},
    {"skin_sh_eval", "S-ORD-13", "nx ny nz D0 D1 D2 L0 L1 L2 L3 L4 L5 L6 L7 L8", "f", 1e-12, sh_light},
    {"skin_zh", "S-ORD-12", "r_mm",
     "D0r D0g D0b D1r D1g D1b D2r D2g D2b half_D0r half_D0g half_D0b half_D1r half_D1g half_D1b half_D2r "
     "half_D2g half_D2b line_D0r line_D0g line_D0b line_D1r line_D1g line_D1b line_D2r line_D2g line_D2b",
     1e-11, zonal},
    {0},
};
