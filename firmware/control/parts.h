/* firmware/control/parts.h - what the controller's own files share. */
#ifndef FIRMWARE_CONTROL_PARTS_H
#define FIRMWARE_CONTROL_PARTS_H

#include "firmware/control/controller.h"

/* watch.c: count ticks; read every drive's feedback; then judge it. */
void controller_watch_tick(struct controller *controller, int64_t now_ns);
void controller_watch_read(struct controller *controller);
void controller_watch_judge(struct controller *controller);

/* controller.c: latch a fault (the first is recorded) and start its reaction,
 * unless a stronger one is under way. */
void controller_raise(struct controller *controller,
                      enum controller_fault fault, int axis, int64_t value,
                      int64_t limit);

/* controller.c: enter a state; ask every drive; end of motion (no track, no
 * speed, set points stay); is a move being played? */
void controller_enter(struct controller *controller,
                      enum controller_state state);
void controller_request(struct controller *controller,
                        enum hal_drive_request request);
void controller_rest(struct controller *controller);
bool controller_in_motion(const struct controller *controller);
/* The clock stands where it is, from now on; or goes at this rate from there. */
void controller_stand(struct controller *controller);
void controller_clock_set(struct controller *controller, int64_t s_ns_q12,
                          int64_t rate_q30);
/* The path's clock is at rate 0 for good, or at the end of the tracks. */
bool controller_clock_stands(const struct controller *controller);
/* True, and the clock stands from now on, when by the last set points every
 * axis is at rest: nothing has to slow down. */
bool controller_freeze(struct controller *controller);
/* Where an axis is that has no set point of ours: a drive that samples its track has one
 * of its own. */
int64_t controller_place_q32(const struct controller_axis *axis);
/* Does the axis have to stay inside its range? */
bool controller_range_counts(const struct controller *controller,
                             unsigned index);
/* In which its drive follows what the controller tells it. */
enum hal_drive_mode controller_usual_mode(const struct controller *controller,
                                          unsigned index);
/* Does a drive move its axis by itself: homing, to a goal, or (`samples`) to rest on a
 * track that it samples? */
bool controller_any_by_profile(const struct controller *controller,
                               bool samples);
/* In FAULT, standing with torque on. */
bool controller_is_held(const struct controller *controller);

/* ramp_bound.c: of an axis, or its stop limits; of a master what leaves its
 * followers inside theirs.  Divides. */
struct motion_clock_limit controller_limit(const struct controller *controller,
                                           unsigned axis, bool stop);

/* ramp_step.c.  Load: what is played has begun.  Seek: once per tick, in motion, for
 * a way to wanted_q30 within the limits.  Request: for one that was asked for, before
 * its tick, of which it takes a part.  Load divides. */
void controller_step_load(struct controller *controller);
void controller_step_seek(struct controller *controller);
void controller_step_request(struct controller *controller);
/* How long it takes at most from now until the rate is 0, in ns of clock_ns, in a
 * move that is being played (see ramp_step.h). */
int64_t controller_step_bound_ns(const struct controller *controller,
                                 bool stop);
/* ramp_bound.c.  A hold or stop is under way, whose rest is due; by when, on clock_ns;
 * INT64_MAX: at no time. */
bool controller_slows(const struct controller *controller);
int64_t controller_due_ns(const struct controller *controller);
/* Path time that a stop within the stop limits takes at most, as a rule, from
 * the rate, on a track of one axis. */
int64_t controller_ramp_reserve(const struct controller *controller,
                                unsigned index,
                                const struct motion_track *track,
                                int64_t rate_q30);

/* path.c.  Path ns, path: the path's time, and its rate, at a time of the clock
 * that reads the move.  State: of a track, as that clock reads it. */
int64_t controller_path_ns_q12(const struct controller *controller,
                               int64_t s_ns_q12);
void controller_path(const struct controller *controller,
                     struct motion_clock_rate *rate);
void controller_path_state(const struct controller *controller,
                           const struct motion_track *track, int64_t s_ns_q12,
                           struct motion_state *state);

/* controller.c: what an axis is told in this tick, and its feed-forward. */
void controller_tell(struct controller *controller, unsigned i,
                     const struct motion_sample *sample);

/* gate.c: may this set point go to the drive now?  When not, the
 * value that was too large and what was allowed. */
void controller_gate_init(struct controller *controller, unsigned index);
bool controller_gate_pass(struct controller *controller, unsigned index,
                          int64_t pos_q32, int64_t *value, int64_t *limit);
