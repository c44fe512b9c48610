/* Starting and ending the fake camera's process. */
#include "tests/host/fake_camera.h"

#include "tests/support/support.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
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

void fake_camera_start(fake_camera *camera, const char *format, const char *size)
{
    int to[2], from[2];
    char program[1024], line[16] = "";
    const char *const build = getenv("WEFT_TEST_BUILD");
    snprintf(program, sizeof program, "%s/tests/fake_camera", build ? build : "build");
    lock_port();
    assert_int_equal(pipe2(to, O_CLOEXEC) | pipe2(from, O_CLOEXEC), 0);
    camera->pid = fork();
    if (camera->pid == 0) {
        dup2(to[0], STDIN_FILENO);
        dup2(from[1], STDOUT_FILENO);
        execl(program, program, format, size, (char *)NULL);
        _exit(127);
    }
    close(to[0]);
    close(from[1]);
    camera->in = fdopen(to[1], "w");
    camera->out = fdopen(from[0], "r");
    if (!fgets(line, sizeof line, camera->out) || strcmp(line, "ready\n") != 0) {
        int status = 0;
        waitpid(camera->pid, &status, 0);
        camera->pid = 0;
        fake_camera_kill(camera);
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 3)
            fail_msg("%s: ended with status %d before it was ready", program, status);
        print_message("skipped: UDP port 3956 of 127.0.0.1 is taken by another program\n");
        skip();
    }
}

void fake_camera_tell(fake_camera *camera, const char *line)
{
    char answer[16] = "";
    fprintf(camera->in, "%s\n", line);
    fflush(camera->in);
    assert_non_null(fgets(answer, sizeof answer, camera->out));
    assert_string_equal(answer, "ok\n");
}

void fake_camera_kill(fake_camera *camera)
{
    if (camera->pid > 0) {
        kill(camera->pid, SIGKILL);
        waitpid(camera->pid, NULL, 0);
    }
    if (camera->in)
        fclose(camera->in);
    if (camera->out)
        fclose(camera->out);
    *camera = (fake_camera){0};
}
