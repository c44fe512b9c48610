/*
 * A raw sensor under libcamera's UVC pipeline, for machines without one: loaded by LD_PRELOAD in a program
 * that runs under umockdev with v4l2_sensor.umockdev.  It answers the ioctls of /dev/media0 and /dev/video0.
 *
 * WEFT_SENSOR_RIG names the control socket of a virtual scanner, from which each frame comes ("frame FILE
 * EXPOSURE"): what the table looks like under the lamps that are on.  Without it frames are drawn.
 * WEFT_SENSOR_SIZE is WIDTHxHEIGHT.  WEFT_SENSOR_FAULT names a file that is looked into for each frame and
 * emptied: "error" (a damaged frame), "gap" (three frames are skipped), "dqbuf" (an I/O error), "unplug".
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/media.h>
#include <linux/videodev2.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))

enum { N_BUFFERS = 8, VIDEO_MAJOR = 81, MEDIA_MAJOR = 240 };

static struct sensor {
    pthread_mutex_t mutex;
    pthread_cond_t wake;
    int media_fd, video_fd; /* an eventfd that counts the frames that are ready */
    int width, height;
    int32_t exposure_100us, automatic;
    int n_buffers, memory[N_BUFFERS]; /* memfds that stand for DMA buffers */
    struct {
        int fd, index;
    } queued[N_BUFFERS];
    int n_queued;
    struct {
        int index;
        uint32_t sequence, flags;
        double time_s;
    } ready[N_BUFFERS];
    int n_ready;
    uint32_t sequence;
    bool streaming, running, io_error, gone;
    pthread_t thread;
} sensor = {.mutex = PTHREAD_MUTEX_INITIALIZER,
            .wake = PTHREAD_COND_INITIALIZER,
            .media_fd = -1,
            .video_fd = -1,
            .exposure_100us = 200,
            .automatic = 3};

typedef int open_fn(const char *path, int flags, ...);

/* ---- where frames come from ---- */

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static size_t frame_bytes(void)
{
    return (size_t)2 * (size_t)sensor.width * (size_t)sensor.height;
}

static bool ask_rig(int to, double exposure_s)
{
    struct sockaddr_un at = {.sun_family = AF_UNIX};
    char line[160], reply[400] = "";
    const char *const path = getenv("WEFT_SENSOR_RIG");
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(at.sun_path, sizeof at.sun_path, "%s", path);
    const int n = snprintf(line, sizeof line, "frame /proc/%d/fd/%d %.6f\n", (int)getpid(), to, exposure_s);
    const bool there = fd >= 0 && connect(fd, (const struct sockaddr *)&at, sizeof at) == 0 &&
                       write(fd, line, (size_t)n) == n && read(fd, reply, sizeof reply - 1) > 0 &&
                       strstr(reply, "\"ok\":true");
    if (fd >= 0)
        close(fd);
    return there;
}

/* The scene's 14 bits (white 15871) to the 16 that are announced: white is white, the offset grows along. */
static void stretch(int to)
{
    uint16_t *const s = mmap(NULL, frame_bytes(), PROT_READ | PROT_WRITE, MAP_SHARED, to, 0);
    if (s == MAP_FAILED)
        abort();
    for (int i = 0; i < sensor.width * sensor.height; i++)
        s[i] = (uint16_t)(s[i] >= 15871 ? 65535 : (s[i] * 65535u + 7935) / 15871);
    munmap(s, frame_bytes());
}

static void draw(int to, uint32_t sequence)
{
    const int n = sensor.width * sensor.height;
    uint16_t *const s = malloc(frame_bytes());
    for (int i = 0; s && i < n; i++)
        s[i] = (uint16_t)((uint32_t)i * 7u + sequence * 13u + (uint32_t)sensor.exposure_100us);
    if (s && pwrite(to, s, frame_bytes(), 0) < 0)
        abort();
    free(s);
}

