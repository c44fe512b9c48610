#include "host/rig/damage.h"

#include "host/rig/scene.h"

#include <math.h>
#include <stddef.h>

enum { STREAM_DAMAGE = 24 };

static const double two_pi = 6.283185307179586;

static float between(uint64_t seed, int *next, double low, double high)
{
    return (float)(low + (high - low) * weft_rig_random(seed, STREAM_DAMAGE, (uint64_t)(*next)++));
}

void weft_rig_damage_init(weft_rig_damage *damage, uint64_t seed)
{
    int next = 0;
    const float turn = between(seed, &next, 0.1, 1.4);
    damage->crease = (weft_rig_crease){.x = between(seed, &next, -15, 15),
                                       .y = between(seed, &next, -10, 10),
                                       .across_x = cosf(turn),
                                       .across_y = sinf(turn),
                                       .height_mm = 0.9F,
                                       .width_mm = 4,
                                       .radius_mm = 0.4F};
    for (int i = 0; i < WEFT_RIG_N_TEARS; i++) {
        const float towards = between(seed, &next, 0, two_pi);
        damage->tears[i] = (weft_rig_tear){.x = between(seed, &next, -60, 60),
                                           .y = between(seed, &next, -40, 40),
                                           .along_x = cosf(towards),
                                           .along_y = sinf(towards),
                                           .half_length = between(seed, &next, 2, 5),
                                           .half_width = between(seed, &next, 0.4, 0.9)};
    }
    for (int i = 0; i < WEFT_RIG_N_FIBRES; i++) {
        const float towards = between(seed, &next, 0, two_pi), length = between(seed, &next, 4, 14);
        weft_rig_fibre *const f = &damage->fibres[i];
        *f = (weft_rig_fibre){.x = between(seed, &next, -60, 60),
                              .y = between(seed, &next, -40, 40),
                              .bend_mm = between(seed, &next, 3, 12),
                              .middle_x = cosf(towards),
                              .middle_y = sinf(towards),
                              .radius = between(seed, &next, 0.05, 0.1)};
        f->cos_half = cosf(fminf(0.5F * length / f->bend_mm, 3));
    }
}

static float across_crease(const weft_rig_crease *c, float x, float y)
{
    return (x - c->x) * c->across_x + (y - c->y) * c->across_y;
}

void weft_rig_damage_bend(const weft_rig_damage *damage, float x, float y, float *height, float slope[2])
{
    const weft_rig_crease *const c = &damage->crease;
    const float d = across_crease(c, x, y), far = sqrtf(d * d + c->radius_mm * c->radius_mm);
    *height = c->height_mm * expf(-far / c->width_mm);
    const float steep = -*height / c->width_mm * d / far;
    slope[0] = steep * c->across_x;
    slope[1] = steep * c->across_y;
}

bool weft_rig_damage_on_crease(const weft_rig_damage *damage, float x, float y)
{
    return fabsf(across_crease(&damage->crease, x, y)) < 0.25F;
}

bool weft_rig_damage_torn(const weft_rig_damage *damage, float x, float y)
{
    for (int i = 0; i < WEFT_RIG_N_TEARS; i++) {
        const weft_rig_tear *const t = &damage->tears[i];
        const float dx = x - t->x, dy = y - t->y;
        const float along = (dx * t->along_x + dy * t->along_y) / t->half_length,
                    across = (dy * t->along_x - dx * t->along_y) / t->half_width;
        if (fabsf(across) < 1 - along * along)
            return true;
    }
    return false;
}

const weft_rig_fibre *weft_rig_damage_fibre(const weft_rig_damage *damage, float x, float y, float normal[3])
{
    for (int i = 0; i < WEFT_RIG_N_FIBRES; i++) {
        const weft_rig_fibre *const f = &damage->fibres[i];
        const float dx = x - f->x, dy = y - f->y, from_middle = sqrtf(dx * dx + dy * dy);
        const float across = (from_middle - f->bend_mm) / f->radius;
        if (!(fabsf(across) < 1) || dx * f->middle_x + dy * f->middle_y < f->cos_half * from_middle)
            continue;
        normal[0] = across * dx / from_middle;
        normal[1] = across * dy / from_middle;
        normal[2] = sqrtf(1 - across * across);
        return f;
    }
    return NULL;
}
