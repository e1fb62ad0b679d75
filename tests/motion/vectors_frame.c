/* tests/motion/vectors_frame.c - frames.json; see vectors.h. */
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/path/arclen.h"
#include "motion/path/frame.h"
#include "motion/path/lookat.h"
#include "tests/motion/path/frame_walk.h"
#include "tests/motion/vectors_json.h"

#define ROWS_MAX    256
#define PIECES_MAX  256
#define COEFS_MAX   2048
#define WAVES_MAX   8
#define LENGTHS_MAX 16384
#define U_BITS      54 /* of the parameter: +-512 */

static int64_t to_u(double u)
{
    return (int64_t)llrint(ldexp(u, U_BITS));
}

/* --- curves -------------------------------------------------------------- */

/* A sum of size cos(n u - quarter quarters of a turn), and slope u. */
struct wave {
    int axis;
    double size;
    double n;
    int quarter;
};

struct waves {
    struct wave wave[WAVES_MAX];
    int count;
    double slope[3];
};

/* Over border[i] .. border[i + 1], with w = 0 .. 1: the sum of coef[i][k] w^k. */
struct poly {
    const int64_t *border;         /* pieces + 1 */
    const struct motion_vec *coef; /* pieces x (degree + 1) */
    uint32_t pieces, degree;
};

struct shape {
    struct frame_curve curve;
    struct poly poly;
    struct waves waves;
    int64_t border[PIECES_MAX + 1];
    struct motion_vec coef[COEFS_MAX];
};

static int waves_at(const void *context, int64_t u, int order,
                    struct motion_curve_point *point)
{
    const struct waves *const waves = context;
    struct motion_vec *const d[4] = { &point->pos, &point->d1, &point->d2,
                                      &point->d3 };
    const struct motion_real rad = motion_real_from_q(u, U_BITS);
    (void)order;

    for (int i = 0; i < 4; i++)
        *d[i] = motion_vec_zero();
    for (int i = 0; i < 3; i++) {
        point->d1.x[i] = vectors_real(waves->slope[i]);
        point->pos.x[i] = motion_real_mul(point->d1.x[i], rad);
    }
    for (int w = 0; w < waves->count; w++) {
        const struct wave *const wave = &waves->wave[w];
        const struct motion_real n = vectors_real(wave->n);
        const int64_t angle = motion_trig_from_rad(motion_real_mul(n, rad));
        struct motion_real size = vectors_real(wave->size);

        for (int i = 0; i < 4; i++) {
            int64_t s, c;
            /* d/du cos(a) = n cos(a + quarter) */
            motion_trig_sincos((int64_t)((uint64_t)angle +
                                         ((uint64_t)(i - wave->quarter) << 62)),
                               &s, &c);
            d[i]->x[wave->axis] = motion_real_add(
                d[i]->x[wave->axis],
                motion_real_mul(size, motion_real_from_q(c, 62)));
            size = motion_real_mul(size, n);
        }
    }
    return MOTION_OK;
}

static void add_wave(struct shape *shape, int axis, double size, double n,
                     int quarter)
{
    shape->waves.wave[shape->waves.count++] =
        (struct wave){ axis, size, n, quarter };
}

static bool read_waves(const cJSON *item, const char *kind, struct shape *shape)
{
    double a = 0, b = 0, c = 0;

    shape->waves = (struct waves){ .count = 0 };
    if (strcmp(kind, "torus_knot") == 0) {
        if (!vectors_number(item, "p", &a) || !vectors_number(item, "q", &b))
            return false;
        for (int i = 0; i < 2; i++) { /* cos, then sin */
            add_wave(shape, i, 2, a, i);
            add_wave(shape, i, 0.5, a + b, i);
            add_wave(shape, i, 0.5, a - b, i);
        }
        add_wave(shape, 2, 1, b, 1);
    } else {
        if (!vectors_number(item, "a", &a) || !vectors_number(item, "b", &b))
            return false;
        if (strcmp(kind, "ellipse") == 0 || strcmp(kind, "helix") == 0) {
            const bool helix = kind[0] == 'h';
            add_wave(shape, 0, a, 1, 0);
            add_wave(shape, 1, helix ? a : b, 1, 1);
            shape->waves.slope[2] = helix ? b : 0;
        } else if (strcmp(kind, "lissajous") == 0 &&
                   vectors_number(item, "c", &c)) {
            add_wave(shape, 0, 1, a, 1);
            add_wave(shape, 1, 1, b, 1);
            add_wave(shape, 2, 1, c, 0);
        } else {
            return false;
        }
    }
    shape->curve.at = waves_at;
    shape->curve.context = &shape->waves;
    return true;
}

