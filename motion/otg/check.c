/* motion/otg/check.c - does a plan do what was asked, inside the limits?
 *
 * Knows nothing of how the plan was found.  It integrates the phases in exact
 * integers and compares with the public numbers, which are whole in the plan's
 * units (otg.h): a limit is kept or it is not.  V is followed from corner to
 * corner; P is what each phase adds to V, times the time that is left.  The
 * corners in `trim` are known to one unit; what these can make is added
 * wherever it can matter:
 *
 *   acceleration  1 at such a corner
 *   jerk          1, or 2 between corners that move apart, over the phase
 *   velocity      W, the sum of both phases' ticks over such corners
 *   the end       W in velocity, 3 W T in position
 *
 * Start and goal are exact, and so is what follows from them alone: the first
 * phase counts from the start, the last one back from the goal.
 *
 * A start that is outside a velocity limit, or bound to leave it, may go where
 * full jerk leads it, v + a^2 / 2j, to the last unit of its acceleration; so
 * may a goal, backwards in time. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/otg/check_internal.h"

#define CHECK_CARRIER 6

static int refuse(enum motion_otg_field *field, enum motion_otg_field which)
{
    *field = which;
    return MOTION_E_LIMIT;
}

/* --- one phase ------------------------------------------------------------ */

/* From a to v1, a1 in n ticks, `rest` ticks before the end; off: what trimming
 * can change of a and a1, and of the difference; `trim` the groups that a1
 * belongs to. */
struct stretch {
    struct motion_u128 v1;
    int64_t a, a1, n, rest;
    int off, off1, off_step, trim;
    bool first, last;
};

static void stretch_next(const struct motion_otg_plan *plan, int i,
                         struct stretch *s)
{
    const struct motion_otg_phase *ph = &plan->phase[i];
    int before = s->trim;
    int after = (int)((plan->trim[0] >> i & 1) | (plan->trim[1] >> i & 1) << 1);
    s->trim = after;
    s->first = i == 0;
    s->last = i + 1 == plan->count;
    s->a = s->a1;
    s->n = ph->dur_ns_q12;
    s->a1 = ph->acc;
    s->rest -= s->n;
    s->off = before != 0;
    s->off1 = after != 0;
    s->off_step = before == after ? 0 : s->off + s->off1;
}

/* V, and 2 P of its gain G = (A + A') n:  G (3 r + n) + A n n. */
static void stretch_run(struct stretch *s, struct wider *twice)
{
    int64_t k = 2 * (3 * s->rest + s->n);
    if ((s->a | s->a1) == 0)
        return;
    struct motion_u128 gain = wide_mul_i64(s->a + s->a1, s->n);
    s->v1 = wide_add(s->v1, gain);
    if (s->a == s->a1)
        k += s->n;
    else if (s->a1 == 0)
        k += 2 * s->n;
    else if (s->a != 0) {
        struct motion_u128 more = wide_mul_i64(2 * s->a, s->n);
        wider_add_mul(twice, s->n, &more);
    }
    wider_add_mul(twice, k, &gain);
}

/* |a1 - a| / n <= jerk */
static bool jerk_is_kept(const struct otg_check *c, const struct stretch *s,
                         uint64_t jerk)
{
    uint64_t step = motion_fixed_abs(s->a1 - s->a) + (uint64_t)s->off_step;
    if (step == 0)
        return true;
    struct motion_u128 have = wide_mul_u64(step, c->fives);
    if (c->step_down > 0) /* up */
        have = wide_neg(wide_shr(wide_neg(have), (unsigned)c->step_down));
    return !wide_is_less(wide_mul_u64(jerk, (uint64_t)s->n), have);
}

static bool acc_is_kept(const struct otg_check *c, int64_t a, int off)
{
    if (a < c->acc_max && a > c->acc_min)
        return true;
    return off == 0 && a <= c->acc_max && a >= c->acc_min;
}

/* room >= least, least >= 0. */
static bool has_room(struct motion_u128 room, int64_t least)
{
    return room.hi == 0 ? room.lo >= (uint64_t)least : !wide_is_negative(room);
}

