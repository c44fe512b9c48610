#include "shading/preview/preview_samples.h"

#include "shading/brdf/sampling.h"

#include <string.h>

enum { N_DIRECTIONS = 32 };

/* World to the panorama's frame: its zenith is +Z over the plane, +Y beside the other shapes, which then have
 * the middle of the panorama behind them. */
static void to_panorama(const weft_preview_setup *setup, const double world[3], double d[3])
{
    const bool lies = setup->view->shape == WEFT_PREVIEW_PLANE;
    d[0] = world[0];
    d[1] = lies ? world[1] : -world[2];
    d[2] = lies ? world[2] : world[1];
}

/* What the split sum needs of a GGX model, from its planes. */
typedef struct glossy {
    int albedo, f0, alpha, roughness, base, metallic; /* planes, -1: none */
} glossy;

static bool glossy_of(const weft_brdf *brdf, glossy *g)
{
    const char *const names[] = {"albedo", "f0", "alpha", "roughness", "base", "metallic"};
    int *const planes[] = {&g->albedo, &g->f0, &g->alpha, &g->roughness, &g->base, &g->metallic};
    static const char *const models[] = {"ggx", "ggx-specular", "unreal", "beckmann"};
    bool known = false;
    for (size_t i = 0; i < sizeof models / sizeof models[0]; i++)
        known |= strcmp(brdf->name, models[i]) == 0;
    for (int i = 0; i < 6; i++)
        if (!weft_brdf_find_param(brdf, names[i], planes[i]))
            *planes[i] = -1;
    return known;
}

static void add_glossy(const weft_preview_setup *setup, const glossy *g, weft_preview_samples *s)
{
    const weft_preview_surroundings *const around = &setup->view->surroundings;
    for (int i = 0; i < s->n; i++) {
        double n[3], r[3], d[3], e[3], mirrored[3];
        const double nv = weft_max(s->view[2][i], WEFT_MIN_NV);
        const double alpha =
            g->alpha >= 0 ? s->param[g->alpha][i] : s->param[g->roughness][i] * s->param[g->roughness][i];
        for (int c = 0; c < 3; c++) {
            n[c] = s->frame[2][c][i];
            r[c] = 2 * nv * n[c] - s->eye[c][i];
        }
        const double inverse = 1 / sqrt(weft_max(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], 1e-12));
        for (int c = 0; c < 3; c++)
            r[c] *= inverse;
        to_panorama(setup, n, d);
        weft_environment_map_irradiance(around->map, d, e);
        to_panorama(setup, r, d);
        weft_environment_map_look(around->map, d, sqrt(alpha), mirrored);
        const weft_environment_share share = weft_environment_table_at(around->table, nv, alpha);
        for (int c = 0; c < 3; c++) {
            const double metallic = g->metallic >= 0 ? s->param[g->metallic][i] : 0;
            const double base = g->base >= 0 ? s->param[g->base + c][i] : 0;
            const double f0 = g->f0 >= 0 ? s->param[g->f0 + c][i] : 0.04 + (base - 0.04) * metallic;
            const double albedo = g->albedo >= 0 ? s->param[g->albedo + c][i] : base * (1 - metallic);
            s->radiance[c][i] +=
                around->scale * (albedo * weft_environment_diffuse(share, f0) * e[c] / WEFT_PI +
                                 mirrored[c] * (f0 * share.scale + share.bias));
        }
    }
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
                s->light[c][i] = local[c];
        weft_preview_eval(setup, s, s->value);
        for (int i = 0; i < s->n; i++) {
            double world[3], d[3], radiance[3], basis[WEFT_SH_COUNT];
            for (int c = 0; c < 3; c++)
                world[c] = local[0] * s->frame[0][c][i] + local[1] * s->frame[1][c][i] +
                           local[2] * s->frame[2][c][i];
            to_panorama(setup, world, d);
            weft_sh_basis(d[0], d[1], d[2], basis);
            for (int c = 0; c < 3; c++) {
                radiance[c] = 0;
                for (int b = 0; b < WEFT_SH_COUNT; b++)
                    radiance[c] += around->map->light[c][b] * basis[b];
            }
            for (int c = 0; c < 3; c++)
                s->radiance[c][i] +=
                    around->scale * WEFT_PI / N_DIRECTIONS * s->value[c][i] * weft_max(radiance[c], 0);
        }
    }
}

void weft_preview_add_surroundings(const weft_preview_setup *setup, weft_preview_samples *s)
{
    glossy g;
    if (glossy_of(setup->surface->brdf, &g))
        add_glossy(setup, &g, s);
    else
        add_by_directions(setup, s);
}
