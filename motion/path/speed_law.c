/* motion/path/speed_law.c - see speed_law.h. */
#include "motion/path/speed_law.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"

/* Where a part is on its way. */
struct speed_state {
    struct motion_real pos, vel;
};

static struct motion_bake_point speed_point(struct motion_real pos,
                                            struct motion_real vel,
                                            struct motion_real acc)
{
    return (struct motion_bake_point){ pos, vel, acc };
}

/* --- whole ---------------------------------------------------------------- */

/* The sine of ease.h: 2^-32 and 1e-10 of the move; all: rounding. */
static struct motion_real speed_error(const struct motion_speed_part *part)
{
    const struct motion_real step = motion_real_from_q(1, 32);

    if (part->kind != MOTION_SPEED_SINE)
        return step;
    return motion_real_add(
        motion_real_twice(step),
        motion_real_div(motion_real_from_q(part->length_q32, 32),
                        motion_real_int(INT64_C(10000000000))));
}

static int speed_whole(struct motion_track *law,
                       const struct motion_speed_part *part)
{
    static const struct motion_state still;
    struct motion_state end = still;
    int err =
        motion_fixed_add(law->end.pos_q32, part->length_q32, &end.pos_q32);

    if (err < 0)
        return err;
    if (part->length_q32 < 0)
        return MOTION_E_ARG;
    switch (part->kind) {
    case MOTION_SPEED_CUBIC:
        return motion_track_append_cubic(law, part->dur_ns_q12, 0, &end);
    case MOTION_SPEED_QUINTIC:
        return motion_track_append_quintic(law, part->dur_ns_q12, &still, &end);
    default:
        return motion_ease_append(
            law,
            part->kind == MOTION_SPEED_SINE        ? MOTION_EASE_SINE
            : part->kind == MOTION_SPEED_PARABOLIC ? MOTION_EASE_PARABOLIC
                                                   : MOTION_EASE_SCURVE,
            end.pos_q32, part->dur_ns_q12, part->k1_q32, part->k2_q32);
    }
}

/* --- ramps ---------------------------------------------------------------- */

/* After a stretch whose acceleration goes from acc0 to acc1 in a straight
 * line: s + t (v + t (2 acc0 + acc1) / 6), v + t (acc0 + acc1) / 2. */
static struct speed_state speed_after(struct speed_state state, int64_t dur,
                                      struct motion_real acc0,
                                      struct motion_real acc1)
{
    const struct motion_real t = motion_bake_seconds(dur);
    const struct motion_real sum = motion_real_add(acc0, acc1);
    const struct motion_real bend =
        motion_real_div(motion_real_add(sum, acc0), motion_real_int(6));

    state.pos = motion_real_add(
        state.pos,
        motion_real_mul(t,
                        motion_real_add(state.vel, motion_real_mul(t, bend))));
    state.vel =
        motion_real_add(state.vel, motion_real_half(motion_real_mul(sum, t)));
    return state;
}

static int speed_stretch(struct motion_track *law, struct speed_state *state,
                         int64_t dur, struct motion_real acc0,
                         struct motion_real acc1)
{
    const struct motion_bake_point from = { state->pos, state->vel, acc0 };

    *state = speed_after(*state, dur, acc0, acc1);
    const struct motion_bake_point to = { state->pos, state->vel, acc1 };
    return motion_bake_append(law, dur, &from, &to);
}

/* s = v0 t + (v1 - v0) T (u^3 - u^4/2) */
static int speed_ramp_cubic(struct motion_track *law,
                            const struct motion_speed_part *part)
{
    const struct motion_real t = motion_bake_seconds(part->dur_ns_q12);
    const struct motion_real displacement = motion_real_half(
        motion_real_mul(t, motion_real_add(part->from, part->to)));
    const struct motion_bake_point from =
        speed_point(motion_bake_end(law), part->from, motion_real_zero());
    const struct motion_bake_point to = speed_point(
        motion_real_add(from.pos, displacement), part->to, motion_real_zero());

    return motion_bake_append(law, part->dur_ns_q12, &from, &to);
}

