/* firmware/studio/wasm/numbers.c - what a plan says in numbers; see plan.h. */
#include <math.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_camera.h"
#include "firmware/studio/wasm/plan.h"
#include "motion/core/fixed.h"
#include "motion/curve/interval.h"

int64_t studio_time(double t_s)
{
    const double most = ldexp(1, 62);
    const double t = t_s * (double)MOTION_FIXED_S_Q12;

    return !(t > 0) ? 0 : t < most ? (int64_t)t : (int64_t)1 << 62;
}

static double numbers_seconds(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12;
}

static const struct motion_track *numbers_track(const struct studio_plan *plan,
                                                uint32_t axis)
{
    return plan->status == STATUS_OK && axis < plan->job.planned
               ? &plan->job.track[axis]
               : NULL;
}

/* The segment that `t` is in, or the last. */
static uint32_t numbers_segment(const struct motion_track *track, int64_t t)
{
    return track->count == 0
               ? 0
               : motion_interval_find(&track->segment->start_ns_q12,
                                      sizeof *track->segment, track->count, t);
}

static void numbers_state(double out[4], const struct motion_state *state)
{
    out[0] = number_double(state->pos_q32, 32);
    out[1] = number_double(state->vel_q32, 32);
    out[2] = number_double(state->acc_q32, 32);
    out[3] = number_double(state->jerk_q32, 32);
}

/* --- keys -------------------------------------------------------------------- */

static double numbers_real(bool given, struct motion_real value)
{
    return given ? ldexp((double)value.m, value.e) : NAN;
}

static void numbers_handle(double out[3], uint8_t kind,
                           const struct motion_fcurve_point *at,
                           const struct motion_fcurve_point *handle)
{
    out[0] = kind;
    out[1] = numbers_seconds(handle->t_ns_q12 - at->t_ns_q12);
    out[2] =
        number_double(handle->pos_q32, 32) - number_double(at->pos_q32, 32);
}

/* Where the curve is at the key; nothing where time is bent. */
static void numbers_curve(const struct studio_plan *plan,
                          const struct motion_track *track, int64_t t,
                          double out[3])
{
    struct motion_state left, right;

    if (plan->job.outcome.is_bent || track->count == 0 || t < 0)
        return;
    t += plan->job.outcome.lag_ns_q12;
    motion_track_state(track, t, &right);
    const uint32_t i = numbers_segment(track, t > 0 ? t - 1 : 0);
    const struct motion_segment *segment = &track->segment[i];
    motion_segment_state(segment,
                         t - segment->start_ns_q12 < segment->dur_ns_q12
                             ? t - segment->start_ns_q12
                             : segment->dur_ns_q12,
                         &left);
    out[0] = number_double(right.vel_q32, 32);
    out[1] = number_double(left.acc_q32, 32);
    out[2] = number_double(right.acc_q32, 32);
}

static void numbers_key(const struct studio_plan *plan, uint32_t index,
                        uint32_t i, const struct motion_fcurve *curve,
                        double *out)
{
    const struct plan_axis *axis = &plan->job.move.axis[index];
    const struct plan_key *key = &axis->key[i];

    for (unsigned k = 0; k < STUDIO_KEY; k++)
        out[k] = 0;
    out[0] = numbers_seconds(key->key.t_ns_q12);
    out[1] = number_double(key->key.pos_q32, 32);
    out[2] = numbers_real(key->key.has_vel, key->key.vel);
    out[3] = numbers_real(key->key.has_acc, key->key.acc);
    out[4] = key->place.line;
    out[5] = key->place.column;
    out[6] = key->has_curve ? key->curve : axis->curve;
    out[7] = key->fixed;
    for (unsigned k = 8; k < 16; k++)
        out[k] = NAN;
    if (curve != NULL) {
        const struct motion_fcurve_key *bezier = &curve->key[i];
        numbers_handle(&out[8], bezier->left_kind, &bezier->at, &bezier->left);
        numbers_handle(&out[11], bezier->right_kind, &bezier->at,
                       &bezier->right);
        out[14] = bezier->interpolation;
        out[15] = bezier->easing;
    }
    out[16] = out[17] = out[18] = NAN;
    numbers_curve(plan, &plan->job.track[index], key->key.t_ns_q12, &out[16]);
}