/* Horner's scheme for the value and its derivatives / k!: each one takes the
 * one below before that is multiplied on. */
static int poly_at(const void *context, int64_t u, int order,
                   struct motion_curve_point *point)
{
    const struct poly *const poly = context;
    const struct motion_vec *coef = poly->coef;
    const int64_t *border = poly->border;
    struct motion_vec d[4];
    (void)order;

    for (; border + 2 <= poly->border + poly->pieces && u >= border[1];
         border++)
        coef += poly->degree + 1;
    const struct motion_real w =
        motion_real_div(motion_real_from_q(u - border[0], U_BITS),
                        motion_real_from_q(border[1] - border[0], U_BITS));
    for (int i = 0; i < 4; i++)
        d[i] = motion_vec_zero();
    for (uint32_t k = poly->degree + 1; k-- > 0;) {
        for (int i = 3; i > 0; i--)
            d[i] = motion_vec_add(motion_vec_scale(d[i], w), d[i - 1]);
        d[0] = motion_vec_add(motion_vec_scale(d[0], w), coef[k]);
    }
    *point = (struct motion_curve_point){
        .pos = d[0],
        .d1 = d[1],
        .d2 = motion_vec_shift(d[2], 1),
        .d3 = motion_vec_scale(d[3], motion_real_int(6)),
    };
    return MOTION_OK;
}

/* Coefficients of (u - border)^k become those of w^k. */
static bool read_piece(const cJSON *axes, double width, uint32_t degree,
                       struct motion_vec *coef)
{
    for (int axis = 0; axis < 3; axis++) {
        const cJSON *const power = cJSON_GetArrayItem(axes, axis);
        struct motion_real scale = motion_real_int(1);

        if (cJSON_GetArraySize(power) > (int)degree + 1)
            return false;
        for (uint32_t k = 0; k <= degree; k++) {
            const cJSON *const a = cJSON_GetArrayItem(power, (int)k);
            coef[k].x[axis] = motion_real_mul(
                vectors_real(a != NULL ? a->valuedouble : 0), scale);
            scale = motion_real_mul(scale, vectors_real(width));
        }
    }
    return true;
}

static bool read_poly(const cJSON *item, struct shape *shape)
{
    const cJSON *const coef = cJSON_GetObjectItemCaseSensitive(item, "coef");
    const int pieces = cJSON_GetArraySize(coef);
    double border[PIECES_MAX + 1];
    uint32_t degree = 0;

    if (pieces < 1 || pieces > PIECES_MAX ||
        !vectors_numbers(cJSON_GetObjectItemCaseSensitive(item, "breaks"),
                         pieces + 1, border))
        return false;
    for (int i = 0; i < 3 * pieces; i++) {
        const int size = cJSON_GetArraySize(
            cJSON_GetArrayItem(cJSON_GetArrayItem(coef, i / 3), i % 3));
        if (size > (int)degree + 1)
            degree = (uint32_t)size - 1;
    }
    if ((uint32_t)pieces * (degree + 1) > COEFS_MAX)
        return false;
    for (int i = 0; i <= pieces; i++)
        shape->border[i] = to_u(border[i]);
    for (int i = 0; i < pieces; i++) {
        if (!read_piece(cJSON_GetArrayItem(coef, i), border[i + 1] - border[i],
                        degree, &shape->coef[(uint32_t)i * (degree + 1)]))
            return false;
    }
    shape->poly =
        (struct poly){ shape->border, shape->coef, (uint32_t)pieces, degree };
    shape->curve =
        (struct frame_curve){ poly_at, &shape->poly, shape->border[0],
                              shape->border[pieces] };
    return true;
}

