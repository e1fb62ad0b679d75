/* sim/physics/payload.c - see payload.h. */
#include "sim/physics/payload.h"

#include <math.h>
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "sim/physics/payload_ball.h"

#define GRAVITY SIM_PAYLOAD_GRAVITY
/* A curtain: a cloth of so much per m2 is as stiff as a soft spring between two
 * of its nodes; what is stiffer makes steps short and looks the same. */
#define CURTAIN_SAG      0.02 /* that a column's own weight makes of its length */
#define CURTAIN_BENDING  0.02 /* of the structural stiffness */
#define CURTAIN_SLACK    0.85 /* how far its corners are apart, of its width */
#define CURTAIN_SPHERE   0.7  /* of the shorter distance of its nodes, across */
#define CURTAIN_PUSH     0.5  /* of the structural stiffness, of two spheres */
#define CURTAIN_DRAG_S   1.2  /* in which the air stops it */
#define CURTAIN_SETTLE_S 3.0
#define CURTAIN_FLOOR    1e-12 /* gauss.h; air and cloth damp it */
#define SETTLE_STEP_S    1e-3

/* From where it was to where it comes, in a cubic. */
static struct sim_signal payload_signal(const struct sim_payload *self,
                                        double step_s, double at, double speed)
{
    const double rise = (at - self->at) / step_s;

    return (struct sim_signal){
        { self->at, self->speed, (3 * rise - 2 * self->speed - speed) / step_s,
          (self->speed + speed - 2 * rise) / (step_s * step_s) }
    };
}

static bool payload_is_legal(const struct sim_payload_config *config)
{
    const bool cable = config->kind == SIM_PAYLOAD_CABLE;
    const bool curtain = config->kind == SIM_PAYLOAD_CURTAIN;
    const bool ball = config->kind == SIM_PAYLOAD_BALL;

    return config->mass_kg > 0 && config->length_m > 0 &&
           (!cable || config->cable_kg > 0) &&
           (!curtain || config->width_m > 0) && config->damping >= 0 &&
           config->damping <= 1 &&
           (!ball || (config->radius_m > 0 && config->friction >= 0 &&
                      config->wall_m >= 0));
}

/* ---- what hangs on links ---- */

static int payload_hang(struct sim_payload *self)
{
    const struct sim_payload_config *const config = &self->config;
    struct sim_linkage_config linkage = { .gravity_m_s2 = GRAVITY };
    const bool cable = config->kind == SIM_PAYLOAD_CABLE;

    linkage.links = cable ? SIM_PAYLOAD_LINKS : 1;
    for (int i = 0; i < linkage.links; i++) {
        linkage.mass_kg[i] = cable ? config->cable_kg / linkage.links : 0;
        linkage.length_m[i] = config->length_m / linkage.links;
    }
    linkage.mass_kg[linkage.links - 1] += config->mass_kg;
    return sim_linkage_init(&self->linkage, &linkage);
}

/* Swings lose speed beside the axis, evenly: damping at the pivot alone would bend
 * a cable there and leave the rest. */
static int payload_swing(struct sim_payload *self, double step_s,
                         const struct sim_signal *signal)
{
    const double rate =
        2 * self->config.damping * sqrt(GRAVITY / self->config.length_m);
    const double left = double_exp(-rate * step_s);
    const int err = sim_linkage_step(&self->linkage, step_s, signal);

    for (int i = 0; i < self->linkage.config.links; i++)
        self->linkage.speed_rad_s[i] *= left;
    return err;
}

/* Along x, of all masses. */
static double payload_hanging_momentum(const struct sim_payload *self)
{
    const struct sim_linkage *const linkage = &self->linkage;
    double speed = self->speed, momentum = 0;

    for (int i = 0; i < linkage->config.links; i++) {
        speed += linkage->config.length_m[i] *
                 double_cos(linkage->angle_rad[i]) * linkage->speed_rad_s[i];
        momentum += linkage->config.mass_kg[i] * speed;
    }
    return momentum;
}

/* ---- a curtain ---- */

/* x, y, z of a node of the cloth. */
static double *payload_node(double *of, int node)
{
    return of + 3 * (ptrdiff_t)node;
}

static void payload_lay_curtain(struct sim_payload *self, double at)
{
    const struct sim_payload_config *const config = &self->config;
    const double from = self->held_m;

    for (int c = 0; c < SIM_PAYLOAD_COLUMNS; c++)
        for (int r = 0; r < SIM_PAYLOAD_ROWS; r++) {
            double *const pos =
                payload_node(self->particles.pos_m, c * SIM_PAYLOAD_ROWS + r);
            const double part = (double)c / (SIM_PAYLOAD_COLUMNS - 1);
            pos[0] = from + (at - from) * part;
            /* in folds: out of a plane it would have no side to go to */
            pos[1] = 0.1 * config->width_m * double_sin(9 * part);
            pos[2] = -config->length_m * r / (SIM_PAYLOAD_ROWS - 1);
        }
}

