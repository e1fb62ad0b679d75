/* motion/plan/keys/memo.c - spans that were planned before; see plan_memo.h. */
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/plan/keys/move_internal.h"

void move_memo_add(const struct move *move, int64_t word)
{
    struct plan_memo_axis *memo = move->memo;

    if (memo->words == memo->word_capacity) {
        const uint32_t capacity =
            memo->word_capacity > 0 ? 2 * memo->word_capacity : 1024;
        int64_t *more = realloc(memo->word, capacity * sizeof *memo->word);
        if (more == NULL) {
            memo->is_full = true;
            return;
        }
        memo->word = more;
        memo->word_capacity = capacity;
    }
    memo->word[memo->words++] = word;
}

void move_memo_add_real(const struct move *move, struct motion_real value)
{
    move_memo_add(move, value.m);
    move_memo_add(move, value.e);
}

void move_memo_begin(const struct move *move, int64_t kind, uint32_t spans,
                     struct plan_memo_span *span)
{
    const struct motion_track *track = move->track;

    *span = (struct plan_memo_span){ .word = move->memo->words,
                                     .spans = spans,
                                     .first = track->count,
                                     .from_ns_q12 = track->end_ns_q12 };
    move_memo_add(move, kind);
    move_memo_add(move, track->end.pos_q32);
    move_memo_add(move, (int64_t)track->end_frac);
    if (kind == PLAN_CURVE_BEZIER) /* begins as its handles say */
        return;
    move_memo_add(move, track->end.vel_q32);
    move_memo_add(move, track->end.acc_q32);
    move_memo_add(move, track->end.jerk_q32);
}

/* Spans are in the order of their times, which are all different. */
static const struct plan_memo_span *
memo_find(const struct plan_memo_axis *former,
          const struct plan_memo_axis *memo,
          const struct plan_memo_span *wanted)
{
    uint32_t low = 0, high = former == NULL ? 0 : former->spans;

    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (former->span[middle].from_ns_q12 < wanted->from_ns_q12)
            low = middle + 1;
        else
            high = middle;
    }
    if (former == NULL || low == former->spans || memo->is_full)
        return NULL;
    const struct plan_memo_span *was = &former->span[low];
    return was->from_ns_q12 == wanted->from_ns_q12 &&
                   was->words == wanted->words &&
                   memcmp(former->word + was->word, memo->word + wanted->word,
                          wanted->words * sizeof *memo->word) == 0
               ? was
               : NULL;
}

bool move_memo_recall(const struct move *move, struct plan_memo_span *span)
{
    struct motion_track *track = move->track;

    span->words = move->memo->words - span->word;
    *move->planned += span->spans;
    const struct plan_memo_span *was =
        memo_find(move->former, move->memo, span);

    if (was == NULL || move_grow(move, was->count) != MOTION_OK)
        return false;
    memcpy(track->segment + track->count, move->former->segment + was->first,
           was->count * sizeof *track->segment);
    track->count += was->count;
    track->end_ns_q12 = was->end_ns_q12;
    track->end = was->end;
    track->end_frac = was->end_frac;
    *move->reused += span->spans;
    return true;
}

int move_memo_keep(const struct move *move, struct plan_memo_span *span)
{
    const struct motion_track *track = move->track;
    struct plan_memo_axis *memo = move->memo;

    if (memo->is_full)
        return move_fail_axis(move, MOTION_E_FULL, "no memory for its spans");
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
    for (uint32_t i = 0; i < memo->axes; i++) {
        free(memo->axis[i].span);
        free(memo->axis[i].word);
        free(memo->axis[i].segment);
    }
    free(memo->axis);
    memset(memo, 0, sizeof *memo);
}
