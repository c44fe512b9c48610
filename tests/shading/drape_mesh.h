/** The drape of the preview as triangles, and rays through every one of them: slow and obvious. */
#ifndef WEFT_TESTS_SHADING_DRAPE_MESH_H
#define WEFT_TESTS_SHADING_DRAPE_MESH_H

#include <stdbool.h>

/** Puts the corners on the drape, 121 x 121 over its half widths; to be called before the others. */
void drape_mesh_make(void);

/** |n.d| of the triangle that the ray from `o` along `d` (unit) meets first; -1 beside the mesh. */
double drape_mesh_facing(const double o[3], const double d[3]);

/** Whether the ray meets any triangle, from either side. */
bool drape_mesh_meets(const double o[3], const double d[3]);

#endif
