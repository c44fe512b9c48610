/* GigE Vision and USB3 Vision cameras through Aravis: finding, opening and setting them. */
#include "host/camera/aravis_private.h"

#include "core/log.h"
#include "core/progress.h"

#include <arpa/inet.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* A camera whose client was killed stays owned for the heartbeat's 3 s. */
#define OWNED_PATIENCE_S 4.5

weft_err aravis_fail(const aravis_camera *a, GError *error, const char *doing, weft_error *err)
{
    const weft_err code = g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT)
                              ? WEFT_ERR_TIMEOUT
                              : WEFT_ERR_DEVICE;
    weft_fail(err, code, "camera %s: %s: %s; check its cable and power, then try again", a->address, doing,
              error ? error->message : "no reason was given");
    g_clear_error(&error);
    return code;
}

static void on_control_lost(ArvGvDevice *device, gpointer state)
{
    (void)device;
    atomic_store(&((aravis_camera *)state)->lost, true);
}

/* The address of the interface that the kernel would take to reach `camera`: a connected UDP socket knows. */
static GInetAddress *local_address_towards(const char *camera)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(3956)}, from = {0};
    socklen_t size = sizeof from;
    GInetAddress *found = NULL;
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && inet_pton(AF_INET, camera, &to.sin_addr) == 1 &&
        connect(fd, (const struct sockaddr *)&to, sizeof to) == 0 &&
        getsockname(fd, (struct sockaddr *)&from, &size) == 0)
        found = g_inet_address_new_from_bytes((const guint8 *)&from.sin_addr, G_SOCKET_FAMILY_IPV4);
    if (fd >= 0)
        close(fd);
    return found;
}

static weft_err open_device(aravis_camera *a, ArvDevice **device, weft_error *err)
{
    GError *error = NULL;
    GInetAddress *const camera = g_inet_address_new_from_string(a->address);
    if (camera && g_inet_address_get_family(camera) == G_SOCKET_FAMILY_IPV4) {
        /* By address, without discovery: a camera that answers on two interfaces is then bound to the one
         * that leads to it, and a second of waiting is saved. */
        GInetAddress *const local = local_address_towards(a->address);
        a->loopback = g_inet_address_get_is_loopback(camera);
        if (local)
            *device = arv_gv_device_new(local, camera, &error);
        if (local)
            g_object_unref(local);
    } else {
        arv_disable_interface("Fake");
        *device = arv_open_device(a->address, &error);
    }
    if (camera)
        g_object_unref(camera);
    if (*device)
        return WEFT_OK;
    weft_fail(
        err, WEFT_ERR_DEVICE,
        "camera %s: cannot be opened: %s; check its cable, power and address, and your permission to use "
        "it (weft devices lists what there is)",
        a->address, error ? error->message : "no network leads to it");
    g_clear_error(&error);
    return WEFT_ERR_DEVICE;
}

/* GigE Vision has one controller at a time; one that died is let go after its heartbeat. */
static weft_err take_control(const aravis_camera *a, double patience_s, weft_error *err)
{
    if (!ARV_IS_GV_DEVICE(a->device))
        return WEFT_OK;
    ArvGvDevice *const device = ARV_GV_DEVICE(a->device);
    const double start_s = weft_clock_s();
    while (!arv_gv_device_is_controller(device)) {
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "camera %s: cancelled while waiting for it",
                             a->address);
        if (weft_clock_s() - start_s > patience_s)
            return weft_fail(err, WEFT_ERR_DEVICE,
                             "camera %s: another program controls it; close that one (a viewer, a capture on "
                             "another computer) and try again",
                             a->address);
        if (!arv_gv_device_take_control(device, NULL))
            g_usleep(100000);
    }
    return WEFT_OK;
}

static void copy_text(char *to, size_t size, const char *text)
{
    snprintf(to, size, "%s", text && g_utf8_validate(text, -1, NULL) ? text : "");
}

static weft_err identify(aravis_camera *a, weft_error *err)
{
    weft_camera_state *const info = a->info;
    const char *text = NULL;
    ARAVIS_TRY(a, "asking its vendor", text = arv_camera_get_vendor_name(a->camera, &error));
    copy_text(info->vendor, sizeof info->vendor, text);
    ARAVIS_TRY(a, "asking its model", text = arv_camera_get_model_name(a->camera, &error));
    copy_text(info->model, sizeof info->model, text);
    text = arv_camera_get_device_serial_number(a->camera, NULL);
    copy_text(info->serial, sizeof info->serial, text); /* some have none */
    return WEFT_OK;
}

