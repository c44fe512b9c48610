/* The simulated board in step with the wall clock, its serial line on a pty. */
#include "core/progress.h"
#include "host/rig/controller_sim_private.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

/* -- the host's side ------------------------------------------------------------------------------------ */

/* Bits per second that the host has set; 0 when it is none of these. */
static double host_rate(const weft_controller_sim *sim)
{
    static const struct {
        speed_t code;
        double rate;
    } rates[] = {{B9600, 9600},     {B19200, 19200},   {B38400, 38400},   {B57600, 57600},
                 {B115200, 115200}, {B230400, 230400}, {B500000, 500000}, {B1000000, 1000000}};
    struct termios t;
    if (tcgetattr(sim->master, &t) == 0)
        for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++)
            if (cfgetospeed(&t) == rates[i].code)
                return rates[i].rate;
    return 0;
}

/* The receiver bears 3.9 % (DS40002061B, table 19-3: eight bits, double speed). */
static bool understands(double sent_rate, double read_rate)
{
    return fabs(sent_rate / read_rate - 1) < 0.039;
}

/* A pty carries bytes whatever the rates are: here they matter.  @return bytes heard */
static size_t hear(const uint8_t *sent, size_t n, double sent_rate, double read_rate, uint8_t *heard,
                   size_t room)
{
    if (sent_rate <= 0 || read_rate <= 0)
        return 0;
    if (!understands(sent_rate, read_rate))
        return weft_controller_sim_garble(sent, n, sent_rate, read_rate, heard, room);
    memcpy(heard, sent, n);
    return n;
}

static void open_line(weft_controller_sim *sim)
{
    sim->is_open = true; /* DTR falls, the board's reset capacitor bites */
    sim->opened++;
    weft_sim_line_clear(&sim->in);
    weft_sim_line_clear(&sim->out);
    weft_sim_press_reset(sim);
}

enum { MOST_GARBAGE = 16 }; /* bytes that one byte can become, from 38 400 to 500 000 bits/s and back */

static void read_host(weft_controller_sim *sim)
{
    uint8_t sent[256], heard[sizeof sent * MOST_GARBAGE];
    const ssize_t n = read(sim->master, sent, sizeof sent);
    if (n <= 0)
        return;
    const size_t m = hear(sent, (size_t)n, host_rate(sim), weft_sim_baud(sim), heard, sizeof heard);
    for (size_t i = 0; i < m; i++)
        weft_sim_line_put(&sim->in, heard[i], sim->avr->cycle);
    weft_sim_start_feeding(sim);
}

static void write_host(weft_controller_sim *sim)
{
    uint8_t sent[256], heard[sizeof sent * MOST_GARBAGE];
    for (;;) {
        size_t n = 0;
        while (n < sizeof sent && weft_sim_line_take(&sim->out, &sent[n], sim->avr->cycle))
            n++;
        if (n == 0)
            return;
        const size_t m = hear(sent, n, weft_sim_baud(sim), host_rate(sim), heard, sizeof heard);
        if (sim->is_open && write(sim->master, heard, m) < 0)
            return; /* a host that does not read loses bytes */
    }
}

/* Moves bytes between the pty and the line, and sees a host open and close it. */
static void serve_pty(weft_controller_sim *sim)
{
    struct pollfd state = {.fd = sim->master, .events = POLLIN};
    if (sim->master < 0)
        return;
    poll(&state, 1, 0);
    const bool nobody = (state.revents & POLLHUP) != 0, bytes = (state.revents & POLLIN) != 0;
    if (!sim->is_open && (!nobody || bytes))
        open_line(sim);
    if (bytes)
        read_host(sim);
    else if (nobody)
        sim->is_open = false;
    write_host(sim);
}

/* -- the clock ------------------------------------------------------------------------------------------ */

/* Waits for bytes of a host or a wish of another thread, at most half a millisecond. */
static void wait_a_little(int wake, int master)
{
    struct pollfd fds[] = {{.fd = wake, .events = POLLIN}, {.fd = master, .events = POLLIN}};
    const struct timespec half_a_millisecond = {.tv_nsec = 500000};
    ppoll(fds, 2, &half_a_millisecond, NULL);
}

enum { SLICE_CYCLES = WEFT_SIM_CLOCK_HZ / 1000, MOST_BEHIND_CYCLES = WEFT_SIM_CLOCK_HZ / 20 };

/* Simulated time follows the wall clock; when the machine is too busy for that, it falls behind for good
 * rather than hurry after it. */
