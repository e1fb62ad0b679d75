/* motion/path/head.h - a rotation as the pan, tilt and roll of a camera head,
 * and the tracks of its three axes.
 *
 * In the frame of the mount, x is right, y up, -z forward, and
 *
 *     q = pan about up, then tilt about right, then roll about the view
 *
 * each by the right-hand rule: pan is positive to the left, tilt upwards, roll
 * clockwise as the camera sees it.  All angles are zero when the camera looks
 * forward, level.  Every orientation has two sets of angles (pan, tilt, roll)
 * and (pan + 1/2, 1/2 - tilt, roll + 1/2 turn), each plus whole turns; the one
 * nearest to the set before is taken, so the axes run on over +-180 degrees and
 * a tilt goes on over the top instead of all three jumping.  Straight up and
 * down pan keeps its angle and roll takes the rest.  Plan-time. */
#ifndef MOTION_PATH_HEAD_H
#define MOTION_PATH_HEAD_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"
#include "motion/number/quat.h"

enum motion_head_axis {
    MOTION_HEAD_PAN,
    MOTION_HEAD_TILT,
    MOTION_HEAD_ROLL,
    MOTION_HEAD_AXES,
};

/* Zero-initialised it starts afresh: pan and roll in -180 .. 180 degrees, tilt
 * in -90 .. 90. */
struct motion_head {
    int64_t turn[MOTION_HEAD_AXES];  /* the angles, modulo one turn (trig.h) */
    int64_t whole[MOTION_HEAD_AXES]; /* turns that went by */
    bool valid;
};

/* Go on to rotation q.  MOTION_E_RANGE beyond 2^22 turns, head unchanged. */
int motion_head_follow(struct motion_head *head, struct motion_quat q);

/* An angle in degrees, Q32.32, and whole turns counted. */
int64_t motion_head_deg_q32(const struct motion_head *head,
                            enum motion_head_axis axis);

/* Set one, and that the head starts there; |deg| < 2^30. */
void motion_head_set_deg_q32(struct motion_head *head,
                             enum motion_head_axis axis, int64_t deg_q32);

/* The rotation of three angles. */
struct motion_quat motion_head_quat(const int64_t turn[MOTION_HEAD_AXES]);

/* --- tracks -------------------------------------------------------------- */

/* Something that turns: q at a time, the same q whenever it is asked for that
 * time.  MOTION_OK or an error, which is handed on. */
struct motion_turning {
    int (*at)(void *context, int64_t t_ns_q12, struct motion_quat *q);
    void *context;
};

struct motion_head_bake {
    /* What is baked: times from[0] .. from[count - 1], increasing, of which the
     * inner ones are where its derivatives may step (keys, rests). */
    const int64_t *border_ns_q12;
    uint32_t borders;
    int64_t tolerance_q32;   /* degrees, > 0 */
    int64_t shortest_ns_q12; /* segments; 0: 2^-8 s.  Below is given up. */
    /* Derivatives are taken from 7 orientations this far apart; 0: 2^-10 s.  A
     * sixteenth of the stretch where that is shorter.  Wider for a turning with
     * noise: e degrees of it become 3 e / width^2 of acceleration. */
    int64_t stencil_ns_q12;
    uint32_t evaluations; /* at most, as bake.h; 0: any number */
    bool is_rest;         /* before the first time and after the last one */
};

/* Append quintics to the tracks of pan, tilt and roll, which end where the
 * turning begins (2^-30 degree), with the baker of bake.h: positions,
 * velocities and accelerations continue at every segment but at inner borders,
 * where they do, too, if they step by less in a second than a 16th of the
 * tolerance, which is the rounding of the stencil,
 * and bound_q32[axis] in degrees, at most the tolerance, is the error bound.
 * What the stencil misses of a derivative is not in it: 1 / 140 width^6 f7 of
 * f' in the middle of a stretch, 1 / 7 at its ends.  Within a 64th of a stretch
 * no axis may turn by half a turn.
 *   head   where to go on from, and then where it ended
 * MOTION_E_TOLERANCE when the shortest segment does not meet it, MOTION_E_WORK, MOTION_E_ARG,
 * MOTION_E_ORDER for borders, MOTION_E_RANGE for borders less than 16 ns apart,
 * MOTION_E_FULL, or what the turning or the tracks return; tracks and head are
 * unchanged on an error. */
int motion_head_bake(const struct motion_head_bake *job,
                     const struct motion_turning *turning,
                     struct motion_head *head,
                     struct motion_track *track[MOTION_HEAD_AXES],
                     int64_t bound_q32[MOTION_HEAD_AXES]);

#endif