static bool numbers_is_bezier(const struct plan_axis *axis)
{
    for (uint32_t i = 0; i + 1 < axis->key_count; i++)
        if ((axis->key[i].has_curve ? axis->key[i].curve : axis->curve) !=
            PLAN_CURVE_BEZIER)
            return false;
    return axis->curve == PLAN_CURVE_BEZIER && axis->key_count > 0;
}

STUDIO_EXPORT bool studio_plan_keys(const struct studio_plan *plan,
                                    uint32_t index, double *out)
{
    struct motion_fcurve curve = { .key = NULL };

    if (numbers_track(plan, index) == NULL)
        return false;
    const struct plan_axis *axis = &plan->job.move.axis[index];
    const bool is_bezier =
        numbers_is_bezier(axis) && plan_bezier_curve(axis, &curve) == 0;
    for (uint32_t i = 0; i < axis->key_count; i++)
        numbers_key(plan, index, i, is_bezier ? &curve : NULL,
                    out + (size_t)STUDIO_KEY * i);
    memory_free(curve.key);
    return true;
}

/* --- samples -----------------------------------------------------------------
 *
 * Position, velocity and acceleration at both ends of a column as the tick
 * samples them; jerk, which the tick has no use for, from the facts about its
 * segment, where it is a polynomial of the second degree at most.  What lies between is
 * in the extremes of the segment. */

struct numbers_column {
    int64_t from, to;
    double *out; /* lowest, highest of p, v, a, j */
};

static void numbers_take(const struct numbers_column *column, unsigned k,
                         double value)
{
    double *pair = &column->out[(size_t)2 * k];

    pair[0] = value < pair[0] ? value : pair[0];
    pair[1] = value > pair[1] ? value : pair[1];
}

static void numbers_take_at(const struct motion_track *track,
                            struct motion_cursor *cursor,
                            const struct numbers_column *column, int64_t t)
{
    struct motion_sample sample;

    motion_track_sample(track, cursor, t, &sample);
    numbers_take(column, 0, number_double(sample.pos_q32, 32));
    numbers_take(column, 1, number_double(sample.vel_q32, 32));
    numbers_take(column, 2, number_double(sample.acc_q32, 32));
}

/* Its middle follows from both ends and the change of acceleration (Simpson's
 * rule, exact for the second degree). */
static double numbers_jerk(const struct motion_segment *segment,
                           const struct plan_facts *facts, int64_t t)
{
    const double dur_s = numbers_seconds(segment->dur_ns_q12);
    const double u =
        (double)(t - segment->start_ns_q12) / (double)segment->dur_ns_q12;
    const double start = facts->value[0][MOTION_JERK] * 0x1p-32,
                 end = facts->value[1][MOTION_JERK] * 0x1p-32;
    const double change =
        (facts->value[1][MOTION_ACC] - facts->value[0][MOTION_ACC]) * 0x1p-32;
    const double middle = (6 * change / dur_s - start - end) / 4;

    return start * (1 - u) * (1 - 2 * u) + middle * 4 * u * (1 - u) +
           end * u * (2 * u - 1);
}

/* What of a segment is in the column. */
static void numbers_part(const struct numbers_column *column,
                         const struct motion_segment *segment,
                         const struct plan_facts *facts)
{
    const int64_t start = segment->start_ns_q12;
    const int64_t end = start + segment->dur_ns_q12;
    const int64_t from = column->from > start ? column->from : start;
    const int64_t to = column->to < end ? column->to : end;

    numbers_take(column, 3, numbers_jerk(segment, facts, from));
    numbers_take(column, 3, numbers_jerk(segment, facts, to));
    for (unsigned k = 0; k < 4; k++) {
        const struct motion_extreme *of = &facts->extreme[k];
        if (of->min_ns_q12 >= from && of->min_ns_q12 <= to)
            numbers_take(column, k, number_double(of->min, 32));
        if (of->max_ns_q12 >= from && of->max_ns_q12 <= to)
            numbers_take(column, k, number_double(of->max, 32));
    }
}

