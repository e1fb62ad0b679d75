/* hal/drive/modbus/parts.h - private to drive_modbus*.c: what the parts share of
 * each other. */
#ifndef HAL_DRIVE_MODBUS_PARTS_H
#define HAL_DRIVE_MODBUS_PARTS_H

#include "hal/drive/modbus/drive.h"

#define DRIVE_MODBUS_FRESH      2 /* cycles before a status may be believed */
#define DRIVE_MODBUS_STEP_TRIES 3 /* of a write */
#define DRIVE_MODBUS_STARTS     4 /* sequences before the parameters */

extern const struct hal_drive_ops drive_modbus_ops;
extern const struct modbus_node_ops drive_modbus_node_ops;

/* ---- walk.c ---- */

/* One step per tick. */
void drive_modbus_walk(struct drive_modbus *self);
/* Begin what leads to what is requested. */
void drive_modbus_pursue(struct drive_modbus *self);
/* Look for the drive from the beginning. */
void drive_modbus_start(struct drive_modbus *self);
/* fault_text begins anew; more may be put to what is returned. */
struct hal_text drive_modbus_say(struct drive_modbus *self, const char *words);
/* The alarm as polled, if there is one. */
void drive_modbus_say_alarm(struct drive_modbus *self);
/* A fault, the drive still there; gone.  What was said first stays. */
void drive_modbus_latch(struct drive_modbus *self);
void drive_modbus_lose(struct drive_modbus *self, enum hal_drive_state state);
/* It was lost, or has a fault: what it says of itself starts nothing more. */
bool drive_modbus_is_down(const struct drive_modbus *self);
/* Does the drive say so?  `unknown` when it cannot. */
bool drive_modbus_status(const struct drive_modbus *self,
                         enum modbus_map_status status, bool unknown);

/* Busy, lost or broken: may be tried again. */
bool drive_modbus_is_passing(const struct hal_modbus_reply *reply);

/* ---- run.c: sequences ---- */

/* Begin a sequence; write its next value, if that is its step. */
void drive_modbus_run_begin(struct drive_modbus *self,
                            enum modbus_map_sequence_name name);
bool drive_modbus_run_request(struct drive_modbus *self,
                              struct hal_modbus_request *request);
void drive_modbus_run_reply(struct drive_modbus *self,
                            const struct hal_modbus_reply *reply);
/* Of a step that checks: is this the value?  true of one that does not. */
bool drive_modbus_run_checks(const struct drive_modbus *self,
                             const struct hal_modbus_reply *reply);
/* Its step, NULL at its end; on to the next. */
const struct modbus_map_step *
drive_modbus_run_at(const struct drive_modbus *self);
void drive_modbus_run_next(struct drive_modbus *self);
/* Is it this one?  One step per tick: MOTION_OK when it is done, MOTION_E_AGAIN
 * while it runs; else what was waited for did not come, and has been said. */
bool drive_modbus_runs(const struct drive_modbus *self,
                       enum modbus_map_sequence_name name);
int drive_modbus_run_step(struct drive_modbus *self);
/* The steps of its `stop` are done, and its polls do not show yet that it stands:
 * within HAL_DRIVE_ROLL_NS. */
bool drive_modbus_run_rolls(const struct drive_modbus *self);

/* ---- off.c: torque off, in LATCHED and LOST ---- */

void drive_modbus_off_begin(struct drive_modbus *self);
/* It was stopped already, in vain or not: only disabled. */
void drive_modbus_off_disable(struct drive_modbus *self);
/* One step per tick. */
void drive_modbus_off_step(struct drive_modbus *self);
/* Of a write; heard: of anything else, after it did not answer. */
void drive_modbus_off_reply(struct drive_modbus *self,
                            const struct hal_modbus_reply *reply);
void drive_modbus_off_heard(struct drive_modbus *self);
/* Does the drive say that it has torque?  `unknown` when it cannot. */
bool drive_modbus_has_torque(const struct drive_modbus *self, bool unknown);
/* It stands, by its status and by its positions. */
bool drive_modbus_rests(const struct drive_modbus *self);
/* By its polls since the search began it has torque, or moves and cannot say.  To
 * any other `stop` is not written: it may be what gives it some. */
bool drive_modbus_needs_stop(const struct drive_modbus *self);

/* ---- parameter.c: written at start-up, and read back ---- */

bool drive_modbus_parameters_done(const struct drive_modbus *self);
bool drive_modbus_parameter_request(struct drive_modbus *self,
                                    struct hal_modbus_request *request);
void drive_modbus_parameter_reply(struct drive_modbus *self,
                                  const struct hal_modbus_reply *reply);

/* ---- go.c: the optional calls of hal/drive.h ---- */

unsigned drive_modbus_modes(struct hal_drive *drive);
int drive_modbus_set_mode(struct hal_drive *drive, enum hal_drive_mode mode);
int drive_modbus_go(struct hal_drive *drive, const struct hal_drive_go *go);
int drive_modbus_home(struct hal_drive *drive,
                      const struct hal_drive_home *home);
int drive_modbus_halt(struct hal_drive *drive);
/* The mode when nothing was asked. */
enum hal_drive_mode
drive_modbus_first_mode(const struct drive_modbus_config *config);
/* It moves by itself, or may: by its profile, or to its home. */
bool drive_modbus_goes(const struct drive_modbus *self);
/* `homed` was polled. */
void drive_modbus_note_homed(struct drive_modbus *self);
/* Is it at home by this homing, not by an earlier one? */
bool drive_modbus_is_home(const struct drive_modbus *self);
/* One step per tick while enabled: has it arrived, is it home? */
void drive_modbus_go_step(struct drive_modbus *self);
/* Everything under way ends without a word to the drive. */
void drive_modbus_go_drop(struct drive_modbus *self);

/* ---- fields.c ---- */

/* What goes into a field for ramps where nothing else is asked for. */
int64_t drive_modbus_ramp(const struct drive_modbus_config *config,
                          const struct modbus_map_field *field);

/* ---- stream.c ---- */

/* Fill in the group for the set point in force now. */
void drive_modbus_put_stream(struct drive_modbus *self,
                             struct hal_modbus_request *request);
void drive_modbus_put_move(struct drive_modbus *self,
                           struct hal_modbus_request *request);
/* Can the drive be sent there?  A position beyond its field is refused; only
 * what a set point says of a place ahead of it is clamped. */
bool drive_modbus_fits(const struct drive_modbus *self, int64_t counts);
/* A position was read that cannot be: the second in a row is a fault. */
void drive_modbus_doubt_position(struct drive_modbus *self, const char *why);
/* A position was read, measured at t_ns. */
void drive_modbus_note_position(struct drive_modbus *self, int64_t counts,
                                int64_t t_ns);
/* Remember what is asked for; what was asked for at t_ns, false: not known. */
void drive_modbus_note_target(struct drive_modbus *self);
bool drive_modbus_demand(const struct drive_modbus *self, int64_t t_ns,
                         int64_t *pos_q32);

#endif
