/* firmware/linux/tools/ask_can.c - see ask_can.h. */
#include "firmware/linux/tools/ask_can.h"

#include <inttypes.h>
#include <stdio.h>

#include "motion/core/err.h"

#define ASK_STEP_NS INT64_C(500000)
#define ASK_TRIES   3
#define ASK_OWN     127

static const struct canopen_node_ops ask_can_ops = { .step = NULL };

void ask_can_init(struct ask_can *ask, struct hal_can *can,
                  struct hal_clock *clock, int64_t timeout_ns)
{
    *ask = (struct ask_can){ .can = can,
                             .clock = clock,
                             .timeout_ns = timeout_ns };
    (void)ask_can_node(ask, 1);
}

int ask_can_node(struct ask_can *ask, uint8_t node_id)
{
    const struct canopen_config config = {
        .node_id = node_id == ASK_OWN ? ASK_OWN - 1 : ASK_OWN,
        .sdo_timeout_ns = ask->timeout_ns,
    };
    const int err = canopen_init(&ask->master, ask->can, &config);

    ask->node = (struct canopen_node){ .ops = &ask_can_ops, .id = node_id };
    canopen_lss_init(&ask->lss, &ask->master);
    return err < 0 ? err : canopen_add(&ask->master, &ask->node);
}

/* One turn of the master.  MOTION_E_IO: the bus is gone. */
static int ask_can_step(struct ask_can *ask)
{
    const int64_t now_ns = hal_clock_now_ns(ask->clock);

    if (hal_fieldbus_begin(&ask->master.fieldbus, now_ns) >=
        HAL_FIELDBUS_BUS_OFF)
        return MOTION_E_IO;
    (void)hal_clock_wait_until(ask->clock, now_ns + ASK_STEP_NS);
    return MOTION_OK;
}

void ask_can_wait(struct ask_can *ask, int64_t dur_ns)
{
    const int64_t end_ns = hal_clock_now_ns(ask->clock) + dur_ns;

    while (hal_clock_now_ns(ask->clock) < end_ns)
        if (ask_can_step(ask) < 0)
            return;
}

/* ---- SDO ---- */

/* A transfer, as bytes. */
struct ask_can_job {
    uint16_t index;
    uint8_t sub;
    uint8_t *into;
    const uint8_t *from; /* NULL: reading */
    uint32_t length;     /* or room */
};

static int ask_can_start(struct ask_can *ask, const struct ask_can_job *job)
{
    const int64_t now_ns = hal_clock_now_ns(ask->clock);

    return job->from == NULL
               ? canopen_sdo_read_bytes(&ask->node, now_ns, job->index,
                                        job->sub, job->into, job->length, false)
               : canopen_sdo_write_bytes(&ask->node, now_ns, job->index,
                                         job->sub, job->from, job->length,
                                         false);
}

static int ask_can_once(struct ask_can *ask, const struct ask_can_job *job)
{
    int err = ask_can_start(ask, job);

    if (err < 0)
        return err;
    do {
        err = ask_can_step(ask);
        if (err < 0)
            break;
        err = canopen_sdo_take(&ask->node, NULL, NULL);
    } while (err == MOTION_E_AGAIN);
    if (err == MOTION_E_IO)
        canopen_sdo_drop(&ask->node);
    ask->abort_code = ask->node.sdo.abort_code;
    return err;
}

static int ask_can_do(struct ask_can *ask, const struct ask_can_job *job)
{
    int err = MOTION_E_TIMEOUT;

    for (unsigned i = 0; i < ASK_TRIES && err == MOTION_E_TIMEOUT; i++)
        err = ask_can_once(ask, job);
    return err;
}

int ask_can_read(struct ask_can *ask, uint16_t index, uint8_t sub,
                 uint8_t *into, uint32_t room, uint32_t *length)
{
    const struct ask_can_job job = {
        .index = index, .sub = sub, .into = into, .length = room
    };
    const int err = ask_can_do(ask, &job);

    *length = err == MOTION_OK ? ask->node.sdo.length : 0;
    return err;
}

int ask_can_write(struct ask_can *ask, uint16_t index, uint8_t sub,
                  const uint8_t *from, uint32_t length)
{
    const struct ask_can_job job = {
        .index = index, .sub = sub, .from = from, .length = length
    };
    return ask_can_do(ask, &job);
}

int ask_can_read_number(struct ask_can *ask, uint16_t index, uint8_t sub,
                        uint32_t *value, uint8_t *size)
{
    uint8_t bytes[4] = { 0 };
    uint32_t length = 0;
    const int err = ask_can_read(ask, index, sub, bytes, sizeof bytes, &length);

    *value = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 |
             (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
    if (size != NULL)
        *size = (uint8_t)length;
    return err;
}

int ask_can_write_number(struct ask_can *ask, uint16_t index, uint8_t sub,
                         uint8_t size, uint32_t value)
{
    const uint8_t bytes[4] = { (uint8_t)value, (uint8_t)(value >> 8),
                               (uint8_t)(value >> 16), (uint8_t)(value >> 24) };
    return ask_can_write(ask, index, sub, bytes, size);
}

void ask_can_text(const struct ask_can *ask, int err,
                  char text[ASK_CAN_TEXT_MAX])
{
    if (err == MOTION_E_REFUSED)
        snprintf(text, ASK_CAN_TEXT_MAX, "%s (0x%08" PRIX32 ")",
                 canopen_abort_text(ask->abort_code), ask->abort_code);
    else if (err == MOTION_E_TIMEOUT)
        snprintf(text, ASK_CAN_TEXT_MAX, "node %u does not answer",
                 ask->node.id);
    else if (err == MOTION_E_IO)
        snprintf(
            text, ASK_CAN_TEXT_MAX, "the bus is gone: %s",
            hal_can_state_text((enum hal_can_state)hal_can_state(ask->can)));
    else
        snprintf(text, ASK_CAN_TEXT_MAX, "%s", motion_err_text(err));
}

/* ---- LSS ---- */

int ask_can_lss(struct ask_can *ask)
{
    int err;

    do {
        err = ask_can_step(ask);
        if (err < 0)
            return err;
        err = canopen_lss_take(&ask->lss);
    } while (err == MOTION_E_AGAIN);
    return err;
}
