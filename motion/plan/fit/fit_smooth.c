/* motion/plan/fit/fit_smooth.c - keys moved, within a tolerance, until the curve
 * through them is inside its limits.  See fit.h.
 *
 * A derivative of order 1, 2 or 3 is near the divided difference D of two, three
 * or four keys (times 1, 2, 6).  Displacements s of the keys, in tolerances, are
 * found that minimise |s|^2 under
 *
 *     |s_i| <= 1        |D_r (p + s)| <= margin_r limit
 *
 * a quadratic programme with a band matrix, by the alternating direction method
 * of multipliers (Boyd et al., Found. and Trends in Machine Learning 3 (2011), in
 * the form of Stellato et al., OSQP (2020), section 3.1).  Then the curve is
 * planned and judged; where a span still breaks a limit, the margin of the
 * differences around it shrinks by as much, and the keys around it are free in the
 * next round.  A key far from any violation is never free, and stays to the bit.
 * Before the first and after the last key stand two more at their position, as
 * the axis rests there. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"
#include "motion/plan/fit/fit_internal.h"
#include "motion/plan/keys/move_internal.h"
#include "motion/plan/plan_error.h"

#define SMOOTH_REST    2 /* keys at rest on either side */
#define SMOOTH_BESIDE  4 /* keys on either side of a violation that are free */
#define SMOOTH_TIGHTER 0.97
#define SMOOTH_TELLING                                                         \
    0.7 /* a span that needs less says nothing of its margin */
#define SMOOTH_LEAST    1e-3 /* of a margin */
#define SMOOTH_WIDEST   10.0
#define SMOOTH_STEPS    800
#define SMOOTH_PATIENCE 12   /* rounds without a smaller excess */
#define SMOOTH_CLOSE    1e-3 /* of a limit: as near as the steps have to come */
#define SMOOTH_WEIGHT   1e-3 /* of |s|^2 */
#define SMOOTH_PENALTY  1.0
#define SMOOTH_PROXIMAL 1e-6
#define SMOOTH_RELAX    1.6

/* low <= c . s <= high, of keys first .. first + order; |c| = 1. */
struct smooth_row {
    double c[PLAN_FIT_ORDERS + 1], low, high, z, y;
    double size; /* of a limit, in the unit of the row */
};

struct smooth_key {
    double t_s, p, tolerance; /* 0: it stays */
    bool is_free;
    double s;
    struct smooth_row box;
    struct smooth_row
        row[PLAN_FIT_ORDERS];       /* of the differences from here on */
    double margin[PLAN_FIT_ORDERS]; /* of the span from here on */
    double
        a[PLAN_FIT_ORDERS + 1]; /* of the matrix: main diagonal, then right */
    double l[PLAN_FIT_ORDERS + 1]; /* of its factor */
    double b;
};

struct smooth {
    struct fit *fit;
    uint32_t axis, count; /* keys, with those at rest */
    const struct plan_axis *from;
    struct plan_axis *to;
    double limit[PLAN_FIT_ORDERS]; /* unit; 0: none */
    struct smooth_key *key;
};

/* --- rows ------------------------------------------------------------------- */

/* c[0 .. order]: the derivative is sum c_j p_(i+j). */
static void smooth_difference(const struct smooth *self, uint32_t i,
                              unsigned order, double c[])
{
    double factorial = 1;

    for (unsigned j = 0; j <= order; j++) {
        c[j] = 1;
        for (unsigned k = 0; k <= order; k++)
            if (k != j)
                c[j] /= self->key[i + j].t_s - self->key[i + k].t_s;
        factorial *= j > 0 ? j : 1;
    }
    for (unsigned j = 0; j <= order; j++)
        c[j] *= factorial;
}

/* A row without a free key has no coefficients. */
static void smooth_row(struct smooth *self, uint32_t i, unsigned order)
{
    struct smooth_row *row = &self->key[i].row[order - 1];
    double c[PLAN_FIT_ORDERS + 1], value = 0, size = 0, margin = 1;

    smooth_difference(self, i, order, c);
    for (unsigned j = 0; j <= order; j++) {
        const struct smooth_key *key = &self->key[i + j];
        value += c[j] * (key->p - self->key[i].p);
        row->c[j] = key->is_free ? c[j] * key->tolerance : 0;
        size += row->c[j] * row->c[j];
        if (j < order)
            margin = fmin(margin, key->margin[order - 1]);
    }
    size = size > 0 ? sqrt(size) : 1;
    for (unsigned j = 0; j <= order; j++)
        row->c[j] /= size;
    row->size = self->limit[order - 1] / size;
    row->low = -row->size * margin - value / size;
    row->high = row->size * margin - value / size;
}

