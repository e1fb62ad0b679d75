/* tests/support/can_corrupt.c - see can_corrupt.h. */
#include "tests/support/can_corrupt.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal/support/container_of.h"
#include "tests/support/check.h"

#define SDO_ANSWER 0x580u
#define LSS_ANSWER 0x7E4u
#define FUNCTION   0x780u /* bits of an id; the rest is the node */
#define TPDO1      0x180u

static void can_corrupt_hold(struct can_corrupt *self,
                             const struct hal_can_frame *frame)
{
    assert_true(self->count < CAN_CORRUPT_HELD);
    self->held[(self->head + self->count++) % CAN_CORRUPT_HELD] = *frame;
}

static bool can_corrupt_is_sdo(const struct hal_can_frame *frame)
{
    return (frame->id & FUNCTION) == SDO_ANSWER;
}

/* A TPDO that is made up is a wrong value that nobody could tell; a frame of a
 * node that is there has its length then. */
static void can_corrupt_noise(struct can_corrupt *self)
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
    if (can_corrupt_is_sdo(&frame))
        frame.data[3] = 0xEE; /* of no object */
    can_corrupt_hold(self, &frame);
}

static void can_corrupt_abort(struct hal_can_frame *frame)
{
    if (!can_corrupt_is_sdo(frame))
        return;
    frame->data[0] = 0x80;
    memcpy(frame->data + 4, "\x00\x00\x00\x08", 4);
}

static bool can_corrupt_do(struct can_corrupt *self, enum can_corrupt_kind kind,
                           struct hal_can_frame *frame)
{
    switch (kind) {
    case CAN_CORRUPT_LOSE:
        return false;
    case CAN_CORRUPT_REPEAT:
        can_corrupt_hold(self, frame);
        break;
    case CAN_CORRUPT_SHORT:
        if (frame->len > 0)
            frame->len =
                (uint8_t)check_random_in(&self->seed, 0, frame->len - 1);
        break;
    case CAN_CORRUPT_NODE:
        frame->id = (frame->id & FUNCTION) | ((frame->id + 1) & 0x7F);
        break;
    case CAN_CORRUPT_KIND:
        if (can_corrupt_is_sdo(frame) || frame->id == LSS_ANSWER)
            frame->data[0] ^=
                (uint8_t)(check_random_in(&self->seed, 1, 7) << 5);
        break;
    case CAN_CORRUPT_ABORT:
        can_corrupt_abort(frame);
        break;
    case CAN_CORRUPT_DELAY:
        self->until_ns =
            self->now_ns + check_random_in(&self->seed, 1, self->late_ns);
        break;
    case CAN_CORRUPT_NOISE:
        can_corrupt_noise(self);
        break;
    case CAN_CORRUPT_NONE:
    case CAN_CORRUPT_KINDS:
        break;
    }
    return true;
}

static void can_corrupt_take(struct can_corrupt *self,
                             struct hal_can_frame *frame)
{
    enum can_corrupt_kind kind = CAN_CORRUPT_NONE;

    if (self->heard != NULL)
        self->heard(self->context, frame);
    if (self->one_in > 0 && check_random(&self->seed) % self->one_in == 0)
        kind = (enum can_corrupt_kind)check_random_in(&self->seed, 1,
                                                      CAN_CORRUPT_KINDS - 1);
    if (++self->taken == self->corrupt_at)
        kind = self->corrupt_kind;
    self->done[kind]++;
    if (can_corrupt_do(self, kind, frame))
        can_corrupt_hold(self, frame);
}

static struct can_corrupt *can_corrupt_of(struct hal_can *can)
{
    return CONTAINER_OF(can, struct can_corrupt, port.can);
}

static int can_corrupt_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct can_corrupt *self = can_corrupt_of(can);

    while (self->count < CAN_CORRUPT_HELD - 2 &&
           hal_can_recv(self->port.inner, frame) == 1)
        can_corrupt_take(self, frame);
    if (self->count == 0 || self->now_ns < self->until_ns)
        return 0;
    *frame = self->held[self->head];
    self->head = (self->head + 1) % CAN_CORRUPT_HELD;
    self->count--;
    return 1;
}

static const struct hal_can_ops can_corrupt_ops = {
    .send = can_behind_send,
    .flush = can_behind_flush,
    .recv = can_corrupt_recv,
    .state = can_behind_state,
    .stats = can_behind_stats,
};

void can_corrupt_init(struct can_corrupt *self, struct hal_can *inner,
                      uint64_t seed)
{
    *self = (struct can_corrupt){ .port = { { &can_corrupt_ops }, inner },
                                  .seed = seed,
                                  .late_ns = 40000000 };
}

void can_corrupt_mend(struct can_corrupt *self)
{
    self->one_in = 0;
    self->until_ns = self->now_ns;
}

unsigned can_corrupt_count(const struct can_corrupt *self)
{
    unsigned sum = 0;

    for (unsigned i = 1; i < CAN_CORRUPT_KINDS; i++)
        sum += self->done[i];
    return sum;
}

unsigned can_corrupt_wanted(unsigned preset)
{
    const char *given = getenv("CORRUPTIONS");

    return given != NULL ? (unsigned)strtoul(given, NULL, 10) : preset;
}

void can_corrupt_print(const struct can_corrupt *self)
{
    static const char *const name[CAN_CORRUPT_KINDS] = {
        "whole", "lost",    "twice",   "short", "other node",
        "kind",  "aborted", "delayed", "noise",
    };

    for (unsigned i = 1; i < CAN_CORRUPT_KINDS; i++)
        print_message("%s%u %s", i == 1 ? "corrupted: " : ", ", self->done[i],
                      name[i]);
    print_message("\n");
}
