#include "host/daemon/job_words.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "host/client/job_kinds.h"
#include "host/set/set.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

bool weft_job_writes_nothing_there(const weft_job *job)
{
    for (size_t i = 0; i < json_array_size(job->writes); i++)
        if (weft_file_exists(json_string_value(json_array_get(job->writes, i))))
            return false;
    return true;
}

/* ".weft-NAME-PID-N" of the process */
static bool is_left_over(const char *entry, int64_t pid)
{
    char ending[32];
    const char *const last = strrchr(entry, '-');
    const int n = snprintf(ending, sizeof ending, "-%" PRId64, pid);
    return strncmp(entry, ".weft-", 6) == 0 && last && last - entry > n &&
           strncmp(last - n, ending, (size_t)n) == 0 && last[1] &&
           strspn(last + 1, "0123456789") == strlen(last + 1);
}

/* What the process has left in a folder; only_of: with this name, NULL with any. */
static void sweep_in(const char *folder, const char *only_of, int64_t pid)
{
    DIR *const entries = opendir(folder);
    const struct dirent *entry;
    while (entries && (entry = readdir(entries)) != NULL) {
        if (!is_left_over(entry->d_name, pid) ||
            (only_of && strncmp(entry->d_name + 6, only_of, strlen(only_of)) != 0))
            continue;
        char *const left = weft_path_join(folder, entry->d_name, NULL);
        if (left && unlink(left) != 0 && weft_folder_remove(left, NULL) != WEFT_OK)
            weft_explain("%s cannot be removed", left);
        weft_free(left);
    }
    if (entries)
        closedir(entries);
}

void weft_job_sweep(const weft_job *job, int64_t pid)
{
    for (size_t i = 0; i < json_array_size(job->writes) && pid > 0; i++) {
        const char *const path = json_string_value(json_array_get(job->writes, i));
        char *const folder = weft_path_folder(path, NULL);
        if (folder)
            sweep_in(folder, weft_path_name(path), pid);
        if (weft_folder_exists(path)) /* a material is built file by file */
            sweep_in(path, NULL, pid);
        weft_free(folder);
    }
}

/* Whether the set that the job writes was begun by it: times are text that sorts. */
static bool set_is_its_own(const weft_job *job)
{
    weft_set set;
    const char *const folder = json_string_value(json_array_get(job->writes, 0));
    if (!folder || weft_set_load(folder, &set, NULL) != WEFT_OK)
        return false;
    const bool own = strcmp(set.created, job->created) >= 0;
    weft_set_fini(&set);
    return own;
}

/* The option that a later run gets in front; *drops_force: and --force goes. */
static const char *choose_option(const weft_job *job, const weft_job_kind *kind, bool forced,
                                 bool *drops_force)
{
    *drops_force = false;
    if (job->attempt == 0)
        return NULL;
    if (!kind->resumes)
        return job->fresh && kind->writes && !forced ? "--force" : NULL;
    if (forced && !set_is_its_own(job))
        return NULL;
    *drops_force = forced;
    return "--resume";
}

static bool has_word(const json_t *words, const char *wanted)
{
    for (size_t i = 0; i < json_array_size(words); i++) {
        const char *const word = json_string_value(json_array_get(words, i));
        if (!word || strcmp(word, "--") == 0)
            return false;
        if (strcmp(word, wanted) == 0)
            return true;
    }
    return false;
}

static weft_err add(char **words, size_t *n, const char *word, size_t length, weft_error *err)
{
    words[*n] = weft_asprintf(err, "%.*s", (int)length, word);
    return words[(*n)++] ? WEFT_OK : WEFT_ERR_NOMEM;
}

static weft_err fill(const weft_job *job, const weft_job_kind *kind, char **words, weft_error *err)
{
    size_t n = 0;
    bool drops_force, options = true;
    const char *const option = choose_option(job, kind, has_word(job->words, "--force"), &drops_force);
    WEFT_TRY(add(words, &n, "weft", 4, err));
    for (const char *p = job->command; *p;) {
        const size_t length = strcspn(p, " ");
        WEFT_TRY(add(words, &n, p, length, err));
        p += length + (p[length] == ' ');
    }
    if (option)
        WEFT_TRY(add(words, &n, option, strlen(option), err));
    for (size_t i = 0; i < json_array_size(job->words); i++) {
        const char *const word = json_string_value(json_array_get(job->words, i));
        if (!word)
            return weft_fail(err, WEFT_ERR_FORMAT, "a word of the job is no text");
        options = options && strcmp(word, "--") != 0;
        if (!(options && drops_force && strcmp(word, "--force") == 0))
            WEFT_TRY(add(words, &n, word, strlen(word), err));
    }
    return WEFT_OK;
}

weft_err weft_job_words_make(const weft_job *job, char ***words, weft_error *err)
{
    const weft_job_kind *const kind = weft_job_kind_find(job->command);
    if (!kind)
        return weft_fail(err, WEFT_ERR_FORMAT, "this weftd does not know the command \"%s\"", job->command);
    char **const made = weft_alloc(json_array_size(job->words) + 8, sizeof *made, err);
    if (!made)
        return WEFT_ERR_NOMEM;
    const weft_err status = fill(job, kind, made, err);
    if (status != WEFT_OK) {
        weft_job_words_free(made);
        return status;
    }
    *words = made;
    return WEFT_OK;
}

void weft_job_words_free(char **words)
{
    for (char **word = words; word && *word; word++)
        weft_free(*word);
    weft_free(words);
}
