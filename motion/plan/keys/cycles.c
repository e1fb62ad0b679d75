/* motion/plan/keys/cycles.c - keys repeated before the first and after the last one.
 * See move.h.
 *
 * An axis that is bezier throughout repeats its curve (motion/curve/fcurve.h).
 * Any other has its keys written out, lap by lap, and the curve goes through
 * all of them: where one lap goes over to the next, what is continuous at a key
 * is continuous there, and the ends of all of it have the axis's end rules.  A
 * lap that goes back in time (mirror) has its keys in reverse, velocities
 * negated. */
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/keys/move_internal.h"

struct cycles {
    const struct move *move;
    const struct plan_axis *axis; /* as it was written */
    uint32_t last;                /* its last key */
    int64_t first_ns_q12, period_ns_q12;
    int64_t from, to; /* laps; the keys as written are lap 0 */
    struct plan_key *key;
    uint32_t *number;
    uint32_t count;
};

bool move_has_cycles(const struct plan_axis *axis)
{
    const struct plan_bezier *bezier = &axis->bezier;

    return bezier->before.mode != MOTION_FCURVE_ONCE ||
           bezier->after.mode != MOTION_FCURVE_ONCE || bezier->has_end;
}

/* Only a curve in which each key has a place of its own can be written out. */
static int cycles_check_curve(const struct move *move, uint32_t i)
{
    const enum plan_curve curve = move_curve_at(move->axis, i);

    if (curve == PLAN_CURVE_BEZIER)
        return move_fail_axis(move, MOTION_E_ARG,
                              "cycles and until need curve bezier on all "
                              "spans, or on none");
    if (curve == PLAN_CURVE_LAGRANGE)
        return move_fail_axis(move, MOTION_E_ARG,
                              "lagrange has neither cycles nor until, as it is "
                              "one polynomial through all keys, expected "
                              "another curve such as c2");
    return MOTION_OK;
}

int move_cycles_check(const struct move *move)
{
    const struct plan_axis *axis = move->axis;
    const struct plan_bezier *bezier = &axis->bezier;
    int rc = MOTION_OK;

    if (bezier->after.mode != MOTION_FCURVE_ONCE && bezier->after.count == 0 &&
        !bezier->has_end)
        return move_fail_axis(move, MOTION_E_ARG,
                              "its cycles never end, expected after_count "
                              "or until");
    if (bezier->has_end && bezier->end_ns_q12 <= 0)
        return move_fail_axis(move, MOTION_E_ORDER,
                              "until is %.9g s, which is not after the start",
                              move_seconds(bezier->end_ns_q12));
    if (move->is_bezier)
        return MOTION_OK;
    if (axis->key_count < 2)
        return move_fail_axis(move, MOTION_E_ARG,
                              "cycles and until need two keys or more");
    for (uint32_t i = 0;
         rc == MOTION_OK && !move_has_profile(axis) && i + 1 < axis->key_count;
         i++)
        rc = cycles_check_curve(move, i);
    return rc;
}

/* --- one key of one lap ---------------------------------------------------- */

static uint8_t cycles_mode(const struct cycles *self, int64_t lap)
{
    return lap < 0   ? self->axis->bezier.before.mode
           : lap > 0 ? self->axis->bezier.after.mode
                     : MOTION_FCURVE_ONCE;
}

static bool cycles_is_back(const struct cycles *self, int64_t lap)
{
    return cycles_mode(self, lap) == MOTION_FCURVE_MIRROR && lap % 2 != 0;
}

/* As written, of the i-th key in time. */
static uint32_t cycles_source(const struct cycles *self, int64_t lap,
                              uint32_t i)
{
    return cycles_is_back(self, lap) ? self->last - i : i;
}

/* Parameters of a span that is gone through backwards. */
static union plan_shape cycles_mirror(const struct plan_curve_rules *rules,
                                      union plan_shape shape)
{
    union plan_shape mirrored = shape;

    if (rules->shape)
        mirrored.tcb.bias_q32 = -shape.tcb.bias_q32;
    if (rules->ease) {
        mirrored.ease.k1_q32 = MOTION_FIXED_ONE_Q32 - shape.ease.k2_q32;
        mirrored.ease.k2_q32 = MOTION_FIXED_ONE_Q32 - shape.ease.k1_q32;
    }
    return mirrored;
}

