/* motion/kinematics/arm_inverse.c - joints for a pose; see arm.h.
 *
 * Damped least squares: with the error e of the pose (its length over a scale of
 * the arm, and a rotation vector), the step x of
 *
 *     (J^T J + k diag(J^T J)) x = J^T e
 *
 * is taken when it makes |e| smaller, k then falls; else k rises.  Near an answer
 * k is small and the steps are Newton's, each with twice the digits. */
#include "motion/core/err.h"
#include "motion/kinematics/arm.h"
#include "motion/number/elementary.h"
#include "motion/number/trig.h"

#define ARM_STEPS      100
#define ARM_DAMP_FIRST (-8) /* k = 2^damp */
#define ARM_DAMP_LEAST (-30)
#define ARM_DAMP_MOST  20
#define ARM_STEP_MAX   (-1)  /* 2^-1 rad, or of the scale */
#define ARM_STEP_STAYS (-38) /* the last bit of Q32.32 degrees */
#define ARM_PLACE_BITS 20    /* an answer: 2^-20 of the unit, */
#define ARM_TURN_BITS  29    /* 2^-29 rad */
#define ARM_RANK_BITS  44    /* square of a sine: a rank is lost */
#define ARM_SAME_Q32   ((int64_t)1 << 20)
#define ARM_LIMIT_Q32  ((int64_t)1 << 12) /* rounding beyond a limit */
#define ARM_CIRCLE_Q32 ((int64_t)360 << 32)
#define ARM_ROWS       6

struct arm_descent {
    const struct motion_arm *arm;
    const struct motion_pose *target;
    struct motion_real scale;
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
    struct motion_real error[ARM_ROWS], cost;
    struct motion_arm_jacobian jacobian; /* scaled like the error */
};

typedef struct motion_real arm_square[MOTION_ARM_JOINTS_MAX]
                                     [MOTION_ARM_JOINTS_MAX];

/* How long the arm is, at least one unit. */
static struct motion_real arm_scale(const struct motion_arm *arm)
{
    struct motion_real sum = motion_real_int(1);

    for (uint32_t i = 0; i < arm->count; i++)
        sum = motion_real_add(
            sum,
            motion_real_add(
                motion_real_abs(motion_real_from_q(arm->joint[i].a_q32, 32)),
                motion_real_abs(motion_real_from_q(arm->joint[i].d_q32, 32))));
    return sum;
}

/* --- the error, and its derivative ---------------------------------------- */

static void arm_scale_jacobian(struct arm_descent *d)
{
    for (uint32_t i = 0; i < d->arm->count; i++) {
        struct motion_real *column = d->jacobian.column[i];
        if (d->arm->joint[i].is_fixed)
            for (int k = 0; k < ARM_ROWS; k++)
                column[k] = motion_real_zero();
        if (d->arm->joint[i].is_prismatic)
            continue; /* travel counts in the scale too */
        for (int k = 0; k < 3; k++)
            column[k] = motion_real_div(column[k], d->scale);
    }
}

/* Error, cost and Jacobian at d->joint_q32. */
static void arm_measure(struct arm_descent *d)
{
    struct motion_pose flange;
    struct motion_vec off, turn;
    struct motion_quat q;

    (void)motion_arm_jacobian(d->arm, d->joint_q32, &flange, &d->jacobian);
    arm_scale_jacobian(d);
    off = motion_vec_sub(d->target->origin, flange.origin);
    q = motion_quat_mul(d->target->q, motion_quat_inverse(flange.q));
    if (q.w < 0)
        q = motion_quat_neg(q);
    (void)motion_quat_log(q, &turn);
    d->cost = motion_real_zero();
    for (int k = 0; k < 3; k++) {
        d->error[k] = motion_real_div(off.x[k], d->scale);
        d->error[3 + k] = turn.x[k];
    }
    for (int k = 0; k < ARM_ROWS; k++)
        d->cost = motion_real_add(d->cost, motion_real_sqr(d->error[k]));
}

static bool arm_is_met(const struct arm_descent *d)
{
    struct motion_vec off, turn;

    for (int k = 0; k < 3; k++) {
        off.x[k] = motion_real_mul(d->error[k], d->scale);
        turn.x[k] = d->error[3 + k];
    }
    return motion_real_lt(motion_vec_length(off),
                          motion_real_make(1, -ARM_PLACE_BITS)) &&
           motion_real_lt(motion_vec_length(turn),
                          motion_real_make(1, -ARM_TURN_BITS));
}

/* --- linear equations ------------------------------------------------------ */

/* a = L D L^T in place, L below, D on the diagonal.  False when a pivot is below
 * 2^-bits of what was there: a column depends on those before. */