static weft_err set_format(aravis_camera *a, weft_error *err)
{
    guint n = 0;
    const char **names = NULL;
    ARAVIS_TRY(a, "asking its formats",
               names = arv_camera_dup_available_pixel_formats_as_strings(a->camera, &n, &error));
    const bool found = weft_raw_format_best(names, n, &a->format);
    char list[400] = "";
    for (guint i = 0; i < n && strlen(list) < 300; i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%.32s", i ? ", " : "", names[i]);
    }
    g_free(names);
    if (!found)
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: has no raw Bayer format (only %s); a colour camera with raw output is "
                         "needed",
                         a->address, list);
    ARAVIS_TRY(a, "setting the format",
               arv_camera_set_pixel_format_from_string(a->camera, a->format.name, &error));
    const char *got = NULL;
    ARAVIS_TRY(a, "reading back the format", got = arv_camera_get_pixel_format_as_string(a->camera, &error));
    ARAVIS_TRY(a, "reading back the format", a->code = arv_camera_get_pixel_format(a->camera, &error));
    if (!got || strcmp(got, a->format.name) != 0)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "camera %s: stays at format %s when told %s", a->address,
                         got ? got : "?", a->format.name);
    return WEFT_OK;
}

/* @param wanted  width 0: the whole sensor */
static weft_err set_region(aravis_camera *a, const weft_camera_region *wanted, weft_error *err)
{
    gint x, y, width, height, got_width, got_height, least;
    if (arv_camera_is_binning_available(a->camera, NULL))
        ARAVIS_TRY(a, "switching off binning", arv_camera_set_binning(a->camera, 1, 1, &error));
    if (arv_camera_is_region_offset_available(a->camera, NULL)) { /* the bounds depend on the offsets */
        ARAVIS_TRY(a, "asking the region", arv_camera_get_region(a->camera, &x, &y, &width, &height, &error));
        ARAVIS_TRY(a, "setting the region", arv_camera_set_region(a->camera, 0, 0, width, height, &error));
    }
    ARAVIS_TRY(a, "asking the width", arv_camera_get_width_bounds(a->camera, &least, &width, &error));
    ARAVIS_TRY(a, "asking the height", arv_camera_get_height_bounds(a->camera, &least, &height, &error));
    if (width < 2 || height < 2 || width > WEFT_IMAGE_MAX_SIDE || height > WEFT_IMAGE_MAX_SIDE)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "camera %s: says its frames can be %d x %d", a->address,
                         width, height);
    weft_camera_region r = {.width = width, .height = height};
    if (wanted->width > 0)
        r = *wanted;
    if (r.x < 0 || r.y < 0 || r.width < 2 || r.height < 2 || r.width > width - r.x ||
        r.height > height - r.y || ((r.x | r.y | r.width | r.height) & 1 && wanted->width > 0))
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "camera %s: a region of %d x %d at %d, %d is not possible: even numbers inside %d x %d",
            a->address, r.width, r.height, r.x, r.y, width, height);
    ARAVIS_TRY(a, "setting the region",
               arv_camera_set_region(a->camera, r.x, r.y, r.width, r.height, &error));
    ARAVIS_TRY(a, "reading back the region",
               arv_camera_get_region(a->camera, &x, &y, &got_width, &got_height, &error));
    if (x != r.x || y != r.y || got_width != r.width || got_height != r.height)
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "camera %s: makes a region of %d x %d at %d, %d when told %d x %d at %d, %d; ask for "
            "what it makes",
            a->address, got_width, got_height, x, y, r.width, r.height, r.x, r.y);
    a->info->width = r.width;
    a->info->height = r.height;
    a->region = *wanted;
    return WEFT_OK;
}