/* What the file says; it is emptied, but for "unplug", which lasts until somebody else does. */
static void read_fault(char word[32])
{
    const char *const path = getenv("WEFT_SENSOR_FAULT");
    const int fd = path ? ((open_fn *)dlsym(RTLD_NEXT, "open"))(path, O_RDWR | O_CLOEXEC) : -1;
    const ssize_t n = fd >= 0 ? read(fd, word, 31) : 0;
    word[n > 0 ? n : 0] = '\0';
    if (n > 0 && strncmp(word, "unplug", 6) != 0 && ftruncate(fd, 0) != 0)
        abort();
    if (fd >= 0)
        close(fd);
}

static void take_fault(uint32_t *flags)
{
    char word[32];
    read_fault(word);
    if (strncmp(word, "error", 5) == 0)
        *flags |= V4L2_BUF_FLAG_ERROR;
    sensor.sequence += strncmp(word, "gap", 3) == 0 ? 3 : 0;
    sensor.io_error |= strncmp(word, "dqbuf", 5) == 0;
    sensor.gone |= strncmp(word, "unplug", 6) == 0;
}

static void expose(int to, int index)
{
    const double exposure_s = 1e-4 * sensor.exposure_100us, begin_s = now_s();
    uint32_t flags = 0;
    pthread_mutex_unlock(&sensor.mutex);
    if (getenv("WEFT_SENSOR_RIG")) {
        if (ask_rig(to, exposure_s))
            stretch(to);
        else
            flags |= V4L2_BUF_FLAG_ERROR;
    } else {
        const struct timespec t = {(time_t)exposure_s,
                                   (long)(1e9 * (exposure_s - (double)(time_t)exposure_s))};
        nanosleep(&t, NULL);
        draw(to, sensor.sequence);
    }
    pthread_mutex_lock(&sensor.mutex);
    take_fault(&flags);
    const uint64_t one = 1;
    if (sensor.streaming && sensor.n_ready < N_BUFFERS) {
        sensor.ready[sensor.n_ready].index = index;
        sensor.ready[sensor.n_ready].sequence = sensor.sequence;
        sensor.ready[sensor.n_ready].flags = flags;
        sensor.ready[sensor.n_ready++].time_s = begin_s;
        if (write(sensor.video_fd, &one, sizeof one) < 0)
            abort();
    }
    sensor.sequence++;
}

static void *run(void *unused)
{
    pthread_mutex_lock(&sensor.mutex);
    while (sensor.streaming) {
        if (sensor.n_queued == 0) {
            pthread_cond_wait(&sensor.wake, &sensor.mutex);
            continue;
        }
        const int fd = sensor.queued[0].fd, index = sensor.queued[0].index;
        memmove(sensor.queued, sensor.queued + 1, (size_t)--sensor.n_queued * sizeof sensor.queued[0]);
        expose(fd, index);
    }
    pthread_mutex_unlock(&sensor.mutex);
    return unused;
}

/* ---- the devices ---- */

static int refuse(int reason)
{
    errno = reason;
    return -1;
}

static int media_ioctl(unsigned long request, void *argument)
{
    if (request == MEDIA_IOC_DEVICE_INFO) {
        struct media_device_info *const i = argument;
        memset(i, 0, sizeof *i);
        snprintf(i->driver, sizeof i->driver, "uvcvideo");
        snprintf(i->model, sizeof i->model, "Weft test sensor");
        snprintf(i->serial, sizeof i->serial, "VS1");
        snprintf(i->bus_info, sizeof i->bus_info, "usb-0000:00:14.0-2");
        i->media_version = i->driver_version = 6 << 16;
        return 0;
    }
    if (request != MEDIA_IOC_G_TOPOLOGY)
        return refuse(EINVAL);
    struct media_v2_topology *const t = argument;
    t->topology_version = 1;
    t->num_entities = t->num_interfaces = t->num_links = 1;
    t->num_pads = 0;
    struct media_v2_entity *const e = (void *)(uintptr_t)t->ptr_entities;
    struct media_v2_interface *const i = (void *)(uintptr_t)t->ptr_interfaces;
    struct media_v2_link *const l = (void *)(uintptr_t)t->ptr_links;
    if (e) {
        memset(e, 0, sizeof *e);
        e->id = 1;
        snprintf(e->name, sizeof e->name, "Weft test sensor");
        e->function = MEDIA_ENT_F_IO_V4L;
        e->flags = MEDIA_ENT_FL_DEFAULT;
    }
    if (i) {
        memset(i, 0, sizeof *i);
        i->id = 2;
        i->intf_type = MEDIA_INTF_T_V4L_VIDEO;
        i->devnode.major = VIDEO_MAJOR;
    }
    if (l) {
        memset(l, 0, sizeof *l);
        l->id = 3;
        l->source_id = 2;
        l->sink_id = 1;
        l->flags = MEDIA_LNK_FL_INTERFACE_LINK | MEDIA_LNK_FL_ENABLED | MEDIA_LNK_FL_IMMUTABLE;
    }
    return 0;
}

