/* hal/canopen/block.c - the SDO client: long objects by blocks of up to 127
 * segments, acknowledged as a whole, with a CRC over all (CiA 301 7.2.4.3.9 to
 * 7.2.4.3.16).
 *
 *   read:   initiate, its answer (size) -> start -> segments ... acknowledge
 *           ... -> end (bytes unused in the last segment, CRC) -> end
 *   write:  initiate, its answer (block size) -> segments ... (acknowledged)
 *           ... -> end (unused, CRC) -> end
 *
 * A segment that is missing is noticed by its number; what was there up to it
 * is acknowledged, and the other side goes on from there. */
#include "hal/canopen/sdo.h"

#define BLOCK_READ_ANSWER  0xC0u
#define BLOCK_WRITE_ANSWER 0xA0u
#define BLOCK_CRC          0x04u
#define BLOCK_SIZE_GIVEN   0x02u
#define BLOCK_KIND         0xE3u /* command, and what of it */
#define BLOCK_START        0xA3u
#define BLOCK_ACKNOWLEDGE  0xA2u
#define BLOCK_END          0xC1u /* + unused << 2 */
#define BLOCK_END_DONE     0xA1u
#define BLOCK_LAST         0x80u
#define BLOCK_SIZE_MAX     127u

/* Segments that go out per cycle: a quarter of a millisecond of the wire. */
#define BLOCK_PACE 4u

/* CRC-16 of CCITT, polynomial 0x1021, from 0, up to byte `until`. */
static void canopen_block_crc(struct canopen_sdo *sdo, const uint8_t *bytes,
                              uint32_t until)
{
    for (; sdo->crc_at < until; sdo->crc_at++) {
        sdo->crc = (uint16_t)(sdo->crc ^ bytes[sdo->crc_at] << 8);
        for (unsigned bit = 0; bit < 8; bit++)
            sdo->crc = (uint16_t)((unsigned)sdo->crc << 1 ^
                                  (sdo->crc & 0x8000u ? 0x1021u : 0u));
    }
}

static uint16_t canopen_block_get_crc(const uint8_t *data)
{
    return (uint16_t)(data[1] | data[2] << 8);
}

/* ---- beginning ---- */

static void canopen_block_read_begin(struct canopen_node *node,
                                     const uint8_t *data)
{
    const uint8_t start[8] = { BLOCK_START };
    struct canopen_sdo *sdo = &node->sdo;

    sdo->checked = (data[0] & BLOCK_CRC) != 0;
    sdo->length =
        data[0] & BLOCK_SIZE_GIVEN ? canopen_sdo_get_u32(&data[4]) : 0;
    if (sdo->length > sdo->capacity) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_MEMORY);
        return;
    }
    sdo->step = CANOPEN_SDO_BLOCK;
    canopen_sdo_send(node, start);
}

/* MOTION_OK, or the transfer has been given up. */
static int canopen_block_next_size(struct canopen_node *node, uint8_t size)
{
    if (size < 1 || size > BLOCK_SIZE_MAX) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_BLOCK_SIZE);
        return MOTION_E_PROTOCOL;
    }
    node->sdo.block_size = size;
    node->sdo.sequence = 0;
    node->sdo.block_last = false;
    return MOTION_OK;
}

void canopen_block_begin(struct canopen_node *node, const uint8_t *data)
{
    struct canopen_sdo *sdo = &node->sdo;
    const unsigned want = sdo->write ? BLOCK_WRITE_ANSWER : BLOCK_READ_ANSWER;

    if (SDO_COMMAND(data[0]) != want || (data[0] & 1u) != 0) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
    } else if (!sdo->write) {
        canopen_block_read_begin(node, data);
    } else if (canopen_block_next_size(node, data[4]) == MOTION_OK) {
        sdo->checked = (data[0] & BLOCK_CRC) != 0;
        sdo->step = CANOPEN_SDO_BLOCK;
    }
}

/* ---- reading ---- */

static void canopen_block_acknowledge(struct canopen_node *node)
{
    struct canopen_sdo *sdo = &node->sdo;
    const uint8_t data[8] = { BLOCK_ACKNOWLEDGE, sdo->sequence,
                              sdo->block_size };

    if (sdo->block_last)
        sdo->step = CANOPEN_SDO_BLOCK_END;
    sdo->sequence = 0;
    canopen_sdo_send(node, data);
}

/* The last segment may be partly unused, which only the end says: up to six
 * bytes beyond the room are dropped, and the end decides. */
static void canopen_block_store(struct canopen_node *node, const uint8_t *data)
{
    struct canopen_sdo *sdo = &node->sdo;

    if (sdo->at >= sdo->capacity) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_MEMORY);
        return;
    }
    canopen_block_crc(sdo, sdo->into, sdo->at);
    for (unsigned i = 0; i < SDO_SEGMENT_BYTES && sdo->at + i < sdo->capacity;
         i++)
        sdo->into[sdo->at + i] = data[1 + i];
    sdo->at += SDO_SEGMENT_BYTES;
    sdo->sequence++;
    sdo->block_last = (data[0] & BLOCK_LAST) != 0;
}

