/* tests/sim/vectors_physics_bodies.c - families of sim/physics/bodies.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/physics/bodies.h"
#include "tests/motion/vectors_json.h"
#include "tests/sim/oracle.h"
#include "tests/sim/vectors_physics.h"

#define SPHERES_MAX     16
#define PLANES_MAX      16
#define BOXES_MAX       16
#define IMPACTS_MAX     4096
#define IMPACT_MARGIN_S 0.05
#define REST_FROM_S     1.0
#define IMPULSE_S       1e-9

struct balls {
    const cJSON *item;
    struct sim_bodies bodies;
    struct sim_sphere sphere[SPHERES_MAX];
    struct sim_plane plane[PLANES_MAX];
    struct sim_box box[BOXES_MAX];
    struct sim_contact
        contact[SIM_BODIES_CONTACTS(SPHERES_MAX, PLANES_MAX + BOXES_MAX)];
    struct sim_impact impacts[IMPACTS_MAX];
    double apex[IMPACTS_MAX + 1]; /* largest gap before each impact */
    double from[3 * SPHERES_MAX]; /* centres at REST_FROM_S */
    double drift, speed, t_s;
    bool tilts;
    double tilt_rad;
};

static void balls_watch_rest(struct balls *self)
{
    for (int i = 0; i < self->bodies.config.spheres; i++) {
        const struct sim_sphere *const of = &self->sphere[i];
        double *const from = self->from + 3 * (size_t)i;

        if (self->t_s < REST_FROM_S + 1e-9)
            memcpy(from, of->pos_m, sizeof of->pos_m);
        if (self->t_s < REST_FROM_S - 1e-9)
            continue;
        self->drift =
            fmax(self->drift,
                 hypot(hypot(of->pos_m[0] - from[0], of->pos_m[1] - from[1]),
                       of->pos_m[2] - from[2]));
        self->speed =
            fmax(self->speed,
                 hypot(hypot(of->vel_m_s[0], of->vel_m_s[1]), of->vel_m_s[2]));
    }
}

static int balls_step(void *plant, double t_s, double step_s)
{
    struct balls *const self = plant;
    struct sim_signal tilt = physics_input(self->item, "tilt", t_s);

    if (sim_bodies_step(&self->bodies, t_s, step_s,
                        self->tilts ? &tilt : NULL) < 0)
        return -1;
    self->t_s = t_s + step_s;
    self->tilt_rad = sim_signal_at(&tilt, step_s);
    const unsigned impacts = self->bodies.impacts_count;
    if (impacts < IMPACTS_MAX && self->bodies.contacts > 0)
        self->apex[impacts] =
            fmax(self->apex[impacts],
                 oracle_bodies_gap_m(&self->bodies, &self->contact[0], step_s));
    balls_watch_rest(self);
    return 0;
}

static int balls_read(void *plant, const char *q, double *to, int capacity)
{
    struct balls *const self = plant;
    const int n = self->bodies.config.spheres;

    double other[3];

    (void)capacity;
    if (strcmp(q, "momentum") == 0) {
        oracle_bodies_momentum(&self->bodies, to, other);
        return 3;
    }
    if (strcmp(q, "angular_momentum") == 0) {
        oracle_bodies_momentum(&self->bodies, other, to);
        return 3;
    }
    for (int i = 0; i < n; i++) {
        const struct sim_sphere *const of = &self->sphere[i];
        if (strcmp(q, "pos") == 0)
            memcpy(to + 3 * (size_t)i, of->pos_m, sizeof of->pos_m);
        else if (strcmp(q, "vel") == 0 || strcmp(q, "impulse_vel") == 0)
            memcpy(to + 3 * (size_t)i, of->vel_m_s, sizeof of->vel_m_s);
        else if (strcmp(q, "spin") == 0 || strcmp(q, "impulse_spin") == 0)
            memcpy(to + 3 * (size_t)i, of->spin_rad_s, sizeof of->spin_rad_s);
        else if (i > 0)
            return -1;
        else if (strcmp(q, "energy") == 0)
            return to[0] = oracle_bodies_energy_j(&self->bodies), 1;
        else if (strcmp(q, "drift") == 0)
            return to[0] = self->drift, 1;
        else if (strcmp(q, "speed") == 0)
            return to[0] = self->speed, 1;
        else if (strcmp(q, "s") == 0 && self->tilts)
            return to[0] = of->pos_m[0] * cos(self->tilt_rad) -
                           of->pos_m[2] * sin(self->tilt_rad),
                   1;
        else
            return -1;
    }
    return 3 * n;
}

