/* tests/bench/otg_random.c - see otg_random.h. */
#include "tests/bench/otg_random.h"

#include <stdbool.h>

#include "motion/core/fixed.h"

/* Of a length of 1, and 1/s, 1/s2, 1/s3 times that. */
#define LENGTH_Q32 (32 + OTG_RANDOM_LENGTH_BITS)

#define SPREAD 49 /* has no factor in common with OTG_RANDOM_CYCLE */

const char *otg_random_name(enum otg_random_kind kind)
{
    static const char *const name[OTG_RANDOM_KINDS] = {
#define RANDOM_NAME(id, text, share) [OTG_RANDOM_##id] = text,
        OTG_RANDOM_KIND_LIST(RANDOM_NAME)
#undef RANDOM_NAME
    };
    return name[kind];
}

enum otg_random_kind otg_random_kind(uint32_t row)
{
    static const uint8_t share[OTG_RANDOM_KINDS] = {
#define RANDOM_SHARE(id, text, n) n,
        OTG_RANDOM_KIND_LIST(RANDOM_SHARE)
#undef RANDOM_SHARE
    };
    int kind = 0;
    row = row * SPREAD % OTG_RANDOM_CYCLE;
    for (; row >= share[kind]; kind++)
        row -= share[kind];
    return (enum otg_random_kind)kind;
}

/* --- numbers (xorshift).  One call per statement: C leaves the order within
 * an expression to the compiler. ------------------------------------------- */

static uint64_t random_u64(uint64_t *seed)
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return *seed * UINT64_C(0x2545F4914F6CDD1D);
}

/* lo .. hi, without a division */
static int64_t random_between(uint64_t *seed, int64_t lo, int64_t hi)
{
    uint64_t span = (uint64_t)(hi - lo) + 1;
    return lo + (int64_t)motion_fixed_mulhi_u64(random_u64(seed), span);
}

static bool random_is(uint64_t *seed, unsigned percent)
{
    return random_between(seed, 0, 99) < (int64_t)percent;
}

/* Of any order of magnitude between 2^lo and 2^hi, times 2^scale. */
static int64_t random_size(uint64_t *seed, int lo, int hi, int scale)
{
    int bits = (int)random_between(seed, lo, hi - 1) + scale;
    uint64_t mantissa = random_u64(seed) | (uint64_t)1 << 63;
    return (int64_t)(mantissa >> (63 - bits));
}

static int64_t random_sign(uint64_t *seed, int64_t size)
{
    return random_is(seed, 50) ? -size : size;
}

/* --- limits --------------------------------------------------------------- */

static void random_limits(uint64_t *seed, bool symmetric,
                          struct motion_otg_limit *limit)
{
    limit->vel_max_q32 = random_size(seed, -3, 4, LENGTH_Q32);
    limit->acc_max_q32 = random_size(seed, -3, 4, LENGTH_Q32);
    limit->jerk_q32 = random_size(seed, -3, 4, LENGTH_Q32);
    limit->vel_min_q32 = -limit->vel_max_q32;
    limit->acc_min_q32 = -limit->acc_max_q32;
    if (symmetric)
        return;
    limit->vel_min_q32 = -random_size(seed, -3, 4, LENGTH_Q32);
    limit->acc_min_q32 = -random_size(seed, -3, 4, LENGTH_Q32);
}

/* Velocity : acceleration : jerk over four decades each. */
static void random_ratios(uint64_t *seed, struct motion_otg_limit *limit)
{
    int vel = (int)random_between(seed, -6, 6);
    int acc = vel + (int)random_between(seed, -6, 6);
    int jerk = acc + (int)random_between(seed, -6, 6);
    limit->vel_max_q32 = random_size(seed, vel, vel + 1, LENGTH_Q32);
    limit->acc_max_q32 = random_size(seed, acc, acc + 1, LENGTH_Q32);
    limit->jerk_q32 = random_size(seed, jerk, jerk + 1, LENGTH_Q32);
    limit->vel_min_q32 = -limit->vel_max_q32;
    limit->acc_min_q32 = -limit->acc_max_q32;
}

