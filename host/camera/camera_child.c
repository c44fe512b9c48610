#include "host/camera/camera_child.h"

#include "core/log.h"
#include "core/progress.h"
#include "core/shipped.h"
#include "core/version.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

/* Loading a camera library takes tenths of a second, on a busy machine seconds. */
#define HELLO_S 20
/* Between two looks at `idle`; a lease is renewed several times a second. */
#define SLICE_MS 40

/* The helper beside this program, or where a package puts it; WEFT_HELPERS names another folder. */
static bool find_helper(const char *backend, char path[PATH_MAX])
{
    static const char *const places[] = {".", "../bin", "../libexec/weft", NULL};
    const char *const given = getenv("WEFT_HELPERS");
    char name[64];
    snprintf(name, sizeof name, "weft-camera-%s", backend);
    if (given)
        snprintf(path, PATH_MAX, "%.3900s/%s", given, name);
    else if (weft_shipped_find(name, places, path, NULL) != WEFT_OK)
        return false;
    return access(path, X_OK) == 0;
}

bool weft_camera_child_exists(const char *backend)
{
    char path[PATH_MAX];
    return find_helper(backend, path);
}

/* ---- beginning ---- */

/* Its end of the pair at a fixed number, nothing else of ours; its own process group, so that Ctrl-C at the
 * terminal reaches the program only, which then ends it in good order. */
static int spawn(const char *program, int socket, pid_t *pid)
{
    char level[8], parent[16];
    snprintf(level, sizeof level, "%d", (int)weft_log_get_level());
    /* PR_SET_PDEATHSIG acts when the thread that spawned ends: it is of use from the main thread only. */
    snprintf(parent, sizeof parent, "%d", gettid() == getpid() ? (int)getpid() : 0);
    char *const argv[] = {(char *)(uintptr_t)program, (char *)(uintptr_t) "--serve", level, parent, NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    int failed = posix_spawn_file_actions_init(&actions);
    if (failed)
        return failed;
    failed = posix_spawnattr_init(&attributes);
    if (failed) {
        posix_spawn_file_actions_destroy(&actions);
        return failed;
    }
    failed = posix_spawn_file_actions_adddup2(&actions, socket, WEFT_CAMERA_HELPER_FD);
    if (!failed)
        failed = posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    if (!failed) /* a library that prints must not spoil the results on stdout */
        failed = posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
    if (!failed)
        failed = posix_spawn_file_actions_addclosefrom_np(&actions, WEFT_CAMERA_HELPER_FD + 1);
    if (!failed)
        failed = posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK |
                                                           POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    if (!failed)
        failed = posix_spawn(pid, program, &actions, &attributes, argv, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return failed;
}

/* A descriptor that the helper's own numbers cannot run over while they are put in place. */
static int move_up(int fd)
{
    const int moved = fcntl(fd, F_DUPFD_CLOEXEC, WEFT_CAMERA_HELPER_FD + 1);
    close(fd);
    return moved;
}

static weft_err hear_hello(weft_camera_child *child, weft_error *err)
{
    weft_camera_message m = {.call = WEFT_CALL_HELLO};
    const weft_camera_wait wait = {.deadline_s = HELLO_S};
    WEFT_TRY(weft_camera_child_answer(child, &wait, &m, NULL, err));
    const weft_camera_hello *const h = &m.body.hello;
    if (h->version == WEFT_CAMERA_MESSAGE_VERSION && h->message_size == sizeof m &&
        strcmp(h->build, WEFT_VERSION) == 0 && strcmp(h->backend, child->backend) == 0)
        return WEFT_OK;
    weft_fail(err, WEFT_ERR_VERSION,
              "the camera helper weft-camera-%s is of another build (%s %s) than this program (%s): install "
              "both from one package",
              child->backend, h->backend, h->build, WEFT_VERSION);
    weft_camera_child_end(child, 0);
    return WEFT_ERR_VERSION;
}

weft_err weft_camera_child_start(weft_camera_child *child, const char *backend, weft_error *err)
{
    char program[PATH_MAX];
    int pair[2];
    *child = (weft_camera_child){.fd = -1};
    snprintf(child->backend, sizeof child->backend, "%s", backend);
    if (!find_helper(backend, program))
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "%s cameras: the helper weft-camera-%s is not installed beside this program",
                         backend, backend);
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "no socket for the helper weft-camera-%s", backend);
    const int theirs = move_up(pair[1]);
    const int failed = theirs < 0 ? errno : spawn(program, theirs, &child->pid);
    if (theirs >= 0)
        close(theirs);
    if (failed) {
        close(pair[0]);
        errno = failed;
        child->pid = 0;
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s cannot be started", program);
    }
    child->fd = pair[0];
    return hear_hello(child, err);
}

