/* hal/drive/modbus/go.c - motion by the drive's own profile, and its homing;
 * see drive.h for the rules, drive.h for how. */
#include <stddef.h>

#include "hal/drive/modbus/parts.h"
#include "hal/support/container_of.h"
#include "hal/support/quotient.h"
#include "motion/core/fixed.h"

#define STAND_NS    INT64_C(5000000000) /* short of its target, before a fault */
#define REST_NS     INT64_C(1000000000) /* at home, with `homed` never read low */
#define REST_CYCLES 4                   /* besides */
#define REST_PART   64 /* of the first step: one at rest moves no more */

static struct drive_modbus *go_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_modbus, drive);
}

static bool go_has(const struct modbus_map *map,
                   enum modbus_map_sequence_name name)
{
    return map->sequence[name].count > 0;
}

/* ---- modes ---- */

static unsigned go_modes(const struct modbus_map *map)
{
    unsigned modes = 0;

    if (map->stream.count > 0)
        modes |= 1u << HAL_DRIVE_STREAM_POSITION;
    if (map->move.count > 0)
        modes |= 1u << HAL_DRIVE_PROFILE_POSITION;
    if (go_has(map, MODBUS_SEQUENCE_home))
        modes |= 1u << HAL_DRIVE_HOMING;
    return modes;
}

enum hal_drive_mode
drive_modbus_first_mode(const struct drive_modbus_config *config)
{
    return config->map->stream.count > 0 ? config->mode
                                         : HAL_DRIVE_PROFILE_POSITION;
}

unsigned drive_modbus_modes(struct hal_drive *drive)
{
    const struct drive_modbus *self = go_of(drive);

    return self->state == HAL_DRIVE_OFFLINE ? 0 : go_modes(self->config.map);
}

static bool go_is_busy(const struct drive_modbus *self)
{
    return self->move != DRIVE_MODBUS_NO_MOVE ||
           self->homing == HAL_DRIVE_HOMING_RUNNING ||
           self->run.sequence != NULL;
}

/* As the drive says, or its position. */
static bool drive_modbus_stands(const struct drive_modbus *self)
{
    return !drive_modbus_status(self, MODBUS_STATUS_moving,
                                self->actual_vel_q32 != 0);
}

bool drive_modbus_goes(const struct drive_modbus *self)
{
    return self->move != DRIVE_MODBUS_NO_MOVE ||
           self->homing == HAL_DRIVE_HOMING_RUNNING ||
           (self->mode != HAL_DRIVE_STREAM_POSITION &&
            !drive_modbus_stands(self));
}

int drive_modbus_set_mode(struct hal_drive *drive, enum hal_drive_mode mode)
{
    struct drive_modbus *self = go_of(drive);

    if ((unsigned)mode >= HAL_DRIVE_MODES ||
        (go_modes(self->config.map) & 1u << mode) == 0)
        return MOTION_E_EMPTY;
    if (self->state != HAL_DRIVE_OFF &&
        (self->state != HAL_DRIVE_ENABLED || go_is_busy(self) ||
         !drive_modbus_stands(self)))
        return MOTION_E_STATE;
    if (self->mode == mode)
        return MOTION_OK;
    self->mode = mode;
    self->target_ns = 0;
    self->past_count = 0;
    self->first_target = true;
    self->begun = self->begin_requested = false;
    self->went = false;
    return MOTION_OK;
}

/* ---- ramps ---- */

/* num / den to nearest, both positive. */
static int64_t go_over(int64_t num, int64_t den)
{
    uint64_t rest;
    const uint64_t quotient = hal_quotient((uint64_t)num, (uint64_t)den, &rest);

    return (int64_t)(rest >= (uint64_t)den - rest ? quotient + 1 : quotient);
}

/* The preset where the drive is to keep its own, or has no field for it.  The
 * scale for speeds takes acc_q32 to counts/s2 in Q16. */
static int64_t go_ramp(const struct drive_modbus *self, unsigned which,
                       int64_t acc_q32)
{
    const struct drive_modbus_ramp *ramp = &self->move_scale[which];
    int64_t counts_s2, value;

    if (acc_q32 == 0 || ramp->field == NULL)
        return self->ramp[which];
    counts_s2 = hal_ratio_scale(&self->to_speed, acc_q32);
    counts_s2 = (int64_t)((motion_fixed_abs(counts_s2) + 32768) >> 16);
    if (ramp->over > 0)
        value = go_over(ramp->over, counts_s2 > 0 ? counts_s2 : 1);
    else
        value = hal_ratio_scale(&ramp->to_field, counts_s2);
    if (value < ramp->field->min)
        return ramp->field->min;
    return value > ramp->field->max ? ramp->field->max : value;
}

