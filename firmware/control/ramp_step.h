/* firmware/control/ramp_step.h - a change of rate where a tick has few
 * instructions: step by step, each with a way back to a constant rate.
 *
 * To look along whole ramps would take millions of instructions in the tick of the
 * request.  The horizon is short instead, because one thing is certain: at a
 * constant rate that the move's limits allow every axis keeps them, wherever the
 * path goes (clock_warp.h: with r' = r'' = 0 the limits only shrink with r).  So a
 * candidate needs to be judged until r' is 0 and no further, and what is in force
 * always ends so (in the words of predictive control, r' = 0 is the terminal
 * invariant set; Mayne et al., Automatica 36 (2000), 3.3).
 *
 *   candidate  From the state at its begin: for `wait` ticks r'' towards the target,
 *              as large as seems to fit, then back to r' = 0 by one r'' in n ticks.
 *              It may not go beyond the target; where it would, n and the peak of r'
 *              are such that it ends there, and the search is over.  Where r' < 0
 *              points away from the target it is brought back to 0 from the begin on,
 *              in fewer ticks than by what is in force, in two ticks from now at most;
 *              where r' > 0 does, see below.
 *   judged     span by span (ramp_span.c): over a span of time and the path that it
 *              goes through p'' and p''' are where interval arithmetic puts them
 *              (ramp_limit.h), from where f', f'' and f''' are
 *              (motion/core/track_enclose.h): axis by axis, segment by segment, so
 *              that it goes on in the next tick where one has no more for it.
 *              Nothing is kept of a track but how far it was looked at, so it may be
 *              a window, or have begun in this tick.  A span also gives by what
 *              factor r'' or r' would just fit there: a candidate that fails is made
 *              anew by a little less, the next one begins with it.
 *   in force   when it fits, at its begin: `lead` ticks after it was made, 0 where all of
 *              this fits into one: to begin with as many as judging takes where segments
 *              are long, more from when one was not ready in time, less where eight in a
 *              row would have been in less.  `wait` is as long, so that the next one
 *              follows at its end.  Where none is there in time the clock goes on to
 *              r' = 0 as it was judged, and the search from there.
 *
 * So r'' is chosen anew every few ticks by what the path leaves just there, and rest
 * often comes sooner than by the shortest ramp of one A and J, which its tightest
 * place rules.  A tick does pieces of this for config.effort: at most 12,000
 * instructions for a tick of six axes, whatever it does (make bench-tick).
 *
 * A stop of one axis at 100 %, 1 kHz: at tick 0 r'' = -1.2 per s2 fits where the path
 * is, and 3 ticks are judged that bring r' back to 0: that is in force at once.  In
 * tick 1 the rate has begun to fall, r'' = -1.3 fits, and so on; at tick 60 r' = -2
 * is all that p'' leaves, so r'' follows what the path leaves from there on; at tick
 * 300 the way back ends at rate 0.
 *
 * Level before all else.  A rise is judged along with every way to bring r' back to 0
 * sooner: from any tick of it, by any r'' between its own and -b within the limits, -b'
 * within the stop limits, b and b' as large as fit.  What such a fall goes through is
 * between the candidate itself and where r' = 0, the rate has not risen and the path is
 * behind (span_behind), so that one more product of intervals per b judges them all.
 * What is asked for while r' > 0 needs no search then: the fall by b is in force from
 * that tick on, the rate rises by r'^2 / 2b and no more.  b is what the tightest place
 * of all of these ways leaves; so from the next tick or two on, and so forth every few
 * ticks, r'' is as steep as the path leaves just there (step_steeper): one span is
 * judged, and what comes after it, the fall by b, has been.  That holds over requests
 * that follow, until r' is 0.  A rise itself takes a thirty-second of the steepest r''
 * that spans hold, so that it can be brought back by that within few ticks.
 *
 * Rest is due to the tick, at a time that is stated with the request (ramp_rest.c).
 * Let F be the ticks of the fall, or of what is left of a rise that was scheduled, at
 * most 8 + 3 r' / J, and r the rate after it, 0 and the present rate where r' <= 0; and D(k) what the shortest ramp from r
 * to 0 within A / k and J / k takes, with A and J that alone would use the whole of the
 * limits at the peaks of the tracks (ramp_bound.c), A' and J' of the stop limits, or of
 * 8 times the limits where these are less: no ramp uses more (RAMP_STOP_TIMES):
 *     D(k) = k r / A + A / J    for r >= A^2 / (k J), where r' comes up to A / k,
 *            2 (k r / J)^1/2    below
 * in ticks, rounded up; and, with 8 the longest lead, of which one passes until a
 * candidate begins, which lasts another, and a third until the one that ends in rest has,
 *     stop   F + 24 + D'(4)
 *     else   F + 24 + D'(4) + D(3)
 * From 24 + D'(4) before that time on the stop limits count for a hold or stop.  What was
 * learned by other limits is worth little then: r'' is J' at least to begin with.  A ramp
 * in force that ends in rest too late gives way to any that is steeper.  Where
 * rest has not come by then the drives' quick stop takes over in the next tick: a track
 * at its limits, above all one that brakes from its peak, may leave no r' < 0 at all,
 * so no such time is certain without that.  make ramps counts how often.
 *
 * What it does not do.  Where segments are so dense that the way back to r' = 0 takes
 * more of them than are judged in the 8 ticks of the longest lead, no candidate is
 * there in time: rest comes by the drives.  With six axes that is some 50 segments in
 * all on that way. */
#ifndef FIRMWARE_CONTROL_RAMP_STEP_H
#define FIRMWARE_CONTROL_RAMP_STEP_H

#include "firmware/control/parts.h"

/* Where r' is brought to 0 from now on, which was judged with the rise that is in
 * force: by that r'' in so many ticks, and what is left in one more. */
struct controller_step_fall {
    struct motion_clock_begin begin;
    int32_t ticks;
    int64_t left_q56;
};
bool controller_step_fall(const struct controller *controller, bool stop,
                          struct controller_step_fall *fall);

/* ramp_rest.c.  Rest: of the limits, or the stop limits, once per move.  Stop: ticks
 * from the rate to rest within the stop limits, with the longest lead. */
struct controller_step_rest
controller_step_rest(const struct controller *controller, bool stop);
int64_t controller_step_stop_ticks(const struct controller *controller,
                                   int64_t rate_q30);
/* The same of what a hold or stop takes from that rate where r' <= 0: D'(4) with its
 * leads, and D(3) unless `stop`. */
int64_t controller_step_rest_ticks(const struct controller *controller,
                                   int64_t rate_q30, bool stop);

/* ramp_span.c.  A piece of judging: the next span is begun; in it a segment of the
 * track of step.axis, until that is config.axis_count, for all have been judged, or
 * one does not keep its limits; or it ends.  True: it has, and step.verdict says
 * whether it is kept. */
bool controller_span_step(struct controller *controller);

/* ramp_scheduled.c.  Goes on: is a ramp still scheduled, or in force?  Else it is
 * forgotten.  Judge: a piece of that, as of a candidate; false: there is nothing
 * to be judged. */
bool controller_scheduled_goes_on(struct controller *controller);
bool controller_scheduled_judge(struct controller *controller);

#endif