static int speed_ramp_jerk(struct motion_track *law,
                           const struct motion_speed_part *part)
{
    const int64_t half = part->dur_ns_q12 / 2, rest = part->dur_ns_q12 - half;
    const struct motion_real peak = motion_real_div(
        motion_real_twice(motion_real_sub(part->to, part->from)),
        motion_bake_seconds(part->dur_ns_q12));
    struct speed_state state = { motion_bake_end(law), part->from };
    int err = half > 0
                  ? speed_stretch(law, &state, half, motion_real_zero(), peak)
                  : MOTION_OK;

    return err < 0 ? err
                   : speed_stretch(law, &state, rest, peak, motion_real_zero());
}

static int speed_ramp_line(struct motion_track *law,
                           const struct motion_speed_part *part)
{
    const struct motion_real acc =
        motion_real_div(motion_real_sub(part->to, part->from),
                        motion_bake_seconds(part->dur_ns_q12));
    struct speed_state state = { motion_bake_end(law), part->from };

    return speed_stretch(law, &state, part->dur_ns_q12, acc, acc);
}

/* A quarter sine: with w = pi/2 / T, D = v1 - v0 and x the time from the slower
 * end, v = slow + |D| sin(w x), and s over it from there is slow x +
 * |D| (1 - cos(w x)) / w.  Going down is the same seen from the end. */
struct speed_sine {
    struct motion_real start, slow, size, w, displacement;
    int64_t dur;
    bool down;
};

static int speed_sine_at(void *context, int64_t t_ns_q12,
                         enum motion_bake_side side,
                         struct motion_bake_point *point)
{
    const struct speed_sine *sine = context;
    const int64_t t = sine->down ? sine->dur - t_ns_q12 : t_ns_q12;
    const struct motion_real x = motion_bake_seconds(t);
    int64_t phase, s_q62, c_q62, h_q62, unused;

    (void)side;
    (void)motion_fixed_muldiv(t, (int64_t)1 << 62, sine->dur, &phase);
    motion_fixed_sincos_q62((uint64_t)phase, &s_q62, &c_q62);
    motion_fixed_sincos_q62((uint64_t)phase / 2, &h_q62, &unused);
    /* 1 - cos = 2 sin^2 of the half does not cancel */
    const struct motion_real rise = motion_real_div(
        motion_real_mul(sine->size, motion_real_twice(motion_real_sqr(
                                        motion_real_from_q(h_q62, 62)))),
        sine->w);
    struct motion_real pos =
        motion_real_add(motion_real_mul(sine->slow, x), rise);
    struct motion_real acc = motion_real_mul(
        motion_real_mul(sine->size, sine->w), motion_real_from_q(c_q62, 62));

    if (sine->down) {
        pos = motion_real_sub(sine->displacement, pos);
        acc = motion_real_neg(acc);
    }
    point->pos = motion_real_add(sine->start, pos);
    point->vel = motion_real_add(
        sine->slow, motion_real_mul(sine->size, motion_real_from_q(s_q62, 62)));
    point->acc = acc;
    return MOTION_OK;
}

/* Within 1e-10 of the distance (or 2^-30 unit), 1e-8 of the speed, 5e-7 of the
 * acceleration. */
static int speed_ramp_sine(struct motion_track *law,
                           const struct motion_speed_part *part,
                           struct motion_real *error)
{
    struct motion_bake_report report;
    const struct motion_real d = motion_real_sub(part->to, part->from);
    const int64_t border[2] = { 0, part->dur_ns_q12 };
    struct speed_sine sine = {
        .start = motion_bake_end(law),
        .slow = motion_real_min(part->from, part->to),
        .size = motion_real_abs(d),
        .dur = part->dur_ns_q12,
        .down = motion_real_sign(d) < 0,
    };

