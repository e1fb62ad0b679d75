/* motion/plan/rig/plan_rig.c - see plan_rig.h. */
#include "motion/plan/rig/plan_rig.h"

#include "motion/core/err.h"
#include "motion/curve/bake.h"
#include "motion/double/double_math.h"
#include "motion/plan/rig/plan_arm.h"

/* A direction shorter than this, of its distance, is none. */
#define RIG_POLE 1e-9

static const double rig_x[3] = { 1, 0, 0 }, rig_y[3] = { 0, 1, 0 },
                    rig_z[3] = { 0, 0, 1 };

double plan_rig_real(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

struct motion_real plan_rig_from_double(double a)
{
    int exponent = 0;
    const double mantissa = frexp(a, &exponent);

    return motion_real_make((int64_t)ldexp(mantissa, 60), exponent - 60);
}

static double rig_q32(int64_t a)
{
    return ldexp((double)a, -32);
}

static struct plan_jet_vec rig_vec(struct motion_vec v)
{
    const double x[3] = { plan_rig_real(v.x[0]), plan_rig_real(v.x[1]),
                          plan_rig_real(v.x[2]) };

    return plan_jet_vec_of(x);
}

struct plan_jet plan_rig_track(const struct motion_track *track,
                               int64_t t_ns_q12, int side)
{
    if (t_ns_q12 > track->end_ns_q12 ||
        (t_ns_q12 == track->end_ns_q12 && side > 0) || track->count == 0)
        return plan_jet_of(plan_rig_real(motion_bake_end(track)));
    const struct motion_bake_point point =
        motion_bake_track(track, t_ns_q12, (enum motion_bake_side)side);
    return (struct plan_jet){ plan_rig_real(point.pos),
                              plan_rig_real(point.vel),
                              plan_rig_real(point.acc) };
}

struct plan_jet plan_rig_coordinate(const struct motion_axis_map *map,
                                    struct plan_jet axis)
{
    return plan_jet_add(plan_jet_scale(axis, map->is_reversed ? -1 : 1),
                        plan_jet_of(rig_q32(map->offset_q32)));
}

struct plan_jet plan_rig_position(const struct motion_axis_map *map,
                                  struct plan_jet coordinate)
{
    return plan_jet_scale(
        plan_jet_sub(coordinate, plan_jet_of(rig_q32(map->offset_q32))),
        map->is_reversed ? -1 : 1);
}

/* ---- carriers ------------------------------------------------------------ */

static void rig_turn_frame(struct plan_rig_frame *frame, const double axis[3],
                           struct plan_jet angle)
{
    frame->forward = plan_jet_vec_turn(frame->forward, axis, angle);
    frame->left = plan_jet_vec_turn(frame->left, axis, angle);
    frame->up = plan_jet_vec_turn(frame->up, axis, angle);
}

static void rig_linear(const struct motion_carrier *carrier,
                       const struct plan_jet axis[], struct plan_jet_vec *pivot,
                       struct plan_rig_frame *mount)
{
    const struct motion_linear *linear = &carrier->as.linear;

    (void)mount;
    *pivot = rig_vec(linear->origin);
    for (uint32_t i = 0; i < linear->count; i++)
        *pivot = plan_jet_vec_add(
            *pivot,
            plan_jet_vec_mul(rig_vec(motion_vec_from_dir(linear->direction[i])),
                             plan_rig_coordinate(&linear->axis[i], axis[i])));
}

static void rig_arc(const struct motion_carrier *carrier,
                    const struct plan_jet axis[], struct plan_jet_vec *pivot,
                    struct plan_rig_frame *mount)
{
    const struct motion_arc *arc = &carrier->as.arc;
    const double radius = rig_q32(arc->radius_q32);
    const struct plan_jet angle =
        plan_jet_scale(plan_rig_coordinate(&arc->axis, axis[0]), 1 / radius);
    double normal[3];

    for (int i = 0; i < 3; i++)
        normal[i] = ldexp((double)arc->normal.q62[i], -62);
    *pivot = plan_jet_vec_add(
        rig_vec(arc->centre),
        plan_jet_vec_mul(
            plan_jet_vec_turn(rig_vec(motion_vec_from_dir(arc->start)), normal,
                              angle),
            plan_jet_of(radius)));
    if (arc->is_turning)
        rig_turn_frame(mount, normal, angle);
}

/* A polynomial, or its derivative of an order, at x. */
static struct plan_jet rig_poly(const struct motion_real coef[],
                                uint32_t degree, uint32_t order,
                                struct plan_jet x)
{
    struct plan_jet sum = plan_jet_of(0);

    for (uint32_t n = degree + 1; n-- > order;) {
        double c = plan_rig_real(coef[n]);
        for (uint32_t k = 0; k < order; k++)
            c *= n - k;
        sum = plan_jet_add(plan_jet_mul(sum, x), plan_jet_of(c));
    }
    return sum;
}

/* Where a rail is at a length, and its tangent, of any length: with
 * sigma = |P'(u)|, u' = s' / sigma, u'' = (s'' - sigma' u'^2) / sigma. */
static void rig_rail_at(const struct motion_arclen_table *table,
                        struct plan_jet s, struct plan_jet_vec *pos,
                        struct plan_jet_vec *tangent)
{
    const struct motion_arclen_poly *poly = table->curve->context;
    const struct motion_real *coef = poly->coef;
    struct motion_arclen_place place;
    double square = 0, bend = 0;

    motion_arclen_find(table, plan_rig_from_double(s.p), &place);
    coef += (size_t)place.piece * poly->axes * (poly->degree + 1);
    struct plan_jet u = plan_jet_of(plan_rig_real(place.x));
    for (uint32_t i = 0; i < 3; i++) {
        const struct motion_real *c = coef + (size_t)i * (poly->degree + 1);
        const double first = rig_poly(c, poly->degree, 1, u).p;
        square += first * first;
        bend += first * rig_poly(c, poly->degree, 2, u).p;
    }
    u.v = s.v / sqrt(square);
    u.a = s.a / sqrt(square) - bend / square * u.v * u.v;
    for (uint32_t i = 0; i < 3; i++) {
        const struct motion_real *c = coef + (size_t)i * (poly->degree + 1);
        pos->x[i] = rig_poly(c, poly->degree, 0, u);
        tangent->x[i] = rig_poly(c, poly->degree, 1, u);
    }
}

static void rig_rail(const struct motion_carrier *carrier,
                     const struct plan_jet axis[], struct plan_jet_vec *pivot,
                     struct plan_rig_frame *mount)
{
    const struct motion_rail *rail = &carrier->as.rail;
    struct plan_jet_vec start, first, tangent;

    rig_rail_at(rail->table, plan_rig_coordinate(&rail->axis, axis[0]), pivot,
                &tangent);
    if (!rail->is_turning)
        return;
    rig_rail_at(rail->table, plan_jet_of(0), &start, &first);
    rig_turn_frame(mount, rig_z,
                   plan_jet_sub(plan_jet_atan2(tangent.x[1], tangent.x[0]),
                                plan_jet_atan2(first.x[1], first.x[0])));
}

static void rig_gantry(const struct motion_carrier *carrier,
                       const struct plan_jet axis[], struct plan_jet_vec *pivot,
                       struct plan_rig_frame *mount)
{
    const struct motion_gantry *gantry = &carrier->as.gantry;
    const double y1 = rig_q32(gantry->at_y_q32[0]),
                 y2 = rig_q32(gantry->at_y_q32[1]);
    struct plan_jet at[4];

    for (int i = 0; i < 4; i++)
        at[i] = plan_rig_coordinate(&gantry->axis[i], axis[i]);
    const struct plan_jet slope =
        plan_jet_scale(plan_jet_sub(at[1], at[0]), 1 / (y2 - y1));
    const struct plan_jet along =
        plan_jet_mul(plan_jet_sub(at[2], plan_jet_of(y1)),
                     plan_jet_invert(plan_jet_sqrt(plan_jet_add(
                         plan_jet_of(1), plan_jet_mul(slope, slope)))));
    *pivot = (struct plan_jet_vec){ {
        plan_jet_add(at[0], plan_jet_mul(along, slope)),
        plan_jet_add(plan_jet_of(y1), along),
        at[3],
    } };
    rig_turn_frame(mount, rig_z,
                   plan_jet_scale(plan_jet_atan2(slope, plan_jet_of(1)), -1));
}

static struct plan_jet_vec rig_boom(struct plan_jet_vec v, struct plan_jet pan,
                                    struct plan_jet tilt)
{
    return plan_jet_vec_turn(
        plan_jet_vec_turn(v, rig_y, plan_jet_scale(tilt, -1)), rig_z, pan);
}

static void rig_jib(const struct motion_carrier *carrier,
                    const struct plan_jet axis[], struct plan_jet_vec *pivot,
                    struct plan_rig_frame *mount)
{
    const struct motion_jib *jib = &carrier->as.jib;
    const struct plan_jet zero = plan_jet_of(0);
    const struct plan_jet pan = plan_jet_scale(
        plan_rig_coordinate(&jib->axis[0], axis[0]), DOUBLE_RADIAN);
    const struct plan_jet tilt = plan_jet_scale(
        plan_rig_coordinate(&jib->axis[1], axis[1]), DOUBLE_RADIAN);
    const struct plan_jet length =
        plan_jet_add(plan_jet_of(rig_q32(jib->length_q32)),
                     plan_rig_coordinate(&jib->axis[2], axis[2]));
    /* what turns the head */
    const struct plan_jet head_pan =
        jib->mount == MOTION_JIB_SPACE ? zero : pan;
    const struct plan_jet head_tilt =
        jib->mount == MOTION_JIB_BOOM ? tilt : zero;

    *pivot = plan_jet_vec_add(
        plan_jet_vec_add(
            rig_vec(jib->foot),
            plan_jet_vec_mul(rig_boom(plan_jet_vec_of(rig_x), pan, tilt),
                             length)),
        rig_boom(rig_vec(jib->drop), head_pan, head_tilt));
    mount->forward = rig_boom(mount->forward, head_pan, head_tilt);
    mount->left = rig_boom(mount->left, head_pan, head_tilt);
    mount->up = rig_boom(mount->up, head_pan, head_tilt);
}

typedef void rig_place(const struct motion_carrier *carrier,
                       const struct plan_jet axis[], struct plan_jet_vec *pivot,
                       struct plan_rig_frame *mount);

static const struct {
    const struct motion_carrier_kind *kind;
    rig_place *place;
} rig_kinds[] = {
    { &motion_carrier_linear, rig_linear },
    { &motion_carrier_arc, rig_arc },
    { &motion_carrier_rail, rig_rail },
    { &motion_carrier_gantry, rig_gantry },
    { &motion_carrier_jib, rig_jib },
};

/* Camera's frame: x right, y up, z backwards. */
static struct plan_jet_vec rig_level(struct motion_quat level, int axis,
                                     int64_t sign)
{
    struct motion_dir dir = { { 0, 0, 0 } };

    dir.q62[axis] = sign * ((int64_t)1 << 62);
    return rig_vec(motion_vec_from_dir(motion_quat_turn(level, dir)));
}

void plan_rig_mount(const struct motion_carrier *carrier,
                    const struct plan_jet axis[], struct plan_jet_vec *pivot,
                    struct plan_rig_frame *mount)
{
    mount->forward = rig_level(carrier->level, 2, -1);
    mount->left = rig_level(carrier->level, 0, -1);
    mount->up = rig_level(carrier->level, 1, 1);
    for (size_t i = 0; i < sizeof rig_kinds / sizeof *rig_kinds; i++)
        if (rig_kinds[i].kind == carrier->kind)
            rig_kinds[i].place(carrier, axis, pivot, mount);
}

struct plan_jet_vec plan_rig_on_table(const struct plan_rig *rig,
                                      struct plan_jet table,
                                      struct plan_jet_vec point)
{
    double centre[3];

    for (int i = 0; i < 3; i++)
        centre[i] = rig_q32(rig->centre_q32[i]);
    return plan_jet_vec_add(
        plan_jet_vec_of(centre),
        plan_jet_vec_turn(
            point, rig_z,
            plan_jet_scale(plan_rig_coordinate(&rig->table_map, table),
                           DOUBLE_RADIAN)));
}

/* ---- the head ------------------------------------------------------------ */

/* sqrt(square - leg^2), false where there is none. */
static bool rig_leg(struct plan_jet square, struct plan_jet leg,
                    struct plan_jet *other)
{
    const struct plan_jet rest = plan_jet_sub(square, plan_jet_mul(leg, leg));

    if (!(rest.p > RIG_POLE * RIG_POLE * square.p))
        return false;
    *other = plan_jet_sqrt(rest);
    return true;
}

/* Tracking in closed form.  With roll given, the pupil is at (n, l, u) from the
 * pivot in the frame that tilts (forward, left, up) and the view runs along its
 * first axis, so a subject at distance t is at v = (n + t, l, u) there and at
 * d = Rz(pan) Ry(-tilt) v in the mount.  Then
 *
 *     |d|^2 = X^2 + l^2 + u^2                       X = n + t
 *     d_up  = A sin(tilt + phi)                     X = A cos phi, u = A sin phi
 *     W     = A cos(tilt + phi), W^2 + l^2 = d_forward^2 + d_left^2
 *     pan   = angle(d_forward, d_left) - angle(W, l)
 *
 * with X > 0 (the subject before the pivot) and W > 0 (upright). */
int plan_rig_look(const struct motion_nodal *nodal,
                  const struct plan_rig_frame *mount, struct plan_jet_vec off,
                  struct plan_jet roll, struct plan_rig_aim *aim)
{
    const double right = rig_q32(nodal->right_q32),
                 above = rig_q32(nodal->up_q32);
    const struct plan_jet s = plan_jet_sin(roll), c = plan_jet_cos(roll);
    const struct plan_jet x = plan_jet_vec_dot(off, mount->forward),
                          y = plan_jet_vec_dot(off, mount->left),
                          z = plan_jet_vec_dot(off, mount->up);
    /* of the pupil, in the frame that tilts: Rx(roll) (-right, above) */
    const struct plan_jet left =
        plan_jet_sub(plan_jet_scale(c, -right), plan_jet_scale(s, above));
    const struct plan_jet up =
        plan_jet_add(plan_jet_scale(s, -right), plan_jet_scale(c, above));
    const struct plan_jet flat =
        plan_jet_add(plan_jet_mul(x, x), plan_jet_mul(y, y));
    const struct plan_jet square = plan_jet_add(flat, plan_jet_mul(z, z));
    struct plan_jet w, view;

    if (!(flat.p > RIG_POLE * RIG_POLE * square.p))
        return MOTION_E_SINGULAR;
    if (!rig_leg(flat, left, &w) ||
        !rig_leg(plan_jet_add(plan_jet_mul(w, w), plan_jet_mul(z, z)), up,
                 &view))
        return MOTION_E_UNREACHABLE;
    aim->distance =
        plan_jet_sub(view, plan_jet_of(rig_q32(nodal->forward_q32)));
    if (!(aim->distance.p > rig_q32(MOTION_KINEMATICS_NEAR_Q32)))
        return aim->distance.p < 0 ? MOTION_E_UNREACHABLE : MOTION_E_SINGULAR;
    aim->pan = plan_jet_sub(plan_jet_atan2(y, x), plan_jet_atan2(left, w));
    aim->tilt = plan_jet_sub(plan_jet_atan2(z, w), plan_jet_atan2(up, view));
    return MOTION_OK;
}

static void rig_arm_at(const struct plan_arm *arm,
                       const struct motion_track track[], int64_t t_ns_q12,
                       struct plan_rig_camera *camera)
{
    struct plan_jet joint[MOTION_ARM_JOINTS_MAX];

    for (uint32_t i = 0; i < arm->arm.count; i++)
        joint[i] =
            arm->axis[i].is_given
                ? plan_arm_joint(arm, i,
                                 plan_rig_track(&track[arm->axis[i].axis],
                                                t_ns_q12, MOTION_BAKE_LEFT))
                : plan_jet_of(0);
    plan_arm_camera(arm, joint, camera);
}

void plan_rig_camera_at(const struct plan_rig *rig,
                        const struct motion_track track[], int64_t t_ns_q12,
                        struct plan_rig_camera *camera)
{
    if (rig->arm.arm.count > 0) {
        rig_arm_at(&rig->arm, track, t_ns_q12, camera);
        return;
    }
    const struct motion_nodal *nodal = &rig->rig.head.nodal;
    struct plan_jet axis[MOTION_CARRIER_AXES_MAX], angle[MOTION_HEAD_AXES];
    struct plan_rig_frame *frame = &camera->frame;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        axis[i] = rig->carrier[i].is_given
                      ? plan_rig_track(&track[rig->carrier[i].axis], t_ns_q12,
                                       MOTION_BAKE_LEFT)
                      : plan_jet_of(0);
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        angle[i] = rig->head[i].is_given
                       ? plan_jet_scale(
                             plan_rig_coordinate(
                                 &rig->rig.head.axis[i],
                                 plan_rig_track(&track[rig->head[i].axis],
                                                t_ns_q12, MOTION_BAKE_LEFT)),
                             DOUBLE_RADIAN)
                       : plan_jet_of(0);
    plan_rig_mount(&rig->rig.carrier, axis, &camera->pupil, frame);
    plan_jet_vec_swing(&frame->forward, &frame->left, angle[MOTION_HEAD_PAN]);
    plan_jet_vec_swing(&frame->forward, &frame->up, angle[MOTION_HEAD_TILT]);
    plan_jet_vec_swing(&frame->left, &frame->up, angle[MOTION_HEAD_ROLL]);
    camera->pupil = plan_jet_vec_add(
        plan_jet_vec_add(
            camera->pupil,
            plan_jet_vec_mul(frame->forward,
                             plan_jet_of(rig_q32(nodal->forward_q32)))),
        plan_jet_vec_sub(
            plan_jet_vec_mul(frame->up, plan_jet_of(rig_q32(nodal->up_q32))),
            plan_jet_vec_mul(frame->left,
                             plan_jet_of(rig_q32(nodal->right_q32)))));
}