/* --- states --------------------------------------------------------------- */

/* a^2 / 2j, up: the speed that ramping a to zero takes. */
static int64_t ramp_q32(int64_t acc_q32, int64_t jerk_q32)
{
    int64_t ramp = 0;
    int err = motion_fixed_muldiv(acc_q32, acc_q32, jerk_q32 * 2, &ramp);
    return err < 0 ? INT64_MAX : ramp + 2;
}

/* Anywhere inside the limits, such that it can stay there (`displacement` 1: a start)
 * or can have been there (-1: a goal). */
static void random_state(uint64_t *seed, const struct motion_otg_limit *limit,
                         int displacement, struct motion_state *state)
{
    int64_t acc =
        random_between(seed, limit->acc_min_q32 + 1, limit->acc_max_q32 - 1);
    int64_t lo = limit->vel_min_q32, hi = limit->vel_max_q32;
    if (random_is(seed, 28))
        acc = 0;
    int64_t ramp = ramp_q32(acc, limit->jerk_q32);
    while (acc != 0 && ramp >= hi - lo) {
        acc /= 2;
        ramp = ramp_q32(acc, limit->jerk_q32);
    }
    if (acc * displacement > 0)
        hi -= ramp;
    else if (acc != 0)
        lo += ramp;
    state->acc_q32 = acc;
    state->vel_q32 = random_between(seed, lo, hi);
    if (random_is(seed, 12) && lo < 0 && hi > 0)
        state->vel_q32 = 0;
}

/* Up to twice the limits. */
static void random_violating(uint64_t *seed,
                             const struct motion_otg_limit *limit,
                             struct motion_state *state)
{
    state->vel_q32 =
        random_between(seed, 2 * limit->vel_min_q32, 2 * limit->vel_max_q32);
    state->acc_q32 =
        random_between(seed, 2 * limit->acc_min_q32, 2 * limit->acc_max_q32);
}

static void random_displacement(uint64_t *seed, int lo, int hi,
                                struct motion_otg_move *move)
{
    int64_t displacement = random_size(seed, lo, hi, LENGTH_Q32);
    move->start.pos_q32 = random_between(seed, -displacement, displacement);
    move->goal.pos_q32 = move->start.pos_q32 + random_sign(seed, displacement);
}

/* --- kinds ---------------------------------------------------------------- */

/* Whole numbers and simple fractions, where switching times coincide. */
static void random_round(uint64_t *seed, struct motion_otg_move *move)
{
    struct motion_otg_limit *limit = &move->limit;
    int64_t one_q32 = (int64_t)1 << LENGTH_Q32;
    limit->vel_max_q32 = one_q32 * random_between(seed, 2, 8);
    limit->vel_min_q32 = -limit->vel_max_q32;
    limit->acc_max_q32 = one_q32 * random_between(seed, 1, 8);
    limit->acc_min_q32 = -limit->acc_max_q32;
    limit->jerk_q32 = one_q32 * random_between(seed, 1, 8);
    move->goal.pos_q32 = one_q32 * random_between(seed, -20, 20);
    if (random_is(seed, 40))
        return;
    move->start.vel_q32 = one_q32 * random_between(seed, -1, 1);
    move->goal.vel_q32 = one_q32 * random_between(seed, -1, 1);
    if (limit->jerk_q32 >= one_q32 && random_is(seed, 50))
        move->start.acc_q32 = one_q32 * random_between(seed, -1, 1);
}

/* From rest to rest with ramps of r seconds, a hold of h and hardly a cruise: v
 * = a (r + h), d = v (2 r + h).  The limit that is not touched is twice
 * that. */