/* Reads into static storage, so at most as many shapes as are named. */
static bool read_shape(const cJSON *item, struct shape *shape)
{
    const char *const kind = vectors_text(item, "kind");
    double u0, u1;

    if (!vectors_number(item, "u0", &u0) || !vectors_number(item, "u1", &u1))
        return false;
    if (strcmp(kind, "ppoly") == 0)
        return read_poly(item, shape);
    if (!read_waves(item, kind, shape))
        return false;
    shape->curve.first = to_u(u0);
    shape->curve.last = to_u(u1);
    return true;
}

/* --- comparing ----------------------------------------------------------- */

static double dir_error(struct motion_dir got, const double want[3])
{
    double error = 0;

    for (int i = 0; i < 3; i++)
        vectors_worst(&error, fabs(ldexp((double)got.q62[i], -62) - want[i]));
    return error;
}

static bool item_vec(const cJSON *list, int i, double to[3])
{
    return vectors_numbers(cJSON_GetArrayItem(list, i), 3, to);
}

static struct motion_dir read_dir(const double a[3])
{
    struct motion_dir dir = { { 0, 0, 0 } };

    (void)motion_vec_unit(vectors_vec(a), &dir);
    return dir;
}

static double largest_of(const cJSON *list)
{
    const cJSON *item;
    double most = 1;

    cJSON_ArrayForEach(item, list)
    {
        if (cJSON_IsNumber(item))
            most = fmax(most, fabs(item->valuedouble));
    }
    return most;
}

/* --- Frenet and rotation-minimising frames ------------------------------- */

struct frame_case {
    const cJSON *item;
    struct shape shape;
    int64_t u[ROWS_MAX];
    int rows;
};

static bool tangent_rows(const struct frame_case *c, struct vectors_row *row)
{
    const cJSON *const p = cJSON_GetObjectItemCaseSensitive(c->item, "P");
    const cJSON *const t = cJSON_GetObjectItemCaseSensitive(c->item, "T");
    double most = 1, a[3], b[3];

    for (int i = 0; i < c->rows; i++) {
        if (!item_vec(p, i, a) || !item_vec(t, i, b))
            return false;
        most = fmax(most, fmax(fabs(a[0]), fmax(fabs(a[1]), fabs(a[2]))));
    }
    for (int i = 0; i < c->rows; i++) {
        struct motion_curve_point point;
        struct motion_dir tangent;

        if (!item_vec(p, i, a) || !item_vec(t, i, b) ||
            frame_tangent(&c->shape.curve, c->u[i], &point, &tangent) < 0)
            return false;
        vectors_worst(&row->worst_v, dir_error(tangent, b));
        for (int k = 0; k < 3; k++)
            vectors_worst(&row->worst_p,
                          fabs(vectors_double(point.pos.x[k]) - a[k]) / most);
    }
    return true;
}

