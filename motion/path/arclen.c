/* motion/path/arclen.c - curves, and the rules with equal panels; see
 * arclen.h. */
#include "motion/path/arclen.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/path/arclen_internal.h"

#define ARCLEN_PANELS_MAX (UINT32_C(1) << 20)

/* p, p', p'' in one pass of Horner's rule. */
static void arclen_horner(const struct motion_real coef[], uint32_t degree,
                          struct motion_real x, struct motion_real d[3])
{
    d[0] = coef[degree];
    d[1] = d[2] = motion_real_zero();
    for (uint32_t k = degree; k-- > 0;) {
        d[2] = motion_real_add(motion_real_mul(d[2], x), d[1]);
        d[1] = motion_real_add(motion_real_mul(d[1], x), d[0]);
        d[0] = motion_real_add(motion_real_mul(d[0], x), coef[k]);
    }
    d[2] = motion_real_twice(d[2]);
}

/* p' alone: a length asks for nothing else, and often. */
static struct motion_real arclen_horner_d1(const struct motion_real coef[],
                                           uint32_t degree,
                                           struct motion_real x)
{
    struct motion_real p = coef[degree], d = motion_real_zero();

    for (uint32_t k = degree; k-- > 0;) {
        d = motion_real_add(motion_real_mul(d, x), p);
        if (k > 0)
            p = motion_real_add(motion_real_mul(p, x), coef[k]);
    }
    return d;
}

/* Without powers that are zero, which most curves have. */
static uint32_t arclen_degree(const struct motion_real coef[], uint32_t degree)
{
    while (degree > 0 && motion_real_is_zero(coef[degree]))
        degree--;
    return degree;
}

void motion_arclen_poly_at(const void *context, uint32_t piece,
                           struct motion_real x, int order,
                           struct motion_arclen_point *point)
{
    const struct motion_arclen_poly *poly = context;
    const size_t size = poly->degree + 1;
    const struct motion_real *coef = poly->coef + size * piece * poly->axes;

    for (uint32_t i = 0; i < poly->axes; i++, coef += size) {
        const uint32_t degree = arclen_degree(coef, poly->degree);
        struct motion_real d[3];
        if (order == 1) {
            point->d1[i] = arclen_horner_d1(coef, degree, x);
            continue;
        }
        arclen_horner(coef, degree, x, d);
        point->pos[i] = d[0];
        point->d1[i] = d[1];
        point->d2[i] = d[2];
    }
}

/* 2^-58 of itself: a quick one, and a step of Newton's method. */
static struct motion_real arclen_sqrt(struct motion_real a)
{
    struct motion_real per, root, rest;

    if (motion_real_is_zero(a))
        return a;
    per = motion_real_rsqrt(a);
    root = motion_real_mul(a, per);
    rest = motion_real_sub(a, motion_real_sqr(root));
    return motion_real_add(root, motion_real_half(motion_real_mul(rest, per)));
}

struct motion_real arclen_norm(const struct motion_real v[], uint32_t axes)
{
    struct motion_real sum = motion_real_zero();

    if (axes == 1)
        return motion_real_abs(v[0]);
    for (uint32_t i = 0; i < axes; i++)
        sum = motion_real_add(sum, motion_real_sqr(v[i]));
    return arclen_sqrt(sum);
}

struct motion_real motion_arclen_speed(const struct motion_arclen_curve *curve,
                                       uint32_t piece, struct motion_real x)
{
    struct motion_arclen_point point;

    curve->at(curve->context, piece, x, 1, &point);
    return arclen_norm(point.d1, curve->axes);
}

int motion_arclen_check(const struct motion_arclen_curve *curve)
{
    if (curve->pieces == 0)
        return MOTION_E_EMPTY;
    if (curve->axes < 1 || curve->axes > MOTION_ARCLEN_AXES)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < curve->pieces; i++) {
        if (motion_real_cmp(curve->border[i + 1], curve->border[i]) <= 0)
            return MOTION_E_ORDER;
    }
    return MOTION_OK;
}

