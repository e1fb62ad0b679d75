/* firmware/host/exchange/import_odd.c - see import_odd.h. */
#include "firmware/host/exchange/import_odd.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/fixed.h"

#define ODD_LEAST    6  /* rows, for a cubic */
#define ODD_FEW      16 /* rows: with fewer one disturbs half of them */
#define ODD_CALM     2  /* of few: steps that the limits explain, at least */
#define ODD_MOST     64 /* odd rows that are looked for */
#define ODD_LIMITS   4  /* times what the limits explain */
#define ODD_OTHERS   12 /* times what half of the rows exceed */
#define ODD_AROUND   6  /* rows on either side that one row disturbs */
#define ODD_EXPONENT 15

struct odd {
    const struct rig_axis *on;
    const struct plan_axis *axis;
    uint32_t count;
    double *t_s, *p, *off; /* of each row; off -1: it is told already */
    double typical;
};

/* ---- foretelling ---- */

/* The cubic through four other places, at the time of one; *trust is how much of an
 * error in them is in it. */
static double odd_foretell(const struct odd *self, const uint32_t other[4],
                           uint32_t at, double *trust)
{
    double sum = 0;

    *trust = 0;
    for (unsigned i = 0; i < 4; i++) {
        double share = 1;
        for (unsigned k = 0; k < 4; k++)
            if (k != i)
                share *= (self->t_s[at] - self->t_s[other[k]]) /
                         (self->t_s[other[i]] - self->t_s[other[k]]);
        sum += share * self->p[other[i]];
        *trust += share * share;
    }
    *trust = sqrt(1 + *trust);
    return sum;
}

/* Four others nearest to a place, none of them `skip`; two on either side where
 * there are. */
static void odd_others(const struct odd *self, uint32_t at, uint32_t skip,
                       uint32_t other[4])
{
    uint32_t left = at, right = at;
    unsigned found = 0;

    while (found < 4) {
        const bool is_left =
            left > 0 && (at - left <= right - at || right + 1 >= self->count);
        const uint32_t next = is_left ? --left : ++right;
        if (next != skip)
            other[found++] = next;
    }
}

/* How far a place is from what is foretold, for the trust in that. */
static double odd_off(const struct odd *self, uint32_t at, uint32_t skip)
{
    uint32_t other[4];
    double trust;

    odd_others(self, at, skip, other);
    const double foretold = odd_foretell(self, other, at, &trust);
    return fabs(self->p[at] - foretold) / trust;
}

/* How far from its foretelling the limits let a row be.  A fourth difference is at
 * most two jerks, or four accelerations; a sixth of it is the error. */
static double odd_explained(const struct odd *self, uint32_t at)
{
    const struct plan_limit *limit = &self->on->limit;
    const uint32_t from = at > 0 ? at - 1 : 0;
    const uint32_t to = at + 1 < self->count ? at + 1 : at;
    const double h = (self->t_s[to] - self->t_s[from]) / (double)(to - from);
    const double jerk = number_double(limit->jerk_q32, 32);
    const double by_acc = number_double(limit->acc_q32, 32) * h * h * 4 / 6;

    return jerk > 0 ? fmin(by_acc, jerk * h * h * h / 3) : by_acc;
}

static int odd_compare(const void *a, const void *b)
{
    const double one = *(const double *)a, other = *(const double *)b;

    return (one > other) - (one < other);
}

static double odd_median(const double off[], uint32_t count)
{
    double *sorted = memory_new(count, sizeof *sorted);

    memcpy(sorted, off, count * sizeof *sorted);
    qsort(sorted, count, sizeof *sorted, odd_compare);
    const double median = sorted[count / 2];
    memory_free(sorted);
    return median;
}

/* ---- which row ---- */

static uint32_t odd_low(uint32_t at)
{
    return at < ODD_AROUND ? 0 : at - ODD_AROUND;
}

static uint32_t odd_high(const struct odd *self, uint32_t at)
{
    return at + ODD_AROUND < self->count ? at + ODD_AROUND : self->count - 1;
}

