#include "host/client/job_kinds.h"

#include <string.h>

#define CHART .reads = "*", .writes = "output|overlay|patches"

/* clang-format off */
const weft_job_kind weft_job_kinds[] = {
    {.command = "devices", .hardware = true, .by_hand = true},
    {.command = "light on", .hardware = true, .by_hand = true},
    {.command = "light level", .hardware = true, .by_hand = true},
    {.command = "light off", .hardware = true, .by_hand = true},
    {.command = "light run", .hardware = true, .by_hand = true, .reads = "*"},
    {.command = "light set", .hardware = true, .by_hand = true},
    {.command = "light status", .hardware = true, .by_hand = true},
    {.command = "live", .hardware = true, .by_hand = true, .writes = "output", .texts = "lights"},
    {.command = "capture", .hardware = true, .resumes = true, .writes = "*", .texts = "lights|exposure|name|trigger|file-name|bracket"},
    {.command = "calibrate lens", .reads = "*|board-on-table", .writes = "output", .texts = "model|bent"},
    {.command = "calibrate linearity", CHART},
    {.command = "calibrate white", CHART},
    {.command = "calibrate lights", .reads = "*|guess|positions|balls", .writes = "output"},
    {.command = "calibrate colour", .reads = "*|chart-photo|flat|cal", .writes = "output|overlay|patches", .texts = "chart|edition|exclude"},
    {.command = "import", .reads = "*", .writes = "output|cal"},
    {.command = "calibrate report", .reads = "*", .writes = "output"},
    {.command = "solve", .reads = "*|calibration", .writes = "output|explain-plot", .texts = "method"},
    {.command = "check", .reads = "*|calibration|repeat", .writes = "map", .texts = "method"},
    {.command = "layout", .reads = "*", .writes = "plot"},
    {.command = "batch", .reads = "*|calibration", .writes = "output", .texts = "solve", .never = "sbatch|task"},
    {.command = "compare", .reads = "*|mask"},
    {.command = "lint", .reads = "*"},
    {.command = "weave", .reads = "*", .writes = "output|picture"},
    {.command = "bake", .reads = "*|library", .writes = "output", .texts = "material|export", .never = "format"},
    {.command = "preview", .reads = "*|match|calibration|env|height-map", .writes = "output", .texts = "brdf|param|lamp|columns|polarise"},
    {.command = "contact", .reads = "*", .writes = "output", .texts = "brdf|param"},
    {.command = "library reindex", .reads = "library", .in_library = true},
    {0},
};
/* clang-format on */

const weft_job_kind *weft_job_kind_find(const char *command)
{
    for (const weft_job_kind *kind = weft_job_kinds; kind->command; kind++)
        if (strcmp(kind->command, command) == 0)
            return kind;
    return NULL;
}

bool weft_job_kind_lists(const char *list, const char *word)
{
    const size_t n = strlen(word);
    for (const char *p = list; p && *p;) {
        const size_t length = strcspn(p, "|");
        if (length == n && memcmp(p, word, n) == 0)
            return true;
        p += length + (p[length] == '|');
    }
    return false;
}

bool weft_job_kind_is_path(const weft_job_kind *kind, const char *option)
{
    return weft_job_kind_lists(kind->reads, option) || weft_job_kind_lists(kind->writes, option);
}

bool weft_job_kind_is_device(const char *option)
{
    return weft_job_kind_lists("rig|port|camera", option);
}
