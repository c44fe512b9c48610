/*
 * A GigE Vision camera on 127.0.0.1 for the tests: Aravis' own ArvGvFakeCamera with a raw format and a known
 * picture.  A process of its own, so that it can be killed.
 *
 *     fake_camera FORMAT WIDTHxHEIGHT     prints "ready", then obeys lines on stdin:
 *     lost RATIO      drops that share of the stream's packets
 *     delay MS        holds each frame back for so long, as a long exposure does
 *     stray           sends a frame that nobody asked for; "ok" when its exposure has begun
 *     format CODE     sends another pixel format (hexadecimal PFNC code) than it was told
 *     quit
 *
 * Exit status 3 when port 3956 is taken.  The picture is fake_camera_sample() of fake_camera.h.
 */
#include "tests/host/fake_camera.h"

#include <arv.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct {
    const char *name;
    unsigned code;
} formats[] = {{"BayerRG16", 0x0110002f},
               {"BayerGB12p", 0x010c0055},
               {"BayerBG8", 0x0108000b},
               {"BayerRG14p", 0x010e0106},
               {"BayerGR10p", 0x010a0056}};

static atomic_int delay_ms, n_begun;

/* Sample i of `bits` bits behind the ones before it, low bits first (PFNC "p"). */
static void put_bits(uint8_t *bytes, int i, int bits, unsigned sample)
{
    for (int b = 0; b < bits; b++) {
        const int at = i * bits + b;
        bytes[at / 8] = (uint8_t)((bytes[at / 8] & ~(1u << at % 8)) | (sample >> b & 1) << at % 8);
    }
}

static void fill(ArvBuffer *buffer, void *context, guint32 exposure_us, guint32 gain, ArvPixelFormat format)
{
    static unsigned count;
    uint8_t *const bytes = (uint8_t *)(uintptr_t)arv_buffer_get_data(buffer, NULL);
    const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
    (void)context;
    atomic_fetch_add(&n_begun, 1);
    g_usleep(1000UL * (unsigned long)atomic_load(&delay_ms));
    for (int i = 0; i < width * height; i++) {
        const uint16_t s = fake_camera_sample(i % width, i / width, exposure_us, gain);
        uint8_t *const b = bytes + i / 2 * 3;
        if (format == formats[0].code) {
            bytes[2 * i] = (uint8_t)s;
            bytes[2 * i + 1] = (uint8_t)(s >> 8);
        } else if (format == formats[3].code || format == formats[4].code) {
            put_bits(bytes, i, format == formats[3].code ? 14 : 10, s);
        } else if (format == formats[1].code && i % 2 == 0) {
            b[0] = (uint8_t)s;
            b[1] = s >> 8 & 15;
        } else if (format == formats[1].code) {
            b[1] = (uint8_t)(b[1] | (s & 15) << 4);
            b[2] = (uint8_t)(s >> 4);
        } else {
            bytes[i] = (uint8_t)s;
        }
    }
    if (format == formats[0].code) { /* the first sample counts the frames */
        bytes[0] = (uint8_t)count;
        bytes[1] = (uint8_t)(count >> 8);
    }
    count++;
}

/* Aravis' description with the format added and the others taken out, so that it must be chosen. */
static char *write_description(const char *format, unsigned code)
{
    size_t size = 0;
    ArvFakeCamera *const scratch = arv_fake_camera_new("scratch");
    const char *const original = arv_fake_camera_get_genicam_xml(scratch, &size);
    char *const xml = g_strndup(original, size);
    const char *const begin = strstr(xml, "<EnumEntry Name=\"BayerBG8\""), *const end = strstr(
                                                                               xml,
                                                                               "<pValue>PixelFormatRegister");
    char *path = NULL;
    const int fd = g_file_open_tmp("weft-fake-XXXXXX.xml", &path, NULL);
    FILE *const file = begin && end && fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!file)
        exit(1);
    fprintf(file,
            "%.*s<EnumEntry Name=\"Mono8\"><Value>17301505</Value></EnumEntry>"
            "<EnumEntry Name=\"%s\"><Value>%u</Value></EnumEntry>%s",
            (int)(begin - xml), xml, format, code, end);
    fclose(file);
    g_free(xml);
    g_object_unref(scratch);
    return path;
}

static void send_stray(ArvGvFakeCamera *camera)
{
    const int before = atomic_load(&n_begun);
    arv_fake_camera_write_register(arv_gv_fake_camera_get_fake_camera(camera),
                                   ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 1);
    for (int i = 0; i < 5000 && atomic_load(&n_begun) == before; i++)
        g_usleep(1000);
}

static void obey(ArvGvFakeCamera *camera)
{
    char line[80];
    double ratio;
    int ms;
    unsigned format;
    while (fgets(line, sizeof line, stdin) && strcmp(line, "quit\n") != 0) {
        if (sscanf(line, "lost %lf", &ratio) == 1)
            g_object_set(camera, "gvsp-lost-ratio", ratio, NULL);
        else if (sscanf(line, "delay %d", &ms) == 1)
            atomic_store(&delay_ms, ms);
        else if (strcmp(line, "stray\n") == 0)
            send_stray(camera);
        else if (sscanf(line, "format %x", &format) == 1)
            arv_fake_camera_write_register(arv_gv_fake_camera_get_fake_camera(camera),
                                           ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, format);
        puts("ok");
        fflush(stdout);
    }
}

int main(int argc, char **argv)
{
    unsigned code = 0, width = 0, height = 0;
    for (size_t i = 0; argc == 3 && i < sizeof formats / sizeof formats[0]; i++)
        if (strcmp(formats[i].name, argv[1]) == 0)
            code = formats[i].code;
    if (argc != 3 || sscanf(argv[2], "%ux%u", &width, &height) != 2)
        return 2;
    char *const description = write_description(argv[1], code ? code : 17301505);
    ArvGvFakeCamera *const camera = arv_gv_fake_camera_new_full("127.0.0.1", "FC01", description);
    unlink(description);
    if (!arv_gv_fake_camera_is_running(camera))
        return 3;
    ArvFakeCamera *const device = arv_gv_fake_camera_get_fake_camera(camera);
    arv_fake_camera_set_fill_pattern(device, fill, NULL);
    arv_fake_camera_set_trigger_frequency(device, 1000.0);
    arv_fake_camera_write_register(device, ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, width);
    arv_fake_camera_write_register(device, ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, height);
    puts("ready");
    fflush(stdout);
    obey(camera);
    g_object_unref(camera);
    g_free(description);
    return 0;
}
