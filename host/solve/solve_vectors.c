#include "host/solve/solve_vectors.h"

#include "host/solve/samples.h"

/* Columns: ten directions, ten intensities of the lights, ten values seen. */
enum { N = 10, LIGHT = 0, INTENSITY = 3 * N, VALUE = 4 * N };

/* Each row as one lane of the kernel that solves every pixel. */
static void photometric(int n, const double *const *in, double *const *out)
{
    for (int row = 0; row < n; row++) {
        const int lane = row % WEFT_SOLVE_LANES;
        weft_solve_samples samples = {.n_lights = N, .n_channels = 3};
        weft_solve_answers answers;
        for (int j = 0; j < N; j++) {
            weft_solve_light *const at = &samples.at[j];
            const float value = (float)(in[VALUE + j][row] / in[INTENSITY + j][row]);
            for (int c = 0; c < 3; c++) {
                at->light[c][lane] = (float)in[LIGHT + 3 * j + c][row];
                at->value[c][lane] = value;
            }
            at->grey[lane] = value;
            at->weight[lane] = 1;
        }
        weft_method_lsq.solve(&samples, &answers);
        for (int c = 0; c < 3; c++)
            out[c][row] = (double)answers.normal[c][lane];
        out[3][row] = (double)answers.albedo[0][lane];
    }
}

const weft_vectors_model weft_solve_vectors[] = {
    {.stem = "photometric",
     .ids = "S-ORD-17",
     .inputs =
         "l0x l0y l0z l1x l1y l1z l2x l2y l2z l3x l3y l3z l4x l4y l4z l5x l5y l5z l6x l6y l6z l7x l7y l7z "
         "l8x l8y l8z l9x l9y l9z i0 i1 i2 i3 i4 i5 i6 i7 i8 i9 I0 I1 I2 I3 I4 I5 I6 I7 I8 I9",
     .outputs = "nx ny nz kd",
     .rtol = 1e-5, /* single precision */
     .eval = photometric},
    {0},
};
