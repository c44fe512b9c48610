#include "shading/brdf/brdf.h"

extern const weft_brdf weft_brdf_lambert;
extern const weft_brdf weft_brdf_balanced;
extern const weft_brdf weft_brdf_coupled;
extern const weft_brdf weft_brdf_ggx_specular;
extern const weft_brdf weft_brdf_ggx_aniso;
extern const weft_brdf weft_brdf_ggx;
extern const weft_brdf weft_brdf_cloth;

const weft_brdf *const weft_brdfs[] = {
    &weft_brdf_lambert,   &weft_brdf_balanced, &weft_brdf_coupled, &weft_brdf_ggx_specular,
    &weft_brdf_ggx_aniso, &weft_brdf_ggx,      &weft_brdf_cloth,   NULL,
};
