/* firmware/host/exchange/otg_motion.h - rows of slew otg, planned, as tracks.
 *
 * A row on its own is a motion of one leg.  Points that are passed without
 * stopping, and goals that replace each other, are one motion of a leg per row.
 * Whatever is planned ends in a track per axis and leg, and the tracks alone
 * say where the axis is. */
#ifndef FIRMWARE_HOST_EXCHANGE_OTG_MOTION_H
#define FIRMWARE_HOST_EXCHANGE_OTG_MOTION_H

#include "firmware/host/exchange/otg_rows.h"
#include "motion/otg/replan.h"

/* In the row's units, t from the start of the motion. */
struct otg_point {
    double t, p, v, a, j;
};

/* One axis on its way to the goal of one row. */
struct otg_piece {
    enum motion_otg_outcome outcome; /* KEPT: the piece before goes on, and here
                                        is no track */
    enum motion_otg_field field;     /* why it is not NEW */
    struct motion_track track;
    struct motion_segment segment[MOTION_OTG_PHASES];
    int length, time;               /* exponents of the track's units */
    double place, speed;            /* what the track counts from */
    double begin_s, end_s, until_s; /* of the plan; until the next begins */
    struct otg_point start, goal;   /* the row's own numbers; NAN where it has
                                       none, and of t and j */
    const double *limit;            /* the row's values */
    double residual_p, residual_v;  /* motion/otg/otg.h */
};

struct otg_leg {
    struct otg_row row;
    struct otg_piece *piece; /* of every axis */
    double begin_s, end_s;   /* when the last axis is there */
};

struct otg_motion {
    const struct otg_header *header;
    enum motion_sync_kind kind;
    struct otg_leg *leg; /* rows filled in by the caller */
    int legs;
    int failed; /* the leg that `err` and `fault` are about */
    int err;    /* MOTION_OK, or below zero: nothing of it is to be used */
    enum otg_value lost; /* with MOTION_E_RANGE: of what nothing is left in the
                            planner's formats; OTG_VALUES: none */
    struct motion_sync_fault fault;
    bool bent; /* PHASE, but the states allow no straight line: as TIME */
};

/* Room for the pieces of `legs` legs; free with otg_motion_free. */
void otg_motion_init(struct otg_motion *motion, const struct otg_header *header,
                     enum motion_sync_kind kind, int legs);
void otg_motion_free(struct otg_motion *motion);
/* Plan what header->table says; motion->err is what came of it. */
void otg_motion_make(struct otg_motion *motion);
/* Until the last axis is there. */
double otg_motion_seconds(const struct otg_motion *motion);

/* A piece `t_ns_q12` into a segment; at both of its ends the row's own
 * numbers. */
struct otg_point otg_piece_at(const struct otg_piece *piece, uint32_t segment,
                              int64_t t_ns_q12);
/* Where it ends. */
struct otg_point otg_piece_end(const struct otg_piece *piece);

/* Every phase of an axis by its start, and each end after which the axis stands
 * or the motion is over. */
typedef void otg_motion_take(void *context, int leg,
                             const struct otg_point *point);
void otg_motion_walk(const struct otg_motion *motion, int axis,
                     otg_motion_take *take, void *context);
/* What the axis ends with. */
const struct otg_piece *otg_motion_last(const struct otg_motion *motion,
                                        int axis);

#endif
