#include "calibration/lens/lens_module.h"

#include "core/file.h"
#include "core/mem.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char module_name[] = "libweft_lens_opencv.so";

/* Folder of the running program, without the last slash; false when the system does not say. */
static bool program_folder(char *folder, size_t size)
{
    const ssize_t n = readlink("/proc/self/exe", folder, size - 1);
    if (n <= 0)
        return false;
    folder[n] = 0;
    char *const slash = strrchr(folder, '/');
    if (!slash)
        return false;
    *slash = 0;
    return true;
}

static void *open_module(char *path, size_t size)
{
    static const char *const places[] = {".", "../lib/weft", "../bin"};
    char folder[768];
    const char *const given = getenv("WEFT_MODULES");
    if (given) {
        snprintf(path, size, "%s/%s", given, module_name);
        return dlopen(path, RTLD_NOW | RTLD_LOCAL);
    }
    if (!program_folder(folder, sizeof folder))
        snprintf(folder, sizeof folder, ".");
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        snprintf(path, size, "%s/%s/%s", folder, places[i], module_name);
        if (weft_file_exists(path))
            return dlopen(path, RTLD_NOW | RTLD_LOCAL);
    }
    snprintf(path, size, "%s/%s", folder, module_name);
    return dlopen(path, RTLD_NOW | RTLD_LOCAL); /* fails, and says so in the system's words */
}

weft_err weft_lens_opencv_load(const weft_lens_opencv **opencv, weft_error *err)
{
    static const weft_lens_opencv *loaded;
    if (!loaded) {
        char path[1024];
        void *const module = open_module(path, sizeof path);
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
