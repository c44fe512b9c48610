#include "shading/vectors/vectors.h"
const weft_vectors_model weft_vectors_lighting[] = {{0}};
