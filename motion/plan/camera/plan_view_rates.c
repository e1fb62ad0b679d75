/* motion/plan/camera/plan_view_rates.c - how fast pan and tilt turn: see plan_view.h.
 *
 * With the vector w to what is looked at, up u, its height h = w.u and the level
 * part of it, whose length is r = sqrt(w.w - h^2):
 *
 *     pan'  = u.(w x w') / r^2
 *     tilt' = (r h' - h r') / w.w
 *
 * and their derivatives by the quotient rule.  One look instead of a stencil's
 * seven.  Not where the vector is level with nothing (straight up and down), and
 * not where a second derivative steps, which the stencil makes a ramp of. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/interval.h"
#include "motion/plan/camera/plan_view.h"

#define RATES_DEG_Q56 INT64_C(4128596020240314225) /* 180 / pi */
/* The level part of the vector is at least so much of it, 2^-12. */
#define RATES_LEVEL_BITS 12

/* A place, and its first two derivatives by the distance. */
struct rates_jet {
    struct motion_vec d[3];
};

static void rates_space(const struct plan_space *space, int64_t distance_q32,
                        struct rates_jet *jet)
{
    struct motion_arclen_place place;
    struct motion_arclen_point at;

    motion_arclen_find(&space->table, motion_real_from_q(distance_q32, 32),
                       &place);
    motion_arclen_by_length(&space->curve, place.piece, place.x, &at);
    for (int k = 0; k < 3; k++)
        jet->d[k] = motion_vec_zero();
    for (uint32_t i = 0; i < space->curve.axes; i++) {
        jet->d[0].x[i] = at.pos[i];
        jet->d[1].x[i] = at.d1[i];
        jet->d[2].x[i] = at.d2[i];
    }
}

/* Past the end what is ahead goes on straight, or from the start, or stands. */
static void rates_ahead(const struct plan_view *self, int64_t distance_q32,
                        struct rates_jet *jet)
{
    const struct plan_camera *camera = self->camera;
    const int64_t length = self->path.length_q32;
    const int64_t left = length - distance_q32;
    const int64_t beyond = camera->ahead_q32 - left;

    if (beyond <= 0) {
        rates_space(self->space, distance_q32 + camera->ahead_q32, jet);
        return;
    }
    if (camera->end == MOTION_AHEAD_CLOSED) {
        rates_space(self->space, beyond % length, jet);
        return;
    }
    rates_space(self->space, length, jet);
    jet->d[2] = motion_vec_zero();
    if (camera->end == MOTION_AHEAD_HOLD)
        jet->d[1] = motion_vec_zero();
    else
        jet->d[0] = motion_vec_add(
            jet->d[0],
            motion_vec_scale(jet->d[1], motion_real_from_q(beyond, 32)));
}

/* At the same part of another path. */
static bool rates_other(const struct plan_view *self, int64_t distance_q32,
                        struct rates_jet *jet)
{
    const int64_t length = self->path.length_q32;
    const struct plan_space *other = &self->other_space;
    const struct motion_real ratio =
        motion_real_div(motion_real_from_q(other->length_q32, 32),
                        motion_real_from_q(length, 32));
    int64_t at = 0;

    if (motion_fixed_muldiv(distance_q32, other->length_q32, length, &at) < 0)
        return false;
    rates_space(other, at, jet);
    jet->d[1] = motion_vec_scale(jet->d[1], ratio);
    jet->d[2] = motion_vec_scale(jet->d[2], motion_real_sqr(ratio));
    return true;
}

/* The share of the way at x, and its first two derivatives; see
 * motion_target. */
static void rates_ease(enum motion_dwell_ease ease, struct motion_real x,
                       struct motion_real e[3])
{
    const struct motion_real y = motion_real_sub(motion_real_int(1), x);
    const struct motion_real xy = motion_real_mul(x, y);
    const struct motion_real turn = motion_real_sub(y, x);

    if (ease == MOTION_DWELL_CUBIC) { /* 3x^2 - 2x^3 */
        e[0] = motion_real_mul(
            motion_real_sqr(x),
            motion_real_add(motion_real_int(1), motion_real_twice(y)));
        e[1] = motion_real_mul(xy, motion_real_int(6));
        e[2] = motion_real_mul(turn, motion_real_int(6));
        return;
    }
    /* x^3 (10 - 15x + 6x^2) = x^3 (1 + 3y + 6y^2) */
    e[0] = motion_real_mul(
        motion_real_mul(x, motion_real_sqr(x)),
        motion_real_add(
            motion_real_add(motion_real_int(1),
                            motion_real_mul(y, motion_real_int(3))),
            motion_real_mul(motion_real_sqr(y), motion_real_int(6))));
    e[1] = motion_real_mul(motion_real_sqr(xy), motion_real_int(30));
    e[2] = motion_real_mul(motion_real_mul(xy, turn), motion_real_int(60));
}

