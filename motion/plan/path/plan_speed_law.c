/* motion/plan/path/plan_speed_law.c - see plan_speed_law.h.
 *
 * The parts after the one that takes the rest are first put on a track of their
 * own, to see how far they go. */
#include "motion/plan/path/plan_speed_law.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

static const enum motion_speed_kind law_ramp[] = {
#define LAW_RAMP(name, spelling, kind) [name] = kind,
    PLAN_RAMP_LIST(LAW_RAMP)
#undef LAW_RAMP
};

struct law {
    const struct plan_part *part;
    uint32_t parts;
    struct motion_real length, error_bound;
    struct plan_error *error;
};

static double law_double(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

static double law_seconds(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12;
}

struct motion_real plan_speed_law_distance(const struct plan_distance *distance,
                                           struct motion_real length)
{
    const struct motion_real value = motion_real_from_q(distance->q32, 32);

    return distance->is_ratio ? motion_real_mul(value, length) : value;
}

/* The speed at which a track ends. */
static struct motion_real law_speed(const struct motion_track *law)
{
    const struct motion_segment *last;

    if (law->count == 0)
        return motion_real_zero();
    last = &law->segment[law->count - 1];
    return motion_bake_segment(last, last->dur_ns_q12).vel;
}

static int law_fail(const struct law *self, uint32_t i, int code,
                    const char *what)
{
    return plan_error_set(self->error, code, self->part[i].place,
                          "part %u of the speed law %s", (unsigned)i + 1, what);
}

/* --- one part ------------------------------------------------------------- */

/* A part on its way to motion_speed_append, and what it lends. */
struct law_part {
    struct motion_speed_part speed;
    struct motion_speed_point line[2];
    struct motion_track drawn;
};

static int law_drawn(const struct law *self, uint32_t i,
                     struct motion_real length, struct motion_track *drawn)
{
    struct plan_axis axis = *self->part[i].drawn;
    struct plan_error *error = self->error;
    int err = MOTION_OK;

    axis.key = malloc(axis.key_count * sizeof *axis.key);
    if (axis.key == NULL)
        return law_fail(self, i, MOTION_E_FULL, "has no memory for its keys");
    err = plan_bezier_copy(&axis.bezier, axis.key_count, length);
    for (uint32_t k = 0; k < axis.key_count && err == MOTION_OK; k++) {
        struct motion_key *key = &axis.key[k].key;
        axis.key[k] = self->part[i].drawn->key[k];
        key->vel = motion_real_mul(key->vel, length);
        key->acc = motion_real_mul(key->acc, length);
        err = motion_real_round(
            motion_real_mul(motion_real_from_q(key->pos_q32, 32), length), 32,
            &key->pos_q32);
    }
    if (err == MOTION_OK)
        err = plan_axis_track(&axis, drawn, error);
    else
        err = law_fail(self, i, err, "is too long");
    plan_axis_free(&axis);
    error->axis = PLAN_AXES_MAX;
    return err;
}

/* Constant speed for a length: two points of speed, which motion_speed_append
 * scales so that the length is met exactly; by the rounding of the time. */
static int law_constant(const struct law *self, uint32_t i,
                        struct motion_real from, struct motion_real length,
                        struct law_part *part)
{
    struct motion_speed_part *speed = &part->speed;
    int64_t dur = self->part[i].dur_ns_q12;

    speed->kind = MOTION_SPEED_VEL_POINTS;
    if (self->part[i].extent != PLAN_EXTENT_TIMED) {
        if (motion_real_sign(from) <= 0)
            return law_fail(self, i, MOTION_E_ARG,
                            "stands still, so no length comes about");
        if (motion_real_round(
                motion_real_mul(motion_real_div(length, from),
                                motion_real_int(MOTION_FIXED_S_Q12)),
                0, &dur) < 0 ||
            dur < 1)
            return law_fail(self, i, MOTION_E_RANGE,
                            "would take too long or no time");
    }
    part->line[0] = (struct motion_speed_point){ 0, from };
    part->line[1] = (struct motion_speed_point){ dur, from };
    speed->point = part->line;
    speed->points = 2;
    return MOTION_OK;
}

static int law_prepare(const struct law *self, uint32_t i,
                       struct motion_real from, struct motion_real length,
                       struct law_part *out)
{
    static const enum motion_speed_kind whole[] = {
        [PLAN_SPEED_LAW_CUBIC] = MOTION_SPEED_CUBIC,
        [PLAN_SPEED_LAW_QUINTIC] = MOTION_SPEED_QUINTIC,
        [PLAN_SPEED_LAW_SINE] = MOTION_SPEED_SINE,
        [PLAN_SPEED_LAW_PARABOLIC] = MOTION_SPEED_PARABOLIC,
        [PLAN_SPEED_LAW_SCURVE] = MOTION_SPEED_SCURVE,
    };
    const struct plan_part *part = &self->part[i];
    struct motion_speed_part *speed = &out->speed;

    *speed = (struct motion_speed_part){
        .dur_ns_q12 = part->dur_ns_q12,
        .k1_q32 = part->k1_q32,
        .k2_q32 = part->k2_q32,
        .from = part->has_from ? motion_real_from_q(part->from_q32, 32) : from,
        .to = motion_real_from_q(part->to_q32, 32),
        .point = part->point,
        .points = part->points,
        .drawn = &out->drawn,
    };
    if (part->extent != PLAN_EXTENT_TIMED &&
        (motion_real_round(length, 32, &speed->length_q32) < 0 ||
         speed->length_q32 <= 0))
        return law_fail(self, i, MOTION_E_ARG, "has no length left to cover");
    switch (part->law) {
    case PLAN_SPEED_LAW_RAMP:
        speed->kind = law_ramp[part->shape];
        return MOTION_OK;
    case PLAN_SPEED_LAW_PAUSE:
        speed->kind = MOTION_SPEED_RAMP_LINE;
        speed->from = speed->to = motion_real_zero();
        return MOTION_OK;
    case PLAN_SPEED_LAW_CONSTANT:
        return law_constant(self, i, speed->from, length, out);
    case PLAN_SPEED_LAW_ACCELERATION:
        speed->kind = MOTION_SPEED_ACC_POINTS;
        return MOTION_OK;
    case PLAN_SPEED_LAW_VELOCITY:
        speed->kind = MOTION_SPEED_VEL_POINTS;
        return MOTION_OK;
    case PLAN_SPEED_LAW_DRAWN:
        speed->kind = MOTION_SPEED_DRAWN;
        return law_drawn(self, i, length, &out->drawn);
    default:
        speed->kind = whole[part->law];
        return MOTION_OK;
    }
}

static int law_refuse(const struct law *self, uint32_t i, int err,
                      struct motion_real before, struct motion_real after)
{
    if (err == MOTION_E_DISCONTINUITY)
        return plan_error_set(self->error, err, self->part[i].place,
                              "part %u of the speed law starts at %.9g/s, but "
                              "the part before it ends at %.9g/s",
                              (unsigned)i + 1, law_double(after),
                              law_double(before));
    if (err == MOTION_E_ORDER)
        return law_fail(self, i, err, "goes back somewhere");
    if (self->part[i].dur_ns_q12 > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return plan_error_set(self->error, err, self->part[i].place,
                              "part %u of the speed law takes %.6g s, expected "
                              "at most %.6g s: put it together from several",
                              (unsigned)i + 1,
                              law_seconds(self->part[i].dur_ns_q12),
                              law_seconds(MOTION_TRACK_SEGMENT_MAX_NS_Q12));
    return law_fail(self, i, err, motion_err_text(err));
}

/* The speed at which a part starts. */
static struct motion_real law_start(const struct motion_speed_part *speed)
{
    if (speed->kind <= MOTION_SPEED_SCURVE)
        return motion_real_zero();
    if (speed->kind == MOTION_SPEED_VEL_POINTS)
        return speed->point[0].value;
    if (speed->kind == MOTION_SPEED_DRAWN)
        return motion_bake_segment(&speed->drawn->segment[0], 0).vel;
    return speed->from;
}

/* Append part i, whose length is `length` unless its time says it. */
static int law_append(struct law *self, uint32_t i, struct motion_real length,
                      struct motion_track *law)
{
    const struct motion_real before = law_speed(law);
    struct motion_speed_report report;
    struct law_part part = { .drawn = { .segment = NULL } };
    int err = law_prepare(self, i, before, length, &part);

    if (err == MOTION_OK) {
        do
            err = motion_speed_append(law, &part.speed, 1, &report);
        while (err == MOTION_E_FULL && plan_track_grow(law) == MOTION_OK);
        if (err == MOTION_OK)
            self->error_bound =
                motion_real_add(self->error_bound, report.error);
        else
            err = law_refuse(self, i, err, before, law_start(&part.speed));
    }
    plan_track_free(&part.drawn);
    return err;
}

/* Parts first .. end - 1, none of which takes the rest. */
static int law_append_all(struct law *self, uint32_t first, uint32_t end,
                          struct motion_track *law)
{
    int err = MOTION_OK;

    for (uint32_t i = first; i < end && err == MOTION_OK; i++)
        err = law_append(
            self, i,
            plan_speed_law_distance(&self->part[i].length, self->length), law);
    return err;
}

/* --- all of them ---------------------------------------------------------- */

/* The part that takes the rest; `parts` when there is none. */
static int law_find_rest(const struct law *self, uint32_t *rest)
{
    *rest = self->parts;
    for (uint32_t i = 0; i < self->parts; i++) {
        if (self->part[i].extent != PLAN_EXTENT_REST)
            continue;
        if (*rest != self->parts)
            return plan_error_set(
                self->error, MOTION_E_ARG, self->part[i].place,
                "parts %u and %u of the speed law both take the rest of the "
                "length, expected one",
                (unsigned)*rest + 1, (unsigned)i + 1);
        *rest = i;
    }
    return MOTION_OK;
}

static bool law_is_fast_after(const struct plan_part *part)
{
    return part->law == PLAN_SPEED_LAW_CONSTANT;
}

/* How far the parts after `rest` go. */
static int law_after(struct law *self, uint32_t rest,
                     const struct motion_track *before,
                     struct motion_real *length)
{
    const struct motion_real bound = self->error_bound;
    const struct plan_part *part = &self->part[rest];
    struct motion_track after;
    int err = MOTION_OK;

    plan_track_init(&after, 0);
    if (law_is_fast_after(part)) {
        /* a moment at its speed, so that the next part can read it */
        const struct motion_real speed =
            part->has_from ? motion_real_from_q(part->from_q32, 32)
                           : law_speed(before);
        const struct motion_speed_part moment = {
            .kind = MOTION_SPEED_RAMP_LINE,
            .dur_ns_q12 = MOTION_FIXED_S_Q12,
            .from = speed,
            .to = speed,
        };
        if (plan_track_grow(&after) < 0)
            err = law_fail(self, rest, MOTION_E_FULL, "has no memory");
        else if ((err = motion_speed_append(&after, &moment, 1, NULL)) < 0)
            err = law_refuse(self, rest, err, speed, speed);
    }
    const struct motion_real start =
        after.count > 0 ? motion_bake_end(&after) : motion_real_zero();
    if (err == MOTION_OK)
        err = law_append_all(self, rest + 1, self->parts, &after);
    if (err == MOTION_OK)
        *length = after.count > 0
                      ? motion_real_sub(motion_bake_end(&after), start)
                      : motion_real_zero();
    self->error_bound = bound;
    plan_track_free(&after);
    return err;
}

static int law_rest(struct law *self, uint32_t rest, struct motion_track *law)
{
    struct motion_real after = motion_real_zero(), left;
    int err = law_append_all(self, 0, rest, law);

    if (err == MOTION_OK && rest < self->parts)
        err = law_after(self, rest, law, &after);
    if (err < 0 || rest == self->parts)
        return err;
    left = motion_real_sub(motion_real_sub(self->length, after),
                           law->count > 0 ? motion_bake_end(law)
                                          : motion_real_zero());
    if (motion_real_sign(left) <= 0)
        return plan_error_set(
            self->error, MOTION_E_ARG, self->part[rest].place,
            "the other parts of the speed law cover %.9g already, and the path "
            "is %.9g long: nothing is left for part %u",
            law_double(motion_real_sub(self->length, left)),
            law_double(self->length), (unsigned)rest + 1);
    err = law_append(self, rest, left, law);
    return err < 0 ? err : law_append_all(self, rest + 1, self->parts, law);
}

/* As motion_path_init asks for. */
static int law_check_end(const struct law *self, const struct motion_track *law)
{
    const struct motion_real end = motion_bake_end(law);
    const struct motion_real off =
        motion_real_abs(motion_real_sub(end, self->length));

    if (motion_real_cmp(
            off, motion_real_add(motion_real_from_q(1, 30),
                                 motion_real_scale(self->length, -48))) <= 0)
        return MOTION_OK;
    return plan_error_set(
        self->error, MOTION_E_ARG, self->part[self->parts - 1].place,
        "the speed law covers %.9g of the path's %.9g, expected a part without "
        "a time or length of its own, which takes the rest",
        law_double(end), law_double(self->length));
}

int plan_speed_law_track(const struct plan_part *part, uint32_t parts,
                         struct motion_real length, struct motion_track *law,
                         struct motion_real *error_bound,
                         struct plan_error *error)
{
    struct law self = { part, parts, length, motion_real_zero(), error };
    uint32_t rest = 0;
    int err;

    plan_track_init(law, 0);
    if (parts == 0)
        return plan_error_set(error, MOTION_E_EMPTY,
                              (struct plan_place){ 0, 0 },
                              "the speed law has no part");
    err = law_find_rest(&self, &rest);
    if (err == MOTION_OK)
        err = law_rest(&self, rest, law);
    if (err == MOTION_OK)
        err = law_check_end(&self, law);
    if (err < 0)
        plan_track_free(law);
    *error_bound = self.error_bound;
    return err;
}

void plan_speed_law_free(struct plan_part *part, uint32_t parts)
{
    for (uint32_t i = 0; i < parts; i++) {
        free(part[i].point);
        if (part[i].drawn != NULL)
            plan_axis_free(part[i].drawn);
        free(part[i].drawn);
    }
    free(part);
}
