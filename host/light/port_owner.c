#include "host/light/port_owner.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <unistd.h>

static void name_process(weft_port_user *user)
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/comm", user->pid);
    FILE *const file = user->pid > 0 ? fopen(path, "r") : NULL;
    if (!file)
        return;
    if (fgets(user->name, sizeof user->name, file))
        user->name[strcspn(user->name, "\n")] = '\0';
    fclose(file);
}

weft_err weft_port_fail_used(const char *port, const weft_port_user *user, weft_error *err)
{
    if (user->pid > 0)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: another program is using this port: %s (process %d); close it first", port,
                         user->name[0] ? user->name : "a program", user->pid);
    return weft_fail(err, WEFT_ERR_DEVICE, "%s: another program is using this port; close it first", port);
}

/* Device files that may be serial ports; /dev/null and its like (major 1) are open everywhere. */
static bool is_port(const char *path, struct stat *device)
{
    return stat(path, device) == 0 && S_ISCHR(device->st_mode) && major(device->st_rdev) != 1;
}

/* -- reservation ---------------------------------------------------------------------------------------- */

/* Whoever listens at the name answers for it, also to other users. */
static weft_err reserved_by_other(const char *port, const struct sockaddr_un *name, socklen_t size,
                                  weft_error *err)
{
    weft_port_user user = {0};
    struct ucred peer = {0};
    socklen_t n = sizeof peer;
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd >= 0 && connect(fd, (const struct sockaddr *)name, size) == 0 &&
        getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &n) == 0)
        user.pid = (int)peer.pid;
    if (fd >= 0)
        close(fd);
    name_process(&user);
    return weft_port_fail_used(port, &user, err);
}

weft_err weft_port_reserve(const char *port, int *fd, weft_error *err)
{
    struct stat device;
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    *fd = -1;
    if (!is_port(port, &device))
        return WEFT_OK;
    const int length = snprintf(name.sun_path + 1, sizeof name.sun_path - 1, "weft-port-%u:%u",
                                major(device.st_rdev), minor(device.st_rdev));
    const socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + (size_t)length);
    const int new = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (new < 0)
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: the port cannot be reserved", port);
    if (bind(new, (const struct sockaddr *)&name, size) != 0 || listen(new, 8) != 0) {
        const int why = errno;
        close(new);
        if (why == EADDRINUSE)
            return reserved_by_other(port, &name, size, err);
        errno = why;
        return weft_fail_errno(err, WEFT_ERR_DEVICE, "%s: the port cannot be reserved", port);
    }
    *fd = new;
    return WEFT_OK;
}

/* -- everybody ------------------------------------------------------------------------------------------ */

static bool has_open(int pid, dev_t device)
{
    char folder[64];
    snprintf(folder, sizeof folder, "/proc/%d/fd", pid);
    DIR *const fds = opendir(folder);
    bool found = false;
    for (const struct dirent *entry; fds && !found && (entry = readdir(fds)) != NULL;) {
        struct stat file;
        found = fstatat(dirfd(fds), entry->d_name, &file, 0) == 0 && S_ISCHR(file.st_mode) &&
                file.st_rdev == device;
    }
    if (fds)
        closedir(fds);
    return found;
}

bool weft_port_find_user(const char *port, weft_port_user *user)
{
    struct stat device;
    DIR *const processes = opendir("/proc");
    *user = (weft_port_user){0};
    if (processes && is_port(port, &device))
        for (const struct dirent *entry; user->pid == 0 && (entry = readdir(processes)) != NULL;) {
            const int pid =
                isdigit((unsigned char)entry->d_name[0]) ? (int)strtol(entry->d_name, NULL, 10) : 0;
            if (pid > 0 && pid != (int)getpid() && has_open(pid, device.st_rdev))
                user->pid = pid;
        }
    if (processes)
        closedir(processes);
    name_process(user);
    return user->pid != 0;
}
