#include "host/camera/gphoto_session.h"

#include "core/log.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* libgphoto2 2.5.30 forgets some bytes at each event it asks for, and unloads the driver that did so: no list
 * of leaks can name it.  What it allocates inside a call is its own affair. */
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#define LEAKS_BEGIN() __lsan_disable()
#define LEAKS_END()   __lsan_enable()
#else
#define LEAKS_BEGIN() (void)0
#define LEAKS_END()   (void)0
#endif

/* ---- errors ---- */

#define REPLUG "; switch it off and on, check the cable and try again"

static const struct {
    int code;
    weft_err status;
    const char *words;
} meanings[] = {
    {GP_ERROR_IO_USB_CLAIM, WEFT_ERR_DEVICE,
     "another program has it; a desktop mounts cameras by itself: eject it there, or run \"gio mount -s "
     "gphoto2\", "
     "or stop gvfs-gphoto2-volume-monitor, and close other photo programs"},
    {GP_ERROR_IO_LOCK, WEFT_ERR_DEVICE, "another program has locked it; close that one"},
    {GP_ERROR_IO_USB_FIND, WEFT_ERR_DEVICE, "is not there (any more); plug it in and switch it on"},
    {GP_ERROR_MODEL_NOT_FOUND, WEFT_ERR_DEVICE,
     "is not there, or libgphoto2 does not know it; plug it in and "
     "switch it on, and see \"gphoto2 --list-cameras\""},
    {GP_ERROR_UNKNOWN_PORT, WEFT_ERR_UNSUPPORTED,
     "libgphoto2 knows no such port; wanted usb:BUS,DEVICE, "
     "ptpip:ADDRESS or serial:NUMBER"},
    {GP_ERROR_LIBRARY, WEFT_ERR_UNSUPPORTED, "libgphoto2 cannot load its driver; install libgphoto2-6 again"},
    {GP_ERROR_IO, WEFT_ERR_DEVICE, "does not answer on its line" REPLUG},
    {GP_ERROR_IO_INIT, WEFT_ERR_DEVICE, "its line cannot be opened" REPLUG},
    {GP_ERROR_IO_READ, WEFT_ERR_DEVICE, "its answer cannot be read" REPLUG},
    {GP_ERROR_IO_WRITE, WEFT_ERR_DEVICE, "takes no command" REPLUG},
    {GP_ERROR_IO_USB_CLEAR_HALT, WEFT_ERR_DEVICE, "its USB line hangs" REPLUG},
    {GP_ERROR_TIMEOUT, WEFT_ERR_TIMEOUT, "did not answer in time" REPLUG},
    {GP_ERROR_CAMERA_BUSY, WEFT_ERR_TIMEOUT,
     "is busy; leave its menu and playback, and wait until its access lamp "
     "is dark"},
    {GP_ERROR_NO_SPACE, WEFT_ERR_DEVICE, "there is no room for the picture; empty its card or take it out"},
    {GP_ERROR_NO_MEMORY, WEFT_ERR_NOMEM, "libgphoto2 has no memory"},
    {GP_ERROR_NOT_SUPPORTED, WEFT_ERR_UNSUPPORTED, "cannot do that by remote control"},
    {GP_ERROR_BAD_PARAMETERS, WEFT_ERR_PROTOCOL, "does not take what libgphoto2 sends; update libgphoto2"},
    {GP_ERROR_CORRUPTED_DATA, WEFT_ERR_PROTOCOL, "sent damaged data" REPLUG},
    {GP_ERROR_FILE_NOT_FOUND, WEFT_ERR_PROTOCOL, "has not got the picture that it announced" REPLUG},
    {GP_ERROR_CANCEL, WEFT_ERR_CANCELLED, "cancelled"},
    {GP_ERROR, WEFT_ERR_DEVICE, "failed" REPLUG},
};

/* "usb:001,042" is a file, and files have permissions; libgphoto2 does not tell. */
static bool is_forbidden(const char *port)
{
    char path[64];
    if (strlen(port) != strlen("usb:001,042") || strncmp(port, "usb:", 4) != 0)
        return false;
    snprintf(path, sizeof path, "/dev/bus/usb/%.3s/%.3s", port + 4, port + 8);
    return access(path, R_OK | W_OK) != 0 && errno == EACCES;
}