static void *run_paced(void *context)
{
    weft_controller_sim *const sim = context;
    const double origin_s = weft_clock_s();
    avr_cycle_count_t behind = 0;
    pthread_mutex_lock(&sim->mutex);
    while (!sim->stop && !sim->crashed) {
        serve_pty(sim);
        const avr_cycle_count_t now = (avr_cycle_count_t)((weft_clock_s() - origin_s) * WEFT_SIM_CLOCK_HZ);
        avr_cycle_count_t target = now - behind;
        if (target > sim->avr->cycle + MOST_BEHIND_CYCLES) {
            behind += target - sim->avr->cycle - MOST_BEHIND_CYCLES;
            target = sim->avr->cycle + MOST_BEHIND_CYCLES;
        }
        const bool late = target > sim->avr->cycle + SLICE_CYCLES;
        weft_sim_run_until(sim, late ? sim->avr->cycle + SLICE_CYCLES : target);
        serve_pty(sim);
        const int master = sim->is_open ? sim->master : -1; /* closed meanwhile: it waits for nothing */
        pthread_mutex_unlock(&sim->mutex);
        if (!late)
            wait_a_little(sim->wake, master);
        pthread_mutex_lock(&sim->mutex);
    }
    pthread_cond_broadcast(&sim->passed);
    pthread_mutex_unlock(&sim->mutex);
    return NULL;
}

static weft_err open_pty(weft_controller_sim *sim, char *pty_path, weft_error *err)
{
    int slave;
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    cfsetispeed(&raw, B9600); /* as every line of Linux begins */
    cfsetospeed(&raw, B9600);
    char name[128] = "";
    if (openpty(&sim->master, &slave, NULL, &raw, NULL) != 0) {
        sim->master = -1;
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "no pseudo terminal for the virtual controller");
    }
    const int failed = ptsname_r(sim->master, name, sizeof name);
    close(slave); /* from now on a hang-up says that no host has it open */
    if (failed || fcntl(sim->master, F_SETFL, O_NONBLOCK) != 0 ||
        fcntl(sim->master, F_SETFD, FD_CLOEXEC) != 0) {
        close(sim->master);
        sim->master = -1;
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "the virtual controller's pseudo terminal");
    }
    snprintf(pty_path, 128, "%s", name);
    return WEFT_OK;
}

/* -- unplugging ----------------------------------------------------------------------------------------- */

static void close_fd(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

/* The kernel gives the lowest free name: the old one is held until there is a new one. */
static void unplug(weft_controller_sim *sim)
{
    char name[128];
    if (sim->master < 0)
        return;
    if (ptsname_r(sim->master, name, sizeof name) == 0)
        sim->name_kept = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    close_fd(&sim->master);
    sim->is_open = false;
    weft_sim_line_clear(&sim->in);
    weft_sim_line_clear(&sim->out);
}

void weft_controller_sim_unplug(weft_controller_sim *sim, bool power)
{
    pthread_mutex_lock(&sim->mutex);
    unplug(sim);
    if (power)
        weft_sim_power_cycle(sim);
    pthread_mutex_unlock(&sim->mutex);
}

weft_err weft_controller_sim_plug_in(weft_controller_sim *sim, char *pty_path, weft_error *err)
{
    pthread_mutex_lock(&sim->mutex);
    unplug(sim);
    const weft_err status = open_pty(sim, pty_path, err);
    close_fd(&sim->name_kept);
    pthread_mutex_unlock(&sim->mutex);
    return status;
}

/* -- begin and end -------------------------------------------------------------------------------------- */

weft_err weft_controller_sim_create_with(const weft_controller_sim_program *program,
                                         weft_controller_sim **out, char *pty_path, weft_error *err)
{
    weft_controller_sim *sim;
    WEFT_TRY(weft_sim_make(program, &sim, err));
    weft_err status = open_pty(sim, pty_path, err);
    sim->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (status == WEFT_OK && sim->wake < 0)
        status = weft_fail_errno(err, WEFT_ERR_DEVICE, "the virtual controller's clock");
    if (status == WEFT_OK) {
        sim->paced = true;
        const int failed = pthread_create(&sim->thread, NULL, run_paced, sim);
        if (failed) {
            sim->paced = false;
            errno = failed;
            status = weft_fail_errno(err, WEFT_ERR_NOMEM, "no thread for the virtual controller");
        }
    }
    if (status == WEFT_OK)
        *out = sim;
    else
        weft_controller_sim_destroy(sim);
    return status;
}

weft_err weft_controller_sim_create(const char *elf_path, weft_controller_sim **sim, char *pty_path,
                                    weft_error *err)
{
    return weft_controller_sim_create_with(&(weft_controller_sim_program){.firmware = elf_path}, sim,
                                           pty_path, err);
}

static void wake_thread(const weft_controller_sim *sim)
{
    const uint64_t one = 1;
    if (sim->wake >= 0 && write(sim->wake, &one, sizeof one) < 0)
        assert(errno == EAGAIN);
}

void weft_sim_stop_pace(weft_controller_sim *sim)
{
    if (sim->paced) {
        pthread_mutex_lock(&sim->mutex);
        sim->stop = true;
        pthread_mutex_unlock(&sim->mutex);
        wake_thread(sim);
        pthread_join(sim->thread, NULL);
    }
    close_fd(&sim->master);
    close_fd(&sim->name_kept);
    close_fd(&sim->wake);
}
