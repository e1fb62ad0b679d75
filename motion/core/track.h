/* motion/core/track.h - the one trajectory form: a piecewise polynomial in
 * integers.
 *
 * Whatever plans ends in a track; whatever moves a motor samples one.  A track
 * is a list of segments that follow each other without a gap.  Segment i runs
 * over [start, start + dur) and there, with u = (t - start) / dur,
 *
 *     p(t) = pos + (c[0] + c[1] w + ... + c[5] w^5) / 2^(32 + frac),  w = u / 2
 *
 * where pos is Q32.32 and the coefficients are integers.  The coefficients are
 * scaled to the position, not to seconds, so rounding does not grow with the
 * length of a segment; `frac` is chosen per segment so that they use the 62
 * bits there are (a float's exponent, shared by the six; zero and below when a
 * segment travels far, a quintic over 2^18 units, a line over 2^27; below zero
 * `remainder` u / 2^32, what the steps leave of the travel, is added).  w = u/2
 * lets the tick multiply signed by signed; c[k] is 2^k times the coefficient
 * of u^k.  The sum at u = 1 is the next segment's value to the bit: the last
 * coefficient absorbs what rounding left over.  c[0] is the fraction of the
 * start below 2^-32; at a key it is zero and sampling returns the key itself.
 *
 * Position is defined by motion_track_sample alone; every other function here
 * agrees with it.  Evaluation is absolute: nothing is accumulated from tick to
 * tick, so a six-hour move ends where it was told to. */
#ifndef MOTION_CORE_TRACK_H
#define MOTION_CORE_TRACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

#define MOTION_TRACK_DEGREE 5

/* Longest segment and longest track: 2^60 / 4096 ns = 3.2 days for a segment,
 * 19 days for a track. */
#define MOTION_TRACK_SEGMENT_MAX_NS_Q12 ((int64_t)1 << 60)
#define MOTION_TRACK_MAX_NS_Q12         ((int64_t)3 << 61)

/* The most a segment may reach, +-: 2^31 - 1 unit and unit/s.  Its acceleration
 * may be over the most that samples tell, half of what the format holds, so
 * that rounding never wraps: 1.07e9 unit/s2. */
#define MOTION_TRACK_POS_MAX_Q32 ((int64_t)INT32_MAX << 32)
#define MOTION_TRACK_VEL_MAX_Q32 ((int64_t)INT32_MAX << 32)
#define MOTION_TRACK_ACC_MAX_Q32 (INT64_MAX / 2)

/* Position and derivatives at one time. */
struct motion_state {
    int64_t pos_q32;  /* unit */
    int64_t vel_q32;  /* unit/s */
    int64_t acc_q32;  /* unit/s2 */
    int64_t jerk_q32; /* unit/s3 */
};

/* What the tick gets. */
struct motion_sample {
    int64_t pos_q32;
    int64_t vel_q32;
    int64_t acc_q32;
};

struct motion_segment {
    int64_t start_ns_q12;
    int64_t dur_ns_q12; /* > 0 */
    int64_t pos_q32;
    int64_t coef[MOTION_TRACK_DEGREE + 1];
    /* Derived from the above when the segment is made, so that the tick does
     * not divide; see track_append.c for their bounds.  A scale is high * 2^32
     * + low, both signed. */
    uint64_t inverse; /* 2^127 / (dur << normalise), rounded down */
    int32_t vel_scale_high, vel_scale_low; /* d/dw to unit/s */
    int32_t acc_scale_high, acc_scale_low;
    int32_t pos_scale; /* 2^(32 - frac), or 2^-frac where frac <= 0 */
    int32_t remainder; /* of the travel, below 2^-frac */
    int8_t frac;       /* 2..31, or -14..0 */
    uint8_t normalise; /* leading zeros of dur */
    uint8_t degree;    /* highest coefficient that is not zero */
    uint8_t kind;      /* how to sample it: enum motion_segment_kind */
    uint8_t vel_shift, acc_shift; /* left, where a scale is not enough */
    uint16_t vel_factor;          /* 2^vel_shift, of the far kind */
};