weft_err gphoto_fail(const gphoto_session *s, int code, const char *doing, weft_error *err)
{
    const char *const own = s->words[0] ? s->words : gp_result_as_string(code);
    if (is_forbidden(s->port))
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "camera %s: %s: you may not open it; install Weft's udev rules (70-weft.rules), be in the "
            "group weft or plugdev, and plug it in again",
            s->address, doing);
    for (size_t i = 0; i < sizeof meanings / sizeof meanings[0]; i++)
        if (meanings[i].code == code)
            return weft_fail(err, meanings[i].status, "camera %s: %s: %s (libgphoto2: %s)", s->address, doing,
                             meanings[i].words, own);
    return weft_fail(err, WEFT_ERR_DEVICE, "camera %s: %s: %s (libgphoto2 error %d)" REPLUG, s->address,
                     doing, own, code);
}

static void on_error(GPContext *context, const char *text, void *data)
{
    gphoto_session *const s = data;
    (void)context;
    snprintf(s->words, sizeof s->words, "%s", text);
    for (char *c = s->words; *c; c++) /* one line */
        if ((unsigned char)*c < ' ')
            *c = ' ';
}

/* libgphoto2 writes some failures straight to stderr, where only our one line belongs. */
int gphoto_hush(void)
{
    LEAKS_BEGIN();
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    const int kept = null >= 0 ? fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 10) : -1;
    if (kept >= 0)
        dup2(null, STDERR_FILENO);
    if (null >= 0)
        close(null);
    return kept;
}

void gphoto_unhush(int kept)
{
    LEAKS_END();
    if (kept < 0)
        return;
    dup2(kept, STDERR_FILENO);
    close(kept);
}

/* ---- finding ---- */

static bool can_photograph(CameraAbilitiesList *abilities, const char *model)
{
    CameraAbilities a;
    const int i = gp_abilities_list_lookup_model(abilities, model);
    return i >= 0 && gp_abilities_list_get_abilities(abilities, i, &a) == GP_OK &&
           a.device_type == GP_DEVICE_STILL_CAMERA &&
           (a.operations & (GP_OPERATION_CAPTURE_IMAGE | GP_OPERATION_TRIGGER_CAPTURE));
}

static int look(gphoto_session *s, CameraAbilitiesList *abilities, CameraList *list, gphoto_seen *seen,
                int max, int *n)
{
    int code = gp_abilities_list_load(abilities, s->context);
    if (code == GP_OK)
        code = gp_camera_autodetect(list, s->context);
    const int count = code >= 0 ? gp_list_count(list) : 0;
    for (int i = 0; i < count && *n < max; i++) {
        const char *model = "", *port = "";
        gp_list_get_name(list, i, &model);
        gp_list_get_value(list, i, &port);
        if (strncmp(port, "usb:", 4) != 0 || !can_photograph(abilities, model))
            continue;
        snprintf(seen[*n].model, sizeof seen->model, "%s", model);
        snprintf(seen[*n].port, sizeof seen->port, "%s", port);
        ++*n;
    }
    return code < 0 ? code : GP_OK;
}

weft_err gphoto_look(gphoto_seen *seen, int max, int *n, weft_error *err)
{
    gphoto_session s = {.context = gp_context_new(), .address = "gphoto"};
    CameraAbilitiesList *abilities = NULL;
    CameraList *list = NULL;
    int code = GP_ERROR_NO_MEMORY;
    *n = 0;
    gp_context_set_error_func(s.context, on_error, &s);
    if (gp_abilities_list_new(&abilities) == GP_OK && gp_list_new(&list) == GP_OK)
        GPHOTO_CALL(&s, code, look(&s, abilities, list, seen, max, n));
    gp_abilities_list_free(abilities);
    gp_list_free(list);
    gp_context_unref(s.context);
    return code < 0 ? gphoto_fail(&s, code, "looking for cameras", err) : WEFT_OK;
}

/* ---- connecting ---- */

