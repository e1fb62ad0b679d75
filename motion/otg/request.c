/* motion/otg/request.c - is what is asked for sound, and possible at all?
 *
 * Limits of the right sign, numbers that have a negative and a place in a
 * track, a goal that a motion within the limits can end in.  All exactly,
 * before anything is solved. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

const char *motion_otg_field_text(enum motion_otg_field field)
{
    static const char *const text[] = {
#define MOTION_OTG_FIELD_TEXT(name, sentence) [name] = sentence,
        MOTION_OTG_FIELD_LIST(MOTION_OTG_FIELD_TEXT)
#undef MOTION_OTG_FIELD_TEXT
    };
    if ((unsigned)field >= sizeof text / sizeof text[0])
        return text[0];
    return text[field];
}

static int otg_limits_are_valid(const struct motion_otg_move *move,
                                enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    bool acc = lim->acc_max_q32 != 0 || lim->acc_min_q32 != 0;
    bool vel = move->mode == MOTION_OTG_POSITION;
    if (vel && lim->vel_max_q32 <= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_VEL_MAX, MOTION_E_ARG);
    if (vel && lim->vel_min_q32 >= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_VEL_MIN, MOTION_E_ARG);
    if (lim->jerk_q32 < 0)
        return otg_refuse(field, MOTION_OTG_FIELD_JERK, MOTION_E_ARG);
    if ((acc || lim->jerk_q32) && lim->acc_max_q32 <= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_ACC_MAX, MOTION_E_ARG);
    if ((acc || lim->jerk_q32) && lim->acc_min_q32 >= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_ACC_MIN, MOTION_E_ARG);
    if (lim->jerk_down_q32 < 0 || (lim->jerk_down_q32 && !lim->jerk_q32))
        return otg_refuse(field, MOTION_OTG_FIELD_JERK_DOWN, MOTION_E_ARG);
    if (move->dur_ns_q12 < 0 || (!vel && move->dur_ns_q12 != 0))
        return otg_refuse(field, MOTION_OTG_FIELD_DURATION, MOTION_E_ARG);
    return MOTION_OK;
}

/* What the formats hold, but has no negative, or no place in a track. */
static int otg_fits_formats(const struct motion_otg_move *move,
                            enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start, *goal = &move->goal;
    if (lim->vel_min_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_VEL_MIN, MOTION_E_RANGE);
    if (lim->acc_min_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_ACC_MIN, MOTION_E_RANGE);
    if (start->vel_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_START_VEL, MOTION_E_RANGE);
    if (motion_fixed_abs(start->acc_q32) > MOTION_TRACK_ACC_MAX_Q32)
        return otg_refuse(field, MOTION_OTG_FIELD_START_ACC, MOTION_E_RANGE);
    if (goal->vel_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_VEL, MOTION_E_RANGE);
    if (motion_fixed_abs(goal->acc_q32) > MOTION_TRACK_ACC_MAX_Q32)
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_RANGE);
    return MOTION_OK;
}

/* The ramp down from `acc` fits below `limit`, or is too long by no more than
 * 2^-40 of the velocities and a unit: numbers that come rounded from elsewhere
 * may tie. */
static bool otg_ramp_fits(int64_t vel_q32, int64_t acc_q32, int64_t jerk_q32,
                          int64_t limit_q32)
{
    uint64_t room = (uint64_t)limit_q32 - (uint64_t)vel_q32;
    uint64_t tie = (motion_fixed_abs(limit_q32) >> 40) + 1;
    return jerk_q32 == 0 || motion_otg_ramp_fits(acc_q32, jerk_q32, room + tie);
}

/* The goal needs room to have been reached: with af < 0 the speed was higher
 * just before. */
static int otg_goal_is_possible(const struct motion_otg_move *move,
                                enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *goal = &move->goal;
    int64_t jerk = otg_closing_jerk(lim);
    if (lim->jerk_q32 &&
        (goal->acc_q32 > lim->acc_max_q32 || goal->acc_q32 < lim->acc_min_q32))
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    if (move->mode == MOTION_OTG_VELOCITY)
        return MOTION_OK;
    if (goal->vel_q32 > lim->vel_max_q32 || goal->vel_q32 < lim->vel_min_q32)
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_VEL, MOTION_E_LIMIT);
    if ((goal->acc_q32 < 0 && !otg_ramp_fits(goal->vel_q32, goal->acc_q32, jerk,
                                             lim->vel_max_q32)) ||
        (goal->acc_q32 > 0 && !otg_ramp_fits(-goal->vel_q32, goal->acc_q32,
                                             jerk, -lim->vel_min_q32)))
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    return MOTION_OK;
}

bool motion_otg_start_fits(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start;
    int64_t vel = start->vel_q32, acc = start->acc_q32;
    if (vel > lim->vel_max_q32 || vel < lim->vel_min_q32)
        return false;
    return acc > 0 ? otg_ramp_fits(vel, acc, lim->jerk_q32, lim->vel_max_q32)
                   : otg_ramp_fits(-vel, acc, lim->jerk_q32, -lim->vel_min_q32);
}

int motion_otg_is_valid(const struct motion_otg_move *move,
                        enum motion_otg_field *field)
{
    *field = MOTION_OTG_FIELD_NONE;
    int err = otg_limits_are_valid(move, field);
    if (err == MOTION_OK)
        err = otg_fits_formats(move, field);
    return err < 0 ? err : otg_goal_is_possible(move, field);
}