static bool frenet_rows(const struct frame_case *c, struct vectors_row *row)
{
    const cJSON *const want =
        cJSON_GetObjectItemCaseSensitive(c->item, "frenet");
    const cJSON *const curvature =
        cJSON_GetObjectItemCaseSensitive(want, "curvature");
    const cJSON *const torsion =
        cJSON_GetObjectItemCaseSensitive(want, "torsion");
    const cJSON *const n = cJSON_GetObjectItemCaseSensitive(want, "N");
    const cJSON *const b = cJSON_GetObjectItemCaseSensitive(want, "B");

    for (int i = 0; i < c->rows; i++) {
        const cJSON *const k = cJSON_GetArrayItem(curvature, i);
        const cJSON *const tau = cJSON_GetArrayItem(torsion, i);
        struct motion_curve_point point;
        struct motion_frenet f;
        double a[3];
        int err = c->shape.curve.at(c->shape.curve.context, c->u[i], 3, &point);

        if (err == MOTION_OK)
            err = motion_frame_frenet(&point, &f);
        if (!cJSON_IsNumber(k)) { /* at rest, or no curvature at all */
            row->pass = row->pass && err != MOTION_FRENET_OK;
            continue;
        }
        if (err < 0)
            return false;
        vectors_worst(&row->worst_v,
                      fabs(vectors_double(f.curvature) - k->valuedouble) /
                          largest_of(curvature));
        if (cJSON_IsNull(tau) || cJSON_IsNull(cJSON_GetArrayItem(n, i))) {
            row->pass = row->pass && err == MOTION_FRENET_FLAT;
            continue;
        }
        row->pass = row->pass && err == MOTION_FRENET_OK;
        vectors_worst(&row->worst_a,
                      fabs(vectors_double(f.torsion) - tau->valuedouble) /
                          largest_of(torsion));
        if (!item_vec(n, i, a))
            return false;
        vectors_worst(&row->worst_p, dir_error(f.n, a));
        if (!item_vec(b, i, a))
            return false;
        vectors_worst(&row->worst_p, dir_error(f.b, a));
    }
    return true;
}

static bool first_frame(const struct frame_case *c, const cJSON *r,
                        struct motion_frame *frame)
{
    const cJSON *const t = cJSON_GetObjectItemCaseSensitive(c->item, "T");
    double a[3], b[3];

    return item_vec(t, 0, a) && item_vec(r, 0, b) &&
           motion_frame_start(read_dir(a), read_dir(b), frame) == MOTION_OK;
}

static bool compare_r(const struct frame_case *c, const cJSON *r,
                      const struct motion_frame *frame, struct vectors_row *row)
{
    double a[3];

    for (int i = 0; i < c->rows; i++) {
        if (!item_vec(r, i, a))
            return false;
        vectors_worst(&row->worst_p, dir_error(frame[i].r, a));
    }
    return true;
}

static bool reflection_rows(const struct frame_case *c, struct vectors_row *row)
{
    const cJSON *const r =
        cJSON_GetObjectItemCaseSensitive(c->item, "rmf_double_reflection_r");
    struct motion_frame frame[ROWS_MAX];

    return first_frame(c, r, &frame[0]) &&
           frame_table(&c->shape.curve, c->u, (uint32_t)c->rows, frame) ==
               MOTION_OK &&
           compare_r(c, r, frame, row);
}

static bool exact_frames(const struct frame_case *c, struct motion_frame *frame)
{
    const cJSON *const r =
        cJSON_GetObjectItemCaseSensitive(c->item, "rmf_exact_r");

    if (!first_frame(c, r, &frame[0]))
        return false;
    for (int i = 1; i < c->rows; i++) {
        frame[i] = frame[i - 1];
        if (frame_carry(&c->shape.curve, c->u[i - 1], c->u[i], &frame[i]) < 0)
            return false;
    }
    return true;
}

static bool exact_rows(const struct frame_case *c, struct vectors_row *row)
{
    struct motion_frame frame[ROWS_MAX];

    return exact_frames(c, frame) &&
           compare_r(c,
                     cJSON_GetObjectItemCaseSensitive(c->item, "rmf_exact_r"),
                     frame, row);
}

/* The twist, and that nothing is left of it. */
static bool closed_rows(const struct frame_case *c, struct vectors_row *row)
{
    const cJSON *const want =
        cJSON_GetObjectItemCaseSensitive(c->item, "closed_twist_rad");
    struct motion_frame frame[ROWS_MAX];

    if (cJSON_IsNull(want))
        return true;
    if (!exact_frames(c, frame))
        return false;
    const int64_t twist = motion_frame_twist(&frame[0], &frame[c->rows - 1]);
    motion_frame_turn(&frame[c->rows - 1], motion_trig_diff(0, twist));
    vectors_worst(&row->worst_p, fabs(vectors_double(motion_trig_rad(twist)) -
                                      want->valuedouble));
    for (int i = 0; i < 3; i++)
        vectors_worst(&row->worst_p,
                      ldexp(fabs((double)(frame[0].r.q62[i] -
                                          frame[c->rows - 1].r.q62[i])),
                            -62));
    row->cases++;
    return true;
}

