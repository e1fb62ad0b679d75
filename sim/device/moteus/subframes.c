/* sim/device/moteus/subframes.c - the sub-frames of a simulated moteus. */
#include <math.h>
#include <string.h>

#include "sim/device/moteus/parts.h"
#include "sim/util.h"

enum { MOTEUS_I8, MOTEUS_I16, MOTEUS_I32, MOTEUS_F32 };

static const unsigned moteus_size[] = { 1, 2, 4, 4 };

/* What one step of an integer is, by what is measured. */
static const struct moteus_unit {
    unsigned first, last; /* registers */
    double step[3];
} moteus_units[] = {
    { 0x001, 0x001, { 0.01, 0.0001, 0.00001 } }, /* position */
    { 0x002, 0x002, { 0.1, 0.00025, 0.00001 } }, /* velocity */
    { 0x003, 0x003, { 0.5, 0.01, 0.001 } },      /* torque */
    { 0x004, 0x005, { 1, 0.1, 0.001 } },         /* current */
    { 0x00D, 0x00D, { 0.5, 0.1, 0.001 } },       /* voltage */
    { 0x00E, 0x00E, { 1, 0.1, 0.001 } },         /* temperature */
    { 0x020, 0x020, { 0.01, 0.0001, 0.00001 } }, /* position */
    { 0x021, 0x021, { 0.1, 0.00025, 0.00001 } }, /* velocity */
    { 0x022, 0x022, { 0.5, 0.01, 0.001 } },      /* torque */
    { 0x023, 0x024, { 1 / 127.0, 1 / 32767.0, 1 / 2147483647.0 } },
    { 0x025, 0x025, { 0.5, 0.01, 0.001 } },      /* torque */
    { 0x026, 0x026, { 0.01, 0.0001, 0.00001 } }, /* position */
    { 0x027, 0x027, { 0.01, 0.001, 0.000001 } }, /* time */
    { 0x028, 0x028, { 0.1, 0.00025, 0.00001 } }, /* velocity */
    { 0x029, 0x029, { 0.05, 0.001, 0.00001 } },  /* acceleration */
};

static double moteus_step(unsigned reg, unsigned type)
{
    for (size_t i = 0; i < sizeof moteus_units / sizeof moteus_units[0]; i++)
        if (reg >= moteus_units[i].first && reg <= moteus_units[i].last)
            return moteus_units[i].step[type];
    return 1;
}

/* ---- values ---- */

/* The most negative integer is "not a number". */
static double moteus_decode(unsigned reg, unsigned type, const uint8_t *at)
{
    const double lowest[] = { -128, -32768, -2147483648.0 };
    int8_t byte;
    int16_t word;
    int32_t raw;
    float number;
    double value;

    if (type == MOTEUS_F32) {
        memcpy(&number, at, sizeof number);
        return (double)number;
    }
    memcpy(&byte, at, 1);
    value = byte;
    if (type == MOTEUS_I16) {
        memcpy(&word, at, sizeof word);
        value = word;
    } else if (type == MOTEUS_I32) {
        memcpy(&raw, at, sizeof raw);
        value = raw;
    }
    return value <= lowest[type] ? (double)NAN : value * moteus_step(reg, type);
}

static void moteus_encode(unsigned reg, unsigned type, double value,
                          uint8_t *at)
{
    const double highest[] = { 127, 32767, 2147483647.0 };
    const float number = (float)value;
    int32_t raw;
    double steps;

    if (type == MOTEUS_F32) {
        memcpy(at, &number, sizeof number);
        return;
    }
    steps = round(value / moteus_step(reg, type));
    if (isnan(steps))
        steps = -highest[type] - 1;
    else if (steps > highest[type])
        steps = highest[type];
    else if (steps < -highest[type])
        steps = -highest[type];
    raw = (int32_t)steps;
    memcpy(at, &raw, moteus_size[type]);
}

/* ---- the answer ---- */

static void moteus_append(struct hal_can_frame *frame, const uint8_t *bytes,
                          unsigned count)
{
    if (frame->len + count > HAL_CAN_FD_DATA_MAX)
        return;
    memcpy(&frame->data[frame->len], bytes, count);
    frame->len = (uint8_t)(frame->len + count);
}

