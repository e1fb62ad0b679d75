/* motion/plan/rig/jet.h - a number and its first two derivatives by time.
 *
 * Arithmetic on jets carries the chain rule along, so that geometry written once
 * gives positions, velocities and accelerations:
 *
 *     f(g): p = f(g), v = f'(g) g', a = f''(g) g'^2 + f'(g) g''
 *
 * and what does not move has v = a = 0 to the bit.  Angles in radian.  Source:
 * A. Griewank, A. Walther, Evaluating Derivatives (2008), 13 (Taylor
 * arithmetic).  In double: plan-time, off-line only.
 *
 * Sine, cosine and angles are those of motion/number/trig.h: C libraries differ
 * in the last bit of theirs, and with it a move would from one machine to the
 * next. */
#ifndef MOTION_PLAN_RIG_JET_H
#define MOTION_PLAN_RIG_JET_H

#include <math.h>

struct plan_jet {
    double p, v, a;
};

struct plan_jet_vec {
    struct plan_jet x[3];
};

static inline struct plan_jet plan_jet_of(double p)
{
    return (struct plan_jet){ p, 0, 0 };
}

static inline struct plan_jet plan_jet_add(struct plan_jet a, struct plan_jet b)
{
    return (struct plan_jet){ a.p + b.p, a.v + b.v, a.a + b.a };
}

static inline struct plan_jet plan_jet_scale(struct plan_jet a, double k)
{
    return (struct plan_jet){ k * a.p, k * a.v, k * a.a };
}

static inline struct plan_jet plan_jet_sub(struct plan_jet a, struct plan_jet b)
{
    return plan_jet_add(a, plan_jet_scale(b, -1));
}

static inline struct plan_jet plan_jet_mul(struct plan_jet a, struct plan_jet b)
{
    return (struct plan_jet){ a.p * b.p, a.v * b.p + a.p * b.v,
                              a.a * b.p + 2 * a.v * b.v + a.p * b.a };
}

/* f(g) from f, f', f'' at g. */
static inline struct plan_jet plan_jet_chain(struct plan_jet g, double f,
                                             double df, double ddf)
{
    return (struct plan_jet){ f, df * g.v, ddf * g.v * g.v + df * g.a };
}

struct plan_jet plan_jet_sin(struct plan_jet g); /* |g.p| < 2^40 */
struct plan_jet plan_jet_cos(struct plan_jet g);

/* g.p > 0 */
static inline struct plan_jet plan_jet_sqrt(struct plan_jet g)
{
    const double root = sqrt(g.p);

    return plan_jet_chain(g, root, 0.5 / root, -0.25 / (root * g.p));
}

/* g.p != 0 */
static inline struct plan_jet plan_jet_invert(struct plan_jet g)
{
    const double r = 1 / g.p;

    return plan_jet_chain(g, r, -r * r, 2 * r * r * r);
}

/* The angle of (x, y) from the x axis; not both zero. */
struct plan_jet plan_jet_atan2(struct plan_jet y, struct plan_jet x);

static inline struct plan_jet_vec plan_jet_vec_of(const double x[3])
{
    return (struct plan_jet_vec){ { plan_jet_of(x[0]), plan_jet_of(x[1]),
                                    plan_jet_of(x[2]) } };
}

static inline struct plan_jet_vec plan_jet_vec_add(struct plan_jet_vec a,
                                                   struct plan_jet_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = plan_jet_add(a.x[i], b.x[i]);
    return a;
}

static inline struct plan_jet_vec plan_jet_vec_mul(struct plan_jet_vec a,
                                                   struct plan_jet k)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = plan_jet_mul(a.x[i], k);
    return a;
}

static inline struct plan_jet_vec plan_jet_vec_sub(struct plan_jet_vec a,
                                                   struct plan_jet_vec b)
{
    return plan_jet_vec_add(a, plan_jet_vec_mul(b, plan_jet_of(-1)));
}

/* Two perpendicular ones by an angle, a towards b. */
static inline void plan_jet_vec_swing(struct plan_jet_vec *a,
                                      struct plan_jet_vec *b,
                                      struct plan_jet angle)
{
    const struct plan_jet s = plan_jet_sin(angle), c = plan_jet_cos(angle);
    const struct plan_jet_vec from = *a;

    *a = plan_jet_vec_add(plan_jet_vec_mul(from, c), plan_jet_vec_mul(*b, s));
    *b = plan_jet_vec_sub(plan_jet_vec_mul(*b, c), plan_jet_vec_mul(from, s));
}

static inline struct plan_jet plan_jet_vec_dot(struct plan_jet_vec a,
                                               struct plan_jet_vec b)
{
    struct plan_jet sum = plan_jet_mul(a.x[0], b.x[0]);

    for (int i = 1; i < 3; i++)
        sum = plan_jet_add(sum, plan_jet_mul(a.x[i], b.x[i]));
    return sum;
}

/* Turned about a unit axis that stands still (Rodrigues). */
static inline struct plan_jet_vec plan_jet_vec_turn(struct plan_jet_vec v,
                                                    const double axis[3],
                                                    struct plan_jet angle)
{
    const struct plan_jet s = plan_jet_sin(angle), c = plan_jet_cos(angle);
    const struct plan_jet along =
        plan_jet_mul(plan_jet_vec_dot(v, plan_jet_vec_of(axis)),
                     plan_jet_sub(plan_jet_of(1), c));
    struct plan_jet_vec turned;

    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const struct plan_jet across = plan_jet_sub(
            plan_jet_scale(v.x[k], axis[j]), plan_jet_scale(v.x[j], axis[k]));
        turned.x[i] = plan_jet_add(
            plan_jet_add(plan_jet_mul(v.x[i], c), plan_jet_mul(across, s)),
            plan_jet_scale(along, axis[i]));
    }
    return turned;
}

#endif
