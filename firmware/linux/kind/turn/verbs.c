/* firmware/linux/kind/turn/verbs.c - see verbs.h. */
#include "firmware/linux/kind/turn/verbs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"

/* ---- what is meant ---- */

bool turn_number(const char *text, unsigned long most, uint16_t *number)
{
    char *end;
    const unsigned long value = strtoul(text, &end, 0);

    *number = (uint16_t)value;
    return end != text && *end == '\0' && value <= most;
}

int turn_type(const struct options *options, struct quantity *quantity,
              char message[QUANTITY_MESSAGE_MAX])
{
    if (options->type == NULL ||
        quantity_type_of(options->type, &quantity->type))
        return 0;
    snprintf(message, QUANTITY_MESSAGE_MAX,
             "--type: expected bool, u8, i8, u16, i16, u32, i32 or f32");
    return -1;
}

struct quantity turn_by_number(enum quantity_kind kind, uint16_t number)
{
    return (struct quantity){
        .kind = kind,
        .type = QUANTITY_F32,
        .at = number,
        .readable = true,
        .writable = true,
        .unit = "",
    };
}

int turn_by_name(const char *text, const char *what,
                 const struct quantity *list, unsigned count,
                 struct quantity *quantity, char message[QUANTITY_MESSAGE_MAX])
{
    const struct quantity *const found = quantity_find(text, list, count);

    if (found == NULL) {
        quantity_unknown(text, what, list, count, message);
        return -1;
    }
    *quantity = *found;
    return 0;
}

enum status turn_find_quantity(struct session *session, const char *text,
                               const struct options *options,
                               struct quantity *quantity, turn_find *find)
{
    char message[QUANTITY_MESSAGE_MAX];
    const int err = turn_client_hello(&session->turn);

    if (err < 0)
        return drive_failed(session, text, err);
    return find(session, text, options, quantity, message) == 0
               ? STATUS_OK
               : drive_complain(message);
}

/* ---- values ---- */

/* "= 12.5 mm" for turns, of an axis whose gear is known. */
static void value_turns_in_units(const struct session *session,
                                 struct drive_value *value)
{
    int64_t num, den;

    if (session->axis == NULL || strncmp(value->unit, "turns", 5) != 0)
        return;
    rig_axis_turn(session->axis, &num, &den);
    snprintf(value->text, sizeof value->text, "%.6g %s%s",
             value->real * (double)den / (double)num,
             units_axis_text(session->axis->unit),
             value->unit + strlen("turns"));
}

static void turn_read_quantity(struct session *session,
                               const struct quantity *quantity,
                               struct drive_value *value)
{
    uint32_t raw = 0;
    float real;
    int err;

    *value = (struct drive_value){ .is_number = true,
                                   .is_real = quantity->type == QUANTITY_F32 };
    quantity_number(quantity, value->number);
    snprintf(value->name, sizeof value->name, "%s", quantity->name);
    snprintf(value->type, sizeof value->type, "%s",
             quantity_type_text(quantity->type));
    snprintf(value->unit, sizeof value->unit, "%s", quantity->unit);
    err = turn_client_read(&session->turn, quantity, &raw);
    if (err < 0) {
        session_text(session, err, value->error);
        return;
    }
    value->value = quantity_value(quantity->type, raw);
    memcpy(&real, &raw, sizeof real);
    value->real = value->is_real ? (double)real : 0;
    if (quantity->words != NULL)
        snprintf(value->text, sizeof value->text, "%s",
                 quantity->words((unsigned)value->value));
    if (value->is_real)
        value_turns_in_units(session, value);
}

void turn_read_list(struct session *session, const struct quantity *list,
                    unsigned count, struct drive_info *info)
{
    for (unsigned i = 0; i < count && info->count < DRIVE_INFO_VALUES_MAX;
         i++) {
        if (list[i].writable) /* of no meaning at rest */
            continue;
        turn_read_quantity(session, &list[i], &info->value[info->count]);
        info->count += info->value[info->count].error[0] == '\0';
    }
}

enum status turn_info_fault(struct session *session, struct drive_info *info)
{
    struct turn_client_state state = { .is_fault = false };
    const int err = turn_client_state(&session->turn, &state);

    if (err < 0)
        return drive_failed(session, "", err);
    if (state.is_fault)
        turn_client_reason(&session->turn, &state, info->fault);
    return STATUS_OK;
}

/* ---- as members of struct verb_kind ---- */

void turn_read(struct session *session, const struct drive_what *what,
               struct drive_value *value)
{
    turn_read_quantity(session, &what->quantity, value);
}

enum status turn_parse(struct session *session, const char *text,
                       struct drive_what *what, int64_t *value)
{
    char message[QUANTITY_MESSAGE_MAX];
    uint32_t raw = 0;

    (void)session;
    if (quantity_parse(&what->quantity, text, &raw, message) < 0)
        return drive_complain(message);
    *value = quantity_value(what->quantity.type, raw);
    return STATUS_OK;
}

int turn_write(struct session *session, const struct drive_what *what,
               int64_t value)
{
    return turn_client_write(&session->turn, &what->quantity, (uint32_t)value);
}

bool turn_is_writable(const struct drive_what *what)
{
    return what->quantity.writable;
}

bool turn_is_readable(const struct drive_what *what)
{
    return what->quantity.readable;
}
