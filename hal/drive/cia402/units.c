/* hal/drive/cia402/units.c - positions, speeds and ramps in the drive's
 * units. */
#include "hal/drive/cia402/parts.h"

#include "motion/core/fixed.h"

static int units_reach(const struct drive_cia402 *self, int64_t pos_q32,
                       int64_t zero_counts, struct hal_drive_reach *reach)
{
    *reach = (struct hal_drive_reach){ .min_counts = self->reach_counts[0],
                                       .max_counts = self->reach_counts[1] };
    return motion_fixed_mulshift(pos_q32, self->to_counts.mantissa,
                                 self->to_counts.shift,
                                 &reach->counts) == MOTION_OK &&
                   motion_fixed_sub(reach->counts, zero_counts,
                                    &reach->counts) == MOTION_OK &&
                   reach->counts >= reach->min_counts &&
                   reach->counts <= reach->max_counts
               ? MOTION_OK
               : MOTION_E_RANGE;
}

int drive_cia402_reach(struct hal_drive *drive, int64_t pos_q32,
                       struct hal_drive_reach *reach)
{
    const struct drive_cia402 *self = drive_cia402_of(drive);

    return units_reach(self, pos_q32, self->zero_counts, reach);
}

static int units_counts(const struct drive_cia402 *self, int64_t pos_q32,
                        int64_t zero_counts, int32_t *counts)
{
    struct hal_drive_reach reach;

    if (units_reach(self, pos_q32, zero_counts, &reach) != MOTION_OK)
        return MOTION_E_RANGE;
    *counts = (int32_t)reach.counts;
    return MOTION_OK;
}

int drive_cia402_counts(const struct drive_cia402 *self, int64_t pos_q32,
                        int32_t *counts)
{
    return units_counts(self, pos_q32, self->zero_counts, counts);
}

int drive_cia402_counts_of(const struct drive_cia402 *self, int64_t pos_q32,
                           int32_t *counts)
{
    return units_counts(self, pos_q32, 0, counts);
}

int drive_cia402_speed(const struct drive_cia402 *self, int64_t speed_q16,
                       int32_t *speed)
{
    const int64_t wide = hal_ratio_scale(&self->to_vel_unit, speed_q16);

    if (wide < INT32_MIN || wide > INT32_MAX)
        return MOTION_E_RANGE;
    *speed = (int32_t)wide;
    return MOTION_OK;
}

/* Rounded to nearest, but a wish for a little is not one for what it has. */
static int units_signless(int64_t wide, uint32_t *value)
{
    const uint64_t size = motion_fixed_abs(wide);

    if (size > UINT32_MAX)
        return MOTION_E_RANGE;
    *value = size > 0 ? (uint32_t)size : 1;
    return MOTION_OK;
}

int drive_cia402_speed_of(const struct drive_cia402 *self, int64_t vel_q32,
                          uint32_t *speed)
{
    *speed = 0;
    if (vel_q32 == 0)
        return MOTION_OK;
    return units_signless(
        hal_ratio_scale(&self->to_vel_unit,
                        hal_ratio_scale(&self->to_speed, vel_q32)),
        speed);
}

int drive_cia402_ramp_of(const struct drive_cia402 *self, int64_t acc_q32,
                         uint32_t *ramp)
{
    *ramp = 0;
    if (acc_q32 == 0)
        return MOTION_OK;
    return units_signless(
        hal_ratio_scale(&self->to_acc_unit,
                        hal_ratio_scale(&self->to_ramp, acc_q32)),
        ramp);
}