static bool smooth_has_row(const struct smooth *self, uint32_t i,
                           unsigned order)
{
    if (self->limit[order - 1] == 0 || i + order >= self->count)
        return false;
    for (unsigned j = 0; j <= order; j++)
        if (self->key[i + j].is_free)
            return true;
    return false;
}

/* Each row there is, with its key and how many more it has. */
typedef void smooth_do(struct smooth *self, struct smooth_row *row, uint32_t i,
                       unsigned order);

static void smooth_each(struct smooth *self, smooth_do *act)
{
    for (uint32_t i = 0; i < self->count; i++) {
        if (self->key[i].is_free)
            act(self, &self->key[i].box, i, 0);
        for (unsigned order = 1; order <= PLAN_FIT_ORDERS; order++)
            if (smooth_has_row(self, i, order))
                act(self, &self->key[i].row[order - 1], i, order);
    }
}

static void smooth_set_row(struct smooth *self, struct smooth_row *row,
                           uint32_t i, unsigned order)
{
    if (order > 0)
        smooth_row(self, i, order);
    for (unsigned j = 0; j <= order; j++)
        for (unsigned k = j; k <= order; k++)
            self->key[i + j].a[k - j] += SMOOTH_PENALTY * row->c[j] * row->c[k];
}

/* --- the band matrix ---------------------------------------------------------- */

/* L D L', row by row: l[0] is D, l[k] the entry k to the right of L'.  A key that
 * is not free has nothing but its diagonal. */
static void smooth_factor(struct smooth *self)
{
    struct smooth_key *const key = self->key;

    for (uint32_t i = 0; i < self->count; i++) {
        key[i].a[0] = SMOOTH_WEIGHT + SMOOTH_PROXIMAL;
        for (unsigned k = 1; k <= PLAN_FIT_ORDERS; k++)
            key[i].a[k] = 0;
    }
    smooth_each(self, smooth_set_row);
    for (uint32_t i = 0; i < self->count; i++)
        for (unsigned k = 0; k <= PLAN_FIT_ORDERS; k++) {
            double sum = key[i].a[k];
            for (unsigned j = 1; j + k <= PLAN_FIT_ORDERS && j <= i; j++)
                sum -= key[i - j].l[0] * key[i - j].l[j] * key[i - j].l[j + k];
            key[i].l[k] = k == 0 ? sum : sum / key[i].l[0];
        }
}

/* The solution in b. */
static void smooth_solve(struct smooth *self)
{
    struct smooth_key *const key = self->key;

    for (uint32_t i = 0; i < self->count; i++)
        for (unsigned j = 1; j <= PLAN_FIT_ORDERS && j <= i; j++)
            key[i].b -= key[i - j].l[j] * key[i - j].b;
    for (uint32_t i = self->count; i-- > 0;) {
        key[i].b /= key[i].l[0];
        for (unsigned k = 1; k <= PLAN_FIT_ORDERS && i + k < self->count; k++)
            key[i].b -= key[i].l[k] * key[i + k].b;
    }
}

/* --- steps -------------------------------------------------------------------- */

static void smooth_pull(struct smooth *self, struct smooth_row *row, uint32_t i,
                        unsigned order)
{
    for (unsigned j = 0; j <= order; j++)
        self->key[i + j].b += row->c[j] * (SMOOTH_PENALTY * row->z - row->y);
}

static void smooth_project(struct smooth *self, struct smooth_row *row,
                           uint32_t i, unsigned order)
{
    double value = 0;

    for (unsigned j = 0; j <= order; j++)
        value += row->c[j] * self->key[i + j].b;
    value = SMOOTH_RELAX * value + (1 - SMOOTH_RELAX) * row->z;
    const double at = value + row->y / SMOOTH_PENALTY;
    row->z = fmax(row->low, fmin(at, row->high));
    row->y += SMOOTH_PENALTY * (value - row->z);
}