static const struct {
    const char *method;
    bool (*run)(const struct frame_case *c, struct vectors_row *row);
} frame_methods[] = {
    { "tangent", tangent_rows },
    { "frenet", frenet_rows },
    { "rmf_double_reflection", reflection_rows },
    { "rmf_exact", exact_rows },
    { "rmf_closed_twist", closed_rows },
};

static bool frame_case(const cJSON *item, struct vectors_row *rows,
                       int capacity, int *count)
{
    static struct frame_case c;
    const cJSON *const u = cJSON_GetObjectItemCaseSensitive(item, "u");

    c.item = item;
    c.rows = cJSON_GetArraySize(u);
    if (c.rows < 2 || c.rows > ROWS_MAX || !read_shape(item, &c.shape))
        return false;
    for (int i = 0; i < c.rows; i++) {
        c.u[i] = to_u(cJSON_GetNumberValue(cJSON_GetArrayItem(u, i)));
        if (c.u[i] < c.shape.curve.first)
            c.u[i] = c.shape.curve.first;
        if (c.u[i] > c.shape.curve.last)
            c.u[i] = c.shape.curve.last;
    }
    for (size_t i = 0; i < sizeof frame_methods / sizeof *frame_methods; i++) {
        struct vectors_row *const row = vectors_row_of(
            rows, capacity, count, frame_methods[i].method, 1e-8);
        if (row == NULL || !frame_methods[i].run(&c, row))
            return false;
        row->cases += frame_methods[i].run != closed_rows;
    }
    return true;
}

/* --- look-at ------------------------------------------------------------- */

/* A shape by its length.  Pieces of polynomials run over 0 .. 1 each. */
struct length {
    const struct shape *shape;
    struct motion_real border[PIECES_MAX + 1];
    struct motion_real coef[3 * COEFS_MAX];
    struct motion_arclen_poly poly;
    struct motion_arclen_curve curve;
    struct motion_arclen_row row[LENGTHS_MAX];
    struct motion_arclen_table table;
};

/* The shape's parameter at x of a piece. */
static int64_t length_u(const struct length *length, uint32_t piece,
                        struct motion_real x)
{
    const struct frame_curve *const curve = &length->shape->curve;
    const int64_t *const border = length->shape->border;
    int64_t first = curve->first, last = curve->last, u;

    if (curve->context == &length->shape->poly) {
        first = border[piece];
        last = border[piece + 1];
        x = motion_real_mul(x, motion_real_from_q(last - first, U_BITS));
    }
    if (motion_real_round(x, U_BITS, &u) != MOTION_OK || u > last - first)
        return last;
    return u < 0 ? first : first + u;
}

static void length_waves_at(const void *context, uint32_t piece,
                            struct motion_real x, int order,
                            struct motion_arclen_point *point)
{
    const struct length *const length = context;
    struct motion_curve_point at;

    (void)waves_at(&length->shape->waves, length_u(length, piece, x), order,
                   &at);
    for (int i = 0; i < 3; i++) {
        point->pos[i] = at.pos.x[i];
        point->d1[i] = at.d1.x[i];
        point->d2[i] = at.d2.x[i];
    }
}

static void length_of_waves(struct length *length)
{
    const struct frame_curve *const curve = &length->shape->curve;

    length->border[0] = motion_real_from_q(curve->first, U_BITS);
    length->border[1] = motion_real_from_q(curve->last, U_BITS);
    length->curve = (struct motion_arclen_curve){ 3, 1, length->border,
                                                  length_waves_at, length };
}

static void length_of_poly(struct length *length)
{
    const struct poly *const poly = &length->shape->poly;
    const uint32_t size = poly->degree + 1;

    for (uint32_t i = 0; i <= poly->pieces; i++)
        length->border[i] = motion_real_int(i);
    for (uint32_t i = 0; i < poly->pieces * size; i++)
        for (uint32_t axis = 0; axis < 3; axis++)
            length->coef[(i / size * 3 + axis) * size + i % size] =
                poly->coef[i].x[axis];
    length->poly = (struct motion_arclen_poly){ length->coef, poly->degree, 3 };
    length->curve =
        (struct motion_arclen_curve){ 3, poly->pieces, length->border,
                                      motion_arclen_poly_at, &length->poly };
}

