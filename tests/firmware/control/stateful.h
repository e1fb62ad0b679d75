/* tests/firmware/control/stateful.h - the controller under random commands, a
 * judge at its side.
 *
 * An episode follows from its seed alone: a rig of one to six axes with drives,
 * switches and limits of its own, then commands, lost ticks and faults at
 * random times, several in one tick, stops above all right after something
 * began.  After every tick the judge looks at what the drives were told and at
 * what the machine does.  It knows the commands and the configuration, and
 * computes what is allowed by itself; of the controller it reads what that
 * reports.
 *
 *   stateful_axis.c     a drive and its axis: late, drooping, failing; switches
 *   stateful_profile.c  a drive that goes by its own profile
 *   stateful_board.c    a board that samples tracks by itself
 *   stateful_onboard.c  which axes are on boards; whose set points are in force
 *   stateful_rig.c      what an episode is made of
 *   stateful_move.c     tracks, from gentle to exactly at the limits
 *   stateful_play.c     a move that is gone to, reversed and repeated
 *   stateful_command.c  commands, noted and told to the judge
 *   stateful_couple.c   gears and cams
 *   stateful_client.c   several senders at once, a stop of any of them
 *   stateful_shot.c     pulses at times of the path
 *   stateful_read.c     moves that are read piece by piece while they are played
 *   stateful_draw.c     which commands come when
 *   stateful_mishap.c   what goes wrong by itself
 *   stateful_judge.c    set points: limits, range, standing still, torque
 *   stateful_fault.c    faults: causes, latching; e-stop; an axis that runs away
 *   stateful_torque.c   torque in motion: off, and the drives' quick stop, for a reason
 *   stateful_stop.c     stops: no faster, at rest in time; the dead man
 *   stateful_goal.c     drives that go by their own profile: goals, and rest
 *   stateful_home.c     homing: switches, distances, time-outs
 *   stateful_run.c      the tick, the episode, the trace */
#ifndef TESTS_FIRMWARE_CONTROL_STATEFUL_H
#define TESTS_FIRMWARE_CONTROL_STATEFUL_H

#include "firmware/control/gear.h"
#include "firmware/control/homing.h"
#include "firmware/control/mailbox.h"
#include "firmware/control/playback.h"
#include "firmware/control/trigger.h"
#include "motion/core/fixed.h"
#include "tests/firmware/control/stateful_machine.h"
#include "tests/support/check.h"

#define STATEFUL_SEGMENTS 96
#define STATEFUL_GOALS    16
#define STATEFUL_TRACE    48
#define STATEFUL_NOTE     160

