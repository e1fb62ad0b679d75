/* hal/canopen/sdo.c - the SDO client: start, expedited transfers, outcome; see
 * canopen.h.  Long objects: segment.c, block.c.
 *
 * One transfer per node, and per device of several axes: IDLE -> WAIT -> DONE,
 * ABORTED or TIMEOUT -> (take) IDLE.  An answer belongs to the transfer when
 * index and sub-index are the ones asked for; anything else is a late answer to
 * an older question and is dropped.  So is, where an earlier transfer on the same
 * object has not been answered, one of the wrong kind; and an abort, which is the
 * outcome all the same if nothing else comes.  A transfer that is given up is aborted
 * on the wire too, so that the server is in a known state for the next one. */
#include "hal/canopen/sdo.h"

#define SDO_BLOCK_READ     0xA4u /* CRC known */
#define SDO_BLOCK_WRITE    0xC6u /* CRC known, size given */
#define SDO_BLOCK_SEGMENTS 32u   /* that we take at a time */

static void canopen_sdo_put_u32(uint8_t *at, uint32_t value)
{
    for (unsigned i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> 8 * i);
}

uint32_t canopen_sdo_get_u32(const uint8_t *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 |
           (uint32_t)at[3] << 24;
}

int canopen_sdo_send(struct canopen_node *node, const uint8_t data[8])
{
    struct hal_can_frame frame = { .id = CANOPEN_COB_SDO_REQUEST + node->id,
                                   .len = 8 };

    for (unsigned i = 0; i < 8; i++)
        frame.data[i] = data[i];
    return can_cycle_send(&node->master->cycle, &frame);
}

/* Command, the transfer's index and sub-index, 4 bytes. */
static int canopen_sdo_request(struct canopen_node *node, uint8_t command,
                               uint32_t value)
{
    uint8_t data[8] = { command, (uint8_t)node->sdo.index,
                        (uint8_t)(node->sdo.index >> 8), node->sdo.sub };

    canopen_sdo_put_u32(&data[4], value);
    return canopen_sdo_send(node, data);
}

/* ---- beginning ---- */

int64_t canopen_sdo_timeout_ns(const struct canopen_node *node)
{
    return node->sdo_timeout_ns > 0 ? node->sdo_timeout_ns
                                    : node->master->config.sdo_timeout_ns;
}

/* It requests one again in every cycle as long as it needs one. */
static bool canopen_sdo_waits(const struct canopen_node *node, int64_t now_ns)
{
    return node->sdo.state == CANOPEN_SDO_IDLE &&
           now_ns - node->sdo_requested_ns <=
               2 * node->master->config.sync_period_ns;
}

/* The axes of a device share its SDO channel. */
static bool canopen_sdo_is_its_turn(const struct canopen_node *node,
                                    int64_t now_ns)
{
    for (const struct canopen_node *other = node->sibling; other != node;
         other = other->sibling)
        if (other->sdo.state == CANOPEN_SDO_WAIT ||
            (canopen_sdo_waits(other, now_ns) &&
             other->sdo_served_ns < node->sdo_served_ns))
            return false;
    return true;
}

static int canopen_sdo_start(struct canopen_node *node, int64_t now_ns,
                             const struct canopen_sdo *sdo, uint8_t command,
                             uint32_t value)
{
    struct canopen *master = node->master;
    int err;

    if (node->sdo.state != CANOPEN_SDO_IDLE)
        return MOTION_E_STATE;
    if (!canopen_sdo_is_its_turn(node, now_ns) ||
        now_ns - master->sdo_started_ns < master->config.sdo_gap_ns) {
        node->sdo_requested_ns = now_ns;
        return MOTION_E_AGAIN;
    }
    node->sdo = *sdo;
    err = canopen_sdo_request(node, command, value);
    if (err != MOTION_OK)
        return err;
    node->sdo.state = CANOPEN_SDO_WAIT;
    node->sdo.deadline_ns = now_ns + canopen_sdo_timeout_ns(node);
    node->sdo_served_ns = now_ns;
    master->sdo_started_ns = now_ns;
    return MOTION_OK;
}

static uint8_t canopen_sdo_expedited(unsigned size)
{
    return (uint8_t)(SDO_WRITE | (4u - size) << 2 | SDO_EXPEDITED |
                     SDO_SIZE_GIVEN);
}

int canopen_sdo_write(struct canopen_node *node, int64_t now_ns, uint16_t index,
                      uint8_t sub, uint8_t size, uint32_t value)
{
    const struct canopen_sdo sdo = {
        .write = true, .index = index, .sub = sub, .size = size, .value = value
    };

    if (size < 1 || size > 4)
        return MOTION_E_ARG;
    return canopen_sdo_start(node, now_ns, &sdo, canopen_sdo_expedited(size),
                             value);
}