static bool arm_factor(arm_square a, uint32_t n, int bits)
{
    for (uint32_t j = 0; j < n; j++) {
        const struct motion_real least = motion_real_scale(a[j][j], -bits);

        for (uint32_t k = 0; k < j; k++)
            a[j][j] = motion_real_sub(
                a[j][j], motion_real_mul(motion_real_sqr(a[j][k]), a[k][k]));
        if (motion_real_sign(a[j][j]) <= 0 || motion_real_lt(a[j][j], least))
            return false;
        for (uint32_t i = j + 1; i < n; i++) {
            for (uint32_t k = 0; k < j; k++)
                a[i][j] = motion_real_sub(
                    a[i][j], motion_real_mul(motion_real_mul(a[i][k], a[j][k]),
                                             a[k][k]));
            a[i][j] = motion_real_div(a[i][j], a[j][j]);
        }
    }
    return true;
}

static void arm_substitute(arm_square a, uint32_t n,
                           struct motion_real x[MOTION_ARM_JOINTS_MAX])
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < i; k++)
            x[i] = motion_real_sub(x[i], motion_real_mul(a[i][k], x[k]));
    for (uint32_t i = 0; i < n; i++)
        x[i] = motion_real_div(x[i], a[i][i]);
    for (uint32_t i = n; i-- > 0;)
        for (uint32_t k = i + 1; k < n; k++)
            x[i] = motion_real_sub(x[i], motion_real_mul(a[k][i], x[k]));
}

/* J^T J of `count` columns; by rows J J^T. */
static uint32_t arm_gram(const struct motion_arm_jacobian *j, uint32_t count,
                         bool rows, arm_square a)
{
    const uint32_t n = rows ? ARM_ROWS : count;
    const uint32_t m = rows ? count : ARM_ROWS;

    for (uint32_t r = 0; r < n; r++)
        for (uint32_t c = 0; c <= r; c++) {
            a[r][c] = motion_real_zero();
            for (uint32_t k = 0; k < m; k++)
                a[r][c] = motion_real_add(
                    a[r][c],
                    rows ? motion_real_mul(j->column[k][r], j->column[k][c])
                         : motion_real_mul(j->column[r][k], j->column[c][k]));
        }
    return n;
}

/* Of the joints that are not fixed. */
static bool arm_is_singular(const struct arm_descent *d)
{
    struct motion_arm_jacobian moving;
    uint32_t count = 0;
    arm_square a;

    for (uint32_t i = 0; i < d->arm->count; i++) {
        if (d->arm->joint[i].is_fixed)
            continue;
        for (int k = 0; k < ARM_ROWS; k++)
            moving.column[count][k] = d->jacobian.column[i][k];
        count++;
    }
    const uint32_t n = arm_gram(&moving, count, count > ARM_ROWS, a);
    return !arm_factor(a, n, ARM_RANK_BITS);
}

/* --- descent ---------------------------------------------------------------- */

/* The damped step; false when there is none.  At most 2^ARM_STEP_MAX long. */
static bool arm_step(const struct arm_descent *d, int damp,
                     struct motion_real x[MOTION_ARM_JOINTS_MAX],
                     struct motion_real *largest)
{
    const struct motion_real most = motion_real_make(1, ARM_STEP_MAX);
    arm_square a;
    const uint32_t n = arm_gram(&d->jacobian, d->arm->count, false, a);

    for (uint32_t i = 0; i < n; i++) {
        a[i][i] = motion_real_add(
            a[i][i],
            motion_real_scale(
                motion_real_max(a[i][i], motion_real_make(1, -20)), damp));
        x[i] = motion_real_zero();
        for (int k = 0; k < ARM_ROWS; k++)
            x[i] = motion_real_add(
                x[i], motion_real_mul(d->jacobian.column[i][k], d->error[k]));
    }
    if (!arm_factor(a, n, 58))
        return false;
    arm_substitute(a, n, x);
    *largest = motion_real_zero();
    for (uint32_t i = 0; i < n; i++)
        *largest = motion_real_max(*largest, motion_real_abs(x[i]));
    if (motion_real_cmp(*largest, most) > 0) {
        const struct motion_real less = motion_real_div(most, *largest);
        for (uint32_t i = 0; i < n; i++)
            x[i] = motion_real_mul(x[i], less);
        *largest = most;
    }
    return true;
}

/* The joints a step further; false when one does not fit. */
static bool arm_go(struct arm_descent *d,
                   const struct motion_real x[MOTION_ARM_JOINTS_MAX])
{
    const struct motion_real deg =
        motion_real_div(motion_real_int(180), motion_elementary_pi());

    for (uint32_t i = 0; i < d->arm->count; i++) {
        const bool slides = d->arm->joint[i].is_prismatic;
        int64_t more_q32;
        if (motion_real_round(motion_real_mul(x[i], slides ? d->scale : deg),
                              32, &more_q32) < 0 ||
            motion_fixed_add(d->joint_q32[i], more_q32, &d->joint_q32[i]) < 0)
            return false;
    }
    return true;
}