/* ---- ending ---- */

static void describe_end(weft_camera_child *child, int status)
{
    if (WIFSIGNALED(status))
        snprintf(child->end, sizeof child->end, "was killed by signal %d (%s)", WTERMSIG(status),
                 strsignal(WTERMSIG(status)));
    else
        snprintf(child->end, sizeof child->end, "ended with status %d", WEXITSTATUS(status));
}

/* Whether the process ends by itself within the time. */
static bool ends_within(pid_t pid, double patience_s)
{
    const int fd = pidfd_open(pid, 0);
    if (fd < 0)
        return false;
    struct pollfd end = {.fd = fd, .events = POLLIN};
    const bool ended = poll(&end, 1, (int)(1e3 * patience_s)) > 0;
    close(fd);
    return ended;
}

/* Afterwards there is neither process nor socket, and `end` tells how it ended. */
static void reap(weft_camera_child *child, double patience_s)
{
    int status = 0;
    pid_t ended = -1;
    if (child->fd >= 0)
        close(child->fd);
    child->fd = -1;
    if (!ends_within(child->pid, patience_s))
        kill(child->pid, SIGKILL);
    do
        ended = waitpid(child->pid, &status, 0);
    while (ended < 0 && errno == EINTR);
    if (ended == child->pid)
        describe_end(child, status);
    else
        snprintf(child->end, sizeof child->end, "is gone");
    child->pid = 0;
    child->answer_owed = false;
}

/* The other end has hung up: so the process ends, or has ended. */
static weft_err lost(weft_camera_child *child, const char *doing, weft_error *err)
{
    enum { CORE_DUMP_S = 5 };
    reap(child, CORE_DUMP_S);
    return weft_fail(err, WEFT_ERR_DEVICE, "the camera's helper process (weft-camera-%s) %s %s",
                     child->backend, child->end, doing);
}

void weft_camera_child_end(weft_camera_child *child, double patience_s)
{
    weft_camera_message m = {.call = WEFT_CALL_CLOSE, .number = child->number + 1};
    if (child->pid == 0)
        return;
    if (patience_s > 0 && !child->answer_owed && weft_camera_message_send(child->fd, &m, 0, -1)) {
        const weft_camera_wait wait = {.deadline_s = patience_s};
        child->number++;
        if (weft_camera_child_answer(child, &wait, &m, NULL, NULL) == WEFT_OK)
            reap(child, patience_s);
        if (strncmp(child->end, "ended with status 0", sizeof child->end) != 0)
            weft_warn("the camera helper weft-camera-%s %s when it was to end", child->backend, child->end);
    }
    if (child->pid != 0)
        reap(child, 0);
}

/* ---- talking ---- */

