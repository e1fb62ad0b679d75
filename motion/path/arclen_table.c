/* motion/path/arclen_table.c - adaptive panels and the inverse; see
 * arclen.h. */
#include "motion/core/err.h"
#include "motion/curve/bake.h"
#include "motion/path/arclen_internal.h"

#define ARCLEN_STEPS 80 /* of Newton's method and halving together */

/* A panel by 8 points, and its two parts, which are what counts. */
struct arclen_leaf {
    struct motion_real h, part, low, high, error;
};

/* Of the curve's borders and the first panel: not a half, so that a panel's
 * middle is not the middle of what is symmetric. */
static struct motion_real arclen_uneven(struct motion_real h)
{
    return motion_real_mul(h, motion_real_from_q(15073, 15)); /* 0.46 */
}

/* From the end of a panel to the first of its points, of its length. */
#define ARCLEN_GAP_Q62 INT64_C(91565356790028544) /* (1 - 0.96029) / 2 */

static struct motion_real arclen_dot(const struct motion_arclen_point *a,
                                     const struct motion_arclen_point *b,
                                     uint32_t axes)
{
    struct motion_real sum = motion_real_zero();

    for (uint32_t i = 0; i < axes; i++)
        sum = motion_real_add(sum, motion_real_mul(a->d1[i], b->d1[i]));
    return sum;
}

/* A cusp between the end of a panel and the first of its points is invisible to
 * them: on their side the speed is as smooth as without it.  But the curve has
 * turned.  What is missed then is at most the speed at the end, over the gap.
 * `h` leads from the end into the panel, and may be negative; turned by more
 * than 60 degrees counts. */
static struct motion_real arclen_hidden(const struct motion_arclen_curve *curve,
                                        uint32_t piece, struct motion_real x,
                                        struct motion_real h)
{
    const struct motion_real gap =
        motion_real_mul(h, motion_real_from_q(ARCLEN_GAP_Q62, 62));
    struct motion_arclen_point at, in;

    curve->at(curve->context, piece, x, 1, &at);
    curve->at(curve->context, piece, motion_real_add(x, gap), 1, &in);
    const struct motion_real speed = arclen_norm(at.d1, curve->axes);
    const struct motion_real both =
        motion_real_mul(speed, arclen_norm(in.d1, curve->axes));
    if (!motion_real_lt(arclen_dot(&at, &in, curve->axes),
                        motion_real_half(both)))
        return motion_real_zero();
    return motion_real_mul(speed, motion_real_abs(gap));
}

/* At both ends of a panel. */
static struct motion_real arclen_hidden_ends(struct motion_arclen_table *table,
                                             uint32_t piece,
                                             struct motion_real x,
                                             struct motion_real h)
{
    table->evaluations += 4;
    return motion_real_add(arclen_hidden(table->curve, piece, x, h),
                           arclen_hidden(table->curve, piece,
                                         motion_real_add(x, h),
                                         motion_real_neg(h)));
}

/* The error given is that of the whole panel; its parts are about 2^16 times
 * better where the curve is smooth, 4 times at a cusp. */
static struct arclen_leaf arclen_look(struct motion_arclen_table *table,
                                      uint32_t piece, struct motion_real x,
                                      struct motion_real h)
{
    const struct motion_arclen_curve *curve = table->curve;
    struct arclen_leaf leaf = { .h = h, .part = arclen_uneven(h) };
    const struct motion_real whole = arclen_gauss(curve, piece, x, h);

    leaf.low = arclen_gauss(curve, piece, x, leaf.part);
    leaf.high = arclen_gauss(curve, piece, motion_real_add(x, leaf.part),
                             motion_real_sub(h, leaf.part));
    leaf.error = motion_real_abs(
        motion_real_sub(motion_real_add(leaf.low, leaf.high), whole));
    leaf.error = motion_real_add(
        leaf.error,
        motion_real_add(arclen_hidden_ends(table, piece, x, leaf.part),
                        arclen_hidden_ends(table, piece,
                                           motion_real_add(x, leaf.part),
                                           motion_real_sub(h, leaf.part))));
    table->evaluations += 3 * ARCLEN_GAUSS_POINTS;
    return leaf;
}

static int arclen_store(struct motion_arclen_table *table, uint32_t piece,
                        struct motion_real x)
{
    if (table->row) {
        if (table->count == table->capacity)
            return MOTION_E_FULL;
        table->row[table->count] = (struct motion_arclen_row){
            .x = x, .s = table->length, .piece = piece
        };
    }
    table->count++;
    return MOTION_OK;
}

