/* tests/conform/conform_drive.h - what every servo drive keeps to
 * (hal/drive.h), as claims that run on any drive with a device behind it. */
#ifndef TESTS_CONFORM_CONFORM_DRIVE_H
#define TESTS_CONFORM_CONFORM_DRIVE_H

#include "tests/support/check.h"

#include "hal/drive.h"
#include "hal/fieldbus.h"
#include "sim/world.h"

/* What the suite does to the device. */
enum conform_drive_trouble {
    CONFORM_DRIVE_TRIP,         /* a fault of its own that a reset clears */
    CONFORM_DRIVE_LASTING_TRIP, /* one that no reset clears until HEAL */
    CONFORM_DRIVE_SILENT,       /* off the bus until HEAL */
    CONFORM_DRIVE_HEAL,
};

/* Positions in the axis's unit, Q32.32; the axis can move by at least 20 units
 * either way from where it starts, at 20 units/s and 100 units/s2. */
struct conform_drive {
    const char *name;
    /* Device, bus and drive, new, at power-on; also tells where they are. */
    struct hal_drive *(*setup)(struct conform_drive *bench);
    struct sim_world *world;
    struct hal_fieldbus *fieldbus;
    /* What a ruler beside the axis says, at now_ns. */
    int64_t (*ruler_q32)(struct conform_drive *bench);
    void (*trouble)(struct conform_drive *bench,
                    enum conform_drive_trouble trouble);

    int64_t tick_ns;
    int64_t start_ns;  /* power-on to OFF, at most */
    int64_t enable_ns; /* OFF to ENABLED, at most */
    int64_t trip_ns;   /* its fault to FAULT, at most */
    int64_t silent_ns; /* its last word to OFFLINE, at most */
    /* Following: set point in force minus position at 20 units/s; position as
     * reported minus the ruler's at that time. */
    int64_t follow_q32, report_q32;
    int64_t stand_q32;  /* a standing axis may be off by */
    int64_t beyond_q32; /* a position that its units cannot say */
    bool lasts;         /* has a lasting trip */
    int homing_method;  /* where it has a homing */

    /* the suite's own */
    struct hal_drive *drive;
    struct hal_drive_feedback seen;
    int64_t now_ns;
};

/* Runs all claims; returns how many failed, as cmocka does. */
int conform_drive(struct conform_drive *bench);

#endif
