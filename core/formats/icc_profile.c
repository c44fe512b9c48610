#include "core/formats/icc_profile.h"

#include "core/colour.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* D50 as ICC.1 rounds it: readers compare the bits. */
static const double icc_d50[3] = {0.9642, 1.0, 0.8249};

enum { N_TAGS = 9, HEADER = 128, CURVE_SAMPLES = 1024, ICC_ALIGN = 4 };

/* Big-endian numbers, as the format has them. */
static void put32(weft_text_buffer *b, uint32_t v)
{
    const char bytes[4] = {(char)(v >> 24), (char)(v >> 16), (char)(v >> 8), (char)v};
    weft_text_add_bytes(b, bytes, 4);
}

static void put16(weft_text_buffer *b, uint32_t v)
{
    const char bytes[2] = {(char)(v >> 8), (char)v};
    weft_text_add_bytes(b, bytes, 2);
}

static void put_tag(weft_text_buffer *b, const char *signature)
{
    weft_text_add_bytes(b, signature, 4);
}

static void put_fixed(weft_text_buffer *b, double v)
{
    put32(b, (uint32_t)(int32_t)lround(v * 65536));
}

static void put_zeros(weft_text_buffer *b, size_t n)
{
    for (; n > 0; n--)
        weft_text_add_bytes(b, "", 1);
}

static void put_xyz(weft_text_buffer *b, const double xyz[3])
{
    put_tag(b, "XYZ ");
    put32(b, 0);
    for (int i = 0; i < 3; i++)
        put_fixed(b, xyz[i]);
}

/* textDescriptionType: the ASCII part; no Unicode, no Macintosh script. */
static void put_description(weft_text_buffer *b, const char *text)
{
    put_tag(b, "desc");
    put32(b, 0);
    put32(b, (uint32_t)strlen(text) + 1);
    weft_text_add_bytes(b, text, strlen(text) + 1);
    put_zeros(b, 4 + 4 + 2 + 1 + 67);
}

static void put_curve(weft_text_buffer *b, weft_transfer transfer)
{
    put_tag(b, "curv");
    put32(b, 0);
    if (transfer == WEFT_TRANSFER_LINEAR) {
        put32(b, 0); /* no samples: the identity */
        return;
    }
    put32(b, CURVE_SAMPLES);
    for (int i = 0; i < CURVE_SAMPLES; i++)
        put16(b, (uint32_t)lround(65535 * weft_srgb_decode(i / (CURVE_SAMPLES - 1.0))));
}

static void put_colorant(weft_text_buffer *b, int channel)
{
    double rgb[3] = {0}, xyz[3], adapted[3];
    rgb[channel] = 1;
    weft_srgb_to_xyz(rgb, xyz);
    weft_adapt_bradford(xyz, weft_white_d65, icc_d50, adapted);
    put_xyz(b, adapted);
}

/* The data of tag k.  All curves are one and the same. */
static void put_data(weft_text_buffer *b, int k, weft_transfer transfer)
{
    static const char text[] = "text\0\0\0\0No copyright, use freely";
    if (k == 0)
        put_description(b, transfer == WEFT_TRANSFER_SRGB ? "sRGB" : "linear sRGB");
    else if (k == 1)
        weft_text_add_bytes(b, text, sizeof text);
    else if (k == 2)
        put_xyz(b, icc_d50);
    else if (k < 6)
        put_colorant(b, k - 3);
    else
        put_curve(b, transfer);
    put_zeros(b, (ICC_ALIGN - b->n % ICC_ALIGN) % ICC_ALIGN);
}

static void put_header(weft_text_buffer *b, uint32_t size)
{
    static const uint32_t created[6] = {2026, 1, 1, 0, 0, 0};
    put32(b, size);
    put32(b, 0); /* no preferred engine */
    put32(b, 0x02100000);
    put_tag(b, "mntr");
    put_tag(b, "RGB ");
    put_tag(b, "XYZ ");
    for (int i = 0; i < 6; i++)
        put16(b, created[i]);
    put_tag(b, "acsp");
    put_zeros(b, 4 + 4 + 4 + 4 + 8 + 4); /* platform, flags, maker, model, attributes, perceptual */
    for (int i = 0; i < 3; i++)
        put_fixed(b, icc_d50[i]);
    put_zeros(b, HEADER - 80);
}

void weft_icc_profile(weft_transfer transfer, weft_text_buffer *profile)
{
    static const char *const signatures[N_TAGS] = {"desc", "cprt", "wtpt", "rXYZ", "gXYZ",
                                                   "bXYZ", "rTRC", "gTRC", "bTRC"};
    weft_text_buffer data = {0};
    uint32_t offset[N_TAGS], size[N_TAGS];
    const uint32_t begin = HEADER + 4 + 12 * N_TAGS;
    for (int k = 0; k < N_TAGS; k++) {
        const bool shared = k > 6;
        offset[k] = shared ? offset[6] : begin + (uint32_t)data.n;
        if (!shared)
            put_data(&data, k, transfer);
        size[k] = shared ? size[6] : begin + (uint32_t)data.n - offset[k];
    }
    put_header(profile, begin + (uint32_t)data.n);
    put32(profile, N_TAGS);
    for (int k = 0; k < N_TAGS; k++) {
        put_tag(profile, signatures[k]);
        put32(profile, offset[k]);
        put32(profile, size[k]);
    }
    weft_text_add_bytes(profile, data.text, data.n);
    if (profile->failure.code == WEFT_OK && data.failure.code != WEFT_OK)
        profile->failure = data.failure;
    weft_text_buffer_fini(&data);
}
