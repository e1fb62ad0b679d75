/* tests/sim/vectors_physics_particles.c - families of
 * sim/physics/particles.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/physics/particles.h"
#include "tests/motion/vectors_json.h"
#include "tests/sim/oracle.h"
#include "tests/sim/vectors_physics.h"

#define NODES_MAX    256
#define SPRINGS_MAX  (6 * NODES_MAX + SIM_SPHERES_PAIRS(NODES_MAX))
#define SETTLE_STEPS 10000000

struct cloud {
    const cJSON *item;
    struct sim_particles particles;
    struct sim_particles_input input;
    struct sim_node node[NODES_MAX];
    struct sim_spring spring[SPRINGS_MAX];
    double work[SIM_PARTICLES_WORK(NODES_MAX)];
    bool on_line;           /* x, v are displacements along x */
    double rest[NODES_MAX]; /* whence */
    int first, shown;       /* nodes that are read */
    struct physics_crossings up, down;
};

static int cloud_step(void *plant, double t_s, double step_s)
{
    struct cloud *const self = plant;
    const int i = self->first;

    if (self->particles.config.driven >= 0)
        self->input.pos_m[0] = physics_input(self->item, "dolly_x", t_s);
    if (sim_particles_step(&self->particles, step_s, &self->input) < 0)
        return -1;
    if (self->on_line && self->shown == 1) {
        const double x = self->particles.pos_m[3 * i] - self->rest[i];
        const double v = self->particles.vel_m_s[3 * i];
        physics_crossings_add(&self->up, t_s + step_s, step_s, x, v);
        physics_crossings_add(&self->down, t_s + step_s, step_s, -x, -v);
    }
    return 0;
}

static int cloud_read_mean(const struct cloud *self, double *to)
{
    double mass = 0;

    for (int k = 0; k < 3; k++)
        to[k] = 0;
    for (int i = 0; i < self->particles.config.nodes; i++) {
        mass += self->node[i].mass_kg;
        for (int k = 0; k < 3; k++)
            to[k] += self->node[i].mass_kg * self->particles.pos_m[3 * i + k];
    }
    for (int k = 0; k < 3; k++)
        to[k] /= mass;
    return 3;
}

static int cloud_read(void *plant, const char *q, double *to, int capacity)
{
    struct cloud *const self = plant;
    const struct sim_particles *const particles = &self->particles;
    const int n = self->shown, at = 3 * self->first;
    const bool places = strcmp(q, "pos") == 0;

    double other[3];

    if (strcmp(q, "energy") == 0) {
        to[0] = oracle_particles_energy_j(particles);
        return 1;
    }
    if (strcmp(q, "momentum") == 0) {
        oracle_particles_momentum(particles, to, other);
        return self->on_line ? 1 : 3;
    }
    if (strcmp(q, "angular_momentum") == 0) {
        oracle_particles_momentum(particles, other, to);
        return 3;
    }
    if (strcmp(q, "centre_of_mass") == 0)
        return cloud_read_mean(self, to);
    if (capacity < 3 * n)
        return -1;
    if (places || strcmp(q, "vel") == 0) {
        memcpy(to, (places ? particles->pos_m : particles->vel_m_s) + at,
               3 * (size_t)n * sizeof *to);
        return 3 * n;
    }
    if (!self->on_line || (strcmp(q, "x") != 0 && strcmp(q, "v") != 0))
        return -1;
    for (int i = 0; i < n; i++)
        to[i] = q[0] == 'v' ? particles->vel_m_s[at + 3 * i]
                            : particles->pos_m[at + 3 * i] -
                                  self->rest[self->first + i];
    return n;
}

