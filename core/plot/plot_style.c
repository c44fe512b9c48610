/* How plots look on light and on dark paper.  No CSS variables: viewers that are no browsers show it too. */
#include "core/plot/plot.h"

/* After Okabe and Ito 2008; lighter on dark paper. */
#define SERIES(i, colour)                                                                                    \
    ".weft-plot .l" i "{stroke:" colour ";fill:none}.weft-plot .f" i "{fill:" colour "}\n"

static const char style[] =
    ".weft-plot text{font:11px system-ui,sans-serif;fill:#24292f}\n"
    ".weft-plot .t{font-size:13px;font-weight:600}\n"
    ".weft-plot .n{fill:#57606a}\n"
    ".weft-plot .g{stroke:#d8dee4;fill:none}\n"
    ".weft-plot .a{stroke:#8c959f;fill:none}\n"
    ".weft-plot .w{stroke-width:1.6;stroke-linejoin:round}\n"
    ".weft-plot .d{stroke-width:1.4;stroke-dasharray:5 4}\n"
    ".weft-plot image{image-rendering:pixelated}\n" SERIES("0", "#0072b2") SERIES("1", "#d55e00")
        SERIES("2", "#009e73") SERIES("3", "#aa4f8c") SERIES("4", "#b88000") SERIES("5", "#3a96cf")
            SERIES("6", "#6f6a00") SERIES(
                "7", "#5a6067") "@media(prefers-color-scheme:dark){\n"
                                ".weft-plot text{fill:#e6edf3}.weft-plot .n{fill:#9ea7b3}.weft-plot "
                                ".g{stroke:#30363d}.weft-plot .a{stroke:#6e7681}\n" SERIES("0", "#4ba7e0")
                                    SERIES("1", "#ff8c42") SERIES("2", "#2fc99b") SERIES("3", "#d98cbf")
                                        SERIES("4", "#e6b422") SERIES("5", "#86cdf5") SERIES("6", "#d4cc4a")
                                            SERIES("7", "#a5adb6") "}\n";

const char *weft_plot_style(void)
{
    return style;
}
