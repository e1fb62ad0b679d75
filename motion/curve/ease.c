/* motion/curve/ease.c - phase times of laws and of the limited ease; see
 * ease.h. */
#include "motion/curve/ease.h"

#include "motion/core/err.h"
#include "motion/curve/ease_internal.h"

#define EASE_SLACK_MAX ((int64_t)1 << 40) /* 0.27 s */

/* Shorter phases are rounding: 8 ps. */
#define EASE_PHASE_MIN 32

static struct ease_ramp ease_law_ramp(enum motion_ease_law law, int64_t dur)
{
    if (law == MOTION_EASE_SCURVE)
        return (struct ease_ramp){ .up = dur / 2, .down = dur - dur / 2 };
    return (struct ease_ramp){ .hold = dur, .sine = law == MOTION_EASE_SINE };
}

int motion_ease_append_phases(struct motion_track *track,
                              enum motion_ease_law law, int64_t to_q32,
                              int64_t in_ns_q12, int64_t middle_ns_q12,
                              int64_t out_ns_q12)
{
    const int64_t most = MOTION_TRACK_SEGMENT_MAX_NS_Q12;
    struct ease_ramp in, out;
    struct ease_displacement displacement;

    if ((unsigned)law > MOTION_EASE_SCURVE || in_ns_q12 < 0 ||
        middle_ns_q12 < 0 || out_ns_q12 < 0 || in_ns_q12 > most ||
        middle_ns_q12 > most || out_ns_q12 > most)
        return MOTION_E_ARG;

    const int64_t dur = in_ns_q12 + middle_ns_q12 + out_ns_q12; /* < 2^62 */
    if (dur == 0 || dur > most)
        return MOTION_E_ARG;
    ease_displacement_init(&displacement, track, to_q32);
    if (motion_real_is_zero(displacement.length))
        return motion_track_append_dwell(track, dur);
    in = ease_law_ramp(law, in_ns_q12);
    out = ease_law_ramp(law, out_ns_q12);
    return ease_append(track, &displacement, &in, middle_ns_q12, &out);
}