/* X(name, sentence) */
#define STATEFUL_VIOLATION_LIST(X)                                             \
    X(STATEFUL_NONE, "nothing")                                                \
    X(STATEFUL_SPEED, "a step of position over the limit of speed")            \
    X(STATEFUL_ACCELERATION, "a step of speed over the limit of acceleration") \
    X(STATEFUL_JERK, "a step of acceleration over the limit of jerk")          \
    X(STATEFUL_RANGE, "a set point outside the range")                         \
    X(STATEFUL_STANDS, "a set point moves where nothing may")                  \
    X(STATEFUL_FIRST, "the first set point is not where the axis is")          \
    X(STATEFUL_PATH, "a set point is not on its track")                        \
    X(STATEFUL_CURVE, "a coupled axis is not on its curve")                    \
    X(STATEFUL_DIRECTION, "the path goes the other way")                       \
    X(STATEFUL_GOAL, "a goal was sent where none may be")                      \
    X(STATEFUL_OWNER, "a set point of a board's axis is not the board's")      \
    X(STATEFUL_APART, "a board stands at another place of the path")           \
    X(STATEFUL_UNTOLD, "a board was not told to stop")                         \
    X(STATEFUL_RESUMED, "what is held goes on by itself")                      \
    X(STATEFUL_REFUSED, "what could begin did not")                            \
    X(STATEFUL_FASTER, "faster after a stop was asked for")                    \
    X(STATEFUL_LATE, "not at rest in time after a stop")                       \
    X(STATEFUL_DEAD_MAN, "a jog goes on after its dead-man time")              \
    X(STATEFUL_ACCEPTED, "a motion was accepted before a stop was over")       \
    X(STATEFUL_BESIDE, "a command that came with a stop was done")             \
    X(STATEFUL_SHOT, "a pulse where none is due, or none where one is")        \
    X(STATEFUL_SWITCH, "it moves on towards an active switch")                 \
    X(STATEFUL_DISTANCE, "a leg of homing went too far")                       \
    X(STATEFUL_TIMEOUT, "homing goes on after its time-out")                   \
    X(STATEFUL_TORQUE, "torque in OFF or FAULT")                               \
    X(STATEFUL_CUT, "torque was taken from an axis that moves")                \
    X(STATEFUL_ESCALATES, "the drives brake where a stop would have done")     \
    X(STATEFUL_ENABLES, "a drive was enabled without a command")               \
    X(STATEFUL_LATCH, "a fault did not stay latched")                          \
    X(STATEFUL_SPURIOUS, "a fault without a cause")                            \
    X(STATEFUL_MISSED, "a cause without its fault")                            \
    X(STATEFUL_RESET, "a reset of what is still there")                        \
    X(STATEFUL_RUNS_AWAY, "an axis that runs away has torque")                 \
    X(STATEFUL_NO_END, "OFF cannot be reached, or not be left")

enum stateful_violation {
#define STATEFUL_VIOLATION_ENUM(name, text) name,
    STATEFUL_VIOLATION_LIST(STATEFUL_VIOLATION_ENUM)
#undef STATEFUL_VIOLATION_ENUM
        STATEFUL_VIOLATIONS
};
const char *stateful_violation_text(enum stateful_violation violation);

/* --- a move that is read while it is played -------------------------------- */

struct stateful_reader {
    bool is_on;
    int64_t spare_ns_q12; /* beyond what a stop may need */
    int64_t ahead_ns_q12; /* so far beyond where the move is; */
    bool stalls;          /* no further than there, */
    int64_t stall_ns_q12;
    double stall_share; /* of the move */
    struct motion_track window[STATEFUL_AXES];
    struct motion_track_outline outline[STATEFUL_AXES];
    const struct motion_track *whole[STATEFUL_AXES];
};

/* --- pulses ------------------------------------------------------------------ */

#define STATEFUL_SHOTS 16

struct stateful_shots {
    struct trigger trigger;
    struct hal_gpio line;
    bool is_active; /* the line */
    int64_t lead_ns;
    int64_t t_ns_q12[STATEFUL_SHOTS];
    uint32_t count, seen; /* so many are to come; have come */
    int64_t since_ns;     /* the line is as it is */
    bool is_armed;
};

/* --- gears and cams --------------------------------------------------------- */

#define STATEFUL_CURVE_SEGMENTS 8

/* Of a follower. */
struct stateful_coupling {
    bool is_on;
    double stood; /* beside its curve, when its master began to move */
    struct controller_cam cam;
    struct motion_track track;
    struct motion_segment segment[STATEFUL_CURVE_SEGMENTS];
    /* the same, a unit of the master a millisecond: for a planner */
    bool has_time;
    struct motion_track by_ms;
    struct motion_segment by_ms_segment[STATEFUL_CURVE_SEGMENTS];
};

/* --- the judge -------------------------------------------------------------- */

/* Set points that a drive with torque got, newest first. */
struct stateful_past {
    int64_t pos_q32[4];
    unsigned count;
    bool is_hard;    /* the stop limits may have been in force, */
    int64_t hard_ns; /* in the change of rate that began then, */
    int hard_ticks;  /* and so many ticks ago */
    bool any_range;  /* homing moved it, and it did not stand since */
};

