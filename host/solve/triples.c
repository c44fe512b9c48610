#include "host/solve/triples.h"

#include "core/clones.h"

#include <math.h>

enum {
    LANES = WEFT_SOLVE_LANES,
    FEW_LIGHTS = 12, /* up to which every triple is tried */
    /* Triples tried of more; all of 12 lights are as many. */
    MOST_TRIPLES = 220
};

/* A triple whose directions span less volume than this says little; more keeps the smallest singular value
 * above WEFT_SOLVE_MIN_SINGULAR.  Lights that are left out span none. */
static const float least_volume = 0.08F;

/* ---- all triples of few lights ---- */

/* The normals that fit one light, the hub, lie in a plane: v = g L + s U + t W with L its direction and U, W
 * across it.  What the other lights disagree by is e - s u - t w there: two unknowns instead of three, and
 * two lights more fix them. */
typedef struct hub_plane {
    weft_lane_vectors u, w, at; /* `at`: g L */
    float bar[LANES];           /* least volume; beyond any where the hub is left out */
    float best_s[LANES], best_t[LANES], best_cost[LANES];
} hub_plane;

/* Another light on that plane, over its sigma. */
typedef struct hub_light {
    float e[LANES], u[LANES], w[LANES], over[LANES];
} hub_light;

/* Directions across the hub's without a branch: Duff et al., "Building an orthonormal basis, revisited",
 * JCGT 6 (1), 2017. */
WEFT_INLINE void lay_plane(const weft_triple_light *hub, const weft_triple_best *best, hub_plane *p)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float x = hub->light.x[k], y = hub->light.y[k], z = hub->light.z[k], g = hub->grey[k];
        const float sign = z >= 0 ? 1.0F : -1.0F, a = -1 / (sign + z), b = x * y * a;
        p->u.x[k] = 1 + sign * x * x * a, p->u.y[k] = sign * b, p->u.z[k] = -sign * x;
        p->w.x[k] = b, p->w.y[k] = sign + y * y * a, p->w.z[k] = -y;
        p->at.x[k] = g * x, p->at.y[k] = g * y, p->at.z[k] = g * z;
        p->bar[k] = x * x + y * y + z * z > 0.5F ? least_volume : 1e6F;
        p->best_s[k] = p->best_t[k] = 0;
        p->best_cost[k] = best->cost[k];
    }
}

WEFT_INLINE void lay_light(const weft_triple_light *light, const hub_plane *p, hub_light *to)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float x = light->scaled.x[k], y = light->scaled.y[k], z = light->scaled.z[k];
        to->e[k] = light->scaled_grey[k] - (p->at.x[k] * x + p->at.y[k] * y + p->at.z[k] * z);
        to->u[k] = p->u.x[k] * x + p->u.y[k] * y + p->u.z[k] * z;
        to->w[k] = p->w.x[k] * x + p->w.y[k] * y + p->w.z[k] * z;
        to->over[k] = light->over[k];
    }
}

typedef struct plane_point {
    float s[LANES], t[LANES], cost[LANES];
} plane_point;

/* Where two lights agree on the plane. */
WEFT_INLINE void meet(const hub_plane *p, const hub_light *a, const hub_light *b, plane_point *to)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float det = a->u[k] * b->w[k] - b->u[k] * a->w[k];
        const int fit = fabsf(det) > p->bar[k] * (a->over[k] * b->over[k]);
        const float over = 1 / (fit ? det : 1.0F);
        to->s[k] = over * (a->e[k] * b->w[k] - b->e[k] * a->w[k]);
        to->t[k] = over * (a->u[k] * b->e[k] - b->u[k] * a->e[k]);
        to->cost[k] = fit ? 0.0F : WEFT_TRIPLE_NONE;
    }
}

WEFT_INLINE void add_distance(const hub_light *lights, int first, int last, plane_point *v)
{
    for (int m = first; m < last; m++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float d = lights[m].e[k] - v->s[k] * lights[m].u[k] - v->t[k] * lights[m].w[k];
            const float q = d * d;
            v->cost[k] += q < WEFT_TRIPLE_CUT2 ? q : WEFT_TRIPLE_CUT2;
        }
}

WEFT_INLINE void try_pair(const hub_light *lights, int n, int hub, int j, int l, hub_plane *p)
{
    plane_point v;
    meet(p, &lights[j], &lights[l], &v);
    add_distance(lights, 0, hub, &v); /* the triple's own three lights it fits */
    add_distance(lights, hub + 1, j, &v);
    add_distance(lights, j + 1, l, &v);
    add_distance(lights, l + 1, n, &v);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const int better = v.cost[k] < p->best_cost[k];
        p->best_cost[k] = better ? v.cost[k] : p->best_cost[k];
        p->best_s[k] = better ? v.s[k] : p->best_s[k];
        p->best_t[k] = better ? v.t[k] : p->best_t[k];
    }
}

WEFT_INLINE void try_all(const weft_triple_light *lights, int n, weft_triple_best *best)
{
    _Alignas(64) hub_light laid[FEW_LIGHTS];
    _Alignas(64) hub_plane p;
    for (int hub = 0; hub < n - 2; hub++) {
        lay_plane(&lights[hub], best, &p);
        for (int m = 0; m < n; m++)
            lay_light(&lights[m], &p, &laid[m]);
        for (int j = hub + 1; j < n; j++)
            for (int l = j + 1; l < n; l++)
                try_pair(laid, n, hub, j, l, &p);
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const int better = p.best_cost[k] < best->cost[k];
            const float s = p.best_s[k], t = p.best_t[k];
            best->cost[k] = p.best_cost[k];
            best->normal.x[k] = better ? p.at.x[k] + s * p.u.x[k] + t * p.w.x[k] : best->normal.x[k];
            best->normal.y[k] = better ? p.at.y[k] + s * p.u.y[k] + t * p.w.y[k] : best->normal.y[k];
            best->normal.z[k] = better ? p.at.z[k] + s * p.u.z[k] + t * p.w.z[k] : best->normal.z[k];
        }
    }
}

