/* firmware/host/kind/turn/budget.c - see budget.h.
 *
 * Source: ISO 11898-1 10.4.  The longest FD frame: extended identifier, a stuff
 * bit for every four of the stuffed bits after the first; CRC 21 and its fixed
 * stuff bits. */
#include "firmware/host/kind/turn/budget.h"

#include "hal/can/bits.h"
#include "hal/support/float32.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"

#define NS_PER_S 1e9

/* As budget_most_bits. */
double turn_classic_bits(unsigned bytes)
{
    const unsigned stuffed = (34 + 8 * bytes - 1) / 4;

    return 47 + 8 * bytes + stuffed;
}

/* Before the switch: start, 29 bits of identifier, SRR, IDE, RRS, FDF, res, BRS
 * and their stuff bits; after it the tail: CRC delimiter (half), ACK, end,
 * intermission.  Fast: ESI, DLC, data and their stuff bits, stuff count and CRC
 * with theirs (32 bits, sim/bus/can_bits.c). */
double turn_fd_bits(const struct rig_bus *bus, unsigned bytes)
{
    const unsigned head = 1 + 29 + 2 + 1 + 1 + 1 + 1;
    const unsigned tail = 1 + 1 + 1 + 7 + 3;
    const unsigned data = 1 + 4 + 8 * bytes;
    const double fast = data + data / 4.0 + 32;

    return head + (head - 1) / 4.0 + tail +
           fast * bus->bit_rate / bus->data_bit_rate;
}

/* ---- in the mean ---- */

/* The same in turns. */
struct drive_turn_point turn_point_of(const struct rig_axis *axis,
                                      const struct motion_state *state)
{
    struct drive_turn_point point = { 0 };
    int64_t num, den;

    rig_axis_turn(axis, &num, &den);
    (void)motion_fixed_muldiv(state->pos_q32, num, den, &point.pos_q32);
    (void)motion_fixed_muldiv(state->vel_q32, num, den, &point.vel_q32);
    return point;
}

/* Position and velocity, as both say them. */
void turn_put_estimates(uint8_t at[8], const struct drive_turn_point *point)
{
    hal_float32_put(at, hal_float32_from_fixed(point->pos_q32, 32));
    hal_float32_put(&at[4], hal_float32_from_fixed(point->vel_q32, 32));
}

double turn_frame_bits(const struct rig_bus *bus,
                       const struct hal_can_frame *frame)
{
    const struct can_bits bits = can_bits_of(frame);

    return bus->data_bit_rate == 0
               ? bits.slow
               : bits.slow +
                     (double)bits.fast * bus->bit_rate / bus->data_bit_rate;
}

/* ---- times ---- */

static int64_t bits_ns(const struct rig_bus *bus, double bits)
{
    return (int64_t)(bits * NS_PER_S / bus->bit_rate);
}

int64_t turn_budget_latency_ns(const struct rig *rig, unsigned i)
{
    struct rig_frame frame[RIG_FRAMES_MAX];
    double bits = 0;

    for (unsigned k = 0; k < rig->axis_count; k++) {
        if (rig->axis[k].bus != rig->axis[i].bus)
            continue;
        const unsigned count =
            rig_kinds[rig->axis[k].kind]->frames(rig, k, frame);
        for (unsigned n = 0; n < count; n++)
            if (frame[n].is_before || (n == 0 && k <= i))
                bits += frame[n].bits;
    }
    return bits_ns(&rig->bus[rig->axis[i].bus], bits);
}

int64_t turn_budget_answer_ns(const struct rig *rig, unsigned i)
{
    struct rig_frame frame[RIG_FRAMES_MAX];
    const unsigned count = rig_kinds[rig->axis[i].kind]->frames(rig, i, frame);
    unsigned at = 0;

    while (at + 1 < count && !frame[at].is_answer)
        at++;
    return bits_ns(&rig->bus[rig->axis[i].bus], frame[at].bits);
}