/* Of motion along x, by what a step makes of each mass displaced. */
static int cloud_modes(const struct cloud *self, double *to, int capacity)
{
    const double aside_m = 0.1, step_s = 1e-6;
    const int n = self->shown;
    struct cloud *const other = calloc(1, sizeof *other);
    double *const acc = calloc(2 * (size_t)n * (size_t)n, sizeof *acc);
    double mass[NODES_MAX], hz[NODES_MAX];
    int count = 0;

    for (int j = 0; other != NULL && acc != NULL && j < n; j++) {
        mass[j] = self->node[1 + j].mass_kg;
        if (sim_particles_init(&other->particles, &self->particles.config,
                               other->work) < 0)
            count = -1;
        for (int i = 0; i < n + 2; i++)
            other->particles.pos_m[3 * i] =
                self->rest[i] + (i == 1 + j ? aside_m : 0);
        if (sim_particles_step(&other->particles, step_s, NULL) < 0)
            count = -1;
        for (int i = 0; i < n; i++)
            acc[i * n + j] =
                other->particles.vel_m_s[3 * (1 + i)] / (aside_m * step_s);
    }
    if (other == NULL || acc == NULL || count < 0 ||
        !oracle_modes(mass, acc, n, hz, acc + n * n))
        count = -1;
    for (int i = 0; i < n && count >= 0 && count < capacity; i++)
        if (hz[i] > 0)
            to[count++] = hz[i];
    free(other);
    free(acc);
    return count;
}

static int cloud_frequency(const struct cloud *self, double *to, int capacity)
{
    if (self->shown > 1)
        return cloud_modes(self, to, capacity);
    /* A damped swing has few crossings: the mean of both directions. */
    const double up = physics_crossings_period(&self->up, 100);
    const double down = physics_crossings_period(&self->down, 100);

    to[0] = isnan(up) ? 1 / down : isnan(down) ? 1 / up : 2 / (up + down);
    return 1;
}

static int cloud_result(void *plant, const cJSON *entry, double *to,
                        int capacity)
{
    struct cloud *const self = plant;
    const char *const q = vectors_text(entry, "q");
    const int springs = self->particles.config.springs;

    if (strcmp(q, "frequency") == 0 && self->on_line)
        return cloud_frequency(self, to, capacity);
    if (strcmp(q, "tension") == 0) {
        if (capacity < springs)
            return -1;
        for (int s = 0; s < springs; s++)
            to[s] = sim_particles_tension_n(&self->particles, s);
        return springs;
    }
    return cloud_read(self, q, to, PHYSICS_NUMBERS);
}

static struct cloud *cloud_new(const cJSON *item, struct physics_plant *plant,
                               struct sim_particles_config *config)
{
    struct cloud *const self = calloc(1, sizeof *self);

    *plant =
        (struct physics_plant){ self, cloud_step, cloud_read, cloud_result, 0 };
    if (self == NULL)
        return NULL;
    self->item = item;
    *config = (struct sim_particles_config){ .node = self->node,
                                             .spring = self->spring,
                                             .driven = -1 };
    (void)physics_list(vectors_get(item, "system"), "gravity",
                       config->gravity_m_s2, 3);
    return self;
}

static bool cloud_begin(struct cloud *self,
                        const struct sim_particles_config *config)
{
    self->shown = self->shown == 0 ? config->nodes : self->shown;
    return sim_particles_init(&self->particles, config, self->work) >= 0;
}

/* pos and, if there is any, vel of `initial`. */
static bool cloud_place(struct cloud *self)
{
    const cJSON *const initial = vectors_get(self->item, "initial");
    const int n = 3 * self->particles.config.nodes;

    return physics_flatten(vectors_get(initial, "pos"), self->particles.pos_m,
                           n) == n &&
           (!cJSON_HasObjectItem(initial, "vel") ||
            physics_flatten(vectors_get(initial, "vel"),
                            self->particles.vel_m_s, n) == n);
}

static double value_or_zero(const cJSON *item, const char *name)
{
    const double value = vectors_value_of(item, name);

    return isnan(value) ? 0 : value;
}

bool physics_make_particle(const cJSON *item, struct physics_plant *plant)
{
    struct sim_particles_config config;
    struct cloud *const self = cloud_new(item, plant, &config);
    const cJSON *const system = vectors_get(item, "system");

    if (self == NULL)
        return false;
    config.nodes = 1;
    config.drag_linear_n_s_m = vectors_value_of(system, "drag_linear");
    config.drag_quadratic_n_s2_m2 = vectors_value_of(system, "drag_quadratic");
    self->node[0].mass_kg = vectors_value_of(system, "mass");
    return cloud_begin(self, &config) && cloud_place(self);
}

