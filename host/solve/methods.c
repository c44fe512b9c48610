#include "host/solve/samples.h"

const weft_solve_method *const weft_solve_methods[] = {
    &weft_method_robust,
    &weft_method_lsq,
    &weft_method_svd,
    NULL,
};
