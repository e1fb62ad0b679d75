/* tests/sim/physics/bodies_room.h - spheres thrown about in a closed room: what may
 * never happen there. */
#ifndef TESTS_SIM_PHYSICS_BODIES_ROOM_H
#define TESTS_SIM_PHYSICS_BODIES_ROOM_H

#include "motion/core/err.h"
#include "sim/physics/bodies.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/physics_random.h"

/* Six walls, each so far from the middle. */
static inline void bodies_in_a_room(struct sim_plane plane[6], double size_m)
{
    for (int p = 0; p < 6; p++) {
        plane[p] = (struct sim_plane){ 0 };
        plane[p].point_m[p / 2] = p % 2 == 0 ? -size_m : size_m;
        plane[p].normal[p / 2] = p % 2 == 0 ? 1 : -1;
    }
}

/* From corner i of a cube, anywhere. */
static inline void bodies_throw(struct sim_sphere *sphere, int i, double from_m)
{
    for (int k = 0; k < 3; k++) {
        sphere->pos_m[k] = i >> k & 1 ? from_m : -from_m;
        sphere->vel_m_s[k] = physics_random(-30, 30);
    }
}

/* In no tick a sphere is inside of another, a wall or a box, or energy rises. */
static inline void bodies_stay_apart(struct sim_bodies *bodies, int round,
                                     int ticks)
{
    double energy = oracle_bodies_energy_j(bodies);
    for (int tick = 0; tick < ticks; tick++) {
        assert_int_equal(sim_bodies_step(bodies, tick * 1e-3, 1e-3, NULL),
                         MOTION_OK);
        for (int c = 0; c < bodies->contacts; c++) {
            const double gap =
                oracle_bodies_gap_m(bodies, &bodies->contact[c], 0);
            if (!(gap > -1e-6))
                fail_msg("round %d tick %d pair %d: gap %g", round, tick, c,
                         gap);
        }
        const double now = oracle_bodies_energy_j(bodies);
        if (!(now <= energy + 1e-6))
            fail_msg("round %d tick %d: energy %g to %g", round, tick, energy,
                     now);
        energy = now;
    }
}

#endif
