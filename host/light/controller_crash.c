#include "host/light/controller_crash.h"

#include "firmware/protocol.h"

#include <signal.h>
#include <stdatomic.h>
#include <string.h>
#include <unistd.h>

/* SIGINT and SIGTERM are not here: they end work in an orderly way, see core/progress.h. */
static const int deadly[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT, SIGHUP};
enum { N_DEADLY = sizeof deadly / sizeof deadly[0] };

static struct sigaction before[N_DEADLY];
static atomic_int panic_fd = -1;
static bool installed;

static void on_deadly(int number, siginfo_t *info, void *context)
{
    static const unsigned char panic[WEFT_PANIC_ZEROS];
    const int fd = atomic_load(&panic_fd);
    (void)context;
    if (fd >= 0 && write(fd, panic, sizeof panic) < 0)
        (void)info; /* the end of the lease darkens them then */
    for (int i = 0; i < N_DEADLY; i++)
        if (deadly[i] == number)
            sigaction(number, &before[i], NULL);
    /* A fault comes again by itself when this returns, and keeps its place for a debugger. */
    if (info->si_code <= 0 || number == SIGABRT)
        raise(number);
}

void weft_controller_watch_crash(int fd)
{
    atomic_store(&panic_fd, fd);
    if (installed)
        return;
    installed = true;
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = on_deadly;
    action.sa_flags = SA_SIGINFO;
    sigfillset(&action.sa_mask);
    for (int i = 0; i < N_DEADLY; i++) {
        sigaction(deadly[i], NULL, &before[i]);
        if (before[i].sa_handler != SIG_IGN) /* under nohup, a SIGHUP is no death */
            sigaction(deadly[i], &action, NULL);
    }
}

bool weft_controller_forget_crash(int fd)
{
    return fd >= 0 && atomic_compare_exchange_strong(&panic_fd, &fd, -1);
}
