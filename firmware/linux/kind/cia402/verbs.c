/* firmware/linux/kind/cia402/verbs.c - slew drive for a CiA 402 drive: see
 * firmware/linux/commands/drive/kind.h. */
#include <stdio.h>

#include "firmware/linux/kind/cia402/verbs.h"
#include "motion/core/err.h"

#define VERBS_STORE    0x1010
#define VERBS_SAVE     UINT32_C(0x65766173) /* "save", CiA 301 7.5.2.13 */
#define VERBS_STORE_NS INT64_C(5000000000)
#define VERBS_CONTROL  0x6040

static enum status cia402_find(struct session *session, const char *text,
                               const struct options *options,
                               struct drive_what *what)
{
    char message[OBJECT_MESSAGE_MAX];

    if (object_find(text, session->eds, &what->object, message) < 0)
        return drive_complain(message);
    if (what->object.type == OBJECT_UNKNOWN && options->type != NULL &&
        !object_type_of(options->type, &what->object.type))
        return drive_complain("--type: expected u8, i8, u16, i16, u32 or i32");
    return STATUS_OK;
}

/* Its length is unknown: as long as what the drive answers. */
static void cia402_guess(struct session *session, struct object *object)
{
    static const uint8_t type[] = { 0, OBJECT_U8, OBJECT_U16, OBJECT_U32,
                                    OBJECT_U32 };
    uint32_t raw;
    uint8_t size = 0;

    if (object->type == OBJECT_UNKNOWN &&
        canopen_client_read_number(&session->can, object->index, object->sub,
                                   &raw, &size) == MOTION_OK &&
        size < sizeof type)
        object->type = type[size];
}

static void cia402_read(struct session *session, const struct drive_what *what,
                        struct drive_value *value)
{
    cia402_read_object(session, &what->object, value);
}

static enum status cia402_parse(struct session *session, const char *text,
                                struct drive_what *what, int64_t *value)
{
    char message[OBJECT_MESSAGE_MAX];

    cia402_guess(session, &what->object);
    return object_parse(&what->object, text, value, message) == 0
               ? STATUS_OK
               : drive_complain(message);
}

static int cia402_write(struct session *session, const struct drive_what *what,
                        int64_t value)
{
    return canopen_client_write_number(
        &session->can, what->object.index, what->object.sub,
        (uint8_t)object_type_size(what->object.type), (uint32_t)value);
}

/* The controlword. */
static bool cia402_moves(const struct drive_what *what)
{
    return what->object.index == VERBS_CONTROL;
}

static bool cia402_is_readable(const struct drive_what *what)
{
    return !what->object.in_eds || what->object.readable;
}

/* Takes a drive seconds: its memory is erased first. */
static enum status cia402_store(struct session *session)
{
    int err;

    session->can.timeout_ns = VERBS_STORE_NS;
    (void)canopen_client_node(&session->can, session->node);
    err = canopen_client_write_number(&session->can, VERBS_STORE, 1, 4,
                                      VERBS_SAVE);
    return err < 0 ? drive_failed(session, "cannot store (1010:1)", err)
                   : STATUS_OK;
}

const struct verb_kind verb_kind_cia402 = {
    .find = cia402_find,
    .read = cia402_read,
    .parse = cia402_parse,
    .write = cia402_write,
    .moves = cia402_moves,
    .is_readable = cia402_is_readable,
    .store = cia402_store,
    .info = cia402_info,
};
