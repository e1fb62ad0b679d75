/* firmware/linux/rig/turns_budget.c - see turns_budget.h.
 *
 * ODrive, per tick: set point (8 bytes), the question for a position (remote)
 * and its answer (8 bytes); per heartbeat period one of 8 bytes.  An ODrive that
 * says its position by itself is not asked in that tick: never more than this.
 * moteus: one frame of 32 bytes with set point and questions, an answer of 24.
 *
 * Source: ISO 11898-1 10.4.  The longest FD frame: extended identifier, a stuff
 * bit for every four of the stuffed bits after the first; CRC 21 and its fixed
 * stuff bits. */
#include "firmware/linux/rig/turns_budget.h"

#define NS_PER_S 1e9

#define MOTEUS_ORDER_BYTES  32
#define MOTEUS_ANSWER_BYTES 24

/* As budget_most_bits. */
static double classic_bits(unsigned bytes)
{
    const unsigned stuffed = (34 + 8 * bytes - 1) / 4;

    return 47 + 8 * bytes + stuffed;
}

/* Before the switch: start, 29 bits of identifier, SRR, IDE, RRS, FDF, res, BRS
 * and their stuff bits; after it the tail: CRC delimiter (half), ACK, end,
 * intermission.  Fast: ESI, DLC, data and their stuff bits, stuff count and CRC
 * with theirs (32 bits, sim/can_bits.c). */
static double fd_bits(const struct rig_bus *bus, unsigned bytes)
{
    const unsigned head = 1 + 29 + 2 + 1 + 1 + 1 + 1;
    const unsigned tail = 1 + 1 + 1 + 7 + 3;
    const unsigned data = 1 + 4 + 8 * bytes;
    const double fast = data + data / 4.0 + 32;

    return head + (head - 1) / 4.0 + tail +
           fast * bus->bit_rate / bus->data_bit_rate;
}

unsigned turns_budget_frames(const struct rig *rig, unsigned i,
                             struct turns_frame frame[TURNS_FRAMES_MAX])
{
    const struct rig_axis *axis = &rig->axis[i];
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const int64_t tick_ns = rig->period_ns;

    if (axis->kind == RIG_MOTEUS) {
        frame[0] = (struct turns_frame){ "set point", tick_ns,
                                         fd_bits(bus, MOTEUS_ORDER_BYTES) };
        frame[1] = (struct turns_frame){ "feedback", tick_ns,
                                         fd_bits(bus, MOTEUS_ANSWER_BYTES) };
        return 2;
    }
    frame[0] = (struct turns_frame){ "set point", tick_ns, classic_bits(8) };
    frame[1] = (struct turns_frame){ "question", tick_ns, classic_bits(0) };
    frame[2] = (struct turns_frame){ "feedback", tick_ns, classic_bits(8) };
    frame[3] =
        (struct turns_frame){ "heartbeat", rig->heartbeat_ns, classic_bits(8) };
    return 4;
}

static int64_t bits_ns(const struct rig_bus *bus, double bits)
{
    return (int64_t)(bits * NS_PER_S / bus->bit_rate);
}

int64_t turns_budget_latency_ns(const struct rig *rig, unsigned i)
{
    struct turns_frame frame[TURNS_FRAMES_MAX];
    double bits = 0;

    for (unsigned k = 0; k < rig->axis_count; k++) {
        if (rig->axis[k].bus != rig->axis[i].bus)
            continue;
        (void)turns_budget_frames(rig, k, frame);
        if (k <= i) /* its set point */
            bits += frame[0].bits;
        if (rig->axis[k].kind == RIG_ODRIVE) /* asked before */
            bits += frame[1].bits + frame[2].bits;
    }
    return bits_ns(&rig->bus[rig->axis[i].bus], bits);
}

int64_t turns_budget_answer_ns(const struct rig *rig, unsigned i)
{
    struct turns_frame frame[TURNS_FRAMES_MAX];
    const unsigned at = rig->axis[i].kind == RIG_MOTEUS ? 1 : 2;

    (void)turns_budget_frames(rig, i, frame);
    return bits_ns(&rig->bus[rig->axis[i].bus], frame[at].bits);
}
