/* motion/plan/camera/plan_carry.c - see plan_carry.h. */
#include "motion/plan/camera/plan_carry.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_along.h"

/* Of the largest pivot of the normal equations: below, axes are not determined. */
#define CARRY_SINGULAR 1e-12
#define CARRY_UNKNOWNS 3

struct carry_row {
    int64_t axis_q32[MOTION_CARRIER_AXES_MAX];
};

struct carry {
    const struct plan_path *path;
    const struct plan_rig *rig;
    struct plan_along along;
    struct carry_row *row; /* rows + 1 */
    /* Axes that move as one, the two motors of a gantry: the unknown of each,
     * or none. */
    int unknown[MOTION_CARRIER_AXES_MAX], unknowns;
};

static const char *carry_refusal(int err)
{
    switch (err) {
    case MOTION_E_UNREACHABLE:
    case MOTION_E_LIMIT:
        return "the path is out of reach of what carries the head";
    case MOTION_E_SINGULAR:
        return "the axes that carry the head are not determined by the path";
    case MOTION_E_TOLERANCE:
        return "the axes that carry the head would have to be too fast to be "
               "planned: go slower, or stay away from where they turn over";
    default:
        return NULL;
    }
}

/* ---- positions ----------------------------------------------------------- */

static struct plan_jet_vec carry_place(const struct carry *self, int64_t t,
                                       int side)
{
    struct plan_jet_vec at;

    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        at.x[i] = plan_rig_track(&self->along.place[i], t, side);
    return at;
}

/* Axes that the rig lacks are where they count from. */
static bool carry_is_still(const struct carry *self, const int64_t axis_q32[])
{
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (!self->rig->carrier[i].is_given &&
            motion_fixed_abs(axis_q32[i]) >
                (uint64_t)MOTION_KINEMATICS_NEAR_Q32)
            return false;
    return true;
}

static int carry_find(const struct carry *self, struct plan_jet_vec at,
                      const int64_t *before_q32, int64_t axis_q32[])
{
    const struct motion_carrier *carrier = &self->rig->rig.carrier;
    struct motion_vec pivot;

    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        pivot.x[i] = plan_rig_from_double(at.x[i].p);
    int err = carrier->kind->find(carrier, pivot, before_q32, axis_q32);
    return err == MOTION_OK && !carry_is_still(self, axis_q32)
               ? MOTION_E_UNREACHABLE
               : err;
}

static int carry_begin(void *context)
{
    struct carry *self = context;

    self->row = calloc((size_t)self->along.rows + 1, sizeof *self->row);
    return self->row != NULL ? MOTION_OK : MOTION_E_FULL;
}

/* Whole turns go on from row to row. */
static int carry_row(void *context, uint32_t row, int64_t t)
{
    const struct carry *self = context;

    return carry_find(self, carry_place(self, t, MOTION_BAKE_LEFT),
                      row == 0 ? NULL : self->row[row - 1].axis_q32,
                      self->row[row].axis_q32);
}

/* ---- derivatives --------------------------------------------------------- */

/* Solve a x = b, symmetric; false when x is not determined. */
static bool carry_solve(int n, double a[CARRY_UNKNOWNS][CARRY_UNKNOWNS],
                        double b[CARRY_UNKNOWNS])
{
    double largest = 0;

    for (int i = 0; i < n; i++)
        largest = fmax(largest, a[i][i]);
    for (int i = 0; i < n; i++) {
        if (!(a[i][i] > CARRY_SINGULAR * largest))
            return false;
        for (int k = i + 1; k < n; k++) {
            const double ratio = a[k][i] / a[i][i];
            for (int j = i; j < n; j++)
                a[k][j] -= ratio * a[i][j];
            b[k] -= ratio * b[i];
        }
    }
    for (int i = n; i-- > 0;) {
        for (int j = i + 1; j < n; j++)
            b[i] -= a[i][j] * b[j];
        b[i] /= a[i][i];
    }
    return true;
}

static struct plan_jet_vec carry_pivot(const struct carry *self,
                                       const struct plan_jet axis[])
{
    struct plan_rig_frame mount;
    struct plan_jet_vec pivot = { { { 0, 0, 0 } } };

    plan_rig_mount(&self->rig->rig.carrier, axis, &pivot, &mount);
    return pivot;
}