/* ---- some triples of many ---- */

typedef struct candidates {
    float x[LANES], y[LANES], z[LANES], cost[LANES];
} candidates;

WEFT_INLINE void cross(const weft_lane_vectors *a, const weft_lane_vectors *b, weft_lane_vectors *to)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        to->x[k] = a->y[k] * b->z[k] - a->z[k] * b->y[k];
        to->y[k] = a->z[k] * b->x[k] - a->x[k] * b->z[k];
        to->z[k] = a->x[k] * b->y[k] - a->y[k] * b->x[k];
    }
}

/* Three lights and the cross products of their pairs. */
typedef struct triple {
    int i, j, l;
    const weft_lane_vectors *ij, *il, *jl;
} triple;

/* The scaled normal that three lights agree on, by Cramer's rule. */
WEFT_INLINE void agree(const weft_triple_light *lights, const triple *t, candidates *to)
{
    const weft_triple_light *const a = &lights[t->i], *const b = &lights[t->j], *const c = &lights[t->l];
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float volume =
            t->ij->x[k] * c->light.x[k] + t->ij->y[k] * c->light.y[k] + t->ij->z[k] * c->light.z[k];
        const int fit = fabsf(volume) > least_volume;
        const float over = 1 / (fit ? volume : 1.0F);
        to->x[k] = over * (a->grey[k] * t->jl->x[k] - b->grey[k] * t->il->x[k] + c->grey[k] * t->ij->x[k]);
        to->y[k] = over * (a->grey[k] * t->jl->y[k] - b->grey[k] * t->il->y[k] + c->grey[k] * t->ij->y[k]);
        to->z[k] = over * (a->grey[k] * t->jl->z[k] - b->grey[k] * t->il->z[k] + c->grey[k] * t->ij->z[k]);
        to->cost[k] = fit ? 0.0F : WEFT_TRIPLE_NONE;
    }
}

/* Adds what the lights of `first` to `last` do not agree with. */
WEFT_INLINE void add_cost(const weft_triple_light *lights, int first, int last, candidates *v)
{
    for (int m = first; m < last; m++)
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const weft_triple_light *const at = &lights[m];
            const float d = at->scaled_grey[k] - (v->x[k] * at->scaled.x[k] + v->y[k] * at->scaled.y[k] +
                                                  v->z[k] * at->scaled.z[k]);
            const float q = d * d;
            v->cost[k] += q < WEFT_TRIPLE_CUT2 ? q : WEFT_TRIPLE_CUT2;
        }
}

WEFT_INLINE void try_triple(const weft_triple_light *lights, int n, const triple *t, weft_triple_best *best)
{
    candidates v;
    agree(lights, t, &v);
    add_cost(lights, 0, t->i, &v); /* its own three lights it fits */
    add_cost(lights, t->i + 1, t->j, &v);
    add_cost(lights, t->j + 1, t->l, &v);
    add_cost(lights, t->l + 1, n, &v);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const int better = v.cost[k] < best->cost[k];
        best->cost[k] = better ? v.cost[k] : best->cost[k];
        best->normal.x[k] = better ? v.x[k] : best->normal.x[k];
        best->normal.y[k] = better ? v.y[k] : best->normal.y[k];
        best->normal.z[k] = better ? v.z[k] : best->normal.z[k];
    }
}

/* Of many lights' triples every so many, in the order (0, 1, 2), (0, 1, 3), ..., of which only the ones that
 * are tried are come by: the triples that begin with i, or with i and j, are stepped over together. */
WEFT_INLINE void try_some(const weft_triple_light *lights, int n, weft_triple_best *best)
{
    const long all = (long)n * (n - 1) * (n - 2) / 6;
    long i = 0, j = 1, of_i = 0, of_j = 0; /* the numbers of the first triples with i, and with i and j */
    for (long tried = 0; tried < MOST_TRIPLES; tried++) {
        const long number = (2 * tried + 1) * all / (2L * MOST_TRIPLES);
        while (number >= of_i + (n - 1 - i) * (n - 2 - i) / 2) {
            of_i += (n - 1 - i) * (n - 2 - i) / 2;
            i++;
            of_j = of_i;
            j = i + 1;
        }
        while (number >= of_j + n - 1 - j) {
            of_j += n - 1 - j;
            j++;
        }
        const int l = (int)(j + 1 + number - of_j);
        weft_lane_vectors ij, il, jl;
        cross(&lights[i].light, &lights[j].light, &ij);
        cross(&lights[i].light, &lights[l].light, &il);
        cross(&lights[j].light, &lights[l].light, &jl);
        const triple t = {(int)i, (int)j, l, &ij, &il, &jl};
        try_triple(lights, n, &t, best);
    }
}

WEFT_CLONES void weft_triples_search(const weft_triple_light *lights, int n, weft_triple_best *best)
{
    _Alignas(64) weft_triple_best found = {0};
    for (int k = 0; k < LANES; k++)
        found.cost[k] = WEFT_TRIPLE_NONE;
    if (n <= FEW_LIGHTS)
        try_all(lights, n, &found);
    else
        try_some(lights, n, &found);
    *best = found;
}