int canopen_sdo_read(struct canopen_node *node, int64_t now_ns, uint16_t index,
                     uint8_t sub)
{
    const struct canopen_sdo sdo = { .index = index,
                                     .sub = sub,
                                     .capacity = sizeof sdo.small };

    return canopen_sdo_start(node, now_ns, &sdo, SDO_READ, 0);
}

int canopen_sdo_read_bytes(struct canopen_node *node, int64_t now_ns,
                           uint16_t index, uint8_t sub, uint8_t *into,
                           uint32_t capacity, bool block)
{
    const struct canopen_sdo sdo = { .index = index,
                                     .sub = sub,
                                     .into = into,
                                     .capacity = capacity,
                                     .block = block,
                                     .block_size = SDO_BLOCK_SEGMENTS };

    if (into == NULL || capacity == 0)
        return MOTION_E_ARG;
    return canopen_sdo_start(node, now_ns, &sdo,
                             block ? SDO_BLOCK_READ : SDO_READ,
                             block ? SDO_BLOCK_SEGMENTS : 0);
}

int canopen_sdo_write_bytes(struct canopen_node *node, int64_t now_ns,
                            uint16_t index, uint8_t sub, const uint8_t *from,
                            uint32_t length, bool block)
{
    const struct canopen_sdo sdo = { .write = true,
                                     .index = index,
                                     .sub = sub,
                                     .from = from,
                                     .length = length,
                                     .block = block };
    uint32_t value = 0;

    if (from == NULL || length == 0)
        return MOTION_E_ARG;
    if (block)
        return canopen_sdo_start(node, now_ns, &sdo, SDO_BLOCK_WRITE, length);
    if (length > 4)
        return canopen_sdo_start(node, now_ns, &sdo, SDO_WRITE | SDO_SIZE_GIVEN,
                                 length);
    for (unsigned i = 0; i < length; i++)
        value |= (uint32_t)from[i] << 8 * i;
    return canopen_sdo_start(node, now_ns, &sdo,
                             canopen_sdo_expedited((unsigned)length), value);
}

/* ---- the outcome ---- */

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

static struct canopen_sdo_late *
canopen_sdo_late_of(const struct canopen_node *node)
{
    return &node->master->node_at[node->id]->sdo_late;
}

static bool canopen_sdo_is_of(const struct canopen_sdo_late *late,
                              const struct canopen_sdo *sdo)
{
    return late->count > 0 && late->index == sdo->index &&
           late->sub == sdo->sub;
}

/* Its answer may come later; segments name no object, and are told from others. */
static void canopen_sdo_owe(const struct canopen_node *node)
{
    const struct canopen_sdo *sdo = &node->sdo;
    struct canopen_sdo_late *late = canopen_sdo_late_of(node);

    if (sdo->step != CANOPEN_SDO_INITIATE)
        return;
    if (!canopen_sdo_is_of(late, sdo))
        *late = (struct canopen_sdo_late){ sdo->index, sdo->sub, 0 };
    if (late->count < UINT8_MAX)
        late->count++;
}

/* In the middle of a long one the server would wait for the rest. */
void canopen_sdo_drop(struct canopen_node *node)
{
    if (node->sdo.state == CANOPEN_SDO_WAIT) {
        if (node->sdo.step != CANOPEN_SDO_INITIATE)
            canopen_sdo_request(node, SDO_ABORT, CANOPEN_ABORT_TIMEOUT);
        canopen_sdo_owe(node);
    }
    node->sdo.state = CANOPEN_SDO_IDLE;
}

static void canopen_sdo_aborted(struct canopen_node *node, uint32_t code)
{
    node->sdo.state = CANOPEN_SDO_ABORTED;
    node->sdo.abort_code = code;
    node->master->stats.sdo_aborted++;
}

void canopen_sdo_give_up(struct canopen_node *node, uint32_t abort_code)
{
    canopen_sdo_request(node, SDO_ABORT, abort_code);
    canopen_sdo_aborted(node, abort_code);
}

void canopen_sdo_done(struct canopen_node *node)
{
    node->sdo.state = CANOPEN_SDO_DONE;
    node->master->stats.sdo_done++;
}

void canopen_sdo_expire(struct canopen_node *node, int64_t now_ns)
{
    if (node->sdo.state != CANOPEN_SDO_WAIT || now_ns < node->sdo.deadline_ns)
        return;
    canopen_sdo_request(node, SDO_ABORT, CANOPEN_ABORT_TIMEOUT);
    if (node->sdo.doubtful_code != 0) {
        canopen_sdo_aborted(node, node->sdo.doubtful_code);
        return;
    }
    canopen_sdo_owe(node);
    node->sdo.state = CANOPEN_SDO_TIMEOUT;
    node->master->stats.sdo_timeouts++;
}

/* ---- answers ---- */