/* "ptpip:HOST:PORT" means that port for events too; libgphoto2 would take 15740 for those. */
static void spell_port(const char *address, char *port, size_t size)
{
    const char *const host = strncmp(address, "ptpip:", 6) == 0 ? address + 6 : NULL;
    const char *const colon = host ? strchr(host, ':') : NULL;
    if (colon && !strchr(colon + 1, ':'))
        snprintf(port, size, "%s:%s", address, colon + 1);
    else
        snprintf(port, size, "%s", address);
}

/* Network cameras are not looked for, so their driver is named.  Asking all drivers for their lists of models
 * takes a third of a second; the answer is always the same. */
static int set_network_driver(gphoto_session *s)
{
    static CameraAbilities network;
    CameraAbilitiesList *list = NULL;
    int code = GP_OK;
    if (!network.model[0]) {
        code = gp_abilities_list_new(&list);
        if (code == GP_OK)
            code = gp_abilities_list_load(list, s->context);
        if (code >= GP_OK)
            code = gp_abilities_list_lookup_model(list, "PTP/IP Camera");
        if (code >= GP_OK)
            code = gp_abilities_list_get_abilities(list, code, &network);
        gp_abilities_list_free(list);
    }
    return code == GP_OK ? gp_camera_set_abilities(s->camera, network) : code;
}

static int set_port(Camera *camera, const char *port)
{
    GPPortInfoList *list = NULL;
    GPPortInfo info;
    int code = gp_port_info_list_new(&list);
    if (code == GP_OK)
        code = gp_port_info_list_load(list);
    if (code >= GP_OK)
        code = gp_port_info_list_lookup_path(list, port);
    if (code >= GP_OK)
        code = gp_port_info_list_get_info(list, code, &info);
    if (code == GP_OK)
        code = gp_camera_set_port_info(camera, info);
    gp_port_info_list_free(list);
    return code;
}

static int connect_port(gphoto_session *s)
{
    int code = gp_camera_new(&s->camera);
    if (code == GP_OK && strncmp(s->port, "ptpip:", 6) == 0)
        code = set_network_driver(s);
    if (code == GP_OK)
        code = set_port(s->camera, s->port);
    return code == GP_OK ? gp_camera_init(s->camera, s->context) : code;
}

static weft_err connect_at(gphoto_session *s, const char *port, weft_error *err)
{
    int code;
    snprintf(s->port, sizeof s->port, "%s", port);
    GPHOTO_CALL(s, code, connect_port(s));
    if (code == GP_OK)
        return WEFT_OK;
    if (code == GP_ERROR && strncmp(port, "ptpip:", 6) == 0)
        weft_fail(
            err, WEFT_ERR_DEVICE,
            "camera %s: it refuses the connection: another program has it, or it wants to be paired with "
            "this computer in its network menu first",
            s->address);
    else
        gphoto_fail(s, code, "connecting", err);
    const weft_err status = err ? err->code : WEFT_ERR_DEVICE;
    gphoto_disconnect(s);
    return status;
}

static weft_err connect_serial(gphoto_session *s, const char *serial, weft_error *err)
{
    enum { MAX = 16 };
    gphoto_seen seen[MAX];
    weft_error first = {0};
    int n = 0;
    WEFT_TRY(gphoto_look(seen, MAX, &n, err));
    for (int i = 0; i < n; i++) {
        char found[GPHOTO_TEXT];
        if (connect_at(s, seen[i].port, first.text[0] ? NULL : &first) != WEFT_OK)
            continue;
        gphoto_read_serial(s, found);
        if (found[0] && strcmp(found, serial + strspn(serial, "0")) == 0)
            return WEFT_OK;
        gphoto_disconnect(s);
    }
    if (first.text[0]) { /* it may be the one that cannot be opened */
        if (err)
            *err = first;
        return first.code;
    }
    return weft_fail(
        err, WEFT_ERR_DEVICE,
        "camera %s: none of the %d cameras on USB has that serial number; plug it in, switch it on, and "
        "see \"weft devices\"",
        s->address, n);
}

