/* tests/firmware/control/stateful_profile.c - a drive that goes to positions by
 * ramps of its own, as hal/drive.h has it.
 *
 * A go takes the place of the one before when it has come through to the ramps,
 * some ticks late; from there it is a trapezoid from whatever speed there is.
 * Arrived is said some ticks after it stands.  Without torque, or in another
 * mode, a go is over and nothing is resumed.  Some drives cannot halt; bad ones
 * are slower than they were asked to be, stop short, or never begin. */
#include <math.h>

#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

bool stateful_profile_is_on(const struct stateful_profile *profile)
{
    return profile->on || profile->pending != STATEFUL_NO_ORDER;
}

bool stateful_profile_is_open(const struct stateful_profile *profile)
{
    return profile->there &&
           (profile->is_bad || !profile->halts ||
            stateful_profile_is_on(profile) ||
            profile->still <= profile->arrive_ticks + STATEFUL_SAID_TICKS);
}

void stateful_profile_end(struct stateful_profile *profile)
{
    profile->on = profile->halting = profile->arrived = false;
    profile->seen_arrived = false;
    profile->pending = STATEFUL_NO_ORDER;
    profile->arrive = 0;
}

static void profile_order(struct stateful_profile *profile,
                          enum stateful_order order)
{
    profile->pending = order;
    profile->wait = profile->delay_ticks;
    profile->arrived = profile->seen_arrived = false;
    profile->arrive = 0;
}

int stateful_profile_go(struct stateful_axis *axis,
                        const struct hal_drive_go *go)
{
    struct stateful_profile *profile = &axis->profile;
    if (!profile->there)
        return MOTION_E_EMPTY;
    if (go->vel_q32 <= 0 || go->acc_q32 < 0 || go->dec_q32 < 0)
        return MOTION_E_ARG;
    if (axis->state != HAL_DRIVE_ENABLED ||
        axis->mode != HAL_DRIVE_PROFILE_POSITION ||
        axis->next_mode != axis->mode || profile->busy > 0)
        return MOTION_E_STATE;
    profile->next = *go;
    profile->busy = profile->busy_ticks;
    profile->taken = true;
    profile_order(profile, STATEFUL_ORDER_GO);
    return MOTION_OK;
}

int stateful_profile_halt(struct stateful_axis *axis)
{
    struct stateful_profile *profile = &axis->profile;
    if (!profile->there || !profile->halts)
        return MOTION_E_EMPTY;
    if (!stateful_profile_is_on(profile))
        return MOTION_E_STATE;
    profile_order(profile, STATEFUL_ORDER_HALT);
    return MOTION_OK;
}

/* Where it will stand, by its encoder: a bad one stops on the way. */
static int64_t profile_to_q32(const struct stateful_axis *axis)
{
    const struct stateful_profile *profile = &axis->profile;
    const int64_t goal_q32 = profile->next.pos_q32 - axis->slip_q32;
    const int64_t displacement_q32 = goal_q32 - axis->pos_q32;
    if (llabs(displacement_q32) <= profile->short_q32)
        return profile->short_q32 == 0 ? goal_q32 : axis->pos_q32;
    return goal_q32 -
           (displacement_q32 < 0 ? -profile->short_q32 : profile->short_q32);
}

static void profile_take(struct stateful_axis *axis)
{
    struct stateful_profile *profile = &axis->profile;
    if (profile->pending == STATEFUL_NO_ORDER ||
        (profile->wait > 0 && profile->wait-- > 0))
        return;
    profile->halting = profile->pending == STATEFUL_ORDER_HALT;
    if (!profile->halting) {
        profile->go = profile->next;
        profile->arrive = 0; /* where the one before was to end is past */
        profile->go.pos_q32 = profile_to_q32(axis);
        profile->on = true;
    }
    profile->pending = STATEFUL_NO_ORDER;
}

static double toward(double from, double to, double most)
{
    if (fabs(to - from) <= most)
        return to;
    return to > from ? from + most : from - most;
}

/* The speed from which the rest of the way, after a tick at it, is enough to
 * brake on: v dt + v^2 / 2 d = way. */
static double profile_vel(const struct stateful_axis *axis, double dt)
{
    const struct stateful_profile *profile = &axis->profile;
    const double dec = (double)profile->go.dec_q32 / 0x1p32;
    const double displacement =
        stateful_unit(profile->go.pos_q32 - axis->pos_q32);
    const double most = stateful_unit(profile->go.vel_q32) * profile->share;
    const double vel =
        dec * (sqrt(dt * dt + 2 * fabs(displacement) / dec) - dt);
    if (profile->halting)
        return 0;
    return copysign(fmin(vel, most), displacement);
}

/* What is less than a step of its position is not lost: a goal that is a hundred
 * of them away, at 1 %, is some hundredths of one per tick. */
static void profile_move(struct stateful_axis *axis, double dt)
{
    const double move =
        axis->vel * dt * (double)MOTION_FIXED_ONE_Q32 + axis->profile.part;
    axis->profile.part = move - trunc(move);
    axis->pos_q32 += (int64_t)move;
}

static void profile_step(struct stateful_axis *axis, double dt)
{
    struct stateful_profile *profile = &axis->profile;
    const double want = profile_vel(axis, dt);
    const double acc = (double)profile->go.acc_q32 / 0x1p32;
    const double dec = (double)profile->go.dec_q32 / 0x1p32;
    const bool slower = want * axis->vel < 0 || fabs(want) < fabs(axis->vel);
    const int64_t left_q32 = profile->go.pos_q32 - axis->pos_q32;
    axis->vel = toward(axis->vel, want, (slower ? dec : acc) * dt);
    if (!profile->halting && fabs(axis->vel) <= dec * dt &&
        fabs(stateful_unit(left_q32)) <= 2 * dec * dt * dt) {
        axis->pos_q32 += left_q32;
        axis->vel = 0;
        profile->part = 0;
    }
    profile_move(axis, dt);
    if (axis->vel != 0 ||
        (!profile->halting && axis->pos_q32 != profile->go.pos_q32))
        return;
    profile->on = false;
    if (!profile->halting && profile->pending == STATEFUL_NO_ORDER)
        profile->arrive = 1 + profile->arrive_ticks;
    profile->halting = false;
}

void stateful_profile_advance(struct stateful_axis *axis, double dt)
{
    struct stateful_profile *profile = &axis->profile;
    profile->still = stateful_profile_is_on(profile) ? 0 : profile->still + 1;
    if (profile->busy > 0)
        profile->busy--;
    profile_take(axis);
    if (profile->on)
        profile_step(axis, dt);
    else if (profile->halting)
        profile->halting = false;
    if (profile->arrive > 0 && --profile->arrive == 0)
        profile->arrived = true;
}
