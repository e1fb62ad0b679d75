/* motion/otg/otg.c - see otg.h.
 *
 *   judge the request  ->  reals, limits drawn in  ->  brake both ends inside
 *   ->  solve  ->  whole ticks  ->  check; draw in further while it fails */
#include "motion/otg/otg.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"

#define OTG_HURRY       20 /* at first no more than 2^-20 longer, and a ns */
#define OTG_HURRY_TICKS 4096
#define OTG_ROOT        10 /* what a search next to an edge may be off */
#define OTG_LATER       24 /* durations tried when the shortest has no plan */
#define OTG_SOON        6  /* of these before all draws are tried */
#define OTG_WAIT        4  /* the second is 2^4 ticks more */

/* Seconds to whole 2^-12 ns, up by more than the search is off and so much that
 * there is something to choose from. */
static int64_t in_ns_q12(struct num t)
{
    struct num up = num_add(t, num_scale(t, -23));
    return motion_real_floor_clamped(
               num_real(num_mul(up, motion_otg_per_second())), 0) +
           1;
}

static bool is_there(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    return (move->mode == MOTION_OTG_VELOCITY ||
            start->pos_q32 == goal->pos_q32) &&
           start->vel_q32 == goal->vel_q32 && start->acc_q32 == goal->acc_q32;
}

/* The shape of the motion, for a position or a velocity. */
static int otg_shape_of(const struct motion_otg_move *move,
                        struct otg_problem *q, int64_t dur_ns_q12,
                        struct otg_shape *shape, struct num *next)
{
    otg_shape_init(shape);
    if (dur_ns_q12 == 0 && is_there(move))
        return MOTION_OK;
    if (move->mode == MOTION_OTG_POSITION)
        return motion_otg_propose(q, motion_otg_seconds(dur_ns_q12), shape,
                                  next);
    motion_otg_propose_velocity(q, shape);
    return MOTION_OK;
}

/* The plan's duration is the proposal's where the answer is MOTION_E_LIMIT; one
 * above `most` is not made good, nor one that is on an edge when that is
 * asked. */
static int otg_try(const struct motion_otg_move *move, int64_t dur_ns_q12,
                   struct otg_draw draw, int64_t most, bool *is_edge,
                   struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    struct otg_problem q;
    struct otg_shape shape;
    struct num next = num_zero();
    motion_otg_problem_init(move, draw, &q);
    int err = otg_shape_of(move, &q, dur_ns_q12, &shape, &next);
    if (err < 0) {
        plan->dur_ns_q12 = in_ns_q12(next);
        return otg_refuse(field, MOTION_OTG_FIELD_DURATION, err);
    }
    err = MOTION_E_LIMIT;
    if (is_edge)
        *is_edge = shape.is_edge;
    if (is_edge && *is_edge)
        *field = MOTION_OTG_FIELD_GOAL_POS;
    else if (most == INT64_MAX ||
             in_ns_q12(motion_otg_shape_time(&shape)) <= most)
        err = motion_otg_settle(move, &q, &shape, dur_ns_q12, plan, field);
    if (err == MOTION_E_LIMIT)
        plan->dur_ns_q12 = in_ns_q12(motion_otg_shape_time(&shape));
    return err;
}

/* Without a limit on it, what a start or goal has of acceleration (velocity)
 * does not matter: it steps. */
static struct motion_otg_move
without_unlimited(const struct motion_otg_move *move)
{
    struct motion_otg_move m = *move;
    if (!m.limit.jerk_q32)
        m.start.acc_q32 = m.goal.acc_q32 = 0;
    if (!m.limit.acc_max_q32)
        m.start.vel_q32 = m.goal.vel_q32 = 0;
    return m;
}

static int64_t least_of(const struct motion_otg_move *move)
{
    static const struct otg_draw draw = { OTG_BITS, OTG_BITS, OTG_BITS, false };
    struct otg_problem q;
    struct otg_shape shape;
    struct num next;
    motion_otg_problem_init(move, draw, &q);
    (void)otg_shape_of(move, &q, 0, &shape, &next);
    struct num t =
        num_mul(motion_otg_shape_time(&shape), motion_otg_per_second());
    return motion_real_floor_clamped(num_real(t), 0);
}

OTG_OWN_FRAME static int64_t least_unlimited(const struct motion_otg_move *move)
{
    const struct motion_otg_move own = without_unlimited(move);
    return least_of(&own);
}

int motion_otg_least(const struct motion_otg_move *move, int64_t *dur_ns_q12,
                     enum motion_otg_field *field)
{
    int err = motion_otg_is_valid(move, field);
    if (err == MOTION_OK)
        *dur_ns_q12 =
            move->limit.jerk_q32 ? least_of(move) : least_unlimited(move);
    return err;
}

int motion_otg_make(const struct motion_otg_move *move,
                    struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    return motion_otg_make_in(move, move->dur_ns_q12, plan,
                              field ? field : &unused);
}

/* Where the way is next to what the plain change of speed covers, drawing
 * limits in costs the root of it: that is made exactly, or what is next to it,
 * unless the search has a shorter way, with the acceleration on one side of
 * zero. */
OTG_OWN_FRAME static int otg_make_edge(const struct motion_otg_move *move,
                                       struct motion_otg_plan *plan,
                                       enum motion_otg_field *field)
{
    int64_t dur = plan->dur_ns_q12;
    int err = motion_otg_plain(move, plan, field);
    if (err < 0)
        err = motion_otg_edge(move, dur, plan, field);
    if (err == MOTION_OK && plan->dur_ns_q12 > dur + (dur >> OTG_ROOT))
        err = MOTION_E_LIMIT;
    return err;
}

/* In a hurry what takes longer waits: lower limits can close a way that was
 * just open.  Then strictly, and then as they are. */