/* Down from d->joint_q32; true when the pose is met. */
static bool arm_descend(struct arm_descent *d)
{
    struct motion_real x[MOTION_ARM_JOINTS_MAX], largest;
    int damp = ARM_DAMP_FIRST;

    arm_measure(d);
    for (int i = 0; i < ARM_STEPS && damp <= ARM_DAMP_MOST; i++) {
        struct arm_descent next = *d;

        if (!arm_step(d, damp, x, &largest)) {
            damp += 4;
            continue;
        }
        if (!arm_go(&next, x))
            break;
        arm_measure(&next);
        if (motion_real_lt(next.cost, d->cost)) {
            *d = next;
            damp = damp - 4 < ARM_DAMP_LEAST ? ARM_DAMP_LEAST : damp - 4;
        } else {
            damp += 4;
        }
        if (motion_real_lt(largest, motion_real_make(1, ARM_STEP_STAYS)))
            break;
    }
    return arm_is_met(d);
}

/* --- answers ---------------------------------------------------------------- */

static bool arm_is_within(const struct motion_arm_joint *joint, int64_t at_q32)
{
    return !joint->is_limited ||
           (at_q32 >= joint->low_q32 && at_q32 <= joint->high_q32);
}

/* Onto a limit that rounding is beyond. */
static int64_t arm_at_limit(const struct motion_arm_joint *joint,
                            int64_t at_q32)
{
    const int64_t limit_q32[2] = { joint->low_q32, joint->high_q32 };

    for (int i = 0; i < 2 && joint->is_limited; i++) {
        int64_t off_q32;
        if (motion_fixed_sub(at_q32, limit_q32[i], &off_q32) == MOTION_OK &&
            motion_fixed_abs(off_q32) <= (uint64_t)ARM_LIMIT_Q32)
            return limit_q32[i];
    }
    return at_q32;
}

/* Whole turns of a joint: the nearest to its start, or the next that the limits
 * allow.  False when none is. */
static bool arm_turns(const struct motion_arm_joint *joint, int64_t start_q32,
                      int64_t *at_q32)
{
    static const int more[3] = { 0, 1, -1 };
    int64_t near_q32;

    if (joint->is_prismatic) {
        *at_q32 = arm_at_limit(joint, *at_q32);
        return arm_is_within(joint, *at_q32);
    }
    if (motion_axis_nearest_deg(motion_trig_from_deg_q32(*at_q32), start_q32,
                                &near_q32) < 0)
        return false;
    for (int i = 0; i < 3; i++) {
        int64_t turned_q32;
        if (motion_fixed_add(near_q32, more[i] * ARM_CIRCLE_Q32, &turned_q32) <
            0)
            continue;
        *at_q32 = arm_at_limit(joint, turned_q32);
        if (arm_is_within(joint, *at_q32))
            return true;
    }
    return false;
}

static bool arm_is_allowed(struct arm_descent *d, const int64_t *start_q32)
{
    bool all = true;

    for (uint32_t i = 0; i < d->arm->count; i++)
        if (!d->arm->joint[i].is_fixed)
            all =
                arm_turns(&d->arm->joint[i], start_q32[i], &d->joint_q32[i]) &&
                all;
    return all;
}

static int arm_check(const struct motion_arm *arm)
{
    if (arm->count < 1 || arm->count > MOTION_ARM_JOINTS_MAX)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < arm->count; i++) {
        if (arm->joint[i].is_limited &&
            arm->joint[i].low_q32 > arm->joint[i].high_q32)
            return MOTION_E_ARG;
    }
    return MOTION_OK;
}

/* One descent: MOTION_OK and the joints, or why not. */
static int arm_answer(struct arm_descent *d, const int64_t *start_q32)
{
    if (!arm_descend(d))
        return MOTION_E_UNREACHABLE;
    if (!arm_is_allowed(d, start_q32))
        return MOTION_E_UNREACHABLE;
    return arm_is_singular(d) ? MOTION_E_SINGULAR : MOTION_OK;
}

