/* sim/physics/bodies_contact.h - what the files of bodies.h share: a pair's
 * geometry, and impulses on it. */
#ifndef SIM_PHYSICS_BODIES_CONTACT_H
#define SIM_PHYSICS_BODIES_CONTACT_H

#include "sim/physics/bodies.h"

#define SIM_BODIES_TOUCH_M      1e-9  /* surfaces that touch */
#define SIM_BODIES_NEAR_M       1e-6  /* that rest on each other still */
#define SIM_BODIES_APART_M_S    1e-5  /* that separate */
#define SIM_BODIES_APPROACH_M_S 1e-10 /* that approach */

static inline double sim_dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void sim_cross3(const double *a, const double *b, double *to)
{
    to[0] = a[1] * b[2] - a[2] * b[1];
    to[1] = a[2] * b[0] - a[0] * b[2];
    to[2] = a[0] * b[1] - a[1] * b[0];
}

/* The normal points to sphere a; push is what impulses act along, the same but
 * where a contact that rests moves over something round. */
struct sim_touch {
    double gap_m, normal[3], push[3];
    double slip_m_s[3]; /* of a's contact point against b's, tangential */
    double speed_m_s;   /* normal: negative when they approach */
};

/* Of a pair with a plane or box that turns: about what, and its angle over the
 * step. */
struct sim_turning {
    const double *point, *axis;
    const struct sim_signal *angle; /* NULL: it stands */
};

struct sim_turning sim_contact_turning(const struct sim_bodies *bodies,
                                       const struct sim_contact *contact);
/* How fast what turns goes at a place. */
void sim_turning_vel(const struct sim_turning *turning, double t_s,
                     const double *pos, double *vel);

/* Normal and gap with the spheres at these places; b: NULL when it is no
 * sphere. */
void sim_contact_gap_at(const struct sim_bodies *bodies,
                        const struct sim_contact *contact, double t_s,
                        const double *a, const double *b,
                        struct sim_touch *touch);

/* Normal and gap with planes and boxes at t_s, the spheres where they are. */
void sim_contact_gap(const struct sim_bodies *bodies,
                     const struct sim_contact *contact, double t_s,
                     struct sim_touch *touch);
/* The same, with the speeds. */
void sim_contact_touch(const struct sim_bodies *bodies,
                       const struct sim_contact *contact, double t_s,
                       struct sim_touch *touch);

/* An impulse on a, and the opposite one on b, at the point of contact. */
void sim_contact_push(struct sim_bodies *bodies,
                      const struct sim_contact *contact, const double *normal,
                      const double *impulse_n_s);

/* What resists a normal and a tangential impulse. */
double sim_contact_mass(const struct sim_bodies *bodies,
                        const struct sim_contact *contact);
double sim_contact_slip_mass(const struct sim_bodies *bodies,
                             const struct sim_contact *contact);

/* Solve the contacts that rest over step_s: speeds at its begin to those at its
 * end, where planes and boxes are at end_s. */
void sim_contact_rest(struct sim_bodies *bodies, double begin_s, double step_s);

/* The first time in (0, step_s) after t_s at which a pair that does not rest
 * meets, on the parabolas of the substep; step_s when none does. */
double sim_contact_next(const struct sim_bodies *bodies, double t_s,
                        double step_s);

#endif
