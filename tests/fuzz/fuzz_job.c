/*
 * libFuzzer over what a client of weftd sends: the body of a job, and the names in a path.  A job that is
 * accepted must have words that name nothing outside the library, and a command line that the command itself
 * accepts.
 */
#include "host/daemon/http_private.h"
#include "host/daemon/job_words.h"

#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define ROOT "/nonexistent/library"

static void check_paths(const json_t *paths)
{
    for (size_t i = 0; i < json_array_size(paths); i++) {
        const char *const path = json_string_value(json_array_get(paths, i));
        if (strncmp(path, ROOT, strlen(ROOT)) != 0 || strstr(path, "/../") || strstr(path, "/.weft"))
            abort();
    }
}

static void try_body(const char *bytes, size_t n)
{
    const weft_job_rights rights = {.root = ROOT, .rig = "/nonexistent/rig", .owner = "fuzz"};
    weft_job job;
    weft_error error = {0};
    char **words = NULL;
    if (weft_job_request_parse(bytes, n, &rights, &job, &error) != WEFT_OK) {
        if (!error.text[0])
            abort(); /* refused without a word */
        return;
    }
    check_paths(job.reads);
    check_paths(job.writes);
    for (job.attempt = 0; job.attempt < 2; job.attempt++)
        if (weft_job_words_make(&job, &words, NULL) == WEFT_OK)
            weft_job_words_free(words);
    weft_job_fini(&job);
}

static void try_path(const char *bytes, size_t n)
{
    char *const text = weft_alloc(n + 1, 1, NULL);
    const char *tail;
    int64_t id;
    char allowed[64];
    if (!text)
        return;
    memcpy(text, bytes, n);
    char *const path = weft_http_decode(text, n % 2 == 0);
    if (path)
        (void)weft_route_find("GET", path, &tail, &id, allowed);
    weft_free(path);
    weft_free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    try_body((const char *)data, size);
    try_path((const char *)data, size < 4096 ? size : 4096);
    return 0;
}
