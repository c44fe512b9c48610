#include "shading/brdf/brdf.h"

extern const weft_brdf weft_brdf_lambert;
extern const weft_brdf weft_brdf_balanced;
extern const weft_brdf weft_brdf_coupled;
extern const weft_brdf weft_brdf_multiscatter;
extern const weft_brdf weft_brdf_ggx_specular;
extern const weft_brdf weft_brdf_ggx_aniso;
extern const weft_brdf weft_brdf_ggx;
extern const weft_brdf weft_brdf_beckmann;
extern const weft_brdf weft_brdf_blinn_phong;
extern const weft_brdf weft_brdf_cook_torrance;
extern const weft_brdf weft_brdf_unreal;
extern const weft_brdf weft_brdf_disney;
extern const weft_brdf weft_brdf_cloth;
extern const weft_brdf weft_brdf_cloth_two_tone;
extern const weft_brdf weft_brdf_ggx_cloth;
extern const weft_brdf weft_brdf_charlie;

const weft_brdf *const weft_brdfs[] = {
    &weft_brdf_lambert,
    &weft_brdf_balanced,
    &weft_brdf_coupled,
    &weft_brdf_multiscatter,
    &weft_brdf_ggx_specular,
    &weft_brdf_ggx_aniso,
    &weft_brdf_ggx,
    &weft_brdf_beckmann,
    &weft_brdf_blinn_phong,
    &weft_brdf_cook_torrance,
    &weft_brdf_unreal,
    &weft_brdf_disney,
    &weft_brdf_cloth,
    &weft_brdf_cloth_two_tone,
    &weft_brdf_ggx_cloth,
    &weft_brdf_charlie,
    NULL,
};