enum stateful_stop_kind {
    STATEFUL_GOES,
    STATEFUL_HOLD,
    STATEFUL_STOP,
    STATEFUL_JOG_STOP,
    STATEFUL_HARD_STOP,
    STATEFUL_DEAD,
    STATEFUL_HOME_STOP,
    STATEFUL_FAULT_STOP,
    STATEFUL_STOPS
};

struct stateful_stop {
    enum stateful_stop_kind kind;
    int64_t requested_ns;
    int64_t by_ns;    /* at rest then, on clock_ns */
    double rate;      /* of the path at most, */
    double rate_kept; /* and while the ramp from before the request stays */
    double vel;       /* of the axis that jogs at most, unit/s */
    bool by_rate;     /* the first counts, else the second */
    bool by_drives;   /* their quick stop has taken over */
    struct motion_clock_rate from; /* of the clock that reads the path */
};

/* An axis that goes by goals. */
struct stateful_goer {
    double vel; /* a tick ago */
    int64_t outside_q32, offset_q32, slip_q32;
    bool any_range, has_end;
    int64_t end_q32; /* of its track */
};

/* How far a homing axis has come towards an active switch. */
struct stateful_mark {
    bool set;
    int64_t pos_q32, most_q32;
};

struct stateful_homing {
    enum homing_state state, leg;
    unsigned axis;
    int64_t turn_ns; /* the axis's turn began */
    int64_t leg_q32;
    struct stateful_mark mark[STATEFUL_SWITCHES];
};

/* What a button has shown since it was pressed. */
struct stateful_pressed {
    bool is_active, both, is_late, differs;
    int64_t differ_ns;
    bool is_unproved; /* until it was pressed and released as it should be */
};

/* Why drives brake by themselves after a fault, or a stop: X(name, words).  What is
 * none of these is a violation. */
#define STATEFUL_EXCUSE_LIST(X)                                                \
    X(STATEFUL_BY_PROFILE, "a drive moved by its own profile or homing")       \
    X(STATEFUL_NOT_READ, "the move was not read as far as a stop needs")       \
    X(STATEFUL_NO_STOP_FITS, "no stop along the path fits its limits in time") \
    X(STATEFUL_DEAF_BOARD, "a board did not stop")

enum stateful_excuse {
#define STATEFUL_EXCUSE_ENUM(name, text) name,
    STATEFUL_EXCUSE_LIST(STATEFUL_EXCUSE_ENUM)
#undef STATEFUL_EXCUSE_ENUM
        STATEFUL_EXCUSES
};
const char *stateful_excuse_text(enum stateful_excuse excuse);

/* Answers of an axis, newest first, that say that it runs away. */
struct stateful_away {
    int64_t error_q32, vel_q32, demand_q32, t_ns;
    double told_q32; /* the fastest since it was followed last */
    bool follows, against, beyond, faster;
    int ticks; /* of the controller since it was enabled */
    int count;
};

enum stateful_motion { STATEFUL_REST, STATEFUL_MOVE, STATEFUL_JOG };

struct stateful_judge {
    struct stateful_past past[STATEFUL_AXES];
    struct stateful_goer goer[STATEFUL_AXES];
    bool towards[STATEFUL_AXES]; /* an active limit switch, a tick ago */
    struct stateful_stop stop;
    struct stateful_homing homing;
    enum stateful_motion motion; /* what was accepted last */
    bool is_reversed;            /* and which way along its path */
    int64_t s_ns_q12;            /* a tick ago */
    bool is_fresh;               /* and no tick since */
    int64_t began_ns; /* from rest, on clock_ns: it, or a leg of homing */
    unsigned jog_axis;
    int64_t jog_step_q32; /* the most per tick of this jog */
    int64_t dead_ns;      /* the dead-man time, on now_ns; 0: none */
    struct controller_fault_record fault;
    struct stateful_pressed pressed;
    struct stateful_away away[STATEFUL_AXES];
    enum controller_reaction reaction;
    bool by_profile;      /* a drive moved by itself, a tick ago */
    bool reset_requested; /* and accepted, since that */
    enum controller_state before;
    bool homed_before; /* homing was running */
    int quiet_ticks;   /* in OFF or FAULT without torque asked for */
    /* of boards */
    bool late, lost;    /* answers, ticks, since it began */
    bool deaf;          /* one does not stop */
    bool is_resumed;    /* since it was held */
    int64_t hold_by_ns; /* one that was asked for has begun then, on clock_ns */
    enum controller_state before_play;
    int play_err;
    uint32_t causes; /* a bit per enum controller_fault that may come */
};

