/* What lies in the library, and its files. */
#include "host/daemon/http_private.h"

#include "core/file.h"
#include "core/mem.h"
#include "host/daemon/library_path.h"
#include "host/library/catalogue.h"

#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LIST_LIMIT = 200, MAX_WORDS = 16 };

/* Cuts at blanks; at most MAX_WORDS. */
static int split(char *text, const char *words[MAX_WORDS])
{
    int n = 0;
    for (char *p = text; *p && n < MAX_WORDS;) {
        p += strspn(p, " ");
        if (*p)
            words[n++] = p;
        p += strcspn(p, " ");
        if (*p)
            *p++ = '\0';
    }
    return n;
}

/* false: answered. */
static bool take_kind(weft_http_request *r, const char **kind, enum MHD_Result *result)
{
    bool present;
    char *const name = weft_http_query(r, "kind", &present);
    *kind = NULL;
    for (int i = 0; name && weft_catalogue_kind(i); i++)
        if (strcmp(weft_catalogue_kind(i), name) == 0)
            *kind = weft_catalogue_kind(i);
    weft_free(name);
    if (present && !*kind)
        *result = weft_reply_problem(r, 400, "bad_query",
                                     "kind: wanted set, calibration, maps, material or picture");
    return !present || *kind;
}

enum MHD_Result weft_route_library_list(weft_http_request *r)
{
    enum MHD_Result result = MHD_NO;
    weft_error error = {0};
    const char *words[MAX_WORDS];
    weft_catalogue_query query = {.limit = LIST_LIMIT, .words = words};
    json_t *items = NULL;
    bool present;
    if (!take_kind(r, &query.kind, &result) ||
        !weft_http_query_int(r, "limit", 1, 1000, &query.limit, &result) ||
        !weft_http_query_int(r, "offset", 0, INT32_MAX, &query.offset, &result))
        return result;
    char *const text = weft_http_query(r, "q", &present);
    if (present && !text)
        return weft_reply_problem(r, 400, "bad_query", "q: is not UTF-8");
    query.n_words = text ? split(text, words) : 0;
    const weft_err status = weft_catalogue_find(r->server->house.db, &query, &items, &error);
    weft_free(text);
    return status == WEFT_OK ? weft_reply_json(r, 200, json_pack("{s:o}", "items", items))
                             : weft_reply_error(r, status, &error);
}

enum MHD_Result weft_route_library_item(weft_http_request *r)
{
    weft_error error = {0};
    json_t *item = NULL;
    const weft_err status = weft_catalogue_get(r->server->house.db, r->tail, &item, &error);
    return status == WEFT_OK ? weft_reply_json(r, 200, item) : weft_reply_error(r, status, &error);
}

static const char *type_of(const char *name)
{
    static const struct {
        const char *suffix, *type;
    } types[] = {{".png", "image/png"},         {".jpg", "image/jpeg"},        {".jpeg", "image/jpeg"},
                 {".json", "application/json"}, {".tif", "image/tiff"},        {".tiff", "image/tiff"},
                 {".exr", "image/x-exr"},       {".dng", "image/x-adobe-dng"}, {".ktx2", "image/ktx2"},
                 {".glb", "model/gltf-binary"}};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (weft_path_has_suffix(name, types[i].suffix))
            return types[i].type;
    return "application/octet-stream"; /* never text/html: the library may hold anybody's files */
}

enum MHD_Result weft_route_file(weft_http_request *r)
{
    weft_error error = {0};
    struct stat s;
    int fd = -1;
    const weft_err status = weft_library_open_file(r->server->house.db->root, r->tail, &fd, &error);
    if (status != WEFT_OK)
        return weft_reply_error(r, status, &error);
    struct MHD_Response *const response =
        fstat(fd, &s) == 0 ? MHD_create_response_from_fd64((uint64_t)s.st_size, fd) : NULL;
    if (!response) {
        close(fd);
        return MHD_NO;
    }
    return weft_reply(r, 200, response, type_of(r->tail));
}
