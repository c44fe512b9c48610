#define WEFT_SINGLE /* shading/brdf/real.h */

#include "shading/preview/preview_samples.h"

#include "shading/brdf/log_positive.h"

#include <string.h>

/* What samples see of the map: ellipses in texels of level 0. */
typedef struct footprint {
    float along[2][WEFT_PREVIEW_RUN]; /* the long axis, u and v, of full length */
    float taps[WEFT_PREVIEW_RUN];     /* look-ups along it */
    float lod[WEFT_PREVIEW_RUN];      /* level of each: log2 of its width */
} footprint;

/*
 * How a step of one sample on the screen moves over the map: the step is projected along the view onto the
 * shape's tangent plane.  On the sphere, whose map is equidistant along the meridians, the steps across them
 * cover theta/sin(theta) more.
 */
WEFT_INLINE void step_over_map(const weft_preview_samples *s, int i, const float screen[3], float round,
                               float step[2])
{
    const float nx = s->axis[2][0][i], ny = s->axis[2][1][i];
    float te = 0, be = 0, ne = 0, ts = 0, bs = 0, ns = 0;
    for (int c = 0; c < 3; c++) {
        te += s->axis[0][c][i] * s->eye[c][i];
        be += s->axis[1][c][i] * s->eye[c][i];
        ne += s->axis[2][c][i] * s->eye[c][i];
        ts += s->axis[0][c][i] * screen[c];
        bs += s->axis[1][c][i] * screen[c];
        ns += s->axis[2][c][i] * screen[c];
    }
    const float lean = ns / weft_max(ne, 0.02F);
    const float p = ts - te * lean, q = bs - be * lean;
    const float sine2 = nx * nx + ny * ny, unit = 1 / sqrtf(weft_max(sine2, 1e-12F));
    const float rx = nx * unit, ry = ny * unit, across = (q * rx - p * ry) * (round - 1);
    step[0] = p - across * ry;
    step[1] = -(q + across * rx);
}

WEFT_CLONES
static void find_footprints(const weft_preview_setup *setup, const weft_preview_samples *s, footprint *f)
{
    const float scale = (float)(setup->texels_per_px / setup->supersampling);
    const float most = setup->view->filter == WEFT_PREVIEW_ANISOTROPIC ? (float)setup->view->max_taps : 1;
    const float sphere = setup->view->shape == WEFT_PREVIEW_SPHERE ? 1 : 0;
    const float u0 = (float)(setup->crop.width / 2.0 - 0.5), v0 = (float)(setup->crop.height / 2.0 - 0.5);
    const float radius = sphere > 0 ? (float)setup->radius_texels : 1;
    /* the picture's axes in the frame of a turned sample */
    const float c = (float)setup->turn_cos, sine = (float)setup->turn_sin;
    const bool plane = setup->view->shape == WEFT_PREVIEW_PLANE;
    const float right[3] = {c, plane ? -sine : 0, plane ? 0 : sine};
    const float up[3] = {plane ? sine : 0, plane ? c : 1, 0};
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float u = (float)s->u[i] - u0, v = (float)s->v[i] - v0;
        const float nx = s->axis[2][0][i], ny = s->axis[2][1][i], sine2 = nx * nx + ny * ny;
        const float theta = sqrtf(u * u + v * v) / radius;
        const float wide = theta / sqrtf(weft_max(sine2, 1e-6F)) - 1;
        const float round = 1 + sphere * (sine2 > 1e-6F ? wide : 0);
        float a[2], b[2];
        step_over_map(s, i, right, round, a);
        step_over_map(s, i, up, round, b);
        /* the ellipse's axes: eigenvalues of J J^T */
        const float aa = a[0] * a[0] + b[0] * b[0], bb = a[1] * a[1] + b[1] * b[1];
        const float ab = a[0] * a[1] + b[0] * b[1], half = 0.5F * (aa - bb), mean = 0.5F * (aa + bb);
        const float root = sqrtf(half * half + ab * ab);
        const float major = scale * sqrtf(mean + root), minor = scale * sqrtf(weft_max(mean - root, 1e-12F));
        const float x = half > 0 ? half + root : ab, y = half > 0 ? ab : root - half;
        const float length2 = x * x + y * y, inverse = major / sqrtf(weft_max(length2, 1e-20F));
        const float wanted = weft_max(ceilf(major / minor - 1e-3F), 1);
        const float taps = wanted < most ? wanted : most, share = major / taps;
        const float width = weft_max(minor, share);
        f->along[0][i] = x * inverse;
        f->along[1][i] = y * inverse;
        f->taps[i] = taps;
        f->lod[i] = weft_log_positive(width) * (1 / WEFT_LN2);
    }
}

