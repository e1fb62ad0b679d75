/* hal/drive/modbus/stream.c - set points out, positions in; see drive.h.
 */
#include "hal/drive/modbus/parts.h"

#include "hal/support/quotient.h"
#include "motion/core/fixed.h"

#define PAST_MASK (DRIVE_MODBUS_HISTORY - 1)

static int64_t stream_abs(int64_t value)
{
    return (int64_t)(motion_fixed_abs(value) & INT64_MAX);
}

/* a * b / 2^bits; what is beyond the format is beyond any drive too. */
static int64_t stream_mul(int64_t a, int64_t b, unsigned bits)
{
    int64_t product;

    if (motion_fixed_mulshift(a, b, bits, &product) == MOTION_OK)
        return product;
    return (a < 0) == (b < 0) ? INT64_MAX / 4 : -(INT64_MAX / 4);
}

/* ---- what was asked for ---- */

void drive_modbus_note_target(struct drive_modbus *self)
{
    struct drive_modbus_past *last = &self->past[self->past_at];

    if (self->past_count > 0 &&
        self->target_ns - last->t_ns < self->past_step_ns)
        return;
    self->past_at = (self->past_at + 1) & PAST_MASK;
    self->past[self->past_at] =
        (struct drive_modbus_past){ self->target_ns, self->target.pos_q32 };
    if (self->past_count < DRIVE_MODBUS_HISTORY)
        self->past_count++;
}

bool drive_modbus_demand(const struct drive_modbus *self, int64_t t_ns,
                         int64_t *pos_q32)
{
    for (unsigned i = 0; i < self->past_count; i++) {
        const struct drive_modbus_past *past =
            &self->past[(self->past_at - i) & PAST_MASK];

        if (past->t_ns > t_ns)
            continue;
        *pos_q32 = past->pos_q32;
        return true;
    }
    return false;
}

/* ---- groups ---- */

/* v^2 / 2 dec: where the drive comes to rest from there. */
static int64_t stream_stop_q32(const struct drive_modbus *self, int64_t vel_q32)
{
    const int64_t half_q32 =
        hal_ratio_scale(&self->law.brake, stream_abs(vel_q32));

    return stream_mul(vel_q32, half_q32, 32);
}

/* Where the drive would stop if it began to where the axis will be, `lead` from
 * now.  Slowing down it does not turn back: where it would, v lead / 2 is where
 * it stands, or a little beyond. */
static int64_t stream_ahead_q32(const struct drive_modbus *self)
{
    const struct hal_drive_target *target = &self->target;
    const int64_t by_vel = stream_mul(target->vel_q32, self->lead_q32, 32);
    const int64_t gained = stream_mul(target->acc_q32, self->lead_q32, 32);
    const int64_t by_acc =
        stream_mul(target->acc_q32, self->half_lead2_q32, 32);
    int64_t by_q32, pos_q32;

    if ((target->vel_q32 < 0) != (target->acc_q32 < 0) &&
        motion_fixed_abs(gained) > motion_fixed_abs(target->vel_q32))
        by_q32 = by_vel >> 1;
    else
        by_q32 =
            by_vel + by_acc + stream_stop_q32(self, target->vel_q32 + gained);
    return motion_fixed_add(target->pos_q32, by_q32, &pos_q32) < 0
               ? target->pos_q32
               : pos_q32;
}

/* The following error as a speed, no more than the motor can take back. */
static int64_t stream_correction_q32(const struct drive_modbus *self)
{
    const struct drive_modbus_law *law = &self->law;
    const int64_t actual_q32 =
        hal_ratio_scale(&self->to_pos, self->actual_counts);
    int64_t demand_q32, off_q32;

    if (!drive_modbus_demand(self, self->actual_ns, &demand_q32) ||
        motion_fixed_sub(demand_q32, actual_q32, &off_q32) < 0)
        return 0;
    off_q32 = stream_mul(off_q32, law->gain_q16, 16);
    if (off_q32 > law->correct_max_q32)
        return law->correct_max_q32;
    return off_q32 < -law->correct_max_q32 ? -law->correct_max_q32 : off_q32;
}

/* As fast as leads there, and takes back what it is off. */
static int64_t stream_speed_q32(const struct drive_modbus *self)
{
    const struct hal_drive_target *target = &self->target;
    const int64_t gained = stream_mul(target->acc_q32, self->feed_q32, 32);
    const int64_t off_q32 = stream_correction_q32(self);
    int64_t speed_q32 = target->vel_q32 + gained;

    if ((target->vel_q32 < 0) != (speed_q32 < 0))
        speed_q32 = 0;
    if (speed_q32 == 0)
        return self->law.correct_max_q32; /* it is to stand at the target */
    return (speed_q32 < 0) == (speed_q32 + off_q32 < 0)
               ? stream_abs(speed_q32 + off_q32)
               : 0;
}

