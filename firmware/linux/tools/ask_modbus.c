/* firmware/linux/tools/ask_modbus.c - see ask_modbus.h. */
#include "firmware/linux/tools/ask_modbus.h"

#include <stdio.h>

#include "motion/core/err.h"

#define ASK_STEP_NS     INT64_C(500000)
#define ASK_PATIENCE_NS INT64_C(1000000000) /* to be connected */
#define ASK_TRIES       3

void ask_modbus_init(struct ask_modbus *ask, struct hal_modbus *line,
                     struct hal_clock *clock, uint8_t unit)
{
    *ask = (struct ask_modbus){ .line = line, .clock = clock, .unit = unit };
}

static void ask_modbus_step(struct ask_modbus *ask)
{
    (void)hal_clock_wait_until(ask->clock,
                               hal_clock_now_ns(ask->clock) + ASK_STEP_NS);
}

static int ask_modbus_connect(struct ask_modbus *ask)
{
    const int64_t end_ns = hal_clock_now_ns(ask->clock) + ASK_PATIENCE_NS;

    while (hal_modbus_is_up(ask->line) == 0) {
        if (hal_clock_now_ns(ask->clock) > end_ns)
            return MOTION_E_IO;
        ask_modbus_step(ask);
    }
    return MOTION_OK;
}

int ask_modbus(struct ask_modbus *ask, const struct hal_modbus_request *request)
{
    int err = ask_modbus_connect(ask);

    ask->reply = (struct hal_modbus_reply){ .err = err };
    if (err < 0)
        return err;
    err = hal_modbus_submit(ask->line, request, ++ask->tag);
    if (err < 0)
        return err;
    while (hal_modbus_collect(ask->line, &ask->reply) == 0)
        ask_modbus_step(ask);
    return ask->reply.err;
}

/* What is only read, or written as a value, may be done twice. */
static int ask_modbus_again(struct ask_modbus *ask,
                            const struct hal_modbus_request *request)
{
    int err = MOTION_E_TIMEOUT;

    for (unsigned i = 0;
         i < ASK_TRIES && (err == MOTION_E_TIMEOUT || err == MOTION_E_PROTOCOL);
         i++)
        err = ask_modbus(ask, request);
    return err;
}

int ask_modbus_read_item(struct ask_modbus *ask,
                         const struct modbus_map_item *item, int64_t *value)
{
    struct hal_modbus_request request = { .unit = ask->unit };
    int err;

    modbus_map_put_read(item, &request);
    request.unit = ask->unit;
    err = ask_modbus_again(ask, &request);
    if (err == MOTION_OK &&
        !modbus_map_is_number(item->type, item->order, ask->reply.value))
        err = MOTION_E_RANGE;
    if (err == MOTION_OK)
        *value = modbus_map_get(item->type, item->order, ask->reply.value);
    return err;
}

int ask_modbus_write_item(struct ask_modbus *ask,
                          const struct modbus_map_item *item, int64_t value)
{
    struct hal_modbus_request request = { .unit = ask->unit };

    modbus_map_put_write(item, value, &request);
    request.unit = ask->unit;
    return ask_modbus_again(ask, &request);
}

int ask_modbus_status(struct ask_modbus *ask, const struct modbus_map *map,
                      enum modbus_map_status status, bool *met)
{
    const struct modbus_map_condition *condition = &map->status[status];
    int64_t value = 0;
    int err;

    *met = false;
    if (condition->item == MODBUS_MAP_NO_ITEM)
        return MOTION_E_EMPTY;
    err = ask_modbus_read_item(ask, &map->item[condition->item], &value);
    if (err == MOTION_OK)
        *met = modbus_map_meets(condition, value);
    return err;
}

static int ask_modbus_until(struct ask_modbus *ask,
                            const struct modbus_map *map,
                            const struct modbus_map_step *step)
{
    const int64_t end_ns = hal_clock_now_ns(ask->clock) + step->dur_ns;

    for (;;) {
        bool met;
        const int err = ask_modbus_status(ask, map, step->status, &met);

        if (err < 0 || met == (step->value != 0))
            return err;
        if (hal_clock_now_ns(ask->clock) > end_ns)
            return MOTION_E_TIMEOUT;
    }
}

int ask_modbus_sequence(struct ask_modbus *ask, const struct modbus_map *map,
                        enum modbus_map_sequence_name name)
{
    const struct modbus_map_sequence *sequence = &map->sequence[name];
    int err = MOTION_OK;

    for (unsigned i = 0; i < sequence->count && err == MOTION_OK; i++) {
        const struct modbus_map_step *step = &sequence->step[i];

        if (step->kind == MODBUS_STEP_WRITE)
            err =
                ask_modbus_write_item(ask, &map->item[step->item], step->value);
        else if (step->kind == MODBUS_STEP_UNTIL)
            err = ask_modbus_until(ask, map, step);
        else
            (void)hal_clock_wait_until(
                ask->clock, hal_clock_now_ns(ask->clock) + step->dur_ns);
    }
    return err;
}

void ask_modbus_text(const struct ask_modbus *ask, int err,
                     char text[ASK_MODBUS_TEXT_MAX])
{
    if (err == MOTION_E_REFUSED)
        snprintf(text, ASK_MODBUS_TEXT_MAX, "%s (exception %u)",
                 hal_modbus_exception_text(ask->reply.exception),
                 ask->reply.exception);
    else if (err == MOTION_E_TIMEOUT)
        snprintf(text, ASK_MODBUS_TEXT_MAX, "unit %u does not answer",
                 ask->unit);
    else if (err == MOTION_E_IO)
        snprintf(text, ASK_MODBUS_TEXT_MAX, "no connection");
    else
        snprintf(text, ASK_MODBUS_TEXT_MAX, "%s", motion_err_text(err));
}
