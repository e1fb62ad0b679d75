/* hal/drive/moteus/frame.h - the register sub-frames of a moteus, in and
 * out.
 *
 * The payload of a CAN FD frame is a row of sub-frames: what to do (write,
 * read, reply) and as which type in the upper bits, how many registers in the
 * lower two (0: the number follows), the first register, the values.  The rest
 * of the frame is filled with 0x50 (no operation) up to a length that FD has.
 * Writers stop quietly at 64 bytes; nothing here ever reaches beyond.
 *
 * Source: mjbots moteus, docs/protocol/can.md, docs/protocol/registers.md. */
#ifndef HAL_DRIVE_MOTEUS_FRAME_H
#define HAL_DRIVE_MOTEUS_FRAME_H

#include "hal/can.h"

enum moteus_register {
    MOTEUS_MODE = 0x000,
    MOTEUS_POSITION = 0x001,
    MOTEUS_VELOCITY = 0x002,
    MOTEUS_TORQUE = 0x003,
    MOTEUS_Q_CURRENT = 0x004,
    MOTEUS_TRAJECTORY_COMPLETE = 0x00B,
    MOTEUS_VOLTAGE = 0x00D,
    MOTEUS_TEMPERATURE = 0x00E,
    MOTEUS_FAULT = 0x00F,
    MOTEUS_COMMAND_POSITION = 0x020,
    MOTEUS_COMMAND_TIMEOUT = 0x027, /* watchdog; 0x028, 0x029: limits */
};

enum moteus_mode {
    MOTEUS_MODE_STOPPED = 0,
    MOTEUS_MODE_FAULT = 1,
    MOTEUS_MODE_POSITION = 10,
    MOTEUS_MODE_TIMEOUT = 11,
};

enum moteus_type {
    MOTEUS_INT8,
    MOTEUS_INT16,
    MOTEUS_INT32,
    MOTEUS_FLOAT,
};

/* ---- out ---- */

/* An FD frame from 0 to `id` (1..127) that asks for an answer. */
void moteus_frame_begin(struct hal_can_frame *frame, uint8_t id, bool switched);
/* 1..3 registers from `first` (up to 0x3FFF), each the lower bytes of its value. */
void moteus_frame_write(struct hal_can_frame *frame, enum moteus_type type,
                        unsigned first, const uint32_t *value, unsigned count);
void moteus_frame_read(struct hal_can_frame *frame, enum moteus_type type,
                       unsigned first, unsigned count);
void moteus_frame_end(struct hal_can_frame *frame);

/* ---- in ---- */

/* One value of an answer; raw has the sign of an integer in all its bits. */
struct moteus_value {
    unsigned reg;
    enum moteus_type type;
    int32_t raw;
};

struct moteus_reader {
    const struct hal_can_frame *frame;
    unsigned at;
    unsigned left; /* values of the present sub-frame */
    struct moteus_value next;
};

void moteus_reader_begin(struct moteus_reader *reader,
                         const struct hal_can_frame *frame);
/* 1: *value; 0: no more; MOTION_E_PROTOCOL: not a row of answers. */
int moteus_reader_next(struct moteus_reader *reader,
                       struct moteus_value *value);

/* ---- who is there ---- */

/* Asks `id` for its mode; it moves nothing. */
void moteus_frame_hello(struct hal_can_frame *frame, uint8_t id);
/* Is this the answer of a moteus to us?  Its id and its mode. */
bool moteus_frame_is_hello(const struct hal_can_frame *frame, uint8_t *id,
                           uint8_t *mode);

#endif
