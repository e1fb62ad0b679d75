/* tests/sim/vectors_physics.h - reference files against sim/physics.
 *
 * A family makes a plant from a case; the runner drives it by control ticks of
 * 1 ms (cut where a piece of the input begins and where a value is compared)
 * and judges: |got - want| <= tol_abs + tol_rel |want| for every number, and
 * the invariants on every tick. */
#ifndef TESTS_SIM_VECTORS_PHYSICS_H
#define TESTS_SIM_VECTORS_PHYSICS_H

#include <stdbool.h>

#include "sim/physics/signal.h"
#include "tests/motion/vectors.h"

#define PHYSICS_NUMBERS 2048 /* of one quantity at one time */
#define PHYSICS_TICK_S  1e-3

struct physics_plant {
    void *self; /* of malloc; freed by the runner */
    /* From t_s to t_s + step_s; 0, or negative. */
    int (*step)(void *self, double t_s, double step_s);
    /* A quantity now; how many numbers, or -1 when there is none such. */
    int (*read)(void *self, const char *q, double *to, int capacity);
    /* A quantity of the whole run (an entry without times): the first
     * `capacity` numbers of it. */
    int (*result)(void *self, const cJSON *entry, double *to, int capacity);
    double duration_s; /* to run at least, besides what is compared */
};

/* Each makes a plant of its families; false when a parameter is missing or
 * refused. */
typedef bool physics_make(const cJSON *item, struct physics_plant *plant);
physics_make physics_make_drive, physics_make_friction, physics_make_end_stop,
    physics_make_motor, physics_make_arm, physics_make_thermal,
    physics_make_particle, physics_make_oscillator, physics_make_pair,
    physics_make_cable, physics_make_cloth, physics_make_chain,
    physics_make_pendulum, physics_make_double_pendulum, physics_make_links,
    physics_make_spheres, physics_make_plate;

/* All numbers of nested lists, in order; how many, or -1. */
int physics_flatten(const cJSON *list, double *to, int capacity);

/* The numbers of a member, exactly count. */
bool physics_list(const cJSON *item, const char *name, double *to, int count);

/* The input `name` of a case over the step that begins at t_s; 0 without it. */
struct sim_signal physics_input(const cJSON *item, const char *name,
                                double t_s);

/* The times at which a value crosses 0 upwards, found inside the ticks by the
 * cubic through values and slopes. */
struct physics_crossings {
    double times[4096];
    int count;
    double last, last_slope;
    bool begun;
};
void physics_crossings_add(struct physics_crossings *of, double t_s,
                           double step_s, double value, double slope);
/* Mean distance of the last `most` ones; NAN without two. */
double physics_crossings_period(const struct physics_crossings *of, int most);

int vectors_physics(const cJSON *file, struct vectors_row *rows, int capacity);

#endif