/* One look-up a sample: four texels of two levels. */
typedef struct lookup {
    int level[WEFT_PREVIEW_RUN];    /* the finer one */
    int at[2][4][WEFT_PREVIEW_RUN]; /* texels, in each level's own count */
    float share[2][4][WEFT_PREVIEW_RUN];
    float sign[2][WEFT_PREVIEW_RUN]; /* of the normal's x, y: -1 in a mirrored repeat */
} lookup;

/* Folds a coordinate into 0..size by mirroring. */
WEFT_INLINE float mirror(double t, double size, float *sign)
{
    const double periods = t / (2 * size), within = 2 * size * (periods - floor(periods));
    *sign = within < size ? 1 : -1;
    return (float)(within < size ? within : 2 * size - within);
}

/* Texels around a place (in texels of the level, from its corner) and their weights. */
WEFT_INLINE void place(float x, float y, int width, int height, float weight, lookup *l, int which, int i)
{
    const float left = weft_max(x - 0.5F, 0), top = weft_max(y - 0.5F, 0);
    const int x0 = (int)left < width - 1 ? (int)left : width - 1, x1 = x0 < width - 1 ? x0 + 1 : x0;
    const int y0 = (int)top < height - 1 ? (int)top : height - 1, y1 = y0 < height - 1 ? y0 + 1 : y0;
    const float fx = left - (float)x0, fy = top - (float)y0;
    l->at[which][0][i] = y0 * width + x0;
    l->at[which][1][i] = y0 * width + x1;
    l->at[which][2][i] = y1 * width + x0;
    l->at[which][3][i] = y1 * width + x1;
    l->share[which][0][i] = weight * (1 - fx) * (1 - fy);
    l->share[which][1][i] = weight * fx * (1 - fy);
    l->share[which][2][i] = weight * (1 - fx) * fy;
    l->share[which][3][i] = weight * fx * fy;
}

/* Tap number `tap` of each sample; samples that have fewer get shares of 0. */
WEFT_CLONES
static void place_taps(const weft_preview_setup *setup, const weft_preview_samples *s, const footprint *f,
                       int tap, lookup *l)
{
    const weft_preview_texture *const t = setup->texture;
    const weft_preview_crop crop = setup->crop;
    const double width0 = setup->surface->width, height0 = setup->surface->height;
    const int last = t->levels - 1, finest = t->first, coarsest = last > finest ? last - 1 : finest;
    const int more = last > finest;
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float offset = ((float)tap + 0.5F) / f->taps[i] - 0.5F;
        const float weight = (float)tap < f->taps[i] ? 1 / f->taps[i] : 0;
        const double u = s->u[i] + (double)(offset * f->along[0][i]) + 0.5;
        const double v = s->v[i] + (double)(offset * f->along[1][i]) + 0.5;
        float sign_x, sign_y;
        const float x = (float)((crop.x + (double)mirror(u, crop.width, &sign_x)) / width0);
        const float y = (float)((crop.y + (double)mirror(v, crop.height, &sign_y)) / height0);
        const float high = weft_max(f->lod[i], (float)finest), lod = high < (float)last ? high : (float)last;
        const int level = (int)lod < coarsest ? (int)lod : coarsest;
        const float part = lod - (float)level;
        const int w0 = t->width[level], h0 = t->height[level];
        const int w1 = t->width[level + more], h1 = t->height[level + more];
        place(x * (float)w0, y * (float)h0, w0, h0, weight * (1 - part), l, 0, i);
        place(x * (float)w1, y * (float)h1, w1, h1, weight * part, l, 1, i);
        l->level[i] = level;
        l->sign[0][i] = sign_x;
        l->sign[1][i] = sign_y;
    }
}

/* Eight channels at once: gcc makes no vector code of the plain loop that widens 16 bits to floats, and with
 * it whole pictures took 1.4 (plane) to 1.7 times (ball) as long. */
