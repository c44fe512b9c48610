/* Where rays meet a fabric: the inner loop of the renderer. */
#include "core/clones.h"
#include "host/rig/fabric.h"

#include <stddef.h>

#define MASK   (WEFT_CLOTH_TEXELS - 1)
#define PER_MM ((float)(WEFT_CLOTH_TEXELS / WEFT_CLOTH_PERIOD_MM))
/* Makes coordinates positive before they are cut to whole texels: 64 periods are more than any field. */
#define OFFSET (64 * WEFT_CLOTH_TEXELS)

weft_fabric_patch weft_fabric_patch_at(const weft_fabric *cloth, float x, float y)
{
    const float c = cloth->turn_cos, s = cloth->turn_sin;
    weft_fabric_patch p = {.x0 = x,
                           .y0 = y,
                           .at = {c * x + s * y, c * y - s * x},
                           .jacobian = {c, s, -s, c},
                           .gain = 1,
                           .strength = 1};
    for (int term = 0; term < 3; term++) {
        const float *const k = cloth->wave_k[term];
        const float phase = k[0] * x + k[1] * y;
        for (size_t i = 0; i < 2; i++) {
            const float amplitude = cloth->wave[term][i][0], at = phase + cloth->wave[term][i][1];
            const float slope = amplitude * cosf(at);
            p.at[i] += amplitude * sinf(at);
            p.jacobian[2 * i] += slope * k[0];
            p.jacobian[2 * i + 1] += slope * k[1];
        }
        const float at = 1.7F * phase + 2 * cloth->wave[term][0][1];
        const float sine = sinf(at), slope = 1.7F * 0.02F * cosf(at);
        p.gain += 0.02F * sine;
        p.gain_dx += slope * k[0];
        p.gain_dy += slope * k[1];
        p.strength += 0.008F * sine;
    }
    return p;
}

/* Splits a tile coordinate into texel and fraction. */
static inline int split(float mm, float *fraction)
{
    const float t = mm * PER_MM + (float)OFFSET;
    const int i = (int)t;
    *fraction = t - (float)i;
    return i & MASK;
}

static inline float height_at(const weft_fabric *cloth, float x_mm, float y_mm)
{
    float fx, fy;
    const int i = split(x_mm, &fx), j = split(y_mm, &fy);
    const int i1 = (i + 1) & MASK, j1 = (j + 1) & MASK;
    const float *const top = cloth->height + (size_t)j * WEFT_CLOTH_TEXELS;
    const float *const bottom = cloth->height + (size_t)j1 * WEFT_CLOTH_TEXELS;
    const float a = top[i] + fx * (top[i1] - top[i]);
    const float b = bottom[i] + fx * (bottom[i1] - bottom[i]);
    return a + fy * (b - a);
}

static void fill_point(const weft_fabric *cloth, const weft_fabric_patch *patch, weft_fabric_point *point)
{
    float fx, fy;
    const int i = split(point->tile_x, &fx), j = split(point->tile_y, &fy);
    const int i1 = (i + 1) & MASK, j1 = (j + 1) & MASK;
    const weft_fabric_texel *const top = cloth->texels + (size_t)j * WEFT_CLOTH_TEXELS;
    const weft_fabric_texel *const bottom = cloth->texels + (size_t)j1 * WEFT_CLOTH_TEXELS;
    const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
    const float h =
        w00 * top[i].height + w01 * top[i1].height + w10 * bottom[i].height + w11 * bottom[i1].height;
    const float sx =
        w00 * top[i].slope_x + w01 * top[i1].slope_x + w10 * bottom[i].slope_x + w11 * bottom[i1].slope_x;
    const float sy =
        w00 * top[i].slope_y + w01 * top[i1].slope_y + w10 * bottom[i].slope_y + w11 * bottom[i1].slope_y;
    const float *const J = patch->jacobian;
    point->height = patch->gain * h;
    point->slope_x = patch->gain * (J[0] * sx + J[2] * sy) + h * patch->gain_dx;
    point->slope_y = patch->gain * (J[1] * sx + J[3] * sy) + h * patch->gain_dy;
    const weft_fabric_texel *const near = (fy < 0.5F ? top : bottom) + (fx < 0.5F ? i : i1);
    point->dye = near->dye;
    point->strength = patch->strength * (0.75F + (float)near->strength * (1 / 510.0F));
    point->openness = (float)near->openness * (1 / 255.0F);
    /* The jacobian is a turn and a little shear: its transpose takes directions back. */
    const float *const f = cloth->fibre[near->fibre];
    const float dx = J[0] * f[0] + J[2] * f[1], dy = J[1] * f[0] + J[3] * f[1];
    const float scale = 1 / sqrtf(dx * dx + dy * dy);
    point->fibre_x = dx * scale;
    point->fibre_y = dy * scale;
}