enum motion_segment_kind {
    MOTION_SEGMENT_CUBIC,   /* degree 0..3 */
    MOTION_SEGMENT_QUINTIC, /* degree 4, 5 */
    MOTION_SEGMENT_FAR,     /* frac <= 0, acc_shift 0 */
    MOTION_SEGMENT_SHORT,   /* any other with a shift */
};

struct motion_track_outline;
struct motion_track_summary;

/* The caller owns the segments; the track only points at them.  A const track
 * may be sampled from several threads, each with its own cursor.
 *
 * A track that is too long to be held is a window: `segment` are `count` (at
 * least 1) consecutive ones of it, end, end_frac and the outline are those of
 * the whole.  Whoever owns it moves the window between ticks.  Nothing may be
 * appended to a window, and functions that look at every segment see those. */
struct motion_track {
    struct motion_segment *segment;
    uint32_t count, capacity;
    int64_t end_ns_q12;      /* 0 while empty */
    struct motion_state end; /* at the end; the next segment starts here */
    uint64_t end_frac;       /* fraction of end.pos below 2^-32, as Q0.64 */
    const struct motion_track_outline *outline; /* NULL: no window */
    const struct motion_track_summary *summary; /* of a whole one; NULL: none */
};

/* Where the last sample was found; zero-initialised it starts at the front. */
struct motion_cursor {
    uint32_t index;
};

/* Empty track that starts at `pos_q32`, time 0. */
void motion_track_init(struct motion_track *track,
                       struct motion_segment *segment, uint32_t capacity,
                       int64_t pos_q32);

/* The appending functions below add one segment from the track's present end
 * and return MOTION_OK, MOTION_E_FULL (no room), MOTION_E_ARG (duration not in
 * 1 .. MOTION_TRACK_SEGMENT_MAX), or MOTION_E_RANGE (the curve between the
 * ends or its velocity go over the MAX above, judged by their control polygons,
 * or the track becomes too long).  Acceleration and jerk saturate instead.
 * On an error the track is unchanged.  After an append, track->end is the
 * state at its end.  Plan-time. */

/* Stand still. */
int motion_track_append_dwell(struct motion_track *track, int64_t dur_ns_q12);

/* Straight line to pos_q32. */
int motion_track_append_line(struct motion_track *track, int64_t dur_ns_q12,
                             int64_t pos_q32);

/* Cubic Hermite: from the position where the track ends, with velocity
 * start_vel_q32 there, to pos and vel of `end` (acc, jerk ignored).
 *   p = h00 p0 + h10 T v0 + h01 p1 + h11 T v1,  h01 = -2u^3 + 3u^2 */
int motion_track_append_cubic(struct motion_track *track, int64_t dur_ns_q12,
                              int64_t start_vel_q32,
                              const struct motion_state *end);

/* Quintic Hermite: position, velocity and acceleration at both ends; `start`
 * gives vel and acc (its pos is the track's end). */
int motion_track_append_quintic(struct motion_track *track, int64_t dur_ns_q12,
                                const struct motion_state *start,
                                const struct motion_state *end);

/* The lowest-degree polynomial that meets `start_order` constraints at the
 * start and `end_order` at the end (1: p; 2: p, v; 3: p, v, a); degree
 * start_order + end_order - 1.  The three above are cases of this one. */
int motion_track_append_constraints(struct motion_track *track,
                                    int64_t dur_ns_q12, int start_order,
                                    const struct motion_state *start,
                                    int end_order,
                                    const struct motion_state *end);

/* Raw: coefficients of u^1 .. u^5 (of u, not of w), each `coef[k-1]` / 2^(32 +
 * frac), frac 0..31, and the end position, in which the rounding residue is
 * absorbed by the highest coefficient given.  end_frac is what the end has
 * below 2^-32, as Q0.64; the next segment starts there, as far as its own
 * fraction goes.  For planners whose polynomial is more exact than its end
 * states. */
