/* firmware/linux/kind/moteus/verbs.c - slew drive for a moteus: see
 * firmware/linux/commands/drive/kind.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/kind/moteus/quantity.h"
#include "firmware/linux/kind/turn/verbs.h"
#include "hal/drive/moteus/frame.h"

#define REGISTER_MAX 0x3FFF

/* A number that has a name has its type, too. */
static void moteus_register(struct quantity *quantity)
{
    unsigned count;
    const struct quantity *list = quantity_of_moteus(&count);

    for (unsigned i = 0; i < count; i++)
        if (list[i].at == quantity->at)
            *quantity = list[i];
}

static int moteus_find_one(const struct session *session, const char *text,
                           const struct options *options,
                           struct quantity *quantity,
                           char message[QUANTITY_MESSAGE_MAX])
{
    const struct quantity *list;
    uint16_t number;
    unsigned count;

    (void)session;
    if (turn_number(text, REGISTER_MAX, &number)) {
        *quantity = turn_by_number(QUANTITY_REGISTER, number);
        moteus_register(quantity);
        return turn_type(options, quantity, message);
    }
    list = quantity_of_moteus(&count);
    return turn_by_name(text, "register of a moteus", list, count, quantity,
                        message);
}

static enum status moteus_find(struct session *session, const char *text,
                               const struct options *options,
                               struct drive_what *what)
{
    return turn_find_quantity(session, text, options, &what->quantity,
                              moteus_find_one);
}

/* Its mode. */
static bool moteus_moves(const struct drive_what *what)
{
    return what->quantity.at == MOTEUS_MODE;
}

/* Byte by byte, as 0x010304 for 1.3.4. */
static void moteus_version(struct drive_value *value)
{
    if (strcmp(value->name, "firmware") == 0 && value->error[0] == '\0')
        snprintf(value->text, sizeof value->text, "%u.%u.%u",
                 (unsigned)(value->value >> 16 & 0xFF),
                 (unsigned)(value->value >> 8 & 0xFF),
                 (unsigned)(value->value & 0xFF));
}

static enum status moteus_info(struct session *session, struct drive_info *info)
{
    const int err = turn_client_hello(&session->turn);
    const struct quantity *list;
    unsigned count;

    if (err < 0)
        return drive_failed(session, "", err);
    list = quantity_of_moteus(&count);
    turn_read_list(session, list, count, info);
    for (unsigned i = 0; i < info->count; i++)
        moteus_version(&info->value[i]);
    return turn_info_fault(session, info);
}

const struct verb_kind verb_kind_moteus = {
    .what = "registers of a moteus by number or name: mode, 0x00F, voltage",
    .find = moteus_find,
    .read = turn_read,
    .parse = turn_parse,
    .write = turn_write,
    .moves = moteus_moves,
    .is_writable = turn_is_writable,
    .is_readable = turn_is_readable,
    .stored_by = "moteus_tool conf write",
    .info = moteus_info,
};
