/* firmware/studio/server/http.c - requests; see parts.h. */
#define ZLIB_CONST
#include <cjson/cJSON.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/library/version.h"
#include "firmware/linux/base/disk.h"
#include "firmware/studio/embedded.h"
#include "firmware/studio/server/guard.h"
#include "firmware/studio/server/parts.h"

#define HTTP_HEADERS   2048
#define HTTP_PIECE     16384
#define HTTP_NAME      1024
#define HTTP_ERRAND_US 2000 /* between two looks whether it is done */
#define HTTP_ERRAND_S  120  /* at most */

#define HTTP_NO_TOKEN                                                          \
    "a token is expected: open the link that slew has printed, "               \
    "http://HOST:PORT/?token=..."

static const char http_policy[] =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; "
    "worker-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: "
    "blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

/* --- whose it is -------------------------------------------------------------- */

static void http_header(struct lws *wsi, enum lws_token_indexes which,
                        char *text, int size)
{
    if (lws_hdr_copy(wsi, text, size, which) < 0)
        text[0] = 0;
}

unsigned studio_refusal(const struct studio_server *server, struct lws *wsi)
{
    char host[HTTP_NAME], origin[HTTP_NAME], text[4 * HTTP_NAME];
    char name[GUARD_COOKIE_MAX];

    http_header(wsi, WSI_TOKEN_HOST, host, sizeof host);
    http_header(wsi, WSI_TOKEN_ORIGIN, origin, sizeof origin);
    if (!guard_is_host(host, server->address, server->config->port))
        return 421;
    if (!guard_is_origin(origin, host))
        return 403;
    http_header(wsi, WSI_TOKEN_HTTP_COOKIE, text, sizeof text);
    guard_cookie_name(server->config->port, name);
    return guard_has_cookie(text, name, server->config->token) ? 0 : 401;
}

/* --- answers ------------------------------------------------------------------ */

struct http_answer {
    unsigned status;
    const char *type;
    const char *tag; /* these NULL: none */
    const char *vary, *cookie, *location;
    bool is_gzip, closes;
};

static int http_headers(struct lws *wsi, const struct http_answer *answer,
                        size_t length)
{
    unsigned char buffer[LWS_PRE + HTTP_HEADERS];
    unsigned char *at = buffer + LWS_PRE, *const start = at;
    unsigned char *const end = buffer + sizeof buffer - 1;
    const struct {
        const char *name, *value;
    } rows[] = {
        { "content-security-policy:", http_policy },
        { "x-content-type-options:", "nosniff" },
        { "referrer-policy:", "no-referrer" },
        { "cross-origin-resource-policy:", "same-origin" },
        { "cross-origin-opener-policy:", "same-origin" },
        { "cache-control:", "no-cache" },
        { "etag:", answer->tag },
        { "content-encoding:", answer->is_gzip ? "gzip" : NULL },
        { "connection:", answer->closes ? "close" : NULL },
        { "vary:", answer->vary },
        { "set-cookie:", answer->cookie },
        { "location:", answer->location },
    };

    if (lws_add_http_common_headers(wsi, answer->status, answer->type, length,
                                    &at, end) != 0)
        return -1;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++)
        if (rows[i].value != NULL &&
            lws_add_http_header_by_name(
                wsi, (const unsigned char *)rows[i].name,
                (const unsigned char *)rows[i].value,
                (int)strlen(rows[i].value), &at, end) != 0)
            return -1;
    return lws_finalize_write_http_header(wsi, start, &at, end) != 0 ? -1 : 0;
}

static void http_drop(struct studio_request *request)
{
    memory_free(request->body);
    errand_leave(request->errand);
    *request = (struct studio_request){ .body = NULL };
}

