/* hal/drive/turn/parts.h - private to drive_turns*.c. */
#ifndef HAL_DRIVE_TURN_PARTS_H
#define HAL_DRIVE_TURN_PARTS_H

#include "hal/drive/turn/drive.h"

/* ---- drive.c: what the controller asks ---- */

extern const struct hal_drive_ops drive_turns_drive_ops;

/* ---- walk.c: phases ---- */

void drive_turns_start(struct drive_turns *self);
void drive_turns_enter(struct drive_turns *self, enum drive_turns_phase phase);
/* A new request: its waits begin now. */
void drive_turns_pursue(struct drive_turns *self);

/* ---- motion.c: set points ---- */

/* Brakes from where the set points are, or the axis is. */
void drive_turns_brake(struct drive_turns *self);
bool drive_turns_is_standing(const struct drive_turns *self);
/* The newest set point given until then; false: none. */
bool drive_turns_in_force(const struct drive_turns *self, int64_t t_ns,
                          struct drive_turns_past *past);

#endif
