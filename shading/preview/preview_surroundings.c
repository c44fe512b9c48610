#include "shading/preview/preview_samples.h"

#include "core/clones.h"
#include "shading/brdf/sampling.h"

#include <math.h>
#include <string.h>

enum { N_DIRECTIONS = 128 };

/* Directions of a run in the panorama's frame, and what comes from them. */
typedef struct looks {
    float direction[3][WEFT_PREVIEW_RUN], alpha[WEFT_PREVIEW_RUN], radiance[3][WEFT_PREVIEW_RUN];
} looks;

/* One local direction in the frames of the samples, seen in the panorama: its zenith is +Z over the plane, +Y
 * beside the other shapes (the axis of their turn too), which then have the middle of the panorama behind
 * them. */
WEFT_CLONES
static void aim(const weft_preview_setup *setup, const weft_preview_samples *s, const float local[3],
                looks *to)
{
    const float lies = setup->view->shape == WEFT_PREVIEW_PLANE ? 1 : 0;
    const float turn_cos = (float)setup->turn_cos, turn_sin = (float)setup->turn_sin;
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        float world[3];
        for (int c = 0; c < 3; c++)
            world[c] =
                local[0] * s->frame[0][c][i] + local[1] * s->frame[1][c][i] + local[2] * s->frame[2][c][i];
        const float y = lies * world[1] - (1 - lies) * world[2];
        to->direction[0][i] = turn_cos * world[0] - turn_sin * y;
        to->direction[1][i] = turn_sin * world[0] + turn_cos * y;
        to->direction[2][i] = lies * world[2] + (1 - lies) * world[1];
    }
}

WEFT_CLONES
static void add_value(const looks *from, float scale, weft_preview_samples *s)
{
    for (int c = 0; c < 3; c++)
        WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++)
        s->radiance[c][i] += scale * s->value[c][i] * from->radiance[c][i];
}

/* Any other model: the mean over directions of pi f L, drawn with the cosine.  Each looks up the mips of the
 * panorama as widely as its share of the sky, pi/(N cos) sr: a lobe of GGX has about 4 pi alpha^2 (Krivanek
 * and Colbert 2008), so that small bright lamps are neither missed nor counted twice. */
static void add_by_directions(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const float scale = (float)(setup->view->surroundings.scale * WEFT_PI / N_DIRECTIONS);
    looks to;
    const float *const direction[3] = {to.direction[0], to.direction[1], to.direction[2]};
    float *const radiance[3] = {to.radiance[0], to.radiance[1], to.radiance[2]};
    for (uint32_t k = 0; k < N_DIRECTIONS; k++) {
        double u[2], local[3];
        weft_hammersley(k, N_DIRECTIONS, u);
        weft_sample_cosine(u[0], u[1], local);
        const float towards[3] = {(float)local[0], (float)local[1], (float)local[2]};
        const float alpha = 0.5F / sqrtf((float)N_DIRECTIONS * (towards[2] > 0.05F ? towards[2] : 0.05F));
        for (int i = 0; i < s->n; i++) {
            for (int c = 0; c < 3; c++)
                s->light[c][i] = towards[c];
            to.alpha[i] = alpha;
        }
        weft_preview_eval(setup, s, s->value);
        aim(setup, s, towards, &to);
        weft_environment_planes_look(&setup->around, s->n, direction, to.alpha, radiance);
        add_value(&to, scale, s);
    }
}

/* Lambert's own: the irradiance of three bands is within a percent of it. */
static void add_matte(const weft_preview_setup *setup, weft_preview_samples *s)
{
    static const float normal[3] = {0, 0, 1};
    looks to;
    const float *const direction[3] = {to.direction[0], to.direction[1], to.direction[2]};
    float *const irradiance[3] = {to.radiance[0], to.radiance[1], to.radiance[2]};
    aim(setup, s, normal, &to);
    weft_environment_planes_irradiance(&setup->around, s->n, direction, irradiance);
    for (int c = 0; c < 3; c++)
        memcpy(s->light[c], s->view[c], sizeof s->light[c]); /* any will do: f is constant */
    weft_preview_eval(setup, s, s->value);
    add_value(&to, (float)setup->view->surroundings.scale, s);
}

void weft_preview_add_surroundings(const weft_preview_setup *setup, weft_preview_samples *s)
{
    if (strcmp(setup->surface->brdf->name, "lambert") == 0)
        add_matte(setup, s);
    else if (!weft_preview_add_split_sum(setup, s))
        add_by_directions(setup, s);
}