enum draws { DRAW_HURRY, DRAW_STRICT, DRAW_ALL };

/* One after the other with limits drawn in further; *first becomes the duration
 * of the first.  Where there is no motion of the duration it stays, and the
 * plan's duration is the next one. */
static int otg_make_drawn(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, enum draws how,
                          struct motion_otg_plan *plan, int64_t *first,
                          enum motion_otg_field *field)
{
    struct otg_draw draw = { OTG_BITS, OTG_BITS, OTG_BITS, how == DRAW_STRICT };
    int64_t most = INT64_MAX;
    int wanted = OTG_BITS;
    for (int i = 0; i < OTG_TRIES; i++) {
        bool is_edge = false;
        int err =
            otg_try(move, dur_ns_q12, draw, most,
                    i == 0 && how == DRAW_HURRY ? &is_edge : NULL, plan, field);
        if (is_edge && otg_make_edge(move, plan, field) == MOTION_OK)
            return MOTION_OK;
        if (is_edge)
            err = otg_try(move, dur_ns_q12, draw, most, NULL, plan, field);
        if (err == MOTION_OK || err == MOTION_E_RANGE)
            return err;
        if (i == 0) {
            if (*field == MOTION_OTG_FIELD_DURATION)
                return err;
            *first = plan->dur_ns_q12;
            wanted = motion_otg_wanted_bits(*first);
            if (how == DRAW_HURRY)
                most = *first + (*first >> OTG_HURRY) + OTG_HURRY_TICKS;
        }
        draw = motion_otg_draw(wanted, i + (wanted == OTG_BITS));
        draw.is_strict = how == DRAW_STRICT;
    }
    return MOTION_E_LIMIT;
}

/* The first duration from `least` on that has a plan.  The fastest motion may
 * exist for no whole number of ticks: at a given speed a way is covered in a
 * part of one, or within what the jerk allows only in times that lie between
 * two.  So wait: for a little longer, or for the next time at which there is a
 * motion. */
static int otg_make_later(const struct motion_otg_move *move, int64_t least,
                          int tries, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int64_t dur = least;
    for (int i = 0; i <= tries; i++) {
        int64_t first = 0;
        if (dur >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
            return otg_refuse(field, MOTION_OTG_FIELD_GOAL_POS, MOTION_E_RANGE);
        int err = otg_make_drawn(move, dur, DRAW_ALL, plan, &first, field);
        if (err == MOTION_OK || err == MOTION_E_RANGE)
            return err;
        if (tries > OTG_SOON && first == 0 && plan->dur_ns_q12 > dur)
            least = plan->dur_ns_q12;
        dur =
            least + (least >> (OTG_BITS - i)) + ((int64_t)1 << (OTG_WAIT + i));
    }
    return otg_refuse(field, MOTION_OTG_FIELD_GOAL_POS, MOTION_E_LIMIT);
}

/* A plan that meets its goal. */
static int otg_make_exact(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int64_t first = 0;
    bool hurry = move->mode == MOTION_OTG_POSITION && dur_ns_q12 == 0;
    if (move->mode == MOTION_OTG_VELOCITY
            ? motion_otg_plain(move, plan, field) == MOTION_OK
            : hurry && motion_otg_cruise(move, plan))
        return MOTION_OK;
    int err = otg_make_drawn(move, dur_ns_q12, hurry ? DRAW_HURRY : DRAW_ALL,
                             plan, &first, field);
    if (err == MOTION_E_LIMIT && hurry &&
        otg_make_later(move, first, OTG_SOON, plan, field) == MOTION_OK)
        return MOTION_OK;
    if (err == MOTION_E_LIMIT && hurry)
        err =
            otg_make_drawn(move, dur_ns_q12, DRAW_STRICT, plan, &first, field);
    if (err == MOTION_E_LIMIT && hurry)
        err = otg_make_drawn(move, dur_ns_q12, DRAW_ALL, plan, &first, field);
    if (err != MOTION_E_LIMIT || move->mode != MOTION_OTG_POSITION)
        return err;
    if (dur_ns_q12 == 0)
        return otg_make_later(move, first, OTG_LATER, plan, field);
    int64_t least = dur_ns_q12 + (dur_ns_q12 >> OTG_BITS) + 1;
    if (first == 0 && plan->dur_ns_q12 > dur_ns_q12)
        least = plan->dur_ns_q12;
    err = otg_make_later(move, least, OTG_LATER, plan, field);
    return otg_refuse(field, MOTION_OTG_FIELD_DURATION,
                      err == MOTION_E_RANGE ? err : MOTION_E_LIMIT);
}

static int otg_make_valid(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int err = otg_make_exact(move, dur_ns_q12, plan, field);
    return dur_ns_q12 ? err : motion_otg_nearest(move, err, plan);
}

OTG_OWN_FRAME static int otg_make_unlimited(const struct motion_otg_move *move,
                                            int64_t dur_ns_q12,
                                            struct motion_otg_plan *plan,
                                            enum motion_otg_field *field)
{
    const struct motion_otg_move own = without_unlimited(move);
    return otg_make_valid(&own, dur_ns_q12, plan, field);
}

int motion_otg_make_in(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan,
                       enum motion_otg_field *field)
{
    int err = motion_otg_is_valid(move, field);
    if (err == MOTION_OK)
        err = move->limit.jerk_q32
                  ? otg_make_valid(move, dur_ns_q12, plan, field)
                  : otg_make_unlimited(move, dur_ns_q12, plan, field);
    if (err < 0)
        plan->count = 0;
    if (err < 0 && move->mode == MOTION_OTG_VELOCITY &&
        *field == MOTION_OTG_FIELD_GOAL_POS)
        *field = MOTION_OTG_FIELD_GOAL_VEL;
    return err;
}