bool motion_otg_check_crest(struct motion_u128 room, int64_t a, int64_t b,
                            int64_t n, int off)
{
    uint64_t from = motion_fixed_abs(a) + (uint64_t)off;
    uint64_t to = motion_fixed_abs(b);
    to = to > (uint64_t)off ? to - (uint64_t)off : 0;
    if (wide_is_negative(room))
        return false;
    if (!wide_is_less(room, wide_mul_u64(from, (uint64_t)n)))
        return true;
    struct wider rise = wider_mul(wide_mul_u64(from, from), n);
    return !wider_is_less(wider_mul(room, (int64_t)(from + to)), rise);
}

static struct motion_u128 widened_room(const struct otg_check *c,
                                       struct motion_u128 v, int sign,
                                       enum otg_check_end end)
{
    struct motion_u128 most = motion_otg_check_widened(c, sign, end);
    return sign > 0 ? wide_sub(most, v) : wide_add(most, v);
}

/* Where the acceleration changes its sign, the velocity turns.  Counted from
 * the phase's start; in the last phase backwards in time from the goal. */
static bool turn_is_inside(const struct otg_check *c, const struct stretch *s)
{
    struct motion_u128 v = c->goal;
    if (!s->last)
        v = wide_sub(s->v1, wide_mul_i64(s->a + s->a1, s->n));
    int64_t a = s->last ? -s->a1 : s->a, b = s->last ? -s->a : s->a1;
    int off = s->off | s->off1, sign = a > 0 ? 1 : -1;
    struct motion_u128 least = wide_from(s->first || s->last ? 0 : c->slack);
    struct motion_u128 room = wide_sub(otg_check_room(c, v, sign), least);
    if (motion_otg_check_crest(room, a, b, s->n, off))
        return true;
    if (!s->last && c->is_in[sign < 0])
        return false;
    room = widened_room(c, v, sign, s->last ? OTG_CHECK_GOAL : OTG_CHECK_START);
    return motion_otg_check_crest(wide_sub(room, least), a, b, s->n, off);
}

/* Outside since the start, where that makes it necessary; and the corner goes
 * on to bring the velocity back: by 2^-20 of what may be, so that no cruise
 * counts as that. */
static bool is_excused(const struct otg_check *c, const struct stretch *s,
                       int sign)
{
    if (c->is_in[sign < 0] ||
        (sign > 0 ? s->a1 > c->acc_min >> 20 : s->a1 < c->acc_max >> 20))
        return false;
    return has_room(widened_room(c, s->v1, sign, OTG_CHECK_START), c->slack);
}

/* The end of the last phase is the goal, which has been judged. */
static bool vel_is_kept(struct otg_check *c, const struct stretch *s)
{
    if ((s->a ^ s->a1) < 0 && s->a != 0 && s->a1 != 0 && !turn_is_inside(c, s))
        return false;
    for (int sign = 1; sign >= -1 && !s->last; sign -= 2) {
        if (sign > 0 ? !wide_is_less(c->up_in, s->v1)
                     : !wide_is_less(s->v1, c->down_in))
            c->is_in[sign < 0] = true;
        else if (!is_excused(c, s, sign))
            return false;
    }
    return true;
}

/* The one before `brake`, the other from `turn` on, the lower between. */
static uint64_t phase_jerk(const struct otg_check *c, int i)
{
    bool is_late = i >= c->plan->turn || c->jerk[1] < c->jerk[0];
    return c->jerk[i >= c->plan->brake && is_late];
}

static int check_phase(struct otg_check *c, int i, const struct stretch *s,
                       enum motion_otg_field *field)
{
    if (c->has_jerk && !jerk_is_kept(c, s, phase_jerk(c, i)))
        return refuse(field, MOTION_OTG_FIELD_JERK);
    if (c->has_acc && !acc_is_kept(c, s->a1, s->off1))
        return refuse(field, MOTION_OTG_FIELD_ACC_MAX);
    if (c->has_vel && !vel_is_kept(c, s))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    return MOTION_OK;
}

/* --- the whole ------------------------------------------------------------ */