/* Whatever the last client left behind that would change the numbers: all off. */
static weft_err switch_off_automatics(const aravis_camera *a, weft_error *err)
{
    if (arv_camera_is_exposure_auto_available(a->camera, NULL))
        ARAVIS_TRY(a, "switching off automatic exposure",
                   arv_camera_set_exposure_time_auto(a->camera, ARV_AUTO_OFF, &error));
    if (arv_camera_is_gain_auto_available(a->camera, NULL))
        ARAVIS_TRY(a, "switching off automatic gain",
                   arv_camera_set_gain_auto(a->camera, ARV_AUTO_OFF, &error));
    if (arv_camera_is_black_level_auto_available(a->camera, NULL))
        ARAVIS_TRY(a, "switching off the automatic black level",
                   arv_camera_set_black_level_auto(a->camera, ARV_AUTO_OFF, &error));
    if (arv_camera_is_feature_available(a->camera, "BalanceWhiteAuto", NULL))
        ARAVIS_TRY(a, "switching off automatic white balance",
                   arv_camera_set_string(a->camera, "BalanceWhiteAuto", "Off", &error));
    if (arv_camera_is_feature_available(a->camera, "GammaEnable", NULL))
        ARAVIS_TRY(a, "switching off gamma", arv_camera_set_boolean(a->camera, "GammaEnable", FALSE, &error));
    return WEFT_OK;
}

weft_err aravis_set_trigger_source(aravis_camera *a, const char *source, weft_error *err)
{
    const char *got = NULL;
    ARAVIS_TRY(a, "setting the trigger's source", arv_camera_set_trigger_source(a->camera, source, &error));
    ARAVIS_TRY(a, "reading back the trigger", got = arv_camera_get_trigger_source(a->camera, &error));
    if (!got || strcmp(got, source) != 0)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "camera %s: stays at trigger source %s when told %s",
                         a->address, got ? got : "?", source);
    return WEFT_OK;
}

/* The input line of the trigger: the one that was wished for, or the first that the camera has. */
static weft_err find_wire(aravis_camera *a, weft_error *err)
{
    guint n = 0;
    const char **names = NULL;
    char list[200] = "";
    ARAVIS_TRY(a, "asking the trigger's sources",
               names = arv_camera_dup_available_trigger_sources(a->camera, &n, &error));
    a->wire_source[0] = '\0';
    for (guint i = 0; i < n; i++) {
        const char *const wanted = a->wishes.line;
        const bool fits = wanted[0] ? strcmp(names[i], wanted) == 0 : strncmp(names[i], "Line", 4) == 0;
        if (fits && !a->wire_source[0])
            copy_text(a->wire_source, sizeof a->wire_source, names[i]);
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%.32s", i ? ", " : "", names[i]);
    }
    g_free(names);
    if (!a->wire_source[0])
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "camera %s: has no trigger input %s (its sources: %s); name one with "
                         "aravis:%s,line=NAME",
                         a->address, a->wishes.line[0] ? a->wishes.line : "Line...", list, a->address);
    return WEFT_OK;
}

static weft_err set_trigger(aravis_camera *a, weft_camera_trigger wanted, weft_error *err)
{
    if (wanted == a->trigger)
        return WEFT_OK;
    if (wanted == WEFT_TRIGGER_WIRE)
        WEFT_TRY(find_wire(a, err));
    WEFT_TRY(aravis_set_trigger_source(a, wanted == WEFT_TRIGGER_WIRE ? a->wire_source : "Software", err));
    a->trigger = wanted;
    return WEFT_OK;
}

static weft_err set_software_trigger(aravis_camera *a, weft_error *err)
{
    if (!arv_camera_is_software_trigger_supported(a->camera, NULL))
        return weft_fail(err, WEFT_ERR_UNSUPPORTED, "camera %s: has no software trigger", a->address);
    ARAVIS_TRY(a, "setting continuous acquisition",
               arv_camera_set_acquisition_mode(a->camera, ARV_ACQUISITION_MODE_CONTINUOUS, &error));
    ARAVIS_TRY(a, "setting the software trigger", arv_camera_set_trigger(a->camera, "Software", &error));
    return aravis_set_trigger_source(a, "Software", err);
}

static weft_err learn_ranges(aravis_camera *a, weft_error *err)
{
    const weft_camera_quirk *const quirk = weft_camera_find_quirk(a->info->vendor, a->info->model);
    double min_us = 0, max_us = 0;
    ARAVIS_TRY(a, "asking the range of exposures",
               arv_camera_get_exposure_time_bounds(a->camera, &min_us, &max_us, &error));
    a->exposure_min_s = 1e-6 * min_us;
    a->exposure_max_s = 1e-6 * max_us;
    a->info->bits = a->format.bits;
    a->info->cfa = a->format.cfa;
    a->info->white = quirk && quirk->white > 0 ? quirk->white : exp2(a->format.bits) - 1;
    for (int i = 0; i < 4; i++)
        a->info->black[i] = quirk ? quirk->black : 0;
    a->has_gain = arv_camera_is_gain_available(a->camera, NULL);
    a->gain_scale = quirk                                       ? quirk->gain
                    : arv_device_get_feature(a->device, "Gain") ? WEFT_GAIN_DB
                                                                : WEFT_GAIN_FIXED;
    a->gain_unit = quirk && quirk->gain_unit > 0 ? quirk->gain_unit : 1;
    return WEFT_OK;
}

