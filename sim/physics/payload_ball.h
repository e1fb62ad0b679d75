/* sim/physics/payload_ball.h - a ball on a plate that an axis tilts: this part of
 * payload.h. */
#ifndef SIM_PHYSICS_PAYLOAD_BALL_H
#define SIM_PHYSICS_PAYLOAD_BALL_H

#include "sim/physics/payload.h"

/* At rest on its plate, which is at that tilt. */
int sim_payload_ball_init(struct sim_payload *self, double at);
int sim_payload_ball_step(struct sim_payload *self, double step_s,
                          const struct sim_signal *tilt);
/* self->force and self->gone after a step, the axis being where it came to. */
void sim_payload_ball_react(struct sim_payload *self, double step_s);
/* From the middle of the plate, along it. */
double sim_payload_ball_m(const struct sim_payload *self);
unsigned sim_payload_ball_points(const struct sim_payload *self,
                                 struct sim_payload_point point[]);

#endif