/* ---- going ---- */

int drive_modbus_go(struct hal_drive *drive, const struct hal_drive_go *go)
{
    struct drive_modbus *self = go_of(drive);
    const int64_t pos_q32 = go->pos_q32 - self->zero_q32;
    const int64_t counts = hal_ratio_scale(&self->to_counts, pos_q32);

    if (self->config.map->move.count == 0)
        return MOTION_E_EMPTY;
    if (self->state != HAL_DRIVE_ENABLED ||
        self->mode != HAL_DRIVE_PROFILE_POSITION ||
        self->move == DRIVE_MODBUS_MOVE_HALTING)
        return MOTION_E_STATE;
    if (go->vel_q32 <= 0 || go->acc_q32 < 0 || go->dec_q32 < 0)
        return MOTION_E_ARG;
    if (!drive_modbus_fits(self, counts))
        return MOTION_E_RANGE;
    self->move_pos_q32 = pos_q32;
    self->move_vel_q32 = go->vel_q32;
    self->move_ramp[0] = go_ramp(self, 0, go->acc_q32);
    self->move_ramp[1] = go_ramp(self, 1, go->dec_q32);
    self->went = true;
    self->again = self->move == DRIVE_MODBUS_MOVE_SENT;
    if (!self->again)
        self->move = DRIVE_MODBUS_MOVE_WANTED;
    return MOTION_OK;
}

int drive_modbus_halt(struct hal_drive *drive)
{
    struct drive_modbus *self = go_of(drive);
    const bool homes = self->homing == HAL_DRIVE_HOMING_RUNNING;

    if (!go_has(self->config.map, MODBUS_SEQUENCE_halt))
        return MOTION_E_EMPTY;
    if (self->state != HAL_DRIVE_ENABLED ||
        (self->move == DRIVE_MODBUS_NO_MOVE && !homes))
        return MOTION_E_STATE;
    if (homes)
        self->homing = HAL_DRIVE_HOMING_FAILED;
    self->went = self->again = false;
    self->move = DRIVE_MODBUS_MOVE_HALTING;
    drive_modbus_run_begin(self, MODBUS_SEQUENCE_halt);
    return MOTION_OK;
}

static void go_fail(struct drive_modbus *self, const char *words)
{
    drive_modbus_say(self, words);
    drive_modbus_latch(self);
}

static void go_move_step(struct drive_modbus *self)
{
    if (self->run.sequence != NULL || self->cycles < DRIVE_MODBUS_FRESH)
        return;
    if (!drive_modbus_stands(self)) {
        self->moved_ns = self->now_ns;
        return;
    }
    if (self->move == DRIVE_MODBUS_MOVE_HALTING ||
        drive_modbus_status(self, MODBUS_STATUS_in_position, true))
        self->move = DRIVE_MODBUS_NO_MOVE;
    else if (self->now_ns - self->moved_ns > STAND_NS)
        go_fail(self, "stands, but not at its target");
}

/* ---- homing ---- */

/* Speeds and ramps are the drive's own, and so is its method. */
int drive_modbus_home(struct hal_drive *drive,
                      const struct hal_drive_home *home)
{
    struct drive_modbus *self = go_of(drive);

    if (!go_has(self->config.map, MODBUS_SEQUENCE_home))
        return MOTION_E_EMPTY;
    if (self->state != HAL_DRIVE_ENABLED || self->mode != HAL_DRIVE_HOMING ||
        go_is_busy(self) || !drive_modbus_stands(self))
        return MOTION_E_STATE;
    if (home->timeout_ns <= 0 || home->method != 0 || home->fast_q32 != 0 ||
        home->slow_q32 != 0 || home->acc_q32 != 0)
        return MOTION_E_ARG;
    self->homing = HAL_DRIVE_HOMING_RUNNING;
    self->home_end_ns = self->now_ns + home->timeout_ns;
    self->home_q32 = home->pos_q32;
    self->home_waits = self->home_begun = self->home_moved = false;
    self->home_rest_ns = self->now_ns;
    self->home_rest_counts = self->actual_counts;
    drive_modbus_run_begin(self, MODBUS_SEQUENCE_home);
    return MOTION_OK;
}

