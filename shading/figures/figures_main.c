/* weft-figures DIR: draws the figures of the sources that the gallery shows. */
#include "shading/figures/figures.h"

#include "core/file.h"

#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    weft_err (*draw)(const char *folder, weft_error *err);
} figures[] = {
    {"order-1", weft_figure_order_1},     {"order-2", weft_figure_order_2},
    {"order-17", weft_figure_order_17},   {"order-18", weft_figure_order_18},
    {"cod", weft_figure_cod_spheres},     {"unreal-4", weft_figure_unreal_4},
    {"unreal-10", weft_figure_unreal_10}, {"unreal-11", weft_figure_unreal_11},
};

enum { N_FIGURES = sizeof figures / sizeof figures[0] };

static int usage(FILE *out, int status)
{
    fprintf(out, "usage: weft-figures DIR [FIGURE]...\n\nDraws figures of the sources into DIR, over what is "
                 "there.  FIGURE is one of:");
    for (int i = 0; i < N_FIGURES; i++)
        fprintf(out, " %s", figures[i].name);
    fputc('\n', out);
    return status;
}

static bool wanted(int argc, char **argv, const char *name)
{
    for (int i = 2; i < argc; i++)
        if (strcmp(argv[i], name) == 0)
            return true;
    return argc == 2;
}

static bool known(const char *name)
{
    for (int i = 0; i < N_FIGURES; i++)
        if (strcmp(figures[i].name, name) == 0)
            return true;
    return false;
}

int main(int argc, char **argv)
{
    weft_error error = {0};
    if (argc < 2)
        return usage(stderr, 2);
    if (strcmp(argv[1], "--help") == 0)
        return usage(stdout, 0);
    for (int i = 2; i < argc; i++)
        if (!known(argv[i])) {
            fprintf(stderr, "weft-figures: %s: no such figure\n", argv[i]);
            return usage(stderr, 2);
        }
    weft_err status = weft_folder_create(argv[1], &error);
    for (int i = 0; i < N_FIGURES && status == WEFT_OK; i++)
        if (wanted(argc, argv, figures[i].name))
            status = figures[i].draw(argv[1], &error);
    if (status != WEFT_OK)
        fprintf(stderr, "weft-figures: %s\n", error.text);
    return weft_err_exit_status(status);
}
