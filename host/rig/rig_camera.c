#include "host/rig/rig_camera.h"

#include "core/embedded.h"
#include "core/file.h"
#include "core/mem.h"

#include "core/text.h"
#include <arpa/inet.h>

#include <arv.h>
#include <errno.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* Registers of the GigE Vision bootstrap (GigE Vision 2.0, table 28-1). */
#define VENDOR_ADDRESS  0x48
#define MODEL_ADDRESS   0x68
#define VERSION_ADDRESS 0x88
#define TEXT_LENGTH     32
#define GVCP_PORT       3956
/* What TriggerSource says in virtual-scanner.xml. */
#define SOURCE_ADDRESS 0x2304
#define SOURCE_LINE1   2

extern const weft_embedded weft_rig_data[];

struct weft_rig_camera {
    ArvGvFakeCamera *gv;
    char *description; /* path of the XML */
    weft_rig_stage *stage;
    weft_controller_sim *sim;
    int width, height;
    uint16_t *dn;           /* [height][width]: the whole sensor, of which a region is sent */
    atomic_int blackout_ms; /* of the next frame */
};

/* Copies the region that the client asked for; 8-bit clients get the upper bits. */
static void copy_region(const weft_rig_camera *camera, ArvBuffer *buffer, ArvPixelFormat format)
{
    gint x, y, width, height;
    arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
    uint8_t *const bytes = (uint8_t *)(uintptr_t)arv_buffer_get_data(buffer, NULL);
    uint16_t *const words = (uint16_t *)(void *)bytes;
    for (int row = 0; row < height; row++)
        for (int column = 0; column < width; column++) {
            const bool inside = x + column < camera->width && y + row < camera->height;
            const uint16_t dn =
                inside ? camera->dn[(size_t)(y + row) * (size_t)camera->width + (size_t)(x + column)] : 0;
            const size_t i = (size_t)row * (size_t)width + (size_t)column;
            if (format == ARV_PIXEL_FORMAT_BAYER_RG_8)
                bytes[i] = (uint8_t)(dn >> 6);
            else
                words[i] = dn;
        }
}

/* From Aravis' thread, which answers no client meanwhile: the exposure itself and some 20 ms. */
static void fill(ArvBuffer *buffer, void *context, guint32 exposure_us, guint32 gain_raw,
                 ArvPixelFormat format)
{
    weft_rig_camera *const camera = context;
    double on[WEFT_RIG_N_LIGHTS] = {0};
    g_usleep(1000UL * (gulong)atomic_exchange(&camera->blackout_ms, 0));
    if (!weft_controller_sim_expose(camera->sim, exposure_us, on))
        memset(on, 0, sizeof on);
    const double gain = pow(10, gain_raw / 2000.0); /* GainRaw counts 0.01 dB */
    weft_rig_stage_expose(camera->stage, on, exposure_us * 1e-6, gain, camera->dn);
    copy_region(camera, buffer, format);
}

/* From the simulator's thread: the trigger pin is wired to Line1 of the camera. */
static void on_trigger(void *context)
{
    const weft_rig_camera *const camera = context;
    uint32_t source = 0;
    arv_fake_camera_read_register(arv_gv_fake_camera_get_fake_camera(camera->gv), SOURCE_ADDRESS, &source);
    if (source != SOURCE_LINE1)
        return;
    arv_fake_camera_write_register(arv_gv_fake_camera_get_fake_camera(camera->gv),
                                   ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 1);
}

static weft_err write_description(weft_rig_camera *camera, const char *folder, weft_error *err)
{
    const weft_embedded *const xml = weft_embedded_find(weft_rig_data, "virtual-scanner.xml");
    camera->description = weft_path_join(folder, "camera.xml", err);
    if (!camera->description)
        return WEFT_ERR_NOMEM;
    return weft_file_write(camera->description, xml->bytes, xml->size, err);
}

static void set_text(ArvFakeCamera *fake, uint32_t address, const char *text)
{
    char padded[TEXT_LENGTH] = "";
    snprintf(padded, sizeof padded, "%s", text);
    arv_fake_camera_write_memory(fake, address, sizeof padded, padded);
}

static void set_registers(const weft_rig_camera *camera, ArvFakeCamera *fake)
{
    set_text(fake, VENDOR_ADDRESS, "Weft");
    set_text(fake, MODEL_ADDRESS, "Virtual scanner");
    set_text(fake, VERSION_ADDRESS, "1");
    const struct {
        uint32_t address, value;
    } registers[] = {
        {ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, (uint32_t)camera->width},
        {ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, (uint32_t)camera->height},
        {ARV_FAKE_CAMERA_REGISTER_WIDTH, (uint32_t)camera->width},
        {ARV_FAKE_CAMERA_REGISTER_HEIGHT, (uint32_t)camera->height},
        {ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, 0x0110002f}, /* BayerRG16 */
        {ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US, 40000},
        {ARV_FAKE_CAMERA_REGISTER_GAIN_RAW, 0},
        {ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE, 1}, /* whichever source SOURCE_ADDRESS names */
        {SOURCE_ADDRESS, 1},
    };
    for (size_t i = 0; i < sizeof registers / sizeof registers[0]; i++)
        arv_fake_camera_write_register(fake, registers[i].address, registers[i].value);
}

