#include "host/daemon/job_order.h"

#include "host/daemon/job_request.h"

#include <string.h>

/* Whether a path is the other, or lies in it. */
static bool is_in(const char *path, const char *folder)
{
    const size_t n = strlen(folder);
    return strncmp(path, folder, n) == 0 && (path[n] == '/' || path[n] == '\0');
}

/* Whether a path of `works` is one of `paths`, or the folder that it lies in. */
static bool holds(const json_t *works, const json_t *paths)
{
    for (size_t i = 0; i < json_array_size(works); i++)
        for (size_t j = 0; j < json_array_size(paths); j++)
            if (is_in(json_string_value(json_array_get(paths, j)),
                      json_string_value(json_array_get(works, i))))
                return true;
    return false;
}

bool weft_job_follows(const weft_job *job, const weft_job *earlier)
{
    return holds(earlier->writes, job->reads) || holds(earlier->writes, job->writes) ||
           holds(job->writes, earlier->writes) || holds(job->writes, earlier->reads) ||
           weft_job_request_is_after(job->request, earlier->id);
}
