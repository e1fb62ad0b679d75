/* tests/motion/otg/otg_many.h - problems for the planner by the million, and
 * what has to come of each.
 *
 * A problem follows from a seed and its number alone, so any of them can be
 * repeated.  Lengths run over twelve decades, times over twelve where the
 * formats hold the limits that belong to them; limits are chosen around what
 * length and time suggest.  Kinds take turns. */
#ifndef TESTS_MOTION_OTG_OTG_MANY_H
#define TESTS_MOTION_OTG_OTG_MANY_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/otg/sync.h"

#define MANY_AXES 7

/* X(name, text) */
#define MANY_KIND_LIST(X)                                                      \
    X(MANY_REST, "rest to rest")                                               \
    X(MANY_MOVING, "moving start")                                             \
    X(MANY_FULL, "any state to any")                                           \
    X(MANY_ASYMMETRIC, "asymmetric limits")                                    \
    X(MANY_OUTSIDE, "start outside the limits")                                \
    X(MANY_TINY, "tiny")                                                       \
    X(MANY_LONG, "long")                                                       \
    X(MANY_RATIO, "extreme ratios")                                            \
    X(MANY_ROUND, "round numbers")                                             \
    X(MANY_ON_LIMIT, "ends on their limits")                                   \
    X(MANY_TIE, "start that must touch")                                       \
    X(MANY_ZERO, "no distance")                                                \
    X(MANY_EQUAL, "goal equal to start")                                       \
    X(MANY_VELOCITY, "velocity goal")                                          \
    X(MANY_NO_JERK, "no limit of jerk")                                        \
    X(MANY_NO_ACC, "none of acceleration")                                     \
    X(MANY_JERK_DOWN, "jerk of slowing down")                                  \
    X(MANY_DURATION, "given duration")                                         \
    X(MANY_SYNC, "2 to 7 axes together")                                       \
    X(MANY_STRAIGHT, "2 to 7 on a line")                                       \
    X(MANY_THROUGH, "through points")                                          \
    X(MANY_REPLAN, "replanned on the way")                                     \
    X(MANY_STOP, "stop")

enum many_kind {
#define MANY_KIND_ENUM(name, text) name,
    MANY_KIND_LIST(MANY_KIND_ENUM)
#undef MANY_KIND_ENUM
        MANY_KINDS
};

const char *many_kind_text(enum many_kind kind);

struct many_problem {
    enum many_kind kind;
    int axes;
    struct motion_otg_move move[MANY_AXES];
    struct motion_otg_move later; /* of MANY_REPLAN */
    uint32_t share_q32;           /* of the duration, where one counts */
};

enum many_verdict {
    MANY_GOOD,
    MANY_REFUSED, /* rightly: there is no such motion */
    MANY_RANGE,   /* rightly: over three days, or beyond the formats */
    MANY_LATE,    /* answered, but over 1e-6 longer than the search says */
    MANY_DOUBT,   /* as that, but not proven */
    MANY_MISSED,  /* refused although there is a motion */
    MANY_BAD,     /* an answer that is wrong */
    MANY_VERDICTS
};

#define MANY_TEXT 800

void many_draw(uint64_t seed, uint64_t number, struct many_problem *problem);
/* Plan it and judge the answer by the oracle; when it is late, missed or bad,
 * `text` says what and gives the move. */
enum many_verdict many_run(const struct many_problem *problem,
                           char text[MANY_TEXT]);

/* Does every motion (of move->dur_ns_q12 or longer) take more than 2^60 ticks,
 * or the change of speed end beyond the format of position?  True is proven, up
 * to rounding. */
bool many_is_far(const struct motion_otg_move *move);
/* All moves in one time; the line of move[0], from rest to rest. */
bool many_are_far(const struct motion_otg_move move[], int axes);
bool many_is_line_far(const struct motion_otg_move move[], int axes);

#endif
