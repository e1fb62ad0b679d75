/* firmware/linux/tools/canopen_client.c - see canopen_client.h. */
#include "firmware/linux/tools/canopen_client.h"

#include <inttypes.h>
#include <stdio.h>

#include "firmware/linux/tools/client_text.h"
#include "motion/core/err.h"

#define REQUEST_STEP_NS INT64_C(500000)
#define REQUEST_TRIES   3
#define REQUEST_OWN     127

static const struct canopen_node_ops canopen_client_ops = { .step = NULL };

void canopen_client_init(struct canopen_client *client, struct hal_can *can,
                         struct hal_clock *clock, int64_t timeout_ns)
{
    *client = (struct canopen_client){ .can = can,
                                       .clock = clock,
                                       .timeout_ns = timeout_ns };
    (void)canopen_client_node(client, 1);
}

int canopen_client_node(struct canopen_client *client, uint8_t node_id)
{
    const struct canopen_config config = {
        .node_id = node_id == REQUEST_OWN ? REQUEST_OWN - 1 : REQUEST_OWN,
        .sdo_timeout_ns = client->timeout_ns,
    };
    const int err = canopen_init(&client->master, client->can, &config);

    client->node =
        (struct canopen_node){ .ops = &canopen_client_ops, .id = node_id };
    canopen_lss_init(&client->lss, &client->master);
    return err < 0 ? err : canopen_add(&client->master, &client->node);
}

/* One turn of the master.  MOTION_E_IO: the bus is gone. */
static int canopen_client_step(struct canopen_client *client)
{
    const int64_t now_ns = hal_clock_now_ns(client->clock);

    if (hal_fieldbus_begin(&client->master.fieldbus, now_ns) >=
        HAL_FIELDBUS_BUS_OFF)
        return MOTION_E_IO;
    (void)hal_clock_wait_until(client->clock, now_ns + REQUEST_STEP_NS);
    return MOTION_OK;
}

void canopen_client_wait(struct canopen_client *client, int64_t dur_ns)
{
    const int64_t end_ns = hal_clock_now_ns(client->clock) + dur_ns;

    while (hal_clock_now_ns(client->clock) < end_ns)
        if (canopen_client_step(client) < 0)
            return;
}

/* ---- SDO ---- */

/* A transfer, as bytes. */
struct canopen_client_job {
    uint16_t index;
    uint8_t sub;
    uint8_t *into;
    const uint8_t *from; /* NULL: reading */
    uint32_t length;     /* or room */
};

static int canopen_client_start(struct canopen_client *client,
                                const struct canopen_client_job *job)
{
    const int64_t now_ns = hal_clock_now_ns(client->clock);

    return job->from == NULL
               ? canopen_sdo_read_bytes(&client->node, now_ns, job->index,
                                        job->sub, job->into, job->length, false)
               : canopen_sdo_write_bytes(&client->node, now_ns, job->index,
                                         job->sub, job->from, job->length,
                                         false);
}

static int canopen_client_once(struct canopen_client *client,
                               const struct canopen_client_job *job)
{
    int err = canopen_client_start(client, job);

    if (err < 0)
        return err;
    do {
        err = canopen_client_step(client);
        if (err < 0)
            break;
        err = canopen_sdo_take(&client->node, NULL, NULL);
    } while (err == MOTION_E_AGAIN);
    if (err == MOTION_E_IO)
        canopen_sdo_drop(&client->node);
    client->abort_code = client->node.sdo.abort_code;
    return err;
}

static int canopen_client_do(struct canopen_client *client,
                             const struct canopen_client_job *job)
{
    int err = MOTION_E_TIMEOUT;

    for (unsigned i = 0; i < REQUEST_TRIES && err == MOTION_E_TIMEOUT; i++)
        err = canopen_client_once(client, job);
    return err;
}

int canopen_client_read(struct canopen_client *client, uint16_t index,
                        uint8_t sub, uint8_t *into, uint32_t capacity,
                        uint32_t *length)
{
    const struct canopen_client_job job = {
        .index = index, .sub = sub, .into = into, .length = capacity
    };
    const int err = canopen_client_do(client, &job);

    *length = err == MOTION_OK ? client->node.sdo.length : 0;
    return err;
}

static int canopen_client_write(struct canopen_client *client, uint16_t index,
                                uint8_t sub, const uint8_t *from,
                                uint32_t length)
{
    const struct canopen_client_job job = {
        .index = index, .sub = sub, .from = from, .length = length
    };
    return canopen_client_do(client, &job);
}

int canopen_client_read_number(struct canopen_client *client, uint16_t index,
                               uint8_t sub, uint32_t *value, uint8_t *size)
{
    uint8_t bytes[4] = { 0 };
    uint32_t length = 0;
    const int err =
        canopen_client_read(client, index, sub, bytes, sizeof bytes, &length);

    *value = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 |
             (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
    if (size != NULL)
        *size = (uint8_t)length;
    return err;
}

int canopen_client_write_number(struct canopen_client *client, uint16_t index,
                                uint8_t sub, uint8_t size, uint32_t value)
{
    const uint8_t bytes[4] = { (uint8_t)value, (uint8_t)(value >> 8),
                               (uint8_t)(value >> 16), (uint8_t)(value >> 24) };
    return canopen_client_write(client, index, sub, bytes, size);
}

void canopen_client_text(const struct canopen_client *client, int err,
                         char text[CANOPEN_CLIENT_TEXT_MAX])
{
    if (err == MOTION_E_REFUSED)
        snprintf(text, CANOPEN_CLIENT_TEXT_MAX, "%s (0x%08" PRIX32 ")",
                 canopen_abort_text(client->abort_code), client->abort_code);
    else
        client_text(client->can, client->node.id, err, text,
                    CANOPEN_CLIENT_TEXT_MAX);
}

/* ---- LSS ---- */

int canopen_client_lss(struct canopen_client *client)
{
    int err;

    do {
        err = canopen_client_step(client);
        if (err < 0)
            return err;
        err = canopen_lss_take(&client->lss);
    } while (err == MOTION_E_AGAIN);
    return err;
}