static bool length_init(struct length *length, const struct shape *shape)
{
    length->shape = shape;
    if (shape->curve.context == &shape->poly)
        length_of_poly(length);
    else
        length_of_waves(length);
    return motion_arclen_build(&length->table, &length->curve,
                               motion_real_zero(), length->row,
                               LENGTHS_MAX) == MOTION_OK;
}

static int path_at(const void *context, int64_t distance_q32,
                   struct motion_vec *pos, struct motion_dir *tangent)
{
    const struct length *const length = context;
    const struct frame_curve *const curve = &length->shape->curve;
    struct motion_arclen_place place;
    struct motion_curve_point point;
    struct motion_dir along;
    int64_t u;
    int err;

    motion_arclen_find(&length->table, motion_real_from_q(distance_q32, 32),
                       &place);
    u = length_u(length, place.piece, place.x);
    err = frame_tangent(curve, u, &point, tangent != NULL ? tangent : &along);
    *pos = point.pos;
    return err;
}

static bool read_path(const cJSON *cases, const char *name, struct shape *shape,
                      struct length *length, struct motion_lookat_path *path)
{
    const cJSON *item;

    cJSON_ArrayForEach(item, cases)
    {
        if (strcmp(vectors_text(item, "name"), name) != 0)
            continue;
        *path = (struct motion_lookat_path){ path_at, length, 0 };
        return read_shape(item, shape) && length_init(length, shape) &&
               motion_real_round(length->table.length, 32, &path->length_q32) ==
                   MOTION_OK;
    }
    return false;
}

/* A fraction of the path's length. */
static int64_t along(const struct motion_lookat_path *path, double fraction)
{
    int64_t distance_q32;

    if (motion_real_round(
            motion_real_mul(vectors_real(fraction),
                            motion_real_from_q(path->length_q32, 32)),
            32, &distance_q32) != MOTION_OK)
        return path->length_q32;
    return distance_q32;
}

static void to_q32(const double a[3], int64_t q32[3])
{
    for (int i = 0; i < 3; i++)
        q32[i] = (int64_t)llrint(ldexp(a[i], 32));
}

static bool read_dwells(const cJSON *item,
                        const struct motion_lookat_path *path,
                        struct motion_dwell *dwell,
                        struct motion_target *target)
{
    const cJSON *const points =
        cJSON_GetObjectItemCaseSensitive(item, "coi_points");
    const cJSON *const rests = cJSON_GetObjectItemCaseSensitive(item, "dwell");
    const int count = cJSON_GetArraySize(points);

    if (count < 1 || count > ROWS_MAX || cJSON_GetArraySize(rests) != count)
        return false;
    for (int i = 0; i < count; i++) {
        double a[3], rest[2];
        if (!item_vec(points, i, a) ||
            !vectors_numbers(cJSON_GetArrayItem(rests, i), 2, rest))
            return false;
        to_q32(a, dwell[i].point_q32);
        dwell[i].from_q32 = along(path, rest[0]);
        dwell[i].to_q32 = along(path, rest[1]);
    }
    target->kind = MOTION_TARGET_DWELL;
    target->dwell = dwell;
    target->dwells = (uint32_t)count;
    return true;
}

struct lookat_case {
    struct shape shape[2];
    struct length length[2];
    struct motion_lookat_path path[2];
    struct motion_dwell dwell[ROWS_MAX];
    struct motion_target target;
};

static bool read_target(const cJSON *cases, const cJSON *item, const char *mode,
                        struct lookat_case *c)
{
    double a[3], fraction;

