/* motion/otg_track.c - a plan as segments of a track.  See otg.h. */
#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/otg_internal.h"

#define TRACK_COEF_BITS 57 /* of the largest coefficient given */

/* The quintic about time t: value and coefficients of (s/n)^1 .. 5. */
struct bend {
    struct real at, c[5];
};

/* E(u0 + r x): the binomial expansion, Horner's scheme per coefficient. */
static struct bend bend_about(const struct motion_otg_plan *plan, int64_t t,
                              int64_t n)
{
    static const int8_t pascal[3][5] = { { 3, 3, 1, 0, 0 },
                                         { 4, 6, 4, 1, 0 },
                                         { 5, 10, 10, 5, 1 } };
    struct bend b = { .at = real_zero() };
    struct real per_n = real_inv(real_int(plan->ticks));
    struct real u = real_mul(real_int(t), per_n);
    struct real r = real_mul(real_int(n), per_n), rk = r;
    struct real e[3], power[6];
    power[0] = real_int(1);
    for (int i = 1; i < 6; i++)
        power[i] = real_mul(power[i - 1], u);
    for (int i = 0; i < 3; i++) {
        e[i] = wide_real(motion_otg_wide_in(plan->bend[i]), 0);
        b.at = real_add(b.at, real_mul(e[i], power[i + 3]));
    }
    for (int k = 0; k < 5; k++, rk = real_mul(rk, r)) {
        b.c[k] = real_zero();
        for (int i = k < 3 ? 0 : k - 2; i < 3; i++) {
            struct real c = real_mul(e[i], power[i + 2 - k]);
            c = real_mul(c, real_int(pascal[i][k]));
            b.c[k] = real_add(b.c[k], c);
        }
        b.c[k] = real_mul(b.c[k], rk);
    }
    return b;
}

struct walk {
    struct wide p, v; /* without the quintic */
    int64_t a, t;
};

/* Coefficients in steps, of u^1 .. u^5; p, v, a moved to the phase's end. */
static void phase_poly(const struct motion_otg_plan *plan, int i,
                       struct walk *at, struct wide c[5])
{
    int64_t n = plan->phase[i].ticks, to = plan->phase[i].acc;
    struct bend b = bend_about(plan, at->t, n);
    c[0] = wide_mul(wide_mul(at->v, 3), n);
    c[1] = wide_mul(wide_mul(wide_from(3 * at->a), n), n);
    c[2] = wide_mul(wide_mul(wide_from(to - at->a), n), n);
    c[3] = c[4] = wide_from(0);
    at->p = wide_add(at->p, wide_add(c[0], wide_add(c[1], c[2])));
    at->v = wide_add(at->v, wide_mul(wide_from(at->a + to), n));
    at->a = to;
    at->t += n;
    for (int k = 0; k < 5; k++)
        c[k] = wide_add(c[k], wide_floor(b.c[k]));
}

static int wide_bits(struct wide a)
{
    if (wide_is_negative(a))
        a = wide_neg(a);
    return a.hi ? 128 - (int)real_clz(a.hi) : 64 - (int)real_clz(a.lo);
}

/* Steps to 2^-(32 + frac), the finest that the largest allows; to nearest.
 * Returns frac. */
static int poly_scale(const struct wide c[5], int pos_shift, int64_t coef[5])
{
    int bits = 0;
    for (int k = 0; k < 5; k++)
        bits = wide_bits(c[k]) > bits ? wide_bits(c[k]) : bits;
    /* frac + 32 - pos_shift + bits <= TRACK_COEF_BITS */
    int frac = TRACK_COEF_BITS - bits + pos_shift - 32;
    if (frac < TRACK_COEF_BITS - 62)
        return MOTION_E_RANGE;
    frac = frac > 31 ? 31 : frac < 0 ? 0 : frac;
    int shift = pos_shift - 32 - frac;
    for (int k = 0; k < 5; k++) {
        struct wide x = c[k];
        if (shift > 0)
            x = wide_shr(
                wide_add(x, wide_shl(wide_from(1), (unsigned)shift - 1)),
                (unsigned)shift);
        else
            x = wide_shl(x, (unsigned)-shift);
        coef[k] = (int64_t)x.lo;
    }
    return frac;
}

/* start + p as 2^-32 units and the fraction below. */
static int position(const struct motion_otg_plan *plan, struct wide p,
                    int64_t *pos_q32, uint64_t *frac)
{
    unsigned shift = (unsigned)(plan->pos_shift - 32);
    struct wide whole = wide_shr(p, shift);
    struct wide rest = wide_sub(p, wide_shl(whole, shift));
    *frac = shift <= 64 ? wide_shl(rest, 64 - shift).lo
                        : wide_shr(rest, shift - 64).lo;
    if (shift == 0)
        *frac = 0;
    if (whole.hi != 0 - (whole.lo >> 63))
        return MOTION_E_RANGE;
    return motion_fixed_add(plan->start_pos_q32, (int64_t)whole.lo, pos_q32);
}

static int append_phase(const struct motion_otg_plan *plan, int i,
                        struct walk *at, struct motion_track *track)
{
    struct wide c[5], end = motion_otg_wide_in(plan->way);
    int64_t coef[5], pos_q32;
    uint64_t frac;
    int64_t dur = plan->phase[i].ticks << plan->tick_shift;
    phase_poly(plan, i, at, c);
    if (i + 1 < plan->count)
        end = wide_add(at->p, wide_floor(bend_about(plan, at->t, 0).at));
    int scale = poly_scale(c, plan->pos_shift, coef);
    if (scale < 0)
        return scale;
    int err = position(plan, end, &pos_q32, &frac);
    if (err < 0)
        return err;
    return motion_track_append_poly(track, dur, 5, coef, (unsigned)scale,
                                    pos_q32, frac);
}

int motion_otg_append(const struct motion_otg_plan *plan,
                      struct motion_track *track)
{
    struct motion_track before = *track;
    struct walk at = { .v = motion_otg_wide_in(plan->start_vel),
                       .a = plan->start_acc };
    for (int i = 0; i < plan->count; i++) {
        int err = append_phase(plan, i, &at, track);
        if (err < 0) {
            *track = before;
            return err;
        }
    }
    return MOTION_OK;
}
