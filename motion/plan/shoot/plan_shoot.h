/* motion/plan/shoot/plan_shoot.h - a move photographed frame by frame.
 *
 * The move, as its keys or its path have it, is one shot of `frames` pictures.
 * Playing it picture by picture is a warp of its time, w(t), made here, and one
 * exposure every `period`.  With D the move's length, E exposure, M move, S
 * settle, b blur:
 *
 *   stop        shoot, move, shoot: rests on k D / (frames - 1) for S + E, then
 *               takes M to the next; from rest to rest by the quintic of least
 *               jerk.  The first picture is the move's start, the last its end.
 *   go-motion   moves while the shutter is open: during E over b of a frame's
 *               share d = D / frames, at constant rate r = b d / E, so that
 *               movement blurs as with a shutter of b 360 degrees.  The picture's
 *               middle is at (k + 1/2) d.  Between exposures, over (1 - b) d in M,
 *               it does not stop where M <= 2 R, R = (1 - b) E / b; else it slows
 *               to rest in R, waits, and is at speed again after R more: a ramp
 *               from 0 to r in R covers just half of (1 - b) d.  So it never has
 *               to go back for a run-up, nor before the first picture, which
 *               comes after S + R, nor behind the last.
 *   continuous  go-motion with b = E / (E + M): one constant rate from the first
 *               exposure to the last.
 *
 * Step by step the rest before each picture is longer by `wait`, during which the
 * clock may be made to stand until it is told to go on (frame_step.h): in `stop`
 * after the settling, in go-motion before the run-up, and not where it does not
 * rest.
 *
 * Source: R. Edlund et al., Go-Motion (US patent 4,353,634 and others, ILM); the
 * quintic: T. Flash, N. Hogan, J. Neuroscience 5 (1985), eq. 3. */
#ifndef MOTION_PLAN_SHOOT_PLAN_SHOOT_H
#define MOTION_PLAN_SHOOT_PLAN_SHOOT_H

#include "motion/plan/move.h"

#define PLAN_SHOOT_FRAMES_MAX 100000

/* X(name, word). */
#define PLAN_SHOOT_LIST(X)                                                     \
    X(PLAN_SHOOT_STOP, "stop")                                                 \
    X(PLAN_SHOOT_GO_MOTION, "go-motion")                                       \
    X(PLAN_SHOOT_CONTINUOUS, "continuous")

enum plan_shoot_mode {
#define PLAN_SHOOT_ENUM(name, word) name,
    PLAN_SHOOT_LIST(PLAN_SHOOT_ENUM)
#undef PLAN_SHOOT_ENUM
        PLAN_SHOOT_MODES
};

#define PLAN_SHOOT_NO_LINE UINT32_MAX

struct plan_shoot {
    enum plan_shoot_mode mode;
    uint32_t line;           /* trigger, as in plan_event.h, or NO_LINE */
    uint32_t frames;         /* 2 .. PLAN_SHOOT_FRAMES_MAX */
    int64_t exposure_ns_q12; /* > 0 */
    int64_t move_ns_q12;     /* > 0 */
    int64_t settle_ns_q12;   /* >= 0 */
    int64_t blur_q32;        /* go-motion: 1 % .. 99 % */
    bool steps;              /* waits before each picture, for an edge of */
    uint32_t step_line;      /* this line of the rig, or NO_LINE */
    int64_t wait_ns_q12;     /* > 0 where it steps, else 0 */
    struct plan_place place;
};

/* Exposure k opens at first + k period, 2^-12 ns of the move as played, and the
 * wait for it begins at wait + k period; the last one and the end, when all is at
 * rest, INT64_MAX where that is more than any move may take. */
struct plan_shoot_times {
    int64_t first_ns_q12, period_ns_q12, last_ns_q12, end_ns_q12, wait_ns_q12;
};
void plan_shoot_times(const struct plan_shoot *shoot,
                      struct plan_shoot_times *times);

/* The warp for a move that is so long, as keys (plan_warp.h) on the heap:
 * plan_axis_free.  MOTION_E_ARG where it is to step and does not rest,
 * MOTION_E_EMPTY for a move that takes no time, MOTION_E_RANGE
 * for one that would take longer than a track may, MOTION_E_FULL; *error has
 * the sentence then, and nothing is allocated. */
int plan_shoot_warp(const struct plan_shoot *shoot, int64_t length_ns_q12,
                    struct plan_axis *warp, struct plan_error *error);

#endif
