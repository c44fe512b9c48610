#include "host/process/child.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/report_channel.h"
#include "core/text.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { MAX_LINE = 262144, REPORT_FD = 3, MAX_AT_ONCE = 16, MOST_LEFT = 32 };

/* A pipe from the child, cut into lines. */
typedef struct stream {
    const char *name;
    int fd; /* -1: closed */
    size_t used;
    bool cut;   /* the line is longer than MAX_LINE: its rest is thrown away */
    char *line; /* MAX_LINE + 1 */
    struct weft_child *child;
} stream;

struct weft_child {
    weft_loop *loop;
    weft_child_ears ears;
    pid_t pid;
    int64_t start_time;
    int pidfd, go, report; /* -1: closed */
    stream out, err;
};

/* Field 22 of /proc/PID/stat; 0 when there is no such process, or only its remains. */
static int64_t start_time_of(pid_t pid)
{
    char path[64], text[1024];
    snprintf(path, sizeof path, "/proc/%d/stat", (int)pid);
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    const ssize_t n = fd < 0 ? -1 : read(fd, text, sizeof text - 1);
    if (fd >= 0)
        close(fd);
    if (n <= 0)
        return 0;
    text[n] = '\0';
    const char *p = strrchr(text, ')'); /* the name may contain anything */
    if (p && p[1] == ' ' && p[2] == 'Z')
        return 0;
    for (int field = 2; p && field < 22; field++)
        p = strchr(p + 1, ' ');
    return p ? strtoll(p, NULL, 10) : 0;
}

/* ---- what it says ---- */

/* Bytes that are no UTF-8, and control characters, become '?': a terminal and a JSON text are behind this. */
static void clean(char *line, size_t n)
{
    if (n > 0 && line[n - 1] == '\r')
        line[--n] = '\0';
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)line[i] < 0x20 && line[i] != '\t')
            line[i] = '?';
    if (weft_text_is_utf8(line, n))
        return;
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)line[i] >= 0x80)
            line[i] = '?';
}

static void give_line(stream *s)
{
    s->line[s->used] = '\0';
    clean(s->line, s->used);
    s->child->ears.line(s->child->ears.context, s->name, s->line);
    s->used = 0;
    s->cut = false;
}

static void take_bytes(stream *s, const char *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (bytes[i] == '\n')
            give_line(s);
        else if (s->used < MAX_LINE)
            s->line[s->used++] = bytes[i];
        else
            s->cut = true;
    }
}

static void close_fd(weft_child *c, int *fd)
{
    if (*fd < 0)
        return;
    weft_loop_forget(c->loop, *fd);
    close(*fd);
    *fd = -1;
}

static void read_stream(void *context, uint32_t events)
{
    stream *const s = context;
    char bytes[8192];
    (void)events;
    for (int i = 0; i < MAX_AT_ONCE && s->fd >= 0; i++) { /* a flood waits for its turn */
        const ssize_t n = read(s->fd, bytes, sizeof bytes);
        if (n > 0)
            take_bytes(s, bytes, (size_t)n);
        else if (n == 0 || (errno != EAGAIN && errno != EINTR))
            close_fd(s->child, &s->fd);
        else
            return;
    }
}

/* The descriptor that came with a message; -1 when there is none. */
static int take_picture(struct msghdr *envelope)
{
    for (struct cmsghdr *h = CMSG_FIRSTHDR(envelope); h; h = CMSG_NXTHDR(envelope, h))
        if (h->cmsg_level == SOL_SOCKET && h->cmsg_type == SCM_RIGHTS &&
            h->cmsg_len == CMSG_LEN(sizeof(int))) {
            int fd;
            memcpy(&fd, CMSG_DATA(h), sizeof fd);
            return fd;
        }
    return -1;
}

