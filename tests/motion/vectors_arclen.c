/* tests/motion/vectors_arclen.c - arclength.json; see vectors.h.
 *
 * Per kind of curve three rows, all as fractions of the length:
 *   KIND.length   p: length and every s(u) of the table
 *                 v: speed, of the largest
 *   KIND.inverse  p: distance of P(U(s)) from the point given; and of U(s) from
 *                 the parameter given times the speed there, which is the same
 *                 length along the curve and means nothing at a cusp
 *   KIND.even     v: what lies between two lengths, in 2000 equal steps, over
 *                 the step: how constant a constant speed is */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/path/arclen.h"
#include "tests/motion/vectors_json.h"

#define PIECES_MAX 4096
#define DEGREE_MAX 15
#define ROWS_MAX   200000
#define STEPS      2000

/* A curve given by a formula with constants. */
struct formula {
    struct motion_real a, b, c, p, q, u0;
};

static struct motion_arclen_row row[ROWS_MAX];
static struct motion_real border[PIECES_MAX + 1];
static struct motion_real coef[PIECES_MAX * 3 * (DEGREE_MAX + 1)];

typedef struct motion_real real;

/* --- formulas ------------------------------------------------------------- */

static real times(real a, real b)
{
    return motion_real_mul(a, b);
}

static real signed_q62(int64_t a_q62, bool negative)
{
    const real a = motion_real_from_q(a_q62, 62);
    return negative ? motion_real_neg(a) : a;
}

/* Of an angle in radian. */
static void sincos_of(real angle, real *sine, real *cosine)
{
    const real pi_2 = motion_real_from_q(INT64_C(7244019458077122842), 62);
    const real quarters = motion_real_div(angle, pi_2);
    int64_t whole = 0, part = 0, s, c;

    (void)motion_real_floor(quarters, 0, &whole);
    (void)motion_real_floor(motion_real_sub(quarters, motion_real_int(whole)),
                            62, &part);
    motion_fixed_sincos_q62((uint64_t)part, &s, &c);
    *sine = signed_q62(whole & 1 ? c : s, whole & 2);
    *cosine = signed_q62(whole & 1 ? s : c, (whole + 1) & 2);
}

/* size sin(k u) and size cos(k u), two derivatives */
static void wave(struct motion_arclen_point *point, int axis, real size, real k,
                 real u, bool is_cos)
{
    real s, c;

    sincos_of(times(k, u), &s, &c);
    if (is_cos) {
        const real sine = s;
        s = c;
        c = motion_real_neg(sine);
    }
    point->pos[axis] = times(size, s);
    point->d1[axis] = times(size, times(k, c));
    point->d2[axis] = motion_real_neg(times(k, times(k, point->pos[axis])));
}

static real parameter(const struct formula *f, real x)
{
    return motion_real_add(f->u0, x);
}

static void ellipse_at(const void *context, uint32_t piece, real x, int order,
                       struct motion_arclen_point *point)
{
    const struct formula *f = context;
    const real u = parameter(f, x), one = motion_real_int(1);

    (void)piece, (void)order;
    wave(point, 0, f->a, one, u, true);
    wave(point, 1, f->b, one, u, false);
    point->pos[2] = point->d1[2] = point->d2[2] = motion_real_zero();
}

static void helix_at(const void *context, uint32_t piece, real x, int order,
                     struct motion_arclen_point *point)
{
    const struct formula *f = context;
    const real u = parameter(f, x), one = motion_real_int(1);

    (void)piece, (void)order;
    wave(point, 0, f->a, one, u, true);
    wave(point, 1, f->a, one, u, false);
    point->pos[2] = times(f->b, u);
    point->d1[2] = f->b;
    point->d2[2] = motion_real_zero();
}

static void lissajous_at(const void *context, uint32_t piece, real x, int order,
                         struct motion_arclen_point *point)
{
    const struct formula *f = context;
    const real u = parameter(f, x), one = motion_real_int(1);

