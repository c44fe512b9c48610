#include "calibration/report/report_parts.h"

#include "core/file.h"
#include "core/version.h"

static const char style[] =
    ":root{color-scheme:light dark}\n"
    "body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;max-width:1080px;padding:16px;color:#24292f;"
    "background:#fff}\n"
    "h1{font-size:24px;margin:8px 0}h2{font-size:19px;margin:32px 0 8px;border-bottom:1px solid #d8dee4}\n"
    "h3{font-size:15px;margin:18px 0 4px}.soft,figcaption{color:#57606a;font-size:13px}\n"
    "figure{margin:8px 16px 8px 0;display:inline-block;vertical-align:top;max-width:100%}\n"
    ".column{display:inline-block;vertical-align:top;max-width:446px}.maps figure{margin:4px 8px 4px 0}\n"
    "figcaption{max-width:440px}svg{max-width:100%;height:auto}\n"
    "table{border-collapse:collapse;margin:8px 0;font-size:14px}th,td{text-align:left;padding:3px 12px 3px 0;"
    "vertical-align:top}\n"
    "th{font-weight:600}td.n{text-align:right;font-variant-numeric:tabular-nums}tr+tr td{border-top:1px "
    "solid "
    "#d8dee4}\n"
    ".tag{display:inline-block;min-width:52px;text-align:center;border-radius:4px;padding:0 6px;color:#fff;"
    "font-size:13px}\n"
    ".good{background:#1a7f37}.fair{background:#9a6700}.redo{background:#cf222e}.absent.tag{background:#"
    "6e7781}\n"
    "p.absent{color:#57606a;font-style:italic}code{font-size:13px}\n"
    "@media(prefers-color-scheme:dark){body{color:#e6edf3;background:#0d1117}h2,tr+tr "
    "td{border-color:#30363d}"
    ".soft,figcaption,p.absent{color:#9ea7b3}}\n";

void weft_report_absent(weft_text_buffer *page, const char *what, const char *command)
{
    weft_text_add(page, "<p class=\"absent\">");
    weft_text_add_escaped(page, what);
    if (command) {
        weft_text_add(page, " <code>");
        weft_text_add_escaped(page, command);
        weft_text_add(page, "</code>");
    }
    weft_text_add(page, "</p>\n");
}

void weft_report_figure_begin(weft_text_buffer *page)
{
    weft_text_add(page, "<figure>\n");
}

void weft_report_figure_end(weft_text_buffer *page, const char *words)
{
    weft_text_add(page, "<figcaption>");
    weft_text_add_escaped(page, words);
    weft_text_add(page, "</figcaption></figure>\n");
}

void weft_report_cell(weft_text_buffer *page, int decimals, double value)
{
    weft_text_add(page, "<td class=\"n\">");
    if (!isnan(value))
        weft_text_add(page, "%.*f", decimals, value);
    weft_text_add(page, "</td>");
}

/* The whole in one sentence. */
static const char *summary_of(const weft_verdict *v)
{
    static const char *const words[] = {
        "Everything that is here is good.",
        "It can be used; what is fair could be better.",
        "Part of it should be done again.",
        "It is not complete.",
    };
    bool redo = false;
    for (int i = 0; i < v->n; i++)
        redo |= v->findings[i].grade == WEFT_GRADE_REDO;
    return v->worst == WEFT_GRADE_ABSENT && redo ? "It is not complete, and part of it should be done again."
                                                 : words[v->worst];
}

static void write_verdict(const weft_verdict *v, weft_text_buffer *page)
{
    weft_text_add(page, "<h2>Verdict</h2>\n<p><strong>%s</strong></p>\n<table>\n", summary_of(v));
    for (int i = 0; i < v->n; i++) {
        const weft_finding *const f = &v->findings[i];
        const char *const name = weft_grade_name(f->grade);
        weft_text_add(page, "<tr><td><span class=\"tag %s\">%s</span></td><td>%s</td><td>", name, name,
                      f->part);
        weft_text_add_escaped(page, f->text);
        if (f->remedy[0]) {
            weft_text_add(page, "<br><span class=\"soft\">");
            weft_text_add_escaped(page, f->remedy);
            weft_text_add(page, "</span>");
        }
        weft_text_add(page, "</td></tr>\n");
    }
    weft_text_add(page, "</table>\n");
}

void weft_report_page(const weft_calibration *cal, const char *name, const weft_white_sheet *sheet,
                      const weft_verdict *verdict, weft_text_buffer *page)
{
    char now[32];
    weft_time_now_iso(now);
    weft_text_add(
        page, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
              "content=\"width=device-width\">\n<title>");
    weft_text_add_escaped(page, name);
    weft_text_add(page, ": calibration</title>\n<style>\n%s%s</style></head><body>\n<h1>Calibration ", style,
                  weft_plot_style());
    weft_text_add_escaped(page, name);
    weft_text_add(page, "</h1>\n<p class=\"soft\">begun ");
    weft_text_add_escaped(page, cal->created);
    weft_text_add(page, ", report of %s by weft " WEFT_VERSION "</p>\n", now);
    write_verdict(verdict, page);
    weft_report_lens(cal, page);
    weft_report_lights(cal, sheet, page);
    weft_report_linearity(cal, page);
    weft_report_white(cal, page);
    weft_report_colour(cal, page);
    weft_text_add(page, "</body></html>\n");
}
