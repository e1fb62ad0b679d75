/* tests/sim/vectors_physics_linkage.c - families of sim/physics/linkage.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/physics/linkage.h"
#include "tests/motion/vectors_json.h"
#include "tests/sim/oracle.h"
#include "tests/sim/vectors_physics.h"

struct swing {
    const cJSON *item;
    struct sim_linkage linkage;
    double dolly_x, last_piece_s, residual;
    struct physics_crossings down; /* through straight down */
};

static void swing_watch(struct swing *self, double t_s, double step_s)
{
    const double angle = self->linkage.angle_rad[0];

    /* Of one that swings and of one that turns over: once per period. */
    physics_crossings_add(&self->down, t_s + step_s, step_s, sin(angle),
                          cos(angle) * self->linkage.speed_rad_s[0]);
    if (t_s >= self->last_piece_s - 1e-9)
        self->residual = fmax(self->residual, fabs(angle));
}

static int swing_step(void *plant, double t_s, double step_s)
{
    struct swing *const self = plant;
    const struct sim_signal dolly = physics_input(self->item, "dolly_x", t_s);

    if (sim_linkage_step(&self->linkage, step_s, &dolly) < 0)
        return -1;
    self->dolly_x = sim_signal_at(&dolly, step_s);
    swing_watch(self, t_s, step_s);
    return 0;
}

static int swing_read(void *plant, const char *q, double *to, int capacity)
{
    struct swing *const self = plant;
    const int n = self->linkage.config.links;

    (void)capacity;
    if (strcmp(q, "energy") == 0) {
        to[0] = oracle_linkage_energy_j(&self->linkage);
        return 1;
    }
    for (int i = 0; i < n; i++) {
        if (strcmp(q, "angle") == 0)
            to[i] = self->linkage.angle_rad[i];
        else if (strcmp(q, "speed") == 0)
            to[i] = self->linkage.speed_rad_s[i];
        else if (strcmp(q, "pos") == 0 || strcmp(q, "bob") == 0)
            sim_linkage_place_m(&self->linkage, i, &to[2 * i], &to[2 * i + 1]);
        else
            return -1;
    }
    if (strcmp(q, "bob") == 0)
        to[0] += self->dolly_x;
    return q[0] == 'p' || q[0] == 'b' ? 2 * n : n;
}

static int swing_result(void *plant, const cJSON *entry, double *to,
                        int capacity)
{
    struct swing *const self = plant;
    const char *const q = vectors_text(entry, "q");

    (void)capacity;
    if (strcmp(q, "period") == 0)
        to[0] = physics_crossings_period(&self->down, 100);
    else if (strcmp(q, "residual_amplitude") == 0)
        to[0] = self->residual;
    else
        return -1;
    return 1;
}

/* Long enough for two crossings of the slowest; the rest of the file says
 * more. */
#define SWING_S 20.0

static struct swing *swing_new(const cJSON *item, struct physics_plant *plant)
{
    struct swing *const self = calloc(1, sizeof *self);
    const cJSON *const times =
        vectors_get(vectors_get(vectors_get(item, "input"), "dolly_x"), "t");

    *plant =
        (struct physics_plant){ self, swing_step, swing_read, swing_result, 0 };
    if (self == NULL)
        return NULL;
    self->item = item;
    if (times != NULL)
        self->last_piece_s =
            vectors_number_at(times, cJSON_GetArraySize(times) - 1);
    else
        plant->duration_s = SWING_S;
    return self;
}

bool physics_make_pendulum(const cJSON *item, struct physics_plant *plant)
{
    struct swing *const self = swing_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    const struct sim_linkage_config config = {
        .links = 1,
        .mass_kg = { vectors_value_of(system, "mass") },
        .length_m = { vectors_value_of(system, "length") },
        .damping_n_m_s = vectors_value_of(system, "damping"),
        .gravity_m_s2 = vectors_value_of(system, "gravity"),
    };

    if (self == NULL || sim_linkage_init(&self->linkage, &config) < 0)
        return false;
    self->linkage.angle_rad[0] = vectors_value_of(initial, "angle");
    self->linkage.speed_rad_s[0] = vectors_value_of(initial, "speed");
    return true;
}

bool physics_make_double_pendulum(const cJSON *item,
                                  struct physics_plant *plant)
{
    struct swing *const self = swing_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    struct sim_linkage_config config = {
        .links = 2,
        .gravity_m_s2 = vectors_value_of(system, "gravity"),
    };

    return self != NULL &&
           physics_list(system, "mass", config.mass_kg, config.links) &&
           physics_list(system, "length", config.length_m, config.links) &&
           sim_linkage_init(&self->linkage, &config) >= 0 &&
           physics_list(initial, "angle", self->linkage.angle_rad,
                        config.links) &&
           physics_list(initial, "speed", self->linkage.speed_rad_s,
                        config.links);
}

static int links_step(void *plant, double t_s, double step_s)
{
    (void)plant;
    (void)t_s;
    (void)step_s;
    return 0;
}

static int links_read(void *plant, const char *q, double *to, int capacity)
{
    (void)plant;
    (void)q;
    (void)to;
    (void)capacity;
    return -1;
}

static int links_result(void *plant, const cJSON *entry, double *to,
                        int capacity)
{
    const struct sim_linkage_config *const config = plant;
    const char *const q = vectors_text(entry, "q");
    const int n = config->links;
    double frequency_hz[SIM_LINKAGE_LINKS];
    double shapes[SIM_LINKAGE_LINKS * SIM_LINKAGE_LINKS];

    if (!oracle_linkage_modes(config, frequency_hz, shapes))
        return -1;
    if (strcmp(q, "frequency") == 0 && capacity >= n) {
        memcpy(to, frequency_hz, (size_t)n * sizeof *to);
        return n;
    }
    if (strcmp(q, "shape") != 0 || capacity < n * n)
        return -1;
    for (int i = 0; i < n * n; i++) /* the lowest mass positive */
        to[i] = shapes[i] * (shapes[(i / n + 1) * n - 1] < 0 ? -1 : 1);
    return n * n;
}

bool physics_make_links(const cJSON *item, struct physics_plant *plant)
{
    struct sim_linkage_config *const config = calloc(1, sizeof *config);
    const cJSON *const system = vectors_get(item, "system");
    const double links = vectors_value_of(system, "links");

    *plant = (struct physics_plant){ config, links_step, links_read,
                                     links_result, 0 };
    if (config == NULL || !(links >= 1 && links <= SIM_LINKAGE_LINKS))
        return false;
    config->links = (int)links;
    config->gravity_m_s2 = vectors_value_of(system, "gravity");
    for (int i = 0; i < config->links; i++) {
        config->mass_kg[i] = vectors_value_of(system, "mass");
        config->length_m[i] = vectors_value_of(system, "length");
    }
    return true;
}
