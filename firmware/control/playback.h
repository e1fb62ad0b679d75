/* firmware/control/playback.h - one move, and what an operator does with it.
 *
 * Stands between the commands (mailbox.h) and the controller: the controller
 * plays tracks once, the playback records which are loaded, takes the axes to a
 * place of them, and plays them again.  It works between ticks, so that it may
 * divide and plan.  No heap, no clock of its own.
 *
 *   IDLE --start, go--> GOING --there--> PLAYING --last time over--> IDLE
 *                         ^                 |
 *                         '--- the next begins elsewhere
 *
 *   GOING    a move that is held is left; then every axis of the move that is
 *            not there goes to its place, at a quarter of its limits, all
 *            arriving together
 *   PLAYING  the move is held at a time of its own, or played
 *
 * Repeated, a move goes on in the tick after its end where it begins there: in
 * a ping-pong always, else where all axes end where they start.  Moves begin
 * and end at rest (the plan's check), so there is nothing to slow down for.
 *
 * A stop, a fault, or torque off at any time: IDLE.
 *
 * Drives that sample tracks by themselves (hal/drive.h) are given theirs before
 * each motion: the controller is cued and held meanwhile (arm.c), and all begin
 * at one time.  From there on their clocks and ours are in step: where the operator
 * wants them to go, held or to a rate, they go by ramps that begin in a tick that all
 * have been told before (arm_ramp.c), through the same rates, so that all come to rest
 * at one place of the path.  What is asked for meanwhile is kept, and begins after that:
 * a hold is over by a resume alone.  Where a drive has no such thing a hold is a stop.
 * It is not reversed, nor begun in its middle.
 *
 * A stop waits for nobody, so it is no such ramp: each clock comes to rest by itself,
 * as soon as the limits of its own axes let it, and so does one that a fault stops.
 * From that tick on such a drive's set point is its own (controller.c), until it is
 * loaded again; READY comes when all stand, and one that does not in its time is braked
 * by its quick stop. */
#ifndef FIRMWARE_CONTROL_PLAYBACK_H
#define FIRMWARE_CONTROL_PLAYBACK_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/controller.h"
#include "firmware/control/jog.h"
#include "firmware/control/ramp_scheduled.h"

/* A new goal must come within this time while a jog goes on. */
#define PLAYBACK_JOG_MAX_NS INT64_C(2000000000)

#define PLAYBACK_SEGMENTS 8 /* of an approach: an ease has seven at most */

enum playback_state { PLAYBACK_IDLE, PLAYBACK_GOING, PLAYBACK_PLAYING };

/* Once it is at a place of the move. */
enum playback_then {
    PLAYBACK_STAND, /* READY */
    PLAYBACK_HOLD,  /* HOLDING, to be resumed */
    PLAYBACK_PLAY,
};

/* Of a motion that drives are to sample by themselves. */
enum playback_arm {
    PLAYBACK_UNARMED, /* or there is no such drive in it */
    PLAYBACK_LOADING,
    PLAYBACK_WAITING, /* for start_ns */
    PLAYBACK_RUNNING,
    PLAYBACK_PARTED, /* each comes to rest by itself, by rest_ns */
};

/* Of each axis of the controller. */
struct playback_axis {
    /* what is loaded; NULL: stands still */
    const struct motion_track *track;
    const struct controller_goal *goal; /* of an axis that goes to goals */
    unsigned goal_count;
    /* on its way there */
    struct motion_segment storage[PLAYBACK_SEGMENTS];
    struct motion_track approach;
    struct controller_goal approach_goal;
    bool is_armed; /* its drive has the track */
};

/* Where all clocks are to go: held, or the override; and the change of the rate on the
 * way there that drives that sample by themselves go along with. */
struct playback_ramp {
    bool holds;
    int64_t holds_ns;  /* since when */
    bool is_scheduled; /* `ramp`, which begins at begin_ns on the clock */
    int32_t ticks;     /* ahead at least, to be judged by all */
    int32_t tried;     /* controller_ramp_find */
    int64_t rate_q30;  /* that all have been told to begin at */
    struct controller_ramp ramp;
    int64_t at_ns, begin_ns;
    int64_t since_ns;  /* on it, -1: from rest */
    int64_t anchor_ns; /* where all clocks were in step last */
};