double sim_payload_sphere_m(const struct sim_payload_config *config)
{
    return CURTAIN_SPHERE * fmin(config->length_m / (SIM_PAYLOAD_ROWS - 1),
                                 config->width_m / (SIM_PAYLOAD_COLUMNS - 1));
}

/* As far apart across as down in the grid: the width is its own. */
static void payload_space_springs(struct sim_payload *self, int springs)
{
    const struct sim_payload_config *const config = &self->config;
    const double down = config->length_m / (SIM_PAYLOAD_ROWS - 1);
    const double across = config->width_m / (SIM_PAYLOAD_COLUMNS - 1);

    for (int i = 0; i < springs; i++) {
        struct sim_spring *const spring = &self->spring[i];
        const int columns =
            spring->j / SIM_PAYLOAD_ROWS - spring->i / SIM_PAYLOAD_ROWS;
        const int rows =
            spring->j % SIM_PAYLOAD_ROWS - spring->i % SIM_PAYLOAD_ROWS;
        spring->rest_m = double_hypot(across * columns, down * rows);
    }
}

static int payload_spheres(struct sim_payload *self, double stiffness,
                           double damping, int springs)
{
    const struct sim_spring like = {
        .stiffness_n_m = CURTAIN_PUSH * stiffness,
        .damping_n_s_m = damping,
        .rest_m = sim_payload_sphere_m(&self->config),
        .pushes = true,
    };

    return self->config.collides ? sim_spheres_springs(&like, SIM_PAYLOAD_NODES,
                                                       self->spring + springs)
                                 : 0;
}

static int payload_weave(struct sim_payload *self, double at)
{
    const struct sim_payload_config *const config = &self->config;
    const double node_kg = config->mass_kg / SIM_PAYLOAD_NODES;
    const double spacing = config->length_m / (SIM_PAYLOAD_ROWS - 1);
    const double stiffness =
        SIM_PAYLOAD_ROWS * node_kg * GRAVITY / (CURTAIN_SAG * spacing);
    const double damping = 0.1 * sqrt(stiffness * node_kg);
    const struct sim_cloth cloth = {
        .columns = SIM_PAYLOAD_COLUMNS,
        .rows = SIM_PAYLOAD_ROWS,
        .spacing_m = spacing,
        .structural_n_m = stiffness,
        .shear_n_m = 0.3 * stiffness,
        .bending_n_m = CURTAIN_BENDING * stiffness,
        .structural_n_s_m = damping,
        .shear_n_s_m = damping,
    };
    const int springs =
        sim_cloth_springs(&cloth, self->spring, SIM_PAYLOAD_SPRINGS);
    const int driven = (SIM_PAYLOAD_COLUMNS - 1) * SIM_PAYLOAD_ROWS;
    struct sim_particles_config particles = {
        .nodes = SIM_PAYLOAD_NODES,
        .node = self->node,
        .spring = self->spring,
        .gravity_m_s2 = { 0, 0, -GRAVITY },
        .drag_linear_n_s_m = node_kg / CURTAIN_DRAG_S,
        .driven = driven,
    };

    if (springs < 0)
        return springs;
    for (int i = 0; i < SIM_PAYLOAD_NODES; i++)
        self->node[i] = (struct sim_node){
            .mass_kg = node_kg,
            .fixed = i == 0 || i == driven,
        };
    payload_space_springs(self, springs);
    particles.springs =
        springs + payload_spheres(self, stiffness, damping, springs);
    self->held_m = at - CURTAIN_SLACK * config->width_m;
    const int err =
        sim_particles_init(&self->particles, &particles, self->work);
    if (err < 0)
        return err;
    self->particles.gauss.floor = CURTAIN_FLOOR;
    payload_lay_curtain(self, at);
    return MOTION_OK;
}

static int payload_pull_curtain(struct sim_payload *self, double step_s,
                                const struct sim_signal *signal)
{
    const struct sim_particles_input input = {
        { *signal, { { 0 } }, { { 0 } } }
    };

    return sim_particles_step(&self->particles, step_s, &input);
}

