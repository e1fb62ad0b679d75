/* motion/curve/spline_local.c - velocities from a few neighbours; see
 * spline.h. */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

static bool local_is_rule(enum motion_spline_end rule)
{
    return rule == MOTION_SPLINE_REST || rule == MOTION_SPLINE_ONE_SIDED;
}

static int local_check(const struct motion_key *key, uint32_t count,
                       enum motion_spline_end first,
                       enum motion_spline_end last)
{
    if (!local_is_rule(first) || !local_is_rule(last))
        return MOTION_E_ARG;
    return spline_order(key, count);
}

/* Does the rule say that this key rests? */
static bool local_rests(uint32_t i, uint32_t count,
                        enum motion_spline_end first,
                        enum motion_spline_end last)
{
    return count == 1 || (i == 0 && first == MOTION_SPLINE_REST) ||
           (i == count - 1 && last == MOTION_SPLINE_REST);
}

/* --- monotone ----------------------------------------------------------------
 *
 * The weighted harmonic mean of the chords, zero where they turn: never above
 * three times the smaller one, which keeps a cubic between its ends.  Fritsch &
 * Butland, SIAM J. Sci. Stat. Comput. 5 (1984); ends: Moler, Numerical
 * Computing with MATLAB, 3.4. */
static struct motion_real local_harmonic(struct spline_chord before,
                                         struct spline_chord after)
{
    const struct motion_real w0 =
        motion_real_add(motion_real_twice(after.dur), before.dur);
    const struct motion_real w1 =
        motion_real_add(motion_real_twice(before.dur), after.dur);

    if (motion_real_sign(before.vel) * motion_real_sign(after.vel) <= 0)
        return motion_real_zero();
    return motion_real_div(motion_real_add(w0, w1),
                           motion_real_add(motion_real_div(w0, before.vel),
                                           motion_real_div(w1, after.vel)));
}

static struct motion_real local_harmonic_end(struct spline_chord outer,
                                             struct spline_chord inner)
{
    const struct motion_real vel = spline_parabola_end(outer, inner);
    const struct motion_real most = curve_times(outer.vel, 3);

    if (motion_real_sign(vel) != motion_real_sign(outer.vel))
        return motion_real_zero();
    if (motion_real_sign(outer.vel) != motion_real_sign(inner.vel) &&
        motion_real_lt(motion_real_abs(most), motion_real_abs(vel)))
        return most;
    return vel;
}

static struct motion_real local_monotone(const struct motion_key *key,
                                         uint32_t i, uint32_t count)
{
    if (count == 2)
        return spline_chord(key).vel;
    if (i == 0)
        return local_harmonic_end(spline_chord(key), spline_chord(key + 1));
    if (i == count - 1)
        return local_harmonic_end(spline_chord(&key[i - 1]),
                                  spline_chord(&key[i - 2]));
    return local_harmonic(spline_chord(&key[i - 1]), spline_chord(&key[i]));
}

int motion_spline_monotone(struct motion_key *key, uint32_t count,
                           enum motion_spline_end first,
                           enum motion_spline_end last)
{
    int rc = local_check(key, count, first, last);

    if (rc != MOTION_OK)
        return rc;
    for (uint32_t i = 0; i < count; i++)
        if (!key[i].has_vel)
            key[i].vel = local_rests(i, count, first, last)
                             ? motion_real_zero()
                             : local_monotone(key, i, count);
    return spline_velocities_within(key, count);
}

/* --- Akima -------------------------------------------------------------------
 *
 * Of five keys the chords m0 .. m3; v = (w1 m1 + w2 m2) / (w1 + w2) with w1 =
 * |m3 - m2|, w2 = |m1 - m0|.  Two chords more on each side lie on the parabola
 * of the last three keys.  Akima, J. ACM 17 (1970). */