static int check_start(const struct motion_otg_move *move,
                       const struct motion_otg_plan *plan,
                       enum motion_otg_field *field)
{
    const struct motion_state *start = &move->start;
    if (plan->start_vel_q32 != start->vel_q32)
        return refuse(field, MOTION_OTG_FIELD_START_VEL);
    if (plan->start_acc != motion_otg_acc_image(start->acc_q32, plan->acc_bits))
        return refuse(field, MOTION_OTG_FIELD_START_ACC);
    return MOTION_OK;
}

/* What is missing at the end is what the trimmed corners' last unit makes; of
 * a free end the rounding to its format, too. */
static bool way_is_met(const struct otg_check *c, struct wider twice)
{
    const struct motion_otg_plan *plan = c->plan;
    struct motion_u128 unit =
        wide_mul_u64((uint64_t)c->trimmed, (uint64_t)plan->dur_ns_q12);
    struct wider room = wider_mul(unit, 6);
    if (!c->has_vel)
        room = wider_shl((struct wider){ 0, 0, (uint64_t)OTG_WAY_FIVES },
                         (unsigned)(plan->acc_bits + 12));
    return !wider_is_less(room, wider_abs(twice));
}

/* A goal is reached, or named with what is left of it. */
static bool is_named(int64_t have, int64_t residual, int64_t want)
{
    return (uint64_t)have + (uint64_t)residual == (uint64_t)want;
}

static int check_goal(const struct otg_check *c, const struct stretch *end,
                      struct wider twice, int64_t longest,
                      enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    const struct motion_state *goal = &c->move->goal;
    struct motion_u128 miss = wide_sub(c->goal, end->v1);
    struct wider wanted = motion_otg_way_wanted(plan);
    twice = wider_sub(wider_add(wanted, wanted), twice);
    bool is_near = c->trimmed == 0 && motion_otg_check_residual(c, miss, twice);
    int64_t left_pos = is_near ? plan->residual_pos_q32 : 0;
    int64_t left_vel = is_near ? plan->residual_vel_q32 : 0;
    if (!is_named(plan->goal_vel_q32, left_vel, goal->vel_q32) ||
        (!is_near && wide_is_less(wide_from(c->trimmed), wide_abs(miss))))
        return refuse(field, MOTION_OTG_FIELD_GOAL_VEL);
    if (end->a1 != motion_otg_acc_image(goal->acc_q32, plan->acc_bits) ||
        end->trim != 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC);
    if (plan->start_pos_q32 != c->move->start.pos_q32 ||
        (c->has_vel &&
         !is_named(plan->goal_pos_q32, left_pos, goal->pos_q32)) ||
        (!is_near && !way_is_met(c, twice)))
        return refuse(field, MOTION_OTG_FIELD_GOAL_POS);
    if (c->has_vel && is_near &&
        (wide_is_less(c->up, end->v1) || wide_is_less(end->v1, c->down)))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    if (c->has_vel && (c->trimmed != 0 || is_near) &&
        (c->is_coarse || longest < plan->dur_ns_q12 >> CHECK_CARRIER) &&
        !motion_otg_check_carried(c, miss, twice))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    return MOTION_OK;
}

static int check_phases(struct otg_check *c, enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    struct wider twice = { 0, 0, 0 };
    struct stretch s;
    s.v1 = c->start;
    s.a1 = plan->start_acc;
    s.trim = 0;
    s.rest = plan->dur_ns_q12;
    int64_t longest = 0; /* between the first and the last */
    for (int i = 0; i < plan->count; i++) {
        stretch_next(plan, i, &s);
        if (s.n <= 0)
            return refuse(field, MOTION_OTG_FIELD_DURATION);
        stretch_run(&s, &twice);
        if (s.n > longest && !s.first && !s.last)
            longest = s.n;
        int err = check_phase(c, i, &s, field);
        if (err < 0)
            return err;
    }
    if (s.rest != 0)
        return refuse(field, MOTION_OTG_FIELD_DURATION);
    return check_goal(c, &s, twice, longest, field);
}

int motion_otg_check(const struct motion_otg_move *move,
                     const struct motion_otg_plan *plan,
                     enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    struct otg_check c;
    if (field == NULL)
        field = &unused;
    *field = MOTION_OTG_FIELD_NONE;
    int err = check_start(move, plan, field);
    if (err < 0)
        return err;
    motion_otg_check_init(&c, move, plan);
    return check_phases(&c, field);
}
