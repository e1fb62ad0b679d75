/* hal/drive.h - a servo drive that follows a position, whatever its bus.
 *
 * All calls are non-blocking and cheap enough for the tick.  The drive object
 * keeps its own start-up and state machine and is moved on by its fieldbus
 * (hal/fieldbus.h); the controller asks for a condition and watches feedback
 * until it is there.  Positions are in the axis's unit; the drive knows the
 * gear.  Implementations: hal/drive_cia402.c, hal/drive_modbus.c. */
#ifndef HAL_DRIVE_H
#define HAL_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/err.h"

enum hal_drive_state {
    HAL_DRIVE_OFFLINE, /* not found, not configured, or lost */
    HAL_DRIVE_OFF,     /* there, configured, torque off */
    HAL_DRIVE_ENABLING,
    HAL_DRIVE_ENABLED,    /* follows set points */
    HAL_DRIVE_QUICK_STOP, /* ramping down or held by its own quick stop */
    HAL_DRIVE_FAULT,
};
const char *hal_drive_state_text(enum hal_drive_state state);

/* What the controller wants the drive to be. */
enum hal_drive_request {
    HAL_DRIVE_REQUEST_OFF,
    HAL_DRIVE_REQUEST_ENABLE,
    HAL_DRIVE_REQUEST_QUICK_STOP,
    HAL_DRIVE_REQUEST_RESET, /* clear a fault, or look anew for a drive that was
                                lost; then off, never by itself on.  Nothing
                                when there is no fault */
};

struct hal_drive_target {
    int64_t pos_q32; /* unit */
    int64_t vel_q32; /* unit/s, feed-forward */
    int64_t acc_q16; /* unit/s2, feed-forward */
};

struct hal_drive_feedback {
    enum hal_drive_state state;
    int64_t pos_q32;       /* actual */
    int64_t vel_q32;       /* actual; from position when the drive has none */
    int64_t t_ns;          /* when pos was measured (SYNC that latched it);
                              0: never yet */
    int64_t demand_age_ns; /* how long before t_ns the set point that was in
                              force at t_ns had been given to set_target, both
                              on the time of begin(); 0: what is in force does
                              not come from set_target */
    bool demand_known; /* the drive itself knows which set point was in force at
                          t_ns, demand_q32; demand_age_ns then says nothing */
    int64_t demand_q32;
    bool limit_negative, limit_positive; /* switch inputs of the drive */
    bool following;      /* the drive itself says that it follows set points;
                            false also at its own limit: hold then */
    uint16_t fault_code; /* maker's or profile's code, 0: none */
    char fault_text[64]; /* why it is in FAULT or OFFLINE, for a person */
};

struct hal_drive;

struct hal_drive_ops {
    void (*request)(struct hal_drive *drive, enum hal_drive_request request);
    /* Next set point; goes out with the fieldbus's end of cycle.
     * MOTION_E_RANGE when it does not fit the drive's own units, MOTION_E_LIMIT
     * when it is the first since enabling and too far from where the axis is
     * (the drive then is in FAULT); nothing is sent then.  While the drive is
     * not ENABLED a set point is checked and forgotten. */
    int (*set_target)(struct hal_drive *drive,
                      const struct hal_drive_target *target);
    void (*feedback)(struct hal_drive *drive,
                     struct hal_drive_feedback *feedback);
};

struct hal_drive {
    const struct hal_drive_ops *ops;
};

static inline void hal_drive_request(struct hal_drive *drive,
                                     enum hal_drive_request request)
{
    drive->ops->request(drive, request);
}

static inline int hal_drive_set_target(struct hal_drive *drive,
                                       const struct hal_drive_target *target)
{
    return drive->ops->set_target(drive, target);
}

static inline void hal_drive_feedback(struct hal_drive *drive,
                                      struct hal_drive_feedback *feedback)
{
    drive->ops->feedback(drive, feedback);
}

#endif
