/* hal/canopen/segment.c - the SDO client: long objects by segments of seven
 * bytes, each answered (CiA 301 7.2.4.2.4, 7.2.4.2.6). */
#include "hal/canopen/sdo.h"

#define SEGMENT_READ      0x60u /* + toggle */
#define SEGMENT_READ_DONE 0x00u
#define SEGMENT_WRITTEN   0x20u
#define SEGMENT_TOGGLE    0x10u
#define SEGMENT_LAST      0x01u

/* More than there is memory for. */
static void canopen_segment_overruns(struct canopen_node *node)
{
    canopen_sdo_give_up(node, node->sdo.into == NULL ? CANOPEN_ABORT_LENGTH
                                                     : CANOPEN_ABORT_MEMORY);
}

static void canopen_segment_request(struct canopen_node *node)
{
    const uint8_t data[8] = { (uint8_t)(SEGMENT_READ | node->sdo.toggle) };

    canopen_sdo_send(node, data);
}

void canopen_segment_read_begin(struct canopen_node *node, const uint8_t *data)
{
    struct canopen_sdo *sdo = &node->sdo;

    sdo->length = data[0] & SDO_SIZE_GIVEN ? canopen_sdo_get_u32(&data[4]) : 0;
    if (sdo->length > sdo->capacity) {
        canopen_segment_overruns(node);
        return;
    }
    sdo->step = CANOPEN_SDO_SEGMENT;
    canopen_segment_request(node);
}

static void canopen_segment_read(struct canopen_node *node, const uint8_t *data)
{
    struct canopen_sdo *sdo = &node->sdo;
    const uint32_t most = sdo->length > 0 ? sdo->length : sdo->capacity;
    const unsigned count = SDO_SEGMENT_BYTES - (data[0] >> 1 & 7u);
    const bool last = (data[0] & SEGMENT_LAST) != 0;
    uint8_t *to = sdo->into != NULL ? sdo->into : sdo->small;

    if (!last && count < SDO_SEGMENT_BYTES) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
        return;
    }
    if (count > most - sdo->at && sdo->length > 0) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_LENGTH);
        return;
    }
    if (count > most - sdo->at) {
        canopen_segment_overruns(node);
        return;
    }
    for (unsigned i = 0; i < count; i++)
        to[sdo->at + i] = data[1 + i];
    sdo->at += count;
    if (!last) {
        sdo->toggle ^= SEGMENT_TOGGLE;
        canopen_segment_request(node);
    } else if (sdo->length > 0 && sdo->at != sdo->length) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_LENGTH);
    } else {
        sdo->length = sdo->at;
        sdo->size = (uint8_t)sdo->at;
        sdo->value = canopen_sdo_get_u32(sdo->small);
        canopen_sdo_done(node);
    }
}

static unsigned canopen_segment_left(const struct canopen_sdo *sdo)
{
    const uint32_t left = sdo->length - sdo->at;

    return left < SDO_SEGMENT_BYTES ? (unsigned)left : SDO_SEGMENT_BYTES;
}

static void canopen_segment_put(struct canopen_node *node)
{
    const struct canopen_sdo *sdo = &node->sdo;
    const unsigned count = canopen_segment_left(sdo);
    const bool last = sdo->at + count == sdo->length;
    uint8_t data[8] = { (uint8_t)(sdo->toggle |
                                  (SDO_SEGMENT_BYTES - count) << 1 | last) };

    for (unsigned i = 0; i < count; i++)
        data[1 + i] = sdo->from[sdo->at + i];
    canopen_sdo_send(node, data);
}

void canopen_segment_write_begin(struct canopen_node *node)
{
    node->sdo.step = CANOPEN_SDO_SEGMENT;
    canopen_segment_put(node);
}

static void canopen_segment_written(struct canopen_node *node)
{
    struct canopen_sdo *sdo = &node->sdo;

    sdo->at += canopen_segment_left(sdo);
    if (sdo->at == sdo->length) {
        canopen_sdo_done(node);
        return;
    }
    sdo->toggle ^= SEGMENT_TOGGLE;
    canopen_segment_put(node);
}

void canopen_segment_receive(struct canopen_node *node, const uint8_t *data)
{
    const struct canopen_sdo *sdo = &node->sdo;
    const unsigned want = sdo->write ? SEGMENT_WRITTEN : SEGMENT_READ_DONE;

    if (SDO_COMMAND(data[0]) != want)
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
    else if ((data[0] & SEGMENT_TOGGLE) != sdo->toggle)
        canopen_sdo_give_up(node, CANOPEN_ABORT_TOGGLE);
    else if (sdo->write)
        canopen_segment_written(node);
    else
        canopen_segment_read(node, data);
}