/* The chord before key i; i may be 2 beyond either end. */
static struct motion_real local_chord(const struct motion_key *key, int64_t i,
                                      uint32_t count)
{
    const int64_t last = (int64_t)count - 1;
    struct motion_real outer, inner;
    int64_t beyond = 0;

    if (i < 1) {
        beyond = 1 - i;
        outer = spline_chord(key).vel;
        inner = count > 2 ? spline_chord(key + 1).vel : outer;
    } else if (i > last) {
        beyond = i - last;
        outer = spline_chord(&key[last - 1]).vel;
        inner = count > 2 ? spline_chord(&key[last - 2]).vel : outer;
    } else {
        return spline_chord(&key[i - 1]).vel;
    }
    return motion_real_add(
        outer, curve_times(motion_real_sub(outer, inner), (int)beyond));
}

struct local_akima {
    struct motion_real m[4], w1, w2;
};

static struct local_akima local_akima(const struct motion_key *key, uint32_t i,
                                      uint32_t count)
{
    struct local_akima a;

    for (int n = 0; n < 4; n++)
        a.m[n] = local_chord(key, (int64_t)i - 1 + n, count);
    a.w1 = motion_real_abs(motion_real_sub(a.m[3], a.m[2]));
    a.w2 = motion_real_abs(motion_real_sub(a.m[1], a.m[0]));
    return a;
}

/* Where both weights are nothing but what the positions round, the chords are
 * two straight lines that meet: the mean of the two. */
static struct motion_real local_akima_vel(const struct local_akima *a,
                                          struct motion_real least)
{
    const struct motion_real both = motion_real_add(a->w1, a->w2);

    if (motion_real_cmp(both, least) <= 0)
        return motion_real_half(motion_real_add(a->m[0], a->m[3]));
    return motion_real_div(motion_real_add(motion_real_mul(a->w1, a->m[1]),
                                           motion_real_mul(a->w2, a->m[2])),
                           both);
}

int motion_spline_akima(struct motion_key *key, uint32_t count,
                        enum motion_spline_end first,
                        enum motion_spline_end last)
{
    struct motion_real most = motion_real_zero();
    int rc = local_check(key, count, first, last);

    if (rc != MOTION_OK)
        return rc;
    for (uint32_t i = 0; count > 1 && i < count; i++) {
        const struct local_akima a = local_akima(key, i, count);
        most = motion_real_max(most, motion_real_add(a.w1, a.w2));
    }
    most = motion_real_scale(most, -30);
    for (uint32_t i = 0; i < count; i++) {
        if (key[i].has_vel)
            continue;
        key[i].vel = motion_real_zero();
        if (!local_rests(i, count, first, last)) {
            const struct local_akima a = local_akima(key, i, count);
            key[i].vel = local_akima_vel(&a, most);
        }
    }
    return spline_velocities_within(key, count);
}

/* --- no overshoot ------------------------------------------------------------ */

/* Towards zero until it has the chord's sign and at most three times it. */
static struct motion_real local_limit(struct motion_real vel,
                                      struct motion_real chord)
{
    const struct motion_real most = curve_times(chord, 3);

    if (motion_real_sign(vel) != motion_real_sign(chord))
        return motion_real_zero();
    return motion_real_lt(motion_real_abs(most), motion_real_abs(vel)) ? most
                                                                       : vel;
}

int motion_spline_limit_overshoot(struct motion_key *key, uint32_t count)
{
    int rc = spline_order(key, count);

    for (uint32_t i = 0; rc == MOTION_OK && i < count; i++) {
        if (key[i].has_vel)
            continue;
        key[i].vel = spline_read(key[i].vel);
        if (i > 0)
            key[i].vel = local_limit(key[i].vel, spline_chord(&key[i - 1]).vel);
        if (i + 1 < count)
            key[i].vel = local_limit(key[i].vel, spline_chord(&key[i]).vel);
    }
    return rc;
}

/* --- Kochanek & Bartels -------------------------------------------------------
 *
 * With d0, d1 the displacements before and after a key and h0, h1 their times, the
 * velocities that the curve has coming in and going out are
 *   in   (1-t) ((1-c)(1+b) d0 + (1+c)(1-b) d1) / (h0 + h1)
 *   out  (1-t) ((1+c)(1+b) d0 + (1-c)(1-b) d1) / (h0 + h1)
 * Kochanek & Bartels, SIGGRAPH 1984, with their adjustment for uneven keys. */
