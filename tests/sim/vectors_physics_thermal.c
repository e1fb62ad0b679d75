/* tests/sim/vectors_physics_thermal.c - the family of sim/physics/thermal.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/physics/thermal.h"
#include "tests/motion/vectors_json.h"
#include "tests/sim/vectors_physics.h"

struct heat {
    const cJSON *item;
    struct sim_thermal thermal;
};

static int heat_step(void *plant, double t_s, double step_s)
{
    struct heat *const self = plant;
    const struct sim_signal current = physics_input(self->item, "current", t_s);

    sim_thermal_step(&self->thermal, t_s, step_s, &current);
    return 0;
}

static int heat_read(void *plant, const char *q, double *to, int capacity)
{
    const struct heat *const self = plant;

    (void)capacity;
    to[0] = self->thermal.load;
    return strcmp(q, "load") == 0 ? 1 : -1;
}

static int heat_result(void *plant, const cJSON *entry, double *to,
                       int capacity)
{
    const struct heat *const self = plant;

    (void)capacity;
    if (strcmp(vectors_text(entry, "q"), "trip_time") != 0)
        return -1;
    to[0] = self->thermal.trip_s;
    return self->thermal.tripped ? 1 : 0;
}

bool physics_make_thermal(const cJSON *item, struct physics_plant *plant)
{
    struct heat *const self = calloc(1, sizeof *self);
    const cJSON *const system = vectors_get(item, "system");
    const struct sim_thermal_config config = {
        .rated_current_a = vectors_value_of(system, "rated_current"),
        .time_constant_s = vectors_value_of(system, "time_constant"),
        .trip_load = vectors_value_of(system, "trip_load"),
    };

    *plant =
        (struct physics_plant){ self, heat_step, heat_read, heat_result, 0 };
    return self != NULL &&
           (self->item = item,
            sim_thermal_init(
                &self->thermal, &config,
                vectors_value_of(vectors_get(item, "initial"), "load")) >= 0);
}
