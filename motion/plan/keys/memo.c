/* motion/plan/keys/memo.c - spans that were planned before; see plan_memo.h. */
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/plan/keys/move_internal.h"

static bool memo_is_point(struct motion_fcurve_point a,
                          struct motion_fcurve_point b)
{
    return a.t_ns_q12 == b.t_ns_q12 && a.pos_q32 == b.pos_q32;
}

static bool memo_is_key(const struct motion_fcurve_key *a,
                        const struct motion_fcurve_key *b)
{
    return memo_is_point(a->at, b->at) && memo_is_point(a->left, b->left) &&
           memo_is_point(a->right, b->right) &&
           a->interpolation == b->interpolation && a->easing == b->easing &&
           a->back_q32 == b->back_q32 && a->amplitude_q32 == b->amplitude_q32 &&
           a->period_ns_q12 == b->period_ns_q12;
}

static bool memo_is_real(struct motion_real a, struct motion_real b)
{
    return motion_real_cmp(a, b) == 0;
}

static bool memo_is_range(const struct motion_fcurve_range *a,
                          const struct motion_fcurve_range *b)
{
    return a->from_ns_q12 == b->from_ns_q12 && a->to_ns_q12 == b->to_ns_q12 &&
           memo_is_real(a->within.pos, b->within.pos) &&
           memo_is_real(a->within.vel, b->within.vel) &&
           memo_is_real(a->within.acc, b->within.acc) &&
           memo_is_real(a->step, b->step);
}

static bool memo_is_state(const struct motion_state *a,
                          const struct motion_state *b)
{
    return a->pos_q32 == b->pos_q32 && a->vel_q32 == b->vel_q32 &&
           a->acc_q32 == b->acc_q32 && a->jerk_q32 == b->jerk_q32;
}

static bool memo_is_same(const struct plan_memo_span *a,
                         const struct plan_memo_span *b)
{
    for (unsigned i = 0; i < PLAN_MEMO_KEYS; i++)
        if (!memo_is_key(&a->key[i], &b->key[i]))
            return false;
    return memo_is_range(&a->range, &b->range) &&
           memo_is_state(&a->start, &b->start) &&
           a->start_frac == b->start_frac;
}

/* Spans are in the order of their times. */
static const struct plan_memo_span *
memo_find(const struct plan_memo_axis *former,
          const struct plan_memo_span *wanted)
{
    uint32_t low = 0, high = former == NULL ? 0 : former->spans;

    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (former->span[middle].range.from_ns_q12 < wanted->range.from_ns_q12)
            low = middle + 1;
        else
            high = middle;
    }
    return former != NULL && low < former->spans &&
                   memo_is_same(&former->span[low], wanted)
               ? &former->span[low]
               : NULL;
}

void move_memo_want(const struct move *move, uint32_t key,
                    const struct motion_fcurve_range *range,
                    struct plan_memo_span *span)
{
    const struct motion_fcurve *curve = &move->handles;

    memset(span, 0, sizeof *span);
    for (uint32_t i = 0; i < PLAN_MEMO_KEYS; i++)
        if (key + i >= 1 && key + i - 1 < curve->count)
            span->key[i] = curve->key[key + i - 1];
    span->range = *range;
    span->start = move->track->end;
    span->start_frac = move->track->end_frac;
    span->first = move->track->count;
}

bool move_memo_recall(const struct move *move, struct plan_memo_span *span)
{
    const struct plan_memo_span *was = memo_find(move->former, span);
    struct motion_track *track = move->track;

    if (was == NULL || move_grow(move, was->count) != MOTION_OK)
        return false;
    memcpy(track->segment + track->count, move->former->segment + was->first,
           was->count * sizeof *track->segment);
    track->count += was->count;
    track->end_ns_q12 = was->end_ns_q12;
    track->end = was->end;
    track->end_frac = was->end_frac;
    if (move->reused != NULL)
        (*move->reused)++;
    return true;
}

int move_memo_keep(const struct move *move, struct plan_memo_span *span)
{
    const struct motion_track *track = move->track;
    struct plan_memo_axis *memo = move->memo;

    if (memo == NULL)
        return MOTION_OK;
    if (memo->spans == memo->capacity) {
        const uint32_t capacity = memo->capacity > 0 ? 2 * memo->capacity : 64;
        struct plan_memo_span *more =
            realloc(memo->span, capacity * sizeof *memo->span);
        if (more == NULL)
            return move_fail_axis(move, MOTION_E_FULL,
                                  "no memory for its spans");
        memo->span = more;
        memo->capacity = capacity;
    }
    span->count = track->count - span->first;
    span->end = track->end;
    span->end_frac = track->end_frac;
    span->end_ns_q12 = track->end_ns_q12;
    memo->span[memo->spans++] = *span;
    return MOTION_OK;
}

int move_memo_close(const struct move *move)
{
    const struct motion_track *track = move->track;
    struct plan_memo_axis *memo = move->memo;

    if (memo == NULL || memo->spans == 0)
        return MOTION_OK;
    memo->segment = malloc(track->count * sizeof *memo->segment);
    if (memo->segment == NULL)
        return move_fail_axis(move, MOTION_E_FULL, "no memory for its spans");
    memcpy(memo->segment, track->segment, track->count * sizeof *memo->segment);
    return MOTION_OK;
}

void plan_memo_free(struct plan_memo *memo)
{
    for (unsigned i = 0; i < PLAN_AXES_MAX; i++) {
        free(memo->axis[i].span);
        free(memo->axis[i].segment);
    }
    memset(memo, 0, sizeof *memo);
}