static bool balls_list(struct sim_sphere *sphere, int count,
                       const cJSON *shapes, const cJSON *states)
{
    for (int i = 0; i < count; i++) {
        const cJSON *const shape = cJSON_GetArrayItem(shapes, i);
        const cJSON *const state = cJSON_GetArrayItem(states, i);
        sphere[i] = (struct sim_sphere){
            .mass_kg = vectors_value_of(shape, "mass"),
            .radius_m = vectors_value_of(shape, "radius"),
        };
        if (!physics_list(state, "pos", sphere[i].pos_m, 3) ||
            !physics_list(state, "vel", sphere[i].vel_m_s, 3) ||
            !physics_list(state, "spin", sphere[i].spin_rad_s, 3))
            return false;
    }
    return true;
}

/* The result of the single impact of the state in `from`: of a step so short that
 * nothing else happens, without weight. */
static int balls_impulse(const struct balls *self, const cJSON *entry,
                         double *to, int capacity)
{
    const cJSON *const from =
        vectors_get(vectors_get(entry, "from"), "spheres");
    struct balls *const other = calloc(1, sizeof *other);
    struct sim_bodies_config config = self->bodies.config;
    int count = -1;

    memset(config.gravity_m_s2, 0, sizeof config.gravity_m_s2);
    if (other != NULL &&
        cJSON_GetArraySize(from) == self->bodies.config.spheres &&
        balls_list(other->sphere, self->bodies.config.spheres, from, from) &&
        sim_bodies_init(&other->bodies, &config, other->sphere, self->plane,
                        other->contact) >= 0 &&
        sim_bodies_step(&other->bodies, 0, IMPULSE_S, NULL) >= 0)
        count = balls_read(other, vectors_text(entry, "q"), to, capacity);
    free(other);
    return count;
}

/* Whether a plane is what a pair calls it. */
static bool balls_is_plane(const struct sim_plane *plane, const char *name)
{
    const double up = plane->normal[2];

    if (strcmp(name, "floor") == 0)
        return up > 0.999;
    if (strcmp(name, "side") == 0)
        return up > 1e-9 && up < 0.999;
    return (strcmp(name, "wall") == 0 || strcmp(name, "end") == 0) &&
           fabs(up) <= 1e-9;
}

/* "0-1", "floor-0": of several such planes the one that presses most. */
static double balls_force(const struct balls *self, const char *pair)
{
    char name[16] = "";
    int i = -1, j = -1;
    double force = NAN;

    const bool spheres = sscanf(pair, "%d-%d", &i, &j) == 2;
    if (!spheres && sscanf(pair, "%15[a-z]-%d", name, &j) != 2)
        return NAN;
    for (int c = 0; c < self->bodies.contacts; c++) {
        const struct sim_contact *const at = &self->contact[c];
        const bool is_it =
            spheres ? (at->a == i && at->b == j) || (at->a == j && at->b == i)
                    : at->a == j && at->plane >= 0 &&
                          balls_is_plane(&self->plane[at->plane], name);
        if (is_it && !(at->force_n <= force))
            force = at->force_n;
    }
    return force;
}

static int balls_forces(const struct balls *self, const cJSON *entry,
                        double *to, int capacity)
{
    const cJSON *pair;
    int count = 0;

    cJSON_ArrayForEach(pair, vectors_get(entry, "pairs"))
    {
        if (count < capacity)
            to[count++] = balls_force(self, vectors_string(pair));
    }
    return count;
}

static int balls_roll_time(const struct balls *self, double *to)
{
    double last = NAN;

    for (int c = 0; c < self->bodies.contacts; c++) {
        if (!(self->contact[c].stuck_s <= last))
            last = self->contact[c].stuck_s;
    }
    to[0] = last;
    return last > 0 ? 1 : 0;
}

static int balls_result(void *plant, const cJSON *entry, double *to,
                        int capacity)
{
    const struct balls *const self = plant;
    const char *const q = vectors_text(entry, "q");
    const unsigned impacts = self->bodies.impacts_count;
    int count = 0;

    if (cJSON_HasObjectItem(entry, "from"))
        return balls_impulse(self, entry, to, capacity);
    if (strcmp(q, "contact_force") == 0)
        return balls_forces(self, entry, to, capacity);
    if (strcmp(q, "roll_time") == 0)
        return balls_roll_time(self, to);
    if (strcmp(q, "contacts") == 0) {
        to[0] = impacts;
        return 1;
    }
    if (strcmp(q, "contact_time") == 0 || strcmp(q, "contact_times") == 0) {
        for (; count < capacity && (unsigned)count < impacts; count++)
            to[count] = self->impacts[count].t_s;
        return count;
    }
    if (strcmp(q, "apex_heights") != 0)
        return -1;
    for (; count < capacity && (unsigned)count + 1 < impacts; count++)
        to[count] = self->apex[count + 1];
    return count;
}