int motion_arm_inverse(const struct motion_arm *arm,
                       const struct motion_pose *flange,
                       const int64_t *start_q32, int64_t *joint_q32)
{
    struct motion_arm_answer nearest;
    struct arm_descent d = { .arm = arm, .target = flange };
    int err = arm_check(arm);

    if (err < 0)
        return err;
    d.scale = arm_scale(arm);
    for (uint32_t i = 0; i < arm->count; i++)
        d.joint_q32[i] = start_q32[i];
    err = arm_answer(&d, start_q32);
    if (err == MOTION_E_UNREACHABLE) {
        err = motion_arm_answers(arm, flange, start_q32, 1, &nearest);
        if (err < 0)
            return err;
        for (uint32_t i = 0; i < arm->count; i++)
            joint_q32[i] = nearest.joint_q32[i];
        return MOTION_OK;
    }
    for (uint32_t i = 0; i < arm->count && err == MOTION_OK; i++)
        joint_q32[i] = d.joint_q32[i];
    return err;
}

/* --- several answers -------------------------------------------------------- */

/* The fraction of k sqrt(2), sqrt(3), sqrt(5) ..: evenly spread in every
 * dimension (R. D. Richtmyer, 1951).  Prismatic joints over their limits, others
 * over a turn about the start. */
static void arm_spread(struct arm_descent *d, uint32_t k,
                       const int64_t *start_q32)
{
    static const uint32_t root[MOTION_ARM_JOINTS_MAX] = {
        0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A,
        0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19
    };

    for (uint32_t i = 0; i < d->arm->count; i++) {
        const struct motion_arm_joint *const joint = &d->arm->joint[i];
        const struct motion_real at = motion_real_from_q(
            (int64_t)(k * root[i]) - ((int64_t)1 << 31), 32); /* -1/2 .. 1/2 */
        struct motion_real middle = motion_real_from_q(start_q32[i], 32);
        struct motion_real span = motion_real_int(360);

        if (joint->is_fixed)
            continue;
        if (joint->is_prismatic && joint->is_limited) {
            const struct motion_real low =
                motion_real_from_q(joint->low_q32, 32);
            span =
                motion_real_sub(motion_real_from_q(joint->high_q32, 32), low);
            middle = motion_real_add(low, motion_real_half(span));
        } else if (joint->is_prismatic) {
            span = d->scale;
        }
        if (motion_real_round(
                motion_real_add(middle, motion_real_mul(span, at)), 32,
                &d->joint_q32[i]) < 0)
            d->joint_q32[i] = start_q32[i];
    }
}

static struct motion_real arm_distance(const struct motion_arm *arm,
                                       const int64_t *a_q32,
                                       const int64_t *b_q32)
{
    struct motion_real sum = motion_real_zero();

    for (uint32_t i = 0; i < arm->count; i++)
        sum = motion_real_add(sum, motion_real_sqr(motion_real_sub(
                                       motion_real_from_q(a_q32[i], 32),
                                       motion_real_from_q(b_q32[i], 32))));
    return sum;
}

/* Put an answer among the nearest; returns how many there are then. */
static uint32_t arm_insert(const struct arm_descent *d,
                           const int64_t *start_q32,
                           struct motion_arm_answer *answer, uint32_t count,
                           uint32_t capacity)
{
    const struct motion_real far =
        arm_distance(d->arm, d->joint_q32, start_q32);
    const struct motion_real same =
        motion_real_sqr(motion_real_from_q(ARM_SAME_Q32, 32));
    uint32_t at = 0;

    for (uint32_t i = 0; i < count; i++) {
        if (motion_real_lt(
                arm_distance(d->arm, d->joint_q32, answer[i].joint_q32), same))
            return count;
        if (motion_real_cmp(
                arm_distance(d->arm, answer[i].joint_q32, start_q32), far) <= 0)
            at = i + 1;
    }
    if (at == capacity)
        return count;
    count = count < capacity ? count + 1 : capacity;
    for (uint32_t i = count - 1; i > at; i--)
        answer[i] = answer[i - 1];
    for (uint32_t i = 0; i < d->arm->count; i++)
        answer[at].joint_q32[i] = d->joint_q32[i];
    return count;
}

int motion_arm_answers(const struct motion_arm *arm,
                       const struct motion_pose *flange,
                       const int64_t *start_q32, uint32_t capacity,
                       struct motion_arm_answer *answer)
{
    int why = MOTION_E_UNREACHABLE;
    uint32_t count = 0;
    int err = arm_check(arm);

    if (err < 0)
        return err;
    for (uint32_t k = 0; k <= MOTION_ARM_STARTS; k++) {
        struct arm_descent d = { .arm = arm,
                                 .target = flange,
                                 .scale = arm_scale(arm) };

        for (uint32_t i = 0; i < arm->count; i++)
            d.joint_q32[i] = start_q32[i];
        if (k > 0)
            arm_spread(&d, k, start_q32);
        err = arm_answer(&d, start_q32);
        if (err == MOTION_OK)
            count = arm_insert(&d, start_q32, answer, count, capacity);
        else if (err == MOTION_E_SINGULAR)
            why = err;
    }
    return count > 0 ? (int)count : why;
}
