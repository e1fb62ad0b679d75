/* tests/firmware/linux/kind/machine_failures.h - a simulated drive of whatever kind
 * fails in a machine that is ready. */
#ifndef TESTS_FIRMWARE_LINUX_KIND_MACHINE_FAILURES_H
#define TESTS_FIRMWARE_LINUX_KIND_MACHINE_FAILURES_H

#include "sim/device/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"

struct failure {
    int axis;
    enum sim_servo_fault device;
    enum controller_fault fault;
    int64_t most_ms;
    const char *text; /* of the drive; "": it says nothing */
};

static inline void failure_inject(int axis, enum sim_servo_fault fault)
{
    sim_servo_inject(SERVO_OF(sim_servo, &sim, axis), fault);
}

/* Latched, the group off, nothing by itself. */
static inline void failure_stops_the_group(const struct failure *failure)
{
    const struct controller *controller = &machine.controller;
    const int64_t since_ns = now_ns;

    failure_inject(failure->axis, failure->device);
    until(CONTROLLER_FAULT);
    if (controller->fault.fault != failure->fault ||
        (controller->fault.axis != failure->axis &&
         controller->fault.axis != -1))
        fail_msg("fault %d of the drive: axis %d, %s", (int)failure->device,
                 controller->fault.axis,
                 controller_fault_text(controller->fault.fault));
    assert_in_range(now_ns - since_ns, 1, failure->most_ms * 1000000);
    if (failure->text[0] != '\0')
        assert_string_equal(controller->axis[failure->axis].feedback.fault_text,
                            failure->text);
    ticks(1000);
    assert_int_equal(controller->state, CONTROLLER_FAULT);
    assert_true(machine_is_at_rest(&machine));
}

/* It trips, is reset, and is enabled again. */
static inline void failure_is_over(int axis)
{
    failure_inject(axis, SIM_SERVO_TRIP);
    until(CONTROLLER_FAULT);
    ticks(300);
    assert_int_equal(controller_reset(&machine.controller), 0);
    until(CONTROLLER_OFF);
    assert_int_equal(controller_enable(&machine.controller), 0);
    until(CONTROLLER_READY);
}

#endif