weft_err gphoto_connect(gphoto_session *s, const char *address, weft_error *err)
{
    char port[128];
    (void)signal(SIGPIPE, SIG_IGN); /* libgphoto2 writes to sockets with write() */
    if (!s->context) {
        s->context = gp_context_new();
        if (!s->context)
            return weft_fail(err, WEFT_ERR_NOMEM, "libgphoto2 has no memory");
        gp_context_set_error_func(s->context, on_error, s);
    }
    snprintf(s->address, sizeof s->address, "%s", address);
    if (strncmp(address, "serial:", 7) == 0)
        return connect_serial(s, address + 7, err);
    spell_port(address, port, sizeof port);
    return connect_at(s, port, err);
}

void gphoto_disconnect(gphoto_session *s)
{
    int code = GP_OK;
    if (s->camera)
        GPHOTO_CALL(s, code, gp_camera_exit(s->camera, s->context));
    if (code != GP_OK)
        weft_explain("camera %s: it did not say goodbye: %s", s->address, gp_result_as_string(code));
    if (s->camera)
        gp_camera_unref(s->camera);
    s->camera = NULL;
}

/* ---- settings ---- */

bool gphoto_get(gphoto_session *s, const char *name, gphoto_choice *choice)
{
    CameraWidgetType type;
    const char *value = NULL;
    int code, read_only = 0;
    *choice = (gphoto_choice){0};
    GPHOTO_CALL(s, code, gp_camera_get_single_config(s->camera, name, &choice->widget, s->context));
    if (code != GP_OK || !choice->widget)
        return false;
    if (gp_widget_get_type(choice->widget, &type) != GP_OK ||
        (type != GP_WIDGET_RADIO && type != GP_WIDGET_MENU && type != GP_WIDGET_TEXT) ||
        gp_widget_get_value(choice->widget, (void *)&value) != GP_OK) {
        gphoto_choice_free(choice);
        return false;
    }
    snprintf(choice->value, sizeof choice->value, "%s", value ? value : "");
    choice->read_only = gp_widget_get_readonly(choice->widget, &read_only) == GP_OK && read_only;
    const int n = type == GP_WIDGET_TEXT ? 0 : gp_widget_count_choices(choice->widget);
    while (choice->n < n && choice->n < GPHOTO_MAX_CHOICES &&
           gp_widget_get_choice(choice->widget, choice->n, &choice->texts[choice->n]) == GP_OK)
        choice->n++;
    return true;
}

void gphoto_choice_free(gphoto_choice *choice)
{
    if (choice->widget)
        gp_widget_free(choice->widget);
    *choice = (gphoto_choice){0};
}

bool gphoto_read(gphoto_session *s, const char *name, char value[GPHOTO_TEXT])
{
    gphoto_choice choice;
    if (!gphoto_get(s, name, &choice))
        return false;
    memcpy(value, choice.value, GPHOTO_TEXT);
    gphoto_choice_free(&choice);
    return true;
}

void gphoto_read_serial(gphoto_session *s, char serial[GPHOTO_TEXT])
{
    char value[GPHOTO_TEXT] = "";
    gphoto_read(s, "serialnumber", value);
    const char *const digits = value + strspn(value, "0 ");
    snprintf(serial, GPHOTO_TEXT, "%s", strcmp(digits, "None") == 0 ? "" : digits);
}

int gphoto_set(gphoto_session *s, gphoto_choice *choice, const char *name, const char *value)
{
    int code = gp_widget_set_value(choice->widget, value);
    if (code == GP_OK)
        GPHOTO_CALL(s, code, gp_camera_set_single_config(s->camera, name, choice->widget, s->context));
    return code;
}

bool gphoto_is_alive(gphoto_session *s)
{
    CameraStorageInformation *stores = NULL;
    int n = 0, code;
    GPHOTO_CALL(s, code, gp_camera_get_storageinfo(s->camera, &stores, &n, s->context));
    free(stores);
    return code != GP_ERROR_IO && code != GP_ERROR_TIMEOUT && code != GP_ERROR_IO_USB_FIND &&
           !(code == GP_ERROR && strncmp(s->port, "ptpip:", 6) == 0);
}
