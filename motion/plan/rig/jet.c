/* motion/plan/rig/jet.c - see jet.h. */
#include "motion/plan/rig/jet.h"

#include "motion/number/trig.h"
#include "motion/plan/rig/plan_rig.h"

static void jet_sincos(double rad, double *s, double *c)
{
    int64_t sin_q62, cos_q62;
    motion_trig_sincos(motion_trig_from_rad(plan_rig_from_double(rad)),
                       &sin_q62, &cos_q62);
    *s = (double)sin_q62 * 0x1p-62;
    *c = (double)cos_q62 * 0x1p-62;
}

struct plan_jet plan_jet_sin(struct plan_jet g)
{
    double s, c;
    jet_sincos(g.p, &s, &c);
    return plan_jet_chain(g, s, c, -s);
}

struct plan_jet plan_jet_cos(struct plan_jet g)
{
    double s, c;
    jet_sincos(g.p, &s, &c);
    return plan_jet_chain(g, c, -s, -c);
}

/* d = (x dy - y dx) / (x^2 + y^2) */
struct plan_jet plan_jet_atan2(struct plan_jet y, struct plan_jet x)
{
    const int64_t turn = motion_trig_atan2_real(plan_rig_from_double(y.p),
                                                plan_rig_from_double(x.p));
    const double square = x.p * x.p + y.p * y.p;
    const double v = (x.p * y.v - y.p * x.v) / square;
    const double grow = 2 * (x.p * x.v + y.p * y.v);

    return (struct plan_jet){ plan_rig_real(motion_trig_rad(turn)), v,
                              (x.p * y.a - y.p * x.a - v * grow) / square };
}
