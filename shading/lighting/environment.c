#include "shading/lighting/environment.h"

#include "shading/brdf/albedo.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/quadrature.h"
#include "shading/brdf/schlick_smith.h"

typedef struct lobe {
    weft_environment_lobe kind;
    double alpha;
} lobe;

static double masking(const lobe *in, double x)
{
    if (in->kind == WEFT_ENVIRONMENT_SMITH)
        return weft_ggx_v1(x, in->alpha);
    return 0.5 * weft_schlick_v1(x, weft_schlick_k_ggx(in->alpha)); /* 1/4 in two halves */
}

static void integrand(void *context, const weft_brdf_batch *b, double *const value[3])
{
    const lobe *const in = context;
    for (int i = 0; i < b->n; i++) {
        const weft_half h = weft_half_of(b->light[0][i], b->light[1][i], b->light[2][i], b->view[0][i],
                                         b->view[1][i], b->view[2][i]);
        const double f =
            h.valid > 0 ? weft_ggx_d(h.nh, h.s2, in->alpha) * masking(in, h.nl) * masking(in, b->view[2][i])
                        : 0;
        const double w = weft_schlick_weight(h.lh);
        value[0][i] = f * (1 - w);
        value[1][i] = f * w;
        value[2][i] = 0;
    }
}

weft_environment_share weft_environment_brdf(weft_environment_lobe kind, double alpha, double nv,
                                             double cone_cosine)
{
    lobe in = {kind, alpha};
    double sum[3] = {0};
    if (cone_cosine < 1)
        weft_albedo_integrate_cone(integrand, &in, weft_max(nv, WEFT_ENVIRONMENT_MIN_NV),
                                   weft_max(cone_cosine, 0), WEFT_ALBEDO_EXACT, sum);
    return (weft_environment_share){sum[0], sum[1]};
}

/* With u of weft_sample_ggx_cosine() the density of h is uniform; nl > 0 is u < 1/(1 + alpha^2). */
void weft_environment_prefilter(double roughness, int n, double moments[])
{
    const double a2 = roughness * roughness * roughness * roughness, end = 1 / (1 + a2);
    weft_quadrature q;
    double total = 0;
    for (int l = 0; l < n; l++)
        moments[l] = roughness > 0 ? 0 : 1;
    if (roughness <= 0)
        return;
    weft_quadrature_init(&q, 16);
    for (int i = 0; i < q.n; i++) {
        const double u = end * q.at[i], rest = end * (a2 + q.to_end[i]); /* 1 - u */
        const double nl = 1 - 2 * a2 * u / (rest + a2 * u);
        double before = 1, legendre = nl;
        total += q.weight[i] * nl;
        for (int l = 1; l <= n; l++) {
            moments[l - 1] += q.weight[i] * nl * legendre;
            const double next = ((2 * l + 1) * nl * legendre - l * before) / (l + 1);
            before = legendre;
            legendre = next;
        }
    }
    for (int l = 0; l < n; l++)
        moments[l] /= total;
}