    (void)piece, (void)order;
    wave(point, 0, one, f->a, u, false);
    wave(point, 1, one, f->b, u, false);
    wave(point, 2, one, f->c, u, true);
}

/* (2 + cos q u) cos p u and so on, by the product rule; point->*[2] is sin q u
 * and r is its cosine. */
static void torus_knot_at(const void *context, uint32_t piece, real x,
                          int order, struct motion_arclen_point *point)
{
    const struct formula *f = context;
    const real u = parameter(f, x), one = motion_real_int(1);
    struct motion_arclen_point r;

    (void)piece, (void)order;
    wave(&r, 0, one, f->q, u, true);
    r.pos[0] = motion_real_add(r.pos[0], motion_real_int(2));
    wave(point, 0, one, f->p, u, true);
    wave(point, 1, one, f->p, u, false);
    wave(point, 2, one, f->q, u, false);
    for (int i = 0; i < 2; i++) {
        point->d2[i] = motion_real_add(
            motion_real_add(times(r.d2[0], point->pos[i]),
                            motion_real_twice(times(r.d1[0], point->d1[i]))),
            times(r.pos[0], point->d2[i]));
        point->d1[i] = motion_real_add(times(r.d1[0], point->pos[i]),
                                       times(r.pos[0], point->d1[i]));
        point->pos[i] = times(r.pos[0], point->pos[i]);
    }
}

static const struct {
    const char *kind;
    void (*at)(const void *context, uint32_t piece, real x, int order,
               struct motion_arclen_point *point);
} formulas[] = {
    { "ellipse", ellipse_at },
    { "helix", helix_at },
    { "lissajous", lissajous_at },
    { "torus_knot", torus_knot_at },
};

/* --- reading -------------------------------------------------------------- */

static bool read_poly(const cJSON *json, struct motion_arclen_curve *curve,
                      struct motion_arclen_poly *poly)
{
    const cJSON *breaks = vectors_get(json, "breaks"),
                *list = vectors_get(json, "coef");
    const int pieces = cJSON_GetArraySize(list);
    const int axes = cJSON_GetArraySize(cJSON_GetArrayItem(list, 0));
    int size = 1;

    if (pieces < 1 || pieces > PIECES_MAX || axes < 1 || axes > 3 ||
        cJSON_GetArraySize(breaks) != pieces + 1)
        return false;
    for (int i = 0; i <= pieces; i++)
        border[i] = vectors_real(cJSON_GetArrayItem(breaks, i)->valuedouble);
    for (int i = 0; i < pieces * axes; i++) {
        const int n = cJSON_GetArraySize(
            cJSON_GetArrayItem(cJSON_GetArrayItem(list, i / axes), i % axes));
        size = n > size ? n : size;
    }
    if (size > DEGREE_MAX + 1)
        return false;
    for (int i = 0; i < pieces * axes; i++) {
        const cJSON *c =
            cJSON_GetArrayItem(cJSON_GetArrayItem(list, i / axes), i % axes);
        for (int k = 0; k < size; k++)
            coef[i * size + k] =
                k < cJSON_GetArraySize(c)
                    ? vectors_real(cJSON_GetArrayItem(c, k)->valuedouble)
                    : motion_real_zero();
    }
    *poly =
        (struct motion_arclen_poly){ coef, (uint32_t)size - 1, (uint32_t)axes };
    *curve =
        (struct motion_arclen_curve){ (uint32_t)axes, (uint32_t)pieces, border,
                                      motion_arclen_poly_at, poly };
    return true;
}

static double constant(const cJSON *json, const char *name)
{
    return vectors_get(json, name) ? vectors_value_of(json, name) : 0;
}