    if (motion_real_is_zero(d))
        return speed_ramp_line(law, part);
    sine.w = motion_real_div(
        motion_real_from_q(INT64_C(7244019458077122842), 62), /* pi/2 */
        motion_bake_seconds(part->dur_ns_q12));
    sine.displacement = motion_real_add(
        motion_real_mul(sine.slow, motion_bake_seconds(part->dur_ns_q12)),
        motion_real_div(sine.size, sine.w));
    const struct motion_bake job = {
        .source = { speed_sine_at, &sine },
        .axes = 1,
        .border_ns_q12 = border,
        .borders = 2,
        .pos = motion_real_add(
            motion_real_from_q(1, 30),
            motion_real_div(sine.displacement, motion_real_int(10000000000))),
        .vel = motion_real_div(sine.size, motion_real_int(100000000)),
        .acc = motion_real_div(motion_real_mul(sine.size, sine.w),
                               motion_real_int(2000000)),
        .shortest_ns_q12 = 1,
    };
    int err = motion_bake(&job, &law, &report);
    if (err == MOTION_OK)
        *error = motion_real_max(*error, report.bound[0].pos);
    return err;
}

static int speed_ramp(struct motion_track *law,
                      const struct motion_speed_part *part,
                      struct motion_real *error)
{
    if (part->dur_ns_q12 <= 0 ||
        part->dur_ns_q12 > MOTION_TRACK_SEGMENT_MAX_NS_Q12 ||
        motion_real_sign(part->from) < 0 || motion_real_sign(part->to) < 0)
        return MOTION_E_ARG;
    switch (part->kind) {
    case MOTION_SPEED_RAMP_LINE:
        return speed_ramp_line(law, part);
    case MOTION_SPEED_RAMP_SINE:
        return speed_ramp_sine(law, part, error);
    case MOTION_SPEED_RAMP_CUBIC:
        return speed_ramp_cubic(law, part);
    default:
        return speed_ramp_jerk(law, part);
    }
}

/* --- points --------------------------------------------------------------- */

/* Walk the points; append stretches unless `law` is NULL.  All accelerations
 * and speeds are times `scale`. */
static int speed_walk(struct motion_track *law,
                      const struct motion_speed_part *part,
                      struct motion_real scale, struct speed_state *state)
{
    int err = MOTION_OK;

    for (uint32_t i = 0; i + 1 < part->points && err == MOTION_OK; i++) {
        const struct motion_speed_point *a = &part->point[i], *b = a + 1;
        const int64_t dur = b->t_ns_q12 - a->t_ns_q12;
        struct motion_real acc0 = a->value, acc1 = b->value;

        if (dur == 0)
            continue;
        if (part->kind == MOTION_SPEED_VEL_POINTS)
            acc0 = acc1 = motion_real_div(motion_real_sub(acc1, acc0),
                                          motion_bake_seconds(dur));
        acc0 = motion_real_mul(acc0, scale);
        acc1 = motion_real_mul(acc1, scale);
        if (law)
            err = speed_stretch(law, state, dur, acc0, acc1);
        else
            *state = speed_after(*state, dur, acc0, acc1);
    }
    return err;
}

static int speed_check_points(const struct motion_speed_part *part)
{
    const bool is_acc = part->kind == MOTION_SPEED_ACC_POINTS;

    if (part->points < 2)
        return MOTION_E_EMPTY;
    if (part->point[0].t_ns_q12 != 0 || part->length_q32 < 0)
        return MOTION_E_ARG;
    for (uint32_t i = 1; i < part->points; i++) {
        const int64_t t = part->point[i].t_ns_q12;
        const int64_t before = part->point[i - 1].t_ns_q12;
        if (t < before || (t == before && !is_acc))
            return MOTION_E_ORDER;
        if (t > MOTION_TRACK_MAX_NS_Q12)
            return MOTION_E_RANGE;
    }
    return part->point[part->points - 1].t_ns_q12 > 0 ? MOTION_OK
                                                      : MOTION_E_EMPTY;
}