static int set_format(struct v4l2_format *f)
{
    if (f->type != V4L2_BUF_TYPE_VIDEO_CAPTURE)
        return refuse(EINVAL);
    memset(&f->fmt.pix, 0, sizeof f->fmt.pix);
    f->fmt.pix.width = (uint32_t)sensor.width;
    f->fmt.pix.height = (uint32_t)sensor.height;
    f->fmt.pix.pixelformat = V4L2_PIX_FMT_SRGGB16;
    f->fmt.pix.field = V4L2_FIELD_NONE;
    f->fmt.pix.bytesperline = 2 * (uint32_t)sensor.width;
    f->fmt.pix.sizeimage = (uint32_t)frame_bytes();
    f->fmt.pix.colorspace = V4L2_COLORSPACE_RAW;
    return 0;
}

static int query_control(struct v4l2_query_ext_ctrl *q)
{
    static const struct {
        uint32_t id, type;
        const char *name;
        int min, max, def;
    } rows[] = {
        {V4L2_CID_EXPOSURE_AUTO, V4L2_CTRL_TYPE_MENU, "Exposure, automatic", 0, 3, 3},
        {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, "Exposure", 1, 20000, 200},
    };
    const bool next = (q->id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0;
    const uint32_t id = q->id & ~(V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (next ? rows[i].id <= id : rows[i].id != id)
            continue;
        memset(q, 0, sizeof *q);
        q->id = rows[i].id;
        q->type = rows[i].type;
        snprintf(q->name, sizeof q->name, "%s", rows[i].name);
        q->minimum = rows[i].min;
        q->maximum = rows[i].max;
        q->default_value = rows[i].def;
        q->step = 1;
        q->elem_size = 4;
        q->elems = 1;
        return 0;
    }
    return refuse(EINVAL);
}

static int move_controls(struct v4l2_ext_controls *c, bool set)
{
    for (uint32_t i = 0; i < c->count; i++) {
        int32_t *const own = c->controls[i].id == V4L2_CID_EXPOSURE_ABSOLUTE ? &sensor.exposure_100us
                             : c->controls[i].id == V4L2_CID_EXPOSURE_AUTO   ? &sensor.automatic
                                                                             : NULL;
        if (!own) {
            c->error_idx = i;
            return refuse(EINVAL);
        }
        if (set)
            *own = c->controls[i].value;
        else
            c->controls[i].value = *own;
    }
    return 0;
}

static int request_buffers(struct v4l2_requestbuffers *r)
{
    for (int i = 0; i < sensor.n_buffers; i++)
        close(sensor.memory[i]);
    sensor.n_buffers = 0;
    r->count = r->count < N_BUFFERS ? r->count : N_BUFFERS;
    r->capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP | V4L2_BUF_CAP_SUPPORTS_DMABUF;
    for (uint32_t i = 0; i < r->count && r->memory == V4L2_MEMORY_MMAP; i++) {
        sensor.memory[i] = memfd_create("weft-sensor", MFD_CLOEXEC);
        if (ftruncate(sensor.memory[i], (off_t)frame_bytes()) != 0)
            return refuse(ENOMEM);
        sensor.n_buffers++;
    }
    return 0;
}

static int give_frame(struct v4l2_buffer *b)
{
    uint64_t count;
    if (sensor.n_ready == 0)
        return refuse(EAGAIN);
    if (read(sensor.video_fd, &count, sizeof count) < 0)
        return -1;
    if (sensor.io_error) { /* and the frame is lost */
        sensor.io_error = false;
        memmove(sensor.ready, sensor.ready + 1, (size_t)--sensor.n_ready * sizeof sensor.ready[0]);
        return refuse(EIO);
    }
    const uint32_t type = b->type, memory = b->memory;
    struct v4l2_plane *const planes = b->m.planes;
    memset(b, 0, sizeof *b);
    b->type = type;
    b->memory = memory;
    b->m.planes = planes;
    b->index = (uint32_t)sensor.ready[0].index;
    b->sequence = sensor.ready[0].sequence;
    b->flags = sensor.ready[0].flags | V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    b->bytesused = b->length = (uint32_t)frame_bytes();
    b->timestamp.tv_sec = (time_t)sensor.ready[0].time_s;
    b->timestamp.tv_usec = (suseconds_t)(1e6 * (sensor.ready[0].time_s - (double)b->timestamp.tv_sec));
    memmove(sensor.ready, sensor.ready + 1, (size_t)--sensor.n_ready * sizeof sensor.ready[0]);
    return 0;
}

static int stream(bool on)
{
    if (on == sensor.streaming)
        return 0;
    sensor.streaming = on;
    if (on)
        return pthread_create(&sensor.thread, NULL, run, NULL);
    pthread_cond_signal(&sensor.wake);
    pthread_mutex_unlock(&sensor.mutex);
    pthread_join(sensor.thread, NULL);
    pthread_mutex_lock(&sensor.mutex);
    uint64_t count;
    while (sensor.n_ready-- > 0)
        if (read(sensor.video_fd, &count, sizeof count) < 0)
            break;
    sensor.n_ready = sensor.n_queued = 0;
    sensor.sequence = 0;
    return 0;
}

static int video_ioctl(unsigned long request, void *argument)
{
    struct v4l2_capability *const capability = argument;
    struct v4l2_fmtdesc *const description = argument;
    struct v4l2_frmsizeenum *const size = argument;
    struct v4l2_buffer *const buffer = argument;
    struct v4l2_exportbuffer *const export = argument;
    struct v4l2_querymenu *const menu = argument;
    if (sensor.gone)
        return refuse(ENODEV);
    switch (request) {
    case VIDIOC_QUERYCAP:
        memset(capability, 0, sizeof *capability);
        snprintf((char *)capability->driver, sizeof capability->driver, "uvcvideo");
        snprintf((char *)capability->card, sizeof capability->card, "Weft test sensor");
        snprintf((char *)capability->bus_info, sizeof capability->bus_info, "usb-0000:00:14.0-2");
        capability->version = 6 << 16;
        capability->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        capability->capabilities = capability->device_caps | V4L2_CAP_DEVICE_CAPS;
        return 0;
    case VIDIOC_ENUM_FMT:
        if (description->index > 0)
            return refuse(EINVAL);
        description->pixelformat = V4L2_PIX_FMT_SRGGB16;
        return 0;
    case VIDIOC_ENUM_FRAMESIZES:
        if (size->index > 0)
            return refuse(EINVAL);
        size->type = V4L2_FRMSIZE_TYPE_DISCRETE;
        size->discrete.width = (uint32_t)sensor.width;
        size->discrete.height = (uint32_t)sensor.height;
        return 0;
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT:
        return set_format(argument);
    case VIDIOC_QUERY_EXT_CTRL:
        return query_control(argument);
    case VIDIOC_QUERYMENU:
        return menu->index == 1 || menu->index == 3 ? 0 : refuse(EINVAL);
    case VIDIOC_G_EXT_CTRLS:
        return move_controls(argument, false);
    case VIDIOC_S_EXT_CTRLS:
        return move_controls(argument, true);
    case VIDIOC_REQBUFS:
        return request_buffers(argument);
    case VIDIOC_QUERYBUF:
        buffer->length = (uint32_t)frame_bytes();
        return 0;
    case VIDIOC_EXPBUF:
        export->fd = fcntl(sensor.memory[export->index], F_DUPFD_CLOEXEC, 0);
        return export->fd < 0 ? -1 : 0;
    case VIDIOC_QBUF:
        if (sensor.n_queued == N_BUFFERS)
            return refuse(EBUSY);
        sensor.queued[sensor.n_queued].fd = buffer->m.fd;
        sensor.queued[sensor.n_queued++].index = (int)buffer->index;
        pthread_cond_signal(&sensor.wake);
        return 0;
    case VIDIOC_DQBUF:
        return give_frame(buffer);
    case VIDIOC_STREAMON:
        return stream(true);
    case VIDIOC_STREAMOFF:
        return stream(false);
    default:
        return refuse(EINVAL);
    }
}

/* ---- in place of the C library's ---- */

static void find_size(void)
{
    const char *const size = getenv("WEFT_SENSOR_SIZE");
    if (!size || sscanf(size, "%dx%d", &sensor.width, &sensor.height) != 2) {
        sensor.width = 308;
        sensor.height = 204;
    }
}

static int open_device(const char *path)
{
    char word[32] = "";
    if (strcmp(path, "/dev/media0") == 0)
        read_fault(word);
    if (strncmp(word, "unplug", 6) == 0)
        return refuse(ENODEV);
    if (strcmp(path, "/dev/media0") == 0)
        return sensor.media_fd = memfd_create("weft-media", MFD_CLOEXEC);
    if (strcmp(path, "/dev/video0") != 0)
        return -2;
    find_size();
    return sensor.video_fd = eventfd(0, EFD_SEMAPHORE | EFD_NONBLOCK | EFD_CLOEXEC);
}

static int open_or_pass(const char *name, const char *path, int flags, mode_t mode)
{
    const int fd = open_device(path);
    return fd != -2 ? fd : ((open_fn *)dlsym(RTLD_NEXT, name))(path, flags, mode);
}

#define OPEN(name)                                                                                           \
    EXPORT int name(const char *path, int flags, ...);                                                       \
    int name(const char *path, int flags, ...)                                                               \
    {                                                                                                        \
        va_list more;                                                                                        \
        va_start(more, flags);                                                                               \
        const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;                        \
        va_end(more);                                                                                        \
        return open_or_pass(#name, path, flags, mode);                                                       \
    }
OPEN(open)
OPEN(open64)

EXPORT long syscall(long number, ...);
long syscall(long number, ...)
{
    long a[6];
    va_list more;
    va_start(more, number);
    for (int i = 0; i < 6; i++)
        a[i] = va_arg(more, long);
    va_end(more);
    if (number == SYS_openat) {
        const int fd = open_device((const char *)a[1]);
        if (fd != -2)
            return fd;
    }
    return ((long (*)(long, ...))dlsym(RTLD_NEXT, "syscall"))(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}

EXPORT int ioctl(int fd, unsigned long request, ...);
int ioctl(int fd, unsigned long request, ...)
{
    va_list more;
    va_start(more, request);
    void *const argument = va_arg(more, void *);
    va_end(more);
    const bool media = fd >= 0 && fd == sensor.media_fd, video = fd >= 0 && fd == sensor.video_fd;
    if (!media && !video)
        return ((int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl"))(fd, request, argument);
    pthread_mutex_lock(&sensor.mutex);
    const int result = media ? media_ioctl(request, argument) : video_ioctl(request, argument);
    const int reason = errno;
    pthread_mutex_unlock(&sensor.mutex);
    errno = reason;
    return result;
}

/* umockdev does not fake udev's database, so no device would count as initialised. */
struct udev_enumerate;
struct udev_device;
EXPORT int udev_enumerate_add_match_is_initialized(struct udev_enumerate *e);
int udev_enumerate_add_match_is_initialized(struct udev_enumerate *e)
{
    (void)e;
    return 0;
}

EXPORT int udev_device_get_is_initialized(struct udev_device *d);
int udev_device_get_is_initialized(struct udev_device *d)
{
    (void)d;
    return 1;
}