static int64_t stream_field(const struct drive_modbus *self,
                            const struct drive_modbus_scale *scale,
                            const struct modbus_map_field *field,
                            const int64_t ramp[2], int64_t pos_q32,
                            int64_t speed_q32)
{
    int64_t value = field->constant;

    switch (field->quantity) {
    case MODBUS_CONST:
        return value;
    case MODBUS_POSITION:
        value = hal_ratio_scale(&self->to_counts, pos_q32);
        value = hal_ratio_scale(&scale->to_position, value);
        break;
    case MODBUS_VELOCITY:
        value = stream_abs(hal_ratio_scale(&self->to_speed, speed_q32));
        value = hal_ratio_scale(&scale->to_velocity, value);
        break;
    case MODBUS_ACCELERATION:
        value = ramp[0];
        break;
    case MODBUS_DECELERATION:
        value = ramp[1];
        break;
    }
    if (value < field->min)
        return field->min;
    return value > field->max ? field->max : value;
}

static void stream_put(const struct drive_modbus *self,
                       const struct modbus_map_group *group,
                       const struct drive_modbus_scale *scale,
                       const int64_t ramp[2], int64_t pos_q32,
                       int64_t speed_q32, struct hal_modbus_request *request)
{
    unsigned at = 0;

    request->function = HAL_MODBUS_WRITE_MANY;
    request->address = group->at;
    request->count = group->registers;
    for (unsigned i = 0; i < group->count; i++) {
        const struct modbus_map_field *field = &group->field[i];

        modbus_map_set(
            field->type, field->order,
            stream_field(self, scale, field, ramp, pos_q32, speed_q32),
            &request->value[at]);
        at += modbus_map_registers(field->type);
    }
}

static bool stream_holds(const struct drive_modbus *self,
                         const struct modbus_map_group *group,
                         const struct drive_modbus_scale *scale, int64_t counts)
{
    const int64_t value = hal_ratio_scale(&scale->to_position, counts);

    return group->count == 0 ||
           (value >= self->pos_min && value <= self->pos_max);
}

bool drive_modbus_fits(const struct drive_modbus *self, int64_t counts)
{
    const struct modbus_map *map = self->config.map;

    return counts >= INT32_MIN && counts <= INT32_MAX &&
           stream_holds(self, &map->move, &self->to_move, counts) &&
           stream_holds(self, &map->stream, &self->to_stream, counts);
}

void drive_modbus_put_stream(struct drive_modbus *self,
                             struct hal_modbus_request *request)
{
    stream_put(self, &self->config.map->stream, &self->to_stream, self->ramp,
               stream_ahead_q32(self),
               stream_speed_q32(self) + self->law.round_up_q32, request);
}

void drive_modbus_put_move(struct drive_modbus *self,
                           struct hal_modbus_request *request)
{
    stream_put(self, &self->config.map->move, &self->to_move, self->move_ramp,
               self->move_pos_q32, self->move_vel_q32, request);
}

/* ---- positions ---- */

/* The first one, or the same one asked for twice, has no speed. */
static void stream_note_speed(struct drive_modbus *self, int64_t delta,
                              int64_t dt_ns)
{
    const int64_t delta_q32 = hal_ratio_scale(&self->to_pos, delta);

    if (dt_ns < 1000 || dt_ns > 1000000000)
        return;
    self->actual_vel_q32 = stream_mul(delta_q32, hal_per_second_q20(dt_ns), 20);
}

static bool stream_can_have(const struct drive_modbus *self, int64_t delta,
                            int64_t dt_ns)
{
    const int64_t most = stream_mul(self->jump_q16, dt_ns, 48);

    return stream_abs(delta) <= most + self->first_step_counts;
}

void drive_modbus_doubt_position(struct drive_modbus *self, const char *why)
{
    if (self->jumped && !drive_modbus_is_down(self)) {
        drive_modbus_say(self, why);
        drive_modbus_lose(self, HAL_DRIVE_FAULT);
    }
    self->jumped = true;
}

void drive_modbus_note_position(struct drive_modbus *self, int64_t counts,
                                int64_t t_ns)
{
    const int32_t delta =
        (int32_t)((uint32_t)counts - (uint32_t)self->actual_counts);
    const int64_t dt_ns = t_ns - self->actual_ns;

    if (self->actual_ns == 0) {
        self->actual_counts = counts;
        self->actual_vel_q32 = 0;
        hal_standstill_begin(&self->standstill, counts, t_ns);
        self->first_ns = t_ns;
    } else if (self->homing == HAL_DRIVE_HOMING_RUNNING) {
        self->actual_counts =
            counts; /* counts from somewhere else at its end */
        self->actual_vel_q32 = 0;
    } else if (!stream_can_have(self, delta, dt_ns)) {
        drive_modbus_doubt_position(self, "its position jumps");
        return;
    } else {
        stream_note_speed(self, delta, dt_ns);
        self->actual_counts += delta;
    }
    hal_standstill_note(&self->standstill, self->actual_counts,
                        self->near_counts, t_ns);
    self->jumped = false;
    self->actual_ns = t_ns;
}