/* What the springs of the driven corner pull it back with. */
static double payload_curtain_force(const struct sim_payload *self)
{
    const struct sim_particles *const cloth = &self->particles;
    const int driven = cloth->config.driven;
    double force = 0;

    for (int s = 0; s < cloth->config.springs; s++) {
        const struct sim_spring *const spring = &self->spring[s];
        if (spring->i != driven && spring->j != driven)
            continue;
        const int other = spring->i == driven ? spring->j : spring->i;
        const double *const a = payload_node(cloth->pos_m, driven);
        const double *const b = payload_node(cloth->pos_m, other);
        const double length =
            double_hypot(double_hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
        if (length > 0)
            force += sim_particles_tension_n(cloth, s) * (a[0] - b[0]) / length;
    }
    return force;
}

/* ---- all of them ---- */

static int payload_advance(struct sim_payload *self, double step_s,
                           const struct sim_signal *signal)
{
    switch (self->config.kind) {
    case SIM_PAYLOAD_CURTAIN:
        return payload_pull_curtain(self, step_s, signal);
    case SIM_PAYLOAD_BALL:
        return sim_payload_ball_step(self, step_s, signal);
    case SIM_PAYLOAD_PENDULUM:
    case SIM_PAYLOAD_CABLE:
    case SIM_PAYLOAD_KINDS:
        break;
    }
    return payload_swing(self, step_s, signal);
}

static void payload_react(struct sim_payload *self, double step_s)
{
    const double before = self->momentum;

    switch (self->config.kind) {
    case SIM_PAYLOAD_CURTAIN:
        self->force = payload_curtain_force(self);
        return;
    case SIM_PAYLOAD_BALL:
        sim_payload_ball_react(self, step_s);
        return;
    case SIM_PAYLOAD_PENDULUM:
    case SIM_PAYLOAD_CABLE:
    case SIM_PAYLOAD_KINDS:
        break;
    }
    self->momentum = payload_hanging_momentum(self);
    self->force = (self->momentum - before) / step_s;
}

int sim_payload_step(struct sim_payload *self, double step_s, double at,
                     double speed)
{
    const struct sim_signal signal = payload_signal(self, step_s, at, speed);
    const int err = payload_advance(self, step_s, &signal);

    self->at = at;
    self->speed = speed;
    if (err == MOTION_OK)
        payload_react(self, step_s);
    return err;
}

int sim_payload_init(struct sim_payload *self,
                     const struct sim_payload_config *config, double at)
{
    int err = MOTION_OK;

    if (!payload_is_legal(config) || config->kind >= SIM_PAYLOAD_KINDS)
        return MOTION_E_ARG;
    *self = (struct sim_payload){ .config = *config, .at = at };
    if (config->kind == SIM_PAYLOAD_BALL)
        return sim_payload_ball_init(self, at);
    if (config->kind != SIM_PAYLOAD_CURTAIN)
        return payload_hang(self);
    err = payload_weave(self, at);
    for (double t = 0; err == MOTION_OK && t < CURTAIN_SETTLE_S;
         t += SETTLE_STEP_S)
        err = sim_payload_step(self, SETTLE_STEP_S, at, 0);
    return err;
}

double sim_payload_off_m(const struct sim_payload *self)
{
    const int last = self->linkage.config.links - 1;
    double x, z, sum = 0;

    if (self->config.kind == SIM_PAYLOAD_BALL)
        return fabs(sim_payload_ball_m(self));
    if (self->config.kind != SIM_PAYLOAD_CURTAIN) {
        sim_linkage_place_m(&self->linkage, last, &x, &z);
        return fabs(x);
    }
    /* how fast its lower edge goes is what is seen of it; in m over the time in
     * which a weight as far down would swing by one radian */
    for (int c = 0; c < SIM_PAYLOAD_COLUMNS; c++) {
        const double *const vel = payload_node(self->particles.vel_m_s,
                                               (c + 1) * SIM_PAYLOAD_ROWS - 1);
        sum += double_hypot(vel[0], vel[1]) / SIM_PAYLOAD_COLUMNS;
    }
    return sum * sqrt(self->config.length_m / GRAVITY);
}

static unsigned payload_hanging_points(const struct sim_payload *self,
                                       struct sim_payload_point point[])
{
    const int links = self->linkage.config.links;

    point[0] = (struct sim_payload_point){ self->at, 0, 0 };
    for (int i = 0; i < links; i++) {
        double x, z;
        sim_linkage_place_m(&self->linkage, i, &x, &z);
        point[i + 1] = (struct sim_payload_point){ self->at + x, 0, z };
    }
    return (unsigned)links + 1;
}

unsigned sim_payload_points(const struct sim_payload *self,
                            struct sim_payload_point point[SIM_PAYLOAD_NODES])
{
    double *const pos = self->particles.pos_m;

    switch (self->config.kind) {
    case SIM_PAYLOAD_CURTAIN:
        for (int i = 0; i < SIM_PAYLOAD_NODES; i++) {
            const double *const at = payload_node(pos, i);
            point[i] = (struct sim_payload_point){ at[0], at[1], at[2] };
        }
        return SIM_PAYLOAD_NODES;
    case SIM_PAYLOAD_BALL:
        return sim_payload_ball_points(self, point);
    case SIM_PAYLOAD_PENDULUM:
    case SIM_PAYLOAD_CABLE:
    case SIM_PAYLOAD_KINDS:
        break;
    }
    return payload_hanging_points(self, point);
}