static double balls_duration(const cJSON *item)
{
    const cJSON *entry;
    double want[IMPACTS_MAX], duration = 0;

    cJSON_ArrayForEach(entry, vectors_get(item, "expect"))
    {
        const int count =
            physics_flatten(vectors_get(entry, "want"), want, IMPACTS_MAX);
        if (strncmp(vectors_text(entry, "q"), "contact_time", 12) != 0)
            continue;
        for (int i = 0; i < count; i++)
            duration = fmax(duration, want[i] + IMPACT_MARGIN_S);
    }
    return duration;
}

static struct balls *balls_new(const cJSON *item, struct physics_plant *plant)
{
    struct balls *const self = calloc(1, sizeof *self);

    *plant = (struct physics_plant){ self, balls_step, balls_read, balls_result,
                                     balls_duration(item) };
    if (self != NULL)
        self->item = item;
    return self;
}

static bool balls_begin(struct balls *self, struct sim_bodies_config *config)
{
    const cJSON *const system = vectors_get(self->item, "system");

    config->restitution = vectors_value_of(system, "restitution");
    config->friction = vectors_value_of(system, "friction");
    if (!physics_list(system, "gravity", config->gravity_m_s2, 3) ||
        sim_bodies_init(&self->bodies, config, self->sphere, self->plane,
                        self->contact) < 0)
        return false;
    self->bodies.impacts = self->impacts;
    self->bodies.impacts_max = IMPACTS_MAX;
    return true;
}

/* `center`, `size` (of its whole sides) and `axes` (a unit vector along each; left
 * out: those of the world). */
static bool balls_box(const cJSON *of, struct sim_box *box)
{
    double axes[9] = { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, size[3];
    const bool turned = cJSON_HasObjectItem(of, "axes");

    if (!physics_list(of, "center", box->center_m, 3) ||
        !physics_list(of, "size", size, 3) ||
        (turned && physics_flatten(vectors_get(of, "axes"), axes, 9) != 9))
        return false;
    for (int k = 0; k < 3; k++)
        box->half_m[k] = 0.5 * size[k];
    memcpy(box->axis, axes, sizeof axes);
    return true;
}

bool physics_make_spheres(const cJSON *item, struct physics_plant *plant)
{
    struct balls *const self = balls_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const shapes = vectors_get(system, "spheres");
    const cJSON *const planes = vectors_get(system, "planes");
    const cJSON *const boxes = cJSON_GetObjectItem(system, "boxes");
    const cJSON *const states =
        vectors_get(vectors_get(item, "initial"), "spheres");
    struct sim_bodies_config config = {
        .spheres = cJSON_GetArraySize(shapes),
        .planes = cJSON_GetArraySize(planes),
        .boxes = cJSON_GetArraySize(boxes),
    };

    if (self == NULL || config.spheres > SPHERES_MAX ||
        config.planes > PLANES_MAX || config.boxes > BOXES_MAX ||
        !balls_list(self->sphere, config.spheres, shapes, states))
        return false;
    for (int i = 0; i < config.planes; i++) {
        const cJSON *const of = cJSON_GetArrayItem(planes, i);
        if (!physics_list(of, "point", self->plane[i].point_m, 3) ||
            !physics_list(of, "normal", self->plane[i].normal, 3))
            return false;
    }
    config.box = self->box;
    for (int i = 0; i < config.boxes; i++) {
        if (!balls_box(cJSON_GetArrayItem(boxes, i), &self->box[i]))
            return false;
    }
    return balls_begin(self, &config);
}

/* A plate through the origin that turns about +y. */
bool physics_make_plate(const cJSON *item, struct physics_plant *plant)
{
    struct balls *const self = balls_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    struct sim_bodies_config config = { .spheres = 1, .planes = 1 };

    if (self == NULL)
        return false;
    self->tilts = true;
    self->plane[0] =
        (struct sim_plane){ .normal = { 0, 0, 1 }, .axis = { 0, 1, 0 } };
    self->sphere[0] = (struct sim_sphere){
        .mass_kg = vectors_value_of(system, "mass"),
        .radius_m = vectors_value_of(system, "radius"),
    };
    return physics_list(initial, "pos", self->sphere[0].pos_m, 3) &&
           physics_list(initial, "vel", self->sphere[0].vel_m_s, 3) &&
           physics_list(initial, "spin", self->sphere[0].spin_rad_s, 3) &&
           balls_begin(self, &config);
}