/* Two nodes in a line: a wall, and the mass on a spring as long as it needs
 * not to turn over; a constant force is a gravity along x. */
bool physics_make_oscillator(const cJSON *item, struct physics_plant *plant)
{
    struct sim_particles_config config;
    struct cloud *const self = cloud_new(item, plant, &config);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    const double mass = vectors_value_of(system, "mass");
    const double length = 64;

    if (self == NULL)
        return false;
    config.nodes = 2;
    config.springs = 1;
    config.gravity_m_s2[0] = vectors_value_of(system, "force") / mass;
    self->on_line = true;
    self->first = self->shown = 1;
    self->rest[1] = length;
    self->node[0] = (struct sim_node){ .mass_kg = mass, .fixed = true };
    self->node[1] = (struct sim_node){ .mass_kg = mass };
    self->spring[0] =
        (struct sim_spring){ 0,
                             1,
                             vectors_value_of(system, "stiffness"),
                             vectors_value_of(system, "damping"),
                             length,
                             false };
    if (!cloud_begin(self, &config))
        return false;
    self->particles.pos_m[3] = length + vectors_value_of(initial, "x");
    self->particles.vel_m_s[3] = vectors_value_of(initial, "v");
    return true;
}

bool physics_make_pair(const cJSON *item, struct physics_plant *plant)
{
    struct sim_particles_config config;
    struct cloud *const self = cloud_new(item, plant, &config);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const mass = vectors_get(system, "mass");

    if (self == NULL)
        return false;
    config.nodes = 2;
    config.springs = 1;
    for (int i = 0; i < 2; i++)
        self->node[i].mass_kg = vectors_number_at(mass, i);
    self->spring[0] =
        (struct sim_spring){ 0,
                             1,
                             vectors_value_of(system, "stiffness"),
                             vectors_value_of(system, "damping"),
                             vectors_value_of(system, "rest_length"),
                             false };
    return cloud_begin(self, &config) && cloud_place(self);
}

/* Masses in a line with springs between them and to walls; 0 is no spring. */
bool physics_make_chain(const cJSON *item, struct physics_plant *plant)
{
    struct sim_particles_config config;
    struct cloud *const self = cloud_new(item, plant, &config);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    const int n = cJSON_GetArraySize(vectors_get(system, "mass"));
    double mass[NODES_MAX], spring[NODES_MAX], x[NODES_MAX], v[NODES_MAX];

    if (self == NULL || n < 1 || n + 2 > NODES_MAX ||
        !physics_list(system, "mass", mass, n) ||
        !physics_list(system, "spring", spring, n + 1) ||
        !physics_list(initial, "x", x, n) || !physics_list(initial, "v", v, n))
        return false;
    config.nodes = n + 2;
    self->on_line = true;
    self->first = 1;
    self->shown = n;
    for (int i = 0; i < n + 2; i++) {
        const bool wall = i == 0 || i == n + 1;
        self->rest[i] = i;
        self->node[i] = (struct sim_node){ wall ? 1 : mass[i - 1], wall };
        if (i <= n && spring[i] > 0)
            self->spring[config.springs++] =
                (struct sim_spring){ i, i + 1, spring[i], 0, 1, false };
    }
    if (!cloud_begin(self, &config))
        return false;
    for (int i = 0; i < n + 2; i++)
        self->particles.pos_m[3 * i] = i;
    for (int i = 0; i < n; i++) {
        self->particles.pos_m[3 * i + 3] += x[i];
        self->particles.vel_m_s[3 * i + 3] = v[i];
    }
    return true;
}

static bool cloud_pin(struct cloud *self, const cJSON *system, int nodes)
{
    const cJSON *pin;

    cJSON_ArrayForEach(pin, vectors_get(system, "pinned"))
    {
        if (!(pin->valuedouble >= 0 && pin->valuedouble < nodes))
            return false;
        self->node[(int)pin->valuedouble].fixed = true;
    }
    return true;
}

