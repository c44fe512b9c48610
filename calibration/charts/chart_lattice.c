#include "calibration/charts/chart_lattice.h"

#include "calibration/charts/homography.h"

#include <math.h>
#include <string.h>

typedef struct vec2 {
    double u, v;
} vec2;

/* A node with the steps to its neighbours as the picture shows them here. */
typedef struct steps_here {
    vec2 right, down;
} steps_here;

/* Squared Mahalanobis length of (u, v) for the covariance of a blob, and the scalar product. */
static double product(const weft_blob *b, vec2 p, vec2 q)
{
    const double det = b->cuu * b->cvv - b->cuv * b->cuv;
    return (b->cvv * p.u * q.u - b->cuv * (p.u * q.v + p.v * q.u) + b->cuu * p.v * q.v) / det;
}

static bool alike(const weft_blob *a, const weft_blob *b)
{
    const double ratio = a->area / b->area;
    return ratio > 0.55 && ratio < 1.8;
}

static vec2 between(const weft_blob *a, const weft_blob *b)
{
    return (vec2){b->u - a->u, b->v - a->v};
}

/* Two neighbours of the seed at a right angle; of all pairs the one that fits best. */
static bool find_steps(const weft_blobs *blobs, int seed, double reach, const unsigned char *used,
                       steps_here *steps)
{
    const weft_blob *const s = &blobs->items[seed];
    int near[32], n = 0;
    for (int k = 0; k < blobs->n && n < 32; k++) {
        if (k == seed || used[k] || !alike(s, &blobs->items[k]))
            continue;
        const vec2 d = between(s, &blobs->items[k]);
        const double length = sqrt(product(s, d, d)) / reach;
        if (length > 0.82 && length < 1.2)
            near[n++] = k;
    }
    double best = 0.2; /* cosine of the angle plus errors of the lengths */
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++) {
            const vec2 right = between(s, &blobs->items[near[a]]), down = between(s, &blobs->items[near[b]]);
            if (right.u * down.v - right.v * down.u <= 0)
                continue;
            const double lr = sqrt(product(s, right, right)), ld = sqrt(product(s, down, down));
            const double misfit = fabs(product(s, right, down)) / (lr * ld) + 0.5 * fabs(lr / reach - 1) +
                                  0.5 * fabs(ld / reach - 1);
            if (misfit < best) {
                best = misfit;
                *steps = (steps_here){right, down};
            }
        }
    return best < 0.2;
}

static int nearest_blob(const weft_blobs *blobs, const unsigned char *used, const weft_blob *like, vec2 at,
                        double *distance)
{
    int best = -1;
    *distance = INFINITY;
    for (int k = 0; k < blobs->n; k++) {
        if (used[k] || !alike(like, &blobs->items[k]))
            continue;
        const double d = hypot(blobs->items[k].u - at.u, blobs->items[k].v - at.v);
        if (d < *distance) {
            *distance = d;
            best = k;
        }
    }
    return best;
}

static bool has_place(const weft_lattice *lattice, int i, int j, int blob)
{
    for (int k = 0; k < lattice->n; k++)
        if ((lattice->nodes[k].i == i && lattice->nodes[k].j == j) || lattice->nodes[k].blob == blob)
            return true;
    return false;
}

/* Tries the neighbour of node k in one of the four directions. */
static void extend(const weft_blobs *blobs, const unsigned char *used, weft_lattice *lattice,
                   steps_here *steps, int k, int direction)
{
    static const int di[4] = {1, -1, 0, 0}, dj[4] = {0, 0, 1, -1};
    const weft_lattice_node from = lattice->nodes[k];
    const weft_blob *const b = &blobs->items[from.blob];
    const int sign = direction % 2 ? -1 : 1;
    const vec2 step = direction < 2 ? steps[k].right : steps[k].down;
    const vec2 at = {b->u + sign * step.u, b->v + sign * step.v};
    double distance;
    const int blob = nearest_blob(blobs, used, b, at, &distance);
    const double length = hypot(step.u, step.v);
    const int i = from.i + di[direction], j = from.j + dj[direction];
    if (blob < 0 || distance > 0.17 * length || lattice->n >= WEFT_LATTICE_MAX ||
        has_place(lattice, i, j, blob))
        return;
    const vec2 seen = between(b, &blobs->items[blob]);
    steps_here here = steps[k];
    if (direction < 2)
        here.right = (vec2){sign * seen.u, sign * seen.v};
    else
        here.down = (vec2){sign * seen.u, sign * seen.v};
    steps[lattice->n] = here;
    lattice->nodes[lattice->n++] = (weft_lattice_node){blob, i, j};
}

static bool fit_map(const weft_blobs *blobs, const steps_here *first, weft_lattice *lattice)
{
    weft_homography_sight sights[2 * WEFT_LATTICE_MAX];
    double scratch[4 * WEFT_LATTICE_MAX], rms;
    int n = 0;
    for (int k = 0; k < lattice->n; k++) {
        const weft_lattice_node *const node = &lattice->nodes[k];
        const weft_blob *const b = &blobs->items[node->blob];
        sights[n++] = (weft_homography_sight){node->i, node->j, b->u, b->v, 1, 0};
        sights[n++] = (weft_homography_sight){node->i, node->j, b->u, b->v, 0, 1};
    }
    const weft_blob *const seed = &blobs->items[lattice->nodes[0].blob];
    lattice->to_pixel = (weft_mat3){
        {first->right.u, first->down.u, seed->u, first->right.v, first->down.v, seed->v, 0, 0, 1}};
    return weft_homography_refine(sights, n, true, scratch, &lattice->to_pixel, &rms, NULL) == WEFT_OK &&
           rms < 0.1 * hypot(first->right.u, first->right.v);
}

bool weft_lattice_grow(const weft_blobs *blobs, int seed, double ratio, const unsigned char *used,
                       weft_lattice *lattice)
{
    steps_here steps[WEFT_LATTICE_MAX];
    memset(lattice, 0, sizeof *lattice);
    if (used[seed] || !find_steps(blobs, seed, sqrt(12.0) * ratio, used, &steps[0]))
        return false;
    lattice->nodes[0] = (weft_lattice_node){seed, 0, 0};
    lattice->n = 1;
    for (int k = 0; k < lattice->n; k++) /* grows while it is walked through */
        for (int direction = 0; direction < 4; direction++)
            extend(blobs, used, lattice, steps, k, direction);
    for (int k = 0; k < lattice->n; k++) {
        const weft_lattice_node *const node = &lattice->nodes[k];
        lattice->i_min = node->i < lattice->i_min ? node->i : lattice->i_min;
        lattice->i_max = node->i > lattice->i_max ? node->i : lattice->i_max;
        lattice->j_min = node->j < lattice->j_min ? node->j : lattice->j_min;
        lattice->j_max = node->j > lattice->j_max ? node->j : lattice->j_max;
    }
    return lattice->n >= 6 && lattice->i_max > lattice->i_min && lattice->j_max > lattice->j_min &&
           fit_map(blobs, &steps[0], lattice);
}