static void read_report(void *context, uint32_t events)
{
    weft_child *const c = context;
    char text[WEFT_REPORT_MAX];
    (void)events;
    for (int i = 0; i < MAX_AT_ONCE && c->report >= 0; i++) {
        union {
            struct cmsghdr header;
            char bytes[CMSG_SPACE(sizeof(int))];
        } control;
        struct iovec data = {.iov_base = text, .iov_len = sizeof text};
        struct msghdr envelope = {.msg_iov = &data,
                                  .msg_iovlen = 1,
                                  .msg_control = control.bytes,
                                  .msg_controllen = sizeof control.bytes};
        const ssize_t n = recvmsg(c->report, &envelope, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
        if (n < 0 && (errno == EAGAIN || errno == EINTR))
            return;
        if (n <= 0) {
            close_fd(c, &c->report);
            return;
        }
        const int picture = take_picture(&envelope);
        json_t *const message = json_loadb(text, (size_t)n, 0, NULL);
        if (json_is_object(message))
            c->ears.report(c->ears.context, message, picture);
        else if (picture >= 0)
            close(picture);
        json_decref(message);
    }
}

/* The process has ended: hear the rest, end what it left behind, tell. */
static void on_exit_of_child(void *context, uint32_t events)
{
    weft_child *const c = context;
    int status = 0;
    (void)events;
    weft_child_kill(c); /* its children, if it has left any; its number is its own until waitpid() */
    if (waitpid(c->pid, &status, WNOHANG) != c->pid)
        return;
    c->pid = 0;
    for (int i = 0; i < MOST_LEFT && c->report >= 0; i++) /* a full socket holds some hundred messages */
        read_report(c, 0);
    stream *const streams[] = {&c->out, &c->err};
    for (int i = 0; i < 2; i++) {
        read_stream(streams[i], 0);
        if (streams[i]->used > 0)
            give_line(streams[i]);
        close_fd(c, &streams[i]->fd);
    }
    close_fd(c, &c->report);
    close_fd(c, &c->pidfd);
    c->ears.end(c->ears.context, status);
}

/* ---- starting ---- */

/* In the child.  Only async-signal-safe calls, though the daemon has one thread. */
_Noreturn static void become(const char *program, char *const *words, pid_t parent, int nice_by,
                             const int fds[4])
{
    static const int to[] = {STDOUT_FILENO, STDERR_FILENO, REPORT_FD};
    char byte;
    sigset_t none;
    static const int handled[] = {SIGTERM, SIGINT, SIGHUP, SIGPIPE}; /* by the daemon, not by a job */
    for (int i = 0; i < 4; i++)
        signal(handled[i], SIG_DFL);
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) /* it died before that */
        _exit(1);
    const int null = open("/dev/null", O_RDONLY);
    if (null < 0 || dup2(null, STDIN_FILENO) < 0)
        _exit(127);
    int moved[4];
    for (int i = 0; i < 4; i++) /* out of the way of 1, 2, 3 */
        if ((moved[i] = fcntl(fds[i], F_DUPFD, 10)) < 0)
            _exit(127);
    for (int i = 0; i < 3; i++)
        if (dup2(moved[i], to[i]) < 0)
            _exit(127);
    if (dup2(moved[3], REPORT_FD + 1) < 0)
        _exit(127);
    (void)syscall(SYS_close_range, REPORT_FD + 2, ~0U, 0);
    if (read(REPORT_FD + 1, &byte, 1) != 1) /* the daemon died first */
        _exit(1);
    close(REPORT_FD + 1);
    const int oom = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (oom >= 0) {
        (void)!write(oom, "500", 3); /* when memory runs out the job goes, not the daemon */
        close(oom);
    }
    (void)!nice(nice_by);
    setenv(WEFT_REPORT_ENV, "3", 1);
    setenv("WEFT_SOCKET", "none", 1); /* it is the one who opens the devices */
    execv(program, words);
    _exit(127);
}

static weft_err watch_all(weft_child *c, weft_error *err)
{
    WEFT_TRY(weft_loop_watch(c->loop, c->out.fd, EPOLLIN, read_stream, &c->out, err));
    WEFT_TRY(weft_loop_watch(c->loop, c->err.fd, EPOLLIN, read_stream, &c->err, err));
    WEFT_TRY(weft_loop_watch(c->loop, c->report, EPOLLIN, read_report, c, err));
    return weft_loop_watch(c->loop, c->pidfd, EPOLLIN, on_exit_of_child, c, err);
}

static void close_pairs(int pairs[4][2], int side)
{
    for (int i = 0; i < 4; i++)
        if (pairs[i][side] >= 0)
            close(pairs[i][side]);
}

static weft_err open_pairs(int pairs[4][2], weft_error *err)
{
    for (int i = 0; i < 4; i++)
        pairs[i][0] = pairs[i][1] = -1;
    if (pipe2(pairs[0], O_CLOEXEC) == 0 && pipe2(pairs[1], O_CLOEXEC) == 0 &&
        socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pairs[2]) == 0 &&
        pipe2(pairs[3], O_CLOEXEC) == 0)
        return WEFT_OK;
    const weft_err status = weft_fail_errno(err, WEFT_ERR_IO, "no descriptors for another job");
    close_pairs(pairs, 0);
    close_pairs(pairs, 1);
    return status;
}

