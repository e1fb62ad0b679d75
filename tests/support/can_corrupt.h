/* tests/support/can_corrupt.h - a CAN port with a hand on what arrives.
 *
 * A frame is lost, comes twice, late (with all that follow it), cut short, from
 * another node, of another kind, is turned into a refusal, or comes with one
 * that nobody sent.  What is sent goes through.  Every corruption is one that a CRC
 * does not see: no bit of a value is changed. */
#ifndef TESTS_SUPPORT_CAN_CORRUPT_H
#define TESTS_SUPPORT_CAN_CORRUPT_H

#include <stdbool.h>
#include <stdint.h>

#include "tests/support/can_behind.h"

#define CAN_CORRUPT_HELD 512

enum can_corrupt_kind {
    CAN_CORRUPT_NONE,
    CAN_CORRUPT_LOSE,
    CAN_CORRUPT_REPEAT,
    CAN_CORRUPT_SHORT,
    CAN_CORRUPT_NODE,  /* of the node with the next number */
    CAN_CORRUPT_KIND,  /* bits 7-5 of the first byte of an SDO or LSS answer */
    CAN_CORRUPT_ABORT, /* an SDO answer: aborted instead */
    CAN_CORRUPT_DELAY, /* this one and all after it */
    CAN_CORRUPT_NOISE, /* a frame of any id, with anything in it, before it */
    CAN_CORRUPT_KINDS,
};

struct can_corrupt {
    struct can_behind port;
    uint64_t seed;
    unsigned one_in; /* so many frames for one that is corrupted; 0: none is */
    unsigned corrupt_at; /* or: the frame with this number, from 1, is */
    enum can_corrupt_kind corrupt_kind;
    unsigned taken; /* frames so far */
    /* NULL, or ids of frames that have values: noise has others. */
    bool (*has_values)(uint32_t id);
    int64_t late_ns; /* a delay is at most so long */
    struct hal_can_frame held[CAN_CORRUPT_HELD];
    unsigned head, count;
    int64_t now_ns, until_ns; /* the caller's; frames are held until then */
    unsigned done[CAN_CORRUPT_KINDS];
    /* NULL, or what the other side has sent, unharmed. */
    void (*heard)(void *context, const struct hal_can_frame *frame);
    void *context;
};

void can_corrupt_init(struct can_corrupt *self, struct hal_can *inner,
                      uint64_t seed);
/* The line is good again; what was held back arrives. */
void can_corrupt_mend(struct can_corrupt *self);
/* All corrupts together. */
unsigned can_corrupt_count(const struct can_corrupt *self);
/* How many a test is to do: CORRUPTIONS of the environment, or `preset`. */
unsigned can_corrupt_wanted(unsigned preset);
void can_corrupt_print(const struct can_corrupt *self);

#endif