/* Abscissae and weights of the 8-point rule on -1 .. 1, Q2.62; the other four
 * are their mirror images. */
static const struct {
    int64_t at_q62, weight_q62;
} arclen_node[ARCLEN_GAUSS_POINTS / 2] = {
    { INT64_C(845942976092414579), INT64_C(1672583732916339423) },
    { INT64_C(2423590467041585129), INT64_C(1446716552682804564) },
    { INT64_C(3673975655238220854), INT64_C(1025551507352046283) },
    { INT64_C(4428555304847330560), INT64_C(466834225476197634) },
};

struct motion_real arclen_gauss(const struct motion_arclen_curve *curve,
                                uint32_t piece, struct motion_real x,
                                struct motion_real h)
{
    const struct motion_real half = motion_real_half(h);
    const struct motion_real middle = motion_real_add(x, half);
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < ARCLEN_GAUSS_POINTS / 2; i++) {
        const struct motion_real off = motion_real_mul(
            half, motion_real_from_q(arclen_node[i].at_q62, 62));
        const struct motion_real both = motion_real_add(
            motion_arclen_speed(curve, piece, motion_real_sub(middle, off)),
            motion_arclen_speed(curve, piece, motion_real_add(middle, off)));
        sum = motion_real_add(
            sum, motion_real_mul(
                     both, motion_real_from_q(arclen_node[i].weight_q62, 62)));
    }
    return motion_real_mul(sum, half);
}

/* --- equal panels --------------------------------------------------------- */

static struct motion_real arclen_chord(const struct motion_arclen_curve *curve,
                                       uint32_t piece, struct motion_real x,
                                       struct motion_real h)
{
    struct motion_arclen_point a, b;

    curve->at(curve->context, piece, x, 0, &a);
    curve->at(curve->context, piece, motion_real_add(x, h), 0, &b);
    for (uint32_t i = 0; i < curve->axes; i++)
        b.pos[i] = motion_real_sub(b.pos[i], a.pos[i]);
    return arclen_norm(b.pos, curve->axes);
}

static struct motion_real arclen_panel(const struct motion_arclen_curve *curve,
                                       enum motion_arclen_rule rule,
                                       uint32_t piece, struct motion_real x,
                                       struct motion_real h)
{
    const struct motion_real half = motion_real_half(h);
    struct motion_real sum;

    if (rule == MOTION_ARCLEN_GAUSS)
        return arclen_gauss(curve, piece, x, h);
    if (rule == MOTION_ARCLEN_CHORDS)
        return arclen_chord(curve, piece, x, h);
    sum = motion_arclen_speed(curve, piece, x);
    if (rule == MOTION_ARCLEN_RECTANGLE)
        return motion_real_mul(sum, h);
    sum = motion_real_add(
        sum, motion_arclen_speed(curve, piece, motion_real_add(x, h)));
    if (rule == MOTION_ARCLEN_TRAPEZOID)
        return motion_real_mul(sum, half);
    sum = motion_real_add(
        sum,
        motion_real_scale(
            motion_arclen_speed(curve, piece, motion_real_add(x, half)), 2));
    return motion_real_div(motion_real_mul(sum, h), motion_real_int(6));
}

/* What a rule costs: places that two panels share are looked at once by who
 * counts, though not here. */
static uint32_t arclen_cost(enum motion_arclen_rule rule, uint32_t panels)
{
    switch (rule) {
    case MOTION_ARCLEN_RECTANGLE:
        return panels;
    case MOTION_ARCLEN_SIMPSON:
        return 2 * panels + 1;
    case MOTION_ARCLEN_GAUSS:
        return ARCLEN_GAUSS_POINTS * panels;
    default:
        return panels + 1;
    }
}