struct playback {
    struct controller *controller;
    struct controller_jog *jog; /* NULL: none can be jogged */
    struct playback_axis *axis; /* the caller's */
    bool is_loaded;
    enum playback_state state;
    enum playback_then then;
    bool leaves; /* GOING: the move that was held is not over yet */
    int64_t at_ns_q12;
    int64_t end_ns_q12; /* of the move */
    unsigned stops;     /* the controller's, when this began */
    bool is_ping_pong;
    int64_t times;  /* to be played, 0: until a stop */
    int64_t played; /* to the end, since the start */
    int err;        /* why the last one could not begin; MOTION_OK */
    int err_axis;   /* whose fault that is, also of playback_go and
                       playback_begin; -1: none's in particular */
    enum playback_arm arm;
    int64_t arm_ns, start_ns; /* since when; path time 0 of what is armed */
    int64_t rest_ns;          /* PARTED: all stand by then */
    struct playback_ramp ramp;
};

/* `axis`: one per axis of the controller; NULL: nothing can be loaded.  What is
 * played is played once. */
void playback_init(struct playback *playback, struct controller *controller,
                   struct controller_jog *jog, struct playback_axis axis[]);

/* The tracks, of each axis, must outlive their use.  Played once, where it cannot be
 * repeated as was said before.  MOTION_E_STATE while something is played or held,
 * MOTION_E_ARG without `axis`. */
int playback_load(struct playback *playback,
                  const struct motion_track *const track[]);
void playback_unload(struct playback *playback);
/* Of an axis that goes to goals, after it was loaded; see controller_goals_of. */
void playback_set_goals(struct playback *playback, unsigned index,
                        const struct controller_goal goal[], unsigned count);

/* In READY, or HOLDING at rest (MOTION_E_STATE): the axes go to where the move is
 * at a time of its own.  MOTION_E_EMPTY: nothing is loaded; MOTION_E_ARG: a time
 * outside the move, or in a window, or where a drive samples by itself, one that
 * is not 0; MOTION_E_LIMIT: a place
 * outside the range of an axis; or what controller_start says. */
int playback_go(struct playback *playback, int64_t at_ns_q12,
                enum playback_then then);
/* In READY, standing there: on from there. */
int playback_begin(struct playback *playback, int64_t at_ns_q12,
                   enum playback_then then);

/* controller_hold and controller_resume; of a motion that drives sample by
 * themselves as soon as all have been told, and after the change that is under way;
 * a resume takes back a hold that has not begun.  Where one of them has a rate of its
 * own only, or before it has begun: a stop, and MOTION_E_STATE. */
int playback_hold(struct playback *playback);
int playback_resume(struct playback *playback);
/* controller_override; while drives sample by themselves as soon as all have
 * been told, MOTION_E_STATE where one cannot be, or at 0 %; held, from the resume on. */
int playback_override(struct playback *playback, int64_t rate_q30);
/* Are drives being given what they are to sample? */
bool playback_is_arming(const struct playback *playback);

/* controller_reverse, of the move. */
int playback_reverse(struct playback *playback, bool is_reversed);

/* How often the move is played, the present time included; 0: until a stop.
 * MOTION_E_ARG below 0, or where it is loaded and cannot be played more than
 * once: a window; in a ping-pong an axis that goes to goals, or whose drive
 * samples by itself. */
int playback_repeat(struct playback *playback, int64_t times,
                    bool is_ping_pong);

/* As controller_jog, for `for_ns` after the last tick, 1 .. PLAYBACK_JOG_MAX_NS
 * (MOTION_E_ARG; also where its drive samples by itself), however far it is: a
 * client that is gone has let go. */
int playback_jog(struct playback *playback, unsigned axis, int64_t pos_q32,
                 int64_t vel_q32, int64_t for_ns);

/* controller_couple; MOTION_E_ARG also where the drive of either axis samples by
 * itself. */
int playback_couple(struct playback *playback, unsigned axis,
                    struct controller_cam *cam);

/* A key: where the axes stand, one place per axis, and the path time, 0 where no
 * move is held.  Without torque it is where they were pushed to.
 * MOTION_E_STATE while something moves or enables, MOTION_E_UNHOMED while an
 * axis is not homed. */
int playback_capture(const struct playback *playback, int64_t pos_q32[],
                     int64_t *s_ns_q12);

/* After every tick. */
void playback_step(struct playback *playback);

#endif
