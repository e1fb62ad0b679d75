/* motion/plan/keys/stand.c - see stand.h. */
#include "motion/plan/keys/stand.h"

#include "motion/core/fixed.h"
#include "motion/number/real.h"
#include "motion/plan/check.h"
#include "motion/plan/keys/move_internal.h"

#define STAND_FOUND 64 /* at a time */

/* All violations of position, and of nothing else. */
static uint32_t stand_find(const struct motion_track *track,
                           const struct plan_limit *limit,
                           struct plan_violation found[STAND_FOUND])
{
    const struct plan_limit range = { .pos_min_q32 = limit->pos_min_q32,
                                      .pos_max_q32 = limit->pos_max_q32,
                                      .vel_q32 = INT64_MAX,
                                      .acc_q32 = INT64_MAX };
    const uint32_t count = plan_check_track(track, &range, found, STAND_FOUND);

    return count < STAND_FOUND ? count : STAND_FOUND;
}

/* The curve on either side takes a velocity where one is given. */
static bool stand_may(const struct plan_axis *axis, uint32_t i)
{
    const uint32_t last = axis->key_count - 1;
    const enum plan_curve after = move_curve_at(axis, i < last ? i : i - 1);
    const enum plan_curve before = i > 0 ? move_curve_at(axis, i - 1) : after;

    return !axis->key[i].key.has_vel && i > 0 && i < last &&
           plan_curve_rules(before)->vel == PLAN_MAY &&
           plan_curve_rules(after)->vel == PLAN_MAY;
}

/* It is inside, and no key beside it is nearer to that end. */
static bool stand_turns(const struct plan_axis *axis,
                        const struct plan_limit *limit, uint32_t i, bool low)
{
    const int64_t pos = axis->key[i].key.pos_q32;
    const int64_t left = axis->key[i - 1].key.pos_q32;
    const int64_t right = axis->key[i + 1].key.pos_q32;

    return low ? pos >= limit->pos_min_q32 && pos <= left && pos <= right
               : pos <= limit->pos_max_q32 && pos >= left && pos >= right;
}

/* The keys around a place that turn there stand.  How many do so from now on. */
static uint32_t stand_still(struct plan_axis *axis,
                            const struct plan_limit *limit, uint32_t span,
                            bool low)
{
    uint32_t changed = 0;

    for (uint32_t k = span; k <= span + 1; k++) {
        if (!stand_may(axis, k) || !stand_turns(axis, limit, k, low))
            continue;
        axis->key[k].key.has_vel = true;
        axis->key[k].key.vel = motion_real_zero();
        changed++;
    }
    return changed;
}

/* Where they stand already: the other one is too fast for its distance.  From rest,
 * a curve of degree 3 or 5 gets on without going back first at twice the mean speed:
 * 2 u^3 - u^4, u^2. */
static uint32_t stand_slower(struct plan_axis *axis, uint32_t span, bool low)
{
    const struct motion_key *from = &axis->key[span].key;
    const struct motion_key *to = &axis->key[span + 1].key;
    const uint32_t k = (to->pos_q32 > from->pos_q32) == low ? span + 1 : span;
    int64_t way_q32;

    if (!stand_may(axis, k) ||
        motion_fixed_sub(to->pos_q32, from->pos_q32, &way_q32) < 0)
        return 0;
    axis->key[k].key.has_vel = true;
    axis->key[k].key.vel = motion_real_from_q(
        motion_fixed_muldiv_sat(way_q32, 2 * MOTION_FIXED_S_Q12,
                                to->t_ns_q12 - from->t_ns_q12),
        32);
    return 1;
}

/* Last, what the keys beside them make of their accelerations is 0. */
static uint32_t stand_even(struct plan_axis *axis, uint32_t span)
{
    uint32_t changed = 0;

    for (uint32_t k = span; k <= span + 1; k++) {
        struct motion_key *key = &axis->key[k].key;
        const bool is_end = k == 0 || k + 1 == axis->key_count;
        if (is_end || key->has_acc || !key->has_vel ||
            plan_curve_rules(move_curve_at(axis, k - 1))->acc != PLAN_MAY ||
            plan_curve_rules(move_curve_at(axis, k))->acc != PLAN_MAY)
            continue;
        key->has_acc = true;
        key->acc = motion_real_zero();
        changed++;
    }
    return changed;
}

uint32_t plan_stand(struct plan_axis *axis, const struct motion_track *track,
                    const struct plan_limit *limit)
{
    struct plan_violation found[STAND_FOUND];
    const uint32_t count = stand_find(track, limit, found);
    uint32_t changed = 0, span = 0;

    for (uint32_t n = 0; n < count && axis->key_count > 2; n++) {
        while (span + 2 < axis->key_count &&
               axis->key[span + 1].key.t_ns_q12 < found[n].t_ns_q12)
            span++;
        const bool low = found[n].kind == PLAN_POS_LOW;
        uint32_t now = stand_still(axis, limit, span, low);
        if (now == 0)
            now = stand_slower(axis, span, low);
        if (now == 0)
            now = stand_even(axis, span);
        changed += now;
    }
    return changed;
}

bool plan_stand_leaves(const struct motion_track *track,
                       const struct plan_limit *limit, int64_t *at_ns_q12)
{
    struct plan_violation found[STAND_FOUND];

    if (stand_find(track, limit, found) == 0)
        return false;
    *at_ns_q12 = found[0].t_ns_q12;
    return true;
}
