/* firmware/control/follow.h - another clock, seen by its marks, and the rate at
 * which a move is played so that it keeps to it.
 *
 * A mark says that their clock was at s when ours was at t: a frame pulse, a
 * frame of timecode.  Marks come late by turns, so they are filtered: an
 * alpha-beta filter whose gains fall with the number of marks (least squares
 * over all of them) to those of FOLLOW_MEMORY marks.  Source: Bar-Shalom, Li and
 * Kirubarajan, Estimation with Applications to Tracking and Navigation (2001),
 * 6.5.
 *
 *   WAITING --marks for half a second--> LOCKED <--marks-- LOST
 *      ^                                   |  '--none for lost_ns--^
 *      '---- FOLLOW_JUMPS marks in a row far off: JUMPED, and anew
 *
 * What is steered is a rate near 1, by the difference over FOLLOW_CATCH_NS; the
 * move's own ramps take it there.  Never on the tick: divides.  No heap, no
 * clock of its own. */
#ifndef FIRMWARE_CONTROL_FOLLOW_H
#define FIRMWARE_CONTROL_FOLLOW_H

#include <stdbool.h>
#include <stdint.h>

#define FOLLOW_ONE_Q30  (INT64_C(1) << 30)
#define FOLLOW_MEMORY   64
#define FOLLOW_JUMPS    3
#define FOLLOW_LOCK_NS  INT64_C(500000000)
#define FOLLOW_CATCH_NS INT64_C(1000000000)

enum follow_state {
    FOLLOW_WAITING, /* for marks, or enough of them */
    FOLLOW_LOCKED,
    FOLLOW_LOST,   /* no marks any more; it goes on by the last rate */
    FOLLOW_JUMPED, /* they go on elsewhere; WAITING next */
};

struct follow {
    int64_t lost_ns;  /* without a mark */
    int64_t far_ns;   /* a mark that is further off does not count */
    int64_t span_q30; /* the rate is 1 give or take this */

    enum follow_state state;
    unsigned marks, far; /* counted; in a row */
    int64_t first_ns;    /* our time of the first */
    int64_t t_ns, s_ns;  /* of the last: ours, and theirs, filtered */
    int64_t rate_q30;    /* of their clock by ours */
};

/* lost_ns, far_ns > 0; span_q30 0 .. FOLLOW_ONE_Q30 / 4. */
void follow_init(struct follow *self, int64_t lost_ns, int64_t far_ns,
                 int64_t span_q30);
void follow_mark(struct follow *self, int64_t s_ns, int64_t t_ns);
/* Now and then, with the time it is: LOST comes by itself. */
void follow_look(struct follow *self, int64_t now_ns);

/* Their time at our time t_ns; and ours at which theirs is s_ns: while LOCKED or
 * LOST, within years. */
int64_t follow_s_ns(const struct follow *self, int64_t t_ns);
int64_t follow_t_ns(const struct follow *self, int64_t s_ns);

/* For what was at s_ns when our clock was at t_ns. */
int64_t follow_rate_q30(const struct follow *self, int64_t s_ns, int64_t t_ns);

#endif
