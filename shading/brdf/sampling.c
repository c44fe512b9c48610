#include "shading/brdf/sampling.h"

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
