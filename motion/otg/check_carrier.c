/* motion/otg/check_carrier.c - does the track keep the limits of velocity, too?
 *
 * A track lays what is missing at the end on one phase, the carrier (track.c),
 * as d u^3 over its n ticks, n of T in all: 3 d / n more velocity.  With d at
 * most 2 W T that is less than 2^9 W where n > T / 2^6, and such is the room
 * that velocities keep.  Where it is too much to ask, or the carrier is shorter
 * or the first phase or the last, d itself tells. */
#include "motion/number/real.h"
#include "motion/otg/check_internal.h"

#define CHECK_COEF_BITS 60 /* of a segment, all but one */

/* The carrier, and where it begins. */
struct carrier {
    int64_t a, a1, n;
    struct motion_u128 v, v1;
    bool last;
};

static struct carrier carrier_of(const struct otg_check *c, int at)
{
    const struct motion_otg_plan *plan = c->plan;
    struct carrier k = { .a1 = plan->start_acc, .v1 = c->start };
    for (int i = 0; i <= at; i++) {
        k.v = k.v1;
        k.a = k.a1;
        k.n = plan->phase[i].dur_ns_q12;
        k.a1 = plan->phase[i].acc;
        k.v1 = wide_add(k.v, wide_mul_i64(k.a + k.a1, k.n));
    }
    k.last = at + 1 == plan->count;
    return k;
}

/* 2 d of it, in units of P: what is missing at the end, less what the velocity
 * missing there makes of the time behind the carrier. */
static struct wider carried(const struct otg_check *c, int at,
                            struct motion_u128 vel, struct wider twice)
{
    const struct motion_otg_plan *plan = c->plan;
    int64_t left = 0;
    for (int i = at + 1; i < plan->count; i++)
        left += plan->phase[i].dur_ns_q12;
    return wider_sub(twice, wider_mul(vel, 6 * left));
}

/* Above v, or below; what is outside for good reasons has none to keep. */
static bool end_is_carried(const struct otg_check *c, struct motion_u128 v,
                           int sign, struct motion_u128 need)
{
    struct motion_u128 room = otg_check_room(c, v, sign);
    return wide_is_negative(room) || !wide_is_less(room, need);
}

static bool crest_is_carried(const struct otg_check *c, const struct carrier *k,
                             int sign, struct motion_u128 need)
{
    if ((k->a ^ k->a1) >= 0 || (k->a < 0) != (sign < 0))
        return true;
    struct motion_u128 room = wide_sub(otg_check_room(c, k->v, sign), need);
    return motion_otg_check_crest(room, k->a, k->a1, k->n, 1);
}

bool motion_otg_check_carried(const struct otg_check *c, struct motion_u128 vel,
                              struct wider twice)
{
    int at = motion_otg_carrier(c->plan);
    struct wider by = carried(c, at, vel, twice);
    int sign = wider_is_negative(by) ? -1 : 1;
    struct carrier k = carrier_of(c, at);
    by = wider_shr(wider_abs(by), 64 - motion_real_clz((uint64_t)k.n));
    struct motion_u128 need =
        wide_add((struct motion_u128){ by.mid, by.lo }, wide_from(1));
    struct motion_u128 most = wide_abs(sign > 0 ? c->up : c->down);
    if (!wide_is_less(wide_shr(most, CHECK_COEF_BITS), need))
        return true;
    if (k.last && wide_is_negative(otg_check_room(c, k.v1, sign)))
        return false;
    return crest_is_carried(c, &k, sign, need) &&
           end_is_carried(c, k.v, sign, need) &&
           end_is_carried(c, k.v1, sign, need);
}
