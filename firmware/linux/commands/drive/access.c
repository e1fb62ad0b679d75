/* firmware/linux/commands/drive/access.c - slew drive get, set and store. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/drive/kind.h"

#define ACCESS_VALUES 20

#define ACCESS_ROW(NAME, name, word) [RIG_##NAME] = &verb_kind_##name,
const struct verb_kind *const verb_kinds[] = { RIG_KIND_LIST(ACCESS_ROW) };

const struct verb_kind *verb_kind_of(const struct session *session)
{
    unsigned kind = 0;

    while (kind + 1 < RIG_DRIVE_KINDS && tool_kinds[kind] != session->kind)
        kind++;
    return verb_kinds[kind];
}

/* ---- get ---- */

static enum status access_show(const struct options *options,
                               const struct session *session,
                               const struct drive_value *value, unsigned count)
{
    bool bad = false;

    for (unsigned i = 0; i < count; i++)
        bad = bad || value[i].error[0] != '\0';
    if (options->json) {
        cJSON *report = cJSON_CreateObject();

        cJSON_AddStringToObject(report, "drive", session->label);
        cJSON_AddItemToObject(report, "values",
                              drive_values_json(value, count));
        json_report(report, !bad);
    } else {
        drive_values_print(value, count);
    }
    return bad ? STATUS_REFUSED : STATUS_OK;
}

enum status drive_get(const struct options *options)
{
    static struct drive_what what[ACCESS_VALUES];
    static struct drive_value value[ACCESS_VALUES];
    const unsigned count = (unsigned)options->path_count - 3;
    struct session *session;
    enum status status = drive_open(options, &session);

    if (status != STATUS_OK)
        return status;
    for (unsigned i = 0; i < count && status == STATUS_OK; i++)
        status = verb_kind_of(session)->find(session, options->path[3 + i],
                                             options, &what[i]);
    for (unsigned i = 0; i < count && status == STATUS_OK; i++)
        verb_kind_of(session)->read(session, &what[i], &value[i]);
    if (status == STATUS_OK)
        status = access_show(options, session, value, count);
    drive_close(session);
    return status;
}

/* ---- set ---- */

static enum status access_verify(struct session *session,
                                 const struct drive_what *what, int64_t value,
                                 const struct options *options)
{
    static struct drive_value back;
    const struct verb_kind *kind = verb_kind_of(session);

    if (kind->is_readable != NULL && !kind->is_readable(what)) {
        printf("%s: written; it cannot be read back\n", session->label);
        return STATUS_OK;
    }
    kind->read(session, what, &back);
    const enum status status = access_show(options, session, &back, 1);

    if (status != STATUS_OK || back.value == value)
        return status;
    error_say("slew drive: %s: %s reads back %" PRId64 ", expected %" PRId64,
              session->label, back.number, back.value, value);
    return STATUS_REFUSED;
}

/* "6065 20000" or "6065=20000"; a negative one only so, or after --. */
static const char *access_words(const struct options *options, char *name,
                                size_t capacity)
{
    const char *first = options->path[3], *equals = strchr(first, '=');
    const size_t length =
        equals == NULL ? strlen(first) : (size_t)(equals - first);

    if ((equals == NULL) != (options->path_count == 5) || length >= capacity)
        return NULL;
    memcpy(name, first, length);
    name[length] = '\0';
    return equals == NULL ? options->path[4] : equals + 1;
}

/* Keeps what was set over power-off. */
static enum status access_store(struct session *session)
{
    const struct verb_kind *kind = verb_kind_of(session);
    char text[96];

    if (kind->store != NULL)
        return kind->store(session);
    snprintf(text, sizeof text, "it is stored by its maker's program: %s",
             kind->stored_by);
    return drive_complain(text);
}

static enum status access_set(struct session *session,
                              const struct options *options)
{
    static struct drive_what what;
    const struct verb_kind *kind = verb_kind_of(session);
    char name[OBJECT_MESSAGE_MAX];
    const char *text = access_words(options, name, sizeof name);
    enum status status;
    int64_t value = 0;
    int err;

    if (text == NULL)
        return drive_complain("set: expected an object or register and its "
                              "value, such as 6065 20000 or 607D:1=-2000");
    status = kind->find(session, name, options, &what);
    if (status != STATUS_OK)
        return status;
    if (kind->moves != NULL && kind->moves(&what))
        return drive_complain("that moves drives: slew run and slew drive "
                              "reset write it");
    if (kind->is_writable != NULL && !kind->is_writable(&what))
        return drive_complain("that is for reading only");
    status = drive_must_be_off(session, options);
    if (status == STATUS_OK)
        status = kind->parse(session, text, &what, &value);
    if (status != STATUS_OK)
        return status;
    err = kind->write(session, &what, value);
    if (err < 0)
        return drive_failed(session, name, err);
    status = access_verify(session, &what, value, options);
    return status == STATUS_OK && options->store ? access_store(session)
                                                 : status;
}

enum status drive_set(const struct options *options)
{
    struct session *session;
    enum status status = drive_open(options, &session);

    if (status != STATUS_OK)
        return status;
    status = access_set(session, options);
    drive_close(session);
    return status;
}

enum status drive_store(const struct options *options)
{
    struct session *session;
    enum status status = drive_open(options, &session);

    if (status != STATUS_OK)
        return status;
    status = drive_must_be_off(session, options);
    if (status == STATUS_OK)
        status = access_store(session);
    if (status == STATUS_OK)
        printf("%s: stored\n", session->label);
    drive_close(session);
    return status;
}