/* Rests on one point, or on the way in a straight line to the next. */
static void rates_dwell(const struct plan_view *self, int64_t distance_q32,
                        struct rates_jet *jet)
{
    const struct motion_target *target = &self->target;
    uint32_t i = 0;

    while (i + 1 < target->dwells &&
           target->dwell[i + 1].from_q32 <= distance_q32)
        i++;
    const struct motion_dwell *at = &target->dwell[i];
    *jet = (struct rates_jet){ { motion_vec_from_q32(at->point_q32),
                                 motion_vec_zero(), motion_vec_zero() } };
    if (distance_q32 <= at->to_q32 || i + 1 == target->dwells)
        return;
    const struct motion_real from = motion_real_from_q(at->to_q32, 32);
    const struct motion_real width =
        motion_real_sub(motion_real_from_q(at[1].from_q32, 32), from);
    const struct motion_vec line =
        motion_vec_sub(motion_vec_from_q32(at[1].point_q32), jet->d[0]);
    struct motion_real e[3];
    rates_ease(
        target->ease,
        motion_real_div(
            motion_real_sub(motion_real_from_q(distance_q32, 32), from), width),
        e);
    e[1] = motion_real_div(e[1], width);
    e[2] = motion_real_div(e[2], motion_real_sqr(width));
    jet->d[0] = motion_vec_add(jet->d[0], motion_vec_scale(line, e[0]));
    jet->d[1] = motion_vec_scale(line, e[1]);
    jet->d[2] = motion_vec_scale(line, e[2]);
}

static bool rates_target(const struct plan_view *self, int64_t distance_q32,
                         struct rates_jet *jet)
{
    switch (self->camera->look) {
    case PLAN_LOOK_AT:
        *jet =
            (struct rates_jet){ { motion_vec_from_q32(self->camera->point_q32),
                                  motion_vec_zero(), motion_vec_zero() } };
        return true;
    case PLAN_LOOK_AHEAD:
        rates_ahead(self, distance_q32, jet);
        return true;
    case PLAN_LOOK_PATH:
        return rates_other(self, distance_q32, jet);
    case PLAN_LOOK_DWELL:
        rates_dwell(self, distance_q32, jet);
        return true;
    default:
        return false;
    }
}

/* Where `distance` is between the borders, the stencil reaches none of them. */
static bool rates_is_clear(const struct plan_view *self, int64_t distance_q32)
{
    const uint32_t low =
        motion_interval_find(self->border_q32, sizeof *self->border_q32,
                             self->borders, distance_q32);

    return distance_q32 - self->border_q32[low] > 3 * self->step_q32 &&
           (low + 1 >= self->borders ||
            self->border_q32[low + 1] - distance_q32 > 3 * self->step_q32);
}

/* Second derivatives do not step there: points where a curve is smooth do not
 * matter, but where what is ahead leaves the path does. */
static bool rates_is_smooth(const struct plan_view *self, int64_t distance_q32)
{
    const struct plan_camera *camera = self->camera;
    const bool smooth = self->space->smooth > 1;

    switch (camera->look) {
    case PLAN_LOOK_AT:
        return smooth;
    case PLAN_LOOK_DWELL: /* the other ease steps where a rest begins */
        return smooth && camera->ease == MOTION_DWELL_QUINTIC;
    case PLAN_LOOK_PATH:
        return smooth && self->other_space.smooth > 1;
    case PLAN_LOOK_AHEAD:
        return smooth &&
               motion_fixed_abs(self->path.length_q32 - camera->ahead_q32 -
                                distance_q32) > 3 * (uint64_t)self->step_q32;
    default:
        return false;
    }
}

/* (a' - a b' / b) / b: the derivative of a / b. */
static struct motion_real rates_quotient(struct motion_real a1,
                                         struct motion_real ratio,
                                         struct motion_real b,
                                         struct motion_real b1)
{
    return motion_real_div(motion_real_sub(a1, motion_real_mul(ratio, b1)), b);
}

