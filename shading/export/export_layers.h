/**
 * Run-time layers beside an export: the flattened material is the exporter's as always, and `layers/` holds
 * what an engine blends itself:
 *
 *     layers/layers.json        base, order, masks, channels, constants, and the rule
 *     layers/masks.png          8 bit, the weight of layer 0 in red, 1 in green, 2 in blue, 3 in alpha
 *     layers/base/              the material below them, by the same exporter
 *     layers/shared/NAME/       each material of the layers, once
 */
#ifndef WEFT_SHADING_EXPORT_EXPORT_LAYERS_H
#define WEFT_SHADING_EXPORT_EXPORT_LAYERS_H

#include "shading/export/exporter.h"
#include "shading/material/runtime_layers.h"

/**
 * Writes layers/ into job->folder and says in job->lost that the exporter's own file is flattened.
 * @param layers  every level of the maps is there
 */
weft_err weft_export_runtime_layers(const weft_exporter *exporter, const weft_export_job *job,
                                    const weft_runtime_layers *layers, weft_error *err);

#endif
