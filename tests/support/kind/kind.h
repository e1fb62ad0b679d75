/* tests/support/kind/kind.h - a kind of drive to the tests that have something to say
 * of every kind: one row each, in a folder of its own (see
 * firmware/host/rig/kind.h). */
#ifndef TESTS_SUPPORT_KIND_KIND_H
#define TESTS_SUPPORT_KIND_KIND_H

#include "firmware/linux/machine/machine_sim.h"

enum kind_trouble { KIND_SILENT, KIND_BLOCKED, KIND_HEALED };

enum kind_turn_how {
    KIND_PLAIN,
    KIND_WATCHED, /* with a watchdog that slew sets, where the kind has one */
    KIND_OLD,     /* of the firmware before, likewise */
};

/* A drive that counts turns, with its simulated device, of which there is one.
 * A unit is a tenth of a turn. */
#define KIND_TURN_UNITS 10
struct kind_turn {
    const char *text; /* "ODrive" */
    struct hal_drive *(*init)(struct sim_can_bus *wire, struct can_bus *bus,
                              enum kind_turn_how how);
    /* Its driver anew, of the device as it is. */
    void (*restart)(struct can_bus *bus);
    struct sim_servo *servo; /* the device */
    int64_t counts;          /* of it, in a turn */
    bool (*has_torque)(void);
    /* Are there values in the data of a frame with this identifier? */
    bool (*has_values)(uint32_t id);
    /* For tests/conform, up to two; text NULL: no more. */
    struct kind_turn_conform {
        const char *text;
        enum kind_turn_how how;
        int64_t enable_ns, trip_ns;
    } conform[2];
};

struct kind_test {
    /* Of the servo itself, and of nothing that slew believes. */
    bool (*has_torque)(const void *servo);
    void (*trouble)(void *servo, enum kind_trouble trouble);
    const struct kind_turn *turn; /* NULL: it does not count turns */
};

#define KIND_TEST_ROW(NAME, name, word)                                        \
    extern const struct kind_test kind_test_##name;
RIG_KIND_LIST(KIND_TEST_ROW)
/* By enum rig_drive_kind. */
extern const struct kind_test *const kind_tests[RIG_DRIVE_KINDS];

/* What they are all given. */
extern const struct sim_plant_config kind_turn_plant;
extern const struct drive_turn_config kind_turn_config;

#endif
