/* firmware/linux/tools/modbus_client.c - see modbus_client.h. */
#include "firmware/linux/tools/modbus_client.h"

#include <stdio.h>

#include "motion/core/err.h"

#define REQUEST_STEP_NS     INT64_C(500000)
#define REQUEST_PATIENCE_NS INT64_C(1000000000) /* to be connected */
#define REQUEST_TRIES       3

void modbus_client_init(struct modbus_client *client, struct hal_modbus *line,
                        struct hal_clock *clock, uint8_t unit)
{
    *client =
        (struct modbus_client){ .line = line, .clock = clock, .unit = unit };
}

static void modbus_client_step(struct modbus_client *client)
{
    (void)hal_clock_wait_until(client->clock, hal_clock_now_ns(client->clock) +
                                                  REQUEST_STEP_NS);
}

static int modbus_client_connect(struct modbus_client *client)
{
    const int64_t end_ns =
        hal_clock_now_ns(client->clock) + REQUEST_PATIENCE_NS;

    while (hal_modbus_is_up(client->line) == 0) {
        if (hal_clock_now_ns(client->clock) > end_ns)
            return MOTION_E_IO;
        modbus_client_step(client);
    }
    return MOTION_OK;
}

int modbus_client(struct modbus_client *client,
                  const struct hal_modbus_request *request)
{
    int err = modbus_client_connect(client);

    client->reply = (struct hal_modbus_reply){ .err = err };
    if (err < 0)
        return err;
    err = hal_modbus_submit(client->line, request, ++client->tag);
    if (err < 0)
        return err;
    while (hal_modbus_collect(client->line, &client->reply) == 0)
        modbus_client_step(client);
    return client->reply.err;
}

/* What is only read, or written as a value, may be done twice. */
static int modbus_client_again(struct modbus_client *client,
                               const struct hal_modbus_request *request)
{
    int err = MOTION_E_TIMEOUT;

    for (unsigned i = 0; i < REQUEST_TRIES &&
                         (err == MOTION_E_TIMEOUT || err == MOTION_E_PROTOCOL ||
                          hal_modbus_is_missing(&client->reply));
         i++)
        err = modbus_client(client, request);
    return err;
}

int modbus_client_read_item(struct modbus_client *client,
                            const struct modbus_map_item *item, int64_t *value)
{
    struct hal_modbus_request request = { .unit = client->unit };
    int err;

    modbus_map_put_read(item, &request);
    request.unit = client->unit;
    err = modbus_client_again(client, &request);
    if (err == MOTION_OK &&
        !modbus_map_is_number(item->type, item->order, client->reply.value))
        err = MOTION_E_RANGE;
    if (err == MOTION_OK)
        *value = modbus_map_get(item->type, item->order, client->reply.value);
    return err;
}

int modbus_client_write_item(struct modbus_client *client,
                             const struct modbus_map_item *item, int64_t value)
{
    struct hal_modbus_request request = { .unit = client->unit };

    modbus_map_put_write(item, value, &request);
    request.unit = client->unit;
    return modbus_client_again(client, &request);
}

int modbus_client_status(struct modbus_client *client,
                         const struct modbus_map *map,
                         enum modbus_map_status status, bool *met)
{
    const struct modbus_map_condition *condition = &map->status[status];
    int64_t value = 0;
    int err;

    *met = false;
    if (condition->item == MODBUS_MAP_NO_ITEM)
        return MOTION_E_EMPTY;
    err = modbus_client_read_item(client, &map->item[condition->item], &value);
    if (err == MOTION_OK)
        *met = modbus_map_meets(condition, value);
    return err;
}

static int modbus_client_until(struct modbus_client *client,
                               const struct modbus_map *map,
                               const struct modbus_map_step *step)
{
    const int64_t end_ns = hal_clock_now_ns(client->clock) + step->dur_ns;

    for (;;) {
        bool met;
        const int err = modbus_client_status(client, map, step->status, &met);

        if (err < 0 || met == (step->value != 0))
            return err;
        if (hal_clock_now_ns(client->clock) > end_ns)
            return MOTION_E_TIMEOUT;
    }
}

int modbus_client_sequence(struct modbus_client *client,
                           const struct modbus_map *map,
                           enum modbus_map_sequence_name name)
{
    const struct modbus_map_sequence *sequence = &map->sequence[name];
    int err = MOTION_OK;

    for (unsigned i = 0; i < sequence->count && err == MOTION_OK; i++) {
        const struct modbus_map_step *step = &sequence->step[i];

        if (step->kind == MODBUS_STEP_WRITE)
            err = modbus_client_write_item(client, &map->item[step->item],
                                           step->value);
        else if (step->kind == MODBUS_STEP_UNTIL)
            err = modbus_client_until(client, map, step);
        else
            (void)hal_clock_wait_until(
                client->clock, hal_clock_now_ns(client->clock) + step->dur_ns);
    }
    return err;
}

void modbus_client_text(const struct modbus_client *client, int err,
                        char text[MODBUS_CLIENT_TEXT_MAX])
{
    if (err == MOTION_E_REFUSED && hal_modbus_is_missing(&client->reply))
        snprintf(text, MODBUS_CLIENT_TEXT_MAX,
                 "unit %u does not answer its gateway (exception %u)",
                 client->unit, client->reply.exception);
    else if (err == MOTION_E_REFUSED)
        snprintf(text, MODBUS_CLIENT_TEXT_MAX, "%s (exception %u)",
                 hal_modbus_exception_text(client->reply.exception),
                 client->reply.exception);
    else if (err == MOTION_E_TIMEOUT)
        snprintf(text, MODBUS_CLIENT_TEXT_MAX, "unit %u does not answer",
                 client->unit);
    else if (err == MOTION_E_IO)
        snprintf(text, MODBUS_CLIENT_TEXT_MAX, "no connection");
    else
        snprintf(text, MODBUS_CLIENT_TEXT_MAX, "%s", motion_err_text(err));
}
