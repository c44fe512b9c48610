/** Inside of the report: its sections, and reading numbers out of the steps' reports. */
#ifndef WEFT_CALIBRATION_REPORT_REPORT_PARTS_H
#define WEFT_CALIBRATION_REPORT_REPORT_PARTS_H

#include "calibration/report/report.h"
#include "core/plot/plot.h"

#include <math.h>

/** A number of an object; NaN when it is not there. */
static inline double weft_report_number(const json_t *object, const char *key)
{
    const json_t *const value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

/** A number of an array; NaN when it is not there. */
static inline double weft_report_item(const json_t *array, size_t i)
{
    const json_t *const value = json_array_get(array, i);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

/** A text of an object; "" when it is not there. */
static inline const char *weft_report_text(const json_t *object, const char *key)
{
    const char *const text = json_string_value(json_object_get(object, key));
    return text ? text : "";
}

/** "<p class=absent>...": what a section would show, and which command makes it. */
void weft_report_absent(weft_text_buffer *page, const char *what, const char *command);

/** Opens and closes a picture with words below it. */
void weft_report_figure_begin(weft_text_buffer *page);
void weft_report_figure_end(weft_text_buffer *page, const char *words);

/** A table cell with a number of `decimals`; empty for NaN. */
void weft_report_cell(weft_text_buffer *page, int decimals, double value);

/** The sections. */
void weft_report_lens(const weft_calibration *cal, weft_text_buffer *page);
void weft_report_lights(const weft_calibration *cal, const weft_white_sheet *sheet, weft_text_buffer *page);
void weft_report_linearity(const weft_calibration *cal, weft_text_buffer *page);
void weft_report_white(const weft_calibration *cal, weft_text_buffer *page);
void weft_report_colour(const weft_calibration *cal, weft_text_buffer *page);

#endif