/* May the axis be anywhere from low to high?  Its range, or, from outside of
 * it, no further out than marked.  Mark: a motion of it begins there. */
bool controller_gate_range(const struct controller *controller, unsigned index,
                           int64_t low_q32, int64_t high_q32);
void controller_gate_mark(struct controller *controller, unsigned index,
                          int64_t pos_q32);
/* Remember what was sent. */
void controller_gate_sent(struct controller *controller, unsigned index,
                          int64_t pos_q32);

/* command.c.  Largest: |value| on a track, saturated.  Peak: the same; of an
 * acceleration or a jerk less what rounding makes of it: of the coefficients, and
 * 2^-28 (motion/plan/check.c); of a window from its outline, which the plan's check
 * has judged.  Axis play: the axis plays this track from its start (NULL:
 * none).  Admit: whether it keeps to the range of the axis, or comes in from
 * where that stands outside, which then is marked; of an axis that is so far beside
 * the track.  Play: from path time 0 at
 * this rate. */
int64_t controller_largest(const struct motion_track *track,
                           enum motion_quantity quantity);
int64_t controller_peak(const struct motion_track *track,
                        enum motion_quantity quantity);
void controller_axis_play(struct controller_axis *axis,
                          const struct motion_track *track);
bool controller_admit(struct controller *controller, unsigned index,
                      const struct motion_track *track, int64_t beside_q32);
void controller_play(struct controller *controller, int64_t rate_q30);
/* command.c: of windows, what a stop from the rate there is or is to be needs. */
void controller_set_reserve(struct controller *controller);
/* command.c: the drives are asked to enable, once none has torque; false: one
 * still has. */
bool controller_ask(struct controller *controller);
/* command.c: the clock is to stand, and by when it does. */
void controller_slow_down(struct controller *controller,
                          enum controller_state state);

/* couple.c, of which jogs and homing are the users; the rest goes by couplings.
 * Place: no further than the curves of the followers of a master go.  Follow: they
 * go along with this track of it, from where they stand; MOTION_E_LIMIT: it leaves
 * a curve, MOTION_E_AWAY: one does not stand on its own. */
bool controller_any_coupled(const struct controller *controller);
int64_t controller_coupled_place(const struct controller *controller,
                                 unsigned master, int64_t pos_q32);
int controller_coupled_follow(struct controller *controller, unsigned master,
                              const struct motion_track *track);

/* gantry.c, of which jogs and homing are the users; the rest goes by the gantries'
 * functions: the other rail goes along with this track of the leader, from where it
 * stands; MOTION_E_LIMIT: it leaves its range.  Nothing of an axis that is no rail. */
int controller_gantry_follow(struct controller *controller, unsigned leader,
                             const struct motion_track *track);

/* home.c: the drive's own positions and the axis's. */
void controller_from_drive(const struct controller_axis *axis,
                           struct hal_drive_feedback *feedback);
int controller_to_drive(struct controller_axis *axis,
                        const struct hal_drive_target *target);

int controller_go_to_drive(struct controller_axis *axis,
                           const struct hal_drive_go *go);

/* As controller_stop and controller_jog, but for homing's own use: they are not the
 * operator's. */
void controller_halt(struct controller *controller);
struct controller_jog_goal;
int controller_jog_run(struct controller *controller,
                       struct controller_jog *jog,
                       const struct controller_jog_goal *goal);

/* goal.c.  Step: after a tick's set points, sends what is due and
 * watches what is on its way.  Set: what comes next, also while the drive is
 * under way.  Drop: forget the goals; an axis that has not reached all of them
 * goes on from where it stands.  Forget: of all axes, in READY. */
void controller_goal_step(struct controller *controller);
void controller_goal_set(struct controller_axis *axis,
                         const struct controller_goal goal[], unsigned count);
void controller_goal_drop(struct controller_axis *axis);
void controller_goal_forget(struct controller *controller);
/* Is a drive on its way to a goal?  Has every axis been at all of its goals, or
 * been stopped, and stands? */
bool controller_goal_is_running(const struct controller_leg *leg);
bool controller_goals_are_running(const struct controller *controller);
bool controller_goals_reached(const struct controller *controller);
/* What the drive's profile takes at most from where and how fast the axis is: a
 * change of speed by v takes v / a, and what it goes wrong until then v^2 / 2a;
 * a distance d from rest to rest takes d / v + v / a, or less.  Divides. */
int64_t controller_goal_distance_ns_q12(const struct hal_drive_feedback *now,
                                        const struct hal_drive_go *go);

/* An input that is there, and active or unreadable. */
bool controller_input(struct hal_gpio *line);

#endif
