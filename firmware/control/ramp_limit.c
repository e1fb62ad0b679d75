/* firmware/control/ramp_limit.c - see ramp_limit.h. */
#include "firmware/control/ramp_limit.h"

#include "firmware/control/ramp.h"

/* What these are rounded by. */
#define LIMIT_ROUNDING 8

static inline int32_t limit_smaller(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static inline int32_t limit_greater(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

/* a b / 2^32, rounded down: one instruction of a Cortex-M4. */
static inline int32_t limit_mul(int32_t a, int32_t b)
{
    return (int32_t)((int64_t)a * b >> 32);
}

/* Rounded up: what adds to a track at its limit is not rounded away. */
static inline int32_t limit_mul_up(int32_t a, int32_t b)
{
    return -limit_mul(-a, b);
}

/* By a power of the rate, which is >= 0. */
static inline struct motion_range limit_own(struct motion_range g,
                                            const struct controller_part *part)
{
    return (struct motion_range){
        limit_mul(g.low, g.low < 0 ? part->high : part->low),
        limit_mul(g.high, g.high < 0 ? part->low : part->high),
    };
}

static inline struct motion_range
limit_times(struct motion_range g, const struct controller_part *part)
{
    if (part->low >= 0)
        return (struct motion_range){
            limit_mul(g.low, g.low < 0 ? part->high : part->low),
            limit_mul_up(g.high, g.high < 0 ? part->low : part->high),
        };
    if (part->high <= 0)
        return (struct motion_range){
            limit_mul(g.high, g.high > 0 ? part->low : part->high),
            limit_mul_up(g.low, g.low > 0 ? part->high : part->low),
        };
    return (struct motion_range){
        limit_smaller(limit_mul(g.low, part->high),
                      limit_mul(g.high, part->low)),
        limit_greater(limit_mul_up(g.low, part->low),
                      limit_mul_up(g.high, part->high)),
    };
}

/* Q31 by anything. */
static inline struct motion_range limit_share(int32_t share,
                                              struct motion_range value)
{
    return (struct motion_range){ limit_mul(share, value.low) * 2,
                                  limit_mul(share, value.high) * 2 +
                                      (value.high > 0) };
}

/* Of how much more of `part` there is left beside `rest`. */
static inline void limit_factor(int32_t *factor_q10, int32_t rest, int32_t part,
                                int32_t limit)
{
    const int32_t left = limit - rest;
    if ((int64_t)part * *factor_q10 > (int64_t)left * 1024)
        *factor_q10 = left <= 0 ? 0
                                : (int32_t)(((uint32_t)left << 6) /
                                            (((uint32_t)part >> 4) + 1));
}

/* Are both ends of what the track takes itself and of what adds to it within the
 * limit?  All is rounded down, by LIMIT_ROUNDING at most; itself the track never is
 * over the limit, so a side counts to which something is added. */
static inline bool limit_keeps(struct motion_range own,
                               struct motion_range adds, int32_t limit)
{
    return (adds.high <= 0 || own.high + adds.high <= limit - LIMIT_ROUNDING) &&
           (adds.low >= 0 || own.low + adds.low >= -limit);
}

static inline void limit_learn(struct motion_range rest,
                               struct motion_range part, int32_t limit,
                               int32_t *factor_q10)
{
    if (part.high > -part.low)
        limit_factor(factor_q10, rest.high, part.high, limit - LIMIT_ROUNDING);
    else
        limit_factor(factor_q10, -rest.low, -part.low, limit - LIMIT_ROUNDING);
}

static inline struct motion_range limit_sum(struct motion_range a,
                                            struct motion_range b)
{
    return (struct motion_range){ a.low + b.low, a.high + b.high };
}

/* f' r'' */
static inline struct motion_range
limit_by_jerk(const struct controller_share *share, struct motion_range g,
              int32_t jerk)
{
    const struct motion_range part = {
        limit_mul(jerk < 0 ? g.high : g.low, jerk),
        limit_mul_up(jerk < 0 ? g.low : g.high, jerk),
    };
    return limit_share(share->vel_share_q31, part);
}

static void limit_fall(const struct controller_share *share,
                       const struct controller_span *span, unsigned which,
                       struct motion_range vel, struct motion_range own,
                       struct motion_range cross,
                       struct controller_verdict *verdict)
{
    const int32_t limit =
        (which == 1 ? share->stop_jerk : RAMP_LIMIT_ONE) >> span->shift;
    const struct motion_range fall =
        limit_by_jerk(share, vel, span->fall[which]);
    if (limit == 0)
        return; /* not limited */
    if (!limit_keeps(own, limit_sum(cross, fall), limit))
        verdict->fall = false;
    limit_learn(limit_sum(own, cross), fall, limit, &verdict->fall_q10[which]);
}

/* Of a rise alone: out of the way of what is judged when it is urgent. */
__attribute__((noinline)) static void
limit_falls(const struct controller_share *share,
            const struct controller_span *span, struct motion_range vel,
            struct motion_range own, struct motion_range cross,
            struct controller_verdict *verdict)
{
    limit_fall(share, span, 0, vel, own, cross, verdict);
    if (span->fall[1] != 0)
        limit_fall(share, span, 1, vel, own, cross, verdict);
}

void controller_limit_judge(const struct controller_share *share,
                            const struct controller_span *span,
                            const struct motion_range g[3],
                            struct controller_verdict *verdict)
{
    const int shift = span->shift;
    const bool stop = span->stop;
    struct motion_range rest = limit_own(g[1], &span->r2);
    if (shift > 0)
        rest = (struct motion_range){ rest.low >> shift,
                                      (rest.high >> shift) + 1 };
    struct motion_range part =
        limit_share(share->vel_q31, limit_times(g[0], &span->accel));
    int32_t limit = (stop ? share->stop_acc : RAMP_LIMIT_ONE) >> shift;
    const bool keeps = limit_keeps(rest, part, limit);
    if (!keeps)
        verdict->acc = false;
    if (!keeps || span->is_first)
        limit_learn(rest, part, limit, &verdict->acc_q10);
    if (share->share_q31 == 0 || (stop && share->stop_jerk == 0))
        return; /* not limited */
    rest = limit_own(g[2], &span->r3);
    if (shift > 0)
        rest = (struct motion_range){ rest.low >> shift,
                                      (rest.high >> shift) + 1 };
    const struct motion_range cross =
        limit_share(share->share_q31, limit_times(g[1], &span->cross));
    part = limit_by_jerk(share, g[0], span->jerk);
    limit = (stop ? share->stop_jerk : RAMP_LIMIT_ONE) >> shift;
    const bool keeps_jerk = limit_keeps(rest, limit_sum(cross, part), limit);
    if (span->fall[0] != 0)
        limit_falls(share, span, g[0], rest, cross, verdict);
    rest = limit_sum(rest, cross);
    if (!keeps_jerk) {
        verdict->jerk = false;
        /* over it on the side to which r'' does not lead */
        verdict->more =
            (rest.high + part.high > limit) != (part.high > -part.low);
    }
    limit_learn(rest, part, limit, &verdict->jerk_q10);
}
