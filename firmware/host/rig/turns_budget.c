/* firmware/host/rig/turns_budget.c - see turns_budget.h.
 *
 * ODrive, per tick: set point (8 bytes), the question for a position (remote)
 * and its answer (8 bytes); per heartbeat period one of 8 bytes.  It says its
 * position by itself too, every 10 ms as it is delivered, and is not asked in
 * such a tick: no more than one each tick, or one each 10 ms.
 * moteus: one frame of 32 bytes with set point and questions, an answer of 24.
 *
 * Source: ISO 11898-1 10.4.  The longest FD frame: extended identifier, a stuff
 * bit for every four of the stuffed bits after the first; CRC 21 and its fixed
 * stuff bits. */
#include "firmware/host/rig/turns_budget.h"

#include "hal/drive/moteus/drive.h"
#include "hal/drive/odrive/drive.h"
#include "hal/support/float32.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "sim/bus/can.h"

#define NS_PER_S 1e9

#define ODRIVE_ESTIMATES_NS INT64_C(10000000)
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
 * with theirs (32 bits, sim/bus/can_bits.c). */
static double fd_bits(const struct rig_bus *bus, unsigned bytes)
{
    const unsigned head = 1 + 29 + 2 + 1 + 1 + 1 + 1;
    const unsigned tail = 1 + 1 + 1 + 7 + 3;
    const unsigned data = 1 + 4 + 8 * bytes;
    const double fast = data + data / 4.0 + 32;

    return head + (head - 1) / 4.0 + tail +
           fast * bus->bit_rate / bus->data_bit_rate;
}

static int64_t estimates_ns(const struct rig *rig)
{
    return rig->period_ns < ODRIVE_ESTIMATES_NS ? rig->period_ns
                                                : ODRIVE_ESTIMATES_NS;
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
    frame[2] =
        (struct turns_frame){ "feedback", estimates_ns(rig), classic_bits(8) };
    frame[3] =
        (struct turns_frame){ "heartbeat", rig->heartbeat_ns, classic_bits(8) };
    return 4;
}

/* ---- in the mean ---- */

#define ODRIVE_HEARTBEAT   0x01u
#define ODRIVE_ESTIMATES   0x09u
#define ODRIVE_CLOSED_LOOP 8u
#define ODRIVE_TICKS       10000

/* The same in turns. */
static struct drive_turns_point turns_of(const struct rig_axis *axis,
                                         const struct motion_state *state)
{
    struct drive_turns_point point = { 0 };
    int64_t num, den;

    rig_axis_turns(axis, &num, &den);
    (void)motion_fixed_muldiv(state->pos_q32, num, den, &point.pos_q32);
    (void)motion_fixed_muldiv(state->vel_q32, num, den, &point.vel_q32);
    return point;
}

/* Position and velocity, as both say them. */
static void put_estimates(uint8_t at[8], const struct drive_turns_point *point)
{
    hal_float32_put(at, hal_float32_from_fixed(point->pos_q32, 32));
    hal_float32_put(&at[4], hal_float32_from_fixed(point->vel_q32, 32));
}

static double frame_bits(const struct rig_bus *bus,
                         const struct hal_can_frame *frame)
{
    const struct sim_can_bits bits = sim_can_frame_bits(frame);

    return bus->data_bit_rate == 0
               ? bits.slow
               : bits.slow +
                     (double)bits.fast * bus->bit_rate / bus->data_bit_rate;
}

/* In which part of the ticks an ODrive is asked: it is not where it was heard
 * since the last one, by its own accord or as the answer to that one's
 * question. */
static double asked_share(const struct rig *rig)
{
    bool asked = false;
    int64_t told = 0, count = 0;

    for (int64_t i = 0; i < ODRIVE_TICKS; i++) {
        const int64_t by_itself =
            (i * rig->period_ns + rig->period_ns / 2) / ODRIVE_ESTIMATES_NS;

        asked = !asked && by_itself == told;
        told = by_itself;
        count += asked;
    }
    return (double)count / ODRIVE_TICKS;
}

static void expect_odrive(const struct rig *rig, const struct rig_axis *axis,
                          const struct drive_turns_point *point,
                          double bits[TURNS_FRAMES_MAX])
{
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const uint32_t id = (uint32_t)axis->node_id << 5;
    const double asked = asked_share(rig);
    struct hal_can_frame frame;

    drive_odrive_put_point(&frame, axis->node_id, point);
    bits[0] = frame_bits(bus, &frame);
    frame =
        (struct hal_can_frame){ .id = id | ODRIVE_ESTIMATES, .remote = true };
    bits[1] = asked * frame_bits(bus, &frame);
    frame.remote = false;
    frame.len = 8;
    put_estimates(frame.data, point);
    bits[2] = (asked / (double)rig->period_ns + 1.0 / ODRIVE_ESTIMATES_NS) *
              (double)estimates_ns(rig) * frame_bits(bus, &frame);
    frame = (struct hal_can_frame){ .id = id | ODRIVE_HEARTBEAT, .len = 8 };
    frame.data[4] = ODRIVE_CLOSED_LOOP;
    bits[3] = frame_bits(bus, &frame);
}

/* Mode, position, velocity, torque, voltage, temperature, fault: the answer to
 * drive_moteus_put_questions; 24 V, 25 degrees. */
static void moteus_answer(struct hal_can_frame *frame,
                          const struct rig_axis *axis,
                          const struct drive_turns_point *point)
{
    static const uint8_t bytes[] = { 0x21, 0x00, MOTEUS_MODE_POSITION, 0x2F,
                                     MOTEUS_POSITION };
    static const uint8_t rest[] = { 0x23, MOTEUS_VOLTAGE, 48, 25, 0 };

    *frame = (struct hal_can_frame){ .id = (uint32_t)axis->node_id << 8,
                                     .fd = true };
    frame->extended = frame->id > 0x7FF;
    for (unsigned i = 0; i < sizeof bytes; i++)
        frame->data[frame->len++] = bytes[i];
    put_estimates(&frame->data[frame->len], point);
    frame->len += 12; /* and no torque */
    for (unsigned i = 0; i < sizeof rest; i++)
        frame->data[frame->len++] = rest[i];
    moteus_frame_end(frame);
}

static void expect_moteus(const struct rig *rig, const struct rig_axis *axis,
                          const struct drive_turns_point *point,
                          double bits[TURNS_FRAMES_MAX])
{
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const bool switched = bus->data_bit_rate > bus->bit_rate;
    struct hal_can_frame frame;

    moteus_frame_begin(&frame, axis->node_id, switched);
    drive_moteus_put_point(&frame, (uint16_t)(rig->watchdog_ns / 1000000),
                           point);
    drive_moteus_put_questions(&frame);
    moteus_frame_end(&frame);
    bits[0] = frame_bits(bus, &frame);
    moteus_answer(&frame, axis, point);
    frame.switched = switched;
    bits[1] = frame_bits(bus, &frame);
}

void turns_budget_expect(const struct rig *rig, unsigned i,
                         const struct motion_state *state,
                         double bits[TURNS_FRAMES_MAX])
{
    const struct rig_axis *axis = &rig->axis[i];
    const struct drive_turns_point point = turns_of(axis, state);

    if (axis->kind == RIG_MOTEUS)
        expect_moteus(rig, axis, &point, bits);
    else
        expect_odrive(rig, axis, &point, bits);
}

/* ---- times ---- */

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