/* In seven bits a byte, the lower ones first; returns the next free byte. */
static unsigned moteus_put_number(uint8_t *bytes, unsigned at, unsigned number)
{
    for (; number > 0x7F; number >>= 7)
        bytes[at++] = (uint8_t)(0x80 | number);
    bytes[at++] = (uint8_t)number;
    return at;
}

static void moteus_complain(struct hal_can_frame *answer, bool write,
                            unsigned reg)
{
    uint8_t bytes[8] = { write ? 0x30 : 0x31 };
    unsigned length = moteus_put_number(bytes, 1, reg);

    bytes[length++] = 1;
    moteus_append(answer, bytes, length);
}

static void moteus_answer(struct sim_moteus *self, struct hal_can_frame *answer,
                          unsigned type, unsigned reg, unsigned count)
{
    uint8_t bytes[8 + HAL_CAN_FD_DATA_MAX * 2] = { (uint8_t)(0x20 | type
                                                                        << 2) };
    unsigned length = 1;
    double value;

    if (count < 4)
        bytes[0] = (uint8_t)(bytes[0] | count);
    else
        bytes[length++] = (uint8_t)count;
    length = moteus_put_number(bytes, length, reg);
    for (unsigned i = 0; i < count; i++) {
        if (!sim_moteus_read(self, reg + i, &value)) {
            moteus_complain(answer, false, reg + i);
            return;
        }
        moteus_encode(reg + i, type, value, &bytes[length]);
        length += moteus_size[type];
    }
    moteus_append(answer, bytes, length);
}

/* ---- the question ---- */

struct moteus_cursor {
    const uint8_t *data;
    unsigned at, length;
};

static bool moteus_number(struct moteus_cursor *in, unsigned *number)
{
    *number = 0;
    for (unsigned shift = 0; shift < 28; shift += 7) {
        if (in->at >= in->length)
            return false;
        *number |= (in->data[in->at] & 0x7Fu) << shift;
        if ((in->data[in->at++] & 0x80) == 0)
            return true;
    }
    return false;
}

static bool moteus_write_values(struct sim_moteus *self,
                                struct moteus_cursor *in,
                                struct hal_can_frame *answer, unsigned type,
                                unsigned reg, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        if (in->at + moteus_size[type] > in->length)
            return false;
        if (!sim_moteus_write(self, reg + i,
                              moteus_decode(reg + i, type, &in->data[in->at])))
            moteus_complain(answer, true, reg + i);
        in->at += moteus_size[type];
    }
    return true;
}

/* One sub-frame; false: the rest of the frame makes no sense. */
static bool moteus_subframe(struct sim_moteus *self, struct moteus_cursor *in,
                            struct hal_can_frame *answer, bool *commanded)
{
    const unsigned head = in->data[in->at++];
    const unsigned type = head >> 2 & 3;
    unsigned count = head & 3, reg;

    if (head == 0x50)
        return true;
    if (head >= 0x20 || (count == 0 && !moteus_number(in, &count)) ||
        !moteus_number(in, &reg) || count > 32)
        return false;
    if (head >= 0x10) {
        moteus_answer(self, answer, type, reg, count);
        return true;
    }
    *commanded = true;
    return moteus_write_values(self, in, answer, type, reg, count);
}

/* The shortest length there is: FD has only some. */
static void moteus_pad(struct hal_can_frame *frame)
{
    while (!hal_can_is_legal(frame, true))
        frame->data[frame->len++] = 0x50;
}

void sim_moteus_on_frame(struct sim_servo *base,
                         const struct hal_can_frame *frame)
{
    struct sim_moteus *self = CONTAINER_OF(base, struct sim_moteus, base);
    struct moteus_cursor in = { frame->data, 0, frame->len };
    struct hal_can_frame answer = { .fd = true, .switched = frame->switched };
    bool commanded = false;

    if (frame->remote || self->base.deaf ||
        self->base.world->now_ns < self->base.boot_ns || frame->id > 0xFFFF ||
        (frame->id & 0xFF) != self->config.id)
        return;
    answer.id = (uint32_t)self->config.id << 8 | (frame->id >> 8 & 0x7F);
    answer.extended = answer.id > 0x7FF;
    while (in.at < in.length &&
           moteus_subframe(self, &in, &answer, &commanded)) {
    }
    if (commanded)
        sim_moteus_commanded(self);
    if ((frame->id & 0x8000) == 0 || answer.len == 0)
        return;
    moteus_pad(&answer);
    (void)hal_can_send(&self->base.port.can, &answer);
}
