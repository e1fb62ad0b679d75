/* tests/support/can_harm.h - a CAN port with a hand on what arrives.
 *
 * A frame is lost, comes twice, late (with all that follow it), cut short, from
 * another node, of another kind, is turned into a refusal, or comes with one
 * that nobody sent.  What is sent goes through.  Every harm is one that a CRC
 * does not see: no bit of a value is changed. */
#ifndef TESTS_SUPPORT_CAN_HARM_H
#define TESTS_SUPPORT_CAN_HARM_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/can.h"

#define CAN_HARM_HELD 512

enum can_harm_kind {
    CAN_HARM_NONE,
    CAN_HARM_LOSE,
    CAN_HARM_REPEAT,
    CAN_HARM_SHORT,
    CAN_HARM_NODE,  /* of the node with the next number */
    CAN_HARM_KIND,  /* bits 7-5 of the first byte of an SDO or LSS answer */
    CAN_HARM_ABORT, /* an SDO answer: aborted instead */
    CAN_HARM_DELAY, /* this one and all after it */
    CAN_HARM_NOISE, /* a frame of any id, with anything in it, before it */
    CAN_HARM_KINDS,
};

struct can_harm {
    struct hal_can can, *inner;
    uint64_t seed;
    unsigned one_in;  /* so many frames for one that is harmed; 0: none is */
    unsigned harm_at; /* or: the frame with this number, from 1, is */
    enum can_harm_kind harm_kind;
    unsigned taken; /* frames so far */
    /* NULL, or ids of frames that have values: noise has others. */
    bool (*has_values)(uint32_t id);
    int64_t late_ns; /* a delay is at most so long */
    struct hal_can_frame held[CAN_HARM_HELD];
    unsigned head, count;
    int64_t now_ns, until_ns; /* the caller's; frames are held until then */
    unsigned done[CAN_HARM_KINDS];
    /* NULL, or what the other side has sent, unharmed. */
    void (*heard)(void *context, const struct hal_can_frame *frame);
    void *context;
};

void can_harm_init(struct can_harm *self, struct hal_can *inner, uint64_t seed);
/* The line is good again; what was held back arrives. */
void can_harm_mend(struct can_harm *self);
/* All harms together. */
unsigned can_harm_count(const struct can_harm *self);
/* How many a test is to do: HARMS of the environment, or `preset`. */
unsigned can_harm_wanted(unsigned preset);
void can_harm_print(const struct can_harm *self);

#endif