/* 0x4F 0x4B 0x47 0x43: 1 to 4 bytes; 0x42: size not given, all four. */
static void canopen_sdo_read_done(struct canopen_node *node,
                                  const uint8_t data[8])
{
    struct canopen_sdo *sdo = &node->sdo;
    const unsigned unused = data[0] & SDO_SIZE_GIVEN ? data[0] >> 2 & 3u : 0;

    sdo->size = (uint8_t)(4 - unused);
    sdo->value = canopen_sdo_get_u32(&data[4]) & UINT32_MAX >> 8 * unused;
    sdo->length = sdo->size;
    if (sdo->into != NULL && sdo->capacity < sdo->length) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_MEMORY);
        return;
    }
    for (unsigned i = 0; sdo->into != NULL && i < sdo->size; i++)
        sdo->into[i] = data[4 + i];
    canopen_sdo_done(node);
}

static void canopen_sdo_initiated(struct canopen_node *node,
                                  const uint8_t data[8])
{
    const struct canopen_sdo *sdo = &node->sdo;
    const unsigned command = SDO_COMMAND(data[0]);
    const bool is_long = sdo->from != NULL && sdo->length > 4;

    if (sdo->block)
        canopen_block_begin(node, data);
    else if (sdo->write && command == SDO_WRITE_DONE && is_long)
        canopen_segment_write_begin(node);
    else if (sdo->write && command == SDO_WRITE_DONE)
        canopen_sdo_done(node);
    else if (!sdo->write && command == SDO_READ_DONE &&
             (data[0] & SDO_EXPEDITED) != 0)
        canopen_sdo_read_done(node, data);
    else if (!sdo->write && command == SDO_READ_DONE)
        canopen_segment_read_begin(node, data);
    else
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
}

/* Only the beginning and the abort of a transfer name the object. */
static bool canopen_sdo_is_answer(const struct canopen_sdo *sdo,
                                  const uint8_t data[8])
{
    if (sdo->state != CANOPEN_SDO_WAIT)
        return false;
    if (sdo->step != CANOPEN_SDO_INITIATE && data[0] != SDO_ABORT)
        return true;
    return data[1] == (uint8_t)sdo->index &&
           data[2] == (uint8_t)(sdo->index >> 8) && data[3] == sdo->sub;
}

/* Is it of the kind that is waited for?  A segment of a block may look like
 * anything. */
static bool canopen_sdo_is_apt(const struct canopen_sdo *sdo,
                               const uint8_t data[8])
{
    const unsigned command = SDO_COMMAND(data[0]);

    if (sdo->block)
        return true;
    if (sdo->step == CANOPEN_SDO_INITIATE)
        return command == (sdo->write ? SDO_WRITE_DONE : SDO_READ_DONE);
    return command != SDO_WRITE_DONE && command != SDO_READ_DONE;
}

/* The answer to an earlier transfer on this object; an answer to one on another
 * means that none of before comes. */
static bool canopen_sdo_is_late(struct canopen_node *node,
                                const uint8_t data[8])
{
    struct canopen_sdo *sdo = &node->sdo;
    struct canopen_sdo_late *late = canopen_sdo_late_of(node);
    const bool aborts = data[0] == SDO_ABORT;

    if (!canopen_sdo_is_of(late, sdo)) {
        late->count = 0;
        return false;
    }
    if (!aborts && canopen_sdo_is_apt(sdo, data))
        return false;
    late->count--;
    if (aborts)
        sdo->doubtful_code = canopen_sdo_get_u32(&data[4]);
    return true;
}

static void canopen_sdo_answer(struct canopen_node *node, const uint8_t data[8])
{
    if (data[0] == SDO_ABORT) {
        canopen_sdo_aborted(node, canopen_sdo_get_u32(&data[4]));
        return;
    }
    switch (node->sdo.step) {
    case CANOPEN_SDO_INITIATE:
        canopen_sdo_initiated(node, data);
        break;
    case CANOPEN_SDO_SEGMENT:
        canopen_segment_receive(node, data);
        break;
    case CANOPEN_SDO_BLOCK:
    case CANOPEN_SDO_BLOCK_END:
        canopen_block_receive(node, data);
        break;
    }
}

void canopen_sdo_receive(struct canopen_node *node,
                         const struct hal_can_frame *frame, int64_t now_ns)
{
    const struct canopen_node *first = node;

    while (node->sdo.state != CANOPEN_SDO_WAIT && node->sibling != first)
        node = node->sibling;
    if (frame->len != 8) {
        node->master->stats.malformed++;
    } else if (!canopen_sdo_is_answer(&node->sdo, frame->data) ||
               canopen_sdo_is_late(node, frame->data)) {
        node->master->stats.unexpected++;
    } else {
        node->sdo.deadline_ns = now_ns + canopen_sdo_timeout_ns(node);
        canopen_sdo_answer(node, frame->data);
    }
}
