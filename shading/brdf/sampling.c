#include "shading/brdf/sampling.h"

void weft_sample_ggx_normal(const double n[3], double alpha, double u1, double u2, double h[3])
{
    const double cosine = weft_sample_ggx_cosine(alpha, u2), phi = 2 * WEFT_PI * u1;
    const double sine = alpha * sqrt(u2 / (1 + (alpha * alpha - 1) * u2)); /* without cancellation */
    const double x = sine * cos(phi), y = sine * sin(phi);
    const int flat = fabs(n[2]) < 0.999; /* up is z, else x */
    const double inverse = 1 / (flat ? hypot(n[0], n[1]) : hypot(n[1], n[2]));
    const double t[3] = {flat ? -n[1] * inverse : 0, flat ? n[0] * inverse : -n[2] * inverse,
                         flat ? 0 : n[1] * inverse};
    const double b[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
    for (int c = 0; c < 3; c++)
        h[c] = t[c] * x + b[c] * y + n[c] * cosine;
}

void weft_sample_mixed(const weft_brdf_batch *batch, int i, double share, double at, double ab,
                       const double *const u[3], double *const light[3])
{
    double l[3];
    if (u[0][i] < share) {
        const double v[3] = {batch->view[0][i], batch->view[1][i], batch->view[2][i]};
        double h[3];
        weft_sample_ggx_visible(v, at, ab, u[1][i], u[2][i], h);
        weft_reflect(v, h, l);
    } else {
        weft_sample_cosine(u[1][i], u[2][i], l);
    }
    for (int c = 0; c < 3; c++)
        light[c][i] = l[c];
}

double weft_pdf_mixed(const weft_brdf_batch *batch, int i, double share, double at, double ab)
{
    const double v[3] = {batch->view[0][i], batch->view[1][i], batch->view[2][i]};
    const weft_half h =
        weft_half_of(batch->light[0][i], batch->light[1][i], batch->light[2][i], v[0], v[1], v[2]);
    const double lobe = h.up > 0 ? weft_pdf_ggx_visible(weft_ggx_d_aniso(h.h[0], h.h[1], h.nh, at, ab),
                                                        weft_ggx_v1_aniso(v[0], v[1], v[2], at, ab), v[2])
                                 : 0;
    const double cosine = v[2] > 0 ? weft_pdf_cosine(batch->light[2][i]) : 0;
    return share * lobe + (1 - share) * cosine;
}

double weft_sample_share(double specular, double diffuse)
{
    const double share = specular + diffuse > 0 ? specular / (specular + diffuse) : 0.5;
    return share < 0.1 ? 0.1 : share > 0.9 ? 0.9 : share;
}

void weft_brdf_sample_cosine(const weft_brdf_batch *batch, const double *const u[3], double *const light[3])
{
    for (int i = 0; i < batch->n; i++) {
        double l[3];
        weft_sample_cosine(u[1][i], u[2][i], l);
        for (int c = 0; c < 3; c++)
            light[c][i] = l[c];
    }
}

void weft_brdf_pdf_cosine(const weft_brdf_batch *batch, double *density)
{
    for (int i = 0; i < batch->n; i++)
        density[i] = batch->view[2][i] > 0 ? weft_pdf_cosine(batch->light[2][i]) : 0;
}
