/* firmware/control/homing_parts.h - what the ways of homing share. */
#ifndef FIRMWARE_CONTROL_HOMING_PARTS_H
#define FIRMWARE_CONTROL_HOMING_PARTS_H

#include "firmware/control/homing.h"

/* Of the axis in its turn. */
const struct homing_config *homing_of(const struct homing *homing);
struct controller_axis *homing_axis(const struct homing *homing);
bool homing_at_rest(const struct homing *homing);
/* The limit switch in a direction, unless it is what we look for. */
bool homing_bad_limit(const struct homing *homing, int direction);

/* Brakes; the first error is kept. */
void homing_fail(struct homing *homing, enum homing_error error);
/* A jog of `distance_q32` from the set point, and into that state. */
void homing_run(struct homing *homing, enum homing_state state, int direction,
                int64_t vel_q32, int64_t distance_q32);
/* To rest, and into that state. */
void homing_rest(struct homing *homing, enum homing_state state);

/* homing_stop.c: by a hard stop. */
void homing_begin_stop(struct homing *homing);
void homing_press(struct homing *homing);
void homing_pressed(struct homing *homing);
void homing_clear(struct homing *homing);
void homing_press_again(struct homing *homing);

#endif
