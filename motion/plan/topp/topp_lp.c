/* motion/plan/topp/topp_lp.c - see topp_lp.h. */
#include "motion/plan/topp/topp_lp.h"

#include <math.h>
#include <string.h>

/* A row counts as met within this; rows that then seem to exclude each other,
 * which is rounding where they are nearly parallel, within LP_EMPTY. */
#define LP_TOLERANCE 1e-9
#define LP_EMPTY     2e-8

/* Of two or three. */
static double lp_dot(unsigned size, const double a[], const double x[])
{
    const double sum = a[0] * x[0] + a[1] * x[1];

    return size == 2 ? sum : sum + a[2] * x[2];
}

/* One variable: the interval that all rows leave. */
static bool lp_line(const struct topp_lp_part *part, double *x)
{
    double low = part->low[0], high = part->high[0];

    for (unsigned i = 0; i < part->count; i++) {
        const double a = part->row[i].a[0], b = part->row[i].b;
        if (a > 0 && b < a * high)
            high = b / a;
        else if (a < 0 && b < a * low)
            low = b / a;
        else if (a == 0 && b < -LP_EMPTY)
            return false;
    }
    if (low > high) {
        /* Rows that meet in a point, up to rounding. */
        const double middle = low + (high - low) / 2;
        for (unsigned i = 0; i < part->count; i++)
            if (part->row[i].a[0] * middle > part->row[i].b + LP_EMPTY)
                return false;
        low = high = middle;
    }
    *x = part->c[0] > 0 ? high : part->c[0] < 0 ? low : low + (high - low) / 2;
    return true;
}

static unsigned lp_pivot(unsigned size, const double a[])
{
    unsigned best = 0;

    for (unsigned i = 1; i < size; i++)
        if (fabs(a[i]) > fabs(a[best]))
            best = i;
    return best;
}

/* a - b, zero where nothing but rounding is left. */
static double lp_less(double a, double b)
{
    const double rest = a - b;

    return fabs(rest) < 1e-14 * fabs(a) ? 0 : rest;
}

/* `row` without variable p, which is put to what `on` says with equality. */
static void lp_drop(unsigned size, unsigned p, const struct topp_lp_row *on,
                    const double a[], double b, struct topp_lp_row *out)
{
    const double share = a[p] / on->a[p];
    unsigned k = 0;

    for (unsigned i = 0; i < size; i++)
        if (i != p)
            out->a[k++] = lp_less(a[i], share * on->a[i]);
    out->b = lp_less(b, share * on->b);
}

/* The program of one variable less on the plane of `on`, without its rows. */
static void lp_begin(unsigned size, unsigned p, const struct topp_lp_row *on,
                     const double low[], const double high[], const double c[],
                     struct topp_lp_part *part)
{
    struct topp_lp_row side = { 0 }, rest;
    unsigned k = 0;

    for (unsigned i = 0; i < size; i++) {
        if (i == p)
            continue;
        part->low[k] = low[i];
        part->high[k] = high[i];
        k++;
    }
    /* Scaled so that their rounding is what it is in `on`. */
    const double scale = fabs(on->a[p]);
    side.a[p] = scale;
    lp_drop(size, p, on, side.a, scale * high[p], &part->row[0]);
    side.a[p] = -scale;
    lp_drop(size, p, on, side.a, -scale * low[p], &part->row[1]);
    part->count = 2;
    lp_drop(size, p, on, c, 0, &rest);
    memcpy(part->c, rest.a, (size - 1) * sizeof part->c[0]);
}

/* All variables of a point on the plane of `on`. */
static void lp_end(unsigned size, unsigned p, const struct topp_lp_row *on,
                   const double rest[], double x[])
{
    double sum = on->b;
    unsigned k = 0;

    for (unsigned i = 0; i < size; i++) {
        if (i == p)
            continue;
        x[i] = rest[k++];
        sum -= on->a[i] * x[i];
    }
    x[p] = sum / on->a[p];
}

/* Two variables; `line` is for what is left of them. */
static bool lp_plane(const struct topp_lp_part *part, struct topp_lp_part *line,
                     double x[2])
{
    for (unsigned i = 0; i < 2; i++)
        x[i] = part->c[i] >= 0 ? part->high[i] : part->low[i];
    for (unsigned i = 0; i < part->count; i++) {
        const struct topp_lp_row *on = &part->row[i];
        if (lp_dot(2, on->a, x) <= on->b + LP_TOLERANCE)
            continue;
        const unsigned p = lp_pivot(2, on->a);
        double rest;
        if (on->a[p] == 0)
            return false;
        lp_begin(2, p, on, part->low, part->high, part->c, line);
        for (unsigned j = 0; j < i; j++)
            lp_drop(2, p, on, part->row[j].a, part->row[j].b,
                    &line->row[line->count++]);
        if (!lp_line(line, &rest))
            return false;
        lp_end(2, p, on, &rest, x);
    }
    return true;
}

static void lp_to_front(struct topp_lp *lp, unsigned i)
{
    const struct topp_lp_row row = lp->row[i];

    memmove(lp->row + 1, lp->row, i * sizeof lp->row[0]);
    lp->row[0] = row;
}

/* Inline, so that the loops over variables are as long as they are. */
static inline __attribute__((always_inline)) bool
lp_solve(struct topp_lp *lp, unsigned size, const double c[3], double x[3])
{
    struct topp_lp_part *part = &lp->plane;

    for (unsigned i = 0; i < size; i++)
        x[i] = c[i] >= 0 ? lp->high[i] : lp->low[i];
    for (unsigned i = 0; i < lp->count; i++) {
        const struct topp_lp_row *on = &lp->row[i];
        double rest[2];
        if (lp_dot(size, on->a, x) <= on->b + LP_TOLERANCE)
            continue;
        const unsigned p = lp_pivot(size, on->a);
        if (on->a[p] == 0)
            return false;
        lp_begin(size, p, on, lp->low, lp->high, c, part);
        for (unsigned j = 0; j < i; j++) {
            const struct topp_lp_row *row = &lp->row[j];
            lp_drop(size, p, on, row->a, row->b, &part->row[part->count++]);
        }
        if (size == 3 ? !lp_plane(part, &lp->line, rest) : !lp_line(part, rest))
            return false;
        lp_end(size, p, on, rest, x);
        lp_to_front(lp, i);
    }
    return true;
}

bool topp_lp_solve(struct topp_lp *lp, unsigned size, const double c[3],
                   double x[3])
{
    return size == 3 ? lp_solve(lp, 3, c, x) : lp_solve(lp, 2, c, x);
}