/* What was seen, over all episodes: a run that has not been somewhere proves
 * nothing of it. */
struct stateful_tally {
    uint64_t state[CONTROLLER_FAULT + 1], homing[HOMING_STATES];
    uint64_t reversed, repeated, cued; /* ticks; times */
    uint64_t away;                     /* torque taken for it */
    uint64_t coupled, led,
        along;         /* ticks of a follower; moves: by a track, without */
    uint64_t on_board; /* ticks of a board that moves */
    uint64_t beside, shots; /* commands with a stop; pulses */
    uint64_t fault[32], by_drives, stop[STATEFUL_STOPS], range, goals;
    uint64_t excuse[STATEFUL_EXCUSES]; /* of drives that brake by themselves */
};

/* What an episode has beside drives that follow set points. */
struct stateful_kind {
    bool has_units;   /* axes that count in steps of an encoder, or in metres */
    bool has_boards;  /* some sample their tracks by themselves */
    bool has_cams;    /* gears and cams */
    bool has_shots;   /* pulses at times of the path */
    bool has_clients; /* several senders, one of which floods */
};

struct stateful {
    uint64_t first_seed, seed;
    struct stateful_kind kind;
    unsigned axes;
    int64_t period_ns, now_ns;
    int64_t clock_ns; /* a period per tick that is executed */
    uint64_t ticks;
    struct controller_config config;
    struct controller_axis_config axis_config[STATEFUL_AXES];
    struct homing_config home[STATEFUL_AXES];
    struct controller controller;
    struct controller_axis state[STATEFUL_AXES];
    struct controller_jog jog;
    struct homing homing;
    struct stateful_axis axis[STATEFUL_AXES];
    struct stateful_board board[STATEFUL_BOARDS];
    struct stateful_estop estop;
    struct stateful_line line[STATEFUL_AXES][STATEFUL_SWITCHES];
    struct hal_fieldbus_worst bus;
    int bus_ticks, lost;
    int skipped; /* ticks before this one; a drive by goals went on */
    int burst;   /* ticks until a stop; < 0: none */
    struct motion_segment storage[2][STATEFUL_AXES][STATEFUL_SEGMENTS];
    struct motion_track track[2][STATEFUL_AXES];
    struct motion_track_summary summary[2][STATEFUL_AXES]; /* of every other */
    struct controller_goal goal[2][STATEFUL_AXES][STATEFUL_GOALS];
    unsigned spare; /* of the two; the other may be played */
    struct stateful_reader reader[2];
    /* what the playback has loaded */
    struct playback playback;
    struct playback_axis playback_axis[STATEFUL_AXES];
    struct motion_segment loaded[STATEFUL_AXES][STATEFUL_SEGMENTS];
    struct motion_track loaded_track[STATEFUL_AXES];
    struct controller_goal loaded_goal[STATEFUL_AXES][STATEFUL_GOALS];
    struct stateful_coupling coupling[STATEFUL_AXES];
    struct mailbox mailbox;
    int flood; /* ticks in which jogs still come without a pause */
    struct stateful_shots shots;
    struct stateful_judge judge;
    struct stateful_tally tally;
    char note[STATEFUL_NOTE]; /* of this tick */
    struct {
        uint64_t tick;
        enum controller_state state;
        enum homing_state homing;
        int64_t rate_q30;
        int64_t pos_q32[STATEFUL_AXES];
        char note[STATEFUL_NOTE];
    } trace[STATEFUL_TRACE];
    enum stateful_violation violation; /* the first */
    int bad_axis;
    char what[STATEFUL_NOTE];
};