/* What starts it has been confirmed: it waits for `homed`, or is past that. */
static bool go_home_waits(struct drive_modbus *self)
{
    const struct modbus_map_step *step = drive_modbus_run_at(self);

    if (step == NULL || (step->kind == MODBUS_STEP_UNTIL &&
                         step->status == MODBUS_STATUS_homed))
        self->home_waits = true;
    return self->home_waits;
}

void drive_modbus_note_homed(struct drive_modbus *self)
{
    if (self->homing == HAL_DRIVE_HOMING_RUNNING && go_home_waits(self) &&
        !drive_modbus_status(self, MODBUS_STATUS_homed, true))
        self->home_begun = true;
}

static uint64_t go_rest_counts(const struct drive_modbus *self)
{
    return (uint64_t)self->first_step_counts / REST_PART + 1;
}

static void go_home_rest(struct drive_modbus *self)
{
    const bool moved =
        motion_fixed_abs(self->actual_counts - self->home_rest_counts) >
        go_rest_counts(self);

    if (go_home_waits(self) && !moved && drive_modbus_stands(self))
        return;
    self->home_moved = self->home_moved || (moved && self->home_waits);
    self->home_rest_ns = self->now_ns;
    self->home_rest_counts = self->actual_counts;
}

static bool go_home_rests(const struct drive_modbus *self)
{
    return self->now_ns - self->home_rest_ns >
           REST_NS + REST_CYCLES * self->config.cycle_ns;
}

static bool go_home_is_zero(const struct drive_modbus *self)
{
    const bool wide = self->home_begun || self->home_moved;

    return motion_fixed_abs(self->actual_counts) <=
           (wide ? (uint64_t)self->first_step_counts : go_rest_counts(self));
}

bool drive_modbus_is_home(const struct drive_modbus *self)
{
    return drive_modbus_status(self, MODBUS_STATUS_homed, true) &&
           (self->home_begun ||
            (self->home_waits && go_home_rests(self) && go_home_is_zero(self)));
}

/* "homed (state, 0x0B05) stays set: at 200000, not at 0" */
static void go_home_fail(struct drive_modbus *self)
{
    const struct modbus_map *map = self->config.map;
    const uint8_t homed = map->status[MODBUS_STATUS_homed].item;
    struct hal_text text = drive_modbus_say(self, "homing ended");

    if (!self->home_begun && homed != MODBUS_MAP_NO_ITEM) {
        text = drive_modbus_say(self, "homed (");
        hal_text_put(&text, map->item[homed].name);
        hal_text_put(&text, ", 0x");
        hal_text_hex(&text, map->item[homed].at, 4);
        hal_text_put(&text, ") stays set:");
    }
    hal_text_put(&text, self->actual_counts < 0 ? " at -" : " at ");
    hal_text_dec(&text, (uint32_t)motion_fixed_abs(self->actual_counts));
    hal_text_put(&text, ", not at 0");
    drive_modbus_latch(self);
}

static void go_home_step(struct drive_modbus *self)
{
    const bool set = drive_modbus_status(self, MODBUS_STATUS_homed, true);
    const bool fresh = self->cycles >= DRIVE_MODBUS_FRESH;

    go_home_rest(self);
    if (self->now_ns > self->home_end_ns) {
        go_fail(self, "not at home in time");
    } else if (set && fresh && go_home_rests(self) && !go_home_is_zero(self)) {
        go_home_fail(self);
    } else if (self->run.sequence == NULL && fresh &&
               drive_modbus_stands(self) && drive_modbus_is_home(self) &&
               go_home_is_zero(self)) {
        self->homing = HAL_DRIVE_HOMING_DONE;
        self->zero_q32 = self->home_q32;
    }
}

/* ---- what both need ---- */

void drive_modbus_go_step(struct drive_modbus *self)
{
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        go_home_step(self);
    else if (self->again && self->move == DRIVE_MODBUS_MOVE_RUNNING) {
        self->again = false;
        self->move = DRIVE_MODBUS_MOVE_WANTED;
    } else if (self->move >= DRIVE_MODBUS_MOVE_RUNNING) {
        go_move_step(self);
    }
}

void drive_modbus_go_drop(struct drive_modbus *self)
{
    self->move = DRIVE_MODBUS_NO_MOVE;
    self->went = self->again = false;
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        self->homing = HAL_DRIVE_HOMING_FAILED;
}