/* After a cancelled request the helper is let finish it, but not for long. */
static weft_err settle_debt(weft_camera_child *child, weft_error *err)
{
    static const double patience_s = 1.5;
    weft_camera_message m;
    int fd = -1;
    const double end_s = weft_clock_s() + patience_s;
    while (child->answer_owed && weft_clock_s() < end_s) {
        const weft_camera_receipt got = weft_camera_message_receive(child->fd, SLICE_MS, &m, &fd);
        if (fd >= 0)
            close(fd);
        if (got == WEFT_RECEIPT_GONE || got == WEFT_RECEIPT_GARBAGE)
            break;
        child->answer_owed = !(got == WEFT_RECEIPT_MESSAGE && m.call != WEFT_CALL_ARMED);
    }
    if (!child->answer_owed)
        return WEFT_OK;
    reap(child, 0);
    return weft_fail(err, WEFT_ERR_DEVICE,
                     "the camera's helper process (weft-camera-%s) did not let go of a cancelled frame and "
                     "was ended",
                     child->backend);
}

weft_err weft_camera_child_ask(weft_camera_child *child, weft_camera_message *message, size_t body_size,
                               weft_error *err)
{
    if (child->answer_owed)
        WEFT_TRY(settle_debt(child, err));
    message->number = ++child->number;
    child->stopped = false;
    if (weft_camera_message_send(child->fd, message, body_size, -1))
        return WEFT_OK;
    return lost(child, "between two frames", err);
}

/* `idle` has had enough. */
static void stop_waiting(weft_camera_child *child, bool polite)
{
    weft_camera_message m = {.call = WEFT_CALL_CANCEL, .number = child->number};
    if (polite && weft_camera_message_send(child->fd, &m, 0, -1))
        child->answer_owed = true;
    else
        reap(child, 0);
    child->stopped = true;
}

static weft_err refuse(weft_camera_child *child, const char *what, weft_error *err)
{
    reap(child, 0);
    snprintf(child->end, sizeof child->end, "%s and was ended", what); /* the signal was ours */
    return weft_fail(err, WEFT_ERR_DEVICE, "the camera's helper process (weft-camera-%s) %s", child->backend,
                     child->end);
}

/* An answer, or word that the camera is armed. */
static weft_err sort_out(weft_camera_child *child, const weft_camera_wait *wait, uint32_t wanted,
                         weft_camera_message *m, bool *answered, weft_error *err)
{
    if (m->call == WEFT_CALL_ARMED && m->number == child->number)
        return wait->fire ? wait->fire(wait->fire_context, err) : WEFT_OK;
    *answered = m->number == child->number && m->call == wanted;
    if (!*answered)
        return refuse(child, "answered something that was not asked", err);
    if (m->status == WEFT_OK)
        return WEFT_OK;
    const weft_err code = m->status <= WEFT_ERR_CANCELLED ? (weft_err)m->status : WEFT_ERR_PROTOCOL;
    return weft_fail(err, code, "%s", m->body.error.text);
}

weft_err weft_camera_child_answer(weft_camera_child *child, const weft_camera_wait *wait,
                                  weft_camera_message *message, int *fd, weft_error *err)
{
    const double start_s = weft_clock_s();
    const uint32_t wanted = message->call;
    bool answered = false;
    char doing[64];
    snprintf(doing, sizeof doing, "during %s", weft_camera_call_name(wanted));
    while (!answered) {
        int came = -1;
        const weft_camera_receipt got = weft_camera_message_receive(child->fd, SLICE_MS, message, &came);
        weft_err status = WEFT_OK;
        if (got == WEFT_RECEIPT_GONE)
            return lost(child, doing, err);
        if (got == WEFT_RECEIPT_GARBAGE)
            return refuse(child, "said something that is no message", err);
        if (got == WEFT_RECEIPT_MESSAGE)
            status = sort_out(child, wait, wanted, message, &answered, err);
        if (fd && answered && status == WEFT_OK)
            *fd = came;
        else if (came >= 0)
            close(came);
        if (answered || child->pid == 0)
            return status;
        if (status == WEFT_OK && wait->idle)
            status = wait->idle(wait->context, err);
        if (status != WEFT_OK) { /* fire or idle */
            stop_waiting(child, wait->polite);
            return status;
        }
        if (weft_clock_s() - start_s > wait->deadline_s)
            return refuse(child, "did not answer in time", err);
    }
    return WEFT_OK;
}
