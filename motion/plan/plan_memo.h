/* motion/plan/plan_memo.h - what was planned of the keys of a move, so that the
 * next plan of it takes over what is the same.
 *
 * A span is taken over where everything that its segments are made of is the
 * same: its two keys with what was filled in or their handles, parameters, and
 * where the track ends before it.  So a key that moves costs the spans that depend
 * on it, and the whole is what planning afresh gives, to the bit.  What every key
 * has a part in (lagrange), or keys further away than those of the span
 * (rounded, smoothed, kochanek-bartels, b-spline), is taken over run by run.  The
 * velocities of c2 and c4 depend on all keys, by less than their last bit some
 * fifty keys away. */
#ifndef MOTION_PLAN_PLAN_MEMO_H
#define MOTION_PLAN_PLAN_MEMO_H

#include "motion/plan/move.h"

/* A span, or a run of them. */
struct plan_memo_span {
    uint32_t word, words; /* that it is made of */
    uint32_t spans;
    uint32_t first, count; /* segments */
    int64_t from_ns_q12;   /* of the track, before it; and after it: */
    int64_t end_ns_q12;
    struct motion_state end;
    uint64_t end_frac;
};

struct plan_memo_axis {
    char name[PLAN_NAME_MAX];
    struct plan_memo_span *span; /* on the heap, and so are the segments */
    uint32_t spans, capacity;
    int64_t *word; /* of all spans */
    uint32_t words, word_capacity;
    bool is_full; /* there was no memory for words */
    struct motion_segment *segment;
};

/* Zeroed, it remembers nothing. */
struct plan_memo {
    struct plan_memo_axis *axis; /* as in the move; on the heap */
    uint32_t axes;
    uint32_t planned, reused; /* spans */
};

void plan_memo_free(struct plan_memo *memo);

/* As plan_axis_track, with what a former plan of an axis of this name left
 * (NULL: nothing), and what this one leaves as axis `index` of `memo` (NULL:
 * nothing). */
int plan_axis_track_again(const struct plan_axis *axis,
                          const struct plan_memo *former,
                          struct plan_memo *memo, uint32_t index,
                          struct motion_track *track, struct plan_error *error);

#endif
