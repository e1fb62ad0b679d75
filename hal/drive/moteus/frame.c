/* hal/drive/moteus/frame.c - see frame.h. */
#include "hal/drive/moteus/frame.h"

#define WRITE   0x00u
#define READ    0x10u
#define REPLY   0x20u
#define TYPES   0x0Cu
#define COUNTS  0x03u
#define NOTHING 0x50u
#define ANSWER  0x8000u /* of an identifier: please */

static const uint8_t moteus_bytes[] = { [MOTEUS_INT8] = 1,
                                        [MOTEUS_INT16] = 2,
                                        [MOTEUS_INT32] = 4,
                                        [MOTEUS_FLOAT] = 4 };

/* ---- out ---- */

void moteus_frame_begin(struct hal_can_frame *frame, uint8_t id, bool switched)
{
    *frame = (struct hal_can_frame){
        .id = ANSWER | id, .extended = true, .fd = true, .switched = switched
    };
}

static void frame_put(struct hal_can_frame *frame, unsigned byte)
{
    if (frame->len < HAL_CAN_FD_DATA_MAX)
        frame->data[frame->len++] = (uint8_t)byte;
}

static void frame_head(struct hal_can_frame *frame, unsigned what,
                       enum moteus_type type, unsigned first, unsigned count)
{
    frame_put(frame, what | (unsigned)type << 2 | count);
    if (first > 0x7F)
        frame_put(frame, 0x80 | (first & 0x7F));
    frame_put(frame, first > 0x7F ? first >> 7 & 0x7F : first);
}

void moteus_frame_write(struct hal_can_frame *frame, enum moteus_type type,
                        unsigned first, const uint32_t *value, unsigned count)
{
    frame_head(frame, WRITE, type, first, count);
    for (unsigned i = 0; i < count; i++)
        for (unsigned k = 0; k < moteus_bytes[type]; k++)
            frame_put(frame, value[i] >> 8 * k & 0xFF);
}

void moteus_frame_read(struct hal_can_frame *frame, enum moteus_type type,
                       unsigned first, unsigned count)
{
    frame_head(frame, READ, type, first, count);
}

void moteus_frame_end(struct hal_can_frame *frame)
{
    while (frame->len < HAL_CAN_FD_DATA_MAX && !hal_can_is_legal(frame, true))
        frame_put(frame, NOTHING);
}

/* ---- in ---- */

void moteus_reader_begin(struct moteus_reader *reader,
                         const struct hal_can_frame *frame)
{
    *reader = (struct moteus_reader){ .frame = frame };
}

/* A number of seven bits each, at most two of them here: no register is beyond
 * 0x3FFF. */
static bool reader_number(struct moteus_reader *reader, unsigned *number)
{
    const struct hal_can_frame *frame = reader->frame;

    *number = 0;
    for (unsigned shift = 0; shift <= 7; shift += 7) {
        if (reader->at >= frame->len)
            return false;
        const unsigned byte = frame->data[reader->at++];

        *number |= (byte & 0x7F) << shift;
        if ((byte & 0x80) == 0)
            return true;
    }
    return false;
}

/* Of an answer; anything else is none of ours. */
static bool reader_head(struct moteus_reader *reader)
{
    const unsigned head = reader->frame->data[reader->at++];
    const unsigned count = head & COUNTS;

    if ((head & ~(TYPES | COUNTS)) != REPLY)
        return false;
    reader->next.type = (enum moteus_type)((head & TYPES) >> 2);
    reader->left = count;
    if (count == 0 && !reader_number(reader, &reader->left))
        return false;
    return reader_number(reader, &reader->next.reg);
}

static int32_t reader_raw(const uint8_t *at, unsigned bytes)
{
    uint32_t raw = 0;

    for (unsigned i = 0; i < bytes; i++)
        raw |= (uint32_t)at[i] << 8 * i;
    if (bytes == 1)
        return (int8_t)raw;
    return bytes == 2 ? (int16_t)raw : (int32_t)raw;
}

int moteus_reader_next(struct moteus_reader *reader, struct moteus_value *value)
{
    const struct hal_can_frame *frame = reader->frame;
    unsigned bytes;

    while (reader->left == 0) {
        while (reader->at < frame->len && frame->data[reader->at] == NOTHING)
            reader->at++;
        if (reader->at >= frame->len)
            return 0;
        if (!reader_head(reader))
            return MOTION_E_PROTOCOL;
    }
    bytes = moteus_bytes[reader->next.type];
    if (reader->at + bytes > frame->len)
        return MOTION_E_PROTOCOL;
    *value = reader->next;
    value->raw = reader_raw(&frame->data[reader->at], bytes);
    reader->at += bytes;
    reader->next.reg++;
    reader->left--;
    return 1;
}

/* ---- who is there ---- */

void moteus_frame_hello(struct hal_can_frame *frame, uint8_t id)
{
    moteus_frame_begin(frame, id, false);
    moteus_frame_read(frame, MOTEUS_INT8, MOTEUS_MODE, 1);
    moteus_frame_end(frame);
}

bool moteus_frame_is_hello(const struct hal_can_frame *frame, uint8_t *id,
                           uint8_t *mode)
{
    struct moteus_reader reader;
    struct moteus_value value;

    if (!frame->fd || (frame->id & 0xFF) != 0 || frame->id > 0x7F00)
        return false;
    moteus_reader_begin(&reader, frame);
    if (moteus_reader_next(&reader, &value) != 1 || value.reg != MOTEUS_MODE)
        return false;
    *id = (uint8_t)(frame->id >> 8);
    *mode = (uint8_t)value.raw;
    return true;
}
