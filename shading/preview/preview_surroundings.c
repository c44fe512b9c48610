#include "shading/preview/preview_samples.h"

#include "shading/brdf/sampling.h"

#include <string.h>

enum { N_DIRECTIONS = 32 };

/* World to the panorama's frame: its zenith is +Z over the plane, +Y beside the other shapes, which then have
 * the middle of the panorama behind them. */
static void to_panorama(const weft_preview_setup *setup, const double world[3], double d[3])
{
    const bool lies = setup->view->shape == WEFT_PREVIEW_PLANE;
    const double y = lies ? world[1] : -world[2]; /* the zenith is the axis of the turn too */
    d[0] = setup->turn_cos * world[0] - setup->turn_sin * y;
    d[1] = setup->turn_sin * world[0] + setup->turn_cos * y;
    d[2] = lies ? world[2] : world[1];
}

/* Any other model: the mean over directions of pi f L, drawn with the cosine; L in three bands. */
static void add_by_directions(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_surroundings *const around = &setup->view->surroundings;
    for (uint32_t k = 0; k < N_DIRECTIONS; k++) {
        double u[2], local[3];
        weft_hammersley(k, N_DIRECTIONS, u);
        weft_sample_cosine(u[0], u[1], local);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < s->n; i++)
                s->light[c][i] = (float)local[c];
        weft_preview_eval(setup, s, s->value);
        for (int i = 0; i < s->n; i++) {
            double world[3], d[3], radiance[3], basis[WEFT_SH_COUNT];
            for (int c = 0; c < 3; c++)
                world[c] = local[0] * (double)s->frame[0][c][i] + local[1] * (double)s->frame[1][c][i] +
                           local[2] * (double)s->frame[2][c][i];
            to_panorama(setup, world, d);
            weft_sh_basis(d[0], d[1], d[2], basis);
            for (int c = 0; c < 3; c++) {
                radiance[c] = 0;
                for (int b = 0; b < WEFT_SH_COUNT; b++)
                    radiance[c] += around->map->light[c][b] * basis[b];
            }
            for (int c = 0; c < 3; c++)
                s->radiance[c][i] += (float)(around->scale * WEFT_PI / N_DIRECTIONS * (double)s->value[c][i] *
                                             weft_max(radiance[c], 0));
        }
    }
}

void weft_preview_add_surroundings(const weft_preview_setup *setup, weft_preview_samples *s)
{
    if (!weft_preview_add_split_sum(setup, s))
        add_by_directions(setup, s);
}