/* The furthest off around a place without one row. */
static double odd_left(const struct odd *self, uint32_t at, uint32_t skip)
{
    double most = 0;

    for (uint32_t i = odd_low(at); i <= odd_high(self, at); i++)
        if (i != skip)
            most = fmax(most, odd_off(self, i, skip));
    return most;
}

/* A row that is off puts its neighbours off as well: the culprit is the one without
 * which the least is left. */
static uint32_t odd_culprit(const struct odd *self, uint32_t at)
{
    uint32_t best = at;
    double least = odd_left(self, at, at);

    for (uint32_t i = at < 2 ? 0 : at - 2; i <= at + 2 && i < self->count;
         i++) {
        const double left = odd_left(self, at, i);
        if (left < least * 0.999) {
            least = left;
            best = i;
        }
    }
    return best;
}

/* The furthest off, if that is too far; else the count. */
static uint32_t odd_furthest(const struct odd *self)
{
    uint32_t worst = self->count;
    double most = 0;

    for (uint32_t i = 0; i < self->count; i++)
        if (self->off[i] > most && self->off[i] > ODD_OTHERS * self->typical &&
            self->off[i] > ODD_LIMITS * odd_explained(self, i)) {
            most = self->off[i];
            worst = i;
        }
    return worst;
}

/* ---- what is odd about it ---- */

/* The step to a place from the one before. */
static double odd_step(const struct odd *self, uint32_t at)
{
    return at > 0 && at < self->count ? self->p[at] - self->p[at - 1] : 0;
}

static bool odd_is_near(double a, double b, double share)
{
    return fabs(a - b) <= share * fabs(b);
}

static bool odd_is_turn(const struct odd *self, uint32_t at)
{
    const double turn = number_double(import_turn_q32(self->on->unit), 32);

    return turn > 0 && odd_is_near(fabs(odd_step(self, at)), turn, 0.2);
}

static bool odd_is_twice(const struct odd *self, uint32_t at)
{
    return at > 0 && at + 1 < self->count && odd_step(self, at) == 0 &&
           odd_step(self, at + 1) != 0 &&
           (at < 2 || odd_step(self, at - 1) != 0);
}

/* The step to a place is that of both around it together, which are alike. */
static bool odd_is_missing(const struct odd *self, uint32_t at)
{
    const double before = odd_step(self, at - 1),
                 after = odd_step(self, at + 1);

    return at >= 2 && at + 2 < self->count && odd_is_near(before, after, 0.5) &&
           odd_is_near(odd_step(self, at), before + after, 0.3);
}

/* All that follows is moved by as much: the steps around are alike. */
static bool odd_is_step(const struct odd *self, uint32_t at)
{
    const double before = odd_step(self, at - 1),
                 after = odd_step(self, at + 1);
    const double jump = odd_step(self, at) - (before + after) / 2;

    return at >= 2 && at + 2 < self->count &&
           fabs(before - after) < fabs(jump) / 3;
}

/* The power of ten that brings a position to where it is foretold; 0: none. */
static int odd_exponent(const struct odd *self, uint32_t at)
{
    const double near =
        fmax(self->typical * ODD_OTHERS, ODD_LIMITS * odd_explained(self, at));
    uint32_t other[4];
    double tens = 10, least = near, trust;
    int exponent = 0;

    odd_others(self, at, at, other);
    const double expected = odd_foretell(self, other, at, &trust);
    for (int i = 1; i <= ODD_EXPONENT; i++, tens *= 10)
        for (int sign = -1; sign <= 1; sign += 2) {
            const double value =
                sign < 0 ? self->p[at] / tens : self->p[at] * tens;
            if (fabs(value - expected) >= least)
                continue;
            least = fabs(value - expected);
            exponent = sign * i;
        }
    return exponent;
}

/* A jump is between two rows: without one of them there is still most of it. */
static bool odd_is_jump(const struct odd *self, uint32_t at)
{
    return odd_left(self, at, at) > odd_left(self, at, UINT32_MAX) / 4;
}