/* stateful_run.c.  Draw: a rig from the seed.  Begin: the controller on what
 * `config`, `home`, `axis` and the lines say. */
void stateful_begin(struct stateful *bench);
void stateful_tick(struct stateful *bench);
void stateful_ticks(struct stateful *bench, int ticks);
/* `ticks` of random commands; then off, from whatever state.  Plain: drives that follow
 * set points alone, as in every fourth one. */
void stateful_episode(struct stateful *bench, uint64_t seed, uint64_t ticks);
void stateful_plain_episode(struct stateful *bench, uint64_t seed,
                            uint64_t ticks);
void stateful_print(const struct stateful *bench);
void stateful_note(struct stateful *bench, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* The first one counts. */
void stateful_violate(struct stateful *bench, enum stateful_violation violation,
                      int axis, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* stateful_rig.c, stateful_move.c, stateful_draw.c, stateful_mishap.c.  Wide:
 * an episode with all there is; the others are as they were before, so that
 * those on record stay what they are.  Press: of the e-stop, as it should be. */
void stateful_draw_rig(struct stateful *bench);
bool stateful_draw_track(struct stateful *bench, unsigned i);
void stateful_draw_commands(struct stateful *bench);
bool stateful_is_wide(const struct stateful *bench);
void stateful_draw_mishaps(struct stateful *bench);
void stateful_may_come(struct stateful *bench, enum controller_fault fault);
void stateful_press(struct stateful *bench);
void stateful_heal(struct stateful *bench);
int64_t stateful_in(struct stateful *bench, int64_t low, int64_t high);
bool stateful_one_in(struct stateful *bench, int64_t n);
double stateful_between(struct stateful *bench, double low, double high);
int64_t stateful_q32(double value);

/* stateful_command.c: what the operator may do. */
int stateful_enable(struct stateful *bench);
int stateful_off(struct stateful *bench);
/* The tracks in `track`, of the axes in this mask. */
int stateful_start(struct stateful *bench, uint32_t axes);
int stateful_hold(struct stateful *bench);
int stateful_resume(struct stateful *bench);
int stateful_reverse(struct stateful *bench, bool is_reversed);
void stateful_stop(struct stateful *bench);
int stateful_override(struct stateful *bench, int64_t rate_q30);
int stateful_jog(struct stateful *bench, unsigned axis, int64_t pos_q32,
                 int64_t vel_q32, int64_t for_ns);
void stateful_jog_stop(struct stateful *bench, bool hard);
int stateful_homing(struct stateful *bench, uint32_t axes);
int stateful_reset(struct stateful *bench);
int stateful_set_position(struct stateful *bench, unsigned axis,
                          int64_t to_q32);
/* By what coupling[axis] says. */
int stateful_couple(struct stateful *bench, unsigned axis);
int stateful_uncouple(struct stateful *bench, unsigned axis);

/* stateful_play.c.  Step: after a tick; the judge is told what has begun. */
void stateful_load(struct stateful *bench, uint32_t axes);
int stateful_go(struct stateful *bench, int64_t at_ns_q12,
                enum playback_then then);
int stateful_repeat(struct stateful *bench, int64_t times, bool is_ping_pong);
void stateful_play_step(struct stateful *bench);
void stateful_draw_play(struct stateful *bench);

/* stateful_couple.c.  Draw: one is engaged, or let go.  Come back: the track of a master
 * does, now and then.  Axes: those that are to move.  Tracks: of coupled ones of these.
 * Engaged: it is, now.  Judge: after every tick. */
void stateful_draw_couple(struct stateful *bench);
void stateful_come_back(struct stateful *bench, unsigned i);
uint32_t stateful_coupled_axes(struct stateful *bench, uint32_t axes);
uint32_t stateful_coupled_tracks(struct stateful *bench, uint32_t axes);
bool stateful_any_coupled(const struct stateful *bench);
void stateful_engaged(struct stateful *bench, unsigned i);
void stateful_judge_coupled(struct stateful *bench);

/* stateful_client.c.  Draw: what comes in this tick beside all else. */
void stateful_draw_clients(struct stateful *bench);
/* One that came with a stop: none of it is done. */
void stateful_stop_among(struct stateful *bench, unsigned before,
                         unsigned after);

/* stateful_shot.c.  Arm: a move begins.  Step: in every tick, and the judge. */
void stateful_shots_begin(struct stateful *bench);
void stateful_shots_arm(struct stateful *bench);
void stateful_shots_step(struct stateful *bench);

/* stateful_onboard.c.  Rest: as long as one of them takes to stand, and to say so.
 * Ticks: that the board of an axis takes to do what it is told; 0: it has none. */
void stateful_draw_boards(struct stateful *bench);
void stateful_begin_boards(struct stateful *bench);
bool stateful_any_boards(const struct stateful *bench);
void stateful_break_board(struct stateful *bench, struct stateful_board *board);
void stateful_heal_boards(struct stateful *bench);
double stateful_board_rest_s(const struct stateful *bench);
int stateful_board_ticks(const struct stateful *bench, unsigned i);
void stateful_judge_boards(struct stateful *bench);

/* stateful_read.c.  Draw: what is started next is read while it is played.
 * Begin: the windows, in the place of tracks that are there.  Begun: these are
 * played, and may not be read in time.  Step: after a
 * tick, they are moved on.  Track: the whole of what an axis plays, or NULL. */
void stateful_draw_reader(struct stateful *bench);
void stateful_read_begin(struct stateful *bench,
                         const struct motion_track *track[]);
void stateful_read_begun(struct stateful *bench);
void stateful_read_step(struct stateful *bench);
const struct motion_track *stateful_track(const struct stateful *bench,
                                          unsigned i);

/* stateful_judge.c, after every tick; stateful_fault.c, stateful_stop.c,
 * stateful_home.c */
void stateful_judge_before(struct stateful *bench);
void stateful_judge_after(struct stateful *bench);
void stateful_judge_stop(struct stateful *bench);
void stateful_judge_homing(struct stateful *bench);
void stateful_judge_faults(struct stateful *bench);
void stateful_judge_torque(struct stateful *bench);
/* stateful_goal.c.  Rest: how long it takes at most after a stop; rise: by how
 * much it may get faster until a halt has come through. */
void stateful_judge_goals(struct stateful *bench);
double stateful_goal_rest_s(const struct stateful *bench, unsigned i);
double stateful_goal_brake_q32(const struct stateful *bench, unsigned i,
                               int direction);
int64_t stateful_goal_turn_ns(const struct stateful *bench, unsigned i);
/* In a hold a drive without a halt runs on. */
bool stateful_goal_runs_on(const struct stateful *bench, unsigned i);
double stateful_goal_rise(const struct stateful *bench, unsigned i);
/* A stop was asked for; a motion, or a resume, was accepted. */
void stateful_stop_requested(struct stateful *bench,
                             enum stateful_stop_kind kind);
void stateful_motion_begins(struct stateful *bench, enum stateful_motion motion,
                            enum controller_state was);
bool stateful_in_motion(enum controller_state state);
/* Distance to rest from this speed and acceleration, both along the motion,
 * in Q32.32. */
double stateful_brake_q32(const struct motion_clock_limit *limit, double vel,
                          double acc);
/* Position, speed and acceleration by differences of set points. */
double stateful_vel(const struct stateful *bench, unsigned i);
double stateful_acc(const struct stateful *bench, unsigned i);
double stateful_unit(int64_t value_q32);
/* By how much a set point may be off for it, in units. */
double stateful_rounding(const struct stateful *bench, unsigned i);

#endif
