/** weft preview --columns: one picture of many, a row a model, a column a lamp or a value of a parameter. */
#ifndef WEFT_HOST_CLI_PREVIEW_GRID_H
#define WEFT_HOST_CLI_PREVIEW_GRID_H

#include "host/cli/preview_input.h"
#include "shading/preview/tone.h"

typedef struct weft_preview_grid {
    const char *input;        /* as weft_preview_input_load() takes it */
    const char *models;       /* "ggx,cloth": a row each */
    const weft_texts *params; /* that all rows get */
    const weft_texts *lamps;  /* labels of view->lights */
    const char *columns;      /* "lamps", or "NAME=V,V,..." (a parameter of every model) */
    weft_tone tone;
} weft_preview_grid;

/** Renders every cell with `view` (its size is a cell's) and puts them on a labelled sheet. */
weft_err weft_preview_grid_render(const weft_preview_grid *grid, const weft_preview_view *view,
                                  weft_image *sheet, weft_error *err);

#endif
