/* The simulated board in step with the wall clock, its serial line on a pty. */
#include "core/progress.h"
#include "host/rig/controller_sim_private.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

/* Moves bytes between the pty and the queues, and sees a host open and close it. */
static void serve_pty(weft_controller_sim *sim)
{
    struct pollfd state = {.fd = sim->master, .events = POLLIN};
    poll(&state, 1, 0);
    const bool nobody = (state.revents & POLLHUP) != 0, bytes = (state.revents & POLLIN) != 0;
    if (!sim->is_open && (!nobody || bytes)) { /* DTR falls, the board's reset capacitor bites */
        sim->is_open = true;
        sim->opened++;
        sim->in.head = sim->in.tail = sim->out.head = sim->out.tail = 0;
        weft_sim_press_reset(sim);
    }
    uint8_t buffer[1024];
    if (bytes) {
        const ssize_t n = read(sim->master, buffer, sizeof buffer);
        for (ssize_t i = 0; i < n; i++)
            weft_sim_queue_put(&sim->in, buffer[i]);
        weft_sim_start_feeding(sim);
    }
    if (nobody && !bytes)
        sim->is_open = false;
    for (;;) {
        size_t n = 0;
        while (n < sizeof buffer && weft_sim_queue_take(&sim->out, &buffer[n]))
            n++;
        if (n == 0)
            break;
        if (sim->is_open && write(sim->master, buffer, n) < 0)
            break; /* a host that does not read loses bytes */
    }
}

/* Waits for bytes of a host or a wish of another thread, at most half a millisecond. */
static void wait_a_little(const weft_controller_sim *sim, bool is_open)
{
    struct pollfd fds[] = {{.fd = sim->wake, .events = POLLIN},
                           {.fd = is_open ? sim->master : -1, .events = POLLIN}};
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
        const bool is_open = sim->is_open;
        pthread_mutex_unlock(&sim->mutex);
        if (!late)
            wait_a_little(sim, is_open);
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
    char name[128] = "";
    if (openpty(&sim->master, &slave, NULL, &raw, NULL) != 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "no pseudo terminal for the virtual controller");
    const int failed = ptsname_r(sim->master, name, sizeof name);
    close(slave); /* from now on a hang-up says that no host has it open */
    sim->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (failed || sim->wake < 0 || fcntl(sim->master, F_SETFL, O_NONBLOCK) != 0 ||
        fcntl(sim->master, F_SETFD, FD_CLOEXEC) != 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "the virtual controller's pseudo terminal");
    snprintf(pty_path, 128, "%s", name);
    return WEFT_OK;
}

weft_err weft_controller_sim_create_with(const weft_controller_sim_program *program,
                                         weft_controller_sim **out, char *pty_path, weft_error *err)
{
    weft_controller_sim *sim;
    WEFT_TRY(weft_sim_make(program, &sim, err));
    weft_err status = open_pty(sim, pty_path, err);
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
    if (sim->master >= 0)
        close(sim->master);
    if (sim->wake >= 0)
        close(sim->wake);
}
