/* firmware/control/homing.h - finds out where the axes are.
 *
 * One axis after the other, in the order of the configuration; the others
 * stand.  The controller is READY and moves the axis by jogs, so its gate,
 * following error and faults are in force; homing itself looks at switches and
 * keeps the bounds: how far, how long.
 *
 *   by a switch (home, or one of the limit switches):
 *
 *     SEARCH --switch--> SLOW_DOWN --rest--> LEAVE --let go--> TURN --rest-->
 *       |   (on it already:  ^   |             ^                APPROACH
 *       |    LEAVE)          |   '--> BACK ----'                  | switch:
 *       |                    '--- switch ---.                     | the edge
 *       '--limit--> REVERSE --rest--> RETURN                      v
 *                          DONE <--rest-- GO <--rest-- SETTLE (offset set)
 *
 *   by a hard stop:
 *
 *     PRESS --stop--> PRESSED --rest--> CLEAR --rest--> PRESS_AGAIN
 *                                                         | stop: the place
 *                                                         v
 *                          DONE <--rest-- GO <--rest-- SETTLE (offset set)
 *
 *   by the drive:  MODE --in force--> RUN --done--> UNMODE --in force--> GO
 *   here:          the present position is taken; GO
 *
 * SEARCH runs at `fast` in `direction` until the switch is met; when the limit
 * switch of that direction comes first, the home switch is behind: RETURN looks
 * for it the other way.  A switch that is narrower than the distance to rest
 * from `fast` is behind the axis when that has come to rest: after SEARCH the
 * axis comes BACK at `slow`, over the place where the switch was met and as far
 * again; after RETURN it is on the side where APPROACH begins.  A pulse between
 * two looks counts where the line has events: without them a switch narrower
 * than `fast` times a tick may be passed unseen.  LEAVE backs off until the
 * switch has let go, APPROACH meets it again at `slow`.  The position of the
 * edge is that of the tick that saw it, drawn back to the edge's own time stamp
 * where there is one.
 *
 * A hard stop is where the axis stands with at least `push_permille` of the
 * rated torque while its set point goes on by 30 ms of its speed: at `fast`
 * first, then, from `clear` before it, at `slow`.  The position is the axis's, not that of the set
 * point.  What it presses with at most is the drive's to limit.
 *
 * The rails of a gantry (gantry.h) are homed in one turn, by switches or here, and move
 * as one: what stands of a switch above is that of either rail, but that APPROACH goes on
 * until each has met its own, which racks the bridge no further; what comes later than
 * the racking is a failure.  Then both places are known, and SETTLE is followed by SQUARE:
 * the other rail alone goes at `slow` to where it has the place of the first.
 *
 * Anything else is a failure: a switch or stop that does not come within `distance`, a
 * wait longer than `timeout`, an unexpected limit switch (while it brakes too),
 * a fault, the operator's stop (controller_stop, controller_jog_stop), in
 * whatever tick it comes.  The axis brakes by its stop limits then; before the
 * edge was met it is as unhomed as before, after that its position is known
 * although it did not GO.  On GO range and switches are the controller's again.
 * A drive that was asked to home is asked back to its usual mode; one that is not
 * back 5 s after the failure, standing, is braked by its quick stop.
 * A hold keeps the next leg from beginning until it is resumed.
 *
 * Called between ticks; plans, so divides.  No heap, no clock. */
#ifndef FIRMWARE_CONTROL_HOMING_H
#define FIRMWARE_CONTROL_HOMING_H

#include "firmware/control/jog.h"

MOTION_C_BEGIN

enum homing_by {
    HOMING_NONE,
    HOMING_SWITCH,
    HOMING_DRIVE,
    HOMING_HERE,
    HOMING_HARD_STOP,
};

enum homing_input {
    HOMING_INPUT_HOME,
    HOMING_INPUT_LIMIT_NEGATIVE,
    HOMING_INPUT_LIMIT_POSITIVE,
};

struct homing_config {
    enum homing_by by;
    unsigned order;          /* lower ones first; equal ones by their index */
    enum homing_input input; /* SWITCH */
    int direction; /* SWITCH, HARD_STOP: -1 or 1; with a limit switch its own */
    int64_t fast_q32, slow_q32; /* > 0 */
    int64_t distance_q32; /* SWITCH, HARD_STOP: of the search, at most, > 0 */
    int64_t pos_q32;      /* of the edge, the stop, the drive's zero, of here */
    int32_t push_permille; /* HARD_STOP: torque that it is known by, > 0 */
    int64_t clear_q32;     /* HARD_STOP: it backs off by this, > 0 */
    bool goes;             /* to go_q32 afterwards */
    int64_t go_q32;
    int64_t timeout_ns; /* of the axis, > 0 */
    int method; /* DRIVE; 0: it has one way of its own, at speeds of its own,
                   and fast_q32 is for GO alone */
};

/* X(name, sentence) */
#define HOMING_ERROR_LIST(X)                                                   \
    X(HOMING_OK, "homed")                                                      \
    X(HOMING_NOT_FOUND, "the switch was not met within the search distance")   \
    X(HOMING_STUCK, "the switch was not released within the search distance")  \
    X(HOMING_OVERRUN,                                                          \
      "the switch was overrun while braking, and not met on the way back")     \
    X(HOMING_WRONG_LIMIT, "a limit switch came that was not expected")         \
    X(HOMING_BOTH_LIMITS, "both limit switches are active")                    \
    X(HOMING_TIMEOUT, "it took too long")                                      \
    X(HOMING_FAULT, "a fault stopped it")                                      \
    X(HOMING_STOPPED, "stopped by the operator")                               \
    X(HOMING_NO_HALT,                                                          \
      "the drive cannot be halted, so it cannot look for a switch")            \
    X(HOMING_NO_DRIVE, "the drive cannot home by itself")                      \
    X(HOMING_DRIVE_FAILED, "the drive's own homing failed")                    \
    X(HOMING_JOG, "the axis could not be moved")                               \
    X(HOMING_NO_STOP, "no hard stop was met within the search distance")       \
    X(HOMING_NO_TORQUE, "the drive does not report its torque")                \
    X(HOMING_COUNTER, "the drive's counter ends within the axis's range")      \
    X(HOMING_RACKED,                                                           \
      "one rail met its switch and the other none within the racking")