static enum import_odd_kind odd_kind(const struct odd *self, uint32_t at,
                                     bool is_jump)
{
    return odd_is_turn(self, at) && !odd_is_turn(self, at + 1) ? IMPORT_ODD_TURN
           : odd_is_twice(self, at)              ? IMPORT_ODD_TWICE
           : is_jump && odd_is_missing(self, at) ? IMPORT_ODD_MISSING
           : is_jump && odd_is_step(self, at)    ? IMPORT_ODD_STEP
                                                 : IMPORT_ODD_OFF;
}

static void odd_judge(const struct odd *self, uint32_t at,
                      struct import_odd *odd)
{
    const bool is_jump = odd_is_jump(self, at);

    *odd = (struct import_odd){ .kind = IMPORT_ODD_OFF };
    for (uint32_t i = at > 0 ? at - 1 : 0;
         odd->kind == IMPORT_ODD_OFF && i <= at + 1; i++) {
        odd->kind = odd_kind(self, i, is_jump);
        odd->row = i;
    }
    if (odd->kind != IMPORT_ODD_OFF)
        return;
    odd->row = at;
    odd->exponent = odd_exponent(self, at);
    if (odd->exponent != 0)
        odd->kind = IMPORT_ODD_EXPONENT;
}

/* ---- of few rows ---- */

static bool odd_is_fast(const struct odd *self, uint32_t from, uint32_t to,
                        double step)
{
    const double vel = number_double(self->on->limit.vel_q32, 32);

    return fabs(step) > ODD_LIMITS * vel * (self->t_s[to] - self->t_s[from]);
}

/* Why the step to a row is too fast: it is most of a turn, and the rest is not; or the
 * one that follows goes back. */
static enum import_odd_kind odd_few_kind(const struct odd *self, uint32_t at)
{
    const double turn = number_double(import_turn_q32(self->on->unit), 32);
    const double step = odd_step(self, at), next = odd_step(self, at + 1);
    const double rest = fabs(fabs(step) - turn);

    if (odd_is_turn(self, at) && rest > 0 &&
        !odd_is_fast(self, at - 1, at, rest))
        return IMPORT_ODD_TURN;
    return step * next < 0 && odd_is_fast(self, at, at + 1, next) &&
                   !odd_is_fast(self, at - 1, at + 1, step + next)
               ? IMPORT_ODD_OFF
               : IMPORT_ODD_NONE;
}

/* Judged by the velocity limit alone: rows are odd where they explain every step that
 * is far too fast, and there are others. */
static void odd_few(const struct odd *self, struct import_odd *odd)
{
    struct import_odd first = { .kind = IMPORT_ODD_NONE };
    uint32_t found = 0, calm = 0;

    for (uint32_t at = 1; at < self->count; at++) {
        if (!odd_is_fast(self, at - 1, at, odd_step(self, at))) {
            calm++;
            continue;
        }
        const enum import_odd_kind kind = odd_few_kind(self, at);
        if (kind == IMPORT_ODD_NONE)
            return;
        if (found++ == 0)
            first = (struct import_odd){ .kind = kind, .row = at };
        at += kind == IMPORT_ODD_OFF;
    }
    if (found == 0 || calm < ODD_CALM)
        return;
    *odd = first;
    odd->more = found - 1;
}

/* ---- all rows ---- */

static void odd_open(struct odd *self)
{
    self->count = self->axis->key_count;
    self->t_s = memory_new(self->count, sizeof *self->t_s);
    self->p = memory_new(self->count, sizeof *self->p);
    self->off = memory_new(self->count, sizeof *self->off);
    for (uint32_t i = 0; i < self->count; i++) {
        const struct motion_key *key = &self->axis->key[i].key;
        self->t_s[i] = number_double(key->t_ns_q12, 12) / 1e9;
        self->p[i] = number_double(key->pos_q32, 32);
    }
}