static int speed_points(struct motion_track *law,
                        const struct motion_speed_part *part)
{
    const struct motion_real first = part->kind == MOTION_SPEED_ACC_POINTS
                                         ? part->from
                                         : part->point[0].value;
    struct motion_real scale = motion_real_int(1);
    struct speed_state state = { motion_real_zero(), first };

    if (part->length_q32 > 0) {
        (void)speed_walk(NULL, part, scale, &state);
        if (motion_real_sign(state.pos) <= 0)
            return MOTION_E_ARG;
        scale = motion_real_div(motion_real_from_q(part->length_q32, 32),
                                state.pos);
    }
    state = (struct speed_state){ motion_bake_end(law),
                                  motion_real_mul(first, scale) };
    return speed_walk(law, part, scale, &state);
}

/* --- drawn ---------------------------------------------------------------- */

static int speed_drawn(struct motion_track *law,
                       const struct motion_track *drawn)
{
    const struct motion_real start = motion_bake_end(law);
    int err = MOTION_OK;

    if (drawn == NULL || drawn->count == 0)
        return MOTION_E_EMPTY;
    const struct motion_real base =
        motion_bake_segment(&drawn->segment[0], 0).pos;
    err = motion_speed_check(drawn);
    for (uint32_t i = 0; i < drawn->count && err == MOTION_OK; i++) {
        const struct motion_segment *s = &drawn->segment[i];
        const struct motion_bake_point from = motion_bake_segment(s, 0);
        struct motion_bake_point to = motion_bake_segment(s, s->dur_ns_q12);
        to.pos = motion_real_add(start, motion_real_sub(to.pos, base));
        err = motion_bake_append(law, s->dur_ns_q12, &from, &to);
    }
    return err;
}

/* --- joined --------------------------------------------------------------- */

static bool speed_matches(const struct motion_track *law, uint32_t joint)
{
    const struct motion_segment *before = &law->segment[joint - 1];
    const struct motion_real a =
        motion_bake_segment(before, before->dur_ns_q12).vel;
    const struct motion_real b =
        motion_bake_segment(&law->segment[joint], 0).vel;
    const struct motion_real larger =
        motion_real_max(motion_real_abs(a), motion_real_abs(b));
    const struct motion_real allowed = motion_real_add(
        motion_real_scale(larger, -20), motion_real_from_q(4, 32));

    return motion_real_cmp(motion_real_abs(motion_real_sub(a, b)), allowed) <=
           0;
}

static int speed_part(struct motion_track *law,
                      const struct motion_speed_part *part,
                      struct motion_real *error)
{
    int err;

    *error = motion_real_max(*error, speed_error(part));
    if ((unsigned)part->kind > MOTION_SPEED_DRAWN)
        return MOTION_E_ARG;
    if (part->kind <= MOTION_SPEED_SCURVE)
        return speed_whole(law, part);
    if (part->kind <= MOTION_SPEED_RAMP_JERK)
        return speed_ramp(law, part, error);
    if (part->kind == MOTION_SPEED_DRAWN)
        return speed_drawn(law, part->drawn);
    err = speed_check_points(part);
    if (err == MOTION_OK)
        err = speed_points(law, part);
    return err < 0 ? err : motion_speed_check(law);
}

int motion_speed_append(struct motion_track *law,
                        const struct motion_speed_part *part, uint32_t parts,
                        struct motion_speed_report *report)
{
    const struct motion_track before = *law;
    struct motion_real error = motion_real_zero();

    for (uint32_t i = 0; i < parts; i++) {
        const uint32_t joint = law->count;
        int err = speed_part(law, &part[i], &error);

        if (err == MOTION_OK && joint > 0 && law->count > joint &&
            !speed_matches(law, joint))
            err = MOTION_E_DISCONTINUITY;
        if (err < 0) {
            *law = before;
            if (report)
                report->bad = i;
            return err;
        }
    }
    if (report)
        report->error = error;
    return MOTION_OK;
}

/* Velocity is known to 3 units of 2^-32 and 2^-46 of the largest. */
int motion_speed_check(const struct motion_track *law)
{
    for (uint32_t i = 0; i < law->count; i++) {
        struct motion_extreme vel;
        motion_segment_extreme(&law->segment[i], MOTION_VEL, &vel);
        if (vel.min < -4 - vel.max / ((int64_t)1 << 30))
            return MOTION_E_ORDER;
    }
    return MOTION_OK;
}