bool physics_make_cable(const cJSON *item, struct physics_plant *plant)
{
    struct sim_particles_config config;
    struct cloud *const self = cloud_new(item, plant, &config);
    const cJSON *const system = vectors_get(item, "system");
    const int n = cJSON_GetArraySize(vectors_get(system, "node_mass"));
    double mass[NODES_MAX];

    if (self == NULL || n < 2 || n > NODES_MAX ||
        !physics_list(system, "node_mass", mass, n))
        return false;
    config.nodes = n;
    config.springs = n - 1;
    config.drag_linear_n_s_m = value_or_zero(system, "drag_linear");
    for (int i = 0; i < n; i++)
        self->node[i].mass_kg = mass[i];
    for (int i = 0; i + 1 < n; i++)
        self->spring[i] = (struct sim_spring){
            .i = i,
            .j = i + 1,
            .stiffness_n_m = vectors_value_of(system, "stiffness"),
            .damping_n_s_m = value_or_zero(system, "damping"),
            .rest_m = vectors_value_of(system, "rest_length")
        };
    const bool moves = vectors_get(vectors_get(item, "input"), "dolly_x");
    config.driven = moves ? 0 : -1;
    return cloud_pin(self, system, n) && cloud_begin(self, &config) &&
           cloud_place(self) &&
           (moves || oracle_particles_settle(&self->particles, SETTLE_STEPS));
}

/* Every node is a sphere: `diameter`, `stiffness`, `damping` of a touch. */
static int cloud_spheres(struct cloud *self, const cJSON *spheres, int nodes,
                         int springs)
{
    if (spheres == NULL || springs < 0)
        return springs;
    const struct sim_spring like = {
        .stiffness_n_m = vectors_value_of(spheres, "stiffness"),
        .damping_n_s_m = value_or_zero(spheres, "damping"),
        .rest_m = vectors_value_of(spheres, "diameter"),
        .pushes = true,
    };
    return springs + sim_spheres_springs(&like, nodes, self->spring + springs);
}

bool physics_make_cloth(const cJSON *item, struct physics_plant *plant)
{
    struct sim_particles_config config;
    struct cloud *const self = cloud_new(item, plant, &config);
    const cJSON *const system = vectors_get(item, "system");
    const struct sim_cloth cloth = {
        .columns = (int)value_or_zero(system, "columns"),
        .rows = (int)value_or_zero(system, "rows"),
        .spacing_m = vectors_value_of(system, "spacing"),
        .structural_n_m = vectors_value_of(system, "structural"),
        .shear_n_m = vectors_value_of(system, "shear"),
        .bending_n_m = vectors_value_of(system, "bending"),
        .structural_n_s_m = value_or_zero(system, "damping_structural"),
        .shear_n_s_m = value_or_zero(system, "damping_shear"),
        .bending_n_s_m = value_or_zero(system, "damping_bending"),
    };
    const cJSON *const pins = vectors_get(system, "pinned");
    double pin_pos[3 * NODES_MAX];

    if (self == NULL || cloth.columns < 1 || cloth.rows < 1 ||
        cloth.columns > NODES_MAX / cloth.rows)
        return false;
    config.nodes = cloth.columns * cloth.rows;
    config.springs = sim_cloth_springs(&cloth, self->spring, SPRINGS_MAX);
    config.springs = cloud_spheres(self, cJSON_GetObjectItem(system, "spheres"),
                                   config.nodes, config.springs);
    config.drag_linear_n_s_m = value_or_zero(system, "drag_linear");
    for (int i = 0; i < config.nodes; i++)
        self->node[i].mass_kg = vectors_value_of(system, "node_mass");
    if (config.springs < 0 || !cloud_pin(self, system, config.nodes) ||
        !cloud_begin(self, &config) || !cloud_place(self) ||
        physics_flatten(vectors_get(system, "pin_pos"), pin_pos,
                        3 * NODES_MAX) != 3 * cJSON_GetArraySize(pins))
        return false;
    for (int i = 0; i < cJSON_GetArraySize(pins); i++)
        memcpy(&self->particles.pos_m[3 * (int)vectors_number_at(pins, i)],
               &pin_pos[3 * (size_t)i], 3 * sizeof pin_pos[0]);
    return strcmp(vectors_text(item, "family"), "cloth_rest") != 0 ||
           oracle_particles_settle(&self->particles, SETTLE_STEPS);
}
