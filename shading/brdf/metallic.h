/** Base colour and metallic to diffuse reflectance and F0, and the specular control of dielectrics. */
#ifndef WEFT_SHADING_BRDF_METALLIC_H
#define WEFT_SHADING_BRDF_METALLIC_H

#include "shading/brdf/real.h"

/** Reflectance of dielectrics at normal incidence: Unreal's constant (S-UE4-12) and a preset that another
 *  source names (S-BLG-01). */
#define WEFT_F0_UNREAL WEFT_R(0.04)
#define WEFT_F0_PRESET WEFT_R(0.03)

/** Diffuse reflectance: base (1 - metallic).  Source: S-UE4-12, S-BLG-01. */
WEFT_INLINE weft_real weft_metallic_diffuse(weft_real base, weft_real metallic)
{
    return base * (1 - metallic);
}

/** F0 = lerp(dielectric, base, metallic).  Source: S-UE4-12, S-BLG-01. */
WEFT_INLINE weft_real weft_metallic_f0(weft_real base, weft_real metallic, weft_real dielectric)
{
    return weft_mix(dielectric, base, metallic);
}

/** F0 of a dielectric from a control 0..1: lerp(0.017, 0.067, s).  The text also gives 0.063 as the upper
 *  end; its first statement is taken.  Source: S-BLG-01. */
WEFT_INLINE weft_real weft_dielectric_f0(weft_real specular)
{
    return WEFT_R(0.017) + (WEFT_R(0.067) - WEFT_R(0.017)) * specular;
}

#endif