struct local_kochanek {
    const struct motion_key *key;
    uint32_t count;
    struct motion_real less; /* 1 - tension */
    struct motion_real c[2]; /* 1 - continuity, 1 + continuity */
    struct motion_real b[2]; /* 1 - bias, 1 + bias */
    enum motion_spline_end first, last;
};

static struct motion_real local_kochanek_inner(const struct local_kochanek *kb,
                                               uint32_t i, bool out)
{
    const struct motion_key *key = &kb->key[i];
    const struct motion_real both =
        motion_real_add(spline_span(key - 1), spline_span(key));
    const struct motion_real before =
        motion_real_mul(motion_real_mul(kb->c[out], kb->b[1]),
                        spline_displacement(key[-1].pos_q32, key[0].pos_q32));
    const struct motion_real after =
        motion_real_mul(motion_real_mul(kb->c[!out], kb->b[0]),
                        spline_displacement(key[0].pos_q32, key[1].pos_q32));

    return motion_real_mul(
        kb->less, motion_real_div(motion_real_add(before, after), both));
}

static bool local_kochanek_is_end(const struct local_kochanek *kb, uint32_t i)
{
    return i == 0 || i == kb->count - 1;
}

static struct motion_real local_kochanek_vel(const struct local_kochanek *kb,
                                             uint32_t i, bool out)
{
    const uint32_t span = i == 0 ? 0 : i - 1, next = i == 0 ? 1 : i - 1;
    const enum motion_spline_end rule = i == 0 ? kb->first : kb->last;
    struct motion_real chord;

    if (kb->key[i].has_vel)
        return spline_read(kb->key[i].vel);
    if (!local_kochanek_is_end(kb, i))
        return local_kochanek_inner(kb, i, out);
    if (rule == MOTION_SPLINE_REST)
        return motion_real_zero();
    chord = spline_chord(&kb->key[span]).vel;
    if (rule == MOTION_SPLINE_ONE_SIDED || local_kochanek_is_end(kb, next))
        return motion_real_mul(kb->less, chord);
    return motion_real_half(motion_real_sub(
        curve_times(chord, 3), kb->key[next].has_vel
                                   ? spline_read(kb->key[next].vel)
                                   : local_kochanek_inner(kb, next, i != 0)));
}

static int local_kochanek_span(struct motion_track *track,
                               const struct motion_key *key, const void *with)
{
    const struct local_kochanek *kb = with;
    const uint32_t i = (uint32_t)(key - kb->key);
    const struct spline_poly poly = spline_cubic(
        spline_displacement(key[0].pos_q32, key[1].pos_q32), spline_span(key),
        local_kochanek_vel(kb, i, true), local_kochanek_vel(kb, i + 1, false));

    return spline_emit(track, key[1].t_ns_q12 - key[0].t_ns_q12, &poly,
                       key[1].pos_q32, 0);
}

static bool local_is_unit(int64_t a_q32)
{
    return a_q32 >= -MOTION_FIXED_ONE_Q32 && a_q32 <= MOTION_FIXED_ONE_Q32;
}

int motion_spline_append_kochanek(struct motion_track *track,
                                  const struct motion_key *key, uint32_t count,
                                  const struct motion_spline_kochanek *shape,
                                  enum motion_spline_end first,
                                  enum motion_spline_end last, uint32_t *failed)
{
    const int64_t one = MOTION_FIXED_ONE_Q32;
    const struct local_kochanek kb = {
        key,
        count,
        motion_real_from_q(one - shape->tension_q32, 32),
        { motion_real_from_q(one - shape->continuity_q32, 32),
          motion_real_from_q(one + shape->continuity_q32, 32) },
        { motion_real_from_q(one - shape->bias_q32, 32),
          motion_real_from_q(one + shape->bias_q32, 32) },
        first,
        last,
    };

    if (failed)
        *failed = 0;
    if (!local_is_unit(shape->tension_q32) ||
        !local_is_unit(shape->continuity_q32) ||
        !local_is_unit(shape->bias_q32) ||
        (unsigned)first > MOTION_SPLINE_NATURAL ||
        (unsigned)last > MOTION_SPLINE_NATURAL)
        return MOTION_E_ARG;
    return spline_each(track, key, count, local_kochanek_span, &kb, failed);
}