typedef int16_t packed8 __attribute__((vector_size(16)));
typedef int32_t wide8 __attribute__((vector_size(32)));
typedef float float8 __attribute__((vector_size(32)));

/* Adds eight channels of the texels to sums [n][8]. */
WEFT_CLONES
static void gather(const weft_preview_texture *t, const lookup *l, int n, int channel, float (*sums)[8])
{
    const int more = t->levels - 1 > t->first, stride = t->stride;
    const bool turns = channel == 0 && t->plane[0] == -1;
    for (int i = 0; i < n; i++) {
        float8 sum, texel_sum = {0};
        for (int which = 0; which < 2; which++) {
            const int16_t *const level = t->level[l->level[i] + which * more] + channel;
            for (int k = 0; k < 4; k++) {
                packed8 texel;
                memcpy(&texel, level + (size_t)l->at[which][k][i] * (size_t)stride, sizeof texel);
                const wide8 wide = __builtin_convertvector(texel, wide8);
                texel_sum += l->share[which][k][i] * __builtin_convertvector(wide, float8);
            }
        }
        const float8 sign = {turns ? l->sign[0][i] : 1, turns ? l->sign[1][i] : 1, 1, 1, 1, 1, 1, 1};
        memcpy(&sum, sums[i], sizeof sum);
        sum += sign * texel_sum;
        memcpy(sums[i], &sum, sizeof sum);
    }
}

/* From sums of texels to values. */
WEFT_CLONES
static void unpack(const float (*sums)[8], int c, int n, float scale, float offset, float low, float high,
                   float *to)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        const float value = offset + scale * sums[i][c], above = weft_max(value, low);
        to[i] = above < high ? above : high;
    }
}

/* Unit normals.  What averaging between texels cuts off their length is not made roughness once more: the
 * levels' roughness answers for it already (measured: pictures of every texel come 0.7 dB nearer without). */
WEFT_CLONES
static void finish_normals(weft_preview_samples *s)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < s->n; i++) {
        const float x = s->normal[0][i], y = s->normal[1][i], z = s->normal[2][i];
        const float length2 = x * x + y * y + z * z, known = length2 > 1e-6F ? 1 : 0;
        const float inverse = known / sqrtf(known > 0 ? length2 : 1);
        s->normal[0][i] = x * inverse;
        s->normal[1][i] = y * inverse;
        s->normal[2][i] = known > 0 ? z * inverse : 1;
    }
}

static void fill(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_surface *const surface = setup->surface;
    for (int k = 0; k < weft_brdf_n_planes(surface->brdf); k++) {
        const double value = surface->params[k], low = setup->low[k], high = setup->high[k];
        for (int i = 0; i < s->n && !surface->maps[k].image; i++)
            s->param[k][i] = (float)(value > low ? (value < high ? value : high) : low);
    }
    for (int c = 0; c < 3 && !surface->normal; c++)
        for (int i = 0; i < s->n; i++)
            s->normal[c][i] = c == 2;
}

void weft_preview_fetch_filtered(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_texture *const t = setup->texture;
    float sums[WEFT_PREVIEW_MAX_CHANNELS / 8][WEFT_PREVIEW_RUN][8];
    footprint f;
    lookup l;
    int most = 1;
    find_footprints(setup, s, &f);
    for (int i = 0; i < s->n; i++)
        most = (int)f.taps[i] > most ? (int)f.taps[i] : most;
    memset(sums, 0, sizeof sums);
    for (int tap = 0; tap < most; tap++) {
        place_taps(setup, s, &f, tap, &l);
        for (int block = 0; block < t->stride / 8; block++)
            gather(t, &l, s->n, 8 * block, sums[block]);
    }
    fill(setup, s);
    for (int c = 0; c < t->channels; c++) {
        const int plane = t->plane[c];
        unpack((const float(*)[8])sums[c / 8], c % 8, s->n, t->scale[c], t->offset[c],
               plane < 0 ? -1 : (float)setup->low[plane], plane < 0 ? 1 : (float)setup->high[plane],
               plane < 0 ? s->normal[-1 - plane] : s->param[plane]);
    }
    if (setup->surface->normal)
        finish_normals(s);
}