static void numbers_fill(const struct motion_track *track,
                         const struct job_facts *facts,
                         struct motion_cursor *cursor,
                         const struct numbers_column *column)
{
    for (size_t k = 0; k < 4; k++) {
        column->out[2 * k] = INFINITY;
        column->out[2 * k + 1] = -INFINITY;
    }
    numbers_take_at(track, cursor, column, column->from);
    numbers_take_at(track, cursor, column, column->to);
    if (track->count == 0 || column->to > track->end_ns_q12)
        numbers_take(column, 3, 0);
    if (track->count == 0 || column->from > track->end_ns_q12)
        return;
    for (uint32_t i = numbers_segment(track, column->from);
         i < track->count && track->segment[i].start_ns_q12 <= column->to; i++)
        numbers_part(column, &track->segment[i], facts->segment[i].facts);
}

STUDIO_EXPORT bool studio_plan_samples(const struct studio_plan *plan,
                                       uint32_t axis, double from_s,
                                       double to_s, uint32_t columns,
                                       uint32_t first, uint32_t count,
                                       double *out)
{
    const struct motion_track *track = numbers_track(plan, axis);
    struct motion_cursor cursor = { 0 };

    if (track == NULL || !(to_s >= from_s))
        return false;
    const struct job_facts *facts = &plan->job.facts[axis];
    for (uint32_t i = first; i < first + count; i++) {
        const double part = (to_s - from_s) / columns;
        const struct numbers_column column = {
            .from = studio_time(from_s + part * i),
            .to = studio_time(from_s + part * (i + 1)),
            .out = out + (size_t)STUDIO_COLUMN * (i - first),
        };
        numbers_fill(track, facts, &cursor, &column);
    }
    return true;
}

static bool numbers_is_end(const struct motion_track *a,
                           const struct motion_track *b)
{
    return a->end_ns_q12 == b->end_ns_q12 && a->end.pos_q32 == b->end.pos_q32 &&
           a->end_frac == b->end_frac;
}

static double numbers_start(const struct motion_track *track, uint32_t segment)
{
    return numbers_seconds(segment < track->count
                               ? track->segment[segment].start_ns_q12
                               : track->end_ns_q12);
}

STUDIO_EXPORT bool studio_plan_changed(const struct studio_plan *plan,
                                       const struct studio_plan *other,
                                       uint32_t axis, double out[2])
{
    const struct motion_track *a = numbers_track(plan, axis);
    const struct motion_track *b = numbers_track(other, axis);
    uint32_t first = 0, last = 0; /* how many are the same */

    if (a == NULL || b == NULL)
        return false;
    const uint32_t least = a->count < b->count ? a->count : b->count;
    while (first < least &&
           job_same_segment(&a->segment[first], &b->segment[first]))
        first++;
    while (last < least - first && numbers_is_end(a, b) &&
           job_same_segment(&a->segment[a->count - 1 - last],
                            &b->segment[b->count - 1 - last]))
        last++;
    const bool is_same =
        first == a->count && a->count == b->count && numbers_is_end(a, b);
    out[0] = is_same      ? INFINITY
             : first == 0 ? -INFINITY /* it stands there before */
                          : numbers_start(a, first);
    out[1] = is_same     ? -INFINITY
             : last == 0 ? INFINITY
                         : numbers_start(a, a->count - last);
    return true;
}

STUDIO_EXPORT void studio_plan_violations(const struct studio_plan *plan,
                                          double *out)
{
    const struct job *job = &plan->job;

    for (uint32_t i = 0; i < job->violation_count;
         i++, out += STUDIO_VIOLATION) {
        const struct job_violation *violation = &job->violation[i];
        const struct plan_axis *axis = &job->move.axis[violation->axis];
        const bool is_keyed = axis->key_count > 0;
        const struct plan_place place =
            is_keyed ? axis->key[violation->key].place : axis->place;
        out[0] = violation->axis;
        out[1] = violation->kind;
        out[2] = numbers_seconds(violation->t_ns_q12);
        out[3] = number_double(violation->value, 32);
        out[4] = number_double(violation->limit, 32);
        out[5] = is_keyed ? (double)violation->key : NAN;
        out[6] = place.line;
        out[7] = place.column;
    }
}

STUDIO_EXPORT bool studio_plan_at(const struct studio_plan *plan, uint32_t axis,
                                  double t_s, double out[4])
{
    const struct motion_track *track = numbers_track(plan, axis);
    struct motion_state state;

    if (track == NULL)
        return false;
    motion_track_state(track, studio_time(t_s), &state);
    numbers_state(out, &state);
    return true;
}

