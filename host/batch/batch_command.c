#include "host/batch/batch_command.h"

#include "core/mem.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

void weft_command_output_fini(weft_command_output *output)
{
    weft_free(output->out);
    weft_free(output->err);
    *output = (weft_command_output){0};
}

/* A file in memory: no pipe that fills up while nobody reads. */
static int memory_file(const char *text)
{
    const int fd = memfd_create("weft-command", MFD_CLOEXEC);
    if (fd >= 0 && text && (write(fd, text, strlen(text)) < 0 || lseek(fd, 0, SEEK_SET) < 0)) {
        close(fd);
        return -1;
    }
    return fd;
}

static char *content(int fd, weft_error *err)
{
    const off_t size = lseek(fd, 0, SEEK_END);
    char *const text = weft_alloc((size_t)(size > 0 ? size : 0) + 1, 1, err);
    if (!text)
        return NULL;
    ssize_t n = pread(fd, text, (size_t)(size > 0 ? size : 0), 0);
    while (n > 0 && text[n - 1] == '\n')
        text[--n] = '\0';
    return text;
}

/* Ctrl-C is ours to act on: the program gets a process group of its own. */
static int spawn(char *const *words, const int fds[3], pid_t *pid)
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    for (int i = 0; i < 3; i++)
        posix_spawn_file_actions_adddup2(&actions, fds[i], i);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    const int failed = posix_spawnp(pid, words[0], &actions, &attributes, words, environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    return failed;
}

weft_err weft_command_capture(char *const *words, const char *input, weft_command_output *output,
                              weft_error *err)
{
    const int fds[3] = {memory_file(input), memory_file(NULL), memory_file(NULL)};
    weft_err status = WEFT_OK;
    pid_t pid = 0;
    int ended = 0;
    *output = (weft_command_output){0};
    if (fds[0] < 0 || fds[1] < 0 || fds[2] < 0) {
        status = weft_fail_errno(err, WEFT_ERR_IO, "%s: no files in memory for it", words[0]);
    } else {
        errno = spawn(words, fds, &pid);
        if (errno != 0)
            status = weft_fail_errno(err, errno == ENOENT ? WEFT_ERR_MISSING : WEFT_ERR_IO,
                                     "%s cannot be started", words[0]);
    }
    if (status == WEFT_OK) {
        while (waitpid(pid, &ended, 0) < 0 && errno == EINTR)
            ;
        output->exit_status = WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
        output->out = content(fds[1], err);
        output->err = content(fds[2], err);
        if (!output->out || !output->err) {
            weft_command_output_fini(output);
            status = WEFT_ERR_NOMEM;
        }
    }
    for (int i = 0; i < 3; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    return status;
}