static void canopen_block_segment(struct canopen_node *node,
                                  const uint8_t *data)
{
    struct canopen_sdo *sdo = &node->sdo;
    const uint8_t sequence = data[0] & 0x7Fu;
    const bool last = (data[0] & BLOCK_LAST) != 0;

    if (sequence == 0 || sequence > sdo->block_size) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_SEQUENCE);
        return;
    }
    if (sequence == sdo->sequence + 1)
        canopen_block_store(node, data);
    if (sdo->state == CANOPEN_SDO_WAIT && (last || sequence == sdo->block_size))
        canopen_block_acknowledge(node);
}

static void canopen_block_read_end(struct canopen_node *node,
                                   const uint8_t *data)
{
    const uint8_t done[8] = { BLOCK_END_DONE };
    struct canopen_sdo *sdo = &node->sdo;
    const uint32_t unused = data[0] >> 2 & 7u;
    const uint32_t length = sdo->at - unused; /* a segment was there: at >= 7 */

    if ((data[0] & BLOCK_KIND) != BLOCK_END) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
    } else if (length > sdo->capacity) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_MEMORY);
    } else if (sdo->length > 0 && length != sdo->length) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_LENGTH);
    } else {
        canopen_block_crc(sdo, sdo->into, length);
        if (sdo->checked && sdo->crc != canopen_block_get_crc(data)) {
            canopen_sdo_give_up(node, CANOPEN_ABORT_CRC);
            return;
        }
        sdo->length = length;
        canopen_sdo_send(node, done);
        canopen_sdo_done(node);
    }
}

/* ---- writing ---- */

/* Segment number sequence + 1 of this block; false: the port took it not. */
static bool canopen_block_put(struct canopen_node *node)
{
    struct canopen_sdo *sdo = &node->sdo;
    const uint32_t from = sdo->at + SDO_SEGMENT_BYTES * sdo->sequence;
    const bool last = sdo->length - from <= SDO_SEGMENT_BYTES;
    uint8_t data[8] = { (uint8_t)(sdo->sequence + 1) };

    if (last)
        data[0] |= BLOCK_LAST;
    for (unsigned i = 0; i < SDO_SEGMENT_BYTES && from + i < sdo->length; i++)
        data[1 + i] = sdo->from[from + i];
    if (canopen_sdo_send(node, data) != MOTION_OK)
        return false;
    sdo->sequence++;
    sdo->block_last = last;
    return true;
}

void canopen_sdo_pump(struct canopen_node *node, int64_t now_ns)
{
    struct canopen_sdo *sdo = &node->sdo;

    if (sdo->state != CANOPEN_SDO_WAIT || !sdo->write || !sdo->block ||
        sdo->step != CANOPEN_SDO_BLOCK)
        return;
    for (unsigned i = 0; i < BLOCK_PACE; i++) {
        if (sdo->block_last || sdo->sequence == sdo->block_size ||
            !canopen_block_put(node))
            return;
        sdo->deadline_ns = now_ns + node->master->config.sdo_timeout_ns;
    }
}

static void canopen_block_write_end(struct canopen_node *node)
{
    struct canopen_sdo *sdo = &node->sdo;
    unsigned unused = 0;
    uint8_t data[8] = { 0 };

    /* whole segments were acknowledged: at is past the end by what is unused */
    unused = (unsigned)(sdo->at - sdo->length);
    data[0] = (uint8_t)(BLOCK_END | unused << 2);
    canopen_block_crc(sdo, sdo->from, sdo->length);
    if (sdo->checked) {
        data[1] = (uint8_t)sdo->crc;
        data[2] = (uint8_t)(sdo->crc >> 8);
    }
    sdo->step = CANOPEN_SDO_BLOCK_END;
    canopen_sdo_send(node, data);
}

static void canopen_block_acknowledged(struct canopen_node *node,
                                       const uint8_t *data)
{
    struct canopen_sdo *sdo = &node->sdo;
    const uint8_t taken = data[1];

    if ((data[0] & BLOCK_KIND) != BLOCK_ACKNOWLEDGE) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
        return;
    }
    if (taken > sdo->sequence) {
        canopen_sdo_give_up(node, CANOPEN_ABORT_SEQUENCE);
        return;
    }
    sdo->at += SDO_SEGMENT_BYTES * taken;
    if (sdo->at >= sdo->length)
        canopen_block_write_end(node);
    else if (canopen_block_next_size(node, data[2]) == MOTION_OK)
        canopen_block_crc(sdo, sdo->from, sdo->at);
}

static void canopen_block_write_done(struct canopen_node *node,
                                     const uint8_t *data)
{
    if ((data[0] & BLOCK_KIND) != BLOCK_END_DONE)
        canopen_sdo_give_up(node, CANOPEN_ABORT_COMMAND);
    else
        canopen_sdo_done(node);
}

void canopen_block_receive(struct canopen_node *node, const uint8_t *data)
{
    const struct canopen_sdo *sdo = &node->sdo;
    const bool end = sdo->step == CANOPEN_SDO_BLOCK_END;

    if (sdo->write && end)
        canopen_block_write_done(node, data);
    else if (sdo->write)
        canopen_block_acknowledged(node, data);
    else if (end)
        canopen_block_read_end(node, data);
    else
        canopen_block_segment(node, data);
}
