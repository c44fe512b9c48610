#include "shading/preview/tone.h"

#include "shading/brdf/half_vector.h"

const char weft_tone_names[] = "none|aces|agx";

static double clamp01(double x)
{
    return x > 0 ? (x < 1 ? x : 1) : 0;
}

static void apply_matrix(const double m[3][3], double rgb[3])
{
    const double in[3] = {rgb[0], rgb[1], rgb[2]};
    for (int c = 0; c < 3; c++)
        rgb[c] = m[c][0] * in[0] + m[c][1] * in[1] + m[c][2] * in[2];
}

static void apply_agx(double rgb[3])
{
    static const double inset[3][3] = {{0.842479062253094, 0.0784335999999992, 0.0792237451477643},
                                       {0.0423282422610123, 0.878468636469772, 0.0791661274605434},
                                       {0.0423756549057051, 0.0784336, 0.879142973793104}};
    static const double outset[3][3] = {{1.19687900512017, -0.0980208811401368, -0.0990297440797205},
                                        {-0.0528968517574562, 1.15190312990417, -0.0989611768448433},
                                        {-0.0529716355144438, -0.0980434501171241, 1.15107367264116}};
    static const double curve[7] = {-0.00232, 0.1191, 0.4298, -6.868, 31.96, -40.14, 15.5};
    const double low = -12.47393, high = 4.026069;
    apply_matrix(inset, rgb);
    for (int c = 0; c < 3; c++) {
        const double x = clamp01((log2(weft_max(rgb[c], 1e-10)) - low) / (high - low));
        double y = 0;
        for (int k = 6; k >= 0; k--)
            y = y * x + curve[k];
        rgb[c] = y;
    }
    apply_matrix(outset, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = pow(clamp01(rgb[c]), 2.2); /* the curve ends in display codes */
}

void weft_tone_apply(weft_tone tone, double rgb[3])
{
    for (int c = 0; c < 3; c++)
        rgb[c] = rgb[c] > 0 ? (rgb[c] < 1e6 ? rgb[c] : 1e6) : 0; /* NaN fails the first test */
    if (tone == WEFT_TONE_AGX)
        apply_agx(rgb);
    for (int c = 0; c < 3 && tone == WEFT_TONE_ACES; c++) {
        const double x = 0.6 * rgb[c];
        rgb[c] = clamp01(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14));
    }
}

void weft_tone_image(weft_tone tone, weft_image *picture)
{
    const size_t n = weft_image_plane_size(picture);
    for (size_t i = 0; i < n && tone != WEFT_TONE_NONE; i++) {
        double rgb[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = (double)weft_image_plane(picture, c)[i];
        weft_tone_apply(tone, rgb);
        for (int c = 0; c < 3; c++)
            weft_image_plane(picture, c)[i] = (float)rgb[c];
    }
}