int motion_track_append_poly(struct motion_track *track, int64_t dur_ns_q12,
                             int degree, const int64_t coef[], unsigned frac,
                             int64_t end_pos_q32, uint64_t end_frac);

/* Fill in what is derived of a segment whose start, duration, pos, coef, frac
 * and remainder are given, as they were in one that was appended.  MOTION_E_ARG
 * for a time or a form that no segment has, MOTION_E_RANGE where it would leave
 * the formats: nothing that this accepts overflows in the tick.  Plan-time. */
int motion_segment_restore(struct motion_segment *segment);

/* Tick: p, v, a at `t`, in at most 150 instructions on a Cortex-M4 once the
 * cursor is at the segment.  The cursor moves by at most one segment per call
 * when t goes on or back by less than the shortest; when it is further off,
 * the segment is searched by halving, at most 32 steps.  Before 0 the start,
 * at rest; at the end its end state; after it the end position, at rest.  Where
 * the segment is not in the window: the start of the nearest that is, at rest.
 *   pos   the key itself at a key; else within 2 units of 2^-32 of the
 *         polynomial (of 2^(-32-frac) where frac < 0), never a division, the
 *         same bits everywhere
 *   vel   within 3 units of 2^-32 unit/s (24 in a segment under 2 ns) and
 *         2^-60 unit / dur, or 2^-46 of the segment's largest
 *   acc   within 3 units of 2^-32 unit/s2 or 2^-20 of the segment's largest
 *         or 2^-30 unit / dur^2: what the position itself can show (in 1 ms,
 *         1e-3 unit/s2); 0 where a segment is shorter than 0.7 ns or may be
 *         over MOTION_TRACK_ACC_MAX */
void motion_track_sample(const struct motion_track *track,
                         struct motion_cursor *cursor, int64_t t_ns_q12,
                         struct motion_sample *sample);

/* How far a sample's position may be from the polynomial: a track that ends on
 * the border of a range may come out so far beyond it on its way. */
#define MOTION_TRACK_POS_ROUNDING 2

/* All of p, v, a, j, rounded from the polynomial evaluated with 128 bits (pos
 * as motion_track_sample gives it); within 1 unit and 2^-92 unit / dur^order,
 * or 2^-58 of the segment's largest.  Saturates.  At a segment border the later
 * segment's.  Bounded, no division, but ten times the work of a sample. */
void motion_track_state(const struct motion_track *track, int64_t t_ns_q12,
                        struct motion_state *state);

/* The same on one segment; `t` from 0 to dur inclusive, from its start. At dur
 * it is the left-hand limit at the border. */
void motion_segment_state(const struct motion_segment *segment,
                          int64_t t_ns_q12, struct motion_state *state);

/* Smallest and largest value of p, v, a, j on one segment and where (time from
 * the start of the track), from the roots of the derivatives, which are
 * isolated by the roots of the next derivative and searched to the last bit;
 * not by sampling.  Plan-time, bounded: at most 4 roots of 120 steps each,
 * about 10 as a rule.  All four together cost as much as that of the position
 * alone. */
struct motion_extreme {
    int64_t min, max; /* in the format of `quantity` */
    int64_t min_ns_q12, max_ns_q12;
};
enum motion_quantity { MOTION_POS, MOTION_VEL, MOTION_ACC, MOTION_JERK };
void motion_segment_extreme(const struct motion_segment *segment,
                            enum motion_quantity quantity,
                            struct motion_extreme *extreme);
void motion_segment_extremes(const struct motion_segment *segment,
                             struct motion_extreme extreme[MOTION_JERK + 1]);
