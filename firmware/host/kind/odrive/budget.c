/* firmware/host/kind/odrive/budget.c - what an ODrive has on its bus; see struct
 * rig_kind.
 *
 * Per tick: set point (8 bytes), the question for a position (remote) and its
 * answer (8 bytes); per heartbeat period one of 8 bytes.  It says its position
 * by itself too, every 10 ms as it is delivered, and is not asked in such a
 * tick: no more than one each tick, or one each 10 ms.  Where it is asked for its
 * torque, that and the answer (8 bytes) in the first tick after 10 ms; for each
 * reading that is monitored the same every 30 ms. */
#include "firmware/host/kind/turn/budget.h"
#include "firmware/host/kind/odrive/parts.h"
#include "hal/drive/odrive/drive.h"
#include "hal/support/float32.h"
#include "motion/core/fixed.h"

#define ODRIVE_ESTIMATES_NS INT64_C(10000000)
#define ODRIVE_TORQUE_NS    INT64_C(10000000)

static int64_t estimates_ns(const struct rig *rig)
{
    return rig->period_ns < ODRIVE_ESTIMATES_NS ? rig->period_ns
                                                : ODRIVE_ESTIMATES_NS;
}

/* What is monitored: a question each and its answer, behind the set point. */
static unsigned odrive_reading_frames(const struct rig_axis *axis,
                                      unsigned count,
                                      struct rig_frame frame[RIG_FRAMES_MAX])
{
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        if ((axis->monitor.wanted >> i & 1) == 0)
            continue;
        frame[count++] = (struct rig_frame){ "question", HAL_READING_NS,
                                             turn_classic_bits(0), 0, 0 };
        frame[count++] =
            (struct rig_frame){ hal_reading_text((enum hal_reading)i),
                                HAL_READING_NS, turn_classic_bits(8), 0, 0 };
    }
    return count;
}

unsigned odrive_frames(const struct rig *rig, unsigned i,
                       struct rig_frame frame[RIG_FRAMES_MAX])
{
    const int64_t tick_ns = rig->period_ns;
    const int64_t torque_ns =
        (ODRIVE_TORQUE_NS + tick_ns - 1) / tick_ns * tick_ns;

    frame[0] =
        (struct rig_frame){ "set point", tick_ns, turn_classic_bits(8), 0, 0 };
    frame[1] =
        (struct rig_frame){ "question", tick_ns, turn_classic_bits(0), 1, 0 };
    frame[2] = (struct rig_frame){ "feedback", estimates_ns(rig),
                                   turn_classic_bits(8), 1, 1 };
    frame[3] = (struct rig_frame){ "heartbeat", rig->heartbeat_ns,
                                   turn_classic_bits(8), 0, 0 };
    frame[4] = (struct rig_frame){ "torque question", torque_ns,
                                   turn_classic_bits(0), 1, 0 };
    frame[5] =
        (struct rig_frame){ "torque", torque_ns, turn_classic_bits(8), 1, 0 };
    return odrive_reading_frames(
        &rig->axis[i], rig->axis[i].rated_torque_mnm > 0 ? 6 : 4, frame);
}

/* ---- in the mean ---- */

#define ODRIVE_HEARTBEAT   0x01u
#define ODRIVE_ESTIMATES   0x09u
#define ODRIVE_IQ          0x14u
#define ODRIVE_TEMPERATURE 0x15u
#define ODRIVE_SUPPLY      0x17u
#define ODRIVE_TORQUES     0x1Cu
#define ODRIVE_CLOSED_LOOP 8u
#define ODRIVE_TICKS       10000

/* In which part of the ticks an ODrive is asked: it is not where it was heard
 * since the last one, by its own accord or as the answer to that one's
 * question. */
static double requested_share(const struct rig *rig)
{
    bool requested = false;
    int64_t told = 0, count = 0;

    for (int64_t i = 0; i < ODRIVE_TICKS; i++) {
        const int64_t by_profile =
            (i * rig->period_ns + rig->period_ns / 2) / ODRIVE_ESTIMATES_NS;

        requested = !requested && by_profile == told;
        told = by_profile;
        count += requested;
    }
    return (double)count / ODRIVE_TICKS;
}

/* As a number with as many bits as any. */
static void odrive_expect_readings(const struct rig_bus *bus,
                                   const struct rig_axis *axis, uint32_t id,
                                   uint32_t number, double *bits)
{
    static const uint8_t command[HAL_READINGS] = {
        [HAL_READING_TEMPERATURE] = ODRIVE_TEMPERATURE,
        [HAL_READING_VOLTAGE] = ODRIVE_SUPPLY,
        [HAL_READING_CURRENT] = ODRIVE_IQ,
    };

    for (unsigned i = 0; i < HAL_READINGS; i++) {
        struct hal_can_frame frame = { .id = id | command[i], .remote = true };

        if ((axis->monitor.wanted >> i & 1) == 0)
            continue;
        *bits++ = turn_frame_bits(bus, &frame);
        frame.remote = false;
        frame.len = 8;
        hal_float32_put(frame.data, number);
        hal_float32_put(&frame.data[4], number);
        *bits++ = turn_frame_bits(bus, &frame);
    }
}

void odrive_expect(const struct rig *rig, unsigned i,
                   const struct motion_state *state,
                   double bits[RIG_FRAMES_MAX])
{
    const struct rig_axis *axis = &rig->axis[i];
    const struct drive_turn_point point = turn_point_of(axis, state);
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const uint32_t id = (uint32_t)axis->node_id << 5;
    const double requested = requested_share(rig);
    struct hal_can_frame frame;

    drive_odrive_put_point(&frame, axis->node_id, &point);
    bits[0] = turn_frame_bits(bus, &frame);
    frame =
        (struct hal_can_frame){ .id = id | ODRIVE_ESTIMATES, .remote = true };
    bits[1] = requested * turn_frame_bits(bus, &frame);
    frame.remote = false;
    frame.len = 8;
    turn_put_estimates(frame.data, &point);
    bits[2] = (requested / (double)rig->period_ns + 1.0 / ODRIVE_ESTIMATES_NS) *
              (double)estimates_ns(rig) * turn_frame_bits(bus, &frame);
    frame = (struct hal_can_frame){ .id = id | ODRIVE_HEARTBEAT, .len = 8 };
    frame.data[4] = ODRIVE_CLOSED_LOOP;
    bits[3] = turn_frame_bits(bus, &frame);
    frame = (struct hal_can_frame){ .id = id | ODRIVE_TORQUES, .remote = true };
    bits[4] = turn_frame_bits(bus, &frame);
    /* a third of what is rated: a number with as many bits as any */
    const uint32_t torque = hal_float32_from_fixed(
        axis->rated_torque_mnm * MOTION_FIXED_ONE_Q32 / 3000, 32);
    frame.remote = false;
    frame.len = 8;
    hal_float32_put(frame.data, torque);
    hal_float32_put(&frame.data[4], torque);
    bits[5] = turn_frame_bits(bus, &frame);
    odrive_expect_readings(bus, axis, id, torque,
                           &bits[axis->rated_torque_mnm > 0 ? 6 : 4]);
}