weft_err aravis_set_exposure(const aravis_camera *a, double exposure_s, double *achieved_s, weft_error *err)
{
    double us = 0;
    ARAVIS_TRY(a, "setting the exposure", arv_camera_set_exposure_time(a->camera, 1e6 * exposure_s, &error));
    ARAVIS_TRY(a, "reading back the exposure", us = arv_camera_get_exposure_time(a->camera, &error));
    if (us <= 0)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "camera %s: says its exposure is %g us", a->address, us);
    *achieved_s = us / 1e6; /* 56000 us are 0.056 s to the last digit */
    return WEFT_OK;
}

static double gain_to_device(const aravis_camera *a, double gain)
{
    return a->gain_scale == WEFT_GAIN_DB ? 20 * log10(gain) : gain * a->gain_unit;
}

static double gain_from_device(const aravis_camera *a, double value)
{
    return a->gain_scale == WEFT_GAIN_DB ? pow(10, value / 20) : value / a->gain_unit;
}

/* @param gain  0: the least there is */
static weft_err set_gain(const aravis_camera *a, double gain, double *achieved, weft_error *err)
{
    double min = 0, max = 0, value = 0;
    *achieved = 1;
    if (a->gain_scale == WEFT_GAIN_FIXED || !a->has_gain) {
        if (gain > 0 && gain != 1)
            return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                             "camera %s: the meaning of its gain is not known; leave it at 1", a->address);
        if (!a->has_gain)
            return WEFT_OK;
    }
    ARAVIS_TRY(a, "asking the range of gains", arv_camera_get_gain_bounds(a->camera, &min, &max, &error));
    if (a->gain_scale == WEFT_GAIN_FIXED) {
        ARAVIS_TRY(a, "setting the gain", arv_camera_set_gain(a->camera, min, &error));
        return WEFT_OK;
    }
    const double base = a->gain_scale == WEFT_GAIN_DB ? 0 : a->gain_unit; /* gain 1 */
    const double wanted = gain > 0 ? gain_to_device(a, gain) : fmin(fmax(base, min), max);
    if (wanted < min - 1e-6 || wanted > max + 1e-6)
        return weft_fail(err, WEFT_ERR_RANGE, "camera %s: gain %g is not possible, only %.4g to %.4g",
                         a->address, gain, gain_from_device(a, min), gain_from_device(a, max));
    ARAVIS_TRY(a, "setting the gain", arv_camera_set_gain(a->camera, wanted, &error));
    ARAVIS_TRY(a, "reading back the gain", value = arv_camera_get_gain(a->camera, &error));
    *achieved = gain_from_device(a, value);
    return WEFT_OK;
}

static weft_err aravis_configure(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                                 weft_error *err)
{
    aravis_camera *const a = state;
    const double exposure_s = wanted->exposure_s > 0 ? wanted->exposure_s : a->set.exposure_s;
    weft_camera_settings got = *wanted;
    if (exposure_s < 0.999 * a->exposure_min_s || exposure_s > 1.001 * a->exposure_max_s)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "camera %s: an exposure of %g s is not possible, only %g to %g s", a->address,
                         exposure_s, a->exposure_min_s, a->exposure_max_s);
    if (memcmp(&wanted->region, &a->region, sizeof a->region) != 0) {
        aravis_stop(a); /* the size of its frames changes */
        WEFT_TRY(set_region(a, &wanted->region, err));
    }
    WEFT_TRY(set_trigger(a, wanted->trigger, err));
    WEFT_TRY(set_gain(a, wanted->gain, &got.gain, err));
    WEFT_TRY(aravis_set_exposure(a, exposure_s, &got.exposure_s, err));
    a->set = got;
    info->exposure_s = got.exposure_s;
    info->gain = got.gain;
    return WEFT_OK;
}

