/* motion/plan/plan_memo.h - what was planned of the keys of a move, so that the
 * next plan of it takes over what is the same.
 *
 * A span is taken over where everything that its segments are made of is the
 * same: both keys with their handles and the keys beside these, the tolerance,
 * and where the track ends before it.  So a key that moves costs the spans that
 * depend on it, and the whole is what planning afresh gives, to the bit.  Spans
 * of bezier curves are remembered; others take less time than looking them up. */
#ifndef MOTION_PLAN_PLAN_MEMO_H
#define MOTION_PLAN_PLAN_MEMO_H

#include "motion/plan/move.h"

#define PLAN_MEMO_KEYS 4 /* the one before the span, its two, the one after */

struct plan_memo_span {
    struct motion_fcurve_key key[PLAN_MEMO_KEYS]; /* zero where there is none */
    struct motion_fcurve_range range;
    struct motion_state start, end; /* of the track, before and after it */
    uint64_t start_frac, end_frac;
    int64_t end_ns_q12;
    uint32_t first, count; /* segments */
};

struct plan_memo_axis {
    char name[PLAN_NAME_MAX];
    struct plan_memo_span *span; /* on the heap, and so are the segments */
    uint32_t spans, capacity;
    struct motion_segment *segment;
};

/* Zeroed, it remembers nothing. */
struct plan_memo {
    struct plan_memo_axis axis[PLAN_AXES_MAX]; /* as in the move */
    uint32_t planned, reused;                  /* spans */
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