static int arclen_accept(struct motion_arclen_table *table, uint32_t piece,
                         struct motion_real x, const struct arclen_leaf *leaf)
{
    int err = arclen_store(table, piece, x);

    table->length = motion_real_add(table->length, leaf->low);
    if (err == MOTION_OK)
        err = arclen_store(table, piece, motion_real_add(x, leaf->part));
    table->length = motion_real_add(table->length, leaf->high);
    table->error = motion_real_add(table->error, leaf->error);
    return err;
}

/* What is allowed to a panel: its share of the whole, or a 64th. */
static struct motion_real arclen_share(struct motion_real allowed,
                                       struct motion_real h,
                                       struct motion_real all)
{
    return motion_real_max(motion_real_mul(allowed, motion_real_div(h, all)),
                           motion_real_scale(allowed, -6));
}

static int arclen_walk_piece(struct motion_arclen_table *table, uint32_t piece,
                             struct motion_real allowed)
{
    const struct motion_arclen_curve *curve = table->curve;
    const struct motion_real width = arclen_width(curve, piece);
    const struct motion_real all =
        motion_real_sub(curve->border[curve->pieces], curve->border[0]);
    struct motion_real x = motion_real_zero(), left = width,
                       h = arclen_uneven(width);
    int err = MOTION_OK;

    while (err == MOTION_OK && motion_real_sign(left) > 0) {
        if (motion_real_cmp(motion_real_scale(h, 2),
                            motion_real_mul(left, motion_real_int(3))) > 0)
            h = left; /* no crumbs */
        const struct arclen_leaf leaf = arclen_look(table, piece, x, h);
        const struct motion_real share = arclen_share(allowed, h, all);
        if (motion_real_lt(share, leaf.error) &&
            motion_real_lt(motion_real_scale(width, -40), h)) {
            h = arclen_uneven(h);
            continue;
        }
        err = arclen_accept(table, piece, x, &leaf);
        x = motion_real_add(x, h);
        left = motion_real_cmp(h, left) == 0 ? motion_real_zero()
                                             : motion_real_sub(width, x);
        if (motion_real_lt(leaf.error, motion_real_scale(share, -17)))
            h = motion_real_twice(h);
    }
    return err;
}

/* The scale of the tolerance: 8 points a piece. */
static struct motion_real arclen_rough(struct motion_arclen_table *table)
{
    struct motion_real sum = motion_real_zero();

    for (uint32_t i = 0; i < table->curve->pieces; i++)
        sum = motion_real_add(sum,
                              arclen_gauss(table->curve, i, motion_real_zero(),
                                           arclen_width(table->curve, i)));
    table->evaluations += ARCLEN_GAUSS_POINTS * table->curve->pieces;
    return sum;
}

int arclen_walk(struct motion_arclen_table *table, struct motion_real tolerance)
{
    const uint32_t pieces = table->curve->pieces;
    const struct motion_real least = motion_real_from_q(1, 50);
    struct motion_real allowed;
    int err = MOTION_OK;

    table->count = table->evaluations = 0;
    table->length = table->error = motion_real_zero();
    if (motion_real_is_zero(tolerance))
        tolerance = motion_real_from_q(1, 40);
    allowed =
        motion_real_mul(motion_real_max(tolerance, least), arclen_rough(table));
    for (uint32_t i = 0; i < pieces && err == MOTION_OK; i++)
        err = arclen_walk_piece(table, i, allowed);
    if (err == MOTION_OK)
        err = arclen_store(table, pieces, motion_real_zero());
    table->error =
        motion_real_add(table->error, motion_real_scale(table->length, -53));
    return err;
}

/* End of the panel that starts at a row. */
static struct motion_real
arclen_row_end(const struct motion_arclen_table *table, uint32_t i)
{
    const struct motion_arclen_row *row = &table->row[i];

    return row[1].piece == row->piece ? row[1].x
                                      : arclen_width(table->curve, row->piece);
}

/* Speed and its derivative at a place. */
struct arclen_rate {
    struct motion_real v, dv;
};

