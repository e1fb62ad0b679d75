/* sim/physics/bodies.h - rigid spheres against planes, boxes and each other: a
 * ball on a plate, balls on a step.
 *
 * Spheres are uniform (inertia 2/5 m r^2).  Between contacts they fly on their
 * parabola, and the time of the next impact is found on it, so that nothing
 * tunnels.  An impact is Newton's: the normal relative speed becomes
 * -restitution times what it was; the tangential impulse is against the slip of
 * the contact points and at most friction times the normal one, and what sticks
 * ends without slip.  Below SIM_BODIES_REST_M_S an impact is plastic.  Contacts
 * that rest are solved together, over a substep, by sequential impulses that
 * start from those of the last one, so that what rests does not creep.
 * Source: Catto, Iterative Dynamics with Temporal Coherence, GDC 2005;
 * Goldsmith, Impact (1960), ch. 2; Mirtich, PhD thesis, Berkeley (1996), ch. 3.
 *
 * The caller gives all memory; a step takes none. */
#ifndef SIM_PHYSICS_BODIES_H
#define SIM_PHYSICS_BODIES_H

#include <stdbool.h>

#include "sim/physics/signal.h"

#define SIM_BODIES_REST_M_S  1e-3
#define SIM_BODIES_SUBSTEP_S 0.25e-3
#define SIM_BODIES_EVENTS    2000 /* in one step */
#define SIM_BODIES_SPHERES   1000
#define SIM_BODIES_PLANES    1000
#define SIM_BODIES_BOXES     1000
/* Pairs that may touch; solids: planes and boxes. */
#define SIM_BODIES_CONTACTS(spheres, solids)                                   \
    ((spheres) * ((spheres)-1) / 2 + (spheres) * (solids))

struct sim_sphere {
    double mass_kg, radius_m; /* > 0 */
    double pos_m[3], vel_m_s[3], spin_rad_s[3];
    /* private: over the substep */
    double acc_m_s2[3], spin_acc_rad_s2[3];
};

/* A fixed half-space; it may turn about an axis through its point. */
struct sim_plane {
    double point_m[3], normal[3]; /* a unit vector out of the solid */
    double axis[3];               /* a unit vector, or 0 0 0: never turns */
};

/* A box, solid, where no sphere moves it; it may turn about an axis.  A sphere
 * touches its faces, edges and corners: the normal is from the box's nearest point
 * to the sphere's centre. */
struct sim_box {
    double center_m[3], half_m[3]; /* half_m: of its sizes, > 0 */
    double axis[3][3]; /* unit vectors along these, each across the others */
    double pivot_m[3]; /* on the axis about which it turns */
    double turns[3];   /* along that, a unit vector, or 0 0 0: never turns */
};

/* A pair that may touch: sphere a with sphere b, a plane or a box; -1: not
 * it. */
struct sim_contact {
    int a, b, plane, box;
    double force_n; /* normal, over the last substep; 0: apart */
    bool slips;
    double stuck_s; /* when the slip last ended */
    /* private: impulses of the last substep, normal and tangential */
    bool rests, slipped;
    double normal_n_s, tangent_n_s[3];
};

struct sim_impact {
    double t_s;
    int contact;      /* which pair */
    double speed_m_s; /* of approach */
};

struct sim_bodies_config {
    int spheres, planes; /* 1 .. SIM_BODIES_SPHERES, 0 .. SIM_BODIES_PLANES */
    int boxes;           /* 0 .. SIM_BODIES_BOXES */
    const struct sim_box *box;
    double restitution; /* 0 .. 1 */
    double friction;    /* >= 0, sliding and sticking */
    double gravity_m_s2[3];
};

struct sim_bodies {
    struct sim_bodies_config config;
    struct sim_sphere *sphere;
    const struct sim_plane *plane;
    struct sim_contact *contact;
    int contacts;
    /* Where impacts faster than SIM_BODIES_REST_M_S are written, if anywhere;
       count goes on when it is full. */
    struct sim_impact *impacts;
    unsigned impacts_max, impacts_count;
    /* private */
    const struct sim_signal *turn_rad;
    double begin_s;
};

/* contact: SIM_BODIES_CONTACTS(spheres, planes + boxes) of them.  All memory is the
 * bodies' from now on.  MOTION_E_ARG when a value is outside the ranges
 * above. */
int sim_bodies_init(struct sim_bodies *bodies,
                    const struct sim_bodies_config *config,
                    struct sim_sphere *sphere, const struct sim_plane *plane,
                    struct sim_contact *contact);

/* One step of step_s (> 0) from begin_s on, which only times are counted from.
 * turn_rad: the angle of every plane, then of every box, or NULL when none
 * turns.  MOTION_E_RANGE
 * when there are more than SIM_BODIES_EVENTS impacts or flights. */
int sim_bodies_step(struct sim_bodies *bodies, double begin_s, double step_s,
                    const struct sim_signal *turn_rad);

/* About the origin, spin included. */
void sim_bodies_angular_momentum(const struct sim_bodies *bodies,
                                 double *angular_kg_m2_s);

#endif
