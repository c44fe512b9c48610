#include "shading/vectors/vectors_tables.h"

#include <stddef.h>

const weft_vectors_model *weft_vectors_find(const char *stem)
{
    static const weft_vectors_model *const subjects[] = {weft_vectors_reflectance,
                                                         weft_vectors_more_reflectance, weft_vectors_lighting,
                                                         weft_vectors_bake, weft_vectors_skin};
    for (size_t i = 0; i < sizeof subjects / sizeof subjects[0]; i++) {
        const weft_vectors_model *const found = weft_vectors_find_in(subjects[i], stem);
        if (found)
            return found;
    }
    return NULL;
}
