/* hal/drive.h - a servo drive that follows a position, whatever its bus.
 *
 * All calls are non-blocking and cheap enough for the tick.  The drive object
 * keeps its own start-up and state machine and is moved on by its fieldbus
 * (hal/fieldbus.h); the controller asks for a condition and watches feedback
 * until it is there.  Positions are in the axis's unit; the drive has the
 * gear.
 *
 * A drive begins in the first mode, following set points.  Some can also move
 * by ramps of their own; those have the optional calls.  Rules for all:
 *   - a mode changes only when it is asked for, and only at standstill;
 *   - after a fault, and after the drive was lost, torque is off, nothing
 *     moves and nothing is resumed: enable, set the mode and go again;
 *   - every wait has a time-out that ends in FAULT with a sentence.
 * Implementations: hal/drive/<kind>/drive.c, a folder for each kind of drive;
 * tests/conform/conform_drive.c is what all keep to. */
#ifndef HAL_DRIVE_H
#define HAL_DRIVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

enum hal_drive_state {
    HAL_DRIVE_OFFLINE, /* not found, not configured, or lost */
    HAL_DRIVE_OFF,     /* there, configured, torque off */
    HAL_DRIVE_ENABLING,
    HAL_DRIVE_ENABLED,    /* follows set points */
    HAL_DRIVE_QUICK_STOP, /* ramping down or held by its own quick stop */
    HAL_DRIVE_FAULT,
};
const char *hal_drive_state_text(enum hal_drive_state state);

/* What the controller requests the drive to be.  The two ways to no torque are
 * those of IEC 61800-5-2 and IEC 60204-1. */
enum hal_drive_request {
    /* Safe stop 1, stop category 1: what moves is brought to rest in the
     * drive's own way, and torque goes when the axis stands.  What has not come
     * to rest in its time loses it all the same: HAL_DRIVE_STOP_NS of a ramp,
     * HAL_DRIVE_ROLL_NS after its end */
    HAL_DRIVE_REQUEST_OFF,
    HAL_DRIVE_REQUEST_ENABLE,
    HAL_DRIVE_REQUEST_QUICK_STOP,
    HAL_DRIVE_REQUEST_RESET, /* clear a fault, or look anew for a drive that was
                                lost; then off, never by itself on.  Nothing
                                when there is no fault */
    /* Safe torque off, stop category 0: at once, in motion too.  An OFF that
     * comes later does not soften it.  A drive that is lost or in fault takes
     * it for an OFF: its stop is under way */
    HAL_DRIVE_REQUEST_TORQUE_OFF,
};

#define HAL_DRIVE_STOP_NS INT64_C(3000000000) /* a ramp to rest, at most */
#define HAL_DRIVE_ROLL_NS INT64_C(1000000000) /* and the motor behind it */

/* How it moves.  Only the first two take set points. */
enum hal_drive_mode {
    HAL_DRIVE_STREAM_POSITION,  /* follows set_target's position */
    HAL_DRIVE_STREAM_VELOCITY,  /* follows set_target's velocity; whoever gives
                                   it closes the loop around the position */
    HAL_DRIVE_PROFILE_POSITION, /* go: to a position by its own ramps */
    HAL_DRIVE_PROFILE_VELOCITY, /* go: at a velocity until told otherwise */
    HAL_DRIVE_HOMING,           /* home: looks for its own zero */
    HAL_DRIVE_MODES,            /* how many */
};
const char *hal_drive_mode_text(enum hal_drive_mode mode);

struct hal_drive_target {
    int64_t pos_q32; /* unit */
    int64_t vel_q32; /* unit/s, feed-forward; in STREAM_VELOCITY the target */
    int64_t acc_q32; /* unit/s2, feed-forward */
    int32_t torque_permille; /* of the rated torque, positive where acc_q32 is;
                                feed-forward, left out by a drive that has
                                none */
};