/* How far the worst row is outside, in limits. */
static double smooth_excess(const struct smooth *self)
{
    double worst = 0;

    for (uint32_t i = 0; i < self->count; i++) {
        worst = fmax(worst, fabs(self->key[i].s) - 1);
        for (unsigned order = 1; order <= PLAN_FIT_ORDERS; order++) {
            const struct smooth_row *row = &self->key[i].row[order - 1];
            double value = 0;
            if (!smooth_has_row(self, i, order))
                continue;
            for (unsigned j = 0; j <= order; j++)
                value += row->c[j] * self->key[i + j].s;
            worst = fmax(worst,
                         fmax(value - row->high, row->low - value) / row->size);
        }
    }
    return worst;
}

static void smooth_minimise(struct smooth *self)
{
    smooth_factor(self);
    for (unsigned step = 0; step < SMOOTH_STEPS; step++) {
        if (step % 16 == 15 && smooth_excess(self) < SMOOTH_CLOSE)
            break;
        for (uint32_t i = 0; i < self->count; i++)
            self->key[i].b = SMOOTH_PROXIMAL * self->key[i].s;
        smooth_each(self, smooth_pull);
        smooth_solve(self);
        smooth_each(self, smooth_project);
        for (uint32_t i = 0; i < self->count; i++)
            self->key[i].s = SMOOTH_RELAX * self->key[i].b +
                             (1 - SMOOTH_RELAX) * self->key[i].s;
    }
    for (uint32_t i = 0; i < self->from->key_count; i++) {
        const struct smooth_key *key = &self->key[i + SMOOTH_REST];
        const double moved = key->tolerance * fmax(-1, fmin(key->s, 1));
        self->to->key[i].key.pos_q32 =
            self->from->key[i].key.pos_q32 +
            (key->is_free ? (int64_t)ldexp(moved, 32) : 0);
    }
}

/* --- rounds ------------------------------------------------------------------- */

/* The largest difference of an order around a span as the keys are now, in
 * limits. */
static double smooth_around(const struct smooth *self, uint32_t at,
                            unsigned order)
{
    double c[PLAN_FIT_ORDERS + 1], most = 0;

    for (uint32_t i = at + 1 - order; i <= at; i++) {
        double value = 0;
        smooth_difference(self, i, order, c);
        for (unsigned j = 0; j <= order; j++) {
            const struct smooth_key *key = &self->key[i + j];
            const double s = key->is_free ? fmax(-1, fmin(key->s, 1)) : 0;
            value += c[j] * (key->p - self->key[i].p + key->tolerance * s);
        }
        most = fmax(most, fabs(value) / self->limit[order - 1]);
    }
    return most;
}

/* By what the curve of a span makes of the differences around it: how large they
 * may be; and the keys around one that needs more are free. */
static void smooth_tighten(struct smooth *self)
{
    for (uint32_t span = 0; span + 1 < self->from->key_count; span++) {
        const struct plan_fit_need *need = &self->fit->own[span];
        const unsigned order = need->decided_by;
        const uint32_t at = span + SMOOTH_REST;
        if (order == 0 || need->stretch < SMOOTH_TELLING)
            continue;
        self->key[at].margin[order - 1] = fmin(
            fmax(SMOOTH_LEAST, SMOOTH_TIGHTER * smooth_around(self, at, order) /
                                   double_power(need->stretch, order)),
            SMOOTH_WIDEST);
        if (!(need->stretch > 1))
            continue;
        for (uint32_t k = at < SMOOTH_BESIDE ? 0 : at - SMOOTH_BESIDE;
             k <= at + 1 + SMOOTH_BESIDE && k < self->count; k++)
            self->key[k].is_free = self->key[k].tolerance > 0;
    }
}

static int smooth_give_up(const struct smooth *self)
{
    static const char *const word[] = { "velocity", "acceleration", "jerk" };
    const struct plan_fit_need *own = self->fit->own;
    uint32_t worst = 0;

    for (uint32_t i = 0; i + 1 < self->from->key_count; i++)
        if (own[i].stretch > own[worst].stretch)
            worst = i;
    const unsigned order =
        own[worst].decided_by > 0 ? own[worst].decided_by : 1;
    const bool stay = self->key[worst + SMOOTH_REST].tolerance == 0 &&
                      self->key[worst + 1 + SMOOTH_REST].tolerance == 0;
    return plan_error_set(
        self->fit->error, MOTION_E_LIMIT, self->from->key[worst].place,
        "keys of axis %s moved by no more than the tolerance leave %.4g times "
        "its limit of %s between keys %u and %u%s",
        self->from->name, double_power(own[worst].stretch, order),
        word[order - 1], worst + 1, worst + 2,
        stay ? ", which stay (the first, the last, fixed ones): a longer time "
               "would help"
             : ": a larger tolerance or a longer time would help");
}

