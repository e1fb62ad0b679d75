/* hal/support/monitor.h - monitoring of a drive's temperature, bus voltage and
 * current: a drive around a drive, which has the same calls, and whose feedback
 * is in FAULT once a value is at its limit.
 *
 *   value near a limit        warning, no more (drive_monitor_level)
 *   at the limit              FAULT, in two answers in a row
 *   no answer for 3 periods   FAULT
 *
 * Near is 90 % of the way to the limit: from 0 for a temperature and a current,
 * from the middle of the two for a voltage.  It is over below 85 %.  Two answers
 * in a row, so that one spoiled answer stops nothing; both, and three periods,
 * are within 100 ms (hal/readings.h).
 *
 * A voltage below its low limit is one with the power stage on alone, as heard
 * since then: before, the DC link may be open or not charged yet (CiA 402-2,
 * power drive system: high voltage may be off below Switched on).
 *
 * A fault here is what a fault of the drive is to the controller, which stops the
 * group along the path and takes its torque then.  Meanwhile the drive follows
 * its set points as before: it is sound, and it is the path that must end.
 * Where it moves by a profile of its own it is told to quick stop.  The fault
 * latches: a reset ends it once every value is heard again and below its limit;
 * nothing is judged while the drive is offline.
 *
 * fault_code: as CiA 402-2 (2002) table of error codes has it, whatever the kind
 * of drive: 0x4310 excess temperature of the drive, 0x3210 and 0x3220 DC link
 * over- and under-voltage, 0x2310 continuous over-current; 0x7300 (sensor) for a
 * value that is missing. */
#ifndef HAL_SUPPORT_MONITOR_H
#define HAL_SUPPORT_MONITOR_H

#include "hal/drive.h"
#include "hal/readings.h"

struct drive_monitor_limit {
    /* thousandths of the unit; INT32_MIN, INT32_MAX: none.  Of a current: of
     * its magnitude, low is none */
    int32_t low_milli, high_milli;
};

/* How far a value is. */
struct drive_monitor_level {
    int32_t milli, limit_milli; /* the limit that is nearer */
    bool is_over, is_below;     /* 90 %, 85 % of the way */
};

/* Visible so that it can be static; use the functions. */
struct drive_monitor {
    struct hal_drive drive;
    struct hal_drive_ops ops; /* NULL what the drive around has not */
    struct hal_drive *inner;
    struct hal_readings *readings;
    struct {
        struct drive_monitor_limit limit, warn, rest;
        int64_t over_ns; /* of an answer at the limit; 0: the last was not */
    } of[HAL_READINGS];
    int64_t now_ns, online_ns; /* since when it is not offline */
    int64_t power_ns;          /* since when its power stage is on */
    bool online, has_power;
    uint16_t fault_code; /* 0: none */
    char fault_text[64];
};

/* Around `inner`, whose driver fills `readings`; what is wanted of these is
 * judged.  Both outlive it.  MOTION_E_ARG for a low limit that is not below the
 * high one, or a limit of a temperature or a current that is not above 0. */
int drive_monitor_init(struct drive_monitor *self, struct hal_drive *inner,
                       struct hal_readings *readings,
                       const struct drive_monitor_limit limit[HAL_READINGS]);

/* Once per tick, after the bus's begin() and before the feedback is asked for. */
void drive_monitor_step(struct drive_monitor *self, int64_t now_ns);

/* False: it is not judged, or has not been heard yet. */
bool drive_monitor_level(const struct drive_monitor *self,
                         enum hal_reading reading,
                         struct drive_monitor_level *level);
/* It is in fault by itself, not its drive. */
bool drive_monitor_is_latched(const struct drive_monitor *self);

#endif