/* -1 once the connection is over. */
static int http_done(struct lws *wsi, struct studio_request *request)
{
    const bool closes = request->closes;

    http_drop(request);
    return closes || lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

/* A piece of `gives`. */
static int http_write(struct lws *wsi, struct studio_request *request)
{
    static unsigned char buffer[LWS_PRE + HTTP_PIECE]; /* of one thread */
    const size_t left = request->length - request->done;
    const size_t size = left < HTTP_PIECE ? left : HTTP_PIECE;
    const bool last = size == left;

    if (request->gives == NULL)
        return 0;
    memcpy(buffer + LWS_PRE, request->gives + request->done, size);
    if (lws_write(wsi, buffer + LWS_PRE, size,
                  last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < (int)size)
        return -1;
    request->done += size;
    if (last)
        return http_done(wsi, request);
    lws_callback_on_writable(wsi);
    return 0;
}

/* `body` is the request's from now on, where `gives` is in it. */
static int http_give(struct lws *wsi, struct studio_request *request,
                     const struct http_answer *kind, const char *gives,
                     size_t length, char *body)
{
    struct http_answer answer = *kind;

    answer.closes = request->closes;
    request->body = body;
    request->gives = gives;
    request->length = length;
    request->done = 0;
    if (http_headers(wsi, &answer, length) < 0)
        return -1;
    if (length == 0)
        return http_done(wsi, request);
    lws_callback_on_writable(wsi);
    return 0;
}

static int http_say(struct lws *wsi, struct studio_request *request,
                    unsigned status, const char *tag, cJSON *object)
{
    const struct http_answer answer = { .status = status,
                                        .type = "application/json",
                                        .tag = tag };
    char *printed = cJSON_PrintUnformatted(object);
    const size_t length = printed == NULL ? 0 : strlen(printed);
    char *body = memory_new(length + 1, 1);

    memcpy(body, printed == NULL ? "" : printed, length);
    cJSON_free(printed);
    cJSON_Delete(object);
    return http_give(wsi, request, &answer, body, length, body);
}

static int http_refuse(struct lws *wsi, struct studio_request *request,
                       unsigned status, const char *tag, const char *why)
{
    cJSON *object = cJSON_CreateObject();

    cJSON_AddStringToObject(object, "error", why);
    return http_say(wsi, request, status, tag, object);
}

/* --- files of the page --------------------------------------------------------- */

static const char *http_type(const char *name)
{
    static const struct {
        const char *ending, *type;
    } rows[] = {
        { ".html", "text/html; charset=utf-8" },
        { ".js", "text/javascript; charset=utf-8" },
        { ".mjs", "text/javascript; charset=utf-8" },
        { ".css", "text/css; charset=utf-8" },
        { ".wasm", "application/wasm" },
        { ".svg", "image/svg+xml" },
        { ".png", "image/png" },
        { ".json", "application/json" },
    };
    const char *dot = strrchr(name, '.');

    for (unsigned i = 0; dot != NULL && i < ARRAY_LEN(rows); i++)
        if (strcmp(rows[i].ending, dot) == 0)
            return rows[i].type;
    return "text/plain; charset=utf-8";
}

static const struct embedded_file *http_page(const char *name)
{
    const struct embedded_file *file = embedded_page;

    while (file->name != NULL && strcmp(file->name, name) != 0)
        file++;
    return file->name == NULL ? NULL : file;
}

/* For a client that takes no gzip: its last four bytes are how long it was. */
static char *http_unpack(const struct embedded_file *file, size_t *length)
{
    const unsigned char *size = file->data + file->length - 4;
    z_stream stream = { .next_in = file->data, .avail_in = (uInt)file->length };

    *length = (size_t)size[0] | (size_t)size[1] << 8 | (size_t)size[2] << 16 |
              (size_t)size[3] << 24;
    char *data = memory_new(*length + 1, 1);
    stream.next_out = (unsigned char *)data;
    stream.avail_out = (uInt)*length;
    if (inflateInit2(&stream, 15 + 16) == Z_OK) {
        (void)inflate(&stream, Z_FINISH);
        (void)inflateEnd(&stream);
    }
    return data;
}

static int http_file(struct lws *wsi, struct studio_request *request,
                     const struct embedded_file *file)
{
    char text[HTTP_NAME], tag[DOCUMENT_TAG];
    struct http_answer answer = { .status = 200,
                                  .type = http_type(file->name),
                                  .tag = tag,
                                  .vary = "accept-encoding",
                                  .is_gzip = true };
    size_t length;

    document_tag((const char *)file->data, file->length, tag);
    http_header(wsi, WSI_TOKEN_HTTP_IF_NONE_MATCH, text, sizeof text);
    if (strcmp(text, tag) == 0) {
        answer.status = 304;
        answer.is_gzip = false;
        return http_give(wsi, request, &answer, "", 0, NULL);
    }
    http_header(wsi, WSI_TOKEN_HTTP_ACCEPT_ENCODING, text, sizeof text);
    if (strstr(text, "gzip") != NULL)
        return http_give(wsi, request, &answer, (const char *)file->data,
                         file->length, NULL);
    answer.is_gzip = false;
    char *body = http_unpack(file, &length);
    return http_give(wsi, request, &answer, body, length, body);
}

/* The way in: with the right token a cookie, and the page without it, so that
 * the token stays in no history.  The cookie comes along from a link (Lax), with
 * which nothing can be changed. */
static int http_let_in(const struct studio_server *server, struct lws *wsi,
                       struct studio_request *request)
{
    char text[GUARD_TOKEN_MAX + 64], cookie[GUARD_TOKEN_MAX + 128];
    char name[GUARD_COOKIE_MAX];
    const struct http_answer answer = {
        .status = 303, .type = "text/plain", .cookie = cookie, .location = "/"
    };

    const char *token =
        lws_get_urlarg_by_name(wsi, "token=", text, sizeof text);
    if (token == NULL || !guard_is_token(token, server->config->token))
        return http_refuse(wsi, request, 401, NULL, HTTP_NO_TOKEN);
    guard_cookie_name(server->config->port, name);
    snprintf(cookie, sizeof cookie, "%s%s; HttpOnly; SameSite=Lax; Path=/",
             name, token);
    return http_give(wsi, request, &answer, "", 0, NULL);
}

/* --- rig and move --------------------------------------------------------------- */

static const char *http_document(const struct studio_server *server,
                                 const char *path)
{
    return strcmp(path, "/api/rig") == 0    ? server->config->rig_path
           : strcmp(path, "/api/move") == 0 ? server->config->move_path
                                            : NULL;
}

/* The answer comes once it is done. */
static int http_errand(struct lws *wsi, struct studio_request *request,
                       struct errand *errand)
{
    request->errand = errand;
    errand_start(errand);
    lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, HTTP_ERRAND_S);
    lws_set_timer_usecs(wsi, HTTP_ERRAND_US);
    return 0;
}

static int http_studio(const struct studio_server *server, struct lws *wsi,
                       struct studio_request *request)
{
    const struct studio_config *config = server->config;
    cJSON *object = cJSON_CreateObject();

    cJSON_AddStringToObject(object, "slew", SLEW_VERSION);
    cJSON_AddStringToObject(object, "rig", config->rig_path);
    if (config->move_path != NULL)
        cJSON_AddStringToObject(object, "move", config->move_path);
    else
        cJSON_AddNullToObject(object, "move");
    cJSON_AddBoolToObject(object, "real", config->is_real);
    cJSON_AddBoolToObject(object, "edits_rig", config->edits_rig);
    cJSON_AddBoolToObject(object, "address_is_loopback",
                          guard_is_loopback(server->address));
    cJSON_AddNumberToObject(object, "rate_hz", 60);
    return http_say(wsi, request, 200, NULL, object);
}

static int http_beside(const struct studio_server *server, struct lws *wsi,
                       struct studio_request *request)
{
    const struct studio_config *config = server->config;
    struct errand *errand = errand_new(ERRAND_BESIDE, config->rig_path);
    char text[FILES_PATH_MAX];

    const char *asked = lws_get_urlarg_by_name(wsi, "name=", text, sizeof text);
    if (asked != NULL)
        snprintf(errand->name, sizeof errand->name, "%s", asked);
    if (config->move_path != NULL)
        snprintf(errand->move, sizeof errand->move, "%s", config->move_path);
    return http_errand(wsi, request, errand);
}

/* --- takes ------------------------------------------------------------------------ */

/* What the directory of takes is beside. */
static const char *http_takes(const struct studio_server *server)
{
    const struct studio_config *config = server->config;

    return config->move_path != NULL ? config->move_path : config->rig_path;
}

/* The name that is asked for; false: none that a take can have. */
static bool http_take_name(struct lws *wsi, char name[TAKES_NAME])
{
    char text[HTTP_NAME];
    const char *asked = lws_get_urlarg_by_name(wsi, "name=", text, sizeof text);

    if (asked == NULL || !takes_is_name(asked))
        return false;
    snprintf(name, TAKES_NAME, "%s", asked);
    return true;
}

static int http_get_take(const struct studio_server *server, struct lws *wsi,
                         struct studio_request *request)
{
    char name[TAKES_NAME], path[FILES_PATH_MAX];

    if (!http_take_name(wsi, name) ||
        !takes_path(http_takes(server), name, path, sizeof path))
        return http_refuse(wsi, request, 404, NULL,
                           "no take can have this name");
    return http_errand(wsi, request, errand_new(ERRAND_READ, path));
}

static int http_get(const struct studio_server *server, struct lws *wsi,
                    struct studio_request *request, const char *path)
{
    const char *document = http_document(server, path);
    const struct embedded_file *file =
        http_page(strcmp(path, "/") == 0 ? "/index.html" : path);

    if (document != NULL)
        return http_errand(wsi, request, errand_new(ERRAND_READ, document));
    if (strcmp(path, "/api/studio") == 0)
        return http_studio(server, wsi, request);
    if (strcmp(path, "/api/file") == 0)
        return http_beside(server, wsi, request);
    if (strcmp(path, "/api/takes") == 0)
        return http_errand(wsi, request,
                           errand_new(ERRAND_TAKES, http_takes(server)));
    if (strcmp(path, "/api/take") == 0)
        return http_get_take(server, wsi, request);
    if (file != NULL)
        return http_file(wsi, request, file);
    return http_refuse(wsi, request, 404, NULL,
                       strcmp(path, "/planner.wasm") == 0
                           ? "this slew was built without the planner for a "
                             "browser: expected make studio"
                           : "there is nothing of this name");
}

/* --- writing --------------------------------------------------------------------- */

static int http_put(const struct studio_server *server, struct lws *wsi,
                    struct studio_request *request, const char *path)
{
    char length[32];
    const bool is_take =
        strcmp(path, "/api/take") == 0 && http_take_name(wsi, request->take);

    if (!is_take && http_document(server, path) == NULL)
        return http_refuse(wsi, request, 404, NULL,
                           "there is nothing of this name that can be written");
    if (strcmp(path, "/api/rig") == 0 && !server->config->edits_rig)
        return http_refuse(wsi, request, 403, NULL,
                           "the file of the rig is not written from here, "
                           "expected slew started with --edit-rig");
    http_header(wsi, WSI_TOKEN_HTTP_IF_MATCH, request->tag,
                sizeof request->tag);
    http_header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH, length, sizeof length);
    if (!is_take && request->tag[0] == 0)
        return http_refuse(wsi, request, 428, NULL,
                           "expected If-Match with the ETag of the text that "
                           "was changed");
    if (length[0] == 0 || strtoull(length, NULL, 10) > DOCUMENT_MAX)
        return http_refuse(wsi, request, 413, NULL,
                           "expected at most 16 MiB, and their length");
    if (strtoull(length, NULL, 10) == 0)
        return http_refuse(wsi, request, 400, NULL, "expected a text");
    request->closes = false;
    request->is_put = true;
    request->is_rig = strcmp(path, "/api/rig") == 0;
    return 0;
}

