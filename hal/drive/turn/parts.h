/* hal/drive/turn/parts.h - private to drive_turn*.c. */
#ifndef HAL_DRIVE_TURN_PARTS_H
#define HAL_DRIVE_TURN_PARTS_H

#include "hal/drive/turn/drive.h"

/* ---- drive.c: what the controller asks ---- */

extern const struct hal_drive_ops drive_turn_drive_ops;

/* ---- walk.c: phases ---- */

void drive_turn_start(struct drive_turn *self);
void drive_turn_enter(struct drive_turn *self, enum drive_turn_phase phase);
/* A new request: its waits begin now. */
void drive_turn_pursue(struct drive_turn *self);

/* ---- motion.c: set points ---- */

/* Brakes from where the set points are, or the axis is. */
void drive_turn_brake(struct drive_turn *self);
bool drive_turn_is_standing(const struct drive_turn *self);
/* Its ramp is over, and what is heard of it says that it moves still: within
 * HAL_DRIVE_ROLL_NS. */
bool drive_turn_rolls(const struct drive_turn *self);
/* Is it on a ramp of ours to standstill? */
bool drive_turn_ramps(const struct drive_turn *self);
/* The newest set point given until then; false: none. */
bool drive_turn_in_force(const struct drive_turn *self, int64_t t_ns,
                         struct drive_turn_past *past);

#endif