/* What the worst span needs. */
static double smooth_worst(const struct smooth *self)
{
    double worst = 0;

    for (uint32_t i = 0; i + 1 < self->from->key_count; i++)
        worst = fmax(worst, self->fit->own[i].stretch);
    return worst;
}

static int smooth_rounds(struct smooth *self, double tolerance)
{
    struct fit *fit = self->fit;
    double least = INFINITY;
    unsigned last = 0; /* round in which it fell */
    int err = MOTION_OK;

    for (unsigned round = 0; err == MOTION_OK; round++) {
        bool fits = true;
        fit->fit->rounds++;
        err = fit_measure_axis(fit, self->axis, &fits);
        if (err < 0 || fits)
            return err;
        if (smooth_worst(self) < 0.999 * least) {
            least = smooth_worst(self);
            last = round;
        }
        if (round == PLAN_FIT_ROUNDS || round - last > SMOOTH_PATIENCE ||
            tolerance == 0)
            return smooth_give_up(self);
        smooth_tighten(self);
        smooth_minimise(self);
    }
    return err;
}

/* The first and the last key stay: the move is to begin and end where it did. */
static void smooth_open(struct smooth *self, double tolerance)
{
    const struct plan_limit *limit = &self->fit->request->limit[self->axis];
    const uint32_t keys = self->from->key_count;

    self->limit[0] = ldexp((double)limit->vel_q32, -32);
    self->limit[1] = ldexp((double)limit->acc_q32, -32);
    self->limit[2] = ldexp((double)limit->jerk_q32, -32);
    for (uint32_t i = 0; i < self->count; i++) {
        const uint32_t last = keys - 1;
        const uint32_t of = i < SMOOTH_REST          ? 0
                            : i - SMOOTH_REST > last ? last
                                                     : i - SMOOTH_REST;
        const struct plan_key *key = &self->from->key[of];
        const bool stays =
            of == 0 || of == last || (key->fixed & PLAN_FIXED_VALUE) != 0;
        self->key[i] = (struct smooth_key){
            .t_s = move_seconds(key->key.t_ns_q12),
            .p = ldexp((double)key->key.pos_q32, -32),
            .tolerance = stays ? 0 : tolerance,
            .box = { .c = { 1 }, .low = -1, .high = 1 },
            .margin = { 1, 1, 1 },
        };
    }
    for (uint32_t i = 0; i < SMOOTH_REST && keys > 1; i++) {
        struct smooth_key *first = &self->key[SMOOTH_REST],
                          *last = &self->key[self->count - 1 - SMOOTH_REST];
        (first - 1 - i)->t_s -= (i + 1) * (first[1].t_s - first->t_s);
        (last + 1 + i)->t_s += (i + 1) * (last->t_s - last[-1].t_s);
    }
}

static int smooth_axis(struct fit *fit, uint32_t axis)
{
    const struct plan_axis *from = &fit->request->move->axis[axis];
    struct smooth self = { .fit = fit,
                           .axis = axis,
                           .count = from->key_count + 2 * SMOOTH_REST,
                           .from = from,
                           .to = &fit->fit->axis[axis] };
    const double tolerance =
        ldexp((double)fit->request->tolerance_q32[axis], -32);
    int err;

    self.key = calloc(self.count, sizeof *self.key);
    if (self.key == NULL) {
        err = fit_no_memory(fit);
    } else {
        smooth_open(&self, tolerance);
        err = smooth_rounds(&self, tolerance);
    }
    free(self.key);
    return err;
}

int fit_smooth(struct fit *self)
{
    int err = MOTION_OK;

    for (uint32_t a = 0; a < self->fit->axis_count && err == MOTION_OK; a++)
        err = smooth_axis(self, a);
    return err;
}
