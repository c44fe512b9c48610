#include "host/cli/preview_grid.h"

#include "core/mem.h"
#include "shading/preview/font.h"
#include "shading/preview/sheet.h"

#include <stdio.h>
#include <string.h>

enum { MAX_CELLS = 32 };

/* A text cut at commas. */
typedef struct words {
    int n;
    char text[MAX_CELLS][48];
} words;

static weft_err split(const char *text, const char *what, words *w, weft_error *err)
{
    w->n = 0;
    for (const char *p = text; *p; p += strcspn(p, ","), p += *p == ',') {
        const size_t n = strcspn(p, ",");
        if (w->n == MAX_CELLS || n >= sizeof w->text[0] || n == 0)
            return weft_fail(err, WEFT_ERR_USAGE, "%s: wanted up to %d short words between commas", what,
                             MAX_CELLS);
        memcpy(w->text[w->n], p, n);
        w->text[w->n++][n] = '\0';
    }
    return w->n ? WEFT_OK : weft_fail(err, WEFT_ERR_USAGE, "%s: there is nothing in it", what);
}

/* One cell: the row's model, the column's lamp or value. */
static weft_err place_cell(const weft_preview_grid *g, const weft_preview_view *view, const char *model,
                           const char *name, const char *value, int column, int row, weft_sheet *sheet,
                           weft_error *err)
{
    weft_preview_input input;
    weft_preview_view cell = *view;
    weft_texts params = *g->params;
    weft_image picture = {0};
    char setting[112], label[192];
    if (name) {
        snprintf(setting, sizeof setting, "%s=%s", name, value);
        if (params.n == WEFT_TEXTS_MAX)
            return weft_fail(err, WEFT_ERR_USAGE, "too many parameters");
        params.values[params.n++] = setting;
    } else {
        cell.n_lights = 1;
        cell.lights[0] = view->lights[column];
    }
    snprintf(label, sizeof label, "%s %s", model, name ? setting : value);
    if (weft_font_width(sheet->label_scale, label) > sheet->tile_width) /* the column at least */
        snprintf(label, sizeof label, "%s", name ? setting : value);
    WEFT_TRY(weft_preview_input_load(&input, g->input, model, &params, err));
    weft_err status = weft_preview_render(&input.surface, &cell, &picture, err);
    if (status == WEFT_OK) {
        weft_tone_image(g->tone, &picture);
        status = weft_sheet_place(sheet, column, row, &picture, label, err);
    }
    weft_image_fini(&picture);
    weft_preview_input_fini(&input);
    return status;
}

weft_err weft_preview_grid_render(const weft_preview_grid *g, const weft_preview_view *view,
                                  weft_image *sheet_image, weft_error *err)
{
    words models, values = {0};
    char name[48] = "";
    const char *const equals = strchr(g->columns, '=');
    WEFT_TRY(split(g->models, "--brdf", &models, err));
    if (equals) {
        snprintf(name, sizeof name, "%.*s", (int)(equals - g->columns), g->columns);
        WEFT_TRY(split(equals + 1, "--columns", &values, err));
    } else if (strcmp(g->columns, "lamps") != 0 || g->lamps->n == 0) {
        return weft_fail(err, WEFT_ERR_USAGE,
                         "--columns wants NAME=V,V,... of a parameter, or \"lamps\" with some --lamp");
    }
    weft_sheet sheet = {0};
    const int columns = equals ? values.n : g->lamps->n;
    WEFT_TRY(weft_sheet_init(&sheet, columns, models.n, view->width, view->height, "", err));
    weft_err status = WEFT_OK;
    for (int row = 0; row < models.n; row++)
        for (int column = 0; column < columns && status == WEFT_OK; column++)
            status =
                place_cell(g, view, models.text[row], equals ? name : NULL,
                           equals ? values.text[column] : g->lamps->values[column], column, row, &sheet, err);
    if (status != WEFT_OK)
        weft_sheet_fini(&sheet);
    else
        *sheet_image = sheet.image;
    return status;
}