/* Column u of the Jacobian: the velocity when only that unknown moves. */
static void carry_column(const struct carry *self, const struct plan_jet axis[],
                         int u, double column[3])
{
    struct plan_jet moved[MOTION_CARRIER_AXES_MAX];
    struct plan_jet_vec pivot;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        moved[i] =
            (struct plan_jet){ axis[i].p, self->unknown[i] == u ? 1 : 0, 0 };
    pivot = carry_pivot(self, moved);
    for (int k = 0; k < 3; k++)
        column[k] = pivot.x[k].v;
}

/* The unknowns' rates with which the pivot has a rate. */
static bool carry_rates(int n, double column[CARRY_UNKNOWNS][3],
                        const double rate[3], double x[CARRY_UNKNOWNS])
{
    double a[CARRY_UNKNOWNS][CARRY_UNKNOWNS];

    for (int i = 0; i < n; i++) {
        x[i] = 0;
        for (int k = 0; k < 3; k++)
            x[i] += column[i][k] * rate[k];
        for (int j = 0; j < n; j++) {
            a[i][j] = 0;
            for (int k = 0; k < 3; k++)
                a[i][j] += column[i][k] * column[j][k];
        }
    }
    return carry_solve(n, a, x);
}

/* axis[].v and a from axis[].p and the place. */
static bool carry_derive(const struct carry *self, struct plan_jet_vec at,
                         struct plan_jet axis[])
{
    double column[CARRY_UNKNOWNS][3], rate[3], x[CARRY_UNKNOWNS];

    for (int u = 0; u < self->unknowns; u++)
        carry_column(self, axis, u, column[u]);
    for (int k = 0; k < 3; k++)
        rate[k] = at.x[k].v;
    if (!carry_rates(self->unknowns, column, rate, x))
        return false;
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        axis[i].v = self->unknown[i] < 0 ? 0 : x[self->unknown[i]];
    const struct plan_jet_vec curved = carry_pivot(self, axis);
    for (int k = 0; k < 3; k++)
        rate[k] = at.x[k].a - curved.x[k].a;
    if (!carry_rates(self->unknowns, column, rate, x))
        return false;
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        axis[i].a = self->unknown[i] < 0 ? 0 : x[self->unknown[i]];
    return true;
}

/* The axes that the rig has, in their order. */
static int carry_at(void *context, int64_t t, enum motion_bake_side side,
                    struct motion_bake_point point[])
{
    struct carry *self = context;
    const struct plan_jet_vec at = carry_place(self, t, side);
    struct plan_jet axis[MOTION_CARRIER_AXES_MAX] = { { 0, 0, 0 } };
    int64_t axis_q32[MOTION_CARRIER_AXES_MAX] = { 0 };
    uint32_t n = 0;
    const int err = carry_find(
        self, at, self->row[plan_along_row(&self->along, t)].axis_q32,
        axis_q32);
    if (err < 0)
        return err;
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        axis[i].p = ldexp((double)axis_q32[i], -32);
    if (!carry_derive(self, at, axis))
        return MOTION_E_SINGULAR;
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (self->rig->carrier[i].is_given)
            point[n++] = plan_bake_point(axis[i]);
    return MOTION_OK;
}

/* ---- the whole ----------------------------------------------------------- */

static void carry_unknowns(struct carry *self)
{
    const bool is_gantry =
        self->rig->rig.carrier.kind == &motion_carrier_gantry;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++) {
        self->unknown[i] = -1;
        if (!self->rig->carrier[i].is_given)
            continue;
        self->unknown[i] =
            is_gantry && i == 1 ? self->unknown[0] : self->unknowns++;
    }
}

int plan_carry_tracks(const struct plan_path *path, struct plan_drive *drive,
                      struct motion_track track[], int64_t *bound_q32,
                      struct plan_error *error)
{
    struct motion_track *list[MOTION_CARRIER_AXES_MAX];
    uint32_t axes = 0;
    struct carry self = {
        .path = path,
        .rig = path->carrier,
        .along = { .path = path,
                   .error = error,
                   .context = &self,
                   .begin = carry_begin,
                   .row = carry_row,
                   .at = carry_at,
                   .refusal = carry_refusal },
    };

    carry_unknowns(&self);
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (self.rig->carrier[i].is_given)
            list[axes++] = &track[self.rig->carrier[i].axis];
    const int err =
        plan_along_tracks(&self.along, drive, list, axes, bound_q32);
    free(self.row);
    return err;
}
