#include "host/daemon/token.h"

#include "core/file.h"
#include "core/mem.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

bool weft_token_equal(const char *given, const char *token)
{
    const size_t n = strlen(given), m = strlen(token);
    unsigned difference = n != m;
    for (size_t i = 0; i < n; i++)
        difference |= (unsigned)(unsigned char)given[i] ^ (unsigned char)token[m ? i % m : 0];
    return difference == 0;
}

static weft_err make(const char *path, weft_error *err)
{
    unsigned char bytes[32];
    char text[2 * sizeof bytes + 2];
    if (getrandom(bytes, sizeof bytes, 0) != sizeof bytes)
        return weft_fail_errno(err, WEFT_ERR_IO, "no random numbers for a token");
    for (size_t i = 0; i < sizeof bytes; i++)
        snprintf(text + 2 * i, 4, "%02x\n", bytes[i]);
    const int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0 && errno == EEXIST)
        return WEFT_OK;
    const bool good = fd >= 0 && write(fd, text, sizeof text - 1) == sizeof text - 1 && fsync(fd) == 0;
    const weft_err status =
        good ? WEFT_OK : weft_fail_errno(err, WEFT_ERR_IO, "%s: the token cannot be written", path);
    if (fd >= 0)
        close(fd);
    if (!good && fd >= 0)
        unlink(path);
    return status;
}

weft_err weft_token_load(const char *path, char **token, weft_error *err)
{
    struct stat s;
    char *text = NULL;
    size_t n = 0;
    if (!weft_file_exists(path))
        WEFT_TRY(make(path, err));
    if (stat(path, &s) == 0 && (s.st_mode & 077) != 0)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: others may read the token; chmod 600 it and change it",
                         path);
    WEFT_TRY(weft_file_read(path, 4096, &text, &n, err));
    n = strcspn(text, "\r\n");
    text[n] = '\0';
    for (size_t i = 0; i < n; i++)
        if (text[i] <= ' ' || text[i] > '~')
            n = 0;
    if (n < WEFT_TOKEN_LENGTH_MIN || n > WEFT_TOKEN_LENGTH_MAX) {
        weft_free(text);
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: a token has %d to %d visible characters without blanks",
                         path, WEFT_TOKEN_LENGTH_MIN, WEFT_TOKEN_LENGTH_MAX);
    }
    *token = text;
    return WEFT_OK;
}