enum homing_error {
#define HOMING_ERROR_ENUM(name, text) name,
    HOMING_ERROR_LIST(HOMING_ERROR_ENUM)
#undef HOMING_ERROR_ENUM
};
const char *homing_error_text(enum homing_error error);

/* X(name, word for people, what it waits for) */
#define HOMING_STATE_LIST(X)                                                   \
    X(HOMING_IDLE, "idle", "")                                                 \
    X(HOMING_SEARCH, "searching", "the switch was not met yet")                \
    X(HOMING_SLOW_DOWN, "slowing down",                                        \
      "it did not come to rest at the switch")                                 \
    X(HOMING_BACK, "coming back to the switch",                                \
      "the switch that it had overrun was not met again yet")                  \
    X(HOMING_REVERSE, "turning at the limit",                                  \
      "it did not come to rest at the limit switch")                           \
    X(HOMING_RETURN, "searching backwards",                                    \
      "the switch was not met yet on the way back from the limit switch")      \
    X(HOMING_LEAVE, "leaving the switch", "the switch was not released yet")   \
    X(HOMING_TURN, "turning", "it did not come to rest beside the switch")     \
    X(HOMING_APPROACH, "approaching slowly",                                   \
      "the switch was not met again yet at the slow speed")                    \
    X(HOMING_SETTLE, "coming to rest",                                         \
      "it did not come to rest after the edge of the switch")                  \
    X(HOMING_SQUARE, "squaring the bridge",                                    \
      "one rail did not come to where the other stands")                       \
    X(HOMING_PRESS, "going to the hard stop", "the hard stop was not met yet") \
    X(HOMING_PRESSED, "letting up",                                            \
      "it did not come to rest at the hard stop")                              \
    X(HOMING_CLEAR, "backing off", "it did not back off from the hard stop")   \
    X(HOMING_PRESS_AGAIN, "going to the hard stop slowly",                     \
      "the hard stop was not met again yet at the slow speed")                 \
    X(HOMING_MODE, "changing the drive's mode",                                \
      "the drive did not begin its homing")                                    \
    X(HOMING_RUN, "the drive homes", "the drive did not find its zero yet")    \
    X(HOMING_UNMODE, "changing the drive's mode back",                         \
      "the drive did not come back from its homing")                           \
    X(HOMING_GO, "going to its place", "it did not reach its place yet")       \
    X(HOMING_BRAKE, "stopping", "")                                            \
    X(HOMING_DONE, "homed", "")                                                \
    X(HOMING_FAILED, "failed", "")

enum homing_state {
#define HOMING_STATE_ENUM(name, text, wait) name,
    HOMING_STATE_LIST(HOMING_STATE_ENUM)
#undef HOMING_STATE_ENUM
        HOMING_STATES
};
const char *homing_state_text(enum homing_state state);

struct homing {
    struct controller *controller;
    struct controller_jog *jog;
    const struct homing_config *config; /* of each axis; the caller's */
    enum homing_state state;            /* DONE, FAILED: of all */
    enum homing_error error;
    enum homing_state failed; /* in which it was over, and whether held then */
    bool mode_requested; /* HOMING, of the drive, and not the usual one since */
    bool was_held;
    unsigned axis;     /* in its turn, or that failed */
    uint64_t left;     /* bit per axis */
    int64_t since_ns;  /* the axis's turn began */
    int64_t brake_ns;  /* BRAKE: since when */
    unsigned stops;    /* of the controller, when it began */
    int met_direction; /* in which the switch was met first, and where */
    int64_t met_q32;
    int64_t far_q32, far_ns; /* SLOW_DOWN: the furthest place, and since when */
    int64_t told_q32;        /* PRESS: the set point when it was at far_q32 */
    struct controller_gantry *gantry; /* whose rails are in their turn */
    unsigned found; /* bit per rail, the axis in its turn first: edges met */
    int64_t edge_q32[2]; /* where its switch was met, before the offset */
    int64_t edge_ns;     /* and when */
    int64_t go_q32;      /* GO: where to */
    struct hal_drive_reach reach; /* HOMING_COUNTER: of the end that it lacks */
};

/* `jog` and `config`, one per axis, are the caller's and must outlive it.
 * MOTION_E_ARG for a value out of its range. */
int homing_init(struct homing *homing, struct controller *controller,
                struct controller_jog *jog,
                const struct homing_config config[]);

/* Home these axes (a bit each; those of kind NONE are left out).  The
 * controller must be READY: MOTION_E_STATE. */
int homing_start(struct homing *homing, uint64_t axes);

/* After every tick, until it is over. */
void homing_step(struct homing *homing);
bool homing_is_running(const struct homing *homing);

/* Why it failed, in `text`: of a time-out also what was waited for, of a counter
 * that ends its counts. */
#define HOMING_TEXT_MAX 128
const char *homing_failure(const struct homing *homing,
                           char text[HOMING_TEXT_MAX]);

/* Axes that must be homed before a move: not homed yet. */
uint64_t homing_wanted(const struct homing *homing);

MOTION_C_END

#endif