/* One motion by the drive's own profile. */
struct hal_drive_go {
    int64_t pos_q32;          /* PROFILE_POSITION: where to */
    int64_t vel_q32;          /* PROFILE_POSITION: how fast at most, > 0;
                        PROFILE_VELOCITY: signed, 0 stops by the ramp */
    int64_t acc_q32, dec_q32; /* ramps, > 0; 0: as the drive has them */
    int64_t timeout_ns;       /* a fault when it takes longer; 0: not watched */
};

struct hal_drive_home {
    int method; /* the drive's own number: for CiA 402 that of 0x6098; 0 for a
                   drive that has one, at its own speeds and ramps */
    int64_t fast_q32, slow_q32; /* speed to the switch, and to the zero after
                                   it, > 0; 0: as the drive has them */
    int64_t acc_q32;            /* > 0; 0: as the drive has it */
    int64_t pos_q32;            /* of the home point, from then on */
    int64_t timeout_ns;         /* > 0: a fault when it takes longer */
};

enum hal_drive_homing {
    HAL_DRIVE_HOMING_NONE, /* not done since the drive was found */
    HAL_DRIVE_HOMING_RUNNING,
    HAL_DRIVE_HOMING_DONE, /* positions count from the home point */
    HAL_DRIVE_HOMING_FAILED,
};

/* Which change of its probe input stores the position. */
enum hal_drive_probe {
    HAL_DRIVE_PROBE_OFF,
    HAL_DRIVE_PROBE_RISING,
    HAL_DRIVE_PROBE_FALLING,
};

/* What a drive says without being in fault. */
enum hal_drive_event {
    HAL_DRIVE_EVENT_WARNING,
    HAL_DRIVE_EVENT_LIMIT, /* one of its own limits held the axis back */
    HAL_DRIVE_EVENT_NOT_FOLLOWING, /* it left set points out */
    HAL_DRIVE_EVENT_EMERGENCY,     /* an emergency message */
    HAL_DRIVE_EVENTS,              /* how many */
};
const char *hal_drive_event_text(enum hal_drive_event event);

struct hal_drive_events {
    uint32_t count[HAL_DRIVE_EVENTS]; /* since the drive was added */
    uint16_t emergency_code;          /* of the last one */
};

struct hal_drive_feedback {
    enum hal_drive_state state;
    bool torque_off; /* the drive says so itself, and still speaks; false where
                        it is not known */
    bool
        demand_known; /* the drive itself reports which set point was in force at
                          t_ns, demand_q32; demand_age_ns then says nothing */
    bool probe_latched;    /* since probe() was called last: probe_pos_q32 */
    int64_t pos_q32;       /* actual */
    int64_t vel_q32;       /* actual; from position when the drive has none */
    int64_t t_ns;          /* when pos was measured (SYNC that latched it);
                              0: never yet */
    int64_t demand_age_ns; /* how long before t_ns the set point that was in
                              force at t_ns had been given to set_target, both
                              on the time of begin(); 0: what is in force does
                              not come from set_target */
    int64_t demand_q32;    /* where demand_known */
    bool limit_negative, limit_positive; /* switch inputs of the drive */
    bool home_switch;
    bool following; /* the drive itself says that it follows set points;
                            false also at its own limit: hold then */
    enum hal_drive_mode mode; /* in force */
    bool arrived; /* the last go is done: it stands at its target, or runs at
                     its speed; false while one is on its way */
    enum hal_drive_homing homing;
    bool torque_known;
    int32_t torque_permille; /* actual, of the rated torque */
    uint32_t steps; /* counts on while it is being found or enabled, so that a
                       slow drive can be told from one that does not go on; 0:
                       it does not tell */
    int64_t probe_pos_q32;
    struct hal_drive_events events;
    uint16_t fault_code;     /* maker's or profile's code, 0: none */
    bool fault_code_awaited; /* in FAULT: it is being asked for its code, which
                                completes fault_text too */
    char fault_text[64];     /* why it is in FAULT or OFFLINE, for a person */
};

/* What a search found before it switched the drive off: one that has torque,
 * left by a master before or moved by another, is stopped first. */
struct hal_drive_found {
    uint32_t count;  /* times that it had torque, since the drive was added */
    int64_t vel_q32; /* how fast it moved then, of the last one; 0: not known */
    bool goes_on;    /* it did not come to rest in its time */
};

