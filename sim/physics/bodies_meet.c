/* sim/physics/bodies_meet.c - when a pair that flies meets; see bodies_contact.h. */
#include <math.h>
#include <stddef.h>

#include "sim/physics/bodies_contact.h"

#define ADVANCE_MAX 1000

/* The root of gap + speed s + acc/2 s^2 at which it falls; INFINITY when there
 * is none.  gap >= 0. */
static double sim_contact_fall(double gap, double speed, double acc)
{
    const double square = speed * speed - 2 * acc * gap;

    if (square < 0 || (speed >= 0 && acc >= 0))
        return INFINITY;
    if (speed < 0)
        return 2 * gap / (sqrt(square) - speed);
    return (speed + sqrt(square)) / -acc;
}

static void sim_sphere_later(const struct sim_sphere *sphere, double s,
                             double *pos)
{
    for (int k = 0; k < 3; k++)
        pos[k] = sphere->pos_m[k] +
                 s * (sphere->vel_m_s[k] + 0.5 * s * sphere->acc_m_s2[k]);
}

/* Gap of a pair s later, on the parabolas. */
static double sim_contact_later(const struct sim_bodies *bodies,
                                const struct sim_contact *contact, double t_s,
                                double s, struct sim_touch *touch)
{
    double a[3], b[3];

    sim_sphere_later(&bodies->sphere[contact->a], s, a);
    if (contact->b >= 0)
        sim_sphere_later(&bodies->sphere[contact->b], s, b);
    sim_contact_gap_at(bodies, contact, t_s + s, a, contact->b >= 0 ? b : NULL,
                       touch);
    return touch->gap_m;
}

/* A plane that turns: where the gap at the end is negative, by halving. */
static double sim_contact_meet_turning(const struct sim_bodies *bodies,
                                       const struct sim_contact *contact,
                                       double t_s, double step_s)
{
    struct sim_touch touch;
    double low = 0, high = step_s;

    if (sim_contact_later(bodies, contact, t_s, step_s, &touch) >= 0)
        return INFINITY;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (sim_contact_later(bodies, contact, t_s, middle, &touch) < 0)
            high = middle;
        else
            low = middle;
    }
    return high;
}

/* By how much the surface of a box that turns can approach what is near sphere
 * a in the step: the highest speed of turning times how far a comes from what it
 * turns about. */
static double sim_turning_most(const struct sim_bodies *bodies,
                               const struct sim_contact *contact, double end_s,
                               double reach_m)
{
    const struct sim_turning turning = sim_contact_turning(bodies, contact);
    struct sim_signal slope;
    double from[3];

    if (turning.angle == NULL)
        return 0;
    slope = sim_signal_slope(turning.angle);
    for (int i = 0; i < SIM_SIGNAL_COEFFICIENTS; i++)
        slope.c[i] = fabs(slope.c[i]);
    for (int k = 0; k < 3; k++)
        from[k] = bodies->sphere[contact->a].pos_m[k] - turning.point[k];
    return sim_signal_at(&slope, end_s) *
           (sqrt(sim_dot3(from, from)) + reach_m);
}

/* How fast the gap of a pair grows s later; vel, acc as below. */
static double sim_contact_opens(const struct sim_bodies *bodies,
                                const struct sim_contact *contact, double t_s,
                                double s, const double *vel, const double *acc,
                                const double *normal)
{
    const struct sim_turning turning = sim_contact_turning(bodies, contact);
    double at[3], surface[3];

    sim_sphere_later(&bodies->sphere[contact->a], s, at);
    sim_turning_vel(&turning, t_s + s, at, surface);
    return sim_dot3(normal, vel) + s * sim_dot3(normal, acc) -
           sim_dot3(normal, surface);
}

/* By advancing no further than the pair can approach: vel, acc are a's against
 * what it meets, but for the turning of that. */
static double sim_contact_advance(const struct sim_bodies *bodies,
                                  const struct sim_contact *contact, double t_s,
                                  double step_s, const double *vel,
                                  const double *acc)
{
    const double goes =
        sqrt(sim_dot3(vel, vel)) + step_s * sqrt(sim_dot3(acc, acc));
    const double most =
        goes + sim_turning_most(bodies, contact, t_s + step_s, step_s * goes);
    struct sim_touch touch;
    double s = 0;

    for (int i = 0; i < ADVANCE_MAX && s < step_s; i++) {
        const double gap = sim_contact_later(bodies, contact, t_s, s, &touch);
        if (gap > most * (step_s - s))
            return INFINITY;
        if (gap >= 0.1 * SIM_BODIES_TOUCH_M)
            s += gap / most;
        else if (sim_contact_opens(bodies, contact, t_s, s, vel, acc,
                                   touch.normal) < 0)
            return s;
        else /* apart from a touch: not at once together again */
            s += step_s / ADVANCE_MAX;
    }
    return s < step_s ? s : INFINITY;
}

/* Two spheres: a quadratic when both accelerate alike. */
static double sim_contact_meet_spheres(const struct sim_bodies *bodies,
                                       const struct sim_contact *contact,
                                       double t_s, double step_s)
{
    const struct sim_sphere *const a = &bodies->sphere[contact->a];
    const struct sim_sphere *const b = &bodies->sphere[contact->b];
    const double reach = a->radius_m + b->radius_m;
    double from[3], vel[3], acc[3];

    for (int k = 0; k < 3; k++) {
        from[k] = a->pos_m[k] - b->pos_m[k];
        vel[k] = a->vel_m_s[k] - b->vel_m_s[k];
        acc[k] = a->acc_m_s2[k] - b->acc_m_s2[k];
    }
    if (sim_dot3(acc, acc) > 1e-18 * (1 + sim_dot3(b->acc_m_s2, b->acc_m_s2)))
        return sim_contact_advance(bodies, contact, t_s, step_s, vel, acc);
    const double beyond = fmax(0, sim_dot3(from, from) - reach * reach);
    return sim_contact_fall(beyond, 2 * sim_dot3(from, vel),
                            2 * sim_dot3(vel, vel));
}

static double sim_contact_meet(const struct sim_bodies *bodies,
                               const struct sim_contact *contact, double t_s,
                               double step_s)
{
    const struct sim_sphere *const a = &bodies->sphere[contact->a];
    struct sim_touch touch;

    if (contact->b >= 0)
        return sim_contact_meet_spheres(bodies, contact, t_s, step_s);
    if (contact->box >= 0)
        return sim_contact_advance(bodies, contact, t_s, step_s, a->vel_m_s,
                                   a->acc_m_s2);
    if (sim_contact_turning(bodies, contact).angle != NULL)
        return sim_contact_meet_turning(bodies, contact, t_s, step_s);
    sim_contact_gap(bodies, contact, t_s, &touch);
    return sim_contact_fall(fmax(0, touch.gap_m),
                            sim_dot3(a->vel_m_s, touch.normal),
                            sim_dot3(a->acc_m_s2, touch.normal));
}

double sim_contact_next(const struct sim_bodies *bodies, double t_s,
                        double step_s)
{
    double next_s = step_s;

    for (int c = 0; c < bodies->contacts; c++) {
        if (!bodies->contact[c].rests)
            next_s = fmin(next_s, sim_contact_meet(bodies, &bodies->contact[c],
                                                   t_s, next_s));
    }
    return next_s;
}
