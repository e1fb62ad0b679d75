/* firmware/linux/commands/run/jog_wanted.h - what the words of slew jog say, and
 * what came of it. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_JOG_WANTED_H
#define FIRMWARE_LINUX_COMMANDS_RUN_JOG_WANTED_H

#include "firmware/host/rig/rig.h"
#include "firmware/linux/commands/run/live.h"

#define JOG_DEAD_MAN_NS INT64_C(250000000)

/* What the words after the axis say. */
enum jog_kind { JOG_BY_KEYS, JOG_BY, JOG_TO, JOG_AT };

struct jog_wanted {
    const struct options *options;
    const struct rig_axis *rig_axis;
    unsigned axis;
    enum jog_kind kind;
    int64_t pos_q32;     /* BY: distance, TO: where */
    int64_t speed_q32;   /* highest, > 0; by keys 0: a tenth of the limit */
    int direction;       /* AT */
    int64_t for_ns;      /* AT */
    int64_t dead_man_ns; /* by keys */
};

struct jog_result {
    int64_t from_q32, pos_q32, dur_ns;
    bool homed;
    char fault[MACHINE_FAULT_MAX];
};

/* The axis and the words after it, within the limits of the axis: STATUS_OK, or
 * with a line on stderr STATUS_INPUT, or STATUS_REFUSED outside the limits. */
enum status jog_wanted_read(struct jog_wanted *want,
                            const struct options *options,
                            const struct live *live);
/* Which end it would leave: a line on stderr, STATUS_REFUSED. */
enum status jog_wanted_outside(const struct rig_axis *axis, int64_t pos_q32);
/* What will happen, on standard output. */
void jog_wanted_intent(const struct jog_wanted *want);

#endif
