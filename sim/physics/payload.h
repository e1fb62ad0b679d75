/* sim/physics/payload.h - what an axis carries or pulls: a pendulum, a hanging
 * cable with a weight, a curtain, a ball on a plate.
 *
 * The axis is the one input: its place in m where it moves on a line, or in rad
 * where it tilts a plate.  What comes back is the force (N) or torque (N m) with
 * which the payload works against the axis.
 *
 *   SIM_PAYLOAD_PENDULUM  a weight on a rigid rod under the axis (linkage.h)
 *   SIM_PAYLOAD_CABLE     SIM_PAYLOAD_LINKS links with a weight at the end
 *   SIM_PAYLOAD_CURTAIN   a cloth that hangs from its upper corners, one of which
 *                         the axis pulls (particles.h)
 *   SIM_PAYLOAD_BALL      a ball that rolls on the plate, a box (bodies.h), from
 *                         wall to wall where it has walls; beyond its edge it is
 *                         gone
 *
 * x is along the axis, z up, y to the left of both.  Points are in the frame of
 * the axis's zero. */
#ifndef SIM_PHYSICS_PAYLOAD_H
#define SIM_PHYSICS_PAYLOAD_H

#include "sim/physics/bodies.h"
#include "sim/physics/linkage.h"
#include "sim/physics/particles.h"

#define SIM_PAYLOAD_GRAVITY 9.80665
#define SIM_PAYLOAD_LINKS   12
#define SIM_PAYLOAD_COLUMNS 11 /* of a curtain's nodes */
#define SIM_PAYLOAD_ROWS    9
#define SIM_PAYLOAD_NODES   (SIM_PAYLOAD_COLUMNS * SIM_PAYLOAD_ROWS)
#define SIM_PAYLOAD_SPRINGS                                                    \
    (6 * SIM_PAYLOAD_NODES + SIM_SPHERES_PAIRS(SIM_PAYLOAD_NODES))

#define SIM_PAYLOAD_PLATE 3 /* the plate itself, its walls */

enum sim_payload_kind {
    SIM_PAYLOAD_PENDULUM,
    SIM_PAYLOAD_CABLE,
    SIM_PAYLOAD_CURTAIN,
    SIM_PAYLOAD_BALL,
    SIM_PAYLOAD_KINDS
};

struct sim_payload_config {
    enum sim_payload_kind kind;
    double mass_kg;  /* of the weight, the curtain or the ball, > 0 */
    double cable_kg; /* of a cable itself, > 0 */
    double
        length_m; /* of rod or cable; how high a curtain is; of a plate; > 0 */
    double width_m;  /* of a curtain, > 0 */
    bool collides;   /* a curtain with itself: its nodes are spheres */
    double damping;  /* of the first swing, of critical: 0 .. 1 */
    double radius_m; /* of a ball, > 0 */
    double friction; /* of a ball, >= 0 */
    double start_m;  /* of a ball along its plate */
    double wall_m; /* how high the walls at both ends of a plate are; 0: none */
};

struct sim_payload_point {
    double x, y, z; /* m */
};

struct sim_payload {
    struct sim_payload_config config;
    double at, speed; /* of the axis, m or rad, at the last step's end */
    double force;     /* against the axis, N or N m, over the last step */
    bool gone;        /* the ball */
    /* private */
    double held_m;   /* of a curtain: where its other corner hangs */
    double momentum; /* along x; of a ball the angular one, about the axis */
    struct sim_linkage linkage;
    struct sim_particles particles;
    struct sim_bodies bodies;
    struct sim_node node[SIM_PAYLOAD_NODES];
    struct sim_spring spring[SIM_PAYLOAD_SPRINGS];
    double work[SIM_PARTICLES_WORK(SIM_PAYLOAD_NODES)];
    struct sim_sphere ball;
    struct sim_box plate[SIM_PAYLOAD_PLATE];
    struct sim_contact contact[SIM_PAYLOAD_PLATE];
};

/* At rest under an axis that stands there; it points into itself: do not copy.
 * MOTION_E_ARG for a value outside the ranges above. */
int sim_payload_init(struct sim_payload *self,
                     const struct sim_payload_config *config, double at);

/* step_s (> 0) on, in which the axis comes to that place and speed.
 * MOTION_E_RANGE: it cannot be computed; it stays where it was. */
int sim_payload_step(struct sim_payload *self, double step_s, double at,
                     double speed);

/* How far it is from where it would hang or lie at rest, m: the weight of a
 * pendulum or cable beside the axis, the lower edge of a curtain out of its
 * plane of rest, a ball from the middle of its plate. */
double sim_payload_off_m(const struct sim_payload *self);

/* Where it is: of a pendulum and a cable the axis and then every mass; of a
 * curtain its nodes, column after column; of a ball the plate from end to end,
 * each with the top of its wall, and the middle of the ball.  Returns how many, at most SIM_PAYLOAD_NODES. */
unsigned sim_payload_points(const struct sim_payload *self,
                            struct sim_payload_point point[SIM_PAYLOAD_NODES]);

/* Of a curtain that collides with itself: across a sphere, which two nodes come
 * little nearer to each other than. */
double sim_payload_sphere_m(const struct sim_payload_config *config);

#endif
