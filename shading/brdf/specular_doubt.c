#include "shading/brdf/specular_doubt.h"

#include "core/colour.h"
#include "core/log.h"

#include <math.h>

#define GREY_TOLERANCE 0.1 /* of the largest channel: a code of an 8-bit picture in the dark is 5 % */

unsigned weft_specular_doubts(const double diffuse[3], const double f0[3])
{
    const double most = fmax(f0[0], fmax(f0[1], f0[2])), least = fmin(f0[0], fmin(f0[1], f0[2]));
    if (weft_luminance(f0[0], f0[1], f0[2]) > WEFT_F0_METAL)
        return weft_luminance(diffuse[0], diffuse[1], diffuse[2]) > 0.2 ? WEFT_DOUBT_DIFFUSE : 0;
    return (most - least > GREY_TOLERANCE * most ? WEFT_DOUBT_COLOURED : 0U) |
           (most > 0 && least < WEFT_F0_DIELECTRIC_LEAST ? WEFT_DOUBT_LOW : 0U) |
           (most > WEFT_F0_DIELECTRIC_MOST ? WEFT_DOUBT_HIGH : 0U);
}

/* Both parameters of a pair where the model has them and they are constants; the diffuse one may be missing.
 */
static bool read_pair(const weft_brdf *brdf, const double *values, const bool *known,
                      const char *const names[2], double pair[2][3])
{
    for (int i = 0; i < 2; i++) {
        int plane = 0;
        const weft_brdf_param *const param = weft_brdf_find_param(brdf, names[i], &plane);
        if (!param && i == 1)
            return false;
        for (int c = 0; c < 3; c++) {
            const int at = plane + (param && param->components == 3 ? c : 0);
            if (i == 1 && known && !known[at])
                return false;
            pair[i][c] = param && (!known || known[at]) ? values[at] : 0;
        }
    }
    return true;
}

void weft_specular_warn(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], const bool *known)
{
    static const char *const pairs[][2] = {{"albedo", "f0"}, {"cloth_albedo", "cloth_f0"}};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        const char *const diffuse = pairs[i][0], *const f0 = pairs[i][1];
        double pair[2][3];
        if (!read_pair(brdf, values, known, pairs[i], pair))
            continue;
        const unsigned doubts = weft_specular_doubts(pair[0], pair[1]);
        if (doubts & WEFT_DOUBT_COLOURED)
            weft_warn(
                "%s %g,%g,%g: only metals (above %g) reflect in colour; give one number for all channels", f0,
                pair[1][0], pair[1][1], pair[1][2], WEFT_F0_METAL);
        if (doubts & WEFT_DOUBT_LOW)
            weft_warn("%s %g: no dielectric is below %g; fibres are 0.043 to 0.053", f0,
                      fmin(pair[1][0], fmin(pair[1][1], pair[1][2])), WEFT_F0_DIELECTRIC_LEAST);
        if (doubts & WEFT_DOUBT_HIGH)
            weft_warn("%s %g: dielectrics end at %g and metals begin at %g; fibres are 0.043 to 0.053", f0,
                      fmax(pair[1][0], fmax(pair[1][1], pair[1][2])), WEFT_F0_DIELECTRIC_MOST, WEFT_F0_METAL);
        if (doubts & WEFT_DOUBT_DIFFUSE)
            weft_warn(
                "%s is above 0.2 beside the %s of a metal (above %g), which has no diffuse light; lower "
                "one of them",
                diffuse, f0, WEFT_F0_METAL);
    }
}
