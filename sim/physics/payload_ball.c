/* sim/physics/payload_ball.c - see payload_ball.h. */
#include "sim/physics/payload_ball.h"

#include <math.h>
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"

#define PLATE_M      0.01 /* how thick a plate and its walls are */
#define PLATE_BOUNCE 0.2

/* Across as wide as the plate is long: the ball stays in the middle. */
static struct sim_box ball_box(double x, double z, double length, double height,
                               double width)
{
    return (struct sim_box){
        .center_m = { x, 0, z },
        .half_m = { 0.5 * length, 0.5 * width, 0.5 * height },
        .axis = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
        .turns = { 0, 1, 0 }, /* a positive tilt: it rolls to positive x */
    };
}

/* Its upper face goes through the axis; walls stand beside its ends. */
static int ball_plate(struct sim_payload *self)
{
    const double length = self->config.length_m, wall = self->config.wall_m;
    const double beside = 0.5 * (length + PLATE_M);

    self->plate[0] = ball_box(0, -0.5 * PLATE_M, length, PLATE_M, length);
    for (int i = 1; i < SIM_PAYLOAD_PLATE; i++)
        self->plate[i] =
            ball_box(i == 1 ? -beside : beside, 0.5 * (wall - PLATE_M), PLATE_M,
                     wall + PLATE_M, length);
    return wall > 0 ? SIM_PAYLOAD_PLATE : 1;
}

int sim_payload_ball_init(struct sim_payload *self, double at)
{
    const struct sim_payload_config *const config = &self->config;
    const struct sim_bodies_config bodies = {
        .spheres = 1,
        .boxes = ball_plate(self),
        .box = self->plate,
        .restitution = PLATE_BOUNCE,
        .friction = config->friction,
        .gravity_m_s2 = { 0, 0, -SIM_PAYLOAD_GRAVITY },
    };

    self->ball = (struct sim_sphere){
        .mass_kg = config->mass_kg,
        .radius_m = config->radius_m,
        .pos_m = { config->start_m * double_cos(at) +
                       config->radius_m * double_sin(at),
                   0,
                   config->radius_m * double_cos(at) -
                       config->start_m * double_sin(at) },
    };
    return sim_bodies_init(&self->bodies, &bodies, &self->ball, NULL,
                           self->contact);
}

int sim_payload_ball_step(struct sim_payload *self, double step_s,
                          const struct sim_signal *tilt)
{
    struct sim_signal turn[SIM_PAYLOAD_PLATE];

    for (int i = 0; i < SIM_PAYLOAD_PLATE; i++)
        turn[i] = *tilt;
    return self->gone ? MOTION_OK
                      : sim_bodies_step(&self->bodies, 0, step_s, turn);
}

double sim_payload_ball_m(const struct sim_payload *self)
{
    return self->ball.pos_m[0] * double_cos(self->at) -
           self->ball.pos_m[2] * double_sin(self->at);
}

/* What plate and walls change of the ball's angular momentum beside its weight is
 * their torque on it, whatever it touches. */
void sim_payload_ball_react(struct sim_payload *self, double step_s)
{
    const double before = self->momentum;
    const double weight = self->ball.mass_kg * SIM_PAYLOAD_GRAVITY;
    double angular[3];

    sim_bodies_angular_momentum(&self->bodies, angular);
    self->momentum = angular[1];
    self->gone = self->gone ||
                 fabs(sim_payload_ball_m(self)) > 0.5 * self->config.length_m;
    self->force = self->gone ? 0
                             : (self->momentum - before) / step_s -
                                   weight * self->ball.pos_m[0];
}

/* The plate with its walls from end to end, then the ball. */
unsigned sim_payload_ball_points(const struct sim_payload *self,
                                 struct sim_payload_point point[])
{
    const double sine = double_sin(self->at), cosine = double_cos(self->at);
    const double half = 0.5 * self->config.length_m;
    const double wall = self->config.wall_m;
    const double corner[][2] = {
        { -half, wall }, { -half, 0 }, { half, 0 }, { half, wall }
    };
    const double *const ball = self->ball.pos_m;

    for (int i = 0; i < 4; i++) {
        const double x = corner[i][0], z = corner[i][1];
        point[i] = (struct sim_payload_point){ x * cosine + z * sine, 0,
                                               z * cosine - x * sine };
    }
    point[4] = (struct sim_payload_point){ ball[0], ball[1], ball[2] };
    return 5;
}