static bool read_formula(const cJSON *json, const char *kind,
                         struct motion_arclen_curve *curve, struct formula *f)
{
    border[0] = vectors_real(vectors_value_of(json, "u0"));
    border[1] = vectors_real(vectors_value_of(json, "u1"));
    *f = (struct formula){
        vectors_real(constant(json, "a")), vectors_real(constant(json, "b")),
        vectors_real(constant(json, "c")), vectors_real(constant(json, "p")),
        vectors_real(constant(json, "q")), border[0]
    };
    for (size_t i = 0; i < sizeof formulas / sizeof formulas[0]; i++) {
        if (strcmp(kind, formulas[i].kind) == 0) {
            *curve =
                (struct motion_arclen_curve){ 3, 1, border, formulas[i].at, f };
            return true;
        }
    }
    return false;
}

/* --- comparing ------------------------------------------------------------ */

/* Piece and x of a parameter. */
static uint32_t locate(const struct motion_arclen_curve *curve, double u,
                       real *x)
{
    const real at = vectors_real(u);
    uint32_t piece = 0;

    while (piece + 1 < curve->pieces &&
           motion_real_cmp(at, curve->border[piece + 1]) >= 0)
        piece++;
    *x = motion_real_sub(at, curve->border[piece]);
    return piece;
}

/* Simpson's rule with as many panels as it takes: slow, but not the rule that
 * is judged. */
static double simpson(const struct motion_arclen_curve *curve, uint32_t piece,
                      double low, double high)
{
    double before = -1, sum = 0;

    for (int n = 4; n <= 4096; n *= 2) {
        const double h = (high - low) / n;
        sum = 0;
        for (int i = 0; i <= n; i++)
            sum += (i % n == 0 ? 1
                    : i % 2    ? 4
                               : 2) *
                   vectors_double(motion_arclen_speed(
                       curve, piece, vectors_real(low + h * i)));
        sum *= h / 3;
        if (fabs(sum - before) <= 1e-9 * sum)
            break;
        before = sum;
    }
    return sum;
}

/* Length of the curve from one place to a later one. */
static double between(const struct motion_arclen_curve *curve,
                      const struct motion_arclen_place *a,
                      const struct motion_arclen_place *b)
{
    double sum = 0, low = vectors_double(a->x);

    for (uint32_t k = a->piece; k < b->piece; k++, low = 0)
        sum += simpson(curve, k, low,
                       vectors_double(motion_real_sub(curve->border[k + 1],
                                                      curve->border[k])));
    return sum + simpson(curve, b->piece, low, vectors_double(b->x));
}

/* Where the inverse is at the length that a parameter has: how far from it, along
 * the curve. */
static double length_off(const struct motion_arclen_table *table, double u,
                         double s)
{
    struct motion_arclen_place want, got;

    want.piece = locate(table->curve, u, &want.x);
    motion_arclen_find(table, vectors_real(s), &got);
    const bool is_before =
        got.piece < want.piece ||
        (got.piece == want.piece && motion_real_cmp(got.x, want.x) < 0);
    return between(table->curve, is_before ? &got : &want,
                   is_before ? &want : &got);
}

static bool compare_length(const cJSON *json,
                           const struct motion_arclen_table *table,
                           struct vectors_row *out)
{
    const cJSON *u = vectors_get(json, "u"), *s = vectors_get(json, "s"),
                *v = vectors_get(json, "speed");
    const double length = vectors_value_of(json, "length");
    const int n = cJSON_GetArraySize(u);
    double fastest = 0, worst = 0;

    if (n == 0 || cJSON_GetArraySize(s) != n || cJSON_GetArraySize(v) != n)
        return false;
    vectors_worst(&out->worst_p,
                  fabs(vectors_double(table->length) - length) / length);
    for (int i = 0; i < n; i++) {
        const double at = cJSON_GetArrayItem(u, i)->valuedouble,
                     speed = cJSON_GetArrayItem(v, i)->valuedouble;
        real x;
        const uint32_t piece = locate(table->curve, at, &x);

        vectors_worst(
            &out->worst_p,
            length_off(table, at, cJSON_GetArrayItem(s, i)->valuedouble) /
                length);
        vectors_worst(
            &worst,
            fabs(vectors_double(motion_arclen_speed(table->curve, piece, x)) -
                 speed));
        fastest = fmax(fastest, speed);
    }
    vectors_worst(&out->worst_v, worst / fastest);
    return true;
}

