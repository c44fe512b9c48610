#include "calibration/lens/lens_module.h"

#include "core/shipped.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

static const char module_name[] = "libweft_lens_opencv.so";

/* The module's path; of one that is nowhere its name, for dlopen()'s own words. */
static void find_module(char path[PATH_MAX])
{
    static const char *const places[] = {".", "../bin", "../lib/weft", NULL};
    const char *const given = getenv("WEFT_MODULES");
    if (given)
        snprintf(path, PATH_MAX, "%s/%s", given, module_name);
    else if (weft_shipped_find(module_name, places, path, NULL) != WEFT_OK)
        snprintf(path, PATH_MAX, "%s", module_name);
}

weft_err weft_lens_opencv_load(const weft_lens_opencv **opencv, weft_error *err)
{
    static const weft_lens_opencv *loaded;
    if (!loaded) {
        char path[PATH_MAX];
        find_module(path);
        void *const module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (!module)
            return weft_fail(
                err, WEFT_ERR_UNSUPPORTED,
                "the lens module cannot be opened (%s); it is built where OpenCV 4.5 or newer is "
                "installed (libopencv-dev), and found beside the program or in $WEFT_MODULES",
                dlerror());
        const weft_lens_opencv *const table = dlsym(module, WEFT_LENS_OPENCV_SYMBOL);
        if (!table || table->abi != WEFT_LENS_OPENCV_ABI) {
            dlclose(module);
            return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                             "%s: belongs to another version of Weft; build and install both together", path);
        }
        loaded = table;
    }
    *opencv = loaded;
    return WEFT_OK;
}
