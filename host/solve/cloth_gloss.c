#include "host/solve/cloth_gloss.h"

#include "core/mem.h"
#include "core/mem_limit.h"

/* Blocks of 16 pixels: 3072 pixels determine four numbers to a per cent. */
enum { COLUMNS = 16, ROWS = 12, MOST = COLUMNS * ROWS };

static bool all_inside(const weft_mask *inside, int width, int row, int block)
{
    const int first = block * WEFT_SOLVE_LANES;
    if (first + WEFT_SOLVE_LANES > width)
        return false;
    for (int i = 0; inside->data && i < WEFT_SOLVE_LANES; i++)
        if (!inside->data[(size_t)row * (size_t)inside->width + (size_t)(first + i)])
            return false;
    return true;
}

/* Spread evenly; the rows alternate their parity, so that every colour of a mosaic is met. */
static int gather(const weft_solve_plan *plan, const weft_light_plates *plates, const weft_mask *inside,
                  weft_solve_samples *store, weft_solve_samples **blocks)
{
    const int n_blocks = plates->width / WEFT_SOLVE_LANES;
    int n = 0;
    for (int j = 0; j < ROWS; j++)
        for (int i = 0; i < COLUMNS; i++) {
            const int row = weft_spread_over(plates->height, j, ROWS) + i % 2;
            const int block = weft_spread_over(n_blocks, i, COLUMNS);
            weft_solve_row_in in[WEFT_LIGHTS_MAX];
            if (row >= plates->height || !all_inside(inside, plates->width, row, block))
                continue;
            weft_light_plates_row(plates, row, in);
            weft_mem_trim(); /* a block here and there brings its surroundings with it */
            weft_solve_gather(plan, row, block, in, &store[n]);
            blocks[n] = &store[n];
            n++;
        }
    return n;
}

weft_err weft_cloth_gloss(const weft_solve_plan *plan, const weft_light_plates *plates,
                          const weft_mask *inside, weft_gloss *gloss, weft_gloss_report *report,
                          weft_error *err)
{
    weft_solve_samples *const store = weft_alloc(MOST, sizeof *store, err);
    weft_solve_samples *blocks[MOST];
    if (!store)
        return WEFT_ERR_NOMEM;
    const int n = gather(plan, plates, inside, store, blocks);
    *report = n > 0 ? weft_gloss_fit(blocks, n, gloss) : (weft_gloss_report){0};
    weft_free(store);
    return WEFT_OK;
}
