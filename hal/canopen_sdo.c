/* hal/canopen_sdo.c - the SDO client, expedited transfers; see canopen.h.
 *
 * One transfer per node: IDLE -> WAIT -> DONE, ABORTED or TIMEOUT -> (take)
 * IDLE.  An answer belongs to the transfer when index and sub-index are the
 * ones asked for; anything else is a late answer to an older question and is
 * dropped.  A transfer that is given up is aborted on the wire too, so that the
 * server is in a known state for the next one. */
#include "hal/canopen_sdo.h"

#define SDO_WRITE         0x20u /* + size << 2, + 3: expedited, size given */
#define SDO_WRITE_DONE    0x60u
#define SDO_READ          0x40u
#define SDO_READ_DONE     0x40u
#define SDO_ABORT         0x80u
#define SDO_EXPEDITED     0x02u
#define SDO_SIZE_GIVEN    0x01u
#define SDO_COMMAND(byte) ((byte)&0xE0u)

static void canopen_sdo_put_u32(uint8_t *at, uint32_t value)
{
    for (unsigned i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> 8 * i);
}

static uint32_t canopen_sdo_get_u32(const uint8_t *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 |
           (uint32_t)at[3] << 24;
}

static int canopen_sdo_request(struct canopen_node *node, uint8_t command,
                               uint32_t value)
{
    struct hal_can_frame frame = { .id = CANOPEN_COB_SDO_REQUEST + node->id,
                                   .len = 8 };

    frame.data[0] = command;
    frame.data[1] = (uint8_t)node->sdo.index;
    frame.data[2] = (uint8_t)(node->sdo.index >> 8);
    frame.data[3] = node->sdo.sub;
    canopen_sdo_put_u32(&frame.data[4], value);
    return canopen_send(node->master, &frame);
}

static int canopen_sdo_start(struct canopen_node *node, int64_t now_ns,
                             const struct canopen_sdo *sdo, uint8_t command)
{
    struct canopen *master = node->master;
    int err;

    if (node->sdo.state != CANOPEN_SDO_IDLE)
        return MOTION_E_STATE;
    if (now_ns - master->sdo_started_ns < master->config.sdo_gap_ns)
        return MOTION_E_AGAIN;
    node->sdo = *sdo;
    err = canopen_sdo_request(node, command, sdo->value);
    if (err != MOTION_OK)
        return err;
    node->sdo.state = CANOPEN_SDO_WAIT;
    node->sdo.deadline_ns = now_ns + master->config.sdo_timeout_ns;
    master->sdo_started_ns = now_ns;
    return MOTION_OK;
}

int canopen_sdo_write(struct canopen_node *node, int64_t now_ns, uint16_t index,
                      uint8_t sub, uint8_t size, uint32_t value)
{
    const struct canopen_sdo sdo = {
        .write = true, .index = index, .sub = sub, .size = size, .value = value
    };

    if (size < 1 || size > 4)
        return MOTION_E_ARG;
    return canopen_sdo_start(node, now_ns, &sdo,
                             (uint8_t)(SDO_WRITE | (4u - size) << 2 |
                                       SDO_EXPEDITED | SDO_SIZE_GIVEN));
}

int canopen_sdo_read(struct canopen_node *node, int64_t now_ns, uint16_t index,
                     uint8_t sub)
{
    const struct canopen_sdo sdo = { .index = index, .sub = sub };

    return canopen_sdo_start(node, now_ns, &sdo, SDO_READ);
}

int canopen_sdo_take(struct canopen_node *node, uint32_t *value, uint8_t *size)
{
    struct canopen_sdo *sdo = &node->sdo;
    const int state = (int)sdo->state;

    if (state == CANOPEN_SDO_WAIT)
        return MOTION_E_AGAIN;
    if (state == CANOPEN_SDO_IDLE)
        return MOTION_E_STATE;
    sdo->state = CANOPEN_SDO_IDLE;
    if (state == CANOPEN_SDO_ABORTED)
        return MOTION_E_REFUSED;
    if (state == CANOPEN_SDO_TIMEOUT)
        return MOTION_E_TIMEOUT;
    if (value != NULL && !sdo->write)
        *value = sdo->value;
    if (size != NULL && !sdo->write)
        *size = sdo->size;
    return MOTION_OK;
}

void canopen_sdo_drop(struct canopen_node *node)
{
    node->sdo.state = CANOPEN_SDO_IDLE;
}

static void canopen_sdo_aborted(struct canopen_node *node, uint32_t code)
{
    node->sdo.state = CANOPEN_SDO_ABORTED;
    node->sdo.abort_code = code;
    node->master->stats.sdo_aborted++;
}

/* The answer makes no sense for what was asked: tell the server. */
static void canopen_sdo_give_up(struct canopen_node *node)
{
    canopen_sdo_request(node, SDO_ABORT, CANOPEN_ABORT_COMMAND);
    canopen_sdo_aborted(node, CANOPEN_ABORT_COMMAND);
}

static void canopen_sdo_done(struct canopen_node *node)
{
    node->sdo.state = CANOPEN_SDO_DONE;
    node->master->stats.sdo_done++;
}

/* 0x4F 0x4B 0x47 0x43: 1 to 4 bytes; 0x42: size not given, all four. */
static void canopen_sdo_read_done(struct canopen_node *node, uint8_t command,
                                  uint32_t value)
{
    const unsigned unused = command & SDO_SIZE_GIVEN ? command >> 2 & 3u : 0;

    node->sdo.size = (uint8_t)(4 - unused);
    node->sdo.value = value & UINT32_MAX >> 8 * unused;
    canopen_sdo_done(node);
}

static bool canopen_sdo_is_answer(const struct canopen_sdo *sdo,
                                  const uint8_t data[8])
{
    return sdo->state == CANOPEN_SDO_WAIT && data[1] == (uint8_t)sdo->index &&
           data[2] == (uint8_t)(sdo->index >> 8) && data[3] == sdo->sub;
}

static void canopen_sdo_answer(struct canopen_node *node, const uint8_t data[8])
{
    const uint8_t command = data[0];
    const uint32_t value = canopen_sdo_get_u32(&data[4]);

    if (SDO_COMMAND(command) == SDO_ABORT)
        canopen_sdo_aborted(node, value);
    else if (node->sdo.write && SDO_COMMAND(command) == SDO_WRITE_DONE)
        canopen_sdo_done(node);
    else if (!node->sdo.write && SDO_COMMAND(command) == SDO_READ_DONE &&
             (command & SDO_EXPEDITED) != 0)
        canopen_sdo_read_done(node, command, value);
    else
        canopen_sdo_give_up(node);
}

void canopen_sdo_receive(struct canopen_node *node,
                         const struct hal_can_frame *frame)
{
    if (frame->len != 8)
        node->master->stats.malformed++;
    else if (!canopen_sdo_is_answer(&node->sdo, frame->data))
        node->master->stats.unexpected++;
    else
        canopen_sdo_answer(node, frame->data);
}

void canopen_sdo_expire(struct canopen_node *node, int64_t now_ns)
{
    if (node->sdo.state != CANOPEN_SDO_WAIT || now_ns < node->sdo.deadline_ns)
        return;
    canopen_sdo_request(node, SDO_ABORT, CANOPEN_ABORT_TIMEOUT);
    node->sdo.state = CANOPEN_SDO_TIMEOUT;
    node->master->stats.sdo_timeouts++;
}