void weft_fabric_meet(const weft_fabric *cloth, const weft_fabric_patch *patch, float x, float y, float dx,
                      float dy, weft_fabric_point *point)
{
    const float *const J = patch->jacobian;
    const float x_rel = x - patch->x0, y_rel = y - patch->y0;
    const float tx = patch->at[0] + J[0] * x_rel + J[1] * y_rel,
                ty = patch->at[1] + J[2] * x_rel + J[3] * y_rel;
    const float tdx = J[0] * dx + J[1] * dy, tdy = J[2] * dx + J[3] * dy;
    /* Fixed point of z = height over where the ray is at z; contracts by |d| times the slope, 0.1 a step. */
    float z = 0;
    for (int i = 0; i < 16; i++) {
        const float next = patch->gain * height_at(cloth, tx + z * tdx, ty + z * tdy);
        const float change = next - z;
        z = next;
        if (fabsf(change) < 2e-4F)
            break;
    }
    point->tile_x = tx + z * tdx;
    point->tile_y = ty + z * tdy;
    fill_point(cloth, patch, point);
}

#define LANES WEFT_CLOTH_LANES

/* Rays to all lamps from one point: x0, y0 in texels, the rest in mm. */
typedef struct march {
    float rise[LANES];          /* of the ray, in the tile's heights per mm */
    float dx[LANES], dy[LANES]; /* texels per mm */
    float end[LANES];           /* mm at which the ray is above everything */
    float stride[LANES];
    float s[LANES]; /* mm walked */
} march;

/* One step of all rays.  @return how many are still on their way */
static inline __attribute__((always_inline)) int march_step(const float *restrict height, float x0, float y0,
                                                            float h0, march *restrict m,
                                                            float *restrict visible)
{
    int walking = 0;
    for (int i = 0; i < LANES; i++) {
        const float at = m->s[i], end = m->end[i], was = visible[i];
        const float x = x0 + at * m->dx[i], y = y0 + at * m->dy[i];
        const int xi = (int)x, yi = (int)y;
        const float fx = x - (float)xi, fy = y - (float)yi;
        const int c0 = xi & MASK, c1 = (xi + 1) & MASK;
        const int r0 = (yi & MASK) * WEFT_CLOTH_TEXELS, r1 = ((yi + 1) & MASK) * WEFT_CLOTH_TEXELS;
        const float h00 = height[r0 + c0], h01 = height[r0 + c1];
        const float h10 = height[r1 + c0], h11 = height[r1 + c1];
        const float a = h00 + fx * (h01 - h00), b = h10 + fx * (h11 - h10);
        const float gap = h0 + at * m->rise[i] - (a + fy * (b - a));
        const float wanted = gap * m->stride[i];
        const float step = wanted > 0.025F ? wanted : 0.025F;
        /* Selected, not branched, and all loads before: so the compiler can put the lanes side by side. */
        const float next = gap < 0 ? end : at + step, seen = gap < 0 ? 0 : was;
        const float now = at < end ? next : at;
        visible[i] = at < end ? seen : was;
        m->s[i] = now;
        walking += now < end;
    }
    return walking;
}

WEFT_CLONES void weft_fabric_see(const weft_fabric *cloth, const weft_fabric_patch *patch,
                                 const weft_fabric_point *point, const float lx[LANES], const float ly[LANES],
                                 const float lz[LANES], float visible[LANES])
{
    const float *const J = patch->jacobian;
    const float steepest = 1.1F * cloth->steepest, h0 = point->height / patch->gain;
    const float headroom = cloth->highest_mm - h0, gain = 1 / patch->gain;
    const float x0 = point->tile_x * PER_MM + (float)OFFSET, y0 = point->tile_y * PER_MM + (float)OFFSET;
    march m;
    int walking = 0;
    for (int i = 0; i < LANES; i++) {
        const float level = 1 / sqrtf(lx[i] * lx[i] + ly[i] * ly[i] + 1e-12F);
        m.rise[i] = lz[i] * level * gain;
        m.dx[i] = (J[0] * lx[i] + J[1] * ly[i]) * level * PER_MM;
        m.dy[i] = (J[2] * lx[i] + J[3] * ly[i]) * level * PER_MM;
        const float end = m.rise[i] < steepest ? headroom / m.rise[i] : 0;
        m.end[i] = visible[i] > 0 ? end : 0;
        m.stride[i] = 1 / (steepest - m.rise[i]);
        /* Two texels away from the point: nearer, the interpolated surface would shade itself. */
        m.s[i] = 0.04F;
        walking += m.s[i] < m.end[i];
    }
    while (walking > 0)
        walking = march_step(cloth->height, x0, y0, h0, &m, visible);
}
