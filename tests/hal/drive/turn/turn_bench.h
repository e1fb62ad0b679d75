/* tests/hal/drive/turn/turn_bench.h - a drive that takes set points in turns
 * frame by frame: the test plays the port, one
 * cycle per ms. */
#ifndef TESTS_HAL_DRIVE_TURN_TURN_BENCH_H
#define TESTS_HAL_DRIVE_TURN_TURN_BENCH_H

#include "tests/support/fake_can.h"

#include "hal/can/bus.h"
#include "hal/drive/turn/drive.h"
#include "motion/core/fixed.h"

#define MS  INT64_C(1000000)
#define ONE MOTION_FIXED_ONE_Q32

/* One unit is one turn. */
#define TURNS_BENCH_CONFIG                                                     \
    {                                                                          \
        .turns_num = 1, .turns_den = 1, .period_ns = 1 * MS,                   \
        .stop_acc_q32 = INT64_C(100) << 32, .rated_torque_mnm = 1000           \
    }

static struct fake_can fake;
static struct can_bus bus;
static struct hal_drive *subject;
static struct hal_drive_feedback seen;
static int64_t now_ns;
static enum hal_fieldbus_health bus_health; /* what begin() said last */

/* An empty bus, to which the test adds its drive. */
static inline void turn_bench_init(struct hal_drive *drive)
{
    fake_can_init(&fake);
    can_bus_init(&bus, &fake.can);
    subject = drive;
    now_ns = 1000 * MS;
}

static inline void begin(void)
{
    bus_health = hal_fieldbus_begin(&bus.fieldbus, now_ns);
    hal_drive_feedback(subject, &seen);
}

static inline void end(void)
{
    hal_fieldbus_end(&bus.fieldbus, now_ns);
    now_ns += 1 * MS;
}

static inline void cycle(void)
{
    begin();
    end();
}

static inline void hear(const char *text)
{
    fake_can_put(&fake, text);
    cycle();
}

/* A cycle: what it says, then where it is to be. */
static inline void aim(const char *text, const struct hal_drive_target *target)
{
    fake_can_put(&fake, text);
    begin();
    assert_int_equal(hal_drive_set_target(subject, target), 0);
    end();
}

#define expect(want) fake_can_expect(&fake, want)

#endif