STUDIO_EXPORT bool studio_plan_rows(const struct studio_plan *plan,
                                    uint32_t axis, uint32_t first,
                                    uint32_t count, uint32_t rate, int64_t *out)
{
    const struct motion_track *track = numbers_track(plan, axis);
    struct motion_cursor cursor = { 0 };

    if (track == NULL || rate == 0)
        return false;
    for (size_t i = 0; i < count; i++) {
        struct motion_sample sample;
        struct motion_state state;
        int64_t t_ns = INT64_MAX;
        (void)motion_fixed_muldiv((int64_t)(first + i), 1000000000, rate,
                                  &t_ns);
        const int64_t t = t_ns * MOTION_FIXED_NS_Q12;
        motion_track_sample(track, &cursor, t, &sample);
        motion_track_state(track, t, &state);
        out[4 * i] = sample.pos_q32;
        out[4 * i + 1] = sample.vel_q32;
        out[4 * i + 2] = sample.acc_q32;
        out[4 * i + 3] = state.jerk_q32;
    }
    return true;
}

/* --- in space ---------------------------------------------------------------- */

static int64_t numbers_moment(double from_s, double to_s, uint32_t i,
                              uint32_t count)
{
    return studio_time(count < 2 ? from_s
                                 : from_s + (to_s - from_s) / (count - 1) * i);
}

static void numbers_vector(double out[3], const struct plan_jet_vec *v,
                           double by)
{
    for (unsigned k = 0; k < 3; k++)
        out[k] = v->x[k].p * by;
}

static double numbers_lens(const struct motion_track *track,
                           const struct plan_rig_axis *axis, int64_t t)
{
    return axis->is_given ? plan_rig_track(&track[axis->axis], t, 1).p : NAN;
}

void studio_pose(const struct plan_rig *rig, const struct motion_track *track,
                 int64_t t_ns_q12, double out[STUDIO_POSE])
{
    struct plan_rig_camera camera;

    plan_rig_camera_at(rig, track, t_ns_q12, &camera);
    numbers_vector(&out[0], &camera.pupil, 1e-3);
    numbers_vector(&out[3], &camera.frame.forward, 1);
    numbers_vector(&out[6], &camera.frame.left, 1);
    numbers_vector(&out[9], &camera.frame.up, 1);
    out[12] = numbers_lens(track, &rig->lens[PLAN_LENS_ZOOM], t_ns_q12);
    out[13] = numbers_lens(track, &rig->lens[PLAN_LENS_FOCUS], t_ns_q12) / 1000;
    out[14] = 0;
    out[15] = NAN;
}

static double numbers_distance(const double a[3], const struct plan_jet_vec *b)
{
    double sum = 0;

    for (unsigned k = 0; k < 3; k++)
        sum += (b->x[k].p / 1000 - a[k]) * (b->x[k].p / 1000 - a[k]);
    return sqrt(sum);
}

STUDIO_EXPORT bool studio_plan_poses(const struct studio_plan *plan,
                                     double from_s, double to_s, uint32_t count,
                                     double *out)
{
    struct plan_rig rig;

    if (plan->status != STATUS_OK || !job_camera_rig(&plan->job, &rig))
        return false;
    for (uint32_t i = 0; i < count; i++, out += STUDIO_POSE) {
        const int64_t t = numbers_moment(from_s, to_s, i, count);
        struct plan_jet_vec subject;
        studio_pose(&rig, plan->job.track, t, out);
        out[14] = job_camera_subject(&plan->job, t, &subject);
        out[15] = out[14] > 0 ? numbers_distance(out, &subject) : NAN;
    }
    return true;
}

STUDIO_EXPORT bool studio_plan_subject(const struct studio_plan *plan,
                                       double from_s, double to_s,
                                       uint32_t count, double *out)
{
    if (plan->status != STATUS_OK)
        return false;
    for (uint32_t i = 0; i < count; i++) {
        struct plan_jet_vec subject;
        if (!job_camera_subject(
                &plan->job, numbers_moment(from_s, to_s, i, count), &subject))
            return false;
        numbers_vector(out + (size_t)STUDIO_SUBJECT * i, &subject, 1e-3);
    }
    return true;
}
