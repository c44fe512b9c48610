#include "tests/host/rig_process.h"

#include "host/rig/rig_control.h"
#include "tests/support/support.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* One process on a machine can have UDP port 3956 of 127.0.0.1: test programs wait for each other. */
static void lock_port(void)
{
    static int fd = -1;
    const char *const given = getenv("WEFT_RIG_LOCK");
    if (fd < 0)
        fd = open(given ? given : "/tmp/weft-rig.lock", O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd >= 0)
        flock(fd, LOCK_EX);
}

static pid_t spawn(const char *const *options, int out, int errors)
{
    char program[1024];
    const char *words[40] = {program};
    const char *const bin = getenv("WEFT_TEST_BIN");
    snprintf(program, sizeof program, "%s/weft-rig", bin ? bin : "build/bin");
    for (int i = 0; options[i] && i < 38; i++)
        words[i + 1] = options[i];
    const pid_t pid = fork();
    if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM); /* a failed test leaves no rig behind */
        dup2(out, STDOUT_FILENO);
        if (errors >= 0)
            dup2(errors, STDERR_FILENO);
        execv(program, (char *const *)(void *)words);
        _exit(127);
    }
    return pid;
}

static int reap(pid_t pid)
{
    int status = 0;
    while (waitpid(pid, &status, 0) < 0 && errno == EINTR)
        ;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static size_t read_all(int fd, char *text, size_t size, char stop)
{
    size_t used = 0;
    ssize_t n;
    while (used + 1 < size && (n = read(fd, text + used, size - 1 - used)) > 0) {
        used += (size_t)n;
        if (stop && memchr(text, stop, used))
            break;
    }
    text[used] = '\0';
    return used;
}

static void copy_member(char *to, size_t size, json_t *ready, const char *key)
{
    const char *const value = json_string_value(json_object_get(ready, key));
    assert_non_null(value);
    snprintf(to, size, "%s", value);
}

void rig_process_start(rig_process *rig, const char *dir, const char *const *options)
{
    const char *words[40] = {"--quiet", "--dir", dir};
    char line[2048];
    int out[2], k = 3;
    while (*options && k < 39)
        words[k++] = *options++;
    words[k] = NULL;
    lock_port();
    assert_int_equal(pipe2(out, O_CLOEXEC), 0);
    *rig = (rig_process){0};
    snprintf(rig->dir, sizeof rig->dir, "%s", dir);
    rig->pid = spawn(words, out[1], -1);
    close(out[1]);
    const size_t n = read_all(out[0], line, sizeof line, '\n');
    close(out[0]);
    if (n == 0)
        fail_msg("weft-rig ended with status %d before it was ready", reap(rig->pid));
    json_t *const ready = json_loads(line, 0, NULL);
    assert_non_null(ready);
    copy_member(rig->pty, sizeof rig->pty, ready, "pty");
    copy_member(rig->camera, sizeof rig->camera, ready, "camera");
    assert_int_equal(json_integer_value(json_object_get(ready, "pid")), rig->pid);
    json_decref(ready);
}

json_t *rig_process_tell(const rig_process *rig, const char *line)
{
    char socket[600];
    json_t *reply = NULL;
    snprintf(socket, sizeof socket, "%s/control.sock", rig->dir);
    assert_ok(weft_rig_control_tell(socket, line, 60, &reply, err));
    if (!json_is_true(json_object_get(reply, "ok")))
        fail_msg("%s: %s", line, json_string_value(json_object_get(reply, "error")));
    return reply;
}

int rig_process_end(rig_process *rig, int signal)
{
    if (signal)
        kill(rig->pid, signal);
    else
        json_decref(rig_process_tell(rig, "quit"));
    return reap(rig->pid);
}

int rig_process_run(const char *const *options, char *words, size_t size)
{
    int errors[2];
    assert_int_equal(pipe2(errors, O_CLOEXEC), 0);
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    const pid_t pid = spawn(options, null, errors[1]);
    close(null);
    close(errors[1]);
    read_all(errors[0], words, size, '\0');
    close(errors[0]);
    return reap(pid);
}
