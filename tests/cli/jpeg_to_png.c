/* jpeg-to-png IN OUT: staged photographs for the commands, which read no JPEG. */
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "tests/calibration/opencv_oracle.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    static uint8_t grey[4096 * 4096];
    weft_raster raster;
    weft_error error = {0};
    int width, height;
    if (argc != 3 || oracle_read_grey(argv[1], grey, sizeof grey, &width, &height) != 0)
        return 1;
    if (weft_raster_init(&raster, width, height, 1, 8, &error) != WEFT_OK)
        return 1;
    for (int i = 0; i < width * height; i++)
        raster.data[i] = grey[i];
    const weft_err status = weft_png_write(argv[2], &raster, &error);
    if (status != WEFT_OK)
        fprintf(stderr, "%s\n", error.text);
    weft_raster_fini(&raster);
    return status != WEFT_OK;
}
