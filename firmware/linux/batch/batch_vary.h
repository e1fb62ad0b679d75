/* firmware/linux/batch/batch_vary.h - what is varied from run to run, and by how
 * much: "pan.mass=0.5..2, *.friction=0..20 deg/s2, faults=20 %".
 *
 * A value is drawn evenly from its range, or, "pan.mass=1+-0.1", from a normal
 * distribution with that mean and standard deviation, from the seed, the number of the run
 * and what it is of: neither the order of the runs nor what else is varied
 * changes it. */
#ifndef FIRMWARE_LINUX_BATCH_BATCH_VARY_H
#define FIRMWARE_LINUX_BATCH_BATCH_VARY_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/fault/script.h"
#include "firmware/host/rig/rig.h"

/* X(NAME, word, quantity, digits after the unit, least, most, description);
 * least and most in the unit of the quantity. */
#define BATCH_WHAT_LIST(X)                                                     \
    X(MASS, "mass", RATIO, 0.05, 20,                                           \
      "the moved inertia, beside that of the rig: acceleration / m, "          \
      "bandwidth and damping / sqrt(m)")                                       \
    X(BANDWIDTH, "bandwidth", RATIO, 0.05, 20, "of the position loop, x rig")  \
    X(DAMPING, "damping", RATIO, 0.05, 20, "of the position loop, x rig")      \
    X(FRICTION, "friction", ACCELERATION, 0, 1e9,                              \
      "deceleration by friction, in the axis's unit / s2")                     \
    X(DELAY, "delay", TIME, 0, 1, "of every message of its drive")

enum batch_what {
#define BATCH_WHAT_ENUM(name, word, quantity, least, most, text) BATCH_##name,
    BATCH_WHAT_LIST(BATCH_WHAT_ENUM)
#undef BATCH_WHAT_ENUM
        BATCH_FAULTS, /* of a script, by chance */
    BATCH_WHATS
};

#define BATCH_MESSAGE_MAX 400
#define BATCH_NAME_MAX    (PLAN_NAME_MAX + 32)

struct batch_item {
    enum batch_what what;
    uint32_t axis;    /* of the rig */
    double low, high; /* ratio; unit/s2; s */
    /* above 0: normal about low with that standard deviation, and inside what
     * the kind can be */
    double deviation;
};

struct batch_vary {
    const struct rig *rig;
    uint64_t seed;
    struct batch_item *item;
    unsigned count;
    const struct fault_script *script; /* NULL: none */
    struct rig_sim *sim;               /* of each axis, as the rig has it */
    struct memory_pool memory;
};

/* `script` may be NULL.  0, or -1 and a sentence.  All zero before;
 * batch_vary_free in either case. */
int batch_vary_init(struct batch_vary *vary, const struct rig *rig,
                    const char *text, const struct fault_script *script,
                    uint64_t seed, char message[BATCH_MESSAGE_MAX]);
void batch_vary_free(struct batch_vary *vary);

/* "pan.friction_deg_s2" */
void batch_item_name(const struct batch_vary *vary, unsigned item,
                     char name[BATCH_NAME_MAX]);
/* Of BATCH_FAULTS: a bit for each fault of the script that happens. */
double batch_item_value(const struct batch_vary *vary, unsigned item,
                        uint64_t run);

/* The rig's simulated servos and what happens to them as they are in a run. */
void batch_vary_apply(const struct batch_vary *vary, uint64_t run,
                      struct rig *rig, struct fault_script *script);

#endif