    c->target = (struct motion_target){ .kind = MOTION_TARGET_FIXED };
    if (strcmp(mode, "fixed_coi") == 0) {
        if (!vectors_numbers(cJSON_GetObjectItemCaseSensitive(item, "coi"), 3,
                             a))
            return false;
        to_q32(a, c->target.point_q32);
        return true;
    }
    if (strcmp(mode, "look_ahead") == 0) {
        c->target.kind = MOTION_TARGET_AHEAD;
        if (!vectors_number(item, "delta_s_fraction", &fraction))
            return false;
        c->target.ahead_q32 = along(&c->path[0], fraction);
        return true;
    }
    if (strcmp(mode, "separate_coi_path") == 0) {
        c->target.kind = MOTION_TARGET_PATH;
        c->target.path = &c->path[1];
        return read_path(cases, vectors_text(item, "coi_path"), &c->shape[1],
                         &c->length[1], &c->path[1]);
    }
    return strcmp(mode, "dwelling_coi") == 0 &&
           read_dwells(item, &c->path[0], c->dwell, &c->target);
}

static double quat_off(struct motion_quat got, const double want[4])
{
    const int64_t g[4] = { got.w, got.x, got.y, got.z };
    double error[2] = { 0, 0 };

    for (int i = 0; i < 4; i++) {
        vectors_worst(&error[0], fabs(ldexp((double)g[i], -62) - want[i]));
        vectors_worst(&error[1], fabs(ldexp((double)g[i], -62) + want[i]));
    }
    return fmin(error[0], error[1]);
}

static bool lookat_row(const struct lookat_case *c,
                       const struct motion_lookat *lookat,
                       struct motion_lookat_state *state, const cJSON *line,
                       struct vectors_row *row)
{
    static const char *const name[3] = { "right", "up", "w" };
    struct motion_view view;
    double s, a[3], q[4];

    if (!vectors_number(line, "s", &s) ||
        !vectors_numbers(cJSON_GetObjectItemCaseSensitive(line, "q_wxyz"), 4,
                         q) ||
        motion_lookat_at(lookat, state, &c->target, &c->path[0],
                         along(&c->path[0], s), 0, &view) < 0)
        return false;
    const struct motion_dir got[3] = { view.right, view.up, view.view };
    for (int i = 0; i < 3; i++) {
        if (!vectors_numbers(cJSON_GetObjectItemCaseSensitive(line, name[i]), 3,
                             a))
            return false;
        vectors_worst(&row->worst_p, dir_error(got[i], a));
    }
    vectors_worst(&row->worst_p, quat_off(motion_view_quat(&view), q));
    return true;
}

static bool lookat_case(const cJSON *cases, const cJSON *item, const char *mode,
                        struct vectors_row *row)
{
    static struct lookat_case c;
    struct motion_lookat_state state = { .valid = false };
    struct motion_lookat lookat = { .pole = MOTION_POLE_CARRY };
    const cJSON *line;
    double up[3];

    if (!vectors_numbers(cJSON_GetObjectItemCaseSensitive(item, "world_up"), 3,
                         up) ||
        !read_path(cases, vectors_text(item, "path"), &c.shape[0], &c.length[0],
                   &c.path[0]) ||
        !read_target(cases, item, mode, &c))
        return false;
    lookat.up = read_dir(up);
    /* any direction that is not up */
    lookat.ahead = read_dir((const double[]){ up[1], up[2], up[0] });
    cJSON_ArrayForEach(line, cJSON_GetObjectItemCaseSensitive(item, "rows"))
    {
        if (!lookat_row(&c, &lookat, &state, line, row))
            return false;
    }
    row->cases++;
    return true;
}

int vectors_frames(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *const cases = cJSON_GetObjectItemCaseSensitive(file, "cases");
    const cJSON *item;
    int count = 0;

    cJSON_ArrayForEach(item, cases)
    {
        const char *const mode = vectors_text(item, "mode");

        if (mode[0] == '\0') {
            if (!frame_case(item, rows, capacity, &count))
                return -1;
            continue;
        }
        struct vectors_row *const row =
            vectors_row_of(rows, capacity, &count, mode, 1e-8);
        if (row == NULL || !lookat_case(cases, item, mode, row))
            return -1;
    }
    vectors_judge(rows, count);
    return count;
}
