/** A search for one kind of flaw: private to the flaw_*.c files and flaws.c. */
#ifndef WEFT_HOST_SOLVE_FLAW_SEARCH_H
#define WEFT_HOST_SOLVE_FLAW_SEARCH_H

#include "host/solve/components.h"
#include "host/solve/flaws.h"

/** Narrower is a thread that lies on the cloth, not a tear in it. */
#define WEFT_FLAW_THREAD_MM 0.35

/** What was marked, what is kept of it. */
typedef struct weft_flaw_search {
    const weft_maps *maps;
    const weft_mask *cloth; /* 1 where there is nothing but cloth */
    weft_mask marks;
    double least_mm;                  /* length of a place */
    double least_width_mm, widest_mm; /* area over length */
    double least_mm2;
    weft_flaws_found found;
} weft_flaw_search;

static inline bool weft_flaw_answered(const weft_maps *maps, size_t i)
{
    return !maps->mask.data || maps->mask.data[i];
}

/** Clears marks, limits and what was found. */
void weft_flaw_begin(weft_flaw_search *search);

/** Whether a region is as long and as slender as the limits say; counts it. */
weft_component_keep_fn weft_flaw_keep;

/** Marks what reaches `strong` or at least `weak`. */
void weft_flaw_mark(const weft_image *image, float strong, float weak, weft_mask *marks);

/** The value that `share` of the pixels stay below for which `of` is not 0; of one pixel in 7, which is
 * plenty. 0 when there are none.  @return WEFT_ERR_NOMEM */
weft_err weft_flaw_quantile(const weft_image *image, const weft_mask *of, double share, float *value,
                            weft_error *err);

/** Each leaves 255 on what it found in search->marks. */
weft_err weft_flaw_find_creases(weft_flaw_search *search, weft_error *err);
/** @param sign  1: bright lint, -1: dark lint */
weft_err weft_flaw_find_lint(weft_flaw_search *search, float sign, weft_error *err);
/** Needs maps->alpha.  @param pattern  whether the cloth has a pattern of holes */
weft_err weft_flaw_find_tears(weft_flaw_search *search, bool *pattern, weft_error *err);

#endif
