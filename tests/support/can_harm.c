/* tests/support/can_harm.c - see can_harm.h. */
#include "tests/support/can_harm.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal/support/container_of.h"
#include "tests/support/check.h"

#define SDO_ANSWER 0x580u
#define LSS_ANSWER 0x7E4u
#define FUNCTION   0x780u /* bits of an id; the rest is the node */
#define TPDO1      0x180u

static void can_harm_hold(struct can_harm *self,
                          const struct hal_can_frame *frame)
{
    assert_true(self->count < CAN_HARM_HELD);
    self->held[(self->head + self->count++) % CAN_HARM_HELD] = *frame;
}

static bool can_harm_is_sdo(const struct hal_can_frame *frame)
{
    return (frame->id & FUNCTION) == SDO_ANSWER;
}

/* A TPDO that is made up is a wrong value that nobody could tell; a frame of a
 * node that is there has its length then. */
static void can_harm_noise(struct can_harm *self)
{
    struct hal_can_frame frame = {
        .id = (uint32_t)check_random_in(&self->seed, 0, 0x7FF),
        .len = (uint8_t)check_random_in(&self->seed, 0, 8),
    };

    for (unsigned i = 0; i < frame.len; i++)
        frame.data[i] = (uint8_t)check_random(&self->seed);
    if (self->has_values != NULL && self->has_values(frame.id))
        frame.id ^= 0x400;
    if (self->has_values == NULL && (frame.id & FUNCTION) == TPDO1)
        frame.len %= 6;
    if (can_harm_is_sdo(&frame))
        frame.data[3] = 0xEE; /* of no object */
    can_harm_hold(self, &frame);
}

static void can_harm_abort(struct hal_can_frame *frame)
{
    if (!can_harm_is_sdo(frame))
        return;
    frame->data[0] = 0x80;
    memcpy(frame->data + 4, "\x00\x00\x00\x08", 4);
}

static bool can_harm_do(struct can_harm *self, enum can_harm_kind kind,
                        struct hal_can_frame *frame)
{
    switch (kind) {
    case CAN_HARM_LOSE:
        return false;
    case CAN_HARM_REPEAT:
        can_harm_hold(self, frame);
        break;
    case CAN_HARM_SHORT:
        if (frame->len > 0)
            frame->len =
                (uint8_t)check_random_in(&self->seed, 0, frame->len - 1);
        break;
    case CAN_HARM_NODE:
        frame->id = (frame->id & FUNCTION) | ((frame->id + 1) & 0x7F);
        break;
    case CAN_HARM_KIND:
        if (can_harm_is_sdo(frame) || frame->id == LSS_ANSWER)
            frame->data[0] ^=
                (uint8_t)(check_random_in(&self->seed, 1, 7) << 5);
        break;
    case CAN_HARM_ABORT:
        can_harm_abort(frame);
        break;
    case CAN_HARM_DELAY:
        self->until_ns =
            self->now_ns + check_random_in(&self->seed, 1, self->late_ns);
        break;
    case CAN_HARM_NOISE:
        can_harm_noise(self);
        break;
    case CAN_HARM_NONE:
    case CAN_HARM_KINDS:
        break;
    }
    return true;
}

static void can_harm_take(struct can_harm *self, struct hal_can_frame *frame)
{
    enum can_harm_kind kind = CAN_HARM_NONE;

    if (self->heard != NULL)
        self->heard(self->context, frame);
    if (self->one_in > 0 && check_random(&self->seed) % self->one_in == 0)
        kind = (enum can_harm_kind)check_random_in(&self->seed, 1,
                                                   CAN_HARM_KINDS - 1);
    if (++self->taken == self->harm_at)
        kind = self->harm_kind;
    self->done[kind]++;
    if (can_harm_do(self, kind, frame))
        can_harm_hold(self, frame);
}

static struct can_harm *can_harm_of(struct hal_can *can)
{
    return CONTAINER_OF(can, struct can_harm, can);
}

static int can_harm_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    return hal_can_send(can_harm_of(can)->inner, frame);
}

static int can_harm_flush(struct hal_can *can)
{
    return hal_can_flush(can_harm_of(can)->inner);
}

static int can_harm_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct can_harm *self = can_harm_of(can);

    while (self->count < CAN_HARM_HELD - 2 &&
           hal_can_recv(self->inner, frame) == 1)
        can_harm_take(self, frame);
    if (self->count == 0 || self->now_ns < self->until_ns)
        return 0;
    *frame = self->held[self->head];
    self->head = (self->head + 1) % CAN_HARM_HELD;
    self->count--;
    return 1;
}

static int can_harm_state(struct hal_can *can)
{
    return hal_can_state(can_harm_of(can)->inner);
}

static void can_harm_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    hal_can_stats(can_harm_of(can)->inner, stats);
}

static const struct hal_can_ops can_harm_ops = {
    .send = can_harm_send,
    .flush = can_harm_flush,
    .recv = can_harm_recv,
    .state = can_harm_state,
    .stats = can_harm_stats,
};

void can_harm_init(struct can_harm *self, struct hal_can *inner, uint64_t seed)
{
    *self = (struct can_harm){ .can.ops = &can_harm_ops,
                               .inner = inner,
                               .seed = seed,
                               .late_ns = 40000000 };
}

void can_harm_mend(struct can_harm *self)
{
    self->one_in = 0;
    self->until_ns = self->now_ns;
}

unsigned can_harm_count(const struct can_harm *self)
{
    unsigned sum = 0;

    for (unsigned i = 1; i < CAN_HARM_KINDS; i++)
        sum += self->done[i];
    return sum;
}

unsigned can_harm_wanted(unsigned preset)
{
    const char *given = getenv("HARMS");

    return given != NULL ? (unsigned)strtoul(given, NULL, 10) : preset;
}

void can_harm_print(const struct can_harm *self)
{
    static const char *const name[CAN_HARM_KINDS] = {
        "whole", "lost",    "twice",   "short", "other node",
        "kind",  "aborted", "delayed", "noise",
    };

    for (unsigned i = 1; i < CAN_HARM_KINDS; i++)
        print_message("%s%u %s", i == 1 ? "harmed: " : ", ", self->done[i],
                      name[i]);
    print_message("\n");
}
