#include "host/solve/samples.h"

const weft_solve_method weft_solve_methods[] = {
    {.name = "lsq", .summary = "least squares over every usable sample", .solve = weft_solve_lsq},
    {0},
};
