/* peer_uastc PICTURE.png: encodes an 8-bit RGB picture as UASTC on one core; time, and RGB PSNR of what comes
 * back. */
#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/progress.h"
#include "shading/export/uastc.h"

#include <math.h>
#include <stdio.h>

static void fetch(const weft_raster *r, int column, int row, uint8_t texels[16][4])
{
    for (int i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            texels[i][c] =
                (uint8_t)
                    r->data[((size_t)(4 * row + i / 4) * (size_t)r->width + (size_t)(4 * column + i % 4)) *
                                (size_t)r->channels +
                            (size_t)c];
}

int main(int argc, char **argv)
{
    weft_raster r;
    weft_error error = {0};
    uint8_t texels[16][4], out[16][4];
    double sum = 0;
    if (argc != 2 || weft_png_read(argv[1], &r, &error) != WEFT_OK || r.bits != 8 || r.channels < 3) {
        fprintf(stderr, "peer_uastc PICTURE.png (8-bit RGB): %s\n", error.text);
        return 1;
    }
    const int across = r.width / 4, down = r.height / 4;
    uint8_t(*const blocks)[16] = weft_alloc((size_t)across * (size_t)down, 16, &error);
    if (!blocks)
        return 1;
    const double start = weft_clock_s();
    for (int y = 0; y < down; y++)
        for (int x = 0; x < across; x++) {
            fetch(&r, x, y, texels);
            weft_uastc_encode((const uint8_t(*)[4])texels, false,
                              blocks[(size_t)y * (size_t)across + (size_t)x]);
        }
    const double seconds = weft_clock_s() - start;
    for (int y = 0; y < down; y++)
        for (int x = 0; x < across; x++) {
            fetch(&r, x, y, texels);
            (void)weft_uastc_decode(blocks[(size_t)y * (size_t)across + (size_t)x], out);
            for (int i = 0; i < 16; i++)
                for (int c = 0; c < 3; c++)
                    sum += pow(texels[i][c] - out[i][c], 2);
        }
    const double n = 48.0 * across * down;
    printf("weft      %6.2f s, %.2f Mpixel/s, PSNR %.2f dB\n", seconds, n / 3e6 / seconds,
           10 * log10(255 * 255 / (sum / n)));
    weft_free(blocks);
    weft_raster_fini(&r);
    return 0;
}
