/**
 * A material as an engine blends it while it runs (S-ORD-27): a base, up to four materials over it, and where
 * each of them lies.
 *
 *     P <- lerp(P, P_k, a_k)    for k = 0..n-1, per pixel, in the spaces of composite.h
 *
 * Roughness that was filtered with the composited normals is not what an engine has: a documented loss.
 */
#ifndef WEFT_SHADING_MATERIAL_RUNTIME_LAYERS_H
#define WEFT_SHADING_MATERIAL_RUNTIME_LAYERS_H

#include "shading/bake/baked.h"

enum { WEFT_RUNTIME_LAYERS_MAX = 4 };

typedef struct weft_runtime_layer {
    char name[128];   /* of the library's material; with a number behind when the layer changes it */
    weft_baked baked; /* level 0 */
    unsigned channels;
    bool reorient;
    weft_image alpha; /* 1 plane: opacity times mask, 0..1; planes 0: `constant` everywhere */
    float constant;
} weft_runtime_layer;

typedef struct weft_runtime_layers {
    weft_baked base; /* level 0: what lies below */
    int n;
    weft_runtime_layer layers[WEFT_RUNTIME_LAYERS_MAX];
} weft_runtime_layers;

/** `{0}` is fine. */
void weft_runtime_layers_fini(weft_runtime_layers *layers);

#endif
