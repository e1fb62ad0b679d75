/* motion/kinematics/rail.c - a rail through points; see carrier.h.
 *
 * The place on the rail nearest to a pivot q is where (P(s) - q) T(s) = 0; with
 * K = dT/ds Newton's method on it is
 *
 *     s <- s - (P - q) T / (1 + (P - q) K)
 *
 * and from within the rail's curvature it converges quadratically.  It starts at
 * the coordinate before, and where that leads nowhere at the nearest of samples
 * along the rail. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/kinematics/carrier.h"
#include "motion/number/trig.h"

#define RAIL_STEPS   12 /* of Newton */
#define RAIL_SAMPLES 8  /* between two rows of the table */
#define RAIL_DONE    34 /* bits of the last step */

static uint32_t rail_axes(const struct motion_carrier *carrier)
{
    (void)carrier;
    return 1;
}

static void rail_at(const struct motion_rail *rail, struct motion_real s,
                    struct motion_arclen_point *point)
{
    struct motion_arclen_place place;

    motion_arclen_find(rail->table, s, &place);
    motion_arclen_by_length(rail->table->curve, place.piece, place.x, point);
}

static struct motion_vec rail_vec(const struct motion_real x[])
{
    return (struct motion_vec){ { x[0], x[1], x[2] } };
}

/* Of the tangent about the vertical. */
static int64_t rail_heading_turn(const struct motion_arclen_point *point)
{
    return motion_trig_atan2_real(point->d1[1], point->d1[0]);
}

static int rail_place(const struct motion_carrier *carrier,
                      const int64_t *axis_q32, struct motion_mount *mount)
{
    const struct motion_dir up = { { 0, 0, (int64_t)1 << 62 } };
    const struct motion_rail *const rail = &carrier->as.rail;
    struct motion_arclen_point start, point;
    int64_t at_q32;
    int err = motion_axis_coordinate(&rail->axis, axis_q32[0], &at_q32);

    if (err < 0)
        return err;
    if (at_q32 < 0 ||
        motion_real_lt(rail->table->length, motion_real_from_q(at_q32, 32)))
        return MOTION_E_LIMIT;
    rail_at(rail, motion_real_from_q(at_q32, 32), &point);
    *mount = (struct motion_mount){ rail_vec(point.pos), carrier->level };
    if (!rail->is_turning)
        return MOTION_OK;
    rail_at(rail, motion_real_zero(), &start);
    mount->level = motion_quat_mul(
        motion_quat_about(up, motion_trig_diff(rail_heading_turn(&point),
                                               rail_heading_turn(&start))),
        mount->level);
    return MOTION_OK;
}

/* ---- the place nearest to a pivot ---------------------------------------- */

static struct motion_real rail_clamp(const struct motion_rail *rail,
                                     struct motion_real s)
{
    return motion_real_min(motion_real_max(s, motion_real_zero()),
                           rail->table->length);
}

/* Improve *s; true when the rail is at the pivot there. */
static bool rail_approach(const struct motion_rail *rail,
                          struct motion_vec pivot, struct motion_real *s)
{
    const struct motion_real done = motion_real_make(1, -RAIL_DONE);
    struct motion_arclen_point point;

    for (int i = 0; i < RAIL_STEPS; i++) {
        rail_at(rail, *s, &point);
        const struct motion_vec off =
            motion_vec_sub(rail_vec(point.pos), pivot);
        const struct motion_real slope = motion_real_add(
            motion_real_int(1), motion_vec_dot(off, rail_vec(point.d2)));
        if (motion_real_sign(slope) <= 0)
            return false;
        const struct motion_real step =
            motion_real_div(motion_vec_dot(off, rail_vec(point.d1)), slope);
        *s = rail_clamp(rail, motion_real_sub(*s, step));
        if (motion_real_lt(motion_real_abs(step), done))
            break;
    }
    rail_at(rail, *s, &point);
    return motion_mount_is_near(
        motion_vec_length(motion_vec_sub(rail_vec(point.pos), pivot)));
}

/* The nearest of samples. */
static struct motion_real rail_sample(const struct motion_rail *rail,
                                      struct motion_vec pivot)
{
    const struct motion_arclen_row *row = rail->table->row;
    struct motion_real best = motion_real_zero(), least = motion_real_zero();
    bool is_any = false;

    for (uint32_t i = 0; i + 1 < rail->table->count; i++)
        for (int k = 0; k <= RAIL_SAMPLES; k++) {
            const struct motion_real s = motion_real_add(
                row[i].s,
                motion_real_scale(
                    motion_real_mul(motion_real_int(k),
                                    motion_real_sub(row[i + 1].s, row[i].s)),
                    -3));
            struct motion_arclen_point point;
            rail_at(rail, s, &point);
            const struct motion_real far =
                motion_vec_length(motion_vec_sub(rail_vec(point.pos), pivot));
            if (is_any && !motion_real_lt(far, least))
                continue;
            is_any = true;
            least = far;
            best = s;
        }
    return best;
}

static int rail_find(const struct motion_carrier *carrier,
                     struct motion_vec pivot, const int64_t *before_q32,
                     int64_t *axis_q32)
{
    const struct motion_rail *const rail = &carrier->as.rail;
    struct motion_real s = motion_real_zero();
    int64_t near_q32;
    bool is_found = false;

    if (before_q32 != NULL && motion_axis_coordinate(&rail->axis, before_q32[0],
                                                     &near_q32) == MOTION_OK) {
        s = rail_clamp(rail, motion_real_from_q(near_q32, 32));
        is_found = rail_approach(rail, pivot, &s);
    }
    if (!is_found) {
        s = rail_sample(rail, pivot);
        is_found = rail_approach(rail, pivot, &s);
    }
    return is_found ? motion_axis_position_real(&rail->axis, s, axis_q32)
                    : MOTION_E_UNREACHABLE;
}

const struct motion_carrier_kind motion_carrier_rail = {
    .axes = rail_axes,
    .place = rail_place,
    .find = rail_find,
};