/* To those of both; of equal ones what is there stays. */
static inline void motion_extreme_extend(struct motion_extreme *all,
                                         const struct motion_extreme *one)
{
    if (one->min < all->min) {
        all->min = one->min;
        all->min_ns_q12 = one->min_ns_q12;
    }
    if (one->max > all->max) {
        all->max = one->max;
        all->max_ns_q12 = one->max_ns_q12;
    }
}
/* How far the rounding of its coefficients may have moved v, a or j of a
 * segment from the polynomial that was meant, in units of their format, up
 * (plan/check.c derives it).  Saturates. */
int64_t motion_segment_rounding(const struct motion_segment *segment,
                                enum motion_quantity quantity);
/* Largest |v|, |a| or |j| without what rounding may have added, down: what is
 * planned at a limit is not above it.  The difference saturates, not its two
 * sides, which in a segment of nanoseconds may both be beyond the format. */
int64_t motion_segment_peak(const struct motion_segment *segment,
                            enum motion_quantity quantity);
/* Find the extremes of the whole track: of a window from its outline, else from the
 * summary where there is one; the first of equal extremes.  An empty track gives its position and
 * zeros. */
void motion_track_extreme(const struct motion_track *track,
                          enum motion_quantity quantity,
                          struct motion_extreme *extreme);
/* The largest motion_segment_peak of a or j, of a window over its segments. */
int64_t motion_track_peak(const struct motion_track *track,
                          enum motion_quantity quantity);
/* The lowest position of the segments that move down somewhere, faster than what
 * rounding leaves of rest (INT64_MAX: none does), and the highest of those that
 * move up (INT64_MIN).  Of a window those of its outline, as if it were one
 * segment. */
void motion_track_reach(const struct motion_track *track, int64_t *down_to_q32,
                        int64_t *up_to_q32);
/* Rounding leaves an end of a ramp at less than 2^-20 unit/s. */
#define MOTION_TRACK_STANDS_Q32 ((int64_t)1 << 12)

/* What is known of a whole track beside the segments in the window. */
struct motion_track_outline {
    struct motion_extreme extreme[MOTION_JERK + 1]; /* by motion_quantity */
    uint32_t count;
};

/* The answers of the three functions above for a whole track, found by a look at every
 * segment.  With it they take the same time for a track of any length, so that one
 * can be started on a tick. */
struct motion_track_summary {
    struct motion_extreme extreme[MOTION_JERK + 1]; /* by motion_quantity */
    int64_t acc_peak_q32, jerk_peak_q32;            /* motion_track_peak */
    int64_t down_to_q32, up_to_q32;                 /* motion_track_reach */
    /* The segments that it is of; it does not count for any others. */
    const struct motion_segment *segment;
    uint32_t count; /* 0: it is of none */
};
/* Make the summary of a whole track, and have the track point at it, which it must
 * outlive.  It counts while the track has these segments, as many: an append takes it
 * away, and so does whoever changes segments in place.  Should it be wrong all the
 * same, a move may be let begin that its axis cannot follow, and the gate of the
 * controller, which asks no track, stops it at the first set point beyond a limit.
 * Plan-time. */
void motion_track_summarise(struct motion_track *track,
                            struct motion_track_summary *summary);

/* How far from t the segments at hand reach; 0 or less: they do not hold t.
 * INT64_MAX where there is nothing that they lack: of a whole
 * track, before 0, from the window on that holds the end.  On the tick. */
int64_t motion_track_ahead(const struct motion_track *track, int64_t t_ns_q12);

/* Largest step of v and of a at the inner borders of the track, and the steps
 * from and to rest at its ends, with the time; p is continuous by construction
 * and this proves it (pos_step must be 0). */
struct motion_continuity {
    uint64_t pos_step_q32, vel_step_q32, acc_step_q32;
    int64_t vel_step_ns_q12, acc_step_ns_q12;
};
void motion_track_continuity(const struct motion_track *track,
                             struct motion_continuity *worst);

MOTION_C_END

#endif