static struct arclen_rate arclen_rate(const struct motion_arclen_curve *curve,
                                      uint32_t piece, struct motion_real x)
{
    struct motion_arclen_point at;
    struct arclen_rate rate = { .dv = motion_real_zero() };
    struct motion_real dot = motion_real_zero();

    curve->at(curve->context, piece, x, 2, &at);
    rate.v = arclen_norm(at.d1, curve->axes);
    for (uint32_t i = 0; i < curve->axes; i++)
        dot = motion_real_add(dot, motion_real_mul(at.d1[i], at.d2[i]));
    if (!motion_real_is_zero(rate.v))
        rate.dv = motion_real_div(dot, rate.v);
    return rate;
}

/* The first two derivatives of x by s, in units of a panel: 1/v and -v'/v^3. */
static void arclen_inverse(const struct arclen_rate *rate,
                           struct motion_real part, struct motion_real h,
                           struct motion_real d[2])
{
    const struct motion_real per = motion_real_div(motion_real_int(1), rate->v);
    const struct motion_real by = motion_real_mul(part, per);

    d[0] = motion_real_div(by, h);
    d[1] = motion_real_neg(motion_real_mul(motion_real_mul(d[0], rate->dv),
                                           motion_real_mul(by, per)));
}

/* The quintic through both ends of a panel, with the first two derivatives of
 * the inverse there; linear where the curve rests at an end. */
static void arclen_guess_panel(const struct motion_arclen_table *table,
                               uint32_t i)
{
    const struct motion_arclen_curve *curve = table->curve;
    struct motion_arclen_row *row = &table->row[i];
    const struct motion_real h =
        motion_real_sub(arclen_row_end(table, i), row->x);
    const struct motion_real part = motion_real_sub(row[1].s, row->s);
    const struct arclen_rate end[2] = {
        arclen_rate(curve, row->piece, row->x),
        arclen_rate(curve, row->piece, motion_real_add(row->x, h)),
    };
    struct motion_real from[2], to[2], w[5];

    if (motion_real_is_zero(end[0].v) || motion_real_is_zero(end[1].v)) {
        row->guess[0] = motion_real_int(1);
        for (int k = 1; k < 5; k++)
            row->guess[k] = motion_real_zero();
        return;
    }
    arclen_inverse(&end[0], part, h, from);
    arclen_inverse(&end[1], part, h, to);
    w[0] = motion_real_int(1);
    w[1] = from[0];
    w[2] = to[0];
    w[3] = motion_real_half(from[1]);
    w[4] = motion_real_half(to[1]);
    motion_bake_quintic(w, row->guess);
}

int motion_arclen_build(struct motion_arclen_table *table,
                        const struct motion_arclen_curve *curve,
                        struct motion_real tolerance,
                        struct motion_arclen_row *row, uint32_t capacity)
{
    int err = motion_arclen_check(curve);

    if (err < 0)
        return err;
    if (motion_real_sign(tolerance) < 0)
        return MOTION_E_ARG;
    if (capacity == 0)
        return MOTION_E_FULL;
    *table = (struct motion_arclen_table){ .curve = curve,
                                           .row = row,
                                           .capacity = capacity };
    err = arclen_walk(table, tolerance);
    for (uint32_t i = 0; err == MOTION_OK && i + 1 < table->count; i++)
        arclen_guess_panel(table, i);
    return err;
}

/* --- looking up ----------------------------------------------------------- */

/* -1, 0, 1 as a row is before, at, after (piece, x) or (piece, s). */
static int arclen_cmp_x(const struct motion_arclen_row *row, uint32_t piece,
                        struct motion_real x)
{
    if (row->piece != piece)
        return row->piece < piece ? -1 : 1;
    return motion_real_cmp(row->x, x);
}

static int arclen_cmp_s(const struct motion_arclen_row *row, uint32_t piece,
                        struct motion_real s)
{
    if (row->piece != piece)
        return row->piece < piece ? -1 : 1;
    return motion_real_cmp(row->s, s);
}