static void random_boundary(uint64_t *seed, struct motion_otg_move *move)
{
    struct motion_otg_limit *limit = &move->limit;
    int64_t touched = random_between(seed, 1, 3); /* acc 1, vel 2 */
    int64_t jerk = random_between(seed, 1, 4);
    int64_t ramp = random_between(seed, 1, 3);
    int64_t hold = touched == 3 ? random_between(seed, 0, 2) : 0;
    int64_t acc = jerk * ramp, vel = acc * (ramp + hold);
    int64_t displacement = (vel * (2 * ramp + hold)) << LENGTH_Q32;
    if (touched == 3 && random_is(seed, 30))
        displacement += displacement >> 12;
    limit->jerk_q32 = jerk << LENGTH_Q32;
    limit->acc_max_q32 = acc << (LENGTH_Q32 + !(touched & 1));
    limit->acc_min_q32 = -limit->acc_max_q32;
    limit->vel_max_q32 = vel << (LENGTH_Q32 + !(touched & 2));
    limit->vel_min_q32 = -limit->vel_max_q32;
    move->goal.pos_q32 = random_sign(seed, displacement);
}

static void random_states(uint64_t *seed, bool goal,
                          struct motion_otg_move *move)
{
    random_state(seed, &move->limit, 1, &move->start);
    if (goal)
        random_state(seed, &move->limit, -1, &move->goal);
}

void otg_random_move(uint64_t *seed, enum otg_random_kind kind,
                     struct motion_otg_move *move)
{
    *move = (struct motion_otg_move){ .mode = MOTION_OTG_POSITION };
    if (kind == OTG_RANDOM_ROUND) {
        random_round(seed, move);
        return;
    }
    if (kind == OTG_RANDOM_BOUNDARY) {
        random_boundary(seed, move);
        return;
    }
    bool both = random_is(seed, 50);
    random_limits(seed, kind != OTG_RANDOM_ASYMMETRIC, &move->limit);
    if (kind == OTG_RANDOM_RATIO)
        random_ratios(seed, &move->limit);
    if (kind == OTG_RANDOM_START_VIOLATES)
        move->limit.jerk_q32 = random_size(seed, 1, 5, LENGTH_Q32);
    if (kind == OTG_RANDOM_START_VIOLATES && both)
        random_state(seed, &move->limit, -1, &move->goal);
    if (kind == OTG_RANDOM_START_VIOLATES)
        random_violating(seed, &move->limit, &move->start);
    else if (kind == OTG_RANDOM_MOVING_START)
        random_states(seed, false, move);
    else if (kind == OTG_RANDOM_FULL_STATE || kind == OTG_RANDOM_ASYMMETRIC)
        random_states(seed, true, move);
    else if ((kind == OTG_RANDOM_LONG || kind == OTG_RANDOM_RATIO) && both)
        random_states(seed, true, move);
    if (kind == OTG_RANDOM_TINY)
        random_displacement(seed, -20, -10, move);
    else if (kind == OTG_RANDOM_LONG)
        random_displacement(seed, 7, 13, move);
    else if (kind == OTG_RANDOM_REST)
        random_displacement(seed, -10, 7, move);
    else
        random_displacement(seed, -7, 6, move);
}

void otg_random_moves(uint64_t *seed, uint32_t row, int axes,
                      struct motion_otg_move move[])
{
    static const uint8_t share[] = { 4, 4, 6, 3 };
    static const enum otg_random_kind kind[] = {
        OTG_RANDOM_REST,
        OTG_RANDOM_MOVING_START,
        OTG_RANDOM_FULL_STATE,
        OTG_RANDOM_ASYMMETRIC,
    };
    unsigned which = 0;
    row = row * 7 % 20;
    for (; which < 4 && row >= share[which]; which++)
        row -= share[which];
    for (int i = 0; i < axes; i++)
        otg_random_move(seed, kind[which < 4 ? which : (row + (uint32_t)i) % 4],
                        &move[i]);
}
