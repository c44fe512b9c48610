#define WEFT_SINGLE /* shading/brdf/real.h */

#include "shading/preview/preview_samples.h"

#include "shading/brdf/real.h"

/* The frame of the shading normal, whose tangent stays in the plane of the map's X, and the view in it. */
WEFT_CLONES
void weft_preview_set_frame(weft_preview_samples *s)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float x = s->normal[0][i], y = s->normal[1][i], z = s->normal[2][i];
        float n[3], t[3], local[3] = {0};
        for (int c = 0; c < 3; c++)
            n[c] = x * s->axis[0][c][i] + y * s->axis[1][c][i] + z * s->axis[2][c][i];
        /* tangent less its part along n; x is that part, for the axes are orthonormal */
        const float inverse = 1 / sqrtf(weft_max(1 - x * x, 1e-12F));
        for (int c = 0; c < 3; c++)
            t[c] = (s->axis[0][c][i] - x * n[c]) * inverse;
        const float b[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
        for (int c = 0; c < 3; c++) {
            const float v = s->eye[c][i];
            local[0] += v * t[c];
            local[1] += v * b[c];
            local[2] += v * n[c];
            s->frame[0][c][i] = t[c];
            s->frame[1][c][i] = b[c];
            s->frame[2][c][i] = n[c];
        }
        for (int c = 0; c < 3; c++)
            s->view[c][i] = local[c];
    }
}

WEFT_CLONES
void weft_preview_turn_lamp(weft_preview_samples *s)
{
    for (int a = 0; a < 3; a++) {
        WEFT_INDEPENDENT
        for (int i = 0; i < s->n; i++)
            s->light[a][i] = s->lamp[0][i] * s->frame[a][0][i] + s->lamp[1][i] * s->frame[a][1][i] +
                             s->lamp[2][i] * s->frame[a][2][i];
    }
}