static bool compare_inverse(const cJSON *json,
                            const struct motion_arclen_table *table,
                            struct vectors_row *out)
{
    const cJSON *fraction = vectors_get(json, "inv_fraction"),
                *u = vectors_get(json, "inv_u"),
                *p = vectors_get(json, "inv_p");
    const double length = vectors_value_of(json, "length");
    const int n = cJSON_GetArraySize(fraction);

    if (n == 0 || cJSON_GetArraySize(u) != n || cJSON_GetArraySize(p) != n)
        return false;
    for (int i = 0; i < n; i++) {
        const cJSON *want = cJSON_GetArrayItem(p, i);
        struct motion_arclen_place place;
        struct motion_arclen_point point;
        double off = 0;

        motion_arclen_find(
            table,
            vectors_real(length * cJSON_GetArrayItem(fraction, i)->valuedouble),
            &place);
        table->curve->at(table->curve->context, place.piece, place.x, 0,
                         &point);
        for (uint32_t k = 0; k < table->curve->axes; k++)
            off = hypot(off, vectors_double(point.pos[k]) -
                                 cJSON_GetArrayItem(want, (int)k)->valuedouble);
        vectors_worst(&out->worst_p, off / length);
        off = vectors_double(
                  motion_real_add(place.x, table->curve->border[place.piece])) -
              cJSON_GetArrayItem(u, i)->valuedouble;
        off *= vectors_double(
            motion_arclen_speed(table->curve, place.piece, place.x));
        vectors_worst(&out->worst_p, fabs(off) / length);
    }
    return true;
}

static void compare_even(const struct motion_arclen_table *table,
                         struct vectors_row *out)
{
    const double ds = vectors_double(table->length) / STEPS;
    struct motion_arclen_place from, to;

    motion_arclen_find(table, motion_real_zero(), &from);
    for (int i = 1; i <= STEPS; i++, from = to) {
        motion_arclen_find(table, vectors_real(ds * i), &to);
        vectors_worst(&out->worst_v,
                      fabs(between(table->curve, &from, &to) / ds - 1));
    }
}

static const struct {
    const char *what;
    double tolerance;
} rows_of[] = { { "length", 1e-9 }, { "inverse", 1e-8 }, { "even", 1e-7 } };

static bool run_case(const cJSON *json, struct vectors_row *rows, int capacity,
                     int *count)
{
    const char *kind = cJSON_GetStringValue(vectors_get(json, "kind"));
    struct motion_arclen_curve curve;
    struct motion_arclen_poly poly;
    struct motion_arclen_table table;
    struct formula formula;
    struct vectors_row *out[3];

    if (kind == NULL || !(strcmp(kind, "ppoly") == 0
                              ? read_poly(json, &curve, &poly)
                              : read_formula(json, kind, &curve, &formula)))
        return false;
    if (motion_arclen_build(&table, &curve, motion_real_zero(), row, ROWS_MAX) <
        0)
        return false;
    for (int i = 0; i < 3; i++) {
        char name[sizeof rows->method];
        snprintf(name, sizeof name, "%.20s.%s", kind, rows_of[i].what);
        out[i] =
            vectors_row_of(rows, capacity, count, name, rows_of[i].tolerance);
        if (out[i] == NULL)
            return false;
        out[i]->cases++;
    }
    compare_even(&table, out[2]);
    return compare_length(json, &table, out[0]) &&
           compare_inverse(json, &table, out[1]);
}

int vectors_arclength(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *list = vectors_get(file, "cases"), *json;
    int count = 0;

    cJSON_ArrayForEach(json, list)
    {
        if (!run_case(json, rows, capacity, &count)) {
            const char *name = cJSON_GetStringValue(vectors_get(json, "name"));
            fprintf(stderr, "arclength: %s: not a curve that is known\n",
                    name ? name : "?");
            return -1;
        }
    }
    vectors_judge(rows, count);
    return count;
}