static int http_take(struct studio_request *request, const char *in,
                     size_t length)
{
    if (!request->is_put)
        return 0;
    if (request->length + length > DOCUMENT_MAX)
        return -1;
    if (request->length + length + 1 > request->capacity) {
        request->capacity = 2 * (request->length + length + 1);
        request->body = memory_resize(request->body, request->capacity, 1);
    }
    memcpy(request->body + request->length, in, length);
    request->length += length;
    return 0;
}

static int http_put_errand(const struct studio_server *server, struct lws *wsi,
                           struct studio_request *request)
{
    const struct studio_config *config = server->config;
    const bool is_take = request->take[0] != 0;
    struct errand *errand = errand_new(is_take ? ERRAND_KEEP : ERRAND_WRITE,
                                       is_take           ? http_takes(server)
                                       : request->is_rig ? config->rig_path
                                                         : config->move_path);

    snprintf(errand->name, sizeof errand->name, "%s", request->take);
    snprintf(errand->tag, sizeof errand->tag, "%s", request->tag);
    errand->body = request->body;
    errand->length = request->length;
    request->body = NULL;
    request->length = 0;
    return http_errand(wsi, request, errand);
}

/* --- what has come of it --------------------------------------------------------- */

static int http_failure(struct lws *wsi, struct studio_request *request,
                        const struct errand *errand)
{
    const int64_t err = errand->outcome;

    if (err == -EEXIST && errand->kind == ERRAND_KEEP)
        return http_refuse(wsi, request, 412, NULL,
                           "there is a take of this name already");
    if (err == -EEXIST)
        return http_refuse(wsi, request, 412, errand->tag,
                           "the file on disk has changed since it was read");
    if (errand->kind == ERRAND_BESIDE)
        return http_refuse(wsi, request, 404, NULL,
                           "no file beside the rig or the move has this name");
    return http_refuse(wsi, request, errand->kind == ERRAND_READ ? 404 : 500,
                       NULL, files_error((int)err));
}

