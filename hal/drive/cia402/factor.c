/* hal/drive/cia402/factor.c - does the drive count as the config says?
 *
 * Its unit of position, by the factor group: feed (0x6092) user units per
 * revolution of the shaft; without that encoder increments (0x608F) times gear
 * (0x6091).  Velocity (0x6096): makers disagree which way it divides, so both
 * are right.  Many makers ignore all of it, so what is not there is not asked
 * for.  Source: CiA 402-2 7.4. */
#include "hal/drive/cia402/parts.h"

#include "motion/core/fixed.h"

enum factor { FACTOR_ENCODER, FACTOR_GEAR, FACTOR_FEED, FACTOR_VELOCITY };

int drive_cia402_note_factor(struct drive_cia402 *self, uint32_t value)
{
    static const uint16_t index[] = { 0x608F, 0x6091, 0x6092, 0x6096 };
    const struct drive_cia402_step *step = &self->list[self->list_at];

    for (unsigned i = 0; i < 4; i++)
        if (index[i] == step->index)
            self->factor[i][step->sub - 1] = value;
    return MOTION_OK;
}

static bool factor_is_there(const struct drive_cia402 *self, enum factor which)
{
    return self->factor[which][0] != 0 && self->factor[which][1] != 0;
}

/* Counts per revolution of the shaft as num / den; false: not told. */
static bool factor_turn(const struct drive_cia402 *self, uint64_t *num,
                        uint64_t *den)
{
    const bool geared = factor_is_there(self, FACTOR_GEAR);

    if (factor_is_there(self, FACTOR_FEED)) {
        *num = self->factor[FACTOR_FEED][0];
        *den = self->factor[FACTOR_FEED][1];
        return true;
    }
    *num = self->factor[FACTOR_ENCODER][0] *
           (uint64_t)(geared ? self->factor[FACTOR_GEAR][0] : 1);
    *den = self->factor[FACTOR_ENCODER][1] *
           (uint64_t)(geared ? self->factor[FACTOR_GEAR][1] : 1);
    return factor_is_there(self, FACTOR_ENCODER);
}

/* turn_q32 = num / den 2^32 but for its rounding: |turn_q32 den - num 2^32| <=
 * 2 den.  All below 2^127. */
static bool factor_fits(int64_t turn_q32, uint64_t num, uint64_t den)
{
    const struct motion_u128 ours =
        motion_fixed_mul_u64((uint64_t)turn_q32, den);
    const struct motion_u128 its =
        motion_fixed_shl_u128((struct motion_u128){ 0, num }, 32);
    const bool more = motion_fixed_cmp_u128(ours, its) > 0;
    const struct motion_u128 off = more ? motion_fixed_sub_u128(ours, its)
                                        : motion_fixed_sub_u128(its, ours);

    return motion_fixed_cmp_u128(off, motion_fixed_mul_u64(den, 2)) <= 0;
}

static void factor_say(struct hal_text *text, uint64_t num, uint64_t den)
{
    hal_text_dec(text, num > UINT32_MAX ? UINT32_MAX : (uint32_t)num);
    if (den == 1)
        return;
    hal_text_put(text, "/");
    hal_text_dec(text, den > UINT32_MAX ? UINT32_MAX : (uint32_t)den);
}

/* a / b = c / d; all below 2^63. */
static bool factor_is(uint64_t a, uint64_t b, uint64_t c, uint64_t d)
{
    return motion_fixed_cmp_u128(motion_fixed_mul_u64(a, d),
                                 motion_fixed_mul_u64(c, b)) == 0;
}

static bool factor_speeds_fit(const struct drive_cia402 *self)
{
    const uint64_t num = (uint64_t)self->config.vel_num;
    const uint64_t den = (uint64_t)self->config.vel_den;
    const uint32_t *its = self->factor[FACTOR_VELOCITY];

    return !factor_is_there(self, FACTOR_VELOCITY) ||
           factor_is(its[0], its[1], num, den) ||
           factor_is(its[1], its[0], num, den);
}

/* Speeds that do not fit matter to those who stream them; others can do all
 * that needs none. */
static int factor_check_speeds(struct drive_cia402 *self)
{
    const uint32_t *its = self->factor[FACTOR_VELOCITY];
    struct hal_text text;

    self->speeds_fit = factor_speeds_fit(self);
    if (self->speeds_fit ||
        (!self->config.velocity && self->config.stream != DRIVE_CIA402_CSV))
        return MOTION_OK;
    text = drive_cia402_say(self, "0x6096 has speeds at ");
    factor_say(&text, its[0], its[1]);
    hal_text_put(&text, ", we at ");
    factor_say(&text, (uint64_t)self->config.vel_num,
               (uint64_t)self->config.vel_den);
    return MOTION_E_REFUSED;
}

int drive_cia402_check_factors(struct drive_cia402 *self)
{
    uint64_t num, den;
    struct hal_text text;

    if (self->turn_q32 == 0 || !factor_turn(self, &num, &den) ||
        factor_fits(self->turn_q32, num, den))
        return factor_check_speeds(self);
    text = drive_cia402_say(self, "the drive has ");
    factor_say(&text, num, den);
    hal_text_put(&text, " counts per turn, we ");
    hal_text_dec(&text, (uint32_t)(self->turn_q32 >> 32));
    return MOTION_E_REFUSED;
}