/* Aravis shares the port (SO_REUSEADDR), and two cameras would then answer in turn: ask for it alone first.
 */
static bool port_is_taken(const char *address)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(GVCP_PORT)};
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool taken = fd >= 0 && inet_pton(AF_INET, address, &at.sin_addr) == 1 &&
                       bind(fd, (const struct sockaddr *)&at, sizeof at) != 0 && errno == EADDRINUSE;
    if (fd >= 0)
        close(fd);
    return taken;
}

static weft_err start(weft_rig_camera *camera, const char *address, weft_error *err)
{
    if (port_is_taken(address))
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "the camera cannot listen at UDP port 3956 of %s: end the other virtual scanner or "
                         "camera simulator there, or give --address that of another network interface",
                         address);
    camera->gv = arv_gv_fake_camera_new_full(address, "rig-0", camera->description);
    if (!camera->gv || !arv_gv_fake_camera_is_running(camera->gv)) /* 127.0.0.5 could be bound all the same */
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "the camera cannot listen at %s: no network interface has that address; give "
                         "--address one that \"ip address\" lists",
                         address);
    ArvFakeCamera *const fake = arv_gv_fake_camera_get_fake_camera(camera->gv);
    arv_fake_camera_set_fill_pattern(fake, fill, camera);
    arv_fake_camera_set_trigger_frequency(fake, 1000);
    set_registers(camera, fake);
    weft_controller_sim_set_trigger(camera->sim, on_trigger, camera);
    weft_controller_sim_wire_exposure(camera->sim);
    return WEFT_OK;
}

weft_err weft_rig_camera_fail(weft_rig_camera *camera, const char *words, weft_error *err)
{
    ArvFakeCamera *const fake = arv_gv_fake_camera_get_fake_camera(camera->gv);
    const char *const space = strchr(words, ' ');
    const size_t n = space ? (size_t)(space - words) : strlen(words);
    double number = -1;
    const bool has_number = space && weft_text_to_double(space + 1, &number);
    if (n == 4 && memcmp(words, "lost", n) == 0 && has_number && number >= 0 && number <= 1)
        g_object_set(camera->gv, "gvsp-lost-ratio", number, NULL);
    else if (n == 8 && memcmp(words, "blackout", n) == 0 && has_number && number >= 0 && number <= 60)
        atomic_store(&camera->blackout_ms, (int)(1e3 * number));
    else if (strcmp(words, "stray") == 0)
        arv_fake_camera_write_register(fake, ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 1);
    else if (strcmp(words, "format BayerRG8") == 0)
        arv_fake_camera_write_register(fake, ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT,
                                       ARV_PIXEL_FORMAT_BAYER_RG_8);
    else
        return weft_fail(
            err, WEFT_ERR_USAGE,
            "camera: wanted lost 0..1, blackout 0..60 (seconds), stray or format BayerRG8, not %s", words);
    return WEFT_OK;
}

weft_err weft_rig_camera_create(const char *address, const char *folder, weft_rig_stage *stage,
                                weft_controller_sim *sim, weft_rig_camera **camera, weft_error *err)
{
    const weft_camera *const model = &weft_rig_stage_scene(stage)->camera;
    weft_rig_camera *const c = weft_alloc(1, sizeof *c, err);
    if (!c)
        return WEFT_ERR_NOMEM;
    *c = (weft_rig_camera){.stage = stage, .sim = sim, .width = model->width, .height = model->height};
    c->dn = weft_alloc((size_t)c->width * (size_t)c->height, sizeof *c->dn, err);
    weft_err status = c->dn ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = write_description(c, folder, err);
    if (status == WEFT_OK)
        status = start(c, address, err);
    if (status != WEFT_OK) {
        weft_rig_camera_destroy(c);
        return status;
    }
    *camera = c;
    return WEFT_OK;
}

void weft_rig_camera_destroy(weft_rig_camera *camera)
{
    if (!camera)
        return;
    if (camera->gv) {
        weft_controller_sim_set_trigger(camera->sim, NULL, NULL);
        g_object_unref(camera->gv); /* waits for its thread */
    }
    if (camera->description)
        remove(camera->description);
    weft_free(camera->description);
    weft_free(camera->dn);
    weft_free(camera);
}
