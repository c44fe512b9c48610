#include "shading/preview/preview_samples.h"

#include "core/clones.h"
#include "shading/brdf/half_vector.h"

static int plane_of(const weft_brdf *brdf, const char *name, int components)
{
    int plane = -1;
    const weft_brdf_param *const param = weft_brdf_find_param(brdf, name, &plane);
    return param && param->components == components ? plane : -1;
}

weft_preview_matte weft_preview_matte_of(const weft_brdf *brdf)
{
    weft_preview_matte m = {.albedo = plane_of(brdf, "albedo", 3),
                            .metallic = plane_of(brdf, "metallic", 1),
                            .cavity = plane_of(brdf, "cavity", 1),
                            .cloth = plane_of(brdf, "cloth", 1),
                            .cloth_albedo = plane_of(brdf, "cloth_albedo", 3)};
    if (m.albedo < 0)
        m.albedo = plane_of(brdf, "base", 3);
    return m;
}

WEFT_CLONES
static void add(const float *albedo, const float *metallic, const float *cavity, const float *cloth,
                const float *cloth_albedo, float ambient, int n, float *radiance)
{
    WEFT_INDEPENDENT
    for (int i = 0; i < n; i++) {
        const float smooth = albedo[i] * (1 - metallic[i]);
        radiance[i] += ambient * cavity[i] * (smooth + cloth[i] * (cloth_albedo[i] - smooth));
    }
}

void weft_preview_add_ambient(const weft_preview_setup *setup, weft_preview_samples *s)
{
    const weft_preview_matte *const m = &setup->matte;
    float zeros[WEFT_PREVIEW_RUN] = {0}, ones[WEFT_PREVIEW_RUN];
    if (m->albedo < 0 || !(setup->view->ambient > 0))
        return;
    for (int i = 0; i < s->n; i++)
        ones[i] = 1;
    for (int c = 0; c < 3; c++)
        add(s->param[m->albedo + c], m->metallic < 0 ? zeros : s->param[m->metallic],
            m->cavity < 0 ? ones : s->param[m->cavity], m->cloth < 0 ? zeros : s->param[m->cloth],
            m->cloth_albedo < 0 ? zeros : s->param[m->cloth_albedo + c], (float)setup->view->ambient, s->n,
            s->radiance[c]);
}