static int cycles_position(const struct cycles *self, int64_t lap,
                           int64_t *pos_q32)
{
    const struct plan_key *key = self->axis->key;
    int64_t rise = key[self->last].key.pos_q32, off;

    if (cycles_mode(self, lap) != MOTION_FCURVE_REPEAT_OFFSET)
        return MOTION_OK;
    if (motion_fixed_sub(rise, key[0].key.pos_q32, &rise) < 0 ||
        motion_fixed_muldiv(rise, lap, 1, &off) < 0 ||
        motion_fixed_add(*pos_q32, off, pos_q32) < 0)
        return MOTION_E_RANGE;
    return MOTION_OK;
}

/* Its curve and parameters are those of the span after it in time. */
static int cycles_key(const struct cycles *self, int64_t lap, uint32_t i,
                      struct plan_key *key)
{
    const uint32_t source = cycles_source(self, lap, i);
    const bool back = cycles_is_back(self, lap);
    const uint32_t span = back && source > 0 ? source - 1 : source;
    const int64_t within =
        self->axis->key[source].key.t_ns_q12 - self->first_ns_q12;

    *key = self->axis->key[source];
    key->has_curve = true;
    key->curve = move_curve_at(self->axis, span);
    key->has_shape = self->axis->key[span].has_shape;
    key->shape = self->axis->key[span].shape;
    key->key.t_ns_q12 = self->first_ns_q12 + lap * self->period_ns_q12 +
                        (back ? self->period_ns_q12 - within : within);
    if (back) {
        const struct plan_curve_rules *rules = plan_curve_rules(key->curve);

        key->key.vel = motion_real_neg(key->key.vel);
        key->has_shape = key->has_shape || rules->ease || rules->shape;
        key->shape = cycles_mirror(rules, move_shape_at(self->axis, span));
    }
    return cycles_position(self, lap, &key->key.pos_q32);
}

/* --- all of them ----------------------------------------------------------- */

/* `turns`: the next lap is gone through the other way, which negates
 * velocities. */
static int cycles_fail_meet(const struct cycles *self, uint32_t number,
                            const char *what, bool turns)
{
    if (turns)
        return move_fail_key(self->move, MOTION_E_ARG, number,
                             "its %s is not zero, but a mirrored cycle turns "
                             "round here",
                             what);
    return move_fail_key(self->move, MOTION_E_ARG, number,
                         "where cycles meet, the first and the last key are "
                         "one, but each gives another %s",
                         what);
}

static bool cycles_differs(bool has_a, struct motion_real a, bool has_b,
                           struct motion_real b)
{
    return has_a && has_b && motion_real_cmp(a, b) != 0;
}

/* The last key of a lap is the first of the next: what either gives holds. */
static int cycles_meet(const struct cycles *self, uint32_t number, bool turns,
                       const struct plan_key *begin)
{
    struct plan_key *end = &self->key[self->count - 1];
    struct motion_key key = begin->key;

    if (end->key.pos_q32 != key.pos_q32)
        return move_fail_key(self->move, MOTION_E_DISCONTINUITY, number,
                             "a cycle would jump here, as it does not end "
                             "where it starts; repeat-offset would not");
    if (cycles_differs(end->key.has_vel, end->key.vel, key.has_vel, key.vel))
        return cycles_fail_meet(self, number, "velocity", turns);
    if (cycles_differs(end->key.has_acc, end->key.acc, key.has_acc, key.acc))
        return cycles_fail_meet(self, number, "acceleration", turns);
    if (end->key.has_vel && !key.has_vel)
        key.has_vel = true, key.vel = end->key.vel;
    if (end->key.has_acc && !key.has_acc)
        key.has_acc = true, key.acc = end->key.acc;
    *end = *begin;
    end->key = key;
    self->number[self->count - 1] = number;
    return MOTION_OK;
}

static int cycles_add(struct cycles *self, int64_t lap, uint32_t i)
{
    const uint32_t number = cycles_source(self, lap, i);
    struct plan_key key;

    if (cycles_key(self, lap, i, &key) < 0)
        return move_fail_key(self->move, MOTION_E_RANGE, number,
                             "its cycles leave the range of positions");
    if (key.key.t_ns_q12 < 0)
        return MOTION_OK;
    if (i == 0 && self->count > 0)
        return cycles_meet(
            self, number,
            cycles_is_back(self, lap) != cycles_is_back(self, lap - 1), &key);
    self->key[self->count] = key;
    self->number[self->count++] = number;
    return MOTION_OK;
}