/* Judged by a cubic through the rows around. */
static void odd_many(struct odd *self, struct import_odd *odd)
{
    struct import_odd next = { .kind = IMPORT_ODD_NONE };
    uint32_t found = 0, worst;

    for (uint32_t i = 0; i < self->count; i++)
        self->off[i] = odd_off(self, i, i);
    self->typical = odd_median(self->off, self->count);
    while (found < ODD_MOST && (worst = odd_furthest(self)) < self->count) {
        odd_judge(self, odd_culprit(self, worst), &next);
        if (found++ == 0 || next.row < odd->row)
            *odd = next;
        for (uint32_t i = odd_low(worst); i <= odd_high(self, worst); i++)
            self->off[i] = -1;
    }
    odd->more = found > 0 ? found - 1 : 0;
}

void import_odd(const struct rig_axis *on, const struct plan_axis *axis,
                struct import_odd *odd)
{
    struct odd self = { .on = on, .axis = axis };

    *odd = (struct import_odd){ .kind = IMPORT_ODD_NONE };
    odd_open(&self);
    if (self.count >= ODD_LEAST)
        odd_many(&self, odd);
    if (self.count < ODD_FEW && odd->kind == IMPORT_ODD_NONE)
        odd_few(&self, odd);
    memory_free(self.t_s);
    memory_free(self.p);
    memory_free(self.off);
}

/* ---- the sentence ---- */

static const char *odd_pos(const struct plan_axis *axis, uint32_t row,
                           char text[NUMBER_MAX])
{
    if (row < axis->key_count)
        number_short(text, axis->key[row].key.pos_q32, 32);
    else
        snprintf(text, NUMBER_MAX, "nothing");
    return text;
}

void import_odd_text(const struct import_odd *odd, const struct rig_axis *on,
                     const struct plan_axis *axis, char text[IMPORT_ODD_MAX])
{
    const char *unit = units_axis_text(on->unit);
    const uint32_t row = odd->row;
    char is[NUMBER_MAX], before[NUMBER_MAX], after[NUMBER_MAX];
    int used;

    text[0] = 0;
    if (odd->kind == IMPORT_ODD_NONE)
        return;
    odd_pos(axis, row, is);
    odd_pos(axis, row > 0 ? row - 1 : row + 1, before);
    odd_pos(axis, row + 1 < axis->key_count ? row + 1 : row - 1, after);
    used = snprintf(text, IMPORT_ODD_MAX, "row %u (line %u), %s %s, ", row + 1,
                    axis->key[row].place.line, is, unit);
    char *const rest = text + used;
    const size_t room = IMPORT_ODD_MAX - (size_t)used;
    switch (odd->kind) {
    case IMPORT_ODD_TURN:
        used = snprintf(rest, room,
                        "is nearly a whole turn from the row before, %s: "
                        "--unwrap",
                        before);
        break;
    case IMPORT_ODD_TWICE:
        used = snprintf(rest, room,
                        "is where the row before is, and the axis moves before "
                        "and after: a frame twice?");
        break;
    case IMPORT_ODD_MISSING:
        used = snprintf(rest, room,
                        "is twice as far from the row before, %s, as the rows "
                        "around: a row that is not there?",
                        before);
        break;
    case IMPORT_ODD_STEP:
        used = snprintf(rest, room, "jumps from the row before, %s", before);
        break;
    case IMPORT_ODD_EXPONENT: /* of a mantissa below ten */
        used = snprintf(rest, room,
                        "is far from both neighbours, %s and %s, and 10^%d of "
                        "it is not: %s?",
                        before, after, odd->exponent,
                        llabs(axis->key[row].key.pos_q32) <
                                10 * MOTION_FIXED_ONE_Q32
                            ? "an exponent cut off"
                            : "a decimal point left out");
        break;
    default:
        used = snprintf(rest, room, "is far from both neighbours, %s and %s",
                        before, after);
    }
    if (odd->more > 0 && (size_t)used < room)
        snprintf(rest + used, room - (size_t)used, "; and so in %u other %s",
                 odd->more, number_word(odd->more, "place", "places"));
}