static weft_err spawn(weft_child *c, const char *program, char *const *words, int nice_by, weft_error *err)
{
    int pairs[4][2]; /* out, err, report, go: [0] reads, [1] writes */
    WEFT_TRY(open_pairs(pairs, err));
    const pid_t parent = getpid();
    sigset_t all, before;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all,
                &before); /* a signal to the child must not run the daemon's handler in it */
    const pid_t pid = fork();
    if (pid != 0)
        sigprocmask(SIG_SETMASK, &before, NULL);
    if (pid == 0)
        become(program, words, parent, nice_by,
               (const int[]){pairs[0][1], pairs[1][1], pairs[2][1], pairs[3][0]});
    if (pid < 0) {
        const weft_err status = weft_fail_errno(err, WEFT_ERR_NOMEM, "no process for another job");
        close_pairs(pairs, 0);
        close_pairs(pairs, 1);
        return status;
    }
    (void)setpgid(pid, pid);
    c->pid = pid;
    c->start_time = start_time_of(pid);
    c->out.fd = pairs[0][0];
    c->err.fd = pairs[1][0];
    c->report = pairs[2][0];
    c->go = pairs[3][1];
    c->pidfd = (int)syscall(SYS_pidfd_open, pid, 0);
    close(pairs[0][1]);
    close(pairs[1][1]);
    close(pairs[2][1]);
    close(pairs[3][0]);
    (void)fcntl(c->out.fd, F_SETFL, O_NONBLOCK);
    (void)fcntl(c->err.fd, F_SETFL, O_NONBLOCK);
    if (c->pidfd < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "a job's process cannot be watched");
    return watch_all(c, err);
}

weft_err weft_child_start(weft_loop *loop, const char *program, char *const *words, int nice_by,
                          const weft_child_ears *ears, weft_child **child, weft_error *err)
{
    weft_child *const c = weft_alloc(1, sizeof *c, err);
    if (!c)
        return WEFT_ERR_NOMEM;
    *c = (weft_child){.loop = loop, .ears = *ears, .pidfd = -1, .go = -1, .report = -1};
    c->out = (stream){.name = "out", .fd = -1, .child = c, .line = weft_alloc(MAX_LINE + 1, 1, err)};
    c->err = (stream){.name = "err", .fd = -1, .child = c, .line = weft_alloc(MAX_LINE + 1, 1, err)};
    const weft_err status =
        c->out.line && c->err.line ? spawn(c, program, words, nice_by, err) : WEFT_ERR_NOMEM;
    if (status != WEFT_OK) {
        weft_child_destroy(c);
        return status;
    }
    *child = c;
    return WEFT_OK;
}

void weft_child_go(weft_child *c)
{
    if (c->go >= 0) {
        (void)!write(c->go, "g", 1);
        close(c->go);
        c->go = -1;
    }
}

void weft_child_destroy(weft_child *c)
{
    if (!c)
        return;
    if (c->pid > 0) {
        weft_child_kill(c);
        while (waitpid(c->pid, NULL, 0) < 0 && errno == EINTR)
            ;
    }
    if (c->go >= 0)
        close(c->go);
    close_fd(c, &c->out.fd);
    close_fd(c, &c->err.fd);
    close_fd(c, &c->report);
    close_fd(c, &c->pidfd);
    weft_free(c->out.line);
    weft_free(c->err.line);
    weft_free(c);
}

pid_t weft_child_pid(const weft_child *c)
{
    return c->pid;
}

int64_t weft_child_start_time(const weft_child *c)
{
    return c->start_time;
}

void weft_child_signal(const weft_child *c, int number)
{
    if (c->pid > 0)
        (void)kill(c->pid, number);
}

void weft_child_kill(const weft_child *c)
{
    if (c->pid > 0) {
        (void)kill(-c->pid, SIGKILL);
        (void)kill(c->pid, SIGKILL); /* not yet the head of its group */
    }
}

bool weft_child_kill_stray(int64_t pid, int64_t start_time)
{
    if (pid <= 1 || start_time <= 0 || start_time_of((pid_t)pid) != start_time)
        return false;
    weft_note("process %lld of an earlier weftd still runs: ended", (long long)pid);
    (void)kill((pid_t)-pid, SIGKILL);
    (void)kill((pid_t)pid, SIGKILL);
    for (int i = 0; i < 100 && start_time_of((pid_t)pid) == start_time; i++)
        nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    return true;
}