/* The last row that is not after the place; 0 when all are. */
static uint32_t arclen_search(const struct motion_arclen_table *table,
                              uint32_t piece, struct motion_real value,
                              int (*cmp)(const struct motion_arclen_row *,
                                         uint32_t, struct motion_real))
{
    uint32_t low = 0, high = table->count;

    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (cmp(&table->row[middle], piece, value) <= 0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

struct motion_real motion_arclen_border(const struct motion_arclen_table *table,
                                        uint32_t piece)
{
    return table
        ->row[arclen_search(table, piece, motion_real_zero(), arclen_cmp_x)]
        .s;
}

/* Where to begin, at share u of a panel's length; what is linear where that
 * leaves the panel. */
static struct motion_real arclen_guess(const struct motion_arclen_row *row,
                                       struct motion_real u)
{
    struct motion_real x = row->guess[4];

    for (int k = 3; k >= 0; k--)
        x = motion_real_add(motion_real_mul(x, u), row->guess[k]);
    x = motion_real_mul(x, u);
    return motion_real_sign(x) > 0 && motion_real_lt(x, motion_real_int(1)) ? x
                                                                            : u;
}

/* A step of the inverse's Taylor series, of second order; what is left is small
 * of third order, below 2^-54 of the panel where the step is as `*is_last`
 * says. */
static struct motion_real arclen_newton(const struct arclen_rate *rate,
                                        struct motion_real off,
                                        struct motion_real h, bool *is_last)
{
    const struct motion_real step =
        motion_real_neg(motion_real_div(off, rate->v));
    const struct motion_real bend = motion_real_half(
        motion_real_div(motion_real_mul(step, rate->dv), rate->v));

    *is_last =
        motion_real_lt(motion_real_abs(step), motion_real_scale(h, -18)) &&
        motion_real_lt(motion_real_abs(bend), motion_real_from_q(1, 17));
    return motion_real_sub(step, motion_real_mul(step, bend));
}

/* Newton's method for s(x) = goal (from the row on), kept between two places
 * that have the answer between them; halving where it would leave them. */
static void arclen_solve(const struct motion_arclen_table *table,
                         const struct motion_arclen_row *row,
                         struct motion_real high, struct motion_real goal,
                         struct motion_arclen_place *place)
{
    const struct motion_real near = motion_real_scale(table->length, -54);
    const struct motion_real h = motion_real_sub(high, row->x);
    struct motion_real low = row->x, x = place->x, off = near;
    bool is_last = false;

    for (int i = 0; !is_last; i++) {
        off = motion_real_sub(arclen_gauss(table->curve, row->piece, row->x,
                                           motion_real_sub(x, row->x)),
                              goal);
        place->evaluations += ARCLEN_GAUSS_POINTS + 1;
        if (i == ARCLEN_STEPS || motion_real_lt(motion_real_abs(off), near))
            break;
        if (motion_real_sign(off) < 0)
            low = x;
        else
            high = x;
        const struct arclen_rate rate =
            arclen_rate(table->curve, row->piece, x);
        if (!motion_real_is_zero(rate.v))
            x = motion_real_add(x, arclen_newton(&rate, off, h, &is_last));
        if (motion_real_is_zero(rate.v) || motion_real_cmp(x, low) <= 0 ||
            motion_real_cmp(x, high) >= 0) {
            x = motion_real_half(motion_real_add(low, high));
            is_last = false;
        }
    }
    place->x = x;
    place->error =
        motion_real_add(place->error, is_last ? near : motion_real_abs(off));
}

void motion_arclen_find_in(const struct motion_arclen_table *table,
                           uint32_t piece, struct motion_real s,
                           struct motion_arclen_place *place)
{
    uint32_t i = arclen_search(table, piece, s, arclen_cmp_s);

    if (table->row[i].piece < piece)
        i++;
    const struct motion_arclen_row *row = &table->row[i];
    const struct motion_real high = arclen_row_end(table, i);
    const struct motion_real part = motion_real_sub(row[1].s, row->s);
    const struct motion_real goal = motion_real_sub(s, row->s);

    *place = (struct motion_arclen_place){ piece, row->x, table->error, 0 };
    if (motion_real_sign(goal) <= 0)
        return;
    place->x = high;
    if (motion_real_cmp(goal, part) >= 0)
        return;
    place->x = motion_real_add(
        row->x,
        motion_real_mul(motion_real_sub(high, row->x),
                        arclen_guess(row, motion_real_div(goal, part))));
    arclen_solve(table, row, high, goal, place);
}

/* The piece of a length: the last that does not start after it. */
static uint32_t arclen_piece(const struct motion_arclen_table *table,
                             struct motion_real s)
{
    uint32_t low = 0, high = table->count - 1;

    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (motion_real_cmp(table->row[middle].s, s) <= 0)
            low = middle;
        else
            high = middle;
    }
    return table->row[low].piece;
}

void motion_arclen_find(const struct motion_arclen_table *table,
                        struct motion_real s, struct motion_arclen_place *place)
{
    motion_arclen_find_in(table, arclen_piece(table, s), s, place);
}