/* A position in the drive's counter, and the ends of that. */
struct hal_drive_reach {
    int64_t counts, min_counts, max_counts;
};

struct hal_drive;
struct motion_track;

enum hal_drive_track {
    HAL_DRIVE_TRACK_NONE, /* nothing is loaded */
    HAL_DRIVE_TRACK_LOADING,
    HAL_DRIVE_TRACK_LOADED,  /* as much as it takes to begin */
    HAL_DRIVE_TRACK_WAITING, /* for the time that start has said */
    HAL_DRIVE_TRACK_PLAYING, /* has begun at that time */
    HAL_DRIVE_TRACK_ENDED,   /* it has come to its end, and stands there; a
                               drive that stops before it is in fault */
};

/* A change of the rate at which tracks are sampled, which begins and is the same
 * on all clocks of a move: from a constant rate to rate_q30, r' to its peak in
 * `change` times tick_ns, at it for `flat` of them, and back in as many as it came
 * (firmware/control/ramp_scheduled.h).  A drive's clock that stands is in step
 * with ours from at_ns on; one that goes is so since it began, and begins when
 * it is since_ns further than then. */
struct hal_drive_ramp {
    int64_t rate_q30, tick_ns;
    int32_t change, flat; /* ticks */
    int64_t at_ns;        /* on the time of begin() */
    int64_t since_ns;     /* -1: the clock stands */
};

/* Of a drive that samples whole tracks by itself, on a clock of its own.  Its set point
 * has one owner.  From when start was called until a stop, a fault or the end that is
 * ours: set_target says where the axis should be by our clock, the drive sends none of
 * it, and demand_q32 is the one that was due when the position was measured.  Else it is
 * the drive's: demand_q32 is what it holds or runs down by itself, and whoever gives
 * set points gives that back.  demand_known is true throughout.  After a stop it is in
 * a mode of its own, PROFILE_POSITION, until it stands and its place is known. */
struct hal_drive_tracks {
    /* For the next start; NULL: stands.  Outlives being played.
     * MOTION_E_STATE unless ENABLED and standing; MOTION_E_ARG of a window
     * (motion/core/track.h).  Looks at the whole track, not for the tick. */
    int (*load)(struct hal_drive *drive, const struct motion_track *track);
    enum hal_drive_track (*state)(struct hal_drive *drive);
    /* How far ahead start is to be told: whole ticks of the loop. */
    int64_t (*lead_ns)(struct hal_drive *drive);
    /* Path time 0 is at start_ns, on the time of begin(); from there on it runs
     * at rate_q30.  Not begun then, it does not begin at all.  MOTION_E_STATE
     * unless LOADED. */
    int (*start)(struct hal_drive *drive, int64_t start_ns, int64_t rate_q30);
    /* While PLAYING, or about to, else MOTION_E_STATE, as where it was told too late.
     * MOTION_E_AGAIN: it has not said yet that it will, or is to begin another
     * first; ask again, with the same.  MOTION_E_RANGE: no tick of its own is
     * then.  ENDED: MOTION_OK, it stands at any rate.  What it has said and then
     * does not do is a fault of the drive.  NULL: it has the rate that it began
     * with. */
    int (*ramp)(struct hal_drive *drive, const struct hal_drive_ramp *ramp);
    /* Along its path to rest, by what it does itself, before anything else that it
     * is to be told; what is loaded is forgotten. */
    void (*stop)(struct hal_drive *drive);
};

struct hal_drive_ops {
    void (*request)(struct hal_drive *drive, enum hal_drive_request request);
    /* Next set point; goes out with the fieldbus's end of cycle.
     * MOTION_E_RANGE when it does not fit the drive's own units, MOTION_E_AWAY
     * when it is the first since enabling and too far from where the axis is
     * (the drive then is in FAULT); nothing is sent then.  While the drive is
     * not ENABLED a set point is checked and forgotten. */
    int (*set_target)(struct hal_drive *drive,
                      const struct hal_drive_target *target);
    void (*feedback)(struct hal_drive *drive,
                     struct hal_drive_feedback *feedback);