int motion_ease_append(struct motion_track *track, enum motion_ease_law law,
                       int64_t to_q32, int64_t dur_ns_q12, int64_t k1_q32,
                       int64_t k2_q32)
{
    int64_t k1, k2;

    if (k1_q32 < 0 || k2_q32 < k1_q32 || k2_q32 > MOTION_FIXED_ONE_Q32 ||
        dur_ns_q12 <= 0 || dur_ns_q12 > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_ARG;
    (void)motion_fixed_mulshift(dur_ns_q12, k1_q32, 32, &k1);
    (void)motion_fixed_mulshift(dur_ns_q12, k2_q32, 32, &k2);
    return motion_ease_append_phases(track, law, to_q32, k1, k2 - k1,
                                     dur_ns_q12 - k2);
}

/* The limited ease.
 *
 *   acc  |   ___                    ramp: jerk time, hold time, jerk time
 *        |  /   \                   with v = a (jerk + hold), a = j jerk
 *        | /     \_______           cruise at v
 *        |               \     /    and the mirror image
 *        |                \___/     length = v (2 jerk + hold + cruise)
 *
 * Which limits are reached follows from their order:
 *   v j >= a^2    acceleration is reached before speed:  jerk = a/j,
 *                 hold = v/a - jerk; else jerk = sqrt(v/j), hold = 0
 *   length >= v (2 jerk + hold)      speed is reached: cruise = length/v - ...
 *   length >= 2 a^3/j^2              only acceleration is: jerk = a/j and
 *                 length = a (jerk + hold)(2 jerk + hold), so
 *                 hold = (sqrt(jerk^2 + 4 length/a) - 3 jerk) / 2
 *   else          only jerk is: length = 2 j jerk^3
 * (Biagiotti & Melchiorri 3.4.)  Without a jerk limit jerk = 0 and the hold is
 * v/a or sqrt(length/a).  Longer phases mean less of v, a and j, each of them,
 * so phase times rounded up never break a limit. */
struct ease_times {
    struct motion_real jerk, hold, cruise;
};

/* The limits in 2^-32 unit and 2^-12 ns. */
struct ease_limits {
    struct motion_real vel, acc, jerk;
};

static struct ease_limits ease_limits(const struct motion_ease_limit *limit)
{
    const struct motion_real second = ease_whole(MOTION_FIXED_S_Q12);
    const struct motion_real second2 = motion_real_mul(second, second);
    const struct motion_real second3 = motion_real_mul(second2, second);

    return (struct ease_limits){
        motion_real_div(ease_whole(limit->vel_q32), second),
        motion_real_div(ease_whole(limit->acc_q32), second2),
        motion_real_div(ease_whole(limit->jerk_q32), second3),
    };
}

/* A phase that is, but for rounding, not there.  Leaving it out puts the speed
 * or the acceleration over its limit by as little; see
 * motion_ease_append_limited for what becomes of that. */
static bool ease_is_short(struct motion_real time)
{
    return motion_real_cmp(time, ease_whole(EASE_PHASE_MIN)) < 0;
}

/* a - b, or no time where that is below zero. */
static struct motion_real ease_left(struct motion_real a, struct motion_real b)
{
    return motion_real_max(motion_real_sub(a, b), motion_real_zero());
}

/* Up to the speed limit and back; `cruise` is left to the caller. */
static struct ease_times ease_solve_long(const struct ease_limits *limit)
{
    const struct motion_real to_speed = motion_real_div(limit->vel, limit->acc);
    struct ease_times times = { .hold = to_speed,
                                .jerk = motion_real_zero(),
                                .cruise = motion_real_zero() };

    if (motion_real_is_zero(limit->jerk))
        return times;
    times.jerk = motion_real_div(limit->acc, limit->jerk);
    if (motion_real_cmp(to_speed, times.jerk) < 0)
        times.jerk = motion_real_sqrt(motion_real_div(limit->vel, limit->jerk));
    times.hold = ease_left(to_speed, times.jerk);
    return times;
}

/* There and back to rest before the speed limit. */
static struct ease_times ease_solve_short(struct motion_real length,
                                          const struct ease_limits *limit)
{
    const struct motion_real length_acc = motion_real_div(length, limit->acc);
    struct ease_times times = { motion_real_zero(), motion_real_zero(),
                                motion_real_zero() };
    struct motion_real cube, root;

    if (!motion_real_is_zero(limit->jerk)) {
        cube = ease_half(motion_real_div(length, limit->jerk));
        times.jerk = motion_real_div(limit->acc, limit->jerk);
        if (motion_real_cmp(motion_real_cbrt(cube), times.jerk) <= 0) {
            times.jerk = motion_real_cbrt(cube);
            return times;
        }
    }
    root = motion_real_sqrt(
        motion_real_add(motion_real_mul(times.jerk, times.jerk),
                        motion_real_mul(length_acc, ease_whole(4))));
    times.hold =
        ease_half(ease_left(root, motion_real_mul(times.jerk, ease_whole(3))));
    return times;
}

static struct ease_times ease_solve(struct motion_real length,
                                    const struct ease_limits *limit)
{
    const struct motion_real whole = motion_real_div(length, limit->vel);
    struct ease_times times = ease_solve_long(limit);
    const struct motion_real ramp =
        motion_real_add(motion_real_add(times.jerk, times.jerk), times.hold);

    times.cruise = ease_left(whole, ramp);
    if (ease_is_short(times.cruise))
        return ease_solve_short(length, limit);
    return times;
}

/* `slack` more than rounded up. */
static int ease_phase(struct motion_real time, int64_t slack, int64_t *dur)
{
    *dur = 0;
    if (motion_real_is_zero(time))
        return MOTION_OK;
    if (motion_real_ceil(time, 0, dur) ||
        *dur > MOTION_TRACK_SEGMENT_MAX_NS_Q12 - slack)
        return MOTION_E_RANGE;
    *dur += slack;
    return MOTION_OK;
}

/* Speed to the unit; of what follows from it as far as coefficients tell. */
static bool ease_over(const struct motion_segment *segment,
                      enum motion_quantity quantity, int64_t limit)
{
    struct motion_extreme extreme;

    if (quantity != MOTION_VEL)
        return motion_segment_peak(segment, quantity) > limit;
    motion_segment_extreme(segment, quantity, &extreme);
    return extreme.max > limit || extreme.min < -limit;
}

/* MOTION_E_LIMIT when a segment from `first` on is over a limit. */
static int ease_judge(const struct motion_track *track, uint32_t first,
                      const struct motion_ease_limit *limit)
{
    for (uint32_t i = first; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        if (ease_over(segment, MOTION_VEL, limit->vel_q32) ||
            ease_over(segment, MOTION_ACC, limit->acc_q32) ||
            (limit->jerk_q32 &&
             ease_over(segment, MOTION_JERK, limit->jerk_q32)))
            return MOTION_E_LIMIT;
    }
    return MOTION_OK;
}

static int ease_try(struct motion_track *track,
                    const struct ease_displacement *displacement,
                    const struct ease_times *times, int64_t slack,
                    const struct motion_ease_limit *limit)
{
    const struct motion_track before = *track;
    struct ease_ramp ramp = { .sine = false };
    int64_t middle;
    int rc;

    if (ease_phase(times->jerk, slack, &ramp.up) ||
        ease_phase(times->hold, slack, &ramp.hold) ||
        ease_phase(times->cruise, slack, &middle))
        return MOTION_E_RANGE;
    if (4 * ramp.up + 2 * ramp.hold + middle > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_RANGE;
    ramp.down = ramp.up;
    rc = ease_append(track, displacement, &ramp, middle, &ramp);
    if (rc == MOTION_OK)
        rc = ease_judge(track, before.count, limit);
    if (rc != MOTION_OK)
        *track = before;
    return rc;
}

/* Coefficients are multiples of 2^-63 unit at the finest, so in a phase of T
 * the jerk is a multiple of 6 * 2^-63 / T^3: in a very short one that is coarse
 * and rounding may end above the limit.  Judge, and take a little longer, twice
 * as much each time; from microseconds up the first try fits. */
int motion_ease_append_limited(struct motion_track *track, int64_t to_q32,
                               const struct motion_ease_limit *limit)
{
    struct ease_limits limits;
    struct ease_times times;
    struct ease_displacement displacement;
    int rc = MOTION_E_LIMIT;

    if (limit->vel_q32 <= 0 || limit->acc_q32 <= 0 || limit->jerk_q32 < 0)
        return MOTION_E_ARG;
    ease_displacement_init(&displacement, track, to_q32);
    if (motion_real_is_zero(displacement.length))
        return MOTION_OK;
    limits = ease_limits(limit);
    times = ease_solve(displacement.length, &limits);
    if (limit->jerk_q32 && ease_is_short(times.hold))
        times.hold = ease_whole(0);
    rc = ease_try(track, &displacement, &times, 0, limit);
    for (int64_t slack = 1; rc == MOTION_E_LIMIT && slack <= EASE_SLACK_MAX;
         slack *= 2)
        rc = ease_try(track, &displacement, &times, slack, limit);
    return rc;
}