static int http_success(struct lws *wsi, struct studio_request *request,
                        struct errand *errand)
{
    const bool reads =
        errand->kind == ERRAND_READ || errand->kind == ERRAND_BESIDE;
    const struct http_answer answer = {
        .status = reads ? 200 : 204,
        .type = reads ? "text/yaml; charset=utf-8" : "text/plain",
        .tag = errand->kind == ERRAND_KEEP ? NULL : errand->tag,
    };
    char *data = errand->data;
    cJSON *list = errand->list;

    errand->data = NULL;
    errand->list = NULL;
    return list != NULL ? http_say(wsi, request, 200, NULL, list)
                        : http_give(wsi, request, &answer, reads ? data : "",
                                    reads ? (size_t)errand->outcome : 0, data);
}

static int http_errand_over(struct lws *wsi, struct studio_request *request)
{
    struct errand *errand = request->errand;

    request->errand = NULL;
    const int rc = errand->outcome < 0 ? http_failure(wsi, request, errand)
                                       : http_success(wsi, request, errand);
    errand_leave(errand);
    return rc;
}

/* --- which ------------------------------------------------------------------------ */

static int http_begin(const struct studio_server *server, struct lws *wsi,
                      struct studio_request *request, const char *path)
{
    const unsigned refusal = studio_refusal(server, wsi);