    /* ---- NULL where the drive has no such thing ---- */

    /* Which modes it has: bit 1 << enum hal_drive_mode.  0 until the drive has
     * been found. */
    unsigned (*modes)(struct hal_drive *drive);
    /* Asks for a mode; feedback.mode tells when it is in force.  While OFF or
     * ENABLED and standing, with no go, home or change of mode under way, else
     * MOTION_E_STATE (an axis takes a moment to settle: ask again);
     * MOTION_E_EMPTY when the drive has no such mode. */
    int (*set_mode)(struct hal_drive *drive, enum hal_drive_mode mode);
    /* While ENABLED and in one of the two profile modes, else MOTION_E_STATE;
     * also while a go is on its way: the new one takes its place at once.
     * MOTION_E_RANGE when it does not fit the drive's units, MOTION_E_ARG for a
     * value that is not allowed. */
    int (*go)(struct hal_drive *drive, const struct hal_drive_go *go);
    /* While ENABLED, standing and in HOMING, else MOTION_E_STATE; then
     * feedback.homing tells.  MOTION_E_RANGE, MOTION_E_ARG as above.  The
     * position jumps at its end; set points wait for another mode. */
    int (*home)(struct hal_drive *drive, const struct hal_drive_home *home);
    /* Ends a go or a homing by the drive's ramp; it stays ENABLED.
     * MOTION_E_STATE when there is none. */
    int (*halt)(struct hal_drive *drive);
    /* Waits for the next such change, and forgets the one before.
     * MOTION_E_STATE while OFFLINE. */
    int (*probe)(struct hal_drive *drive, enum hal_drive_probe probe);
    const struct hal_drive_tracks *tracks;
    const struct hal_drive_found *(*found)(struct hal_drive *drive);
    /* MOTION_E_RANGE of a position beyond an end of the drive's counter: what it
     * does there is not known, so it is never told one.  NULL: none is. */
    int (*reach)(struct hal_drive *drive, int64_t pos_q32,
                 struct hal_drive_reach *reach);
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

/* The optional calls: MOTION_E_EMPTY when the drive has no such thing. */

static inline unsigned hal_drive_modes(struct hal_drive *drive)
{
    return drive->ops->modes != NULL ? drive->ops->modes(drive)
                                     : 1u << HAL_DRIVE_STREAM_POSITION;
}

static inline int hal_drive_set_mode(struct hal_drive *drive,
                                     enum hal_drive_mode mode)
{
    if (drive->ops->set_mode == NULL)
        return mode == HAL_DRIVE_STREAM_POSITION ? MOTION_OK : MOTION_E_EMPTY;
    return drive->ops->set_mode(drive, mode);
}

static inline int hal_drive_go(struct hal_drive *drive,
                               const struct hal_drive_go *go)
{
    return drive->ops->go != NULL ? drive->ops->go(drive, go) : MOTION_E_EMPTY;
}

static inline int hal_drive_reach(struct hal_drive *drive, int64_t pos_q32,
                                  struct hal_drive_reach *reach)
{
    reach->counts = reach->min_counts = reach->max_counts = 0;
    return drive->ops->reach != NULL ? drive->ops->reach(drive, pos_q32, reach)
                                     : MOTION_OK;
}

static inline int hal_drive_home(struct hal_drive *drive,
                                 const struct hal_drive_home *home)
{
    return drive->ops->home != NULL ? drive->ops->home(drive, home)
                                    : MOTION_E_EMPTY;
}

static inline int hal_drive_halt(struct hal_drive *drive)
{
    return drive->ops->halt != NULL ? drive->ops->halt(drive) : MOTION_E_EMPTY;
}

static inline int hal_drive_probe(struct hal_drive *drive,
                                  enum hal_drive_probe probe)
{
    return drive->ops->probe != NULL ? drive->ops->probe(drive, probe)
                                     : MOTION_E_EMPTY;
}

MOTION_C_END

#endif