static struct motion_bake_point rates_deg(struct motion_real vel,
                                          struct motion_real acc)
{
    const struct motion_real deg = motion_real_from_q(RATES_DEG_Q56, 56);

    return (struct motion_bake_point){ motion_real_zero(),
                                       motion_real_mul(vel, deg),
                                       motion_real_mul(acc, deg) };
}

static struct motion_bake_point rates_pan(const struct rates_jet *sight,
                                          struct motion_vec up,
                                          struct motion_real level,
                                          struct motion_real level1)
{
    const struct motion_vec *w = sight->d;
    const struct motion_real turn =
        motion_vec_dot(up, motion_vec_cross(w[0], w[1]));
    const struct motion_real turn1 =
        motion_vec_dot(up, motion_vec_cross(w[0], w[2]));
    const struct motion_real vel = motion_real_div(turn, level);

    return rates_deg(vel, rates_quotient(turn1, vel, level, level1));
}

static struct motion_bake_point rates_tilt(const struct rates_jet *sight,
                                           const struct motion_real h[3],
                                           const struct motion_real level[3])
{
    const struct motion_vec *w = sight->d;
    const struct motion_real all = motion_vec_dot(w[0], w[0]);
    const struct motion_real all1 =
        motion_real_twice(motion_vec_dot(w[0], w[1]));
    const struct motion_real r = motion_real_sqrt(level[0]);
    const struct motion_real r1 =
        motion_real_div(motion_real_half(level[1]), r);
    const struct motion_real r2 = motion_real_div(
        motion_real_sub(motion_real_half(level[2]), motion_real_sqr(r1)), r);
    const struct motion_real turn =
        motion_real_sub(motion_real_mul(r, h[1]), motion_real_mul(h[0], r1));
    const struct motion_real turn1 =
        motion_real_sub(motion_real_mul(r, h[2]), motion_real_mul(h[0], r2));
    const struct motion_real vel = motion_real_div(turn, all);

    return rates_deg(vel, rates_quotient(turn1, vel, all, all1));
}

/* a0 b0, and its derivatives; of vectors and of numbers. */
static void rates_square(const struct motion_vec w[3],
                         const struct motion_real h[3],
                         struct motion_real level[3])
{
    level[0] =
        motion_real_sub(motion_vec_dot(w[0], w[0]), motion_real_sqr(h[0]));
    level[1] = motion_real_twice(motion_real_sub(motion_vec_dot(w[0], w[1]),
                                                 motion_real_mul(h[0], h[1])));
    level[2] = motion_real_twice(motion_real_sub(
        motion_real_add(motion_vec_dot(w[1], w[1]), motion_vec_dot(w[0], w[2])),
        motion_real_add(motion_real_sqr(h[1]), motion_real_mul(h[0], h[2]))));
}

bool plan_view_rates(const struct plan_view *self, int64_t distance_q32,
                     bool is_over,
                     struct motion_bake_point jet[MOTION_HEAD_AXES])
{
    const struct motion_vec up = motion_vec_from_dir(self->camera->up);
    const struct motion_real zero = motion_real_zero();
    struct rates_jet from, sight;
    struct motion_real h[3], level[3];

    if (!rates_is_smooth(self, distance_q32) &&
        !rates_is_clear(self, distance_q32))
        return false;
    if (!rates_target(self, distance_q32, &sight))
        return false;
    rates_space(self->space, distance_q32, &from);
    for (int k = 0; k < 3; k++) {
        sight.d[k] = motion_vec_sub(sight.d[k], from.d[k]);
        h[k] = motion_vec_dot(sight.d[k], up);
    }
    rates_square(sight.d, h, level);
    if (!motion_real_lt(
            motion_real_scale(motion_vec_dot(sight.d[0], sight.d[0]),
                              -2 * RATES_LEVEL_BITS),
            level[0]))
        return false;
    jet[MOTION_HEAD_PAN] = rates_pan(&sight, up, level[0], level[1]);
    jet[MOTION_HEAD_TILT] = rates_tilt(&sight, h, level);
    jet[MOTION_HEAD_ROLL] = (struct motion_bake_point){ zero, zero, zero };
    if (is_over) {
        struct motion_bake_point *tilt = &jet[MOTION_HEAD_TILT];
        tilt->vel = motion_real_neg(tilt->vel);
        tilt->acc = motion_real_neg(tilt->acc);
    }
    return true;
}
