/* motion/path/orient.c - see orient.h. */
#include "motion/path/orient.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/interval.h"

#define ORIENT_ONE_Q62 ((int64_t)1 << 62)

/* --- the parameter -------------------------------------------------------- */

/* n a + m b + k */
static struct motion_real orient_coef(const struct motion_orient_key *span,
                                      int n, int m, int k)
{
    return motion_real_add(
        motion_real_add(motion_real_mul(span->first, motion_real_int(n)),
                        motion_real_mul(span->last, motion_real_int(m))),
        motion_real_int(k));
}

/* u in 0 .. 1, Q2.62 */
static int64_t orient_parameter(const struct motion_orient_key *span, int64_t t)
{
    const struct motion_real x = motion_real_div(
        motion_real_int(t - span[0].t), motion_real_int(span[1].t - span[0].t));
    struct motion_real u = orient_coef(span, -3, -3, 6);
    int64_t u_q62 = 0;

    u = motion_real_add(motion_real_mul(u, x), orient_coef(span, 8, 7, -15));
    u = motion_real_add(motion_real_mul(u, x), orient_coef(span, -6, -4, 10));
    u = motion_real_add(motion_real_mul(u, motion_real_sqr(x)), span->first);
    (void)motion_real_round(motion_real_mul(u, x), 62, &u_q62);
    return u_q62 < 0 ? 0 : u_q62 > ORIENT_ONE_Q62 ? ORIENT_ONE_Q62 : u_q62;
}

/* Slopes of SQUAD at an inner key: the speed 2 / (h + h') times the span h. */
static void orient_slopes(struct motion_orient_key *key)
{
    const struct motion_real before = motion_real_int(key[0].t - key[-1].t);
    const struct motion_real after = motion_real_int(key[1].t - key[0].t);
    const struct motion_real mean =
        motion_real_half(motion_real_add(before, after));

    key[-1].last = motion_real_div(before, mean);
    key[0].first = motion_real_div(after, mean);
}

/* Rest at both ends of every span; SQUAD and C2 go on through inner keys. */
static int orient_spans(struct motion_orient *orient)
{
    struct motion_orient_key *const key = orient->key;
    const uint32_t count = orient->count;

    for (uint32_t i = 0; i < count; i++)
        key[i].first = key[i].last = motion_real_zero();
    for (uint32_t i = 0; i + 1 < count; i++) {
        int64_t dur;
        if (key[i + 1].t <= key[i].t)
            return MOTION_E_ORDER;
        if (motion_fixed_sub(key[i + 1].t, key[i].t, &dur) < 0)
            return MOTION_E_RANGE;
    }
    for (uint32_t i = 1; i + 1 < count; i++) {
        if (orient->curve == MOTION_ORIENT_SQUAD)
            orient_slopes(&key[i]);
        if (orient->curve == MOTION_ORIENT_C2)
            key[i - 1].last = key[i].first = motion_real_int(1);
    }
    return MOTION_OK;
}

/* --- the curves ----------------------------------------------------------- */

static struct motion_quat orient_near(struct motion_quat q,
                                      struct motion_quat to)
{
    return motion_quat_dot_q62(q, to) < 0 ? motion_quat_neg(q) : q;
}

/* Three keys in a row, of one sign, give the inner point of the middle one. */
static int orient_squad(struct motion_orient *orient)
{
    struct motion_orient_key *const key = orient->key;
    const uint32_t last = orient->count - 1;
    struct motion_quat chain[3], inner[3];
    int err = MOTION_OK;

    chain[1] = key[0].q;
    key[0].from = key[0].from_inner = chain[1];
    for (uint32_t i = 0; i < last && err == MOTION_OK; i++) {
        chain[2] = orient_near(key[i + 1].q, chain[1]);
        if (i > 0) {
            err = motion_quat_squad_inner(chain, 3, inner);
            key[i].from_inner = key[i - 1].to_inner = inner[1];
        }
        key[i].from = chain[1];
        key[i].to = key[i].to_inner = chain[2];
        chain[0] = chain[1];
        chain[1] = chain[2];
    }
    return err;
}

static int orient_c2(struct motion_orient *orient)
{
    for (uint32_t i = 0; i < orient->count; i++)
        orient->rotkey[i] = (struct motion_rotkey){
            .t_ns_q12 = orient->key[i].t,
            .q = orient->key[i].q,
        };
    return motion_rotspline_plan(&orient->spline, orient->rotkey, orient->count,
                                 MOTION_ROTSPLINE_CHORD, MOTION_ROTSPLINE_CHORD,
                                 0);
}

int motion_orient_plan(struct motion_orient *orient)
{
    int err;

    if (orient->count == 0)
        return MOTION_E_EMPTY;
    if ((unsigned)orient->curve > MOTION_ORIENT_C2)
        return MOTION_E_ARG;
    err = orient_spans(orient);
    if (err == MOTION_OK && orient->curve == MOTION_ORIENT_SQUAD)
        err = orient_squad(orient);
    if (err == MOTION_OK && orient->curve == MOTION_ORIENT_C2)
        err = orient_c2(orient);
    return err;
}

static uint32_t orient_find(const struct motion_orient *orient, int64_t t)
{
    return motion_interval_find(&orient->key->t, sizeof *orient->key,
                                orient->count - 1, t);
}

static int orient_squad_at(const struct motion_orient_key *span, int64_t u_q62,
                           struct motion_quat *q)
{
    const struct motion_quat key[2] = { span->from, span->to };
    const struct motion_quat inner[2] = { span->from_inner, span->to_inner };

    return motion_quat_squad(key, inner, u_q62, q);
}

int motion_orient_at(const struct motion_orient *orient, int64_t t,
                     struct motion_quat *q)
{
    const struct motion_orient_key *const last =
        &orient->key[orient->count - 1];

    if (t <= orient->key->t || t >= last->t) {
        *q = t >= last->t ? last->q : orient->key->q;
        return MOTION_OK;
    }
    const struct motion_orient_key *const span =
        &orient->key[orient_find(orient, t)];
    const int64_t u_q62 = orient_parameter(span, t);
    if (orient->curve == MOTION_ORIENT_SLERP)
        return motion_quat_slerp(span[0].q, span[1].q, u_q62, q);
    if (orient->curve == MOTION_ORIENT_SQUAD)
        return orient_squad_at(span, u_q62, q);
    *q =
        motion_rotspline_within(&orient->spline.key[span - orient->key], u_q62);
    return MOTION_OK;
}