static weft_err open_patiently(aravis_camera *a, const char *address, double patience_s,
                               weft_camera_state *info, weft_error *err)
{
    ArvDevice *device = NULL;
    GError *error = NULL;
    const size_t n = strcspn(address, ",");
    snprintf(a->address, sizeof a->address, "%.*s", (int)n, address);
    WEFT_TRY(aravis_read_wishes(address + n, &a->wishes, err));
    a->info = info;
    WEFT_TRY(open_device(a, &device, err));
    a->camera = arv_camera_new_with_device(device, &error);
    g_object_unref(device); /* the camera holds it */
    if (!a->camera)
        return aravis_fail(a, error, "opening it", err);
    a->device = arv_camera_get_device(a->camera);
    if (ARV_IS_GV_DEVICE(a->device))
        g_signal_connect(a->device, "control-lost", G_CALLBACK(on_control_lost), a);
    WEFT_TRY(take_control(a, patience_s, err));
    return identify(a, err);
}

static weft_err aravis_open(void *state, const char *address, weft_camera_state *info, weft_error *err)
{
    aravis_camera *const a = state;
    WEFT_TRY(open_patiently(a, address, OWNED_PATIENCE_S, info, err));
    arv_camera_stop_acquisition(a->camera, NULL); /* a killed client may have left it streaming */
    WEFT_TRY(set_format(a, err));
    WEFT_TRY(set_region(a, &(weft_camera_region){0}, err));
    WEFT_TRY(switch_off_automatics(a, err));
    WEFT_TRY(set_software_trigger(a, err));
    WEFT_TRY(learn_ranges(a, err));
    const double default_s = fmin(fmax(0.02, a->exposure_min_s), a->exposure_max_s);
    WEFT_TRY(aravis_configure(a, &(weft_camera_settings){.exposure_s = default_s}, info, err));
    weft_explain("camera %s: %s %s, %d x %d %s", a->address, info->vendor, info->model, info->width,
                 info->height, a->format.name);
    return WEFT_OK;
}

static gpointer let_go(gpointer camera)
{
    g_object_unref(camera);
    return NULL;
}

static void aravis_close(void *state)
{
    aravis_camera *const a = state;
    if (a->camera)
        g_signal_handlers_disconnect_by_data(a->device, a);
    if (a->camera && atomic_load(&a->lost)) {
        /* Aravis takes 8 s to say goodbye to a camera that does not answer: nobody need wait for that. */
        if (a->stream)
            g_object_set_data_full(G_OBJECT(a->camera), "weft-stream", g_steal_pointer(&a->stream),
                                   g_object_unref);
        g_thread_unref(g_thread_new("weft-let-go", let_go, g_steal_pointer(&a->camera)));
    } else {
        aravis_stop(a);
        g_clear_object(&a->camera);
    }
}

static weft_err aravis_list(weft_camera_found *found, int max, int *n, weft_error *err)
{
    (void)err;
    arv_disable_interface("Fake");
    arv_update_device_list();
    const int count = (int)arv_get_n_devices();
    int here = 0;
    for (int i = 0; i < count && here < max; i++, here++) {
        const char *const protocol = arv_get_device_protocol((guint)i);
        const bool gige = protocol && strcmp(protocol, "GigEVision") == 0;
        const char *const address = gige ? arv_get_device_address((guint)i) : arv_get_device_id((guint)i);
        weft_camera_found *const f = &found[here];
        *f = (weft_camera_found){0};
        snprintf(f->id, sizeof f->id, "aravis:%.100s", address ? address : "");
        copy_text(f->vendor, sizeof f->vendor, arv_get_device_vendor((guint)i));
        copy_text(f->model, sizeof f->model, arv_get_device_model((guint)i));
        copy_text(f->serial, sizeof f->serial, arv_get_device_serial_nbr((guint)i));
        aravis_camera probe = {0};
        weft_camera_state info = {0};
        weft_error problem = {0};
        if (open_patiently(&probe, f->id + strlen("aravis:"), 0, &info, &problem) != WEFT_OK)
            snprintf(f->problem, sizeof f->problem, "%.255s", problem.text);
        aravis_close(&probe);
    }
    *n = here;
    return WEFT_OK;
}

const weft_camera_backend weft_camera_aravis = {
    .name = "aravis",
    .summary = "GigE Vision and USB3 Vision cameras (Aravis)",
    .state_size = sizeof(aravis_camera),
    .list = aravis_list,
    .open = aravis_open,
    .configure = aravis_configure,
    .expose = aravis_expose,
    .close = aravis_close,
};
