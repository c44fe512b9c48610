/**
 * A calibration as one page: pictures, figures, and a verdict in words.
 *
 * The page is one HTML file without scripts or links to anything: plots are inline SVG, maps PNG inside it.
 * Everything comes from calibration.json, its grid and its averaged white sheet; what is absent is said to
 * be.
 */
#ifndef WEFT_CALIBRATION_REPORT_REPORT_H
#define WEFT_CALIBRATION_REPORT_REPORT_H

#include "calibration/calibration.h"
#include "calibration/lights/white_sheet.h"
#include "core/text_buffer.h"

/** How a part of the calibration fares. */
typedef enum weft_grade { WEFT_GRADE_GOOD, WEFT_GRADE_FAIR, WEFT_GRADE_REDO, WEFT_GRADE_ABSENT } weft_grade;

/** One sentence of the verdict. */
typedef struct weft_finding {
    weft_grade grade;
    const char *part; /* "lens", "pose", "lights", "linearity", "white", "colour" */
    char text[320];   /* what was found, with its figure */
    char remedy[320]; /* what to do; empty for what is good */
} weft_finding;

#define WEFT_FINDINGS_MAX 48

typedef struct weft_verdict {
    int n;
    weft_finding findings[WEFT_FINDINGS_MAX];
    weft_grade worst; /* of all findings */
} weft_verdict;

/** "good", "fair", "redo", "absent" */
const char *weft_grade_name(weft_grade grade);

/** Judges every part by its reports, by the limits of docs/calibration.md. */
void weft_report_judge(const weft_calibration *cal, weft_verdict *verdict);

/**
 * Writes the page.
 *
 * @param name   of the calibration, for the heading
 * @param sheet  what the lights were fitted to; NULL: measured and residual maps are said to be absent
 * @param page   gets the HTML; failures stick in it
 */
void weft_report_page(const weft_calibration *cal, const char *name, const weft_white_sheet *sheet,
                      const weft_verdict *verdict, weft_text_buffer *page);

#endif