static struct motion_real arclen_sum(const struct motion_arclen_curve *curve,
                                     enum motion_arclen_rule rule,
                                     uint32_t panels)
{
    struct motion_real sum = motion_real_zero();

    for (uint32_t piece = 0; piece < curve->pieces; piece++) {
        const struct motion_real h = motion_real_div(arclen_width(curve, piece),
                                                     motion_real_int(panels));
        for (uint32_t i = 0; i < panels; i++)
            sum = motion_real_add(
                sum, arclen_panel(curve, rule, piece,
                                  motion_real_mul(h, motion_real_int(i)), h));
    }
    return sum;
}

static int arclen_adaptive(const struct motion_arclen_curve *curve,
                           struct motion_arclen_measure *result)
{
    struct motion_arclen_table table = { .curve = curve };
    int err = arclen_walk(&table, motion_real_zero());

    if (err == MOTION_OK)
        *result = (struct motion_arclen_measure){ table.length, table.error,
                                                  table.evaluations };
    return err;
}

int motion_arclen_measure(const struct motion_arclen_curve *curve,
                          enum motion_arclen_rule rule, uint32_t panels,
                          struct motion_arclen_measure *result)
{
    int err = motion_arclen_check(curve);

    if (err < 0)
        return err;
    if (rule == MOTION_ARCLEN_ADAPTIVE)
        return arclen_adaptive(curve, result);
    if ((unsigned)rule > MOTION_ARCLEN_ADAPTIVE || panels < 2 || panels % 2 ||
        panels > ARCLEN_PANELS_MAX)
        return MOTION_E_ARG;
    result->length = arclen_sum(curve, rule, panels);
    result->error = motion_real_abs(
        motion_real_sub(result->length, arclen_sum(curve, rule, panels / 2)));
    result->evaluations =
        curve->pieces * (rule == MOTION_ARCLEN_GAUSS
                             ? ARCLEN_GAUSS_POINTS * (panels + panels / 2)
                             : arclen_cost(rule, panels));
    return MOTION_OK;
}

/* --- by length ------------------------------------------------------------ */

static struct motion_real arclen_dot(const struct motion_real a[],
                                     const struct motion_real b[],
                                     uint32_t axes)
{
    struct motion_real sum = motion_real_zero();

    for (uint32_t i = 0; i < axes; i++)
        sum = motion_real_add(sum, motion_real_mul(a[i], b[i]));
    return sum;
}

/* Where P' is zero, P' = P'' dx on either side: the tangent is P'' going in,
 * -P'' coming to the end of a piece. */
static void arclen_by_length_still(const struct motion_arclen_curve *curve,
                                   uint32_t piece, struct motion_real x,
                                   struct motion_arclen_point *point)
{
    const struct motion_real norm = arclen_norm(point->d2, curve->axes);
    const bool in =
        motion_real_cmp(motion_real_twice(x), arclen_width(curve, piece)) < 0;

    for (uint32_t i = 0; i < curve->axes; i++) {
        point->d1[i] = motion_real_is_zero(norm)
                           ? norm
                           : motion_real_div(point->d2[i], norm);
        if (!in)
            point->d1[i] = motion_real_neg(point->d1[i]);
        point->d2[i] = motion_real_zero();
    }
}

/* T = P'/|P'|, dT/ds = (P'' - T (T . P'')) / |P'|^2 */
void motion_arclen_by_length(const struct motion_arclen_curve *curve,
                             uint32_t piece, struct motion_real x,
                             struct motion_arclen_point *point)
{
    curve->at(curve->context, piece, x, 2, point);
    const struct motion_real speed = arclen_norm(point->d1, curve->axes);
    if (motion_real_is_zero(speed)) {
        arclen_by_length_still(curve, piece, x, point);
        return;
    }
    const struct motion_real per = motion_real_div(motion_real_int(1), speed);
    const struct motion_real square = motion_real_sqr(per);
    for (uint32_t i = 0; i < curve->axes; i++)
        point->d1[i] = motion_real_mul(point->d1[i], per);
    const struct motion_real along =
        arclen_dot(point->d1, point->d2, curve->axes);
    for (uint32_t i = 0; i < curve->axes; i++)
        point->d2[i] = motion_real_mul(
            motion_real_sub(point->d2[i], motion_real_mul(point->d1[i], along)),
            square);
}