    http_drop(request);
    /* What is refused is not read further. */
    request->closes = lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) == 0;
    if (refusal == 401 && strcmp(path, "/") == 0 &&
        lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) > 0)
        return http_let_in(server, wsi, request);
    if (refusal != 0)
        return http_refuse(wsi, request, refusal, NULL,
                           refusal == 421   ? "this is another host"
                           : refusal == 403 ? "this is for the page of slew"
                                            : HTTP_NO_TOKEN);
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) > 0)
        return http_get(server, wsi, request, path);
    if (lws_hdr_total_length(wsi, WSI_TOKEN_PUT_URI) > 0)
        return http_put(server, wsi, request, path);
    return http_refuse(wsi, request, 405, NULL, "expected GET or PUT");
}

int studio_http(struct lws *wsi, enum lws_callback_reasons reason, void *user,
                void *in, size_t length)
{
    const struct studio_server *server = lws_context_user(lws_get_context(wsi));
    struct studio_request *request = user;

    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: /* a WebSocket, and not ours */
        (void)lws_return_http_status(wsi, HTTP_STATUS_NOT_FOUND, NULL);
        return -1;
    case LWS_CALLBACK_HTTP:
        return http_begin(server, wsi, request, in);
    case LWS_CALLBACK_HTTP_BODY:
        return http_take(request, in, length);
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
        return request->is_put ? http_put_errand(server, wsi, request) : 0;
    case LWS_CALLBACK_TIMER:
        if (request == NULL || request->errand == NULL)
            return 0;
        if (errand_is_done(request->errand))
            lws_callback_on_writable(wsi);
        else
            lws_set_timer_usecs(wsi, HTTP_ERRAND_US);
        return 0;
    case LWS_CALLBACK_HTTP_WRITEABLE:
        return request->errand == NULL ? http_write(wsi, request)
               : errand_is_done(request->errand)
                   ? http_errand_over(wsi, request)
                   : 0;
    case LWS_CALLBACK_CLOSED_HTTP:
        if (request != NULL)
            http_drop(request);
        return 0;
    default:
        return 0;
    }
}