/* What is after `until` goes; it is a key, as only handles can be cut. */
static int cycles_cut(struct cycles *self)
{
    const struct plan_bezier *bezier = &self->axis->bezier;
    uint32_t count = self->count;

    if (count < 2 ||
        (self->first_ns_q12 + self->from * self->period_ns_q12 < 0 &&
         self->key[0].key.t_ns_q12 > 0))
        return move_fail_axis(self->move, MOTION_E_ARG,
                              "the move starts between two keys of its "
                              "cycles, expected a key at 0 s, or curve bezier "
                              "on all spans");
    while (bezier->has_end && count > 0 &&
           self->key[count - 1].key.t_ns_q12 > bezier->end_ns_q12)
        count--;
    if (bezier->has_end &&
        (count < 2 || self->key[count - 1].key.t_ns_q12 != bezier->end_ns_q12))
        return move_fail_axis(
            self->move, MOTION_E_ARG,
            "until is %.9g s, where there is no key, expected the time of one "
            "such as %.9g s, or curve bezier on all spans",
            move_seconds(bezier->end_ns_q12),
            move_seconds(self->key[count > 1 ? count - 1 : 1].key.t_ns_q12));
    self->count = count;
    return MOTION_OK;
}

/* How many laps there are before and after the keys as written. */
static void cycles_laps(struct cycles *self)
{
    const struct plan_bezier *bezier = &self->axis->bezier;
    const int64_t last = self->first_ns_q12 + self->period_ns_q12;
    const int64_t before =
        (self->first_ns_q12 + self->period_ns_q12 - 1) / self->period_ns_q12;

    if (bezier->before.mode != MOTION_FCURVE_ONCE)
        self->from = bezier->before.count > 0 && bezier->before.count < before
                         ? -(int64_t)bezier->before.count
                         : -before;
    if (bezier->after.mode == MOTION_FCURVE_ONCE)
        return;
    self->to = bezier->after.count;
    if (bezier->has_end) {
        const int64_t reach =
            bezier->end_ns_q12 > last
                ? (bezier->end_ns_q12 - last - 1) / self->period_ns_q12 + 1
                : 0;
        self->to = self->to > 0 && self->to < reach ? self->to : reach;
    }
}

static int cycles_capacity(struct cycles *self)
{
    const int64_t laps = self->to - self->from + 1;
    const int64_t most =
        (MOTION_TRACK_MAX_NS_Q12 - self->first_ns_q12) / self->period_ns_q12;

    if (self->to >= most) {
        (void)move_fail_axis(self->move, MOTION_E_RANGE,
                             "its cycles end after %.9g s, the longest that a "
                             "move may be",
                             move_seconds(MOTION_TRACK_MAX_NS_Q12));
        return MOTION_E_RANGE;
    }
    if (laps > PLAN_KEYS_MAX / self->last) {
        (void)move_fail_axis(self->move, MOTION_E_FULL,
                             "its cycles take more than the %u keys allowed",
                             PLAN_KEYS_MAX);
        return MOTION_E_FULL;
    }
    const size_t capacity = (size_t)laps * self->last + 1;
    self->key = calloc(capacity, sizeof *self->key);
    self->number = calloc(capacity, sizeof *self->number);
    if (self->key != NULL && self->number != NULL)
        return MOTION_OK;
    (void)move_fail_axis(self->move, MOTION_E_FULL, "no memory for %zu keys",
                         capacity);
    return MOTION_E_FULL;
}

int move_cycles_write(const struct move *move, struct plan_axis *out,
                      uint32_t **number)
{
    const struct plan_axis *axis = move->axis;
    const uint32_t last = axis->key_count - 1;
    const int64_t first = axis->key[0].key.t_ns_q12;
    struct cycles self = {
        .move = move,
        .axis = axis,
        .last = last,
        .first_ns_q12 = first,
        .period_ns_q12 = axis->key[last].key.t_ns_q12 - first,
    };
    int rc;

    cycles_laps(&self);
    rc = cycles_capacity(&self);
    for (int64_t lap = self.from; rc == MOTION_OK && lap <= self.to; lap++)
        for (uint32_t i = 0; rc == MOTION_OK && i <= last; i++)
            rc = cycles_add(&self, lap, i);
    if (rc == MOTION_OK)
        rc = cycles_cut(&self);
    *out = *axis;
    out->bezier = (struct plan_bezier){ .key = NULL };
    out->key = self.key;
    out->key_count = self.count;
    *number = self.number;
    return rc;
}
