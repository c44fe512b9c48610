#include "host/light/controller.h"

#include "core/mem.h"

#include <glob.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Best first.  The names under by-id begin with the USB maker; 1a86 is the CH340 of cheap boards. */
static const char *const patterns[] = {
    "weft/light-*",
    "serial/by-id/*Arduino*",
    "serial/by-id/*2341*",
    "serial/by-id/*2a03*",
    "serial/by-id/*1a86*",
    "serial/by-id/*",
    "ttyACM*",
    "ttyUSB*",
};
enum { N_PATTERNS = sizeof patterns / sizeof patterns[0] };

typedef struct port_list {
    char **names, **targets; /* both NULL-ended */
    size_t n;
} port_list;

static weft_err add(port_list *list, const char *name, weft_error *err)
{
    char target[PATH_MAX];
    if (!realpath(name, target))
        return WEFT_OK; /* a link to a device that is gone */
    for (size_t i = 0; i < list->n; i++)
        if (strcmp(list->targets[i], target) == 0)
            return WEFT_OK; /* the same device under a better name */
    char **const names = weft_realloc(list->names, list->n + 2, sizeof *names, err);
    if (names)
        list->names = names;
    char **const targets = weft_realloc(list->targets, list->n + 2, sizeof *targets, err);
    if (targets)
        list->targets = targets;
    if (!names || !targets)
        return WEFT_ERR_NOMEM;
    names[list->n] = weft_strdup(name, err);
    targets[list->n] = names[list->n] ? weft_strdup(target, err) : NULL;
    if (!targets[list->n]) {
        weft_free(names[list->n]);
        names[list->n] = NULL;
        return WEFT_ERR_NOMEM;
    }
    list->n++;
    names[list->n] = targets[list->n] = NULL;
    return WEFT_OK;
}

static weft_err add_matches(port_list *list, const char *dev, const char *pattern, weft_error *err)
{
    char path[PATH_MAX];
    glob_t found;
    snprintf(path, sizeof path, "%s/%s", dev, pattern);
    if (glob(path, 0, NULL, &found) != 0)
        return WEFT_OK;
    weft_err status = WEFT_OK;
    for (size_t i = 0; i < found.gl_pathc && status == WEFT_OK; i++)
        status = add(list, found.gl_pathv[i], err);
    globfree(&found);
    return status;
}

weft_err weft_controller_list_ports_under(const char *dev, char ***ports, weft_error *err)
{
    port_list list = {0};
    weft_err status = WEFT_OK;
    list.names = weft_alloc(1, sizeof *list.names, err);
    if (!list.names)
        return WEFT_ERR_NOMEM;
    for (int i = 0; i < N_PATTERNS && status == WEFT_OK; i++)
        status = add_matches(&list, dev, patterns[i], err);
    weft_controller_free_ports(list.targets);
    if (status == WEFT_OK)
        *ports = list.names;
    else
        weft_controller_free_ports(list.names);
    return status;
}

weft_err weft_controller_list_ports(char ***ports, weft_error *err)
{
    return weft_controller_list_ports_under("/dev", ports, err);
}

void weft_controller_free_ports(char **ports)
{
    for (size_t i = 0; ports && ports[i]; i++)
        weft_free(ports[i]);
    weft_free(ports);
}
